"""The process that runs scripts for `script_server` and cleans up after them.

It runs one script after another, each in a session of its own, so that

1. every process that a script starts is found and killed when the script ends, daemons too: on
   Linux an orphan becomes the child of this process;
2. when the tool dies, by whatever signal, this process sees its input close and kills what runs;
3. when this process dies, the system kills the script (Linux).

Importing NumPy and MuJoCo takes longer than most scripts. So this process imports them once, and
runs scripts in copies of itself, which it may as it has one thread. Where that is impossible, it
starts this program anew for each script.

The protocol: JSON objects, each after its length in 4 bytes; from the tool a `Job`, and back a
`ChildReport` for each (see `script_worker`), after `STARTED` if there is something to wait for. In
a sandbox this process is the first one, with number 1: signals from in there do not reach it, and
nobody in there may look into it.
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
import select
import shutil
import signal
import subprocess
import sys
import traceback
from collections.abc import Collection, Sequence
from pathlib import Path

from coursebuild.core.engine.lifetime import end_with_parent
from coursebuild.core.files.locks import remove_folder
from coursebuild.core.run.part_marks import split_output
from coursebuild.core.run.script_process import (
    Job,
    PreloadedPackages,
    ScriptProcess,
    figure_path,
    notes_folder,
)
from coursebuild.core.run.watching import (
    LENGTH,
    PROGRAM,
    STARTED,
    STDERR_KEPT,
    STDOUT_LIMIT,
    RunningScript,
    has_ended,
)

FIGURE_LIMIT = 4 << 20
"""Bytes that a figure may have."""
_NOTES_BYTES = 1 << 20
"""The bytes of shared memory for a script's notes; further notes go to files."""
_OUR_FRAME = re.compile(rb'  File "%s", line \d+ in <module>\n' % re.escape(os.fsencode(PROGRAM)))
"""The frame of `script_main` in Python's fault dumps, below the script's own frames."""
_COUNTER = itertools.count()
_PROCESSES = 4096
"""Processes of its user that a script in a sandbox may see started; the tool allows fewer."""
_FIRST = 1
"""The number of this process in a sandbox."""
_PR_SET_DUMPABLE = 4  # linux/prctl.h
_PR_SET_CHILD_SUBREAPER = 36
_SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTERM, signal.SIGCHLD)


def main(arguments: Sequence[str], initial_modules: Collection[str]) -> ScriptProcess:
    """Run what the tool asks for until it closes the pipe; only a script's process returns.

    The arguments are descriptors: where jobs are read and where reports are written, and whether
    scripts may be copies of this process; or a `Job` as JSON, for which this program is started.
    `initial_modules` are the modules that every Python has from its start.
    """
    if len(arguments) == 1:
        # The script that this process was started for
        job = json.loads(arguments[0])
        preloaded = PreloadedPackages()
        shadowed = _sibling_names(job) & preloaded.names()
        if not shadowed:
            preloaded.load(job["packages"])
        for name in [name for name in sys.modules if name.partition(".")[0] in shadowed]:
            if name not in initial_modules:
                del sys.modules[name]
        return ScriptProcess(job, os.environ, None, preloaded)
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
    except Exception:  # a bug: the tool shows it as the script's error output
        _send(reports, _report_unstartable(traceback.format_exc()))
        status = 70
    # While the tool lives it owns the folder: another supervisor may be about to use it.
    if supervisor.scratch and has_ended(tool):
        remove_folder(supervisor.scratch)
    os._exit(status)


