"""Records of loggers whose formats are read by other libraries."""

from __future__ import annotations

import importlib
import os
import warnings
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from . import _kmcfit
from ._errors import InputError, did_you_mean
from ._experiment import CHANNELS, INPUTS, Experiment

#: Clocks that differ by less than this part of a step are one: times printed from k/1000 and k*0.001 differ by rounding alone,
#: and a hundredth of a step is a phase of 0.03 rad at most at half the sampling rate.
_SAME_CLOCK = 0.01


class Channel(NamedTuple):
    """A signal of a file."""

    name: str
    #: As the file states it; empty where it states none.
    unit: str
    #: s, on the clock of the file; None where the file has no times.
    time: Optional["np.ndarray"]
    #: NaN for missing samples.
    values: "np.ndarray"


def read_record(path: "str | os.PathLike[str]", **keys: Any) -> Experiment:
    """The record of a logger's file as an :class:`Experiment`, with its units and times, read by the library for its format.

    Parameters
    ----------
    path : path
        File of asammdf (``.mf4``, ``.mf3``, ``.mdf``), pyedflib (``.edf``, ``.bdf``), ObsPy (``.mseed``, ``.sac``), idelib (``.ide``), tdm_loader
        (``.tdm``), dwdatareader (``.dxd``, ``.d7d``, ``.dxz``) or scikit-digital-health (``.cwa``). ``pip install kmcfit[loggers]`` installs them.
    displacement, velocity, acceleration, force, base_acceleration, base_displacement : str, optional
        Names of channels. Where none is given, a channel is chosen by its unit, or by its name if it has none, if it is the only one of its quantity.
    sample_rate : float, optional
        Hz, for a file without times.
    **keys
        Further arguments of :class:`Experiment`; `units` where the file states none.

    Returns
    -------
    Experiment
        The times start at the first sample of the responses. Channels with clocks of their own keep them, and responses outside the
        times of the inputs are left out. What a library or a file changes is said by a warning.

    Raises
    ------
    InputError
        For an unknown format, a library that is not installed, a file that the library refuses, or a choice that is not unique.
    """
    name = os.fspath(path)
    suffix = Path(name).suffix.lower()
    if suffix not in _READERS:
        known = ", ".join(_READERS)
        raise InputError("not a format of a logger's library", name, f"`{suffix}`", known, "`kmcfit.init(path)` reads tables, UFF, TDMS, MAT, HDF5")
    module, package, read = _READERS[suffix]
    try:
        library = importlib.import_module(module)
    except ImportError:
        raise InputError("a library is not installed", name, package, hint=f"pip install {package}") from None
    if not os.path.isfile(name):
        raise InputError("no such file", name)
    try:
        channels = list(read(library, name))
    except InputError:
        raise
    except Exception as error:
        raise InputError("the file cannot be read", name, f"{package}: {type(error).__name__}: {error}") from error
    chosen = _chosen(name, channels, {key: keys.pop(key) for key in (*CHANNELS, *INPUTS) if key in keys})
    return _experiment(name, chosen, keys)


def _chosen(path: str, channels: List[Channel], given: Dict[str, Any]) -> Dict[str, Channel]:
    """The channels by their role: those named, else the only ones of their quantities."""
    listed = ", ".join(f"`{channel.name}` [{channel.unit}]" if channel.unit else f"`{channel.name}`" for channel in channels) or "none"
    if given:
        by_name = {channel.name: channel for channel in channels}
        for role, name in given.items():
            if name not in by_name:
                raise InputError("no such channel", f"{path}: {role}", f"`{name}`", listed, did_you_mean(str(name), by_name))
        return {role: by_name[name] for role, name in given.items()}
    chosen: Dict[str, Channel] = {}
    for channel in channels:
        quantity = _kmcfit.quantity(channel.name, channel.unit)
        if quantity not in (*CHANNELS, "force"):
            continue
        if quantity in chosen:
            hint = f"name one: `{quantity}=\"{channel.name}\"`"
            raise InputError(f"several channels of {quantity}", path, listed, "names of the channels to use", hint)
        chosen[quantity] = channel
    if not any(role in chosen for role in CHANNELS):
        hint = f"name one, with its unit: `acceleration=\"{channels[0].name}\", units={{\"acceleration\": \"g\"}}`" if channels else None
        raise InputError("no channel is a motion by its unit or name", path, listed, hint=hint)
    return chosen


