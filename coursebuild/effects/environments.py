"""Throw-away environments with another version of MuJoCo and otherwise the packages of here.

Entry points: `other_version`, what the user may name; `needed(states)`, the distributions that
scripts use; `environment`, which makes one.

1. An environment lies in `.coursebuild/environments`, under a name that says everything that is
   installed in it: one that is there is used again. The ones used last are kept.
2. A new one is made beside its place and renamed there when MuJoCo can be imported in it, so that
   none is ever half there. Whatever goes wrong, its remains are removed; those of a process that
   was killed are, the next time.
3. pip installs, as the user has configured it. All that MuJoCo and the scripts need is held to the
   versions of here.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from coursebuild.effects.errors import EffectError, UsageError, reason
from coursebuild.effects.installing import pip_error, same_version
from coursebuild.effects.locks import is_abandoned, make_private_folder, try_lock
from coursebuild.effects.prune import TEMPORARY
from coursebuild.effects.surroundings import Place, library_folder
from coursebuild.effects.versions import engine_version

_FOLDER = "environments"
_KEPT = 4
"""Environments that stay: one takes some 150 MB."""
_VERSION = re.compile(
    r"\d+(\.\d+){0,3}((a|b|rc)\d+)?(\.post\d+)?(\.dev\d+)?(\+[a-z0-9.]+)?", re.ASCII
)
_REQUIRED = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_ENGINE = "mujoco"
_TRY = f"import {_ENGINE}"
_INSTALL = ("install", "--no-input", "--progress-bar", "off", "--only-binary", _ENGINE)


def other_version(text: str) -> str:
    """A version of MuJoCo that is not the one of here.

    Raises:
        UsageError: it is no version, or the one of here.
    """
    if not _VERSION.fullmatch(text):
        raise UsageError(f"--against: {text!r} is no version of MuJoCo, such as 3.13.0")
    if same_version(text, engine_version()):
        raise UsageError(f"--against: MuJoCo {engine_version()} is the version installed here")
    return text


def needed(states: Iterable[str]) -> dict[str, str]:
    """The versions of distributions, by what is known of modules: `numpy 2.4.6, other 1.0`."""
    found: dict[str, str] = {}
    for part in (part for state in states for part in state.split(", ")):
        name, _, version = part.rpartition(" ")
        if name and name != "files" and _plain(name) != _ENGINE:
            found[_plain(name)] = version
    return found


def environment(
    root: Path, engine: str, wanted: Mapping[str, str], say: Callable[[str], None]
) -> Place:
    """The environment with this version of MuJoCo and these distributions; made if it is not there.

    Only one process at a time may do this for a course: see `project_lock`.

    Raises:
        EffectError: it cannot be made.
    """
    held = _held({**wanted, "numpy": ""})
    installed = {name: version for name, version in wanted.items() if name in held} | held
    key = "\0".join([sys.version, sys.base_prefix, engine, *sorted(map(repr, installed.items()))])
    name = f"mujoco-{engine}-{hashlib.sha256(key.encode()).hexdigest()[:16]}"
    folder = root / ".coursebuild" / _FOLDER
    prefix = folder / name
    try:
        make_private_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        _remove_remains(folder)
        if not (prefix / "pyvenv.cfg").is_file():
            say(f"installing MuJoCo {engine} into .coursebuild/{_FOLDER}/{name}")
            wanted = {one: version for one, version in installed.items() if one in wanted}
            _make(prefix, engine, wanted | {"numpy": installed["numpy"]}, installed)
        os.utime(prefix)
        packages = _packages(prefix)
        _link_library(packages)
        _remove_unused(folder, prefix)
    except OSError as error:
        raise EffectError(f"{prefix.name} cannot be made: {reason(error)}") from None
    return Place(name, f"{prefix}/bin/python", str(prefix), packages)


def _plain(name: str) -> str:
    """A distribution's name as PEP 503 has it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _held(names: Iterable[str]) -> dict[str, str]:
    """What is installed here of these distributions, MuJoCo, and all that they require."""
    found: dict[str, str] = {}
    todo = [*names, _ENGINE]
    while todo:
        name = _plain(todo.pop())
        if name in found:
            continue
        try:
            distribution = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:  # of another system, or of an extra
            continue
        found[name] = distribution.version
        for line in distribution.requires or ():
            match = _REQUIRED.match(line)
            if match is not None and "extra" not in line.partition(";")[2]:
                todo.append(match.group())
    found.pop(_ENGINE, None)
    return found


