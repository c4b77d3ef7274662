"""Work spread over forked copies of this process.

Entry points: `Workers`, a context manager; `can_fork`, whether there can be any.

1. A worker is forked with all that this process has read and imported, and does one task at a time
   with the function that it was made with. What it remembers from one task to the next stays in it.
2. `map` gives each task to the worker that is named for it, or to the first that is free, and gives
   the results in the order of the tasks. Tasks may be made while workers are at earlier ones.
3. What a worker did not finish, because it died, is done here. What the function raises in a worker
   is raised here.
4. Workers are killed when the work is over, however it ends. They have nothing to save, and where
   this process is killed they see it and end.
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
from collections import deque
from collections.abc import Callable, Collection, Iterable
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any, Generic, NoReturn, Self, TypeVar

from msgspec import Struct, field

Task = TypeVar("Task")
Result = TypeVar("Result")

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def can_fork() -> bool:
    """Whether this process can be copied: it has one thread, and nothing that a copy breaks."""
    if not hasattr(os, "fork") or sys.platform == "darwin":
        return False
    # Threads do not come along into a copy, and MuJoCo has some of its own.
    return threading.active_count() == 1 and "mujoco" not in sys.modules


class _Worker(Struct, eq=False):
    number: int
    process: int
    connection: Connection
    own: deque[int] = field(default_factory=deque)
    """Tasks that are for this one, by their numbers."""
    task: int | None = None
    """The one that it is at."""


class Workers(Generic[Task, Result]):
    """Forked processes that all work with the same function, or none."""

    def __init__(self, work: Callable[[Task], Result], count: int) -> None:
        """Fork `count` workers now; with none, or where that fails, all is done here.

        Of the files that are open here only the first three are open in the workers.
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

    def map(
        self, tasks: Iterable[tuple[int | None, Task]]
    ) -> tuple[list[Result], list[int | None]]:
        """The results, in the order of the tasks, and which worker did each.

        A task comes with the number of the worker that should do it, if any.
        """
        asked: list[Task] = []
        done: dict[int, tuple[Result, int | None]] = {}
        free: deque[int] = deque()
        coming = iter(tasks)
        there_are_more = True
        try:
            while True:
                task = next(coming, None) if there_are_more else None
                there_are_more = task is not None
                if task is not None:
                    worker = self._workers.get(-1 if task[0] is None else task[0])
                    (free if worker is None else worker.own).append(len(asked))
                    asked.append(task[1])
                for worker in self._workers.values():
                    self._give(worker, free, asked)
                busy = {w.connection: w for w in self._workers.values() if w.task is not None}
                if not there_are_more and not busy:
                    break
                for ready in wait(busy, 0 if there_are_more else None):
                    self._take(busy[ready], done)  # type: ignore[index]
        except BaseException:  # a result that is still to come would be taken for a later one
            self.close()
            raise
        for number, one in enumerate(asked):
            if number not in done:
                done[number] = self._work(one), None
        found = [done[number] for number in range(len(asked))]
        return [result for result, _ in found], [number for _, number in found]

    def close(self) -> None:
        """End them: all of them at once, since giving back their memory takes a while."""
        for worker in self._workers.values():
            _kill(worker)
        for worker in [*self._workers.values()]:
            self._lose(worker)

    def _give(self, worker: _Worker, free: deque[int], asked: list[Task]) -> None:
        """Give a worker that has nothing to do its next task."""
        queue = worker.own or free
        if worker.task is None and queue:
            worker.task = queue.popleft()
            with contextlib.suppress(OSError):  # it is dead, as reading from it will show
                worker.connection.send_bytes(pickle.dumps(asked[worker.task]))

    def _take(self, worker: _Worker, done: dict[int, tuple[Result, int | None]]) -> None:
        """Take the result of a worker's task; one that has died is no more."""
        assert worker.task is not None
        try:
            good, value = pickle.loads(worker.connection.recv_bytes())
        except (EOFError, OSError):
            self._lose(worker)
            return
        if not good:
            raise value
        done[worker.task] = value, worker.number
        worker.task = None

    def _lose(self, worker: _Worker) -> None:
        del self._workers[worker.number]
        worker.connection.close()
        _kill(worker)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(worker.process, 0)

    def _fork(self, number: int) -> None:
        ours, theirs = Pipe()
        # A signal for all of the terminal's processes must not do in the worker what it does here.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        try:
            process = os.fork()
            if process == 0:
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
    """What a worker does until its input ends; `blocked`: signals that it is to block then."""
    status = 1
    try:
        # Ctrl-C is for the process that has forked it, which ends it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        # By others locks are held, and other workers; it must not outlive its parent with them.
        os.closerange(3, connection.fileno())
        os.closerange(max(3, connection.fileno() + 1), 1 << 16)
        gc.freeze()  # what there is now is not looked through here
        with contextlib.suppress(EOFError, OSError):
            while True:
                task = pickle.loads(connection.recv_bytes())
                try:
                    reply = pickle.dumps((True, work(task)))
                except BaseException as error:
                    reply = pickle.dumps((False, _sendable(error)))
                connection.send_bytes(reply)
        status = 0
    finally:
        os._exit(status)


def _sendable(error: BaseException) -> BaseException:
    """An exception that can be raised elsewhere."""
    error.add_note(f"in a worker:\n{traceback.format_exc()}")
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
