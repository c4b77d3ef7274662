"""A sandbox for scripts of strangers, made by Bubblewrap (`bwrap`).

Entry points: `find_sandbox`, which tries whether there can be one; `Sandbox`.

A supervisor runs in namespaces of its own, and in `runner` only one script, so that a script that
takes over its supervisor speaks for nobody else:

1. It sees Python, what is installed for it, the system's libraries and the course, all read-only.
   All other places lie in memory, take `SIZE` bytes, and are gone at its end: also the temporary
   folder, where the supervisor, inside as well, looks for figures. So nobody outside ever follows a
   link that a script has made.
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
from coursebuild.core.run.script_environment import OtherEnvironment, library_folder

SIZE = 1 << 30
"""Bytes that may be written, in memory."""
_SYSTEM = (
    *("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/nix/store", "/sys/devices/system/cpu"),
    *("/etc/alternatives", "/etc/fonts", "/etc/ld.so.cache", "/etc/localtime"),
)
_OF_PYTHON = ("bin", "lib", "lib64", "pyvenv.cfg")
"""What an interpreter needs of the folder that it is installed in."""
_NAMESPACES = (
    *("--unshare-all", "--unshare-user", "--disable-userns", "--cap-drop", "ALL"),
    *("--die-with-parent", "--new-session", "--clearenv", "--chdir", "/"),
)
_IN_MEMORY = ("--size", str(SIZE), "--tmpfs")
_PLACES = (
    *(*_IN_MEMORY, "/", "--proc", "/proc", "--remount-ro", "/proc"),
    *("--dev", "/dev", *_IN_MEMORY, "/dev/shm", "--remount-ro", "/dev"),
)
"""The system's own; to root, files of /proc belong that change the whole machine."""
_ALLOW = (
    "it takes Bubblewrap 0.8 or newer, and user namespaces: on Ubuntu, `sudo sysctl "
    "kernel.apparmor_restrict_unprivileged_userns=0` allows them; containers often forbid them"
)


def find_sandbox(root: Path) -> Sandbox:
    """The sandbox of this machine, once it has been started for the course in a folder.

    Raises:
        EffectError: there is none, or it cannot be started.
    """
    program = shutil.which("bwrap")
    if program is None:
        message = "`--sandbox` needs Bubblewrap, and there is no program `bwrap`"
        raise EffectError(message, help="install it, as by `apt-get install bubblewrap`")
    found = Sandbox(program)
    nothing = [sys.executable, "-I", "-S", "-c", ""]
    try:
        subprocess.run(
            found.command(nothing, {}, visible(str(root), library_folder(), None)),
            env={},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError) as error:
        said = str(getattr(error, "stderr", error)).strip().removeprefix("bwrap: ")
        message = f"`--sandbox` does not work here, Bubblewrap says: {said or 'nothing'}"
        raise EffectError(message, help=_ALLOW) from None
    return found


class Sandbox(Struct, frozen=True):
    """That of this machine."""

    program: str
    """The path of `bwrap`."""

    def command(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        shown: Mapping[str, str],
        copied: Iterable[tuple[str, str]] = (),
    ) -> list[str]:
        """A command in the sandbox; to be started with an empty environment.

        `shown`: see `visible`. `copied` are folders that may be written into, and where what is in
        them is shown, to be copied from there.
        """
        options = [self.program, *_NAMESPACES, *_PLACES]
        for name, value in environment.items():
            options += ["--setenv", name, value]
        for path, source in sorted(shown.items()):
            options += ["--ro-bind-try", source, path]
        for path, place in copied:
            options += [*_IN_MEMORY, path, "--ro-bind", path, place]
        return [*options, "--", *command]


def visible(root: str, library: str, place: OtherEnvironment | None) -> dict[str, str]:
    """What scripts of a course see: each place, and what is shown there.

    `library` is where they find `mjcourse`.
    """
    ours = library_folder()
    found = {path: path for path in (*_SYSTEM, root, f"{ours}/coursebuild")}
    found[f"{library}/mjcourse"] = f"{ours}/mjcourse"
    if place is None:
        found |= {path: path for path in site_folders()}
    here = (sys.prefix, sys.base_prefix) if place is None else (place.prefix, place.base)
    for prefix in here:
        found |= _interpreter(prefix, root)
    return found


def _interpreter(prefix: str, root: str) -> dict[str, str]:
    """The parts of a folder that holds an interpreter; nothing where it holds none.

    A course can name any folder of the machine, also by a link.
    """
    real = os.path.realpath(prefix)
    is_one = Path(real, "pyvenv.cfg").exists() or any(Path(real).glob("lib/python3*/os.py"))
    if not is_one or f"{real}/".startswith(f"{root}/"):
        return {}
    places = {real} if f"{prefix}/".startswith(f"{root}/") else {real, prefix}
    return {f"{at}/{part}": f"{real}/{part}" for at in places for part in _OF_PYTHON}


def copied_folders(root: str, jobs: Iterable[ScriptJob], scratch: str) -> list[tuple[str, str]]:
    """The folders that scripts may write into, which they get copies of: see `Sandbox.command`.

    None that is reached by a link.
    """
    names = sorted({name for job in jobs for name in job.writes})
    folders = [Path(root, name) for name in names]
    real = [folder for folder in folders if folder.resolve() == folder]
    for folder in real:
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
    there = [folder for folder in real if folder.is_dir()]
    return [(str(folder), f"{scratch}/copied/{i}") for i, folder in enumerate(there)]


def difference(job: ScriptJob, trace: Trace, shown: Iterable[str]) -> str:
    """Why a result may be another one outside, as words that end a sentence; empty if it is not.

    What is known of files outside the sandbox holds for those that are shown.
    """
    if job.writes:
        return "what it wrote went with its sandbox"
    folders = tuple(f"{path}/" for path in shown)
    hidden = (path for path in trace.outside if not f"{path}/".startswith(folders))
    return next((f"its sandbox does not show {path}" for path in hidden), "")