class _Supervisor:
    def __init__(self, jobs: int, reports: int, *, may_fork: bool) -> None:
        self.jobs = jobs
        self.reports = reports
        self.may_fork = may_fork
        self.preloaded = PreloadedPackages()
        self.has_library = not missing_modules(["mjcourse"], [], "")
        """Whether scripts find `mjcourse` without being told where."""
        self.awake, wake = os.pipe()
        os.set_blocking(self.awake, False)
        os.set_blocking(wake, False)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        if os.getpid() != _FIRST:  # which gets only the signals that it handles
            signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
        self.libc = ctypes.CDLL(None) if sys.platform == "linux" else None
        if self.libc is not None:
            self.libc.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
            if os.getpid() == _FIRST:
                self.libc.prctl(_PR_SET_DUMPABLE, 0, 0, 0, 0)
                if sys.version_info >= (3, 14):  # Python's default listens at a socket in a folder
                    from multiprocessing import context

                    context._default_context._default_context = context._concrete_contexts["spawn"]
        os.chdir("/")
        self.scratch = ""

    def work(self) -> ScriptProcess | None:
        """Serve until the input closes; in the process of a script, return the script."""
        while True:
            # A signal between Python's last look for one and the call that waits would not end a
            # read.
            poll = select.poll()
            for fd in (self.jobs, self.awake):
                poll.register(fd, select.POLLIN)
            while self.jobs not in dict(poll.poll()):
                with contextlib.suppress(BlockingIOError):
                    os.read(self.awake, 4096)
            with open(self.jobs, "rb", closefd=False) as pipe:  # no job follows before the report
                header = pipe.read(LENGTH.size)
                length = LENGTH.unpack(header)[0] if len(header) == LENGTH.size else -1
                message = pipe.read(max(length, 0))
            if len(message) != length:
                return None
            job: Job = json.loads(message)
            self.scratch = job["scratch"]
            answer = self._serve(job)
            if isinstance(answer, ScriptProcess):
                return answer
            _send(self.reports, answer)

    def _serve(self, job: Job) -> bytes | ScriptProcess:
        """The report on a script; in the process of the script, the script itself."""
        folder_of_script = Path(job["root"], job["path"]).parent
        path = [str(folder_of_script), *job["folders"]]
        missing = missing_modules(job["requires"], path, job["library"])
        if missing:
            return _report("skipped", missing=missing)
        if not os.path.isfile(f"{job['root']}/{job['path']}"):  # noqa: PTH113 (here time counts)
            return _report_unstartable(f"there is no file {job['path']}\n")
        environment = dict(job["environment"])
        path = job["folders"] if self.has_library else [*job["folders"], job["library"]]
        if path:
            environment["PYTHONPATH"] = os.pathsep.join(path)
        if self.may_fork:
            self.preloaded.load(job["packages"])
        mark = os.urandom(16)  # which a script prints only where it was told to
        job["part_mark"] = mark.hex()
        folder = ""
        script: RunningScript | ScriptProcess | None = None
        try:
            try:
                for writable, content in job["copies"]:
                    shutil.copytree(
                        content, writable, symlinks=True, ignore=_special_names, dirs_exist_ok=True
                    )
                os.makedirs(job["scratch"], 0o700, exist_ok=True)  # noqa: PTH103 (in a sandbox)
                folder = f"{job['scratch']}/{os.getpid()}-{next(_COUNTER)}"
                os.mkdir(folder, 0o700)  # noqa: PTH102
                parent = os.getppid()  # now, since a script may end it as soon as it runs
                script = self._launch(job, environment | {"TMPDIR": folder})
            except OSError as error:
                return _report_unstartable(f"the script cannot be started: {error}\n", error.errno)
            if isinstance(script, ScriptProcess):
                return script
            _send(self.reports, STARTED)
            try:
                script.watch(self.jobs, parent)
            finally:
                script.end()
            trace = _read_notes(script.shared, notes_folder(folder))
            stdout, part_starts = split_output(bytes(script.stdout), mark)
            stdout, stderr = stdout[:STDOUT_LIMIT], script.stderr[-STDERR_KEPT:]
            paths = (Path(figure_path(folder, name)) for name in job["figures"])
            # One that is too large is cut off, so that it cannot be shown.
            figures = (_read_regular(path, FIGURE_LIMIT + 1) for path in paths)
            parts = stdout, _OUR_FRAME.sub(b"", bytes(stderr)), trace, *figures
            status = script.exit_status()
            outcome = script.limit or ("killed" if status < 0 else "failed" if status else "ok")
            return _report(
                outcome, abs(status), script.seconds, parts=parts, part_starts=part_starts
            )
        finally:
            if folder and not isinstance(script, ScriptProcess):
                remove_folder(folder)
                remove_folder(notes_folder(folder))

    def _launch(self, job: Job, environment: dict[str, str]) -> RunningScript | ScriptProcess:
        """Start a script; in its own process, return the script itself."""
        if any(b"\0" in os.fsencode(argument) for argument in job["args"]):
            raise OSError("an argument has a null character")
        (out, stdout), (err, stderr) = os.pipe(), os.pipe()
        try:
            prepare = functools.partial(self._prepare_script, job, stdout, stderr, os.getpid())
            if not self._can_fork(job):
                process = subprocess.Popen(
                    [sys.executable, PROGRAM, json.dumps(job)],
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    preexec_fn=prepare,  # safe: there is no other thread
                )
                process.returncode = 0  # `RunningScript` reaps it
                return RunningScript(process.pid, (out, err), None, job["timeout"], self.awake)
            shared = _shared_memory(environment["TMPDIR"])
            gc.freeze()  # else a script's garbage collector would touch, and so copy, our memory
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
        """Whether this script cannot tell a copy of this process from a fresh interpreter."""
        try:
            threads = len(os.listdir("/proc/self/task"))  # noqa: PTH208 (here time counts)
        except OSError:
            return False
        if not self.may_fork or self.preloaded.is_broken or threads > 1:
            return False
        return _sibling_names(job).isdisjoint(self.preloaded.names())

    def _prepare_script(self, job: Job, stdout: int, stderr: int, parent: int) -> None:
        os.setsid()
        if self.libc is not None:
            self.libc.prctl(_PR_SET_DUMPABLE, 1, 0, 0, 0)
        end_with_parent(parent)
        os.dup2(stdout, 1)
        os.dup2(stderr, 2)
        for number in _SIGNALS:  # `nohup coursebuild` must not make scripts deaf
            interrupt = number == signal.SIGINT
            signal.signal(number, signal.default_int_handler if interrupt else signal.SIG_DFL)
        _lower_limit(resource.RLIMIT_CORE, 0)  # a crash leaves no file in the project
        if parent == _FIRST:  # before the tool has seen them; not for root
            _lower_limit(resource.RLIMIT_NPROC, _PROCESSES)
        _lower_limit(resource.RLIMIT_DATA, job["memory"] << 20)
        os.chdir(job["root"])


