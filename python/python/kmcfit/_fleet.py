"""Fleets: one model on many records."""

from __future__ import annotations

import csv
import json
import os
from itertools import chain, islice
from pathlib import Path
from time import perf_counter
from types import TracebackType
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Tuple, Type, Union

from . import _kmcfit, _yaml
from ._batches import Batches
from ._errors import InputError, unknown_keyword
from ._model import Model, Overrides, overrides
from ._records import Item, Source, item, lowered, other_columns

_KEYS = ("record", "sha256", "estimates", "verdict", "warnings", "seconds", "error")
_WORDS = ("executor", "out", "set", "threads", "batch", "trend")


class Row(Dict[str, Any]):
    """The result of one record: a dict with `record`, `sha256`, `estimates`, `verdict`, `warnings`, `seconds` and `error`, also as attributes.

    Attributes
    ----------
    record : str
        Name of the record.
    estimates : dict
        Estimates with `value`, `unit`, `ci95` and `status`, as in ``result.json``; empty with an error.
    verdict : {"adequate", "check", "inadequate"} or None
    warnings : list of str
    seconds : float
    error : str or None
        Why the record has no estimates.
    """

    def __init__(self, line: str) -> None:
        super().__init__(json.loads(line))

    def __getattr__(self, name: str) -> Any:
        if name in _KEYS:
            return self[name]
        raise AttributeError(name)

    def __reduce__(self) -> Any:
        return Row, (json.dumps(self),)

    def __repr__(self) -> str:
        return f"<Row {self.record!r}: {self.error or self.verdict}>"


class RowList(List[Row]):
    """Rows of a fleet."""

    def to_pandas(self) -> Any:
        """The rows as a DataFrame of pandas with each estimate with its interval in `_low` and `_high`."""
        import pandas  # type: ignore[import-untyped,unused-ignore]

        names: Dict[str, None] = {}
        for row in self:
            names.update(dict.fromkeys(row["estimates"]))
        table = []
        for row in self:
            cells = {"record": row["record"]}
            for name in names:
                given = row["estimates"].get(name) or {}
                low, high = given.get("ci95") or (None, None)
                cells.update({name: given.get("value"), f"{name}_low": low, f"{name}_high": high})
            texts = "\n".join(row["warnings"]) or None
            table.append({**cells, "verdict": row["verdict"], "warnings": texts, "seconds": row["seconds"], "error": row["error"]})
        return pandas.DataFrame(table)


