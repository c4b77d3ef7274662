"""The process that runs scripts for `runner` and sees to it that nothing stays behind.

Entry point: `main`, called by the program `worker_main`.

It runs one script after another, each in a session of its own, so that

1. every process that a script starts is found and killed when the script ends, daemons too: on
   Linux an orphan becomes the child of this process;
2. when the tool dies, by whatever signal, this process sees its input close and kills what runs;
3. when this process dies, the system kills the script (Linux).

Importing NumPy and MuJoCo takes longer than most scripts. So this process imports them once, and
scripts are copies of it. Where that cannot be, it starts this program anew for each script. It has
one thread, so that it may fork.

The protocol: JSON objects, each after its length in 4 bytes; from the tool a `Job`, and to it for
each one a `ChildReport` (see `workers`).
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import gc
import importlib
import itertools
import json
import mmap
import os
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from coursebuild.core.run.script_process import (
    Job,
    Preloaded,
    ScriptProcess,
    figure_path,
    notes_folder,
)
from coursebuild.core.run.watching import (
    STDERR_KEPT,
    STDOUT_LIMIT,
    RunningScript,
    has_ended,
)

LENGTH = struct.Struct(">I")
PROGRAM = str(Path(__file__).with_name("worker_main.py"))

FIGURE_LIMIT = 4 << 20
"""Bytes that a figure may have."""
_NOTES_BYTES = 1 << 20
"""What a script may note of what it looks at, before the rest goes to files."""
_OUR_FRAME = re.compile(rb'  File "%s", line \d+ in <module>\n' % re.escape(os.fsencode(PROGRAM)))
"""What Python's fault handler says of `worker_main`, below the script's own frames."""
_COUNTER = itertools.count()
_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_PR_SET_CHILD_SUBREAPER = 36
_SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTERM, signal.SIGCHLD)


def main(arguments: Sequence[str], bare: Collection[str]) -> ScriptProcess:
    """Run what the tool asks for until it closes the pipe; only a script's process returns.

    The arguments are descriptors: where jobs are read and where reports are written, and whether
    scripts may be copies of this process; or a `Job` as JSON, for which this program is started.
    `bare` are the modules that every Python has from its start.
    """
    if len(arguments) == 1:
        return _alone(json.loads(arguments[0]), bare)
    jobs, reports, fork = map(int, arguments)
    os.set_inheritable(jobs, False)
    os.set_inheritable(reports, False)
    tool = os.getppid()
    supervisor = _Supervisor(jobs, reports, may_fork=bool(fork))
    status = 0
    try:
        script = supervisor.work()
        if script is not None:
            return script
    except SystemExit as end:
        status = int(end.code or 0)
    except Exception:  # a bug: the tool shows it as what the script has said
        _send(reports, _unstartable(traceback.format_exc()))
        status = 70
    # While the tool lives the folder is its own: another supervisor may be about to use it.
    if supervisor.scratch and has_ended(tool):
        remove_folder(supervisor.scratch)
    os._exit(status)


def _alone(job: Job, bare: Collection[str]) -> ScriptProcess:
    """The script that this process was started for."""
    preloaded = Preloaded()
    shadowed = _beside(job) & preloaded.names()
    if not shadowed:
        preloaded.load(job["packages"])
    for name in [name for name in sys.modules if name.partition(".")[0] in shadowed]:
        if name not in bare:
            del sys.modules[name]
    return ScriptProcess(job, os.environ, None, preloaded)


class _Supervisor:
    """Where jobs come from, and reports go to."""

    def __init__(self, jobs: int, reports: int, *, may_fork: bool) -> None:
        self.jobs = jobs
        self.reports = reports
        self.may_fork = may_fork
        self.preloaded = Preloaded()
        self.has_library = not missing_modules(["mjcourse"], [], "")
        """Whether scripts find `mjcourse` without being told where."""
        self.awake, wake = os.pipe()
        os.set_blocking(self.awake, False)
        os.set_blocking(wake, False)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
        self.libc = ctypes.CDLL(None) if sys.platform == "linux" else None
        if self.libc is not None:
            self.libc.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        os.chdir("/")
        self.scratch = ""

    def work(self) -> ScriptProcess | None:
        """Serve until the input closes; a script in a process that is to become it."""
        while (message := _receive(self.jobs)) is not None:
            job: Job = json.loads(message)
            self.scratch = job["scratch"]
            answer = self._serve(job)
            if isinstance(answer, ScriptProcess):
                return answer
            _send(self.reports, answer)
        return None

    def _serve(self, job: Job) -> bytes | ScriptProcess:
        """The report on a script, or the script itself in the process that is to become it."""
        folder_of_script = Path(job["root"], job["path"]).parent
        path = [str(folder_of_script), *job["folders"]]
        missing = missing_modules(job["requires"], path, job["library"])
        if missing:
            return _report("skipped", missing=missing)
        if not os.path.isfile(f"{job['root']}/{job['path']}"):  # noqa: PTH113 (here time counts)
            return _unstartable(f"there is no file {job['path']}\n")
        environment = dict(job["environment"])
        path = job["folders"] if self.has_library else [*job["folders"], job["library"]]
        if path:
            environment["PYTHONPATH"] = os.pathsep.join(path)
        if self.may_fork:
            self.preloaded.load(job["packages"])
        folder = ""
        launched: RunningScript | ScriptProcess | None = None
        try:
            try:
                for written, place in job["copied"]:
                    shutil.copytree(place, written, symlinks=True, dirs_exist_ok=True)
                folder = _temporary(job["scratch"])
                parent = os.getppid()  # now, since a script may end it as soon as it runs
                launched = self._launch(job, environment | {"TMPDIR": folder})
            except (OSError, ValueError) as error:  # a ValueError: an argument has a null character
                return _unstartable(f"the script cannot be started: {error}\n")
            if isinstance(launched, ScriptProcess):
                return launched
            try:
                launched.watch(self.jobs, parent)
            finally:
                launched.end()
            trace = _notes(launched.shared, notes_folder(folder))
            return _finished(launched, trace, _drawn(folder, job["figures"]))
        finally:
            if folder and not isinstance(launched, ScriptProcess):
                remove_folder(folder)
                remove_folder(notes_folder(folder))

    def _launch(self, job: Job, environment: dict[str, str]) -> RunningScript | ScriptProcess:
        """Start a script; the script itself in the process that is to become it."""
        if any(b"\0" in os.fsencode(argument) for argument in job["args"]):
            raise ValueError("embedded null byte")
        (out, stdout), (err, stderr) = os.pipe(), os.pipe()
        try:
            prepare = functools.partial(self._prepare_script, job, stdout, stderr, os.getpid())
            if not self._can_fork(job):
                pid = _spawn(job, environment, prepare)
                return RunningScript(pid, (out, err), None, job["timeout"], self.awake)
            shared = mmap.mmap(-1, _NOTES_BYTES)
            gc.freeze()  # a script's collector shall not look at, and so copy, what is here
            pid = os.fork()
            if pid == 0:
                prepare()
                signal.set_wakeup_fd(-1)
                os.closerange(3, max(self.awake, stderr, self.reports) + 16)
                return ScriptProcess(job, environment, shared, self.preloaded)
            return RunningScript(pid, (out, err), shared, job["timeout"], self.awake)
        except BaseException:
            os.close(out)
            os.close(err)
            raise
        finally:
            with contextlib.suppress(OSError):  # closed in a script
                os.close(stdout)
                os.close(stderr)

    def _can_fork(self, job: Job) -> bool:
        """Whether a copy of this process would be what a fresh interpreter is to this script."""
        if not self.may_fork or self.preloaded.broken or _has_threads():
            return False
        return _beside(job).isdisjoint(self.preloaded.names())

    def _prepare_script(self, job: Job, stdout: int, stderr: int, parent: int) -> None:
        """What a script's process does first: a session, pipes, signals and limits of its own."""
        os.setsid()
        if self.libc is not None:  # the system ends it when this process ends
            self.libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
            if os.getppid() != parent:
                os._exit(1)
        os.dup2(stdout, 1)
        os.dup2(stderr, 2)
        for number in _SIGNALS:  # `nohup coursebuild` must not make scripts deaf
            interrupt = number == signal.SIGINT
            signal.signal(number, signal.default_int_handler if interrupt else signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash leaves no file in the project
        memory, (_, most) = job["memory"] << 20, resource.getrlimit(resource.RLIMIT_DATA)
        if most == resource.RLIM_INFINITY or most > memory:
            resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
        os.chdir(job["root"])


def _beside(job: Job) -> frozenset[str]:
    """What stands where the script looks first, as names of modules."""
    found: set[str] = set()
    for folder in (os.path.dirname(f"{job['root']}/{job['path']}"), *job["folders"]):  # noqa: PTH120
        with contextlib.suppress(OSError):
            found.update(name.partition(".")[0] for name in os.listdir(folder))  # noqa: PTH208
    return frozenset(found)


def _spawn(job: Job, environment: Mapping[str, str], prepare: Callable[[], None]) -> int:
    """Start this program for one script."""
    process = subprocess.Popen(
        [sys.executable, PROGRAM, json.dumps(job)],
        env=environment,
        stdin=subprocess.DEVNULL,
        preexec_fn=prepare,  # safe: there is no other thread
    )
    process.returncode = 0  # who watches the script reaps it
    return process.pid


def _notes(shared: mmap.mmap | None, overflow: str) -> bytes:
    """What a script has noted, in shared memory and in files of a folder."""
    parts = []
    if shared is not None:
        end = shared.find(b"\0\0")
        parts.append(shared[: end if end >= 0 else len(shared)])
        shared.close()
    with contextlib.suppress(OSError):
        for path in sorted(Path(overflow).iterdir()):
            with contextlib.suppress(OSError):
                if path.is_file():
                    parts.append(path.read_bytes())
    return b"\0".join(parts)


def _has_threads() -> bool:
    with contextlib.suppress(OSError):
        return len(os.listdir("/proc/self/task")) > 1  # noqa: PTH208 (here time counts)
    return True


def missing_modules(names: Sequence[str], folders: Sequence[str], library: str) -> list[str]:
    """Which of these modules a script could not import that looks in `folders` first."""
    if not names:
        return []
    importlib.invalidate_caches()
    path = [*folders, *sys.path, *([library] if library else [])]
    return [name for name in names if not _exists(name, path)]


def _exists(name: str, path: Sequence[str]) -> bool:
    top, saved = True, sys.path
    for end in (at for at, c in enumerate(f"{name}.") if c == "."):
        if not name[:end].rpartition(".")[2].isidentifier():
            return False
        spec = None
        try:
            sys.path = list(path) if top else saved
            for finder in sys.meta_path:
                with contextlib.suppress(Exception):  # that of some package may do anything
                    spec = spec or finder.find_spec(name[:end], None if top else path)
        finally:
            sys.path = saved
        if spec is None:
            return False
        path, top = spec.submodule_search_locations or (), False
    return True


def _temporary(scratch: str) -> str:
    """A fresh folder in `scratch`, which another supervisor may have found empty and removed."""
    while True:
        folder = f"{scratch}/{os.getpid()}-{next(_COUNTER)}"
        try:
            os.mkdir(folder, 0o700)  # noqa: PTH102
            return folder
        except FileExistsError:
            continue
        except FileNotFoundError:
            with contextlib.suppress(FileExistsError):
                Path(scratch).mkdir(mode=0o700, parents=True)


def _drawn(folder: str, names: Sequence[str]) -> list[bytes | None]:
    """The figures in a script's temporary folder; `None` for what it did not draw.

    One that is too large is cut, so that it is none that can be shown.
    """
    found: list[bytes | None] = []
    for name in names:
        path = Path(figure_path(folder, name))
        data = None
        with contextlib.suppress(OSError):
            if path.is_file():  # to open a pipe may take for ever
                with path.open("rb") as file:
                    data = file.read(FIGURE_LIMIT + 1)
        found.append(data)
    return found


def _finished(run: RunningScript, trace: bytes, figures: Sequence[bytes | None]) -> bytes:
    stdout, stderr = bytes(run.stdout[:STDOUT_LIMIT]), bytes(run.stderr[-STDERR_KEPT:])
    status = run.exit_status()
    outcome = run.limit or ("killed" if status < 0 else "failed" if status else "ok")
    parts = stdout, _OUR_FRAME.sub(b"", stderr), trace, *figures
    return _report(outcome, abs(status), run.seconds, parts=parts)


def _unstartable(text: str) -> bytes:
    return _report("failed", 2, parts=(b"", text.encode(), b""))


def _report(
    outcome: str,
    status: int = 0,
    seconds: float = 0.0,
    missing: Sequence[str] = (),
    parts: Sequence[bytes | None] = (b"", b"", b""),
) -> bytes:
    """A `ChildReport` as it is sent."""
    report = {
        "outcome": outcome,
        "status": status,
        "seconds": seconds,
        "missing": list(missing),
        "parts": [None if part is None else part.decode("latin-1") for part in parts],
    }
    data = json.dumps(report, ensure_ascii=False).encode()
    return LENGTH.pack(len(data)) + data


def remove_folder(folder: str) -> None:
    """Remove a script's temporary folder, also where it took away its own permissions."""
    try:
        os.rmdir(folder)  # noqa: PTH106 (mostly it is empty)
        return
    except FileNotFoundError:
        return
    except OSError:
        pass
    shutil.rmtree(folder, ignore_errors=True)
    if Path(folder).exists():
        with contextlib.suppress(OSError):
            for parent, _, _ in os.walk(folder):
                Path(parent).chmod(0o700)
        shutil.rmtree(folder, ignore_errors=True)


def _receive(fd: int) -> bytes | None:
    """The next message, after which no other comes before the report; `None` at the end."""
    with open(fd, "rb", closefd=False) as pipe:
        header = pipe.read(LENGTH.size)
        length = LENGTH.unpack(header)[0] if len(header) == LENGTH.size else -1
        message = pipe.read(max(length, 0))
    return message if len(message) == length else None


def _send(fd: int, data: bytes) -> None:
    with open(fd, "wb", closefd=False) as pipe:
        pipe.write(data)
