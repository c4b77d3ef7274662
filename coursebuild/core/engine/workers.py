"""Work spread over forked copies of this process.

Entry points: `Workers`, a context manager; `can_fork`, whether there can be any.

1. A worker is forked with all that this process has read and imported, and does one task at a time
   with the function that it was made with. What it remembers from one task to the next stays in it.
2. `map` gives each task to the worker that is named for it, or to the first that is free, and
   yields the results in the order of the tasks. Tasks are made while workers are at earlier ones.
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
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any, Generic, NoReturn, Self, TypeVar

from msgspec import Struct

Task = TypeVar("Task")
Result = TypeVar("Result")

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_AHEAD = 32
"""Tasks that are made before a worker is free for them."""


def can_fork() -> bool:
    """Whether this process can be copied: it has one thread, and nothing that a copy breaks."""
    if sys.platform == "darwin":
        return False
    # Threads do not come along into a copy, and MuJoCo has some of its own.
    return threading.active_count() == 1 and "mujoco" not in sys.modules


class _Worker(Struct, eq=False):
    number: int
    process: int
    connection: Connection
    task: int | None = None
    """The number of the one that it is at."""


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

    def map(self, tasks: Iterable[tuple[int | None, Task]]) -> Iterator[tuple[Result, int | None]]:
        """The results, in the order of the tasks, each with the worker that gave it.

        A task comes with the number of the worker that should do it, if any.
        """
        coming, there_are_more = enumerate(tasks), True
        asked: dict[int, Task] = {}
        """Tasks without a result."""
        waiting: list[tuple[int, int | None]] = []
        """Those that no worker is at, each with the one that should do it."""
        done: dict[int, tuple[Result, int | None]] = {}
        given = 0
        try:
            while there_are_more or asked or done:
                if hungry := there_are_more and len(waiting) < _AHEAD:
                    number, task = next(coming, (-1, None))
                    there_are_more = task is not None
                    if task is not None:
                        waiting.append((number, task[0]))
                        asked[number] = task[1]
                for worker in self._workers.values():
                    if worker.task is None and waiting:
                        self._give(worker, waiting, asked)
                busy = {w.connection: w for w in self._workers.values() if w.task is not None}
                if not busy and not hungry and waiting:
                    number, _ = waiting.pop(0)
                    done[number] = self._work(asked.pop(number)), None
                for ready in wait(busy, 0 if hungry or not busy else None):
                    self._take(busy[ready], asked, done)  # type: ignore[index]
                while given in done:
                    yield done.pop(given)
                    given += 1
        except BaseException:  # a result that is still to come would be taken for a later one
            self.close()
            raise

    def close(self) -> None:
        """End them: all of them at once, since giving back their memory takes a while."""
        for worker in self._workers.values():
            _kill(worker)
        for worker in [*self._workers.values()]:
            self._lose(worker)

    def _give(
        self, worker: _Worker, waiting: list[tuple[int, int | None]], asked: Mapping[int, Task]
    ) -> None:
        """Give a worker that has nothing to do a task: one for it, or else for nobody.

        Where too many wait, it takes that of another.
        """
        others = self._workers.keys() - {worker.number}
        own = next((one for one in waiting if one[1] == worker.number), None)
        free = next((one for one in waiting if one[1] not in others), None)
        chosen = own or free or (waiting[0] if len(waiting) >= _AHEAD else None)
        if chosen is not None:
            waiting.remove(chosen)
            worker.task = chosen[0]
            with contextlib.suppress(OSError):  # it is dead, as reading from it will show
                worker.connection.send_bytes(pickle.dumps(asked[worker.task]))

    def _take(
        self,
        worker: _Worker,
        asked: dict[int, Task],
        done: dict[int, tuple[Result, int | None]],
    ) -> None:
        """Take the result of a worker's task; the task of one that has died is done here."""
        assert worker.task is not None
        task = asked.pop(worker.task)
        try:
            good, value = pickle.loads(worker.connection.recv_bytes())
        except (EOFError, OSError):
            self._lose(worker)
            done[worker.task] = self._work(task), None
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
