"""Running scripts on an existing Dask cluster, where one machine is not enough.

Entry points: `run_on_dask`, which does what `runner.run_scripts` does; `is_dask`.

1. The course's files travel as one archive, which the scheduler hands to whoever needs it.
2. As many scripts are under way as the cluster has threads, so that the longest begin first.
3. A worker that is lost costs a retry, which is the scheduler's affair, like an archive that was
   lost with it. A script under which worker after worker is lost counts as killed.
4. A worker on which something else is installed runs nothing: its results would be others.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import logging
import warnings
import zipfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run import dask_task
from coursebuild.core.run.runner import RunEvent, RunFinished, RunStarted

_SCHEMES = {"dask": "tcp", "dask+tls": "tls"}
_TRIES = 3
"""How often a script is handed out."""
_LARGEST = 512 << 20
"""Bytes of course that are sent."""
_NEVER = frozenset({"__pycache__", "node_modules", "public"})
"""Folders that hold nothing a script needs."""


def is_dask(url: str) -> bool:
    """Whether an executor is a Dask cluster.

    `dask://HOST:PORT`, or `dask+tls://` with the certificates that Dask is configured with.
    """
    scheme, _, place = url.partition("://")
    host, _, port = place.rpartition(":")
    return scheme in _SCHEMES and bool(host) and port.isdecimal() and int(port) < 65536


def run_on_dask(
    url: str,
    root: Path,
    jobs: Sequence[ScriptJob],
    *,
    on_event: Callable[[RunEvent], None] | None = None,
    patience: float = 15.0,
) -> tuple[ScriptRun, ...]:
    """Run scripts on a cluster; those marked `norun` are not, and cause no event.

    Args:
        url: `dask://HOST:PORT`.
        root: the course folder.
        jobs: what to run, started in this order.
        on_event: is told of every start and end, in this thread.
        patience: seconds to wait for the scheduler, and then for a first worker.

    Returns:
        What each did, in the order of the jobs.

    Raises:
        EffectError: the cluster is not there, or cannot be used.
    """
    root = root.resolve()
    work = _Work(root, jobs, on_event or (lambda event: None))
    if work.waiting:
        with _client(url, patience) as client:
            try:
                _Cluster(client, url, work, archive(root)).run(patience)
            except (OSError, TimeoutError) as error:
                raise _gone(url, error) from None
    return tuple(work.runs[index] for index in range(len(jobs)))


def archive(root: Path) -> bytes:
    """The files of a course that scripts may need, as a zip file; the same files, the same bytes.

    Raises:
        EffectError: they are too many to be sent.
    """
    buffer = io.BytesIO()
    total = 0
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as files:
        for path in _files(root, root):
            total += path.stat().st_size
            if total > _LARGEST:
                raise EffectError(
                    f"the course has more than {_LARGEST >> 20} MiB of files, too much to send",
                    help="move what no script needs out of its folder",
                )
            files.writestr(zipfile.ZipInfo(path.relative_to(root).as_posix()), path.read_bytes())
    return buffer.getvalue()


def _files(folder: Path, root: Path) -> Iterator[Path]:
    """Every file but hidden ones, built sites and environments; sorted."""
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.name.endswith("~") or path.name in _NEVER:
            continue
        if path.is_symlink() and not path.resolve().is_relative_to(root):
            continue
        if path.is_dir():
            foreign = (path / MARKER).exists() or (path / "pyvenv.cfg").exists()
            if not foreign and not path.is_symlink():
                yield from _files(path, root)
        elif path.is_file():
            yield path


@contextlib.contextmanager
def _client(url: str, patience: float) -> Iterator[Any]:
    """A connection to the cluster, silent about what is no news here."""
    distributed = _distributed()
    scheme, _, place = url.partition("://")
    log = logging.getLogger("distributed")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        address = f"{_SCHEMES[scheme]}://{place}"
        try:
            client = distributed.Client(
                address, timeout=patience, set_as_default=False, name="coursebuild"
            )
        except (OSError, TimeoutError, ValueError) as error:
            raise EffectError(
                f"the Dask scheduler {url} cannot be reached: {_first_line(error)}"
            ) from None
        try:
            yield client
        finally:
            client.close(timeout=5.0)
    finally:
        log.setLevel(before)


def _distributed() -> Any:
    """The package, which is imported when it is needed, and has no types."""
    try:
        return importlib.import_module("distributed")
    except ImportError:
        raise EffectError(
            "Dask is not installed", help="run `pip install 'coursebuild[dask]'`"
        ) from None


class _Work:
    """What is to be done, and what is done."""

    def __init__(
        self, root: Path, jobs: Sequence[ScriptJob], tell: Callable[[RunEvent], None]
    ) -> None:
        self.root = root
        self.jobs = jobs
        self.tell = tell
        self.runs: dict[int, ScriptRun] = {
            i: ScriptRun(job.path, Outcome.NORUN, 0, "", "", 0.0)
            for i, job in enumerate(jobs)
            if job.norun
        }
        self.waiting = [i for i in range(len(jobs)) if i not in self.runs]
        self.total = len(self.waiting)
        self.done = 0
        self.tries = dict.fromkeys(self.waiting, 0)

    def take(self) -> int | None:
        """The next job's index."""
        if not self.waiting:
            return None
        index = self.waiting.pop(0)
        if not self.tries[index]:
            self.tell(RunStarted(self.jobs[index].path, self.total))
        self.tries[index] += 1
        return index

    def finish(self, index: int, run: ScriptRun) -> None:
        self.runs[index] = run
        self.done += 1
        self.tell(RunFinished(run, self.done, self.total))

    def lost(self, index: int) -> None:
        """What this job needed was lost: it is handed out again, but not for ever."""
        if self.tries[index] < _TRIES:
            self.waiting.insert(0, index)
        else:
            self.killed(index)

    def killed(self, index: int) -> None:
        """The scheduler has handed the job out again and again, and lost each worker with it."""
        text = "worker after worker was lost while this script ran\n"
        self.finish(index, ScriptRun(self.jobs[index].path, Outcome.KILLED, 9, "", text, 0.0))


