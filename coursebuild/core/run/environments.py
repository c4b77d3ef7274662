"""Environments with another version of MuJoCo and otherwise the packages of here.

Entry points: `other_version`, what the user may name; `needed(states)`, the distributions that
scripts use; `environment`, which makes one.

1. An environment lies in `.coursebuild/environments`, under a name that says everything that is
   installed in it: one that is there is used again. The ones used last are kept.
2. A new one is made beside its place and renamed there when MuJoCo can be imported in it, so that
   none is ever half there. The remains of a process that was killed are removed the next time.
3. pip installs, as the user has configured it. All that MuJoCo and the scripts need is held to the
   versions of here.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from coursebuild.core.engine.memo import TEMPORARY
from coursebuild.core.files.errors import EffectError, UsageError, reason
from coursebuild.core.files.locks import make_private_folder
from coursebuild.core.run.surroundings import OtherEnvironment, library_folder
from coursebuild.core.run.versions import engine_version

_FOLDER = "environments"
_KEPT = 4
"""Environments that stay: one takes some 150 MB."""
_VERSION = re.compile(
    r"\d+(\.\d+){0,3}((a|b|rc)\d+)?(\.post\d+)?(\.dev\d+)?(\+[a-z0-9.]+)?", re.ASCII
)
_ENGINE = "mujoco"
_INSTALL = ("install", "--no-input", "--progress-bar", "off", "--only-binary", _ENGINE)
_LINES = 4
"""Of what pip says where it fails, so many lines are told."""
_OFFLINE = (
    "without a network let pip find the wheels in a folder, by the environment variables "
    "PIP_FIND_LINKS and PIP_NO_INDEX"
)


def other_version(text: str) -> str:
    """A version of MuJoCo that is not the one of here.

    Raises:
        UsageError: it is no version, or the one of here.
    """
    if not _VERSION.fullmatch(text):
        raise UsageError(f"--against: {text!r} is no version of MuJoCo, such as 3.13.0")
    if _shortened(text) == _shortened(engine_version()):
        raise UsageError(f"--against: MuJoCo {engine_version()} is the version installed here")
    return text


def _shortened(version: str) -> str:
    """3.13 for 3.13.0, which is the same version."""
    return re.sub(r"(\.0)+(?=$|[a-z+]|\.(?:post|dev))", "", version)


def needed(states: Iterable[str]) -> dict[str, str]:
    """The versions of distributions, by what is known of modules: `numpy 2.4.6, other 1.0`."""
    found: dict[str, str] = {}
    for part in (part for state in states for part in state.split(", ")):
        name, _, version = part.rpartition(" ")
        if name and name != "files" and _plain(name) != _ENGINE:
            found[_plain(name)] = version
    return found


def _plain(name: str) -> str:
    """A distribution's name as PEP 503 has it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def environment(
    root: Path, engine: str, wanted: Mapping[str, str], say: Callable[[str], None]
) -> OtherEnvironment:
    """The environment with this version of MuJoCo and these distributions; made if it is not there.

    Only one process at a time may do this for a course: see `project_lock`.

    Raises:
        EffectError: it cannot be made.
    """
    here = {_plain(one.name): one.version for one in importlib.metadata.distributions() if one.name}
    here.pop(_ENGINE, None)
    wanted = {"numpy": here["numpy"], **{name: v for name, v in wanted.items() if name in here}}
    parts = [sys.version, sys.base_prefix, engine, sorted(wanted.items()), sorted(here.items())]
    name = f"mujoco-{engine}-{hashlib.sha256(repr(parts).encode()).hexdigest()[:16]}"
    folder = root / ".coursebuild" / _FOLDER
    prefix = folder / name
    try:
        make_private_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        for remains in folder.glob(f"{TEMPORARY}*"):
            shutil.rmtree(remains, ignore_errors=True)
        if not (prefix / "pyvenv.cfg").is_file():
            say(f"installing MuJoCo {engine} into .coursebuild/{_FOLDER}/{name}")
            _make(prefix, engine, wanted, here)
        os.utime(prefix)
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        packages = str(prefix / "lib" / f"python{version}" / "site-packages")
        _link_library(packages)
        _remove_unused(folder, prefix)
    except OSError as error:
        raise EffectError(f"{prefix.name} cannot be made: {reason(error)}") from None
    return OtherEnvironment(name, f"{prefix}/bin/python", str(prefix), packages)