def _lower_limit(limit: int, number: int) -> None:
    """Set a limit of this process, unless it may not have as much."""
    if not 0 <= resource.getrlimit(limit)[1] < number:  # no limit is -1
        resource.setrlimit(limit, (number, number))


def _special_names(folder: str, names: Sequence[str]) -> list[str]:
    """The files that cannot be copied: sockets, pipes and devices."""
    paths = {name: Path(folder, name) for name in names}
    return [n for n, p in paths.items() if not (p.is_symlink() or p.is_dir() or p.is_file())]


def _sibling_names(job: Job) -> frozenset[str]:
    names: set[str] = set()
    for folder in (os.path.dirname(f"{job['root']}/{job['path']}"), *job["folders"]):  # noqa: PTH120
        with contextlib.suppress(OSError):
            names.update(name.partition(".")[0] for name in os.listdir(folder))  # noqa: PTH208
    return frozenset(names)


def _shared_memory(folder: str) -> mmap.mmap:
    if os.getpid() != _FIRST:
        return mmap.mmap(-1, _NOTES_BYTES)
    fd = os.open(folder, os.O_TMPFILE | os.O_RDWR)  # in a sandbox, all that is shared is a file's
    try:
        os.ftruncate(fd, _NOTES_BYTES)
        return mmap.mmap(fd, _NOTES_BYTES)
    finally:
        os.close(fd)


def _read_notes(shared: mmap.mmap | None, overflow: str) -> bytes:
    parts = []
    if shared is not None:
        end = shared.find(b"\0\0")
        parts.append(shared[: end if end >= 0 else len(shared)])
        shared.close()
    with contextlib.suppress(OSError):
        paths = sorted(Path(overflow).iterdir())
        parts += [data for path in paths if (data := _read_regular(path)) is not None]
    return b"\0".join(parts)


def _read_regular(path: Path, size: int = -1) -> bytes | None:
    """The beginning of a file; `None` where there is none: to open a pipe may take for ever."""
    with contextlib.suppress(OSError):
        if path.is_file():
            with path.open("rb") as file:
                return file.read(size)
    return None


def missing_modules(names: Sequence[str], folders: Sequence[str], library: str) -> list[str]:
    """Which of these modules a script could not import that looks in `folders` first."""
    if not names:
        return []
    importlib.invalidate_caches()
    all_folders, original_path = [*folders, *sys.path, *([library] if library else [])], sys.path

    def is_importable(name: str) -> bool:
        path: Sequence[str] | None = None
        parts = name.split(".")
        for count, part in enumerate(parts, 1):
            spec = None
            try:
                sys.path = all_folders if path is None else original_path
                for finder in sys.meta_path if part.isidentifier() else ():
                    with contextlib.suppress(Exception):  # a package's own finder may do anything
                        spec = spec or finder.find_spec(".".join(parts[:count]), path)
            finally:
                sys.path = original_path
            if spec is None:
                return False
            path = spec.submodule_search_locations or ()
        return True

    return [name for name in names if not is_importable(name)]


def _report_unstartable(text: str, number: int | None = None) -> bytes:
    return _report("failed", 2, parts=(b"", text.encode(), b""), number=number)


def _report(
    outcome: str,
    status: int = 0,
    seconds: float = 0.0,
    missing: Sequence[str] = (),
    parts: Sequence[bytes | None] = (b"", b"", b""),
    part_starts: Sequence[int] = (),
    number: int | None = None,
) -> bytes:
    report = {
        "outcome": outcome,
        "errno": number,
        "status": status,
        "seconds": seconds,
        "missing": list(missing),
        "parts": [None if part is None else part.decode("latin-1") for part in parts],
        "part_starts": list(part_starts),
    }
    data = json.dumps(report, ensure_ascii=False).encode()
    return LENGTH.pack(len(data)) + data


def _send(fd: int, data: bytes) -> None:
    with open(fd, "wb", closefd=False) as pipe:
        pipe.write(data)
