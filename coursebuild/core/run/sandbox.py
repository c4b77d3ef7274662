"""A sandbox for scripts of strangers, made by Bubblewrap (`bwrap`).

A supervisor runs in namespaces of its own, and only one script (see `script_server`), so that a
script that takes over its supervisor can falsify only its own result:

1. It sees Python, what is installed for it, the system's libraries and the course, all read-only,
   without sockets and pipes that lie in there. All other places lie in memory, hold `SIZE` bytes,
   and are gone at its end: also the temporary folder, where the supervisor, which is inside too,
   looks for figures. So no process outside ever follows a link that a script has made.
2. It has no network, sees no process but its own, and has no capability, not even in namespaces
   of its own, of which it can make none. Its environment is that of scripts. System calls are
   filtered (`seccomp`), and its session keyring is new and empty (`sandbox_main`).
3. Its supervisor is the first process, which no signal from inside reaches. What it takes in all is
   limited from outside, by systemd where that is to be had, and by `script_worker`.
4. It ends with the process that started it, and so does everything in it.
"""

from __future__ import annotations

import contextlib
import os
import platform
import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from multiprocessing.connection import wait
from pathlib import Path

from msgspec import Struct

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import ScriptJob, Trace
from coursebuild.core.run import gate
from coursebuild.core.run.script_environment import Interpreter, library_folder, site_folders
from coursebuild.core.run.script_worker import (
    PROCESSES,
    START,
    SUPERVISOR_MEMORY,
    SandboxWatch,
)

SIZE = 1 << 30
"""Bytes that may be written, in memory."""
PROGRAM = str(Path(__file__).with_name("sandbox_main.py"))
_SYSTEM = """
/usr /bin /sbin /lib /lib32 /lib64 /nix/store /sys/devices/system/cpu
/etc/alternatives /etc/fonts /etc/ld.so.cache /etc/localtime
""".split()
_PYTHON_PARTS = ("bin", "lib", "lib64", "pyvenv.cfg")
"""The parts that an interpreter needs of the folder that it is installed in."""
_NAMESPACES = """
--unshare-all --unshare-user --disable-userns --cap-drop ALL --as-pid-1
--die-with-parent --new-session --clearenv --chdir /
""".split()
_HIDDEN = ("/proc/keys", "/proc/key-users", "/proc/timer_list", "/proc/kcore")
"""Files of the system that tell of what is outside."""
_ALLOW = (
    "it needs Bubblewrap 0.8 or newer, and user namespaces: on Ubuntu, `sudo sysctl "
    "kernel.apparmor_restrict_unprivileged_userns=0` allows them; containers often forbid them"
)
_TRIAL = """
import sys
fields = dict(line.split()[:2] for line in open("/proc/self/status") if line.split()[1:])
print(fields["Pid:"], fields["Seccomp:"], int(fields["CapEff:"], 16), flush=True)
sys.stdin.read()
"""
"""Prints what must be as in `_FAULTS`, and ends with its input."""
_FAULTS = (
    ("the supervisor is not the first process in the sandbox", "1"),
    ("system calls are not filtered in the sandbox", "2"),
    ("scripts have capabilities in the sandbox", "0"),
)
"""What is wrong where a value is another one."""


class SandboxPart(Struct, frozen=True):
    """Something that a sandbox needs."""

    name: str
    problem: str = ""
    """Why it is not to be had; empty where it is."""
    help: str = ""


def find_sandbox(root: Path) -> Sandbox:
    """The sandbox of this machine, after a trial start; an `EffectError` says what it lacks."""
    sandbox, parts = examine_sandbox(root)
    for part in parts:
        if part.problem:
            raise EffectError(f"`--sandbox` {part.problem}", help=part.help)
    assert sandbox is not None
    return sandbox


def examine_sandbox(
    root: Path, seconds: float = START
) -> tuple[Sandbox | None, tuple[SandboxPart, ...]]:
    """The sandbox of this machine, and its parts; none, and those up to the first that lacks.

    `seconds` are what its trial start may take.
    """
    from coursebuild.core.run.seccomp import compile_filter

    bubblewrap, system_call_filter = "Bubblewrap", "a filter of system calls"
    program, machine = gate.find_program("bwrap"), platform.machine()
    if program is None:
        problem = "needs Bubblewrap, but there is no program `bwrap`"
        help = "install it, for example with `apt-get install bubblewrap`"
        return None, (SandboxPart(bubblewrap, problem, help),)
    system_calls = compile_filter(machine)
    if system_calls is None:
        problem = f"needs a filter of system calls, and there is none for {machine} machines"
        part = SandboxPart(system_call_filter, problem, "use an x86_64 or aarch64 machine")
        return None, (SandboxPart(bubblewrap), part)
    scope = _find_scope()
    sandbox = Sandbox(program, system_calls.hex(), scope)
    problem = _try_sandbox(sandbox, root, seconds)
    parts = tuple(map(SandboxPart, (bubblewrap, system_call_filter)))
    if problem:
        return None, (*parts, SandboxPart("namespaces", problem, _ALLOW))
    means = "by a control group and by watching" if scope else "by watching"
    names = ("namespaces", "a session keyring", f"limits of memory and processes in all, {means}")
    return sandbox, (*parts, *map(SandboxPart, names))


