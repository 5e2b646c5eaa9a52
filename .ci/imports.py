#!/usr/bin/env python3
"""Finds import cycles between the modules of a Rust crate, at every level of folders, and compares the imports with the map.

Usage: .ci/imports.py FOLDER...          the src folders of crates, e.g. src crates/kmcfit-core/src

Two modules that stand side by side in a folder form a cycle if each imports the other, directly or through
others beside them; what a module imports is what any file below it imports. A module may use what its parent declares,
and a parent its children: the cycles looked for are those among siblings. Tests are left out. For each cycle the
imports that make it are printed; the exit code is 1 if there is one.

In the tables of docs/architecture.md a module may import only modules of its own row and of rows above; every module stands in a
row. Violations are printed and counted too.
"""

import re
import sys
from collections import defaultdict
from pathlib import Path

MAP = Path(__file__).resolve().parent.parent / "docs" / "architecture.md"


def without_noise(text):
    """The text without comments, strings and test modules."""
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(r'b?r(#*)".*?"\1', '""', text, flags=re.S)
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', text, flags=re.S)
    # A module of tests stands at the end of a file.
    return re.split(r"#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+\w+\s*\{", text)[0]


def leaves(tree, prefix=()):
    """The paths of a use tree such as a::{b, c::{self, d}}."""
    tree = tree.strip()
    depth, start, parts = 0, 0, []
    for i, c in enumerate(tree):
        depth += (c == "{") - (c == "}")
        if c == "," and depth == 0:
            parts.append(tree[start:i])
            start = i + 1
    parts.append(tree[start:])
    for part in (p.strip() for p in parts if p.strip()):
        if "{" in part:
            head, inner = part.split("{", 1)
            head = tuple(h for h in head.replace(" ", "").split("::") if h)
            yield from leaves(inner.rsplit("}", 1)[0], prefix + head)
        else:
            part = re.sub(r"\s+as\s+\w+$", "", part).replace(" ", "")
            yield prefix + tuple(p for p in part.split("::") if p and p != "self")


def module_of(path, root):
    parts = list(path.relative_to(root).with_suffix("").parts)
    if parts[-1] in ("mod", "lib", "main"):
        parts.pop()
    return tuple(parts)


def resolve(path, module):
    """An absolute module path from one as written in `module`; None if it leads out of the crate."""
    if path[:1] == ("crate",):
        return path[1:]
    up = 0
    while path[up : up + 1] == ("super",):
        up += 1
    if up:
        return module[: len(module) - up] + path[up:]
    return None


def imports(root):
    """(importing module, imported module, file) for every import inside the crate."""
    files = {}
    for path in sorted(root.rglob("*.rs")):
        if path.name in ("tests.rs", "main.rs") or "tests" in path.parts:
            continue
        files[module_of(path, root)] = path
    found = []
    for module, path in files.items():
        text = without_noise(path.read_text())
        written = [p for use in re.findall(r"\buse\s+([^;]+);", text) for p in leaves(use)]
        inline = re.sub(r"\buse\s+[^;]+;", "", text)
        written += [tuple(p.split("::")) for p in re.findall(r"\b((?:crate|super)(?:::\w+)+)", inline)]
        for target in (resolve(p, module) for p in written):
            while target and target not in files:
                target = target[:-1]
            if target and target != module:
                found.append((module, target, path))
    return found


def cycles(edges):
    """Strongly connected sets of more than one node."""
    index, low, stack, on, order, result = {}, {}, [], set(), [0], []

    def visit(node):
        index[node] = low[node] = order[0]
        order[0] += 1
        stack.append(node)
        on.add(node)
        for other in sorted(edges[node]):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in on:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            part = []
            while True:
                other = stack.pop()
                on.remove(other)
                part.append(other)
                if other == node:
                    break
            if len(part) > 1:
                result.append(sorted(part))

    for node in sorted(edges):
        if node not in index:
            visit(node)
    return result


def rows_of_map(text):
    """For each module of the map, as a path, the number of its row: the first column of every table row."""
    rows = {}
    for number, line in enumerate(re.findall(r"^\| (`[^|]*) \|", text, flags=re.M)):
        for name in re.findall(r"`([\w/.]+)`", line):
            rows.setdefault(tuple(name.removesuffix(".rs").strip("/").split("/")), number)
    return rows


def violations(root, rows):
    """Imports of modules of rows below, and modules without a row."""
    row = lambda module: next((rows[module[:n]] for n in range(len(module), 0, -1) if module[:n] in rows), None)
    found = set()
    for source, target, path in imports(root):
        if source[:1] in ((), ("lib",)):
            continue
        for module in (source, target):
            # `simulate` itself joins its parts, which have rows of their own.
            if row(module) is None and not any(known[: len(module)] == module for known in rows):
                found.add(f"{root}: {'::'.join(module)} has no row in {MAP}")
        if None not in (row(source), row(target)) and row(target) > row(source):
            found.add(f"{root}: {'::'.join(source)} imports {'::'.join(target)}, of a row below ({path})")
    return sorted(found)


def main(roots):
    count, wrong = 0, []
    rows = rows_of_map(MAP.read_text(encoding="utf-8"))
    for root in map(Path, roots):
        wrong += violations(root, rows)
        levels = defaultdict(lambda: defaultdict(lambda: defaultdict(set)))
        for source, target, path in imports(root):
            shared = 0
            while source[shared : shared + 1] == target[shared : shared + 1] and shared < min(len(source), len(target)):
                shared += 1
            if shared < len(source) and shared < len(target):
                a, b = source[shared], target[shared]
                levels[source[:shared]][a][b].add(str(path))
        for folder, edges in sorted(levels.items()):
            graph = defaultdict(set, {a: set(bs) for a, bs in edges.items()})
            for bs in list(graph.values()):
                for b in bs:
                    graph.setdefault(b, set())
            for cycle in cycles(graph):
                count += 1
                name = "::".join(("crate",) + folder)
                print(f"{root}: cycle in {name}: {', '.join(cycle)}")
                for a in cycle:
                    for b in sorted(set(edges.get(a, {})) & set(cycle)):
                        files = sorted(edges[a][b])
                        more = f" and {len(files) - 2} more" if len(files) > 2 else ""
                        print(f"    {a} -> {b}   ({', '.join(files[:2])}{more})")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    print(f"{count} cycles; {len(wrong)} imports or modules against the map")
    return 1 if count or wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or ["src"]))
