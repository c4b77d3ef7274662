"""The process that has imported what scripts import, and forks the scripts' supervisors.

Entry point: `serve`, called by `warm/sitecustomize` while Python starts.

1. The tool asks over a socket for packages to be imported (`load`) and for supervisors (`slot`),
   with the ends of two pipes for each. Answers, and notices of supervisors that have ended, are
   JSON objects, one a message.
2. A supervisor forks its scripts. Such a copy returns from `serve`, and Python's start goes on and
   runs the script: there is no frame and no module of this tool left in it.
3. When the socket closes, the tool has gone or wants no more: the supervisors, which see the same,
   are waited for.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]
import atexit
import contextlib
import ctypes
import functools
import gc
import json
import mmap
import os
import re
import resource
import select
import signal
import socket
import sys
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import TypedDict

from coursebuild.core.run import initial_state_perturbation, mujoco_tracing, mujoco_watching
from coursebuild.core.run.interpreter import Interpreter
from coursebuild.core.run.notes import Notes, read_notes
from coursebuild.core.run.preload import Recorder
from coursebuild.core.run.spawned import Waiting
from coursebuild.core.run.supervisor import Job, Slot, die_with, library_is_installed
from coursebuild.core.run.tracing import Tracer, installed_folders, library_folders
from coursebuild.core.run.watching import Launched, has_ended

PLACEHOLDER = "/coursebuild: the place of a script's path"
"""What the server is told to run."""


_NOTES_BYTES = 1 << 20
"""What a script may note of what it looks at, before the rest goes to files."""


class ServerRequest(TypedDict, total=False):
    """What the tool wants: packages, or a supervisor."""

    load: list[str]
    scratch: str
    """With two descriptors: where a supervisor reads its jobs, and writes its reports."""


class LoadReply(TypedDict):
    """The answer to `load`."""

    fork: str
    """Why scripts cannot be forked, in words; empty where they can."""
    files: list[str]
    """The files and folders whose change says that other versions are installed."""


def serve(recorder: Recorder, control: int, said: int) -> None:
    """Serve the tool until it closes the socket; only a script's process returns.

    Args:
        recorder: what was imported until now.
        control: the socket's descriptor.
        said: a file that takes what this process prints.
    """
    server = _Server(recorder, socket.socket(fileno=control), said)
    me = os.getpid()
    try:
        if not server.work():
            os._exit(0)
    except SystemExit as error:
        os._exit(error.code if isinstance(error.code, int) else 1)
    except BaseException:
        text = traceback.format_exc()
        if os.getpid() == me:
            with contextlib.suppress(OSError):
                server.control.send(json.dumps({"failed": text}).encode())
        else:
            os.write(2, text.encode())
        os._exit(70)


class _Server:
    def __init__(self, recorder: Recorder, control: socket.socket, said: int) -> None:
        self.recorder = recorder
        self.control = control
        self.scratch: set[str] = set()
        self.tool = os.getppid()
        self.trouble = ""
        try:
            self.interpreter = Interpreter()
        except Exception as error:
            self.trouble = str(error)
        self.has_library = library_is_installed()
        self.said = said
        if self._has_printed():
            self.trouble = "this Python prints something when it starts"
        self.awake, wake = os.pipe()
        os.set_blocking(wake, False)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        gc.disable()

    def work(self) -> bool:
        """Answer requests until there are no more: `False`; `True` in a script's process."""
        poll = select.poll()
        poll.register(self.control, select.POLLIN)
        poll.register(self.awake, select.POLLIN)
        while True:
            ready = {fd for fd, _ in poll.poll()}
            if self.awake in ready:
                os.read(self.awake, 4096)
                self._reap(os.WNOHANG)
            if self.control.fileno() in ready:
                try:
                    data, fds, _, _ = socket.recv_fds(self.control, 1 << 16, 2)
                except ConnectionResetError:  # closed, with answers that were not read
                    break
                if not data:
                    break
                request: ServerRequest = json.loads(data)
                if "load" in request:
                    self._answer(self._load(request["load"]))
                elif self._slot(request["scratch"], fds):
                    return True
        self._reap(0)
        if has_ended(self.tool):  # it was killed; otherwise the folder is its own
            for folder in self.scratch:
                with contextlib.suppress(OSError):
                    Path(folder).rmdir()
        return False

    def _has_printed(self) -> bool:
        sys.stdout.flush()
        sys.stderr.flush()
        return os.fstat(self.said).st_size > 0

    def _answer(self, answer: Mapping[str, object]) -> None:
        with contextlib.suppress(OSError):
            self.control.send(json.dumps(answer).encode())

    def _reap(self, options: int) -> None:
        with contextlib.suppress(ChildProcessError):
            while (child := os.waitpid(-1, options))[0]:
                status = os.waitstatus_to_exitcode(child[1])
                self._answer({"ended": child[0], "status": status})

    def _load(self, names: Sequence[str]) -> LoadReply:
        before = _surroundings()
        had_mujoco = "mujoco" in sys.modules
        for name in names:
            if self.trouble or name in sys.modules:
                continue
            try:
                self.recorder.load(name)
            except ModuleNotFoundError as error:
                if (
                    error.name != name
                ):  # what is not installed fails in each script that asks for it
                    self.trouble = f"importing {name} failed: {error!r}"
            except BaseException as error:
                self.trouble = f"importing {name} failed: {error!r}"
        self.recorder.settle()
        if "mujoco" in sys.modules and not had_mujoco:
            mujoco_tracing.wrap(sys.modules["mujoco"], re)
            mujoco_watching.watch(sys.modules["mujoco"])
        # A script's collector shall not look at, and so copy, what it did not make. What imports
        # left behind is not collected before: that takes longer than it saves.
        gc.freeze()
        changed = [k for k, v in _surroundings().items() if v != before[k]]
        if not self.trouble and self._has_printed():
            self.trouble = "an import printed something"
        if not self.trouble and changed:
            self.trouble = f"an import changed the process ({', '.join(changed)})"
        return {"fork": self.trouble, "files": _files(names)}

    def _slot(self, scratch: str, fds: Sequence[int]) -> bool:
        """Fork a supervisor; `True` in a process that is to become a script."""
        self.scratch.add(scratch)
        pid = os.fork()
        if pid:
            for fd in fds:
                os.close(fd)
            self._answer({"slot": pid})
            return False
        self.control.close()
        slot = Slot(
            fds[0], fds[1], None if self.trouble else _Forker(self), has_library=self.has_library
        )
        gc.freeze()
        if not slot.work():
            os._exit(0)
        return True


