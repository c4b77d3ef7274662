"""The packages that scripts import: which are installed, and environments with others.

Nothing is imported. Reading what each distribution provides takes a quarter of a second, so the
whole map is stored under the names in the folders with installed packages, which say their
versions. A module that no distribution names, and one of this tool's own, is identified by the
content of its files. Of environments with another version of MuJoCo:

1. They lie in the user's own state folder, since what a course's folder holds is never run, and are
   used again, for all courses. The ones used last are kept.
2. A new one is made under a temporary name, and renamed when MuJoCo can be imported in it, so that
   none is ever incomplete. What a killed process left is removed the next time.
3. pip, as the user has configured it, installs MuJoCo with the packages that it consists of, and
   nothing else. All other packages are used from where they are installed here. uv makes
   environments without pip: in these uv installs.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import os
import platform
import re
import shutil
import sys
import tempfile
import venv
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

import msgspec

from coursebuild.core.engine.digests import file_state
from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import EffectError, UsageError, reason
from coursebuild.core.files.locks import folder_lock
from coursebuild.core.files.trust import TEMPORARY, state_folder
from coursebuild.core.model.results import OutputFile
from coursebuild.core.run import gate
from coursebuild.core.run.script_environment import (
    Interpreter,
    engine_version,
    installed_distributions,
    python_version,
)

ABSENT = ""
_TOOL_PACKAGE = "coursebuild"
_LIBRARY = Path(__file__).resolve().parents[3]
_FOLDERS = ("site-packages", "dist-packages")


def site_folders() -> tuple[str, ...]:
    """The folders with installed packages, which scripts see as well."""
    return tuple(path for path in sys.path if Path(path).name in _FOLDERS)


class InstalledPackages:
    """The packages that are installed for the interpreter that runs the scripts."""

    def __init__(self, store: Store, folders: Sequence[str] | None = None) -> None:
        self._folders = site_folders() if folders is None else tuple(folders)
        self._distributions = functools.cache(lambda: _map_distributions(store, self._folders))
        self.version = functools.cache(self._version)
        """The version of a module, such as `numpy 2.4.6`; empty where there is no such module."""

    def _version(self, module: str) -> str:
        distribution = self._distributions().get(module)
        if distribution is not None:
            return distribution
        spec = _spec(module, self._folders) or _spec(module, [str(_LIBRARY)])
        if spec is None or not spec.submodule_search_locations:
            return ABSENT if spec is None else f"files {file_state(spec.origin or '')[:16]}"
        digest = hashlib.sha256()
        for top in sorted(spec.submodule_search_locations):
            for file in sorted(Path(top).rglob("*")):
                if "__pycache__" not in file.parts and file.is_file():
                    state = file_state(str(file))
                    digest.update(f"{file.relative_to(top).as_posix()}\0{state}\0".encode())
        return f"files {digest.hexdigest()[:16]}"


def distributions(
    store: Store, modules: Iterable[str], folders: Sequence[str] | None = None
) -> tuple[tuple[str, str, str], ...]:
    """(module, distribution, version) of each top-level module that an installed package provides.

    Sorted by module. The standard library, `mjcourse` and what is not installed are left out.
    `folders` are those of another interpreter's packages.
    """
    names = sorted(set(modules))
    by_module = _map_distributions(store, folders or site_folders()) if names else {}
    rows = []
    for module in names:
        name, _, version = by_module.get(module, "").split(", ")[0].rpartition(" ")
        if name:
            rows.append((module, name, version))
    return tuple(rows)


def module_files(name: str, folders: Iterable[Path]) -> tuple[OutputFile, ...]:
    """The files of a module from the first of these folders that has it; their paths are relative.

    `mjcourse`, where none has it, is the one that came with this tool.
    """
    spec = importlib.util.find_spec(name) if name == "mjcourse" else None
    ours = [] if spec is None or spec.origin is None else [Path(spec.origin).parents[1]]
    for folder in (*folders, *ours):
        paths = sorted([folder / f"{name}.py", *(folder / name).rglob("*")])
        files = tuple(
            OutputFile(path.relative_to(folder).as_posix(), path.read_bytes())
            for path in paths
            if path.is_file() and "__pycache__" not in path.parts
        )
        if files:
            return files
    return ()


def _spec(module: str, folders: Sequence[str]) -> ModuleSpec | None:
    with contextlib.suppress(ImportError, ValueError):
        return PathFinder.find_spec(module, list(folders))
    return None


def _map_distributions(store: Store, folders: Sequence[str]) -> Mapping[str, str]:
    contents: list[list[str]] = []
    for folder in folders:
        contents.append([])
        with contextlib.suppress(OSError):
            contents[-1] = sorted(os.listdir(folder))  # noqa: PTH208
    key = hashlib.sha256(repr((sys.version, *contents)).encode()).hexdigest()
    # It is no result of the course, so that `--no-cache` does not make it again.
    decode = functools.partial(msgspec.json.decode, type=dict[str, str])
    names = store.peek("installed", key, decode)
    if names is None:
        names_by_module: dict[str, set[str]] = {}
        seen_names: set[str] = set()
        for distribution in installed_distributions(folders):
            name = distribution.metadata["Name"] or ""
            if name in seen_names or name == _TOOL_PACKAGE:  # the first on the path counts
                continue
            seen_names.add(name)
            top_level = distribution.read_text("top_level.txt") or ""
            modules = {module.rpartition("/")[2] for module in top_level.split()}
            for file in () if top_level else distribution.files or ():
                first = file.parts[0] if file.parts else ""
                if len(file.parts) > 1 and first.isidentifier():
                    modules.add(first)
                elif len(file.parts) == 1 and file.suffix in (".py", ".so", ".pyd"):
                    modules.add(first.split(".")[0])
            for module in modules:
                names_by_module.setdefault(module, set()).add(f"{name} {distribution.version}")
        names = {module: ", ".join(sorted(names)) for module, names in names_by_module.items()}
        store.put_value("installed", key, names)
    return names


# --- environments with other versions

_FOLDER = "environments"
_MAX_ENVIRONMENTS = 4
"""Environments that are kept."""
_VERSION = re.compile(
    r"\d+(\.\d+){0,3}((a|b|rc)\d+)?(\.post\d+)?(\.dev\d+)?(\+[a-z0-9.]+)?", re.ASCII
)
_ENGINE = "mujoco"
_NO_VERSION = rf"there is no version of {_ENGINE}|{_ENGINE}\S* was not found"
"""What uv says."""
_MOST_QUOTED = 4
"""The most lines of an installer's that an error quotes."""


