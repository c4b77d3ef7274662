"""A command's work on the workers of a Dask scheduler.

Entry point: `start`, which makes a `Cluster`.

1. A worker is used after it was compared: another version of what decides results refuses it.
2. Each thread of a worker gets a task, or as many short ones as are worth a message, and before
   it those of the course's files that the worker has not. So its death costs the tasks that it was
   doing. They are done again, each alone on a worker, and one whose worker dies again and again is
   told as such.
3. A script's result counts if all that it looked at is the same here. Where it is not (a hidden
   file, another version of a package, a file of the worker's system) the script runs here.
4. What a script printed of its worker's folders is replaced by the folders of here.
5. However a command ends, its tasks are cancelled, and workers end what they do for it.
"""

from __future__ import annotations

import os
import queue
import secrets
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from msgspec import Struct

from coursebuild.api import (
    DECISIVE,
    EffectError,
    Interpreter,
    RunAll,
    RunStoppedError,
    ScriptJob,
    ScriptRun,
    ScriptServer,
    States,
    Store,
    find_sandbox,
)
from coursebuild_cluster import worker
from coursebuild_cluster.connection import connect
from coursebuild_cluster.course_copy import CourseReader
from coursebuild_cluster.messages import Answer, Request, Work, WorkerFacts, pack, unpack
from coursebuild_cluster.results import lost_run, run_as_here, would_differ, write_output

MOST_DEATHS = 3
"""How often the worker of a task may die."""
_INTERVAL = 0.2
"""Seconds between two looks at what is wanted, and at the workers."""
_WORTH = 0.5
"""Seconds of work that a message to a worker should hold: each costs some 0.04 s of processors."""
_MOST_SENDINGS = 3
"""How often files are sent that change all the time."""


def start(
    address: str, root: Path, jobs: int, sandbox: bool, say: Callable[[str], None]
) -> Cluster:
    """Connect with the scheduler at an address, or start one here.

    Raises:
        EffectError: there is none, or Dask is not installed.
    """
    client, resources = connect(address, jobs)
    return Cluster(client, address, root, say, resources, sandbox=sandbox)


class _Task(Struct, eq=False):
    """Something to be done by a worker."""

    number: int
    work: Work
    deaths: int = 0


class _Assignment(Struct, eq=False):
    """Tasks that a worker does, one after the other."""

    tasks: list[_Task]
    worker: str
    """Its address."""
    began: float
    """By the monotonic clock, s."""