def _experiment(path: str, chosen: Dict[str, Channel], keys: Dict[str, Any]) -> Experiment:
    rate = keys.pop("sample_rate", None)
    units = {role: channel.unit for role, channel in chosen.items() if channel.unit}
    units.update(keys.pop("units", None) or {})
    for role, channel in chosen.items():
        if role not in units:
            warnings.warn(f"{path}: no unit is stated for `{channel.name}`; SI is assumed (`units={{\"{role}\": …}}` states it)", stacklevel=3)
    signals = {role: (_times(path, channel, rate), channel.values) for role, channel in chosen.items()}
    responses = [role for role in CHANNELS if role in signals]
    inputs = [role for role in INPUTS if role in signals]
    for role in responses:
        time, values = signals[role]
        inside = np.ones(len(time), dtype=bool)
        for other in inputs:
            clock = signals[other][0]
            slack = _SAME_CLOCK * _step(time)
            inside &= (time >= clock[0] - slack) & (time <= clock[-1] + slack)
        if not inside.any():
            raise InputError("no common times", path, f"`{chosen[role].name}` and its inputs do not overlap", "channels of one measurement")
        if not inside.all():
            warnings.warn(f"{path}: {np.sum(~inside)} samples of `{chosen[role].name}` outside the times of the inputs are left out", stacklevel=3)
            signals[role] = (time[inside], values[inside])
    main = signals[responses[0]][0] if responses else next(iter(signals.values()))[0]
    columns: Dict[str, Any] = {"time": main - main[0]}
    for role, (time, values) in signals.items():
        own = len(time) != len(main) or np.max(np.abs(time - main)) > _SAME_CLOCK * _step(main)
        columns[role] = (time - main[0], values) if own else values
    return Experiment(**columns, units=units, **{"name": Path(path).stem, **keys})


def _step(time: "np.ndarray") -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def _times(path: str, channel: Channel, rate: Optional[float]) -> "np.ndarray":
    if channel.time is not None:
        return channel.time
    if rate is None:
        raise InputError("no times", path, f"`{channel.name}`", "a file with times", "`sample_rate=…` in Hz")
    return np.arange(len(channel.values)) / rate


