"""Environments with another version of MuJoCo, which all courses of a user share.

1. They lie in the user's own state folder, since what a course's folder holds is never run, and are
   used again. The ones used last are kept.
2. A new one is made under a temporary name, and renamed when MuJoCo can be imported in it, so that
   none is ever incomplete. What a killed process left is removed the next time.
3. pip, as the user has configured it, installs MuJoCo with the packages that it consists of, and
   nothing else. All other packages are used from where they are installed here. uv makes
   environments without pip: in these uv installs.
4. What is locked is installed by the hashes that came with this tool, so that it is the same from
   wherever it comes. Of other versions nobody knows them beforehand: their environments are kept
   apart by how the installers are configured, and so by where they look.
5. Each holds a record of what was installed and from where, with the hash of every file. All are
   hashed again when it is used: one that has no record, or another file, is made anew.
"""

from __future__ import annotations

import compileall
import contextlib
import hashlib
import importlib.util
import os
import platform
import re
import shutil
import sys
import tempfile
import venv
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild import __version__
from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.errors import EffectError, UsageError, reason
from coursebuild.core.files.locks import folder_lock
from coursebuild.core.files.resources import locked_requirements
from coursebuild.core.files.trust import TEMPORARY, state_folder
from coursebuild.core.run import gate
from coursebuild.core.run.script_environment import (
    Interpreter,
    conditions,
    engine_version,
    installed_distributions,
    package_version,
    python_version,
    site_folders,
)

_FOLDER = "environments"
_RECORD = "record.json"
_MAX_ENVIRONMENTS = 4
"""Environments that are kept."""
_VERSION = re.compile(
    r"\d+(\.\d+){0,3}((a|b|rc)\d+)?(\.post\d+)?(\.dev\d+)?(\+[a-z0-9.]+)?", re.ASCII
)
_ENGINE = "mujoco"
_NO_VERSION = rf"there is no version of {_ENGINE}|{_ENGINE}\S* was not found"
"""What uv says."""
_OF_UV = ("uv/uv.toml", "UV_CONFIG_FILE", "/etc/uv/uv.toml")
_MOST_QUOTED = 4
"""The most lines of an installer's that an error quotes."""


def check_other_version(text: str) -> str:
    """The version of MuJoCo that a text names; a `UsageError` where it is none, or that of here."""
    if not _VERSION.fullmatch(text):
        raise UsageError(f"--against: {text!r} is not a version of MuJoCo, such as 3.13.0")
    if engine_version() == "none":
        message = "MuJoCo is not installed for this Python"
        raise EffectError(message, help="run `pip install coursebuild` again")
    if _without_zeros(text) == _without_zeros(engine_version()):
        raise UsageError(f"--against: MuJoCo {engine_version()} is the version installed here")
    return text


def latest_version() -> str:
    """The newest MuJoCo that pip or uv would install here; an `EffectError` where there is none."""
    command = _install_command(sys.executable)
    anew = ["--ignore-installed"] if _has_pip() else ["--reinstall", "--upgrade"]
    status, output = _run([*command, "--dry-run", *anew, _ENGINE])
    versions = re.findall(rf"\b{_ENGINE}[-=]+([0-9]\S*)", output.rpartition("Would install")[2])
    if status or not versions:
        raise _install_error("at all", output)
    return str(versions[-1])  # uv first names the one that it would remove


def _without_zeros(version: str) -> str:
    """A version without trailing zeros: 3.13 for 3.13.0."""
    return re.sub(r"(\.0)+(?=$|[a-z+]|\.(?:post|dev))", "", version)


class Environment(Struct, frozen=True):
    """An environment, which need not be there yet."""

    prefix: Path
    engine: str
    """Its version of MuJoCo."""
    locked: bool
    """Whether it is installed by hashes."""

    @property
    def interpreter(self) -> Interpreter:
        """Its interpreter."""
        packages = (str(_packages(self.prefix)), *site_folders())
        name, python = self.prefix.name, f"{self.prefix}/bin/python"
        version, base = python_version(), sys.base_prefix
        return Interpreter(name, python, str(self.prefix), base, version, self.engine, packages)

    def fault(self) -> str:
        """Why it cannot be used as it is, as the end of a sentence; empty where it can."""
        if not self.prefix.is_dir():
            return "is not there"
        try:
            record = msgspec.json.decode((self.prefix / _RECORD).read_bytes(), type=_Record)
        except (OSError, msgspec.DecodeError):
            return "has no record of what was installed"
        files = dict(_hash_files(self.prefix))
        for path in sorted({*record.files, *files}):
            if record.files.get(path) != files.get(path):
                return f"has another `{path}` than was installed"
        return ""


class _Record(Struct, frozen=True):
    """What an environment consists of."""

    requirements: tuple[str, ...]
    sources: tuple[str, ...]
    """Where pip found each, with its hash; of uv, which does not say it, nothing."""
    files: dict[str, str]
    """Hashes of files and targets of links, by path."""