class Cluster:
    """The workers of a scheduler."""

    def __init__(
        self,
        client: Any,
        address: str,
        root: Path,
        say: Callable[[str], None],
        resources: ExitStack,
        *,
        sandbox: bool,
    ) -> None:
        self._client, self._address, self._say = client, address, say
        self._resources, self._sandbox = resources, sandbox
        self._reader = CourseReader(root)
        self._session = secrets.token_hex(8)
        self._count = 0
        self._threads: dict[str, int] = {}
        """Of each worker that is used."""
        self._refusals: dict[str, str] = {}
        self._sent: dict[str, str] = {}
        """The digest of the course that each worker has."""
        self._looked = 0.0
        self._took = _WORTH
        """Seconds for a task, of those that were done last."""
        self._is_waiting = False
        self._running: dict[Any, _Assignment] = {}
        """By their futures."""
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def close(self) -> None:
        """Cancel what runs, and leave the scheduler."""
        try:
            self._cancel()
        finally:
            self._resources.close()

    @property
    def run(self) -> RunAll:
        """Run scripts, as `ScriptServer.run` does."""
        return self._run

    def map(self, function: str, root: Path, tasks: Sequence[bytes]) -> Iterator[bytes]:
        """Apply a function to tasks; a task that ends its workers is left to this process."""
        pending = [_Task(n, Work(function=function, task=task)) for n, task in enumerate(tasks)]
        pending.reverse()
        results: dict[int, bytes] = {}
        yielded = 0
        try:
            for task, answer in self._answers(
                lambda: pending.pop() if pending else None, lambda: len(pending)
            ):
                results[task.number] = answer.result
                while yielded in results:
                    yield results.pop(yielded)
                    yielded += 1
        finally:
            self._cancel()

    def _run(
        self,
        root: Path,
        jobs: Sequence[ScriptJob],
        *,
        parallel: int,
        on_start: Callable[[str], object] = lambda path: None,
        on_finish: Callable[[ScriptRun], object] = lambda run: None,
        interpreter: Interpreter | None = None,
        is_unwanted: Callable[[frozenset[str]], bool] | None = None,
        claim: Callable[[ScriptJob], ScriptRun | bool] = lambda job: True,
    ) -> tuple[ScriptRun, ...]:
        """See `ScriptServer.run`; `parallel` counts only for what runs here."""
        if interpreter is not None:
            message = f"--cluster: scripts of this course run with {interpreter.python}"
            help = "only the Python of the workers can run them there: take `python` out of the map"
            raise EffectError(message, help=help)
        runs: dict[int, ScriptRun] = {}
        pending, left = list(range(len(jobs))), list[int]()
        states = States(root, Store(root))

        def take() -> _Task | None:
            for index in [*pending]:
                answer = claim(jobs[index])
                if answer is False:
                    continue
                pending.remove(index)
                if answer is True:
                    on_start(jobs[index].path)
                    return _Task(index, Work(self._sandbox, jobs[index]))
                runs[index] = answer
            return None

        def is_wanted() -> None:
            running = frozenset(
                jobs[task.number].path
                for assignment in self._running.values()
                for task in assignment.tasks
            )
            if is_unwanted is not None and is_unwanted(running):
                raise RunStoppedError

        try:
            for task, answer in self._answers(take, lambda: len(pending), is_wanted):
                job = jobs[task.number]
                run = (
                    lost_run(job, task.deaths)
                    if answer.is_lost
                    else run_as_here(answer, states.places)
                )
                if run is None or (not answer.is_lost and would_differ(answer, states)):
                    left.append(task.number)
                    continue
                for path, data in answer.written:
                    write_output(root, job, path, data)
                runs[task.number] = run
                on_finish(run)
        finally:
            self._cancel()
        if left:
            sandbox = find_sandbox(root) if self._sandbox else None
            with ScriptServer(sandbox=sandbox) as server:
                jobs_here = [jobs[number] for number in left]
                runs_here = server.run(
                    root,
                    jobs_here,
                    parallel=parallel,
                    on_start=on_start,
                    on_finish=on_finish,
                    is_unwanted=is_unwanted,
                )
            runs |= dict(zip(left, runs_here, strict=True))
        return tuple(runs[number] for number in range(len(jobs)))

    # --- tasks

    def _answers(
        self,
        take: Callable[[], _Task | None],
        count: Callable[[], int],
        look: Callable[[], None] = lambda: None,
    ) -> Iterator[tuple[_Task, Answer]]:
        """Have tasks done as workers are free; yield the answers as they come.

        `take` gives a task that may begin now, `count` says how many are left. A task whose worker
        died waits for a worker that does nothing else, and has it for itself.
        """
        suspects: list[_Task] = []
        is_empty = False
        while True:
            look()
            self._look_at_workers()
            for address in self._free_workers():
                is_idle = all(assignment.worker != address for assignment in self._running.values())
                tasks = [] if is_empty else self._take_some(take, count())
                if not tasks and suspects and is_idle:
                    tasks = [suspects.pop()]
                if tasks:
                    self._begin(tasks, address)
                else:
                    is_empty = not count()
            if is_empty and not self._running and not suspects:
                return
            for task, answer in self._collect():
                if not answer.is_lost:
                    yield task, answer
                    continue
                task.deaths += 1
                if task.deaths >= MOST_DEATHS:
                    yield task, answer
                else:
                    suspects.append(task)

    def _take_some(self, take: Callable[[], _Task | None], left: int) -> list[_Task]:
        """As many tasks as are worth a message, but at the end not more than a fair share."""
        threads = sum(self._threads.values())
        most = min(_WORTH // max(self._took, _WORTH / 100), left // (2 * threads))
        tasks: list[_Task] = []
        while len(tasks) < max(1, most) and (task := take()) is not None:
            tasks.append(task)
        return tasks

    def _free_workers(self) -> list[str]:
        """Each worker as often as it has free threads, but none that does a suspect alone."""
        free: list[str] = []
        for address, threads in self._threads.items():
            assignments = [a for a in self._running.values() if a.worker == address]
            if not any(task.deaths for assignment in assignments for task in assignment.tasks):
                free += [address] * (threads - len(assignments))
        return free

    def _begin(self, tasks: list[_Task], address: str) -> None:
        """Give tasks to a worker, with the course as it is now."""
        environment = {name: os.environ[name] for name in DECISIVE if name in os.environ}
        try:
            course = self._send_course(address)
        except _WorkerLostError:
            self._threads.pop(address, None)
            self._done.put(None)
            self._running[object()] = _Assignment(tasks, "", 0.0)  # found to be lost by `_collect`
            return
        request = Request(course, environment, tuple(task.work for task in tasks))
        self._count += 1
        future = self._client.submit(
            worker.perform,
            pack(request),
            key=f"coursebuild-{self._session}-{self._count}",
            workers=[address],
            allow_other_workers=False,
            pure=False,
        )
        self._running[future] = _Assignment(tasks, address, time.monotonic())
        future.add_done_callback(self._done.put)

    def _collect(self) -> list[tuple[_Task, Answer]]:
        """Wait a moment for answers; those of workers that are gone say that they are lost."""
        answers: list[tuple[_Task, Answer]] = []
        try:
            futures = [self._done.get(timeout=_INTERVAL)]
            while not self._done.empty():
                futures.append(self._done.get())
        except queue.Empty:
            futures = []
        for future in futures:
            assignment = self._running.pop(future, None)
            if assignment is not None:
                answers += zip(assignment.tasks, self._read(future, assignment), strict=True)
        for future, assignment in list(self._running.items()):
            if assignment.worker not in self._threads:
                del self._running[future]
                if assignment.worker:
                    future.cancel()
                answers += [(task, Answer(is_lost=True)) for task in assignment.tasks]
        return answers

    def _read(self, future: Any, assignment: _Assignment) -> list[Answer]:
        from distributed import KilledWorker

        if future.status == "error":
            error = future.exception()
            if isinstance(error, KilledWorker):
                return [Answer(is_lost=True)] * len(assignment.tasks)
            raise EffectError(f"--cluster: {assignment.worker} cannot do anything: {error}")
        if future.status != "finished":
            raise EffectError(f"--cluster: the scheduler at `{self._address}` is gone")
        answers = unpack(future.result(), list[Answer])
        for answer in answers:
            if answer.refusal:
                message = f"--cluster: {assignment.worker}: {answer.refusal}"
                raise EffectError(message, help=answer.help)
            if answer.bug:
                raise RuntimeError(f"on the worker {assignment.worker}:\n{answer.bug}")
        if answers[0].is_lost:
            return answers * len(assignment.tasks)
        self._took = (time.monotonic() - assignment.began) / len(answers)
        return answers

    def _cancel(self) -> None:
        """Cancel what runs."""
        futures = [future for future, assignment in self._running.items() if assignment.worker]
        self._running.clear()
        if futures:
            self._client.cancel(futures, force=True)

    # --- workers

    def _look_at_workers(self) -> None:
        """See which workers there are; compare those that are new."""
        if time.monotonic() < self._looked + _INTERVAL and self._threads:
            return
        self._looked = time.monotonic()
        try:
            threads: dict[str, int] = dict(self._client.nthreads())
        except OSError:
            raise EffectError(f"--cluster: the scheduler at `{self._address}` is gone") from None
        new = [address for address in threads if address not in self._threads]
        new = [address for address in new if address not in self._refusals]
        for address, reply in self._call(new, worker.describe).items():
            if isinstance(reply, BaseException):
                if not isinstance(reply, OSError):
                    self._refuse(address, f"it cannot run coursebuild-cluster: {reply}")
            else:
                facts, own_facts = (unpack(data, WorkerFacts) for data in (reply, _own_facts()))
                for name, version in own_facts.versions.items():
                    their_version = facts.versions.get(name, "none")
                    if their_version != version:
                        self._refuse(address, f"it has {name} {their_version}, here is {version}")
                if address not in self._refusals:
                    self._threads[address] = 0
        self._threads = {a: n for a, n in threads.items() if a in self._threads}
        self._sent = {a: digest for a, digest in self._sent.items() if a in self._threads}
        if self._threads:
            return
        if threads and all(address in self._refusals for address in threads):
            address = next(iter(threads))
            help = "install the same there as here"
            raise EffectError(
                f"--cluster: no worker can be used: {self._refusals[address]}", help=help
            )
        if not self._is_waiting:
            self._is_waiting = True
            self._say(f"the cluster at {self._address} has no worker: waiting for one")
        if self._client.cluster is not None:  # `local`: Dask gives up one that dies while it starts
            self._client.cluster.scale(len(self._client.cluster.worker_spec))
        time.sleep(_INTERVAL)

    def _refuse(self, address: str, reason: str) -> None:
        self._refusals[address] = f"{address} is refused: {reason}"
        self._say(f"the worker {self._refusals[address]}")

    def _call(self, addresses: Iterable[str], function: Any, *arguments: object) -> dict[str, Any]:
        """What a function returns on workers, at once, whatever they do; or what it raises."""
        addresses = list(addresses)
        if not addresses:
            return {}
        replies: dict[str, Any] = self._client.run(
            function, *arguments, workers=addresses, on_error="return"
        )
        return replies

    def _send_course(self, address: str) -> str:
        """Let a worker have the course as it is now; return the digest of its copy."""
        for _ in range(_MOST_SENDINGS):
            digest = self._reader.read()
            if self._sent.get(address) == digest:
                return digest
            reply = self._ask(address, worker.missing, pack(self._reader.digests()))
            digests = unpack(reply, list[str])
            if not digests:
                self._sent[address] = digest
                return digest
            for pieces in self._reader.pieces(digests):
                self._ask(address, worker.store, pack(pieces), self._session)
            if not unpack(self._ask(address, worker.missing, pack(digests)), list[str]):
                self._sent[address] = digest
                return digest
        raise EffectError("--cluster: files of the course change all the time")

    def _ask(self, address: str, function: Any, *arguments: object) -> Any:
        reply = self._call([address], function, *arguments).get(address)
        if isinstance(reply, OSError) and reply.errno:
            raise EffectError(f"--cluster: {address}: {reply}")
        if isinstance(reply, OSError) or (reply is None and function is not worker.store):
            raise _WorkerLostError
        if isinstance(reply, BaseException):
            raise EffectError(f"--cluster: {address}: {reply}")
        return reply


class _WorkerLostError(Exception):
    """A worker does not answer any more."""


_facts = b""


def _own_facts() -> bytes:
    global _facts
    _facts = _facts or worker.describe()
    return _facts