class _Cluster:
    """Hands out jobs and takes in results."""

    def __init__(self, client: Any, url: str, work: _Work, data: bytes) -> None:
        self.client = client
        self.url = url
        self.work = work
        self.data = data
        self.facts = dask_task.facts()
        self.running: dict[Any, int] = {}
        self.completed = _distributed().as_completed([], loop=client.loop)
        self.sent: Any = None

    def run(self, patience: float) -> None:
        self._wait_for_workers(patience)
        try:
            self._hand_out()
            while self.running:
                future = next(self.completed)
                index = self.running.pop(future)
                self._take(index, future)
                self._hand_out()
        finally:
            if self.running:
                self.client.cancel(list(self.running), force=True)

    def _wait_for_workers(self, patience: float) -> None:
        try:
            self.client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise EffectError(f"the Dask cluster {self.url} has no workers") from None

    def _hand_out(self) -> None:
        if not self.work.waiting:
            return
        self._alive()
        slots = max(1, sum(self.client.nthreads().values()))
        while len(self.running) < slots and (index := self.work.take()) is not None:
            request = dask_task.Request(self.work.jobs[index], self.facts, str(self.work.root))
            future = self.client.submit(
                dask_task.run_job,
                self._archive(),
                msgspec.json.encode(request),
                key=f"coursebuild-{id(self):x}-{index}-{self.work.tries[index]}",
                pure=False,
            )
            self.running[future] = index
            self.completed.add(future)

    def _archive(self) -> Any:
        """The course on the cluster.

        It is the result of a task, not data that was scattered: what is lost with a worker the
        scheduler makes again by itself.
        """
        if self.sent is None:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Sending large graph")  # it is sent once
                self.sent = self.client.submit(
                    dask_task.hold, self.data, key=f"coursebuild-{id(self):x}", pure=False
                )
        return self.sent

    def _take(self, index: int, future: Any) -> None:
        if future.status == "finished":
            self._result(index, msgspec.json.decode(future.result(), type=dask_task.Reply))
            return
        error = future.exception() if future.status == "error" else None
        if isinstance(error, _distributed().KilledWorker):
            self.work.killed(index)
        elif error is not None:
            raise EffectError(
                f"a worker of {self.url} cannot run scripts: {_first_line(error)}",
                help="the same coursebuild must be installed on every worker",
            )
        else:
            self._alive()
            self.work.lost(index)

    def _result(self, index: int, reply: dask_task.Reply) -> None:
        if reply.run is None:
            theirs = dict(reply.facts)
            differ = [
                f"{name} is {theirs.get(name, 'none')} there and {ours} here"
                for name, ours in self.facts
                if theirs.get(name) != ours
            ]
            raise EffectError(
                f"a worker of {self.url} would give other results: {'; '.join(differ)}",
                help="install the same versions on every worker",
            )
        self.work.finish(index, reply.run)

    def _alive(self) -> None:
        if self.client.status != "running":
            raise _gone(self.url, None)


def _gone(url: str, error: Exception | None) -> EffectError:
    why = f": {_first_line(error)}" if error is not None and str(error) else ""
    return EffectError(f"the Dask cluster {url} went away{why}")


def _first_line(error: BaseException) -> str:
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0][:300]