def _make(prefix: Path, engine: str, wanted: Mapping[str, str], held: Mapping[str, str]) -> None:
    if importlib.util.find_spec("pip") is None:
        raise EffectError(
            "pip is not installed for this Python, and nothing can be installed without it",
            help="run `python -m ensurepip`",
        )
    with _temporary(prefix.parent) as new:
        with _told("a virtual environment cannot be made"):
            _run([sys.executable, "-m", "venv", "--without-pip", str(new)])
        configured = Path(sys.prefix) / "pip.conf"
        if configured.is_file():
            shutil.copyfile(configured, new / "pip.conf")
        constraints = new / "constraints.txt"
        rest = {one: version for one, version in held.items() if one not in wanted}
        constraints.write_text("".join(f"{one}=={version}\n" for one, version in rest.items()))
        python = str(new / "bin" / "python")
        pip = [sys.executable, "-m", "pip", "--python", python]
        pinned = [f"{one}=={version}" for one, version in wanted.items()]
        done = _run(
            [*pip, *_INSTALL, "-c", str(constraints), f"{_ENGINE}=={engine}", *pinned],
            check=False,
        )
        if done.returncode:
            raise pip_error(engine, done.stdout, {**held, **wanted})
        with _told(f"MuJoCo {engine} cannot be imported beside the other packages of here"):
            _run([python, "-E", "-P", "-c", _TRY])
        new.rename(prefix)


@contextlib.contextmanager
def _temporary(folder: Path) -> Iterator[Path]:
    """A folder that is gone afterwards, unless it was renamed; locked as long as we live."""
    new = Path(tempfile.mkdtemp(prefix=TEMPORARY, dir=folder))
    fd = os.open(new, os.O_RDONLY | os.O_CLOEXEC)
    try:
        try_lock(fd)
        yield new
    finally:
        shutil.rmtree(new, ignore_errors=True)
        os.close(fd)


@contextlib.contextmanager
def _told(what: str) -> Iterator[None]:
    try:
        yield
    except subprocess.CalledProcessError as error:
        lines = [line.strip() for line in error.output.splitlines() if line.strip()]
        raise EffectError(f"{what}: {lines[-1] if lines else 'it says nothing'}") from None


def _run(command: Sequence[str], *, check: bool = True) -> subprocess.CompletedProcess[str]:
    """Run a program; if we are interrupted it ends, with all that it has started."""
    # What is meant for this process's Python, such as warnings as errors, would disturb pip's.
    unsaid = ("PYTHON", "PIP_TARGET", "PIP_PREFIX", "PIP_PYTHON")
    outer = {name: value for name, value in os.environ.items() if not name.startswith(unsaid)}
    ours = {"PIP_USER": "0", "PIP_DISABLE_PIP_VERSION_CHECK": "1", "LC_ALL": "C.UTF-8"}
    process = subprocess.Popen(
        command,
        env={"PIP_RETRIES": "1", **outer, **ours},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="backslashreplace",
        start_new_session=True,
    )
    try:
        said, _ = process.communicate()
    finally:
        if process.poll() is None:
            with contextlib.suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            assert process.stdout is not None
            process.stdout.close()
    done = subprocess.CompletedProcess(list(command), process.returncode, said)
    if check:
        done.check_returncode()
    return done


def _packages(prefix: Path) -> str:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    return str(prefix / "lib" / f"python{version}" / "site-packages")


def _link_library(packages: str) -> None:
    """Let `mjcourse` be the one that came with this tool."""
    link, target = Path(packages, "mjcourse"), Path(library_folder(), "mjcourse")
    if not link.is_symlink() or link.readlink() != target:
        link.unlink(missing_ok=True)
        link.symlink_to(target)


def _remove_remains(folder: Path) -> None:
    """Remove environments whose makers were killed."""
    for path in folder.glob(f"{TEMPORARY}*"):
        with contextlib.suppress(OSError):
            fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
            try:
                if is_abandoned(fd):
                    shutil.rmtree(path, ignore_errors=True)
            finally:
                os.close(fd)


def _remove_unused(folder: Path, used: Path) -> None:
    """Keep the environments that were used last."""
    others = [path for path in folder.iterdir() if path != used and TEMPORARY not in path.name]
    others.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    for path in others[_KEPT - 1 :]:
        shutil.rmtree(path, ignore_errors=True)
