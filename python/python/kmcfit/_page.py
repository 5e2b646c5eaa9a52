"""Pages of runs in notebooks, and the files of a run."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Dict, Mapping, Union

from ._errors import InputError

#: Rules for the first screen of a page. All are within its own element, and set what the themes of notebooks change.
_STYLE = """
.kmcfit-page { color-scheme: light; background: #fff; color: #1c1f23; padding: .7rem 1rem; max-width: 64rem; text-align: left;
  font: 14px/1.45 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
.kmcfit-page * { color: inherit; background: none; box-sizing: border-box; }
.kmcfit-page h1 { font-size: 1.25em; line-height: 1.25; margin: 0 0 .3em; font-weight: 600; }
.kmcfit-page p, .kmcfit-page li, .kmcfit-page table, .kmcfit-page figcaption { font: inherit; }
.kmcfit-page p { margin: .3em 0; }
.kmcfit-page .soft, .kmcfit-page figcaption span { color: #5b636d; }
.kmcfit-page .state { border: 1px solid; border-radius: 1em; padding: 0 .6em; font-weight: 600; }
.kmcfit-page .good { color: #12703f; } .kmcfit-page .warn { color: #8f4a00; } .kmcfit-page .bad { color: #b3261e; }
.kmcfit-page .first > div { margin: .6em 0; }
.kmcfit-page .scroll { overflow-x: auto; }
.kmcfit-page table { border-collapse: collapse; margin: 0; font-variant-numeric: tabular-nums; }
.kmcfit-page th, .kmcfit-page td { padding: .2em .8em .2em 0; text-align: left; vertical-align: top; border: 0;
  border-bottom: 1px solid #d9dde2; white-space: normal; }
.kmcfit-page tbody th { font-weight: 400; }
.kmcfit-page figure { margin: .6em 0 0; }
.kmcfit-page svg { display: block; width: 100%; height: auto; max-width: 760px; }
"""
#: Anchors and names of elements, of which a notebook with several pages would have several.
_NAMES = re.compile(r'(?<=<a) href="#[^"]*"|(?<=<figure class="chart") id="[^"]*"| tabindex="[^"]*"')


class Drawing:
    """A figure as SVG, which notebooks show."""

    def __init__(self, svg: str) -> None:
        #: The text of the drawing.
        self.svg = svg

    def _repr_html_(self) -> str:
        return f'<div style="background: #fff">{self.svg}</div>'


def first_screen(page: str) -> str:
    """What stands above the contents of a page: title, verdict, answer and chart, with its own style and without scripts."""
    begin, end = page.find("<h1>"), page.find('<div class="sections">')
    # Texts of models and records are escaped in the page: no angle bracket of theirs is found here.
    shown = _NAMES.sub("", page[begin:end])
    return f'<div class="kmcfit-page">\n<style>{_STYLE}</style>\n{shown}</div>'


def read_files(folder: str) -> Dict[str, bytes]:
    """The files of a folder by their relative names."""
    root = Path(folder)
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in sorted(root.rglob("*")) if path.is_file()}


def write_files(folder: Union[str, "os.PathLike[str]"], files: Mapping[str, bytes]) -> None:
    """Writes files into a new or empty folder."""
    target = Path(folder)
    if target.exists() and any(target.iterdir()):
        raise InputError("the folder is not empty", str(target), expected="a new folder")
    for name, content in files.items():
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
