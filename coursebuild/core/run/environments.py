"""Environments with another version of MuJoCo and otherwise the packages of here.

Entry points: `other_version`, what the user may name; `latest_version`, the one that pip finds;
`environment`, which makes one.

1. An environment lies in `.coursebuild/environments`: one that is there is used again. The ones
   used last are kept.
2. A new one is made beside its place and renamed there when MuJoCo can be imported in it, so that
   none is ever half there. The remains of a process that was killed are removed the next time.
3. pip, as the user has configured it, installs MuJoCo, with the packages that it consists of, and
   nothing else. All other packages are found where they are installed here.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import venv
from collections.abc import Callable, Sequence
from pathlib import Path

from coursebuild.core.engine.memo import TEMPORARY
from coursebuild.core.files.errors import EffectError, UsageError, reason
from coursebuild.core.files.locks import make_private_folder
from coursebuild.core.run.packages import site_folders
from coursebuild.core.run.script_environment import OtherEnvironment
from coursebuild.core.run.versions import engine_version, python_version

_FOLDER = "environments"
_KEPT = 4
"""Environments that stay."""
_VERSION = re.compile(
    r"\d+(\.\d+){0,3}((a|b|rc)\d+)?(\.post\d+)?(\.dev\d+)?(\+[a-z0-9.]+)?", re.ASCII
)
_ENGINE = "mujoco"
_INSTALL = ("install", "--no-deps", "--no-input", "--progress-bar", "off", "--only-binary", ":all:")
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


def latest_version() -> str:
    """The newest version of MuJoCo that pip, as the user has configured it, would install here.

    Raises:
        EffectError: it finds none.
    """
    _require_pip()
    pip = [sys.executable, "-m", "pip", *_INSTALL, "--dry-run", "--ignore-installed", "--quiet"]
    status, said = _run([*pip, "--report", "-", _ENGINE])
    if status:
        raise _pip_error("at all", said)
    report, _ = json.JSONDecoder().raw_decode(said, said.index("{"))  # warnings stand around it
    version: str = report["install"][0]["metadata"]["version"]
    return version


def _shortened(version: str) -> str:
    """3.13 for 3.13.0, which is the same version."""
    return re.sub(r"(\.0)+(?=$|[a-z+]|\.(?:post|dev))", "", version)


def environment(root: Path, engine: str, say: Callable[[str], None]) -> OtherEnvironment:
    """The environment with this version of MuJoCo; made if it is not there.

    Only one process at a time may do this for a course: see `project_lock`.

    Raises:
        EffectError: it cannot be made.
    """
    parts = [sys.version, sys.base_prefix, site_folders()]
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
            _make(prefix, engine)
        os.utime(prefix)
        _remove_unused(folder, prefix)
    except OSError as error:
        raise EffectError(f"{prefix.name} cannot be made: {reason(error)}") from None
    return OtherEnvironment(
        name,
        f"{prefix}/bin/python",
        str(prefix),
        sys.base_prefix,
        python_version(),
        engine,
        (str(_packages(prefix)), *site_folders()),
    )


def _packages(prefix: Path) -> Path:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    return prefix / "lib" / f"python{version}" / "site-packages"


def _require_pip() -> None:
    if importlib.util.find_spec("pip") is None:
        raise EffectError(
            "pip is not installed for this Python, and nothing can be installed without it",
            help="run `python -m ensurepip`",
        )


def _make(prefix: Path, engine: str) -> None:
    _require_pip()
    new = Path(tempfile.mkdtemp(prefix=TEMPORARY, dir=prefix.parent))
    try:
        venv.create(new, symlinks=True)
        configured = Path(sys.prefix) / "pip.conf"
        if configured.is_file():
            shutil.copyfile(configured, new / "pip.conf")
        python = str(new / "bin" / "python")
        pip = [sys.executable, "-m", "pip", "--python", python, *_INSTALL]
        wanted, installed = {f"{_ENGINE}=={engine}"}, set[str]()
        while wanted:
            status, said = _run([*pip, *sorted(wanted)])
            if status:
                raise _pip_error(engine, said)
            installed |= wanted
            wanted = _parts(_packages(new)) - installed
        lines = (f"import site; site.addsitedir({folder!r})\n" for folder in site_folders())
        (_packages(new) / "packages_of_here.pth").write_text("".join(lines))
        status, said = _run([python, "-E", "-P", "-c", f"import {_ENGINE}"])
        if status:
            beside = f"MuJoCo {engine} cannot be imported beside the other packages of here"
            raise EffectError(f"{beside}: {_last(said)}")
        new.rename(prefix)
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _parts(packages: Path) -> set[str]:
    """What MuJoCo needs of its own packages, as `mujoco-core==4.0.0`."""
    needs = {
        need
        for installed in importlib.metadata.distributions(path=[str(packages)])
        for need in installed.requires or ()
    }
    return {need for need in needs if need.startswith(f"{_ENGINE}-") and "extra ==" not in need}


def _pip_error(engine: str, said: str) -> EffectError:
    """Why pip did not install this version of MuJoCo, mostly in its own words."""
    if f"No matching distribution found for {_ENGINE}" in said:
        where = f"Python {'.'.join(platform.python_version_tuple()[:2])} on {platform.machine()}"
        return EffectError(f"pip finds no MuJoCo {engine} for {where}", help=_OFFLINE)
    lines = [line.strip() for line in said.splitlines() if line.strip()]
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


def _remove_unused(folder: Path, used: Path) -> None:
    """Keep the environments that were used last."""
    others = [path for path in folder.iterdir() if path != used]
    others.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    for path in others[_KEPT - 1 :]:
        shutil.rmtree(path, ignore_errors=True)
