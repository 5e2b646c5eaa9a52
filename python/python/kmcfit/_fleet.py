"""Fleets: one model on many records."""

from __future__ import annotations

import json
import os
from itertools import islice
from time import perf_counter
from types import TracebackType
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Type, Union

from . import _kmcfit, _yaml
from ._batches import Answer, Batches, Lines, failed
from ._errors import InputError, unknown_keyword
from ._model import Model, Overrides, overrides
from ._records import Item, Source, item, lowered, other_columns

_KEYS = ("record", "estimates", "verdict", "warnings", "seconds", "error")
#: Records of one system that are fitted one after another with `warm_start`, as in `kmcfit fleet`.
_BLOCK = 32
#: Most blocks that wait for further records of their systems.
_OPEN = 256
_WORDS = ("executor", "out", "set", "threads", "batch", "time_limit", "timeout", "retry_errors", "warm_start", "trend")


class Row(Dict[str, Any]):
    """The result of one record: a dict with `record`, `estimates`, `verdict`, `warnings`, `seconds` and `error`, also as attributes.

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
    curves : list of dict
        Coefficients that vary: `function`, `t`, `value`, `low`, `high`; empty for a row that was read from a journal.
    """

    curves: List[Dict[str, Any]]

    def __init__(self, line: str, curves: Sequence[str] = ()) -> None:
        super().__init__(json.loads(line))
        self.curves = [json.loads(curve) for curve in curves]

    def __getattr__(self, name: str) -> Any:
        if name in _KEYS:
            return self[name]
        raise AttributeError(name)

    def __reduce__(self) -> Any:
        return Row, (json.dumps(self), [json.dumps(curve) for curve in self.curves])

    def __repr__(self) -> str:
        return f"<Row {self.record!r}: {self.error or self.verdict}>"