class _Forker:
    """Makes scripts of copies of a supervisor's process."""

    def __init__(self, server: _Server) -> None:
        self.recorder = server.recorder
        self.interpreter = server.interpreter
        self.names = frozenset(n for n in server.recorder.modules if "." not in n)
        self.free = ("", 0)
        """A folder where there is none, and when it was changed."""
        self.libc = ctypes.CDLL(None)
        self.installed = installed_folders()
        self.has_library = server.has_library
        server.recorder.hide()
        # What is here outlives the interpreter of a script, which so leaves it alone.
        for kept in (server.recorder, server, self):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))

    def can_run(self, job: Job) -> bool:
        """Whether nothing beside the script has the name of a module that was imported already."""
        folder = os.path.dirname(f"{job['root']}/{job['path']}")  # noqa: PTH120 (here time counts)
        try:
            changed = os.stat(folder).st_mtime_ns  # noqa: PTH116
            if self.free != (folder, changed):
                beside = os.listdir(folder)  # noqa: PTH208
                if not self.names.isdisjoint(name.partition(".")[0] for name in beside):
                    return False
                self.free = folder, changed
        except OSError:
            return False
        return True

    def fork(self, job: Job, environment: Mapping[str, str], notes: str) -> Launched | None:
        """The copy, which has its pipes and its session; `None` in the copy itself."""
        root = job["root"]
        shared = mmap.mmap(-1, _NOTES_BYTES)
        (out, stdout), (err, stderr) = os.pipe(), os.pipe()
        supervisor = os.getpid()
        pid = os.fork()
        if pid:
            os.close(stdout)
            os.close(stderr)
            read = functools.partial(
                self._notes, shared, notes, job["root"], os.path.normpath(job["path"])
            )
            return Launched(pid, out, err, read)
        os.setsid()
        die_with(supervisor, self.libc)
        os.dup2(stdout, 1)
        os.dup2(stderr, 2)
        _reset_signals()
        os.closerange(3, stderr + 16)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os.chdir(root)
        _set_environment(environment)
        _renew_main()
        self.interpreter.become(f"{root}/{job['path']}", [job["path"], *job["args"]])
        installed = self.installed
        if not self.has_library:
            installed = [*installed, *library_folders(root, job["library"])]
        tracer = Tracer(root, environment["TMPDIR"], installed, notes, shared)
        mujoco_tracing.tracer = tracer
        finder = self.recorder.offer(tracer.restored)
        atexit.register(finder.withdraw)  # the first that is registered is the last that runs
        atexit.register(mujoco_watching.finish)
        self._watch_mujoco(job["perturbation"])
        gc.enable()
        tracer.install()
        return None

    def _watch_mujoco(self, perturbation: int) -> None:
        """See to it that MuJoCo is watched also where it was not imported before."""
        modules = self.recorder.modules
        if "mujoco" not in modules:
            sys.meta_path.insert(0, Waiting(perturbation, at_end=False))
        elif perturbation:
            initial_state_perturbation.install(modules["mujoco"], modules["numpy"], perturbation)

    def _notes(self, shared: mmap.mmap, notes: str, root: str, path: str) -> Notes:
        end = shared.find(b"\0\0")
        data = shared[: end if end >= 0 else len(shared)]
        shared.close()
        return read_notes(data, notes, root, path, self.recorder.looked_for)


