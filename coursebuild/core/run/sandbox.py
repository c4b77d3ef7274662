"""A sandbox for scripts of strangers, made by Bubblewrap (`bwrap`).

Entry points: `find_sandbox`, which tries to start one; `Sandbox`.

A supervisor runs in namespaces of its own, and (see `runner`) runs only one script, so that a
script that takes over its supervisor can falsify only its own result:

1. It sees Python, what is installed for it, the system's libraries and the course, all read-only.
   All other places lie in memory, hold `SIZE` bytes, and are gone at its end: also the temporary
   folder, where the supervisor, which is inside too, looks for figures. So no process outside ever
   follows a link that a script has made.
2. It has no network, sees no process but its own, and has no capability, not even in namespaces
   of its own, of which it can make none. Its environment is that of scripts.
3. It ends with the process that started it, and so does everything in it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from msgspec import Struct

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import ScriptJob, Trace
from coursebuild.core.run.packages import site_folders
from coursebuild.core.run.script_environment import Interpreter, library_folder

SIZE = 1 << 30
"""Bytes that may be written, in memory."""
_SYSTEM = (
    *("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/nix/store", "/sys/devices/system/cpu"),
    *("/etc/alternatives", "/etc/fonts", "/etc/ld.so.cache", "/etc/localtime"),
)
_PYTHON_PARTS = ("bin", "lib", "lib64", "pyvenv.cfg")
"""The parts that an interpreter needs of the folder that it is installed in."""
_NAMESPACES = (
    *("--unshare-all", "--unshare-user", "--disable-userns", "--cap-drop", "ALL"),
    *("--die-with-parent", "--new-session", "--clearenv", "--chdir", "/"),
)
_IN_MEMORY = ("--size", str(SIZE), "--tmpfs")
_PLACES = (
    *(*_IN_MEMORY, "/", "--proc", "/proc", "--remount-ro", "/proc"),
    *("--dev", "/dev", *_IN_MEMORY, "/dev/shm", "--remount-ro", "/dev"),
)
"""The system's own places; /proc is read-only, as root can change the machine by its files."""
_ALLOW = (
    "it takes Bubblewrap 0.8 or newer, and user namespaces: on Ubuntu, `sudo sysctl "
    "kernel.apparmor_restrict_unprivileged_userns=0` allows them; containers often forbid them"
)


def find_sandbox(root: Path) -> Sandbox:
    """The sandbox of this machine, after a trial start for the course in a folder.

    Raises:
        EffectError: there is none, or it cannot be started.
    """
    program = shutil.which("bwrap")
    if program is None:
        message = "`--sandbox` needs Bubblewrap, and there is no program `bwrap`"
        raise EffectError(message, help="install it, as by `apt-get install bubblewrap`")
    sandbox = Sandbox(program)
    empty_script = [sys.executable, "-I", "-S", "-c", ""]
    try:
        subprocess.run(
            sandbox.command(empty_script, {}, visible_places(str(root), library_folder(), None)),
            env={},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError) as error:
        output = str(getattr(error, "stderr", error)).strip().removeprefix("bwrap: ")
        message = f"`--sandbox` does not work here, Bubblewrap says: {output or 'nothing'}"
        raise EffectError(message, help=_ALLOW) from None
    return sandbox


class Sandbox(Struct, frozen=True):
    """The sandbox of this machine."""

    program: str
    """The path of `bwrap`."""

    def command(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        sources: Mapping[str, str],
        copies: Iterable[tuple[str, str]] = (),
    ) -> list[str]:
        """A command in the sandbox; to be started with an empty environment.

        `sources`: see `visible_places`. `copies` are folders that scripts may write into, each with
        the place that shows its content, to be copied from there.
        """
        options = [self.program, *_NAMESPACES, *_PLACES]
        for name, value in environment.items():
            options += ["--setenv", name, value]
        for path, source in sorted(sources.items()):
            options += ["--ro-bind-try", source, path]
        for path, place in copies:
            options += [*_IN_MEMORY, path, "--ro-bind", path, place]
        return [*options, "--", *command]


def visible_places(root: str, library: str, interpreter: Interpreter | None) -> dict[str, str]:
    """The places that scripts of a course see, each with the real path of its content.

    `library` is where they find `mjcourse`.
    """
    ours = library_folder()
    sources = {path: path for path in (*_SYSTEM, root, f"{ours}/coursebuild")}
    sources[f"{library}/mjcourse"] = f"{ours}/mjcourse"
    if interpreter is None:
        sources |= {path: path for path in site_folders()}
    prefixes = (
        (sys.prefix, sys.base_prefix)
        if interpreter is None
        else (interpreter.prefix, interpreter.base)
    )
    for prefix in prefixes:
        sources |= _interpreter_parts(prefix, root)
    return sources


def _interpreter_parts(prefix: str, root: str) -> dict[str, str]:
    """The parts of a folder that holds an interpreter; nothing where it holds none.

    A course can name any folder of the machine, also by a link.
    """
    real = os.path.realpath(prefix)
    is_interpreter = Path(real, "pyvenv.cfg").exists() or any(Path(real).glob("lib/python3*/os.py"))
    if not is_interpreter or f"{real}/".startswith(f"{root}/"):
        return {}
    prefixes = {real} if f"{prefix}/".startswith(f"{root}/") else {real, prefix}
    return {f"{at}/{part}": f"{real}/{part}" for at in prefixes for part in _PYTHON_PARTS}


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
        return "what it wrote went with its sandbox"
    folders = tuple(f"{path}/" for path in sources)
    hidden = (path for path in trace.outside if not f"{path}/".startswith(folders))
    return next((f"its sandbox does not show {path}" for path in hidden), "")
