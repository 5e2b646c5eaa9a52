"""Records of a fleet: what a user may give for one, and its form for the extension module."""

from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple

import numpy as np

from . import _npz, _yaml
from ._arrays import column
from ._errors import InputError, unknown_keyword
from ._experiment import CHANNELS, INPUTS, KEYS, Experiment
from ._functions import plain

#: Known coefficients of a record.
KNOWN = ("mass", "damping", "stiffness")
_COLUMNS = ("time", *CHANNELS, *INPUTS)
#: Keywords of an experiment that are no columns.
_SETTINGS = ("sample_rate", "sigma", "initial", "interpolation", "units", *(key for key in KEYS if key not in ("window", "functions")))
#: First names of keys of the model: a key with a point is changed in the model.
_PATHS = ("experiments", "functions", "fit", "grid", "constraints", "parameters")
_EXPECTED = "a path, an `Experiment`, arrays, a pair (name, data), or a dict with `record` and `file`, `data` or arrays"

#: Name, path, content, changed keys, other columns.
Given = Tuple[str, str, Optional[bytes], List[str], List[str]]


class Item(NamedTuple):
    """A record as given, with a name."""

    name: str
    #: The file; for other data a name whose ending states their format.
    path: str
    #: None for a file, its bytes, an `Experiment`, or columns with settings of the experiment.
    data: Any
    overrides: List[str]
    columns: List[str]


class Source(NamedTuple):
    """The model of a fleet for its tasks."""

    text: str
    path: str
    overrides: List[str]
    #: True if the model states the experiment, with its columns.
    has_experiment: bool
    #: True if a record with a force determines the mass.
    chooses_mass: bool


def item(given: Any, number: int, columns: Optional[List[str]] = None) -> Item:
    """The record `given`, the one with this number from 1; `columns` are the names of other keys that are kept."""
    if isinstance(given, Item):
        return given
    if isinstance(given, (str, os.PathLike)):
        return _of_data(os.fspath(given), given)
    if isinstance(given, tuple) and len(given) == 2:
        return _of_data(str(given[0]), given[1])
    if isinstance(given, Experiment):
        return _of_data(given.name or f"record {number}", given)
    if isinstance(given, Mapping):
        return _of_dict(dict(given), number, columns or [])
    if hasattr(given, "columns"):
        return _of_data(f"record {number}", given)
    raise InputError("not a record", f"records[{number - 1}]", type(given).__name__, _EXPECTED)


def other_columns(given: Any) -> List[str]:
    """Names of the keys of a record that are kept beside its results."""
    if not isinstance(given, Mapping):
        return []
    used = ("record", "file", "data", "window", "start", "end", *KNOWN, *_COLUMNS, *_SETTINGS)
    return [str(key) for key in given if key not in used and "." not in str(key)]


def _of_data(name: str, data: Any, settings: Optional[Dict[str, Any]] = None) -> Item:
    # Names of files need not be text.
    name = name.encode(errors="backslashreplace").decode()
    if isinstance(data, (str, os.PathLike)):
        return Item(name, os.fspath(data), None, [], [])
    if isinstance(data, (bytes, bytearray)):
        return Item(name, name, bytes(data), [], [])
    path = f"{name}.npz"
    if isinstance(data, Experiment):
        return Item(name, path, data, [], [])
    if isinstance(data, Mapping) or hasattr(data, "columns"):
        return Item(name, path, (data, settings or {}), [], [])
    raise InputError("not a record", name, type(data).__name__, _EXPECTED)


def _of_dict(given: Dict[str, Any], number: int, columns: List[str]) -> Item:
    where = f"records[{number - 1}]"
    name = given.get("record", given.get("file"))
    name = f"record {number}" if name is None else str(os.fspath(name) if isinstance(name, os.PathLike) else name)
    settings = {key: given[key] for key in _SETTINGS if key in given}
    arrays = {key: given[key] for key in _COLUMNS if key in given}
    data = [given[key] for key in ("data", "file") if given.get(key) is not None] or ([arrays] if arrays else [])
    if len(data) != 1 or (arrays and data[0] is not arrays):
        found = ", ".join(f"`{key}`" for key in given) or "no keys"
        raise InputError("no data, or several", where, found, "`file`, `data`, or arrays such as `time` and `displacement`")
    if settings and not arrays:
        # A file and a finished experiment have their settings already; here they change those of the model.
        given = {**given, **{f"experiments.0.{key}": value for key, value in settings.items()}}
    found_item = _of_data(name, data[0], settings if arrays else {})
    overrides = []
    for key in KNOWN:
        if _is_given(given.get(key)):
            overrides.append(f"functions.{key}={{fixed: {_number(f'{where}[{key!r}]', given[key])!r}}}")
    window = given.get("window", (given.get("start"), given.get("end")))
    ends = window if isinstance(window, Mapping) else dict(zip(("min", "max"), window))
    ends = {key: _number(f"{where}['window']", value) for key, value in ends.items() if _is_given(value)}
    if ends:
        overrides.append(f"experiments.0.window={_yaml.flow(ends)}")
    for key, value in given.items():
        if "." in str(key):
            first = str(key).split(".")[0]
            if first not in _PATHS:
                raise unknown_keyword(where, first, _PATHS)
            overrides.append(f"{key}={_yaml.flow(plain(value))}")
    cells = [str(plain(given[key])) if _is_given(given.get(key)) else "" for key in columns]
    return found_item._replace(overrides=overrides, columns=cells)


def _is_given(value: Any) -> bool:
    return value is not None and not (isinstance(value, float) and value != value)


def _number(where: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError("not a number", where, repr(value), "a number") from None
    if not np.isfinite(number):
        raise InputError("not a number", where, repr(value), "a number")
    return number


def lowered(record: Item, source: Source) -> Given:
    """The record for a fit, with its data."""
    name, path, data, overrides, columns = record
    if data is None or isinstance(data, bytes):
        if not source.has_experiment:
            raise InputError(
                "the model has no experiment",
                name,
                "a file",
                "a model of a file, whose experiment states the columns",
                "`km.init(path)` makes one; or give arrays",
            )
        return name, path, data, overrides, columns
    if isinstance(data, tuple):
        table, settings = data
        if source.has_experiment:
            keys = table.columns if hasattr(table, "columns") else table
            content = _npz.archive({str(key): column(f"{name}.{key}", table[key]) for key in keys})
            changes = [f"experiments.0.{key}={_yaml.flow(plain(value))}" for key, value in settings.items()]
            return name, path, content, changes + overrides, columns
        data = Experiment(table, **settings)
    changes = [f"experiments.0={_yaml.flow({'data': 'record.npz', **data._spec})}"]
    if source.chooses_mass and data.has_force:
        changes.append("functions.mass={basis: constant}")
    return name, path, data._file(), changes + overrides, columns
