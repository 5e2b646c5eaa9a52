"""Comparison of fits."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Mapping

from . import _kmcfit
from ._errors import InputError
from ._fit import Fit, temporary_folder
from ._page import first_screen


class Comparison:
    """A comparison of fits: model selection, as ``kmcfit compare`` computes it.

    Attributes
    ----------
    result : dict
        The document of the comparison.
    """

    def __init__(self, text: str, document: str, page: str) -> None:
        self._text = text
        self._page = page
        self.result: Dict[str, Any] = json.loads(document)

    @property
    def runs(self) -> List[Dict[str, Any]]:
        """Measures of each fit: cost, AIC, BIC, differences."""
        return self.result["runs"]

    @property
    def html(self) -> str:
        """The page of the comparison, one HTML file without external resources."""
        return self._page

    def __repr__(self) -> str:
        return self._text

    def _repr_html_(self) -> str:
        return first_screen(self._page)

    def to_pandas(self) -> Any:
        """The measures as a DataFrame of pandas, one row for each fit."""
        import pandas  # type: ignore[import-untyped,unused-ignore]

        return pandas.json_normalize(self.runs).set_index("name")


def compare(fits: Mapping[str, Fit]) -> Comparison:
    """Compares fits, of the same records for a model selection.

    Parameters
    ----------
    fits : mapping of str to Fit
        At least two fits by name.
    """
    if len(fits) < 2:
        raise InputError("too few fits", "compare", f"{len(fits)}", "two or more, as in `compare({'a': fit_a, 'b': fit_b})`")
    with temporary_folder() as folder:
        runs = []
        for i, (name, fit) in enumerate(fits.items()):
            run = os.path.join(folder, str(i))
            fit._write(run)
            runs.append((str(name), run))
        return Comparison(*_kmcfit.compare(runs))