def _make(prefix: Path, engine: str, wanted: Mapping[str, str], here: Mapping[str, str]) -> None:
    if importlib.util.find_spec("pip") is None:
        raise EffectError(
            "pip is not installed for this Python, and nothing can be installed without it",
            help="run `python -m ensurepip`",
        )
    new = Path(tempfile.mkdtemp(prefix=TEMPORARY, dir=prefix.parent))
    try:
        status, said = _run([sys.executable, "-m", "venv", "--without-pip", str(new)])
        if status:
            raise EffectError(f"a virtual environment cannot be made: {_last(said)}")
        configured = Path(sys.prefix) / "pip.conf"
        if configured.is_file():
            shutil.copyfile(configured, new / "pip.conf")
        constraints = new / "constraints.txt"
        rest = [f"{one}=={version}\n" for one, version in here.items() if one not in wanted]
        constraints.write_text("".join(rest))
        python = str(new / "bin" / "python")
        pip = [sys.executable, "-m", "pip", "--python", python, *_INSTALL, "-c", str(constraints)]
        pinned = [f"{one}=={version}" for one, version in wanted.items()]
        status, said = _run([*pip, f"{_ENGINE}=={engine}", *pinned])
        if status:
            raise _pip_error(engine, said)
        status, said = _run([python, "-E", "-P", "-c", f"import {_ENGINE}"])
        if status:
            beside = f"MuJoCo {engine} cannot be imported beside the other packages of here"
            raise EffectError(f"{beside}: {_last(said)}")
        new.rename(prefix)
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _pip_error(engine: str, said: str) -> EffectError:
    """Why pip did not install this version of MuJoCo, mostly in its own words."""
    if f"No matching distribution found for {_ENGINE}=={engine}" in said:
        where = f"Python {'.'.join(platform.python_version_tuple()[:2])} on {platform.machine()}"
        return EffectError(f"pip finds no MuJoCo {engine} for {where}", help=_OFFLINE)
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    if "ResolutionImpossible" in said:
        told = [line for line in lines if " depends on " in line or "user requested" in line]
        return EffectError(
            f"MuJoCo {engine} cannot be installed beside the packages of here: "
            f"{'; '.join(told[:_LINES])}",
            help="name a version of MuJoCo that goes with them",
        )
    errors = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR: ")]
    told = errors if errors != ["Exception:"] else lines[-1:]  # pip's own traceback
    return EffectError(
        f"pip cannot install MuJoCo {engine}: {'; '.join((told or lines)[-_LINES:])}"
    )


def _last(said: str) -> str:
    return next((line.strip() for line in reversed(said.splitlines()) if line.strip()), "no reason")


def _run(command: Sequence[str]) -> tuple[int, str]:
    """The status of a program and what it said; if we are interrupted it ends with its children."""
    # What is meant for this process's Python, such as warnings as errors, would disturb pip's.
    unsaid = ("PYTHON", "PIP_TARGET", "PIP_PREFIX", "PIP_PYTHON")
    outer = {name: value for name, value in os.environ.items() if not name.startswith(unsaid)}
    ours = {"PIP_USER": "0", "PIP_DISABLE_PIP_VERSION_CHECK": "1", "LC_ALL": "C.UTF-8"}
    with subprocess.Popen(
        command,
        env={"PIP_RETRIES": "1", **outer, **ours},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="backslashreplace",
        start_new_session=True,
    ) as process:
        try:
            said, _ = process.communicate()
        except BaseException:
            with contextlib.suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL)
            raise
    return process.returncode, said


def _link_library(packages: str) -> None:
    """Let `mjcourse` be the one that came with this tool."""
    link, target = Path(packages, "mjcourse"), Path(library_folder(), "mjcourse")
    if not link.is_symlink() or link.readlink() != target:
        link.unlink(missing_ok=True)
        link.symlink_to(target)


def _remove_unused(folder: Path, used: Path) -> None:
    """Keep the environments that were used last."""
    others = [path for path in folder.iterdir() if path != used]
    others.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    for path in others[_KEPT - 1 :]:
        shutil.rmtree(path, ignore_errors=True)