class Rows(Iterator[Row]):
    """The rows of a fleet, each fitted when it is needed: an iterator, and a context that ends the work."""

    def __init__(self, rows: Iterator[Row], count: Optional[int]) -> None:
        self._rows = rows
        self._count = count

    def __iter__(self) -> "Rows":
        return self

    def __next__(self) -> Row:
        return next(self._rows)

    def __len__(self) -> int:
        """Number of records, where it is known."""
        if self._count is None:
            raise TypeError("the number of records is unknown")
        return self._count

    def __enter__(self) -> "Rows":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the work; rows so far stay in the folder."""
        self._rows.close()  # type: ignore[attr-defined]

    def to_list(self) -> RowList:
        """The rows that are left, as a list."""
        return RowList(self)

    def to_pandas(self) -> Any:
        """The rows that are left, as a DataFrame; see `RowList.to_pandas`."""
        return self.to_list().to_pandas()

    def __repr__(self) -> str:
        return f"<Rows of {'a number of' if self._count is None else self._count} records>"


def fit_many(
    model: Union[Model, str, "os.PathLike[str]"],
    records: Any,
    executor: Any = None,
    *,
    out: Union[str, "os.PathLike[str]", None] = None,
    set: Optional[Overrides] = None,  # noqa: A002
    threads: Optional[int] = None,
    batch: Optional[int] = None,
    trend: Optional[str] = None,
    **unknown: Any,
) -> Rows:
    """Fits one model to many records, as ``kmcfit fleet`` does; one row for each record, in their order.

    Parameters
    ----------
    model : Model or path
        A model of a file with one experiment, whose data each record replaces; or a model without experiments, for records that are arrays.
        For a path, the folder `out` is that of ``kmcfit fleet`` with the same model and records.
    records : str or iterable
        A pattern such as ``"records/*.csv"`` or a table with a column `file`, as for ``kmcfit fleet``; or the records one after another:
        paths, `Experiment`, DataFrames or dicts of arrays, pairs (name, one of these or the bytes of a file), or dicts with `record` (name),
        `file`, `data` or arrays, `mass`, `damping`, `stiffness` (known values, SI), `window` (first and last time, s), and changed keys of
        the model such as ``"fit.stop.iterations"``; other keys are columns of the table. Generators are read as far as the fits need them.
    executor : object, optional
        Anything whose ``submit(function, *arguments)`` returns a future: ``concurrent.futures``, a client of Dask, loky. Threads of this
        process by default.
    out : path, optional
        Folder of the rows. The same call again goes on after the rows that are there, and fits records with errors again; at the end it holds the table and the page too.
    set : dict, optional
        Changed keys of the model; ``{"fit.stop.seconds": 60}`` limits the time of a record.
    threads : int, optional
        Number of threads without `executor`; one per core by default. Rows do not depend on it.
    batch : int, optional
        Records of a task; from the time of the first ones by default: 20 ms for each worker of the executor.
    trend : str, optional
        Column over which the page shows the estimates.

    Returns
    -------
    Rows

    Raises
    ------
    InputError
        If the model or a record has no valid form, or the folder belongs to another fleet. A record that cannot be read or fitted is a row
        with its error.
    """
    for word in unknown:
        raise unknown_keyword("fit_many", word, ["model", "records", *_WORDS])
    for name, count in (("threads", threads), ("batch", batch)):
        if count is not None and (isinstance(count, bool) or not isinstance(count, int) or count < 1):
            raise InputError("invalid number", f"fit_many.{name}", repr(count), "1 or more")
    fleet, source = _source(model, set)
    items, columns, number = _items(records)
    folder = None if out is None else _kmcfit.RawFolder(os.fspath(out), fleet)
    job = Job(_kmcfit.version(), source)
    batches = Batches(executor, threads, batch)
    local = None if executor is not None else fleet
    return Rows(_rows(fleet, batches, (local, job), items, (folder, columns, trend)), number)


def fit_partition(
    model: Union[Model, str, "os.PathLike[str]"], records: Iterable[Any], *, set: Optional[Overrides] = None  # noqa: A002
) -> RowList:
    """Fits one model to the records of a partition where they lie, on this thread: ``bag.map_partitions(lambda part:
    km.fit_partition(model, part))``. Arguments as for `fit_many`.

    Returns
    -------
    RowList
    """
    fleet, source = _source(model, set)
    items, *_ = _items(records)
    lines, _ = fit_batch(fleet, Job(_kmcfit.version(), source), list(items))
    return RowList(Row(line) for line in lines)


def read_fleet(folder: Union[str, "os.PathLike[str]"]) -> RowList:
    """The rows of the folder of a fleet that `fit_many` or ``kmcfit fleet`` wrote, in the order of the records where all have their rows."""
    path = Path(folder) / "rows.jsonl"
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError("the rows cannot be read", str(path), str(error), "the folder of a fleet") from None
    rows = {row["record"]: row for row in map(Row, text.splitlines())}
    table = path.with_name("rows.csv")
    names = list(rows)
    if table.exists():
        with table.open(newline="", encoding="utf-8") as lines:
            names = [cells["record"] for cells in csv.DictReader(lines)]
    return RowList(rows[name] for name in names if name in rows)


class Job(NamedTuple):
    """What the tasks of a fleet have in common."""

    version: str
    source: Source


_last: Optional[Tuple[Source, "_kmcfit.RawFleet"]] = None


def fit_batch(fleet: Optional["_kmcfit.RawFleet"], job: Job, records: List[Item]) -> Tuple[List[str], float]:
    """The task of a worker: rows of the records, as JSON, and their time; on another process the model is made once."""
    global _last
    begin = perf_counter()
    source = job.source
    if fleet is None:
        own = _kmcfit.version()
        if own != job.version:
            raise InputError("the worker has another version of kmcfit", "executor", own, job.version)
        if _last is None or _last[0] != source:
            _last = source, _kmcfit.RawFleet(source.text, source.path, source.overrides)
        fleet = _last[1]
    rows = []
    for record in records:
        try:
            line = fleet.fit(lowered(record, source))
        except Exception as error:  # whatever a record of a user raises is its own error
            text = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            line = json.dumps({"record": record.name, "estimates": {}, "verdict": None, "warnings": [], "seconds": 0.0, "error": text})
        if line is not None:
            rows.append(line)
    return rows, perf_counter() - begin


def _source(model: Any, set: Optional[Overrides]) -> Tuple["_kmcfit.RawFleet", Source]:  # noqa: A002
    changes = overrides(set)
    if not isinstance(model, Model):
        path = os.fspath(model)
        fleet = _kmcfit.RawFleet(None, path, changes)
        return fleet, Source(_kmcfit.read_text(path), path, changes, True, False)
    has_experiment = bool(model._spec["experiments"])
    # Columns and settings are those of each record.
    spec = model._spec if has_experiment else {**model._spec, "experiments": [{"data": "record.npz", "initial": "estimate"}]}
    text = _yaml.text(spec)
    chooses_mass = model._chooses_mass and not has_experiment
    return _kmcfit.RawFleet(text, model._path, changes), Source(text, model._path, changes, has_experiment, chooses_mass)


def _items(records: Any) -> Tuple[Iterator[Item], List[str], Optional[int]]:
    """The records with names, the names of their columns, and their number where it is known."""
    if isinstance(records, (str, os.PathLike)):
        given, columns = _kmcfit.record_list([os.fspath(records)])
        return iter([Item(*one) for one in given]), columns, len(given)
    if hasattr(records, "to_dict") and hasattr(records, "columns"):
        records = records.to_dict("records")
    try:
        given = iter(records)
    except TypeError:
        raise InputError("no records", "records", type(records).__name__, "a pattern, a table, or an iterable of records") from None
    count = len(records) if hasattr(records, "__len__") else None
    first = list(islice(given, count or 1))
    columns = list(dict.fromkeys(name for one in first for name in other_columns(one)))

    def named() -> Iterator[Item]:
        names: Dict[str, int] = {}
        for i, one in enumerate(chain(first, given), 1):
            record = item(one, i, columns)
            if names.setdefault(record.name, i) != i:
                found = f"`{record.name}` as number {names[record.name]} and number {i}"
                raise InputError("two records have the same name", "records", found, "every record once")
            yield record

    # The errors of a list come before the first fit.
    return (named() if count is None else iter(list(named()))), columns, count


def _rows(
    fleet: "_kmcfit.RawFleet",
    batches: Batches,
    task: Tuple[Optional["_kmcfit.RawFleet"], Job],
    items: Iterator[Item],
    output: Tuple[Optional["_kmcfit.RawFolder"], List[str], Optional[str]],
) -> Iterator[Row]:
    """Rows in the order of the records; those of the folder are not fitted again."""
    folder, columns, trend = output
    seen: List[Any] = []
    before: Dict[str, str] = {}
    order: List[str] = []

    def todo() -> Iterator[Item]:
        for record in items:
            order.append(record.name)
            if folder is not None:
                try:
                    content = lowered(record, task[1].source)
                except Exception:  # the error of its row
                    content = (record.name, record.path, None, [], record.columns)
                seen.append((*content[:2], None, [], record.columns))
                line = folder.row(content)
                if line is not None:
                    before[record.name] = line
                    continue
            yield record

    def known() -> Iterator[Row]:
        while order and order[0] in before:
            yield Row(before.pop(order.pop(0)))

    try:
        for line in batches.run(fit_batch, task, todo()):
            yield from known()
            if folder is not None:
                folder.append([line])
            order.pop(0)
            yield Row(line)
        yield from known()
        if folder is not None:
            folder.finish(seen, columns, trend)
    except BaseException:
        fleet.interrupt()
        raise
    finally:
        batches.close()
        if folder is not None:
            folder.close()
