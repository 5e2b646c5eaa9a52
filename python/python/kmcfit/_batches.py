"""Tasks of a fleet on an executor: batches of records, a bounded number in flight, results in order."""

from __future__ import annotations

import os
from collections import deque
from typing import Any, Callable, Deque, Iterator, List, Optional, Tuple, TypeVar

from ._errors import Error, NumericalError

R = TypeVar("R")
#: Work of a task for each worker of the executor, s: a scheduler that takes 1 ms a task then takes less than 5 % of the whole time.
_WORK = 0.02
#: Most records of a task.
_MOST = 10_000
#: Tries of a task whose worker dies.
_TRIES = 4
#: Tasks in flight for each worker.
_AHEAD = 3


class Batches:
    """Runs a function of a list of records, which returns results and the time that they took, on an executor, by default on threads."""

    def __init__(self, executor: Any, threads: Optional[int], size: Optional[int]) -> None:
        self._own: Any = None
        if executor is None:
            from concurrent.futures import ThreadPoolExecutor

            self._own = executor = ThreadPoolExecutor(threads or os.cpu_count() or 1)
        self._executor = executor
        self._workers = threads or workers(executor)
        # Dask takes equal arguments for the same task, whose failure it would return again.
        self._options = {"pure": False} if type(executor).__module__.startswith("distributed.") else {}
        self._size = size
        self._seconds, self._count = 0.0, 0
        self._pending: Deque[Any] = deque()

    def run(self, task: Callable[..., Tuple[List[R], float]], arguments: Tuple[Any, ...], records: Iterator[Any]) -> Iterator[R]:
        """The results in the order of the records, which are read as far as workers need them."""
        tasks: Deque[List[Any]] = deque()
        is_over = False
        while True:
            while not is_over and len(self._pending) < _AHEAD * self._workers:
                batch = [record for _, record in zip(range(self._records()), records)]
                is_over = not batch
                if batch:
                    tasks.append(batch)
                    self._pending.append(self._submit(task, (*arguments, batch)))
            if not self._pending:
                return
            yield from self._finished(task, (*arguments, tasks[0]))
            tasks.popleft()

    def close(self) -> None:
        """Gives up the tasks that are left."""
        for future in self._pending:
            future.cancel()
        self._pending.clear()
        if self._own is not None:
            self._own.shutdown(wait=True)

    def _records(self) -> int:
        """Records of the next task, from the time of those before."""
        if self._size is not None:
            return self._size
        if self._own is not None or self._count == 0:
            return 1
        mean = max(self._seconds / self._count, 1e-6)
        return max(1, min(int(_WORK * self._workers / mean) + 1, _MOST))

    def _submit(self, task: Any, arguments: Tuple[Any, ...]) -> Any:
        try:
            return self._executor.submit(task, *arguments, **self._options)
        except Exception as error:
            raise _ended(f"the executor takes no more tasks ({error or type(error).__name__})") from error

    def _finished(self, task: Any, arguments: Tuple[Any, ...]) -> List[R]:
        """The results of the oldest task, which is repeated where its worker dies."""
        for _ in range(_TRIES):
            try:
                results, seconds = self._pending[0].result()
            except Error:
                raise
            except Exception as error:
                failure = error
                self._pending[0] = self._submit(task, arguments)
                continue
            self._pending.popleft()
            self._seconds += seconds
            self._count += len(results)
            return results
        raise _ended(f"the workers fail ({type(failure).__name__}: {failure})") from failure


def _ended(text: str) -> NumericalError:
    return NumericalError(f"{text}; rows so far are kept, and the same call with `out=…` and a working executor goes on after them")


def workers(executor: Any) -> int:
    """Number of tasks that an executor does at once."""
    threads = getattr(executor, "nthreads", None)
    if callable(threads):
        return max(1, int(sum(threads().values())))
    return max(1, int(getattr(executor, "_max_workers", None) or os.cpu_count() or 1))
