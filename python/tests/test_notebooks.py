"""The notebooks run; their cells assert their numbers."""

import importlib.util

import notebook
import pytest
from conftest import ROOT

import kmcfit as km


@pytest.mark.parametrize("name", notebook.NAMES)
def test_a_notebook_runs(name, monkeypatch):
    if name == "posterior":
        pytest.importorskip("blackjax")
    if importlib.util.find_spec("matplotlib") is None:
        monkeypatch.setattr(km.Fit, "plot", lambda self, quantities=None: None)
    else:
        monkeypatch.setenv("MPLBACKEND", "Agg")
    try:
        cells = list(notebook.run(name))
    except SystemExit as absent:
        pytest.skip(str(absent))
    # The page of the book has the same code.
    page = (ROOT / f"docs/notebooks/{name}.md").read_text()
    for kind, source, _ in cells:
        assert (f"```python\n{source}\n```" if kind == "code" else source.replace("](../../docs/", "](../")) in page
