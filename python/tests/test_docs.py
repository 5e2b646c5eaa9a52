"""The code of README and book runs and prints what stands there."""

import re

import pytest
from conftest import ROOT


@pytest.mark.parametrize("page", ["python/README.md", "docs/python.md"])
def test_the_code_of_a_page_runs(page, capsys):
    text = (ROOT / page).read_text()
    blocks = re.findall(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", text, re.S)
    assert blocks
    names: dict = {}
    for code, expected in blocks:
        exec(compile(code, page, "exec"), names)
        printed = capsys.readouterr().out
        if expected:
            assert printed == expected
