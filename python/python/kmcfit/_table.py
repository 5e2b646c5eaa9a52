"""Tables of a run: CSV with a row of names."""

from __future__ import annotations

from typing import Dict

import numpy as np


def columns(text: str) -> Dict[str, "np.ndarray"]:
    """Columns by name; NaN for an empty field. The decimals of a run give each float64 exactly."""
    head, *rows = text.splitlines()
    names = head.split(",")
    values = np.full((len(rows), len(names)), np.nan)
    for i, row in enumerate(rows):
        for j, field in enumerate(row.split(",")):
            if field:
                try:
                    values[i, j] = float(field)
                except ValueError:
                    pass  # a column of words
    return {name: values[:, j].copy() for j, name in enumerate(names)}
