#!/usr/bin/env python3
"""Runs the NumPy reader of docs/results.md on runs of shipped models: the intervals that it prints are those of result.json.

Usage: .ci/readers.py KMCFIT
"""
import contextlib
import io
import json
import pathlib
import re
import subprocess
import sys
import tempfile

MODELS = ["accelerometer", "hammer-and-shaker", "roll-decay", "spline"]


def reader(root):
    text = (root / "docs" / "results.md").read_text()
    block = re.search(r"```python\n(.*?)```", text, re.S).group(1)
    lines = [line for line in block.splitlines() if line.strip()]
    assert len(lines) <= 20, len(lines)
    return block


def main(program):
    root = pathlib.Path(__file__).resolve().parent.parent
    code = reader(root)
    checked = 0
    for model in MODELS:
        with tempfile.TemporaryDirectory() as folder:
            run = pathlib.Path(folder) / "run"
            path = root / "models" / f"{model}.yaml"
            subprocess.run([program, "fit", path, "--out", run, "--no-report", "--json"], check=True, stdout=subprocess.DEVNULL)
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(code.replace("runs/accelerometer", str(run)), {})
            result = json.loads((run / "result.json").read_text())
        rows = {line[:44].strip(): line[44:].split() for line in printed.getvalue().splitlines()}
        for name, estimate in result["estimates"].items():
            if estimate["ci95"] is None:
                continue
            found = [float(rows[name][1]), float(rows[name][3])]
            for end, expected in zip(found, estimate["ci95"]):
                # The reader prints nine digits.
                size = max(map(abs, estimate["ci95"]))
                assert abs(end - expected) < 2e-8 * size, (model, name, found, estimate)
            checked += 1
    assert checked >= 12, checked
    print(f"{checked} intervals computed again by NumPy")


if __name__ == "__main__":
    main(str(pathlib.Path(sys.argv[1]).resolve()))