def find_environment(root: Path, engine: str, *, locked: bool = False) -> Environment:
    """The environment with a version of MuJoCo; an `EffectError` where there is no place for it."""
    origin = _locked(f"{_ENGINE}=={engine}") if locked else _settings()
    parts = [sys.version, sys.base_prefix, site_folders(), origin]
    name = f"{_ENGINE}-{engine}-{hashlib.sha256(repr(parts).encode()).hexdigest()[:16]}"
    state = state_folder(str(root))
    if state is None:
        help = "set HOME or XDG_STATE_HOME to a folder outside the course"
        message = f"there is no place for an environment with MuJoCo {engine}"
        raise EffectError(message, help=help)
    return Environment(Path(state, _FOLDER, name), engine, locked)


def prepare_environment(
    root: Path, engine: str, say: Callable[[str], None], *, locked: bool = False
) -> Interpreter:
    """The interpreter of an environment, which is made where it is not there as it should be.

    Raises:
        EffectError: it cannot be made.
    """
    environment = find_environment(root, engine, locked=locked)
    prefix, folder = environment.prefix, environment.prefix.parent
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with folder_lock(folder):
            for remains in folder.glob(f"{TEMPORARY}*"):
                shutil.rmtree(remains, ignore_errors=True)
            if fault := environment.fault():
                if prefix.is_dir():
                    say(f"{prefix} {fault}, and is made anew")
                    shutil.rmtree(prefix)
                say(f"installing MuJoCo {engine} into {prefix}")
                _create_environment(environment)
            os.utime(prefix)
            # Remove all environments except those that were used last
            rest = [path for path in folder.iterdir() if path != prefix]
            rest.sort(key=lambda path: path.stat().st_mtime, reverse=True)
            for path in rest[_MAX_ENVIRONMENTS - 1 :]:
                shutil.rmtree(path, ignore_errors=True)
    except OSError as error:
        raise EffectError(f"{prefix.name} cannot be created: {reason(error)}") from None
    return environment.interpreter


def _hash_files(prefix: Path) -> Iterator[tuple[str, str]]:
    for folder, folders, names in os.walk(prefix):
        for path in (Path(folder, name) for name in (*folders, *names)):
            name = path.relative_to(prefix).as_posix()
            if path.is_symlink():
                yield name, f"link to {path.readlink()}"
            elif path.is_file() and name != _RECORD:
                with path.open("rb") as file:
                    yield name, hashlib.file_digest(file, "sha256").hexdigest()


def _packages(prefix: Path) -> Path:
    major, minor, *_ = sys.version_info
    return prefix / f"lib/python{major}.{minor}/site-packages"


def _has_pip() -> bool:
    return importlib.util.find_spec("pip") is not None


def _install_command(python: str) -> list[str]:
    plain = ["--no-deps", "--only-binary", ":all:"]
    if _has_pip():
        pip = gate.python_command("-m", "pip", "--python", python, "install")
        return [*pip, "--no-input", "--progress-bar", "off", *plain]
    if uv := gate.find_program("uv"):
        # It obeys the user's settings, or the machine's, and none in a folder that it works in.
        file = next(_configuration(*_OF_UV), None)
        settings = ["--no-config"] if file is None else ["--config-file", str(file)]
        return [uv, "pip", "install", *settings, "--python", python, "--no-progress", *plain]
    message = "this Python has no pip, and there is no uv, so nothing can be installed"
    raise EffectError(message, help="run `python -m ensurepip`")


def _configuration(name: str, variable: str, *places: str) -> Iterator[Path]:
    """The files with the user's settings of an installer, the most important one first."""
    home = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")  # noqa: PTH111
    for file in map(Path, (os.environ.get(variable, ""), f"{home}/{name}", *places)):
        if file.is_absolute() and file.is_file():
            yield file


def _settings() -> str:
    """A hash of how the installers are configured."""
    variables = [(n, v) for n, v in os.environ.items() if n.startswith(("PIP_", "UV_"))]
    home = os.path.expanduser("~")  # noqa: PTH111
    of_pip = f"{sys.prefix}/pip.conf", f"{home}/.pip/pip.conf", "/etc/pip.conf"
    files = [
        *_configuration("pip/pip.conf", "PIP_CONFIG_FILE", *of_pip),
        *_configuration(*_OF_UV),
    ]
    contents = [file.read_bytes() for file in files]
    return hashlib.sha256(repr((sorted(variables), contents)).encode()).hexdigest()


def _locked(requirement: str) -> str:
    """A requirement with the hashes of its files, as this tool was tested with it."""
    pattern = rf"^{re.escape(requirement)} (?:.*\\\n)+.*$"
    locked = locked_requirements([requirement.partition("==")[0]])
    match = re.search(pattern, locked, re.MULTILINE)
    if match is None:
        raise EffectError(f"this coursebuild brings no hashes of {requirement} along")
    return match[0]


