"""The code of README and book runs and prints what stands there."""

import importlib.util
import re

import pytest
from conftest import ROOT


@pytest.mark.parametrize("page", ["python/README.md", "docs/python.md", "docs/coming_from.md"])
def test_the_code_of_a_page_runs(page, capsys):
    text = (ROOT / page).read_text()
    blocks = re.findall(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", text, re.S)
    assert blocks
    names: dict = {}
    for code, expected in blocks:
        # Other programs are optional.
        needed = re.match(r"import (lmfit|pypesto)\b", code)
        if needed and importlib.util.find_spec(needed[1]) is None:
            continue
        exec(compile(code, page, "exec"), names)
        printed = capsys.readouterr().out
        if expected:
            assert printed == expected


def test_the_chapter_on_fleets_runs(tmp_path, monkeypatch, capsys):
    pytest.importorskip("pandas")
    text = (ROOT / "docs/fleets.md").read_text()
    blocks = re.findall(r"```python\n(import kmcfit.*?|import numpy.*?)```", text, re.S)
    assert len(blocks) == 2
    monkeypatch.chdir(ROOT)
    names: dict = {}
    for code in blocks:
        exec(compile(code.replace("fleets/", f"{tmp_path}/"), "docs/fleets.md", "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == len(names["table"]) == 12
    assert printed[0].startswith("footbridge_01.csv check ")
    assert (tmp_path / "footbridge/fleet.html").exists()
