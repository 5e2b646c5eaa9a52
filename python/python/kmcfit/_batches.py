"""Tasks of a fleet on an executor: batches of records, a bounded number in flight, results in order."""

from __future__ import annotations

import json
import os
from collections import deque
from typing import TYPE_CHECKING, Any, Callable, Deque, Dict, Iterator, List, Optional, Set, Tuple

from ._errors import Error, NumericalError

if TYPE_CHECKING:
    from ._fleet import Block, Job

#: Row of a record and its curves, as JSON.
Lines = Tuple[str, List[str]]
#: Rows of a task, and its time, s.
Answer = Tuple[List[Lines], float]
#: Work of a task for each worker of the executor, s: a scheduler that takes 1 ms a task then takes less than 5 % of the whole time.
_WORK = 0.02
#: Most records of a task.
_MOST = 10_000
#: Most blocks of a task that have their rows.
_DONE = 1000
#: Tries of a task whose worker dies.
_TRIES = 4
#: Failed tasks one after another, without an answer before, after which the executor counts as broken.
_FAILED = 8
#: Tasks in flight for each worker.
_AHEAD = 3


def failed(record: str, error: str, seconds: float = 0.0) -> Lines:
    """The row of a record without estimates."""
    row: Dict[str, Any] = {"record": record, "estimates": {}, "verdict": None, "warnings": [], "seconds": seconds, "error": error}
    return json.dumps(row), []


class _Batch:
    """Blocks of records, and their task; without one if all have their rows."""

    def __init__(self, blocks: "List[Block]", todo: "List[Block]") -> None:
        self.blocks = blocks
        self.todo = todo
        self.future: Any = None
        self.tries = 0


class Batches:
    """Runs `task(job, blocks)` on an executor, or `local(blocks)` on threads of this process."""

    def __init__(
        self,
        task: "Callable[[Job, List[Block]], Answer]",
        job: "Job",
        local: "Callable[[List[Block]], Answer]",
        executor: Any,
        threads: Optional[int],
        size: Optional[int],
        timeout: Optional[float],
    ) -> None:
        self._task = task
        self._job = job
        self._local = local
        self._executor = executor
        self._own: Any = None
        self._workers = threads or os.cpu_count() or 1
        if executor is not None:
            self._workers = workers(executor)
        self._is_dask = type(executor).__module__.startswith("distributed.")
        self._size = size
        self._timeout = timeout
        self._seconds = 0.0
        self._count = 0
        self._pending: Deque[_Batch] = deque()
        #: Records whose rows are failures of workers: another call may fit them.
        self.unanswered: Set[str] = set()
        #: Tasks one after another that workers failed, and that they did not answer.
        self._failed = self._late = 0

    def run(
        self, blocks: "Iterator[Block]", is_todo: "Callable[[Block], bool]"
    ) -> "Iterator[Tuple[List[Block], List[Block], List[Lines]]]":
        """The blocks in their order, those that lacked a row, and the rows of these; the blocks are read as far as workers need them."""
        if self._executor is None:
            from concurrent.futures import ThreadPoolExecutor

            self._own = ThreadPoolExecutor(self._workers)
        is_over = False
        while True:
            while not is_over and len(self._pending) < _AHEAD * self._workers:
                batch = self._next(blocks, is_todo)
                is_over = batch is None
                if batch is not None:
                    self._pending.append(batch)
                    self._submit(batch)
            if not self._pending:
                return
            lines = self._finished(self._pending[0])
            batch = self._pending.popleft()
            yield batch.blocks, batch.todo, lines

    def close(self) -> None:
        """Gives up the tasks that are left."""
        for batch in self._pending:
            if batch.future is not None:
                batch.future.cancel()
        self._pending.clear()
        if self._own is not None:
            self._own.shutdown(wait=True)

    def _next(self, blocks: "Iterator[Block]", is_todo: "Callable[[Block], bool]") -> Optional[_Batch]:
        taken: "List[Block]" = []
        todo: "List[Block]" = []
        left = self._records()
        for block in blocks:
            taken.append(block)
            if is_todo(block):
                todo.append(block)
                left -= len(block)
            if left <= 0 or len(taken) - len(todo) >= _DONE:
                break
        return _Batch(taken, todo) if taken else None

    def _records(self) -> int:
        """Records of the next task, from the time of those before."""
        if self._size is not None:
            return self._size
        if self._count == 0:
            return 1
        mean = max(self._seconds / self._count, 1e-6)
        return max(1, min(int(_WORK * max(self._workers, 2) / mean) + 1, _MOST))

    def _submit(self, batch: _Batch) -> None:
        batch.tries += 1
        if not batch.todo:
            return
        if self._own is not None:
            batch.future = self._own.submit(self._local, batch.todo)
            return
        # Dask takes equal arguments for the same task, whose failure it would return again.
        options = {"pure": False} if self._is_dask else {}
        try:
            batch.future = self._executor.submit(self._task, self._job, batch.todo, **options)
        except Exception as error:
            raise NumericalError(
                f"the executor takes no more tasks ({error or type(error).__name__}); rows so far are kept, and the same call with `out=…` and "
                "a new executor continues after them"
            ) from error

    def _finished(self, batch: _Batch) -> List[Lines]:
        """The rows of a batch; after errors of its workers rows with an error."""
        while batch.future is not None:
            try:
                lines, seconds = batch.future.result(self._timeout)
            except Error:
                raise
            except Exception as error:
                is_late = "Timeout" in type(error).__name__ and not batch.future.done()
                if is_late:
                    batch.future.cancel()
                    self._late += 1
                    text = f"no answer of the worker within {self._timeout:g} s"
                    if self._late > self._workers:
                        raise self._ended(f"no worker answers any more ({text})") from error
                    return self._singly(batch, f"time limit: {text}")
                if batch.tries == _TRIES or self._own is not None:
                    self._failed += 1
                    text = f"{type(error).__name__}: {error}"
                    if self._failed > _FAILED and self._count == 0:
                        raise self._ended(f"the workers fail ({text})") from error
                    return self._singly(batch, f"the worker failed {batch.tries} times: {text}")
                self._submit(batch)
                continue
            batch.future = None
            self._failed = self._late = 0
            self._seconds += seconds
            self._count += len(lines)
            return list(lines)
        return []

    def _singly(self, batch: _Batch, text: str) -> List[Lines]:
        """The rows of the blocks of a failed task, each in a task of its own; of a single one rows with the error."""
        batch.future = None
        if len(batch.todo) > 1:
            parts = [_Batch([block], [block]) for block in batch.todo]
            rows: List[Lines] = []
            for part in parts:
                self._submit(part)
                rows += self._finished(part)
            return rows
        names = [record.name for block in batch.todo for record in block]
        self.unanswered.update(names)
        return [failed(name, text) for name in names]

    def _ended(self, text: str) -> NumericalError:
        return NumericalError(f"{text}; rows so far are kept, and the same call with `out=…` and a working executor continues after them")


def workers(executor: Any) -> int:
    """Number of tasks that an executor does at once."""
    threads = getattr(executor, "nthreads", None)
    if callable(threads):
        return max(1, int(sum(threads().values())))
    return max(1, int(getattr(executor, "_max_workers", None) or os.cpu_count() or 1))
