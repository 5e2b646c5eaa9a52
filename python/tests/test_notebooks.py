"""The notebooks run; their cells assert their numbers."""

import notebook
import pytest


@pytest.mark.parametrize("name", notebook.NAMES)
def test_a_notebook_runs(name):
    assert any(kind == "code" for kind, *_ in notebook.run(name))
