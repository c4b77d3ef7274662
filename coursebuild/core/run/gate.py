"""The gate: every process that the tool, its plug-ins and its benchmarks start goes through here.

A command is mostly given in the folder of a course, which may be a stranger's. Python looks for
modules in its working folder, and programs look for their settings there. So a process takes
neither its place, nor its path, nor its settings from that folder:

1. It works in a private folder, which is empty at its start.
2. Python is started without the working folder on its path (`python_command`). What it starts in
   turn is told the same by `PYTHONSAFEPATH`.
3. The environment is made of what its purpose needs of the user's (`environment`): the home, the
   language, proxies and mirrors stay; what would say to Python where code lies does not.
4. Programs are found in the absolute places of PATH alone (`find_program`).
5. Confinement and what it has to end with are arguments. A limit of memory is set by whoever starts
   it, once it has imported what it needs.

The scripts of a course are the exception, as `docs/reference/scripts.md` says: their supervisor is
started here like all else, with the environment of scripts, and only then enters the project.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import importlib.util
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, TypeAlias

from msgspec import Struct

from coursebuild.core.engine.lifetime import bound_command
from coursebuild.core.files.course_root import DECISIVE
from coursebuild.core.files.locks import temporary_folder

Enclose: TypeAlias = Callable[[Sequence[str], Mapping[str, str]], tuple[list[str], dict[str, str]]]
"""Makes, of a command and its environment, those that run it in a sandbox."""
Stream: TypeAlias = "int | IO[bytes]"

PIPE, NOTHING, OWN = subprocess.PIPE, subprocess.DEVNULL, None
"""Streams: one to this process, none, and the one that this process has itself."""
TO_OUTPUT = subprocess.STDOUT
"""Of errors: they go where the output goes."""
Process: TypeAlias = "subprocess.Popen[bytes]"
StillRunningError = subprocess.TimeoutExpired
"""What waiting for a process raises that has not ended in time."""

NETWORK = """
HTTP_PROXY HTTPS_PROXY FTP_PROXY ALL_PROXY NO_PROXY http_proxy https_proxy ftp_proxy all_proxy
no_proxy SSL_CERT_FILE SSL_CERT_DIR REQUESTS_CA_BUNDLE CURL_CA_BUNDLE NETRC
""".split()
"""How the user reaches other machines."""
INSTALLERS = ("PIP_*", "UV_*", *NETWORK)
"""How the user's pip and uv are configured."""
DESKTOP = """
DISPLAY WAYLAND_DISPLAY XAUTHORITY DBUS_SESSION_BUS_ADDRESS DESKTOP_SESSION SSH_* VSCODE_* KITTY_*
TERM_PROGRAM BROWSER WSL_* WSLENV KDE_* GNOME_* NVIM EMACS*
""".split()
"""Where the user's windows are."""
TOOL = ("COURSEBUILD_*", "CI", "GITHUB_*", *NETWORK)
"""What another command of this tool obeys."""
COMPUTING = ("OMP_*", "OPENBLAS_*", "MKL_*", "MUJOCO_*", "JAX_*", "XLA_*", "CUDA_*", "WARP_*")
"""How many threads and which devices compute."""
_COMMON = (
    *"PATH HOME USER LOGNAME SHELL TMPDIR LANG LANGUAGE LC_* TZ TERM COLORTERM".split(),
    *"NO_COLOR FORCE_COLOR COLUMNS LINES XDG_*".split(),
    *DECISIVE,
)
"""The user, the language, the terminal, and where programs and libraries are."""


_RUN_MODULE = """
import os, runpy, sys
places, module = sys.argv[1:3]
sys.path[:0] = [place for place in places.split(os.pathsep) if place not in sys.path]
del sys.argv[1:3]
runpy.run_module(module, run_name="__main__", alter_sys=True)
"""


class Completed(Struct, frozen=True):
    """What a process did that has ended."""

    status: int
    """Its exit status, or minus the number of the signal that ended it."""
    output: bytes
    errors: bytes

    def last_line(self) -> str:
        """The last line of its errors; empty where it has none."""
        return last_line(self.errors)


def last_line(errors: bytes) -> str:
    """The last line that a process wrote; empty where there is none."""
    return next(reversed(errors.decode("utf-8", "replace").strip().splitlines()), "")


def find_program(name: str) -> str | None:
    """The absolute path of a program on PATH, whose relative places do not count."""
    if "/" in name and not Path(name).is_absolute():
        return None
    return shutil.which(name, path=absolute_places(os.environ.get("PATH", os.defpath)))