def _find_scope() -> tuple[str, ...]:
    """The command that starts another in a control group, where systemd can make one."""
    unified, systemd = Path("/sys/fs/cgroup/cgroup.controllers"), Path("/run/systemd/system")
    program = gate.find_program("systemd-run")
    if program is None or not systemd.is_dir() or not unified.exists():
        return ()
    manager = "--system" if os.geteuid() == 0 else "--user"
    limit = f"--property=TasksMax={16 * PROCESSES}"
    scope = (program, manager, "--scope", "--quiet", "--collect", limit)
    trial = [*scope, "--property=MemoryMax=1G", "--", "true"]
    try:
        trial_run = gate.finish(trial, gate.environment("DBUS_SESSION_BUS_ADDRESS"), seconds=10.0)
    except OSError:  # also where it takes too long
        return ()
    return () if trial_run.status else scope


def _try_sandbox(sandbox: Sandbox, root: Path, seconds: float) -> str:
    """Start a sandbox; say what does not work, as the end of a sentence."""
    trial = [sys.executable, "-I", "-S", "-c", _TRIAL]
    places = visible_places(str(root), library_folder(), None)
    command, environment = sandbox.command(trial, {}, places)
    pipe = gate.PIPE
    process = gate.start(command, environment, stdin=pipe, stdout=pipe, stderr=pipe)
    try:
        output = process.stdout
        assert output is not None
        state = output.readline().split() if wait([output.fileno()], seconds) else []
        watch = SandboxWatch(process.pid)
        is_watched = watch.is_ready() and not watch.excess(SIZE)
        watch.close()
        _, errors = process.communicate(timeout=seconds)
    except gate.StillRunningError:
        return f"does not work here: a sandbox does not start and end within {seconds:g} s"
    finally:
        gate.end(process)
    if not state:
        problem = gate.last_line(errors).removeprefix("bwrap: ") or "nothing"
        return f"does not work here, Bubblewrap says: {problem}"
    for (fault, value), actual in zip(_FAULTS, state, strict=True):
        if actual != value.encode():
            return f"does not work here: {fault}"
    unseen = "does not work here: its memory and processes cannot be seen in /proc"
    return "" if is_watched else unseen


class Sandbox(Struct, frozen=True):
    """The sandbox of this machine."""

    program: str
    """The path of `bwrap`."""
    system_calls: str
    """Their filter, as hexadecimal digits."""
    scope: tuple[str, ...] = ()
    """The command that starts another in a control group; empty where there is none."""

    def command(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        sources: Mapping[str, str],
        copies: Iterable[tuple[str, str]] = (),
        special_files: Mapping[str, str] | None = None,
        memory: int = SIZE >> 20,
    ) -> tuple[list[str], dict[str, str]]:
        """The command that runs another one in the sandbox, and the environment of the former.

        `sources`: see `visible_places`. `copies` are folders that scripts may write into, each with
        the place that shows its content, to be copied from there. `special_files` are hidden.
        `memory` is in MiB.
        """
        in_memory = ("--size", str(min(SIZE, memory << 20)), "--tmpfs")
        options = [*_NAMESPACES, *in_memory, "/", "--proc", "/proc"]
        for path in filter(os.path.exists, _HIDDEN):
            options += _hide(path)
        # /proc is read-only, as root can change the machine by its files; /dev/zero gives memory.
        options += ["--remount-ro", "/proc", "--dev", "/dev", *_hide("/dev/zero")]
        options += [*in_memory, "/dev/shm", "--remount-ro", "/dev"]
        for name, value in environment.items():
            options += ["--setenv", name, value]
        for path, source in sorted(sources.items()):
            options += ["--ro-bind-try", source, path]
        for path, place in copies:
            options += [*in_memory, path, "--ro-bind", path, place]
        for place, path in (special_files or {}).items():
            if os.path.lexists(path):
                options += _hide(place)
        # The system counts the kernel's own memory too, and does not say what its limit was: so it
        # is further, and holds for what happens between two looks.
        most = memory + 2 * SUPERVISOR_MEMORY
        limits = (f"--property=MemoryMax={most}M", "--property=MemorySwapMax=0", "--")
        starter = (sys.executable, "-I", "-S", PROGRAM, self.system_calls, self.program)
        scope = (*self.scope, *limits) if self.scope else ()
        # What a course sets must not reach these programs.
        names = ("XDG_RUNTIME_DIR", "DBUS_SESSION_BUS_ADDRESS") if self.scope else ()
        own_environment = {name: os.environ[name] for name in names if name in os.environ}
        return [*scope, *starter, *options, "--", *command], own_environment

    def enclosure(self, root: Path, interpreter: Interpreter | None, memory: int) -> gate.Enclose:
        """What puts a process into the sandbox that runs Python and writes nothing.

        It sees the course at `root`, and what is installed for the interpreter; it takes at most
        `memory` MiB.
        """
        sources = visible_places(str(root), library_folder(), interpreter)
        hidden = special_files(sources, ())
        return partial(self.command, sources=sources, special_files=hidden, memory=memory)