def _mdf(asammdf: Any, path: str) -> Iterator[Channel]:
    with asammdf.MDF(path) as file:
        masters = file.masters_db
        places = [(name, place) for name, all_places in file.channels_db.items() for place in all_places]
        for name, (group, index) in sorted(places, key=lambda item: item[1]):
            if masters.get(group) == index:
                continue
            # Invalid samples would be left out, and the others moved.
            signal = file.get(name, group=group, index=index, ignore_invalidation_bits=True)
            if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "iuf":
                continue
            values = signal.samples.astype(np.float64)
            if signal.invalidation_bits is not None:
                values[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
            unique = len(file.channels_db[name]) == 1
            yield Channel(name if unique else f"{name} (group {group})", str(signal.unit), np.asarray(signal.timestamps, np.float64), values)


def _edf(pyedflib: Any, path: str) -> Iterator[Channel]:
    with pyedflib.EdfReader(path) as file:
        for i in range(file.signals_in_file):
            name, digital = file.getLabel(i), file.readSignal(i, digital=True)
            in_record = file.samples_in_datarecord(i)
            values = np.asarray(file.readSignal(i), np.float64)
            # Writers fill the last data record with zeros.
            filled = _tail(digital[-in_record:], 0)
            if filled > 1:
                warnings.warn(f"{path}: the last {filled} samples of `{name}` are zeros that fill the last data record; they are left out", stacklevel=4)
                digital, values = digital[:-filled], values[:-filled]
            limits = [(digital <= file.getDigitalMinimum(i)), (digital >= file.getDigitalMaximum(i))]
            clipped = sum(int(np.sum(at[1:] & at[:-1])) for at in limits)
            if clipped:
                warnings.warn(f"{path}: {clipped} samples of `{name}` repeat a limit of the file: they are clipped", stacklevel=4)
            step = file.datarecord_duration / in_record
            yield Channel(name, file.getPhysicalDimension(i).strip(), np.arange(len(values)) * step, values)


def _tail(values: "np.ndarray", end: int) -> int:
    """Number of values equal to `end` behind the last other one."""
    others = np.flatnonzero(values != end)
    return len(values) - (int(others[-1]) + 1 if len(others) else 0)


def _mseed(obspy: Any, path: str) -> Iterator[Channel]:
    from obspy.io.mseed.util import get_record_information

    starts: Dict[str, List[Tuple[Any, int, float]]] = {}
    offset, size = 0, os.path.getsize(path)
    while offset < size:
        record = get_record_information(path, offset=offset)
        identity = ".".join(record[key] for key in ("network", "station", "location", "channel"))
        if record["npts"]:
            starts.setdefault(identity, []).append((record["starttime"], record["npts"], record["samp_rate"]))
        offset += record["record_length"]
    origin = min(start for records in starts.values() for start, _, _ in records)
    stream = obspy.read(path, format="MSEED")
    for identity, records in starts.items():
        traces = sorted((trace for trace in stream if trace.id == identity), key=lambda trace: trace.stats.starttime)
        values = np.concatenate([np.ma.filled(np.ma.asarray(trace.data).astype(np.float64), np.nan) for trace in traces])
        records.sort(key=lambda record: record[0])
        if len(values) != sum(count for _, count, _ in records):
            raise InputError("the data records of a channel overlap", path, f"`{identity}`", "records one after the other")
        time = np.concatenate([(start - origin) + np.arange(count) / rate for start, count, rate in records])
        if np.any(np.diff(time) <= 0):
            raise InputError("the data records of a channel overlap", path, f"`{identity}`", "records one after the other")
        uniform = time[0] + np.arange(len(time)) / records[0][2]
        drift = float(np.max(np.abs(time - uniform)))
        # Starts are stated to a ten-thousandth of a second.
        is_uniform = len(traces) == 1 and drift <= 1.1e-4
        yield Channel(identity, "", uniform if is_uniform else _through_starts(records, origin), values)


def _through_starts(records: List[Tuple[Any, int, float]], origin: Any) -> "np.ndarray":
    """Times of samples between the stated starts of their data records: slips within a record are spread over it, gaps stay; behind one
    the step is that of the record before."""
    times, step = [], 1 / records[0][2]
    for (start, count, rate), following in zip(records, [*records[1:], None]):
        length = following[0] - start if following is not None else float("inf")
        if abs(length - count / rate) < 1 / rate:
            step = length / count
        times.append((start - origin) + np.arange(count) * step)
    return np.concatenate(times)


def _sac(obspy: Any, path: str) -> Iterator[Channel]:
    # The rate would be rounded, the factor left out.
    (trace,) = obspy.read(path, format="SAC", round_sampling_interval=False)
    yield Channel(trace.id, "", trace.times(), trace.data.astype(np.float64) * trace.stats.calib)


def _ide(idelib: Any, path: str) -> Iterator[Channel]:
    document = idelib.importFile(path, quiet=True)
    for channel in document.channels.values():
        for part in channel.subchannels:
            events = part.getSession()
            if len(events) == 0:
                continue
            # The rate that the library states is that of the first block.
            microseconds, values = events.arraySlice()
            name = part.displayName or part.name
            yield Channel(f"{name} ({channel.name})", str((part.units or ("", ""))[1] or ""), microseconds * 1e-6, np.asarray(values, np.float64))


def _tdm(tdm_loader: Any, path: str) -> Iterator[Channel]:
    file = tdm_loader.OpenFile(path)
    for group in range(file.no_channel_groups()):
        found = []
        for i in range(file.no_channels(group)):
            # Units may stand in quotes.
            unit = (file.channel_unit(group, i) or "").strip(" '\"")
            found.append((str(file.channel_name(group, i)), unit, np.asarray(file.channel(group, i))))
        clocks = [values for name, unit, values in found if values.dtype.kind == "M" or _kmcfit.quantity(name, unit) == "time"]
        clock = clocks[0] if clocks else None
        if clock is not None and clock.dtype.kind == "M":
            clock = (clock - clock[0]).astype("timedelta64[ns]").astype(np.int64) / 1e9
        for name, unit, values in found:
            if values.dtype.kind in "iuf" and not any(values is other for other in clocks):
                own = clock is not None and len(clock) == len(values)
                yield Channel(name, unit, clock if own else None, values.astype(np.float64))


def _dewesoft(dwdatareader: Any, path: str) -> Iterator[Channel]:
    refused = []
    with dwdatareader.open_file(path) as file:
        for channel in file.values():
            if channel.array_size != 1:
                continue
            try:
                time, values = channel.scaled()
            except Exception as error:  # channels of buses raise
                refused.append(f"`{channel.name}` ({error})")
                continue
            yield Channel(channel.name, str(channel.unit), np.asarray(time, np.float64), np.asarray(values, np.float64))
    if refused:
        warnings.warn(f"{path}: not read: {', '.join(refused)}", stacklevel=4)


def _axivity(skdh: Any, path: str) -> Iterator[Channel]:
    data = skdh.ReadCwa(ext_error="raise").predict(file=path)
    # The rate `fs` is the nominal one.
    time = data["time"] - data["time"][0]
    for key, name, unit in (("accel", "acceleration", "g"), ("gyro", "rotation", "deg/s")):
        if key in data:
            for axis, values in zip("xyz", np.asarray(data[key], np.float64).T):
                yield Channel(f"{name} {axis}", unit, time, values)


_Reader = Callable[[Any, str], Iterator[Channel]]
_READERS: Dict[str, Tuple[str, str, _Reader]] = {
    ".mf4": ("asammdf", "asammdf", _mdf),
    ".mdf": ("asammdf", "asammdf", _mdf),
    ".mf3": ("asammdf", "asammdf", _mdf),
    ".edf": ("pyedflib", "pyedflib", _edf),
    ".bdf": ("pyedflib", "pyedflib", _edf),
    ".mseed": ("obspy", "obspy", _mseed),
    ".miniseed": ("obspy", "obspy", _mseed),
    ".sac": ("obspy", "obspy", _sac),
    ".ide": ("idelib", "idelib", _ide),
    ".tdm": ("tdm_loader", "tdm_loader", _tdm),
    ".dxd": ("dwdatareader", "dwdatareader", _dewesoft),
    ".d7d": ("dwdatareader", "dwdatareader", _dewesoft),
    ".dxz": ("dwdatareader", "dwdatareader", _dewesoft),
    ".cwa": ("skdh.io", "scikit-digital-health", _axivity),
}
