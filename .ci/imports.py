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
import tempfile
from collections import defaultdict
from pathlib import Path

# Cycles that stand until their part is rebuilt; one that has gone is an error too, so that it cannot come back.
ALLOWED = {
    "crate::report: fit_figures, page, run, tables",
}

MAP = Path(__file__).resolve().parent.parent / "docs" / "architecture.md"


def without_noise(text):
    """The text without comments, strings and test modules."""
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(r'b?r(#*)".*?"\1', '""', text, flags=re.S)
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', text, flags=re.S)
    # A module of tests stands at the end of a file.
    return re.split(r"#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+\w+\s*\{", text)[0]


def leaves(tree, prefix=()):
    """The paths of a use tree such as a::{b, c::{self, d}}, each with the name that it has in the importing module."""
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
            part, _, alias = re.sub(r"\s+", " ", part).partition(" as ")
            path = prefix + tuple(p for p in part.replace(" ", "").split("::") if p and p != "self")
            yield path, alias.strip() or path[-1]


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


def sources(root):
    """The text of each module without tests, comments and strings, and its file."""
    found = {}
    for path in sorted(root.rglob("*.rs")):
        if path.name not in ("tests.rs", "main.rs") and "tests" not in path.parts:
            found[module_of(path, root)] = (without_noise(path.read_text()), path)
    return found


def absolute(path, module, files):
    """As `resolve`; a path that begins with a child of the module leads there."""
    found = resolve(path, module)
    return module + path if found is None and module + path[:1] in files else found


def exports(files):
    """What each module offers from others: (module, name) to a path; the name `*` for all that a path has."""
    found = defaultdict(list)
    for module, (text, _) in files.items():
        for tree in re.findall(r"\bpub(?:\([^)]*\))?\s+use\s+([^;]+);", text):
            for path, name in leaves(tree):
                target = absolute(path, module, files)
                if target:
                    found[module, name].append(target)
    return found


def followed(target, files, offered, seen=()):
    """The module that defines what a path names, behind all re-exports."""
    module = target
    while module and module not in files:
        module = module[:-1]
    rest = target[len(module) :]
    if rest and target not in seen:
        for path in offered.get((module, rest[0]), []):
            return followed(path + rest[1:], files, offered, (*seen, target))
        for path in offered.get((module, "*"), []):
            inner = path[:-1]
            text = files.get(inner, ("",))[0]
            if re.search(r"\b(?:fn|struct|enum|trait|type|const|static|mod)\s+" + rest[0] + r"\b", text):
                return inner
    return module


def imports(root):
    """(importing module, imported module, file) for every import inside the crate, through re-exports too."""
    files = sources(root)
    offered = exports(files)
    found = []
    for module, (text, path) in files.items():
        written = [p for use in re.findall(r"\buse\s+([^;]+);", text) for p, _ in leaves(use)]
        inline = re.sub(r"\buse\s+[^;]+;", "", text)
        written += [tuple(p.split("::")) for p in re.findall(r"\b((?:crate|super)(?:::\w+)+)", inline)]
        for target in (absolute(p, module, files) for p in written):
            target = followed(target, files, offered) if target else None
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
            # A module may join parts that have rows of their own.
            if row(module) is None and not any(known[: len(module)] == module for known in rows):
                found.add(f"{root}: {'::'.join(module)} has no row in {MAP}")
        if None not in (row(source), row(target)) and row(target) > row(source):
            found.add(f"{root}: {'::'.join(source)} imports {'::'.join(target)}, of a row below ({path})")
    return sorted(found)


def found_cycles(root):
    """Folder, imports between its modules, and the modules of each cycle."""
    levels = defaultdict(lambda: defaultdict(lambda: defaultdict(set)))
    for source, target, path in imports(root):
        shared = 0
        while source[shared : shared + 1] == target[shared : shared + 1] and shared < min(len(source), len(target)):
            shared += 1
        if shared < len(source) and shared < len(target):
            levels[source[:shared]][source[shared]][target[shared]].add(str(path))
    found = []
    for folder, edges in sorted(levels.items()):
        graph = defaultdict(set, {a: set(bs) for a, bs in edges.items()})
        for bs in list(graph.values()):
            for b in bs:
                graph.setdefault(b, set())
        found += [(folder, edges, cycle) for cycle in cycles(graph)]
    return found


def main(roots):
    self_test()
    count, wrong, allowed = 0, [], set(ALLOWED)
    rows = rows_of_map(MAP.read_text(encoding="utf-8"))
    for root in map(Path, roots):
        wrong += violations(root, rows)
        for folder, edges, cycle in found_cycles(root):
            name = "::".join(("crate",) + folder) + ": " + ", ".join(cycle)
            if name in allowed:
                allowed.remove(name)
                continue
            count += 1
            print(f"{root}: cycle in {name}")
            for a in cycle:
                for b in sorted(set(edges.get(a, {})) & set(cycle)):
                    files = sorted(edges[a][b])
                    more = f" and {len(files) - 2} more" if len(files) > 2 else ""
                    print(f"    {a} -> {b}   ({', '.join(files[:2])}{more})")
    wrong += [f"the allowed cycle in {name} has gone: strike it" for name in sorted(allowed)]
    print(*wrong, sep="\n", end="\n" if wrong else "")
    print(f"{count} cycles; {len(wrong)} imports or modules against the map")
    return 1 if count or wrong else 0


def self_test():
    """Small trees with each kind of cycle, and one without."""
    trees = {
        "direct": ({"a.rs": "use crate::b::B;", "b.rs": "use crate::a::A;"}, True),
        "re-export": ({"m/mod.rs": "mod a;\nmod b;\npub use a::A;", "m/a.rs": "use super::b::B;", "m/b.rs": "use super::A;"}, True),
        "renamed": ({"m/mod.rs": "mod a;\nmod b;\npub(crate) use a::A as C;", "m/a.rs": "use super::b;", "m/b.rs": "use crate::m::C;"}, True),
        "glob": ({"m/mod.rs": "mod a;\nmod b;\npub use a::*;", "m/a.rs": "use super::b;\npub struct A;", "m/b.rs": "use super::A;"}, True),
        "three": ({"a.rs": "use crate::b;", "b.rs": "use crate::c::{self, C};", "c.rs": "fn f() { crate::a::g() }"}, True),
        "none": ({"m/mod.rs": "mod a;\nmod b;\npub use a::A;", "m/a.rs": "", "m/b.rs": "use super::A;"}, False),
    }
    for name, (files, expected) in trees.items():
        with tempfile.TemporaryDirectory() as folder:
            for path, text in {"lib.rs": "", **files}.items():
                (Path(folder) / path).parent.mkdir(exist_ok=True)
                (Path(folder) / path).write_text(text)
            assert bool(found_cycles(Path(folder))) == expected, name


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or ["src"]))