def _hide(path: str) -> tuple[str, ...]:
    """Let a file be one that cannot be opened: devices of the system are not allowed there."""
    return "--ro-bind", "/dev/null", path


def visible_places(root: str, library: str, interpreter: Interpreter | None) -> dict[str, str]:
    """The places that scripts of a course see, each with the real path of its content.

    `library` is where they find `mjcourse`.
    """
    ours = library_folder()
    sources = {path: path for path in (*_SYSTEM, root, f"{ours}/coursebuild")}
    sources[f"{library}/mjcourse"] = f"{ours}/mjcourse"
    prefixes = (sys.prefix, sys.base_prefix)
    if interpreter is not None:
        prefixes = (interpreter.prefix, interpreter.base)
    if interpreter is None or interpreter.name:  # one that the tool has made uses these, too
        sources |= {path: path for path in site_folders()}
    for prefix in prefixes:
        # A course can name any folder of the machine, also by a link: it must hold an interpreter.
        real = os.path.realpath(prefix)
        marks = (Path(real, "pyvenv.cfg"), *Path(real).glob("lib/python3*/os.py"))
        if any(mark.exists() for mark in marks) and not f"{real}/".startswith(f"{root}/"):
            places = {real} if f"{prefix}/".startswith(f"{root}/") else {real, prefix}
            sources |= {f"{at}/{p}": f"{real}/{p}" for at in places for p in _PYTHON_PARTS}
    return sources


def special_files(sources: Mapping[str, str], copies: Iterable[tuple[str, str]]) -> dict[str, str]:
    """The sockets, pipes and devices that scripts would see in these places, each with its path.

    What is read-only can be neither changed nor made, but anybody may talk into it. In folders of
    the system nobody but root can have made one, for all to use.
    """
    files: dict[str, str] = {}
    for place, source in {**sources, **{place: path for path, place in copies}}.items():
        folders = [] if source in _SYSTEM else [source]
        while folders:
            with contextlib.suppress(OSError), os.scandir(folders.pop()) as entries:
                for entry in entries:
                    if entry.is_dir(follow_symlinks=False):
                        folders.append(entry.path)
                    elif not entry.is_file(follow_symlinks=False) and not entry.is_symlink():
                        files[place + entry.path.removeprefix(source)] = entry.path
    return files


def copied_folders(root: str, jobs: Iterable[ScriptJob], scratch: str) -> list[tuple[str, str]]:
    """The folders that scripts may write into, of which they get copies: see `Sandbox.command`.

    Folders that are reached by a link are left out.
    """
    names = sorted({name for job in jobs for name in job.writes})
    folders = [Path(root, name) for name in names]
    unlinked = [folder for folder in folders if folder.resolve() == folder]
    for folder in unlinked:
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
    existing = [folder for folder in unlinked if folder.is_dir()]
    return [(str(folder), f"{scratch}/copied/{i}") for i, folder in enumerate(existing)]


def sandbox_difference(job: ScriptJob, trace: Trace, sources: Iterable[str]) -> str:
    """Why a result may differ outside the sandbox, as the end of a sentence; empty if it cannot.

    The states of files outside the project count only for files that the sandbox shows.
    """
    if job.writes:
        return "what it wrote was lost with its sandbox"
    folders = tuple(f"{path}/" for path in sources)
    hidden = (path for path in trace.outside if not f"{path}/".startswith(folders))
    return next((f"its sandbox does not show {path}" for path in hidden), "")
