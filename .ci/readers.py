#!/usr/bin/env python3
"""Runs the readers of docs/results.md, in NumPy and where GNU Octave is installed in MATLAB's language, on runs of shipped models: the
intervals that they print are those of result.json.

Usage: .ci/readers.py KMCFIT
"""
import contextlib
import io
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

MODELS = ["accelerometer", "hammer-and-shaker", "roll-decay", "spline"]


def readers(root):
    text = (root / "docs" / "results.md").read_text()
    python = re.search(r"```python\n(.*?)```", text, re.S).group(1)
    lines = [line for line in python.splitlines() if line.strip()]
    assert len(lines) <= 20, len(lines)
    return python, re.search(r"```matlab\n(.*?)```", text, re.S).group(1)


def printed(code, run):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(code.replace("runs/accelerometer", str(run)), {})
    return out.getvalue()


def octave(code, run):
    script = run / "reader.m"
    script.write_text(code.replace("runs/accelerometer", str(run)))
    found = subprocess.run(["octave-cli", "--norc", script], capture_output=True, text=True)
    return found.stdout


def check(text, run, width):
    """Compares the lines `name value low to high` with result.json; the number of intervals."""
    rows = {line[:width].strip(): line[width:].split() for line in text.splitlines()}
    result = json.loads((run / "result.json").read_text())
    count = 0
    for name, estimate in result["estimates"].items():
        if estimate["ci95"] is None:
            continue
        found = [float(rows[name][1]), float(rows[name][3])]
        for end, expected in zip(found, estimate["ci95"]):
            # The readers print nine digits.
            size = max(map(abs, estimate["ci95"]))
            assert abs(end - expected) < 2e-8 * size, (name, found, estimate)
        count += 1
    return count


def fit(program, model, run, *options):
    command = [program, "fit", model, "--out", run, "--no-report", "--json", *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def main(program):
    root = pathlib.Path(__file__).resolve().parent.parent
    python, matlab = readers(root)
    checked, by_octave = 0, 0
    for model in MODELS:
        with tempfile.TemporaryDirectory() as folder:
            run = pathlib.Path(folder) / "run"
            fit(program, root / "models" / f"{model}.yaml", run)
            checked += check(printed(python, run), run, 44)
            if shutil.which("octave-cli"):
                by_octave += check(octave(matlab, run), run, 24)
    assert checked >= 12, checked
    print(f"{checked} intervals computed again by NumPy, {by_octave} by Octave")


if __name__ == "__main__":
    main(str(pathlib.Path(sys.argv[1]).resolve()))