def environment(*names: str, **variables: str) -> dict[str, str]:
    """The variables that every process gets, and these; `LC_*` stands for all that begin so."""
    patterns = {*_COMMON, *names}
    prefixes = tuple(name[:-1] for name in patterns if name.endswith("*"))
    values = {
        name: value
        for name, value in os.environ.items()
        if name in patterns or name.startswith(prefixes)
    }
    if "PATH" in values:
        values["PATH"] = absolute_places(values["PATH"])
    return {**values, "PYTHONSAFEPATH": "1", **variables}


def absolute_places(path: str) -> str:
    """The absolute places of a PATH; those of the system if it has none, as empty it means `.`."""
    return os.pathsep.join(filter(os.path.isabs, path.split(os.pathsep))) or os.defpath


def python_command(*arguments: str, program: str = sys.executable) -> list[str]:
    """The command that starts Python with what is installed for it on its path, and nothing else.

    A file that is run does not bring its folder along.
    """
    return [program, "-E", "-P", *arguments]


def module_command(module: str, *arguments: str, python_path: str = "") -> list[str]:
    """The command that runs a module of a package, found where this process has it from.

    What the absolute places of `python_path` hold is found as well.
    """
    packages = ("coursebuild", module.partition(".")[0])
    files = (importlib.util.find_spec(package) for package in packages)
    places = {str(Path(spec.origin).parents[1]) for spec in files if spec and spec.origin}
    places |= {*filter(os.path.isabs, python_path.split(os.pathsep))}
    return python_command("-c", _RUN_MODULE, os.pathsep.join(sorted(places)), module, *arguments)


def start(
    command: Sequence[str],
    environment: Mapping[str, str],
    *,
    folder: str | Path | None = None,
    stdin: Stream | None = NOTHING,
    stdout: Stream | None = NOTHING,
    stderr: Stream | None = NOTHING,
    pass_fds: Sequence[int] = (),
    bound: bool = True,
    enclose: Enclose | None = None,
) -> Process:
    """Start a process; an `OSError` says why it cannot be.

    `folder` is a private one of the caller, for a process that writes; `bound` lets it end with the
    thread that starts it; `enclose` puts it into a sandbox.
    """
    if enclose is not None:
        command, environment = enclose(command, environment)
    return subprocess.Popen(
        bound_command(command) if bound else list(command),
        cwd=folder or working_folder(),
        env=dict(environment),
        stdin=stdin,
        stdout=stdout,
        stderr=stderr,
        pass_fds=pass_fds,
        start_new_session=True,  # the signals of the terminal are not for it
    )


def finish(
    command: Sequence[str],
    environment: Mapping[str, str],
    *,
    folder: str | Path | None = None,
    stdin: bytes = b"",
    stderr: Stream = PIPE,
    seconds: float | None = None,
    bound: bool = True,
    enclose: Enclose | None = None,
) -> Completed:
    """Run a process to its end; an interrupt, or that it takes longer, ends all that it started.

    `folder`, `bound` and `enclose` are as in `start`; without a folder it gets one of its own.

    Raises:
        OSError: it cannot be started.
        TimeoutError: it took longer than these seconds.
    """
    with contextlib.ExitStack() as resources:
        process = start(
            command,
            environment,
            folder=folder or resources.enter_context(temporary_folder()),
            stdin=PIPE,
            stdout=PIPE,
            stderr=stderr,
            bound=bound,
            enclose=enclose,
        )
        try:
            output, errors = process.communicate(stdin, seconds)
        except subprocess.TimeoutExpired:
            raise TimeoutError(f"it takes longer than {seconds:g} s") from None
        finally:
            end(process)
    return Completed(process.returncode, output, errors or b"")


def end(process: Process) -> None:
    """Kill a process with all that it started, unless it was waited for, and close its pipes."""
    if process.returncode is None:
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    for pipe in (process.stdin, process.stdout, process.stderr):
        with contextlib.suppress(BrokenPipeError):
            if pipe is not None:
                pipe.close()


@functools.cache
def working_folder() -> str:
    """A private folder, for processes that write nothing and for temporary files.

    It ends with this process; if that is killed, with the next command.
    """
    resources = contextlib.ExitStack()
    folder = resources.enter_context(temporary_folder())
    owner = os.getpid()
    atexit.register(lambda: resources.close() if os.getpid() == owner else None)
    return folder