def _create_environment(environment: Environment) -> None:
    prefix, engine = environment.prefix, environment.engine
    new = Path(tempfile.mkdtemp(prefix=TEMPORARY, dir=prefix.parent))
    try:
        venv.create(new, symlinks=True)
        configured = Path(sys.prefix) / "pip.conf"
        if configured.is_file():
            shutil.copyfile(configured, new / "pip.conf")
        sources: list[str] = []
        requirements, installed = {f"{_ENGINE}=={engine}"}, set[str]()
        while requirements:
            sources += _install(new, environment, sorted(requirements))
            installed |= requirements
            needs = {  # MuJoCo requires packages of its own, as `mujoco-core==4.0.0`
                need
                for distribution in installed_distributions([str(_packages(new))])
                for need in distribution.requires or ()
                if need.startswith(f"{_ENGINE}-") and "extra ==" not in need
            }
            requirements = needs - installed
        lines = (f"import site; site.addsitedir({folder!r})\n" for folder in site_folders())
        (_packages(new) / "packages_of_here.pth").write_text("".join(lines))
        python = str(new / "bin" / "python")
        status, output = _run(gate.python_command("-c", f"import {_ENGINE}", program=python))
        if status:
            message = "cannot be imported together with the other installed packages"
            last_line = ["no reason", *_lines(output)][-1]
            raise EffectError(f"MuJoCo {engine} {message}: {last_line}")
        compileall.compile_dir(_packages(new), quiet=2)  # nothing is written there any more
        record = _Record(tuple(sorted(installed)), tuple(sources), dict(_hash_files(new)))
        (new / _RECORD).write_bytes(msgspec.json.format(msgspec.json.encode(record)))
        new.rename(prefix)
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _install(new: Path, environment: Environment, requirements: Sequence[str]) -> Iterator[str]:
    """Install into a new environment; yield where each package came from, and its hash."""
    command = [*_install_command(str(new / "bin" / "python")), *requirements]
    with tempfile.TemporaryDirectory(dir=new) as folder:
        if environment.locked:
            file = Path(folder, "requirements.txt")
            file.write_text("".join(f"{_locked(name)}\n" for name in requirements))
            command[-len(requirements) :] = ["--require-hashes", "-r", str(file)]
        report = Path(folder, "report.json")
        status, output = _run([*command, *(["--report", str(report)] if _has_pip() else [])])
        if status:
            raise _install_error(environment.engine, output)
        with contextlib.suppress(FileNotFoundError):
            for item in msgspec.json.decode(report.read_bytes())["install"]:
                info = item["download_info"]
                yield f"{info['url']} {info.get('archive_info', {}).get('hash', '')}".strip()


def _install_error(engine: str, output: str) -> EffectError:
    tool, offline = ("pip", "PIP_NO_INDEX") if _has_pip() else ("uv", "UV_OFFLINE")
    if re.search(rf"No matching distribution found for {_ENGINE}|{_NO_VERSION}", output):
        host = f"Python {'.'.join(platform.python_version_tuple()[:2])} on {platform.machine()}"
        help = (
            f"without a network, point {tool} to a folder of wheels with the environment variables "
            f"{tool.upper()}_FIND_LINKS and {offline}"
        )
        return EffectError(f"{tool} finds no MuJoCo {engine} for {host}", help=help)
    lines = _lines(output)
    errors = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR: ")]
    reasons = errors if errors != ["Exception:"] else lines[-1:]  # pip's own traceback
    quoted_lines = (reasons or lines)[-_MOST_QUOTED:]
    return EffectError(f"{tool} cannot install MuJoCo {engine}: {'; '.join(quoted_lines)}")


def _lines(output: str) -> list[str]:
    return [line.strip() for line in output.splitlines() if line.strip()]


def _run(command: Sequence[str]) -> tuple[int, str]:
    """Run a program: its status and output."""
    # What says where to install would disturb an installer that is told so.
    places = ("PIP_TARGET", "PIP_PREFIX", "PIP_PYTHON", "UV_PYTHON", "UV_SYSTEM_PYTHON")
    ours = {"PIP_USER": "0", "PIP_DISABLE_PIP_VERSION_CHECK": "1", "LC_ALL": "C.UTF-8"}
    ours["TMPDIR"] = gate.working_folder()  # killed, pip leaves there what it was unpacking
    # Wheels need no program but one that knows passwords; pip would start `rustc` for its version.
    ours["PATH"] = os.path.dirname(gate.find_program("keyring") or "")  # noqa: PTH120
    variables = {"PIP_RETRIES": "1", **gate.environment(*gate.INSTALLERS), **ours}
    variables = {name: value for name, value in variables.items() if name not in places}
    done = gate.finish(command, variables, stderr=gate.TO_OUTPUT)
    return done.status, done.output.decode("utf-8", "backslashreplace")


def deciding_versions() -> dict[str, str]:
    """What must be the same on another machine for its results to be those of this one, by name."""
    return {
        "coursebuild": f"{__version__}, code {code_digest('coursebuild', 'mjcourse')[:12]}",
        **{name: value for name, value in conditions({}) if not name.startswith("the fixed")},
        "MuJoCo": engine_version(),
        "NumPy": package_version("numpy"),
    }
