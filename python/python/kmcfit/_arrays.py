"""Columns of numbers from arrays, Series and lists."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._errors import InputError

_EXPECTED = "a one-dimensional array of real numbers"


def column(where: str, value: Any) -> "np.ndarray":
    """The numbers of `value` as float64, NaN for missing ones. `value` is not changed.

    Parameters
    ----------
    where : str
        Place for messages.
    value : array_like
        One-dimensional; integers and floats of any size, masked arrays, Series of pandas.
    """
    if isinstance(value, str) or value is None:
        raise InputError("not an array", where, repr(value), _EXPECTED)
    if hasattr(value, "to_numpy"):
        value = _of_pandas(where, value)
    mask = np.ma.getmask(value)
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InputError("not an array of numbers", where, str(error), _EXPECTED) from None
    if array.dtype.kind == "M":
        return _seconds(where, array)
    if array.ndim != 1:
        found = f"an array of shape {array.shape}"
        raise InputError("wrong number of dimensions", where, found, _EXPECTED, _flat_hint(array))
    if array.size == 0:
        raise InputError("no samples", where, "0 samples", "samples of a measured record")
    if array.dtype.kind not in "iuf":
        raise InputError("not real numbers", where, f"dtype {array.dtype}", _EXPECTED, _type_hint(array.dtype.kind))
    numbers = array.astype(np.float64)
    if mask is not np.ma.nomask:
        numbers[mask] = np.nan
    return numbers


def _of_pandas(where: str, value: Any) -> Any:
    """A Series or Index as an array: missing values become NaN, times with a zone UTC."""
    kind = getattr(value.dtype, "kind", "O")
    if kind == "M" and getattr(value.dtype, "tz", None) is not None:
        naive = value.dt if hasattr(value, "dt") else value
        return naive.tz_convert(None).to_numpy()
    if kind in "iuf" and not isinstance(value.dtype, np.dtype):
        return value.to_numpy(dtype=np.float64, na_value=np.nan)
    return value.to_numpy()


def _seconds(where: str, times: "np.ndarray") -> "np.ndarray":
    """Dates and times as seconds from the first one."""
    if times.ndim != 1 or times.size == 0:
        raise InputError("no samples", where, f"an array of shape {times.shape}", _EXPECTED)
    if np.isnat(times).any():
        first = int(np.argmax(np.isnat(times)))
        raise InputError("a time is missing", where, f"NaT at index {first}", "a time for every sample")
    nanoseconds = (times - times[0]).astype("timedelta64[ns]").astype(np.int64)
    return nanoseconds / 1e9


def _flat_hint(array: "np.ndarray") -> "str | None":
    if array.ndim == 2 and 1 in array.shape:
        return "pass `values.ravel()`"
    return "pass one column, as in `values[:, 0]`" if array.ndim == 2 else None


def _type_hint(kind: str) -> "str | None":
    return {
        "c": "pass `values.real`",
        "O": "convert it: `values.astype(float)`; None and texts are not numbers",
        "b": "convert it: `values.astype(float)`",
        "U": "convert it: `values.astype(float)`",
    }.get(kind)