def check_other_version(text: str) -> str:
    """The version of MuJoCo that a text names; a `UsageError` where it is none, or that of here."""
    if not _VERSION.fullmatch(text):
        raise UsageError(f"--against: {text!r} is not a version of MuJoCo, such as 3.13.0")
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


def prepare_environment(root: Path, engine: str, say: Callable[[str], None]) -> Interpreter:
    """The environment with this version of MuJoCo; an `EffectError` where it cannot be made."""
    prefix = environment_prefix(root, engine)
    folder = prefix.parent
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with folder_lock(folder):
            for remains in folder.glob(f"{TEMPORARY}*"):
                shutil.rmtree(remains, ignore_errors=True)
            if not (prefix / "pyvenv.cfg").is_file():
                say(f"installing MuJoCo {engine} into {prefix}")
                _create_environment(prefix, engine)
            os.utime(prefix)
            # Remove all environments except those that were used last
            rest = [path for path in folder.iterdir() if path != prefix]
            rest.sort(key=lambda path: path.stat().st_mtime, reverse=True)
            for path in rest[_MAX_ENVIRONMENTS - 1 :]:
                shutil.rmtree(path, ignore_errors=True)
    except OSError as error:
        raise EffectError(f"{prefix.name} cannot be created: {reason(error)}") from None
    python, packages = f"{prefix}/bin/python", (str(_packages(prefix)), *site_folders())
    version, base = python_version(), sys.base_prefix
    return Interpreter(prefix.name, python, str(prefix), base, version, engine, packages)


def environment_prefix(root: Path, engine: str) -> Path:
    """Where the environment with a MuJoCo is, or would be; an `EffectError` without a place."""
    parts = [sys.version, sys.base_prefix, site_folders()]
    name = f"mujoco-{engine}-{hashlib.sha256(repr(parts).encode()).hexdigest()[:16]}"
    state = state_folder(str(root))
    if state is None:
        help = "set HOME or XDG_STATE_HOME to a folder outside the course"
        message = f"there is no place for an environment with MuJoCo {engine}"
        raise EffectError(message, help=help)
    return Path(state, _FOLDER, name)


def _packages(prefix: Path) -> Path:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    return prefix / "lib" / f"python{version}" / "site-packages"


def _has_pip() -> bool:
    return importlib.util.find_spec("pip") is not None


def _install_command(python: str) -> list[str]:
    plain = ["--no-deps", "--only-binary", ":all:"]
    if _has_pip():
        pip = gate.python_command("-m", "pip", "--python", python, "install")
        return [*pip, "--no-input", "--progress-bar", "off", *plain]
    if uv := gate.find_program("uv"):
        return [uv, "pip", "install", "--python", python, "--no-progress", *plain, *_uv_settings()]
    message = "this Python has no pip, and there is no uv, so nothing can be installed"
    raise EffectError(message, help="run `python -m ensurepip`")


def _uv_settings() -> tuple[str, ...]:
    """Let uv obey the user's settings, or the machine's, and none in a folder that it works in."""
    home = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")  # noqa: PTH111
    places = (f"{home}/uv/uv.toml", "/etc/uv/uv.toml")
    for file in map(Path, (os.environ.get("UV_CONFIG_FILE", ""), *places)):
        if file.is_absolute() and file.is_file():
            return "--config-file", str(file)
    return ("--no-config",)


def _create_environment(prefix: Path, engine: str) -> None:
    new = Path(tempfile.mkdtemp(prefix=TEMPORARY, dir=prefix.parent))
    try:
        venv.create(new, symlinks=True)
        configured = Path(sys.prefix) / "pip.conf"
        if configured.is_file():
            shutil.copyfile(configured, new / "pip.conf")
        python = str(new / "bin" / "python")
        command = _install_command(python)
        requirements, installed = {f"{_ENGINE}=={engine}"}, set[str]()
        while requirements:
            status, output = _run([*command, *sorted(requirements)])
            if status:
                raise _install_error(engine, output)
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
        status, output = _run(gate.python_command("-c", f"import {_ENGINE}", program=python))
        if status:
            message = "cannot be imported together with the other installed packages"
            last_line = ["no reason", *_lines(output)][-1]
            raise EffectError(f"MuJoCo {engine} {message}: {last_line}")
        new.rename(prefix)
    finally:
        shutil.rmtree(new, ignore_errors=True)


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
    variables = {"PIP_RETRIES": "1", **gate.environment(*gate.INSTALLERS), **ours}
    variables = {name: value for name, value in variables.items() if name not in places}
    done = gate.finish(command, variables, stderr=gate.TO_OUTPUT)
    return done.status, done.output.decode("utf-8", "backslashreplace")
