"""Archives of float64 arrays in memory: those of ``numpy.savez``, with the same bytes each time."""

from __future__ import annotations

import io
import zipfile
from typing import Mapping

import numpy as np


def archive(columns: Mapping[str, "np.ndarray"]) -> bytes:
    """A zip archive with an uncompressed ``.npy`` of each one-dimensional float64 array."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as whole:
        for name, values in columns.items():
            with whole.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, np.ascontiguousarray(values, dtype="<f8"), version=(1, 0))
    return content.getvalue()