def _renew_main() -> None:
    """Let the script's module be one that the collector looks at, which a frozen one is not."""
    names = vars(sys.modules.pop("__main__"))
    main = sys.modules["__main__"] = ModuleType("__main__")
    vars(main).update(names)


def _reset_signals() -> None:
    signal.set_wakeup_fd(-1)
    _signal.signal(_signal.SIGINT, _signal.default_int_handler)
    for number in (_signal.SIGCHLD, _signal.SIGTERM, _signal.SIGHUP, _signal.SIGQUIT):
        _signal.signal(number, _signal.SIG_DFL)


def _set_environment(environment: Mapping[str, str]) -> None:
    os.environ["TMPDIR"] = environment["TMPDIR"]  # the rest is what the server was started with
    if "PYTHONPATH" in environment:
        os.environ["PYTHONPATH"] = environment["PYTHONPATH"]
        sys.path[:0] = environment["PYTHONPATH"].split(os.pathsep)


def _surroundings() -> dict[str, object]:
    """What an import had better leave alone, since a script would see it."""
    return {
        "threads": len(list(Path("/proc/self/task").iterdir())),
        "open files": sorted(Path("/proc/self/fd").iterdir()),
        "environment": dict(os.environ),
        "search path": list(sys.path),
        "import system": (list(sys.meta_path), list(sys.path_hooks)),
        "signals": [signal.getsignal(n) for n in sorted(signal.valid_signals())],
        "hooks": (sys.excepthook, sys.displayhook, sys.unraisablehook, sys.breakpointhook),
        "streams": (sys.stdin, sys.stdout, sys.stderr),
        "limits": (sys.getrecursionlimit(), sys.getswitchinterval(), gc.get_threshold()),
        "folder": Path.cwd(),
    }


def _files(names: Sequence[str]) -> list[str]:
    """Where installing another version of a package shows."""
    files: set[str] = set()
    for name in names:
        at = getattr(sys.modules.get(name), "__file__", None)
        if at is not None:
            files |= {at, str(Path(at).parent.parent)}
    return sorted(files)