class RowList(List[Row]):
    """Rows of a fleet."""

    def to_pandas(self) -> Any:
        """The rows as a DataFrame of pandas with the columns of ``rows.parquet``: each estimate with its interval in `_low` and `_high`."""
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
        """Ends the work; rows so far stay in the journal."""
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
    time_limit: Optional[float] = None,
    timeout: Optional[float] = None,
    retry_errors: bool = False,
    warm_start: bool = False,
    trend: Optional[str] = None,
    **unknown: Any,
) -> Rows:
    """Fits one model to many records, as ``kmcfit fleet`` does; one row for each record, in their order (with `warm_start` block by block).

    Parameters
    ----------
    model : Model or path
        A model of a file with one experiment, whose data each record replaces; or a model without experiments, for records that are arrays.
        For a path, the folder `out` is that of ``kmcfit fleet`` with the same model and records.
    records : str or iterable
        A pattern such as ``"records/*.csv"`` or a table with a column `file`, as for ``kmcfit fleet``; or the records one after another:
        paths, `Experiment`, DataFrames or dicts of arrays, pairs (name, one of these or the bytes of a file), or dicts with `record` (name),
        `file`, `data` or arrays, `mass`, `damping`, `stiffness` (known values, SI), `window` (first and last time, s), `system`, and changed
        keys of the model such as ``"fit.stop.iterations"``; other keys are columns of the journal. Generators are read as far as the fits
        need them.
    executor : object, optional
        Anything whose ``submit(function, *arguments)`` returns a future: ``concurrent.futures``, a client of Dask, loky. Threads of this
        process by default.
    out : path, optional
        Folder of the journal. The same call again continues after the rows that are there; at the end it holds tables and the page too.
    set : dict, optional
        Changed keys of the model.
    threads : int, optional
        Number of threads without `executor`; one per core by default. Rows do not depend on it.
    batch : int, optional
        Records of a task; from the time of the first ones by default: 20 ms for each worker of the executor.
    time_limit : float, optional
        Longest time of a record, s; its row has then an error that begins with ``time limit``.
    timeout : float, optional
        Longest time without an answer to the oldest task, s; its rows have then an error that begins with ``time limit``. Errors of workers
        are not in the journal: the same call fits their records again.
    retry_errors : bool
        Fit the records again whose rows in `out` have errors.
    warm_start : bool
        Start each fit from the estimates of the record before of the same system, in blocks of 32.
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
    _check_time("fit_many.time_limit", time_limit)
    _check_time("fit_many.timeout", timeout)
    fleet, source = _source(model, set)
    items, columns, count, is_listed = _items(records)
    journal = None
    if out is not None:
        known = None
        if is_listed:
            items = list(items)
            known = [record.listed(source) for record in items]
        journal = _kmcfit.RawJournal(os.fspath(out), fleet, known, columns, warm_start, retry_errors, trend)
    job = Job(_kmcfit.version(), source, warm_start, time_limit)
    batches = Batches(fit_batch, job, lambda blocks: fit_blocks(fleet, job, blocks), executor, threads, batch, timeout)
    rows = _rows(fleet, batches, _blocks(items, warm_start), journal, None if is_listed else source, trend)
    return Rows(rows, count)


def _check_time(name: str, limit: Optional[float]) -> None:
    is_number = isinstance(limit, (int, float)) and not isinstance(limit, bool)
    if limit is not None and not (is_number and 0.0 < limit <= 1e9):
        raise InputError("invalid time", name, repr(limit), "seconds, greater than 0")


def fit_partition(
    model: Union[Model, str, "os.PathLike[str]"],
    records: Iterable[Any],
    *,
    set: Optional[Overrides] = None,  # noqa: A002
    time_limit: Optional[float] = None,
    warm_start: bool = False,
) -> RowList:
    """Fits one model to the records of a partition where they lie, on this thread: ``bag.map_partitions(lambda part:
    km.fit_partition(model, part))``. Arguments as for `fit_many`.

    Returns
    -------
    RowList
    """
    _check_time("fit_partition.time_limit", time_limit)
    fleet, source = _source(model, set)
    items, *_ = _items(records)
    job = Job(_kmcfit.version(), source, warm_start, time_limit)
    rows, _ = fit_blocks(fleet, job, list(_blocks(items, warm_start)))
    return RowList(Row(*lines) for lines in rows)


def read_fleet(folder: Union[str, "os.PathLike[str]"], collect: bool = False) -> RowList:
    """The rows of the folder of a fleet that `fit_many` or ``kmcfit fleet`` wrote, in the order of the records.

    Parameters
    ----------
    folder : path
    collect : bool
        Write tables, statistics and page of the rows so far, as ``kmcfit fleet collect``.
    """
    return RowList(map(Row, _kmcfit.fleet_rows(os.fspath(folder), collect)))


class Job(NamedTuple):
    """What the tasks of a fleet have in common."""

    version: str
    source: Source
    warm_start: bool
    time_limit: Optional[float]


Block = List[Item]
_last: Optional[Tuple[Source, "_kmcfit.RawFleet"]] = None


def fit_batch(job: Job, blocks: List[Block]) -> Answer:
    """The task of a worker: rows and curves of the records, as JSON, and its time."""
    global _last
    own = _kmcfit.version()
    if own != job.version:
        raise InputError("the worker has another version of kmcfit", "executor", own, job.version)
    if _last is None or _last[0] != job.source:
        source = job.source
        _last = source, _kmcfit.RawFleet(source.text, source.path, source.overrides)
    return fit_blocks(_last[1], job, blocks)


def fit_blocks(fleet: "_kmcfit.RawFleet", job: Job, blocks: List[Block]) -> Answer:
    """Rows and curves of the records of blocks, and the time that they took."""
    begin = perf_counter()
    rows: List[Lines] = []
    for block in blocks:
        part = []
        for record in block:
            try:
                part.append(lowered(record, job.source))
            except Exception as error:  # whatever a record of a user raises is its own error
                text = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
                # The next record starts as the model states.
                rows += fleet.fit([part], job.warm_start, job.time_limit)
                rows.append(failed(record.name, text))
                part = []
        rows += fleet.fit([part], job.warm_start, job.time_limit)
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


def _items(records: Any) -> Tuple[Iterable[Item], List[str], Optional[int], bool]:
    """The records with names, the names of their columns, their number, and True where all of them are known."""
    if isinstance(records, (str, os.PathLike)):
        given, columns = _kmcfit.record_list([os.fspath(records)])
        return [Item(*one) for one in given], columns, len(given), True
    if hasattr(records, "to_dict") and hasattr(records, "columns"):
        records = records.to_dict("records")
    if isinstance(records, (list, tuple)):
        columns = list(dict.fromkeys(name for one in records for name in other_columns(one)))
        items = [item(one, i, columns) for i, one in enumerate(records, 1)]
        names: Dict[str, int] = {}
        for i, one in enumerate(items, 1):
            if names.setdefault(one.name, i) != i:
                found = f"`{one.name}` as number {names[one.name]} and number {i}"
                raise InputError("two records have the same name", "records", found, "every record once")
        return items, columns, len(items), True
    count = len(records) if hasattr(records, "__len__") else None
    try:
        given = iter(records)
    except TypeError:
        raise InputError("no records", "records", type(records).__name__, "a pattern, a table, or an iterable of records") from None
    first = list(islice(given, 1))
    columns = other_columns(first[0]) if first else []

    def lazily() -> Iterator[Item]:
        for i, one in enumerate(first, 1):
            yield item(one, i, columns)
        for i, one in enumerate(given, 2):
            yield item(one, i, columns)

    return lazily(), columns, count, False


def _blocks(items: Iterable[Item], warm_start: bool) -> Iterator[Block]:
    """Records that are fitted one after another: single ones, or with `warm_start` those of one system."""
    if not warm_start:
        for record in items:
            yield [record]
        return
    open_blocks: Dict[str, Block] = {}
    for record in items:
        block = open_blocks.setdefault(record.system, [])
        block.append(record)
        if len(block) == _BLOCK:
            yield open_blocks.pop(record.system)
        elif len(open_blocks) > _OPEN:
            yield open_blocks.pop(next(iter(open_blocks)))
    yield from open_blocks.values()


def _rows(
    fleet: "_kmcfit.RawFleet",
    batches: Batches,
    blocks: Iterator[Block],
    journal: Optional["_kmcfit.RawJournal"],
    source: Optional[Source],
    trend: Optional[str],
) -> Iterator[Row]:
    """Rows in the order of `blocks`; those of the journal are not fitted again. With a `source` the records become known one after another."""
    before: Dict[str, str] = {}

    def todo(block: Block) -> bool:
        """True if a record of the block has no row yet."""
        is_open = journal is None
        for record in block:
            if source is not None and journal is not None:
                journal.add(record.listed(source))
            line = None if journal is None else journal.row(record.name)
            if line is None:
                is_open = True
            else:
                before[record.name] = line
        return is_open

    try:
        for found_blocks, fitted, lines in batches.run(blocks, todo):
            # Rows come in the order of their records, whose names may be equal without a journal.
            given = iter(lines)
            new: Dict[int, List[Optional[Lines]]] = {id(block): [next(given, None) for _ in block] for block in fitted}
            rows = [
                (before.pop(record.name, None), record.name, line)
                for block in found_blocks
                for record, line in zip(block, new.get(id(block), [None] * len(block)))
            ]
            added = [line for had, name, line in rows if had is None and line is not None and name not in batches.unanswered]
            if journal is not None and added:
                journal.append(added)
            for had, name, line in rows:
                batches.unanswered.discard(name)
                if had is not None:
                    yield Row(had)
                elif line is not None:
                    yield Row(*line)
        if journal is not None:
            journal.finish(trend)
    except BaseException:
        fleet.interrupt()
        raise
    finally:
        batches.close()
        if journal is not None:
            journal.close()

