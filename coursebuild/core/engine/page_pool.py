"""Work spread over forked copies of this process.

A worker is forked with everything that this process has read and imported, applies one function to
one task at a time, and remembers what it likes between tasks. A task may be reserved for the worker
that remembers its document; that of a worker that died is done in this process. Workers are killed
when the work is over, however it ends, and when this process is: they have nothing to save.

Python's own `ProcessPoolExecutor` cannot reserve a task, gives up all tasks when one worker dies,
and forks with a thread of its own beside it.
"""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator
from itertools import chain, islice
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any, Generic, NoReturn, Self, TypeVar

from msgspec import Struct

from coursebuild.core.engine.lifetime import end_with_parent

Task = TypeVar("Task")
Result = TypeVar("Result")

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_MOST_WAITING = 32
"""How many tasks are made before a worker is idle."""


def can_fork() -> bool:
    """Whether this process can be forked: a copy has only the thread that forks."""
    return sys.platform != "darwin" and threading.active_count() == 1


class _Task(Struct, frozen=True, eq=False):
    number: int
    """In the order of the tasks."""
    owner: int | None
    """The number of the worker that it is reserved for."""
    value: Any


class _Worker(Struct, eq=False):
    number: int
    process: int
    connection: Connection
    task: _Task | None = None
    """What it works on."""


class Workers(Generic[Task, Result]):
    """Forked processes that all work with the same function, or none."""

    def __init__(self, work: Callable[[Task], Result], count: int) -> None:
        """Fork `count` workers; with none, or where forking fails, this process does all tasks.

        Of the files open here, only the first three stay open in the workers.
        """
        self._work = work
        self._workers: dict[int, _Worker] = {}
        try:
            for number in range(count):
                self._fork(number)
        except OSError:  # no room for another process
            pass
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def map(self, tasks: Iterable[tuple[int | None, Task]]) -> Iterator[tuple[Result, int | None]]:
        """Yield the results in the order of the tasks, each with the number of its worker.

        A task comes with the number of the worker that it is reserved for, if any. Tasks are made
        while workers do earlier ones. What a worker raises is raised here.
        """
        new_tasks = (_Task(number, *task) for number, task in enumerate(tasks))
        unassigned: list[_Task] = []
        results: dict[int, tuple[Result, int | None]] = {}
        taken_count = yielded_count = 0
        there_are_more = True
        try:
            while there_are_more or yielded_count < taken_count:
                if can_take_more := there_are_more and len(unassigned) < _MOST_WAITING:
                    next_tasks = [*islice(new_tasks, 1)]
                    there_are_more = bool(next_tasks)
                    taken_count += len(next_tasks)
                    unassigned += next_tasks
                for worker in self._workers.values():
                    if worker.task is None:
                        self._assign(worker, unassigned)
                busy = {w.connection: w for w in self._workers.values() if w.task is not None}
                if not busy and not can_take_more and unassigned:
                    task = unassigned.pop(0)
                    results[task.number] = self._work(task.value), None
                for ready in wait(busy, 0 if can_take_more or not busy else None):
                    number, result = self._collect(busy[ready])  # type: ignore[index]
                    results[number] = result
                while yielded_count in results:
                    yield results.pop(yielded_count)
                    yielded_count += 1
        except BaseException:  # or a result still to come would count for a later task
            self.close()
            raise

    def close(self) -> None:
        """End the workers, all at once, since freeing their memory takes a while."""
        for worker in self._workers.values():
            _kill(worker)
        for worker in [*self._workers.values()]:
            self._drop(worker)

    def _assign(self, worker: _Worker, unassigned: list[_Task]) -> None:
        """Send an idle worker a task: one reserved for it, or else one reserved for nobody.

        Where too many tasks wait, it gets one reserved for another worker.
        """
        other_numbers = self._workers.keys() - {worker.number}
        reserved = (task for task in unassigned if task.owner == worker.number)
        free = (task for task in unassigned if task.owner not in other_numbers)
        rest = unassigned if len(unassigned) >= _MOST_WAITING else []
        worker.task = next(chain(reserved, free, rest), None)
        if worker.task is not None:
            unassigned.remove(worker.task)
            with contextlib.suppress(OSError):  # it is dead, which `_collect` will notice
                worker.connection.send_bytes(pickle.dumps(worker.task.value))

    def _collect(self, worker: _Worker) -> tuple[int, tuple[Result, int | None]]:
        """The number of a worker's task, and its result; if the worker has died, do it here."""
        task, worker.task = worker.task, None
        assert task is not None
        try:
            is_result, value = pickle.loads(worker.connection.recv_bytes())
        except (EOFError, OSError):
            self._drop(worker)
            return task.number, (self._work(task.value), None)
        if not is_result:
            raise value
        return task.number, (value, worker.number)

    def _drop(self, worker: _Worker) -> None:
        del self._workers[worker.number]
        worker.connection.close()
        _kill(worker)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(worker.process, 0)

    def _fork(self, number: int) -> None:
        ours, theirs = Pipe()
        parent = os.getpid()
        # A signal to all processes of the terminal must not run this process's handlers there.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        try:
            process = os.fork()
            if process == 0:
                end_with_parent(parent)
                _serve(self._work, theirs, before)
            self._workers[number] = _Worker(number, process, ours)
        except OSError:
            ours.close()
            raise
        finally:
            theirs.close()
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _kill(worker: _Worker) -> None:
    with contextlib.suppress(OSError):
        os.kill(worker.process, signal.SIGKILL)


def _serve(
    work: Callable[[Any], Any], connection: Connection, blocked: Collection[int]
) -> NoReturn:
    """Do tasks until the input ends; `blocked` are the signals that the worker blocks."""
    status = 1
    try:
        # Ctrl-C is for the parent, which ends its workers.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        # Other open files hold locks or belong to other workers: do not keep them open.
        os.closerange(3, connection.fileno())
        os.closerange(max(3, connection.fileno() + 1), 1 << 16)
        gc.freeze()  # do not collect among the objects of the parent
        with contextlib.suppress(EOFError, OSError):
            while True:
                task = pickle.loads(connection.recv_bytes())
                try:
                    reply = pickle.dumps((True, work(task)))
                except BaseException as error:
                    error.add_note(f"in a worker:\n{traceback.format_exc()}")
                    try:
                        reply = pickle.dumps((False, error))
                        pickle.loads(reply)
                    except Exception:
                        like = RuntimeError(f"{type(error).__name__}: {error}")
                        reply = pickle.dumps((False, like))
                connection.send_bytes(reply)
        status = 0
    finally:
        os._exit(status)
