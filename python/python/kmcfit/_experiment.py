"""Experiments: records of one system as arrays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional

import numpy as np

from . import _kmcfit, _npz
from ._arrays import column
from ._errors import InputError, did_you_mean, unknown_keyword
from ._functions import lowered, plain

#: Columns of a record that are measured responses.
CHANNELS = ("displacement", "velocity", "acceleration")
#: Columns of a record that are inputs.
INPUTS = ("force", "base_acceleration", "base_displacement")
#: Further keys of an experiment in the model file.
KEYS = (
    "window",
    "time_zero",
    "duplicates",
    "exclude",
    "decimate",
    "band",
    "loss",
    "noise",
    "sensors",
    "functions",
    "validation",
)
_UNITS = {
    "time": "s",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "force": "N",
    "base_acceleration": "m/s^2",
    "base_displacement": "m",
}


class Experiment:
    """A record of a system: times, measured responses and inputs, as one-dimensional arrays of one length.

    Parameters
    ----------
    data : DataFrame or mapping of arrays, optional
        Columns; `time`, `force` and the channels are then names of its columns (default: those of the same name).
    time : array_like, shape (n,)
        Increasing times, s, or dates and times (counted in s from the first one).
    displacement, velocity, acceleration : array_like, shape (n,), optional
        Measured responses, m, m/s, m/s^2 (rad and so on where `units` says so). NaN and masked values are missing samples. A pair
        (times, values) is a channel with a clock of its own; so for inputs, which must cover the times of the responses.
    force : array_like, shape (n,), or dict, optional
        Force on the mass, N; a dict is a waveform, e.g. ``{"shape": "sine", "amplitude": 2.0, "frequency": 1.5}``.
    base_acceleration, base_displacement : array_like, shape (n,), optional
        Motion of the base, m/s^2 or m.
    sample_rate : float, optional
        Hz, in place of `time`.
    sigma : float, dict, "estimate" or None
        Standard deviation of a sample: a number for the only channel, or a map of channels to numbers, arrays or ``"estimate"``.
        Default: estimated. None asks for the integral cost of the paper.
    initial : "estimate", (displacement, velocity) or dict
        Initial state, m and m/s. Default: estimated.
    interpolation : {"linear", "cubic", "hold"}, optional
        Interpolation of the input between samples; for one with a clock of its own cubic by default.
    units : dict, optional
        Units of columns in place of SI, e.g. ``{"acceleration": "g"}``.
    name : str, optional
        Name for reports.
    **keys
        Further keys of an experiment in the model file: `window`, `time_zero`, `duplicates`, `exclude`, `decimate`, `band`, `loss`,
        `noise`, `sensors`, `functions`, `validation`.

    Notes
    -----
    The arrays are copied and never changed. What is not given is chosen from the record as ``kmcfit init`` chooses it: interpolation of the
    input, with `sigma` offsets of sensors and a robust loss where there are outliers, and a window that leaves out a rest before the motion.
    """

    def __init__(
        self,
        data: Any = None,
        *,
        time: Any = None,
        displacement: Any = None,
        velocity: Any = None,
        acceleration: Any = None,
        force: Any = None,
        base_acceleration: Any = None,
        base_displacement: Any = None,
        sample_rate: Optional[float] = None,
        sigma: Any = "estimate",
        initial: Any = "estimate",
        interpolation: Optional[str] = None,
        units: Optional[Mapping[str, str]] = None,
        name: Optional[str] = None,
        **keys: Any,
    ) -> None:
        given = {
            "time": time,
            "displacement": displacement,
            "velocity": velocity,
            "acceleration": acceleration,
            "force": force,
            "base_acceleration": base_acceleration,
            "base_displacement": base_displacement,
        }
        for word in keys:
            if word not in KEYS:
                known = [*given, "sample_rate", "sigma", "initial", "interpolation", "units", "name", *KEYS]
                raise unknown_keyword("Experiment", word, known)
        self._waveform = plain(force) if isinstance(force, dict) else None
        if self._waveform is not None:
            given["force"] = None
        self._columns = _columns(data, given, sample_rate)
        self.name = name
        self._spec = self._specification(sample_rate, sigma, initial, interpolation, units or {}, keys)
        self._content: Optional[bytes] = None

    @property
    def channels(self) -> List[str]:
        """Names of the measured responses."""
        return [name for name in CHANNELS if name in self._columns]

    @property
    def has_force(self) -> bool:
        """True if a force is given."""
        return "force" in self._columns or self._waveform is not None

    def __len__(self) -> int:
        return len(next(iter(self._columns.values())))

    def __repr__(self) -> str:
        columns = ", ".join(name for name in self._columns if not name.startswith(("sigma ", "time ")))
        name = "" if self.name is None else f" {self.name!r}:"
        return f"<Experiment{name} {len(self)} samples of {columns}>"

    def _specification(
        self,
        sample_rate: Optional[float],
        sigma: Any,
        initial: Any,
        interpolation: Optional[str],
        units: Mapping[str, str],
        keys: Dict[str, Any],
    ) -> Dict[str, Any]:
        """The keys of the experiment in the model file, without its file."""
        names = [name for name in _UNITS if name in self._columns]
        for word in units:
            if word not in names:
                raise unknown_keyword("Experiment.units", word, names)
        own = [name for name in names if f"time {name}" in self._columns]
        columns = {name: {"column": name, "time": f"time {name}"} if name in own else name for name in names}
        spec: Dict[str, Any] = {"columns": columns}
        if sample_rate is not None:
            spec["sample_rate"] = plain(sample_rate)
        spec["units"] = {name: units.get(name, _UNITS[name]) for name in names}
        if sigma is not None:
            spec["sigma"] = self._sigma(sigma)
        spec["initial"] = _initial(initial)
        chosen = self._chosen_by_init(spec["units"])
        if any(np.isnan(self._columns[name]).any() for name in INPUTS if name in self._columns):
            # An input acts at all times: the fit refuses its gaps, and names the longest part without.
            chosen.pop("window", None)
        for key in ("window", "duplicates", "loss", "sensors", "force", "base"):
            # The paper's integral has no likelihood for what sensors and losses estimate.
            if key in chosen and (key not in ("loss", "sensors") or "sigma" in spec):
                spec[key] = chosen[key]
        if interpolation is None and any(name in own for name in INPUTS):
            interpolation = "cubic"
        if self._waveform is not None:
            spec["force"] = self._waveform
        elif interpolation is not None:
            has_base = any(name in self._columns for name in INPUTS[1:])
            spec["base" if has_base else "force"] = {"interpolation": interpolation}
        for key, value in keys.items():
            spec[key] = plain(value)
        if "functions" in keys:
            spec["functions"] = {name: lowered(value) for name, value in keys["functions"].items()}
        return {key: value for key, value in spec.items() if value is not None}

    def _chosen_by_init(self, units: Mapping[str, str]) -> Dict[str, Any]:
        """The experiment that ``kmcfit init`` writes for these columns; empty where it refuses them."""
        from ._fit import temporary_folder

        columns = {f"{name} [{units[name]}]": self._columns[name] for name in units if f"time {name}" not in self._columns}
        with temporary_folder() as folder:
            path = Path(folder, "record.npz")
            path.write_bytes(_npz.archive(columns))
            try:
                text = _kmcfit.scaffold([str(path)])
            except InputError:
                # The fit refuses them too, or the record is unusual: nothing is chosen.
                return {}
        chosen: Dict[str, Any] = json.loads(_kmcfit.parse(text, "model.yaml", False))["experiments"][0]
        return chosen

    def _sigma(self, sigma: Any) -> Dict[str, Any]:
        if not isinstance(sigma, dict):
            if not isinstance(sigma, str) and len(self.channels) > 1:
                raise InputError(
                    "a sigma for several channels",
                    "Experiment.sigma",
                    repr(sigma),
                    "a map with a sigma for each of: " + ", ".join(self.channels),
                )
            sigma = dict.fromkeys(self.channels, sigma)
        spec = {}
        for name, value in sigma.items():
            value = plain(value)
            if isinstance(value, list):
                values = column(f"Experiment.sigma[{name!r}]", sigma[name])
                _check_length(f"Experiment.sigma[{name!r}]", values, len(self._columns.get(str(name), values)), "the channel")
                self._columns[f"sigma {name}"] = values
                value = f"sigma {name}"
            spec[str(name)] = value
        return spec

    def _file(self) -> bytes:
        """The columns as an archive of NumPy."""
        if self._content is None:
            self._content = _npz.archive(self._columns)
        return self._content


def _columns(data: Any, given: Dict[str, Any], sample_rate: Optional[float]) -> Dict[str, "np.ndarray"]:
    """The columns as float64."""
    if data is not None:
        given = _chosen(data, given)
    columns = {}
    for name, value in given.items():
        if name != "time" and isinstance(value, tuple) and len(value) == 2 and np.ndim(value[1]) == 1:
            columns[f"time {name}"] = column(f"Experiment.{name}[0]", value[0])
            value = value[1]
        if value is not None:
            columns[name] = column(f"Experiment.{name}", value)
    if "time" not in columns and sample_rate is None:
        raise InputError("no times", "Experiment.time", expected="`time=…` in s, or `sample_rate=…` in Hz")
    if not any(name in columns for name in CHANNELS):
        raise InputError(
            "no measured response",
            "Experiment",
            ", ".join(columns) or "no columns",
            "at least one of: " + ", ".join(CHANNELS),
        )
    shared = [name for name in columns if not name.startswith("time ") and f"time {name}" not in columns]
    for name, values in columns.items():
        first = shared[0] if name in shared else name if name.startswith("time ") else f"time {name}"
        _check_length(f"Experiment.{name}", values, len(columns[first]), f"`{first}`")
    for name, values in columns.items():
        _check_finite(f"Experiment.{name}", values)
        if name.startswith("time"):
            _check_times(f"Experiment.{name}", values)
    return columns


def _check_length(where: str, values: "np.ndarray", expected: int, of: str) -> None:
    if len(values) != expected:
        raise InputError("unequal lengths", where, f"{len(values)} samples", f"{expected} samples, as {of}")


def _check_finite(where: str, values: "np.ndarray") -> None:
    infinite = np.isinf(values)
    if infinite.any():
        first = int(np.argmax(infinite))
        raise InputError("not a finite number", where, f"{values[first]} at index {first}", "a finite number, or NaN where missing")


def _check_times(where: str, times: "np.ndarray") -> None:
    bad = ~np.isfinite(times)
    if bad.any():
        first = int(np.argmax(bad))
        found = f"{times[first]} at index {first}"
        raise InputError("a time is missing", where, found, "a finite time for every sample")
    falls = np.diff(times) < 0
    if falls.any():
        first = int(np.argmax(falls)) + 1
        raise InputError(
            "the times do not increase",
            where,
            f"{times[first]} s at index {first} after {times[first - 1]} s",
            "increasing times",
            "sort the samples, or pass each record as an experiment",
        )


def _chosen(data: Any, given: Dict[str, Any]) -> Dict[str, Any]:
    """The columns of a table under their names."""
    names = [str(name) for name in (data.columns if hasattr(data, "columns") else data)]
    chosen = {}
    for name, value in given.items():
        if value is None and name in names:
            value = name
        if isinstance(value, str):
            if value not in names:
                raise InputError(
                    "no such column",
                    f"Experiment.{name}",
                    f"`{value}`",
                    "one of: " + ", ".join(names),
                    did_you_mean(value, names),
                )
            value = data[value]
        chosen[name] = value
    return chosen


def _initial(initial: Any) -> Any:
    initial = plain(initial)
    if isinstance(initial, list):
        if len(initial) != 2:
            found = f"{len(initial)} values"
            raise InputError("invalid initial state", "Experiment.initial", found, "(displacement, velocity), m and m/s")
        return {"displacement": initial[0], "velocity": initial[1]}
    return initial
