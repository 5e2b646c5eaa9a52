"""Runs the code of a notebook in this interpreter, cell by cell."""

import ast
import contextlib
import io
import json
import os
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
NAMES = sorted(path.stem for path in FOLDER.glob("*.ipynb"))


def run(name):
    """Cells of a notebook in order: kind, source, and of a code cell what it prints, with the text of its last expression.

    `SystemExit` of a cell (a record that is absent) is passed on.
    """
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text())["cells"]
    names: dict = {"__name__": "__main__"}
    before = Path.cwd()
    os.chdir(FOLDER)
    try:
        for cell in cells:
            source = "".join(cell["source"])
            printed = _execute(source, f"{name}.ipynb", names) if cell["cell_type"] == "code" else ""
            yield cell["cell_type"], source, printed
    finally:
        os.chdir(before)


def _execute(source, name, names):
    """What the code prints; the value of a last expression without a semicolon is shown, as a notebook does."""
    body = ast.parse(source).body
    last = None
    if isinstance(body[-1], ast.Expr) and not source.rstrip().endswith(";"):
        last = ast.Expression(body.pop().value)
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(ast.Module(body, []), name, "exec"), names)
        value = eval(compile(last, name, "eval"), names) if last else None
        if value is not None:
            print(value)
    return out.getvalue()
