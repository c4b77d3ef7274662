"""Where scripts run: their environment, their interpreter, its packages, the versions, the machine.

Nothing is imported to find a version, and nothing of an environment is run: its files are read.
Reading what each distribution provides takes a quarter of a second, so the whole map is stored
under the names in the folders with installed packages, which say their versions. A module that no
distribution names, and one of this tool's own, is identified by the content of its files.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import Distribution, PathDistribution
from pathlib import Path

from msgspec import Struct

from coursebuild.core.engine.digests import file_state
from coursebuild.core.engine.store import Store, value_reader
from coursebuild.core.files.course_root import DECISIVE, read_regular
from coursebuild.core.files.errors import lacking, reason
from coursebuild.core.model import Course, NamedPath
from coursebuild.core.model.results import Machine, OutputFile
from coursebuild.core.run import gate
from coursebuild.core.text.diagnostics import Parsed, diagnose

_SAYS_NOTHING = tuple("PATH HOME USER LOGNAME VIRTUAL_ENV CONDA_PREFIX".split())
"""Variables about the user and the places of programs, which do not change a result."""
_FIXED = {
    "LC_ALL": "C.UTF-8",
    "LANG": "C.UTF-8",
    "TZ": "UTC",
    "PYTHONUTF8": "1",
    "PYTHONIOENCODING": "utf-8",
    "PYTHONHASHSEED": "0",
    "PYTHONDONTWRITEBYTECODE": "1",
    # A crash, and a script that is stopped after its time limit, say where they were.
    "PYTHONFAULTHANDLER": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "BLIS_NUM_THREADS": "1",
    "NUMEXPR_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
    "NO_COLOR": "1",
    "TERM": "dumb",
    "MPLBACKEND": "Agg",
}


class Interpreter(Struct, frozen=True):
    """Another interpreter that runs scripts, and what is installed for it."""

    name: str
    """Empty for the course's own. Results of another one, as `check --against` makes it, are kept
    apart under its name."""
    python: str
    """The interpreter's absolute path."""
    prefix: str
    """The folder that holds all of it."""
    base: str
    """The folder of the Python that it was made with."""
    version: str
    """Of Python, such as `3.11.7`."""
    engine: str
    """The version of MuJoCo."""
    packages: tuple[str, ...]
    """The folders with the packages that are installed there."""

    def environment(self, clean: Mapping[str, str]) -> dict[str, str]:
        """The environment of scripts there, made from the one that they have here."""
        programs = f"{self.prefix}/bin"
        path = f"{programs}:{clean['PATH']}"
        return {**clean, "PATH": path, "VIRTUAL_ENV": self.prefix}


def clean_environment(outer: Mapping[str, str]) -> dict[str, str]:
    """The environment of scripts except TMPDIR, made from the one that the tool runs in."""
    names = (*_SAYS_NOTHING, *DECISIVE)
    path = gate.absolute_places(outer.get("PATH", os.defpath))
    return {name: outer[name] for name in names if name in outer} | {**_FIXED, "PATH": path}


def find_runner(name: str, interpreter: Interpreter | None) -> str | None:
    """The path of a program that runs scripts, found where they would find it themselves."""
    environment = clean_environment(os.environ)
    if interpreter is not None:
        environment = interpreter.environment(environment)
    return shutil.which(name, path=environment["PATH"])


def library_folder() -> str:
    """The folder that holds the package `mjcourse` that came with this tool."""
    return str(Path(__file__).resolve().parents[3])


def wanted_packages(scripts: Iterable[Path]) -> tuple[str, ...]:
    """The packages to import once for these scripts: those that a file of their folders names.

    A script that imports MuJoCo in another way still runs, but its result is not remembered.
    """
    words: set[bytes] = set()
    for folder in {path.parent for path in scripts}:
        for path in folder.glob("*.py"):
            if b"mujoco" not in words and path.is_file():  # a pipe has no end
                with contextlib.suppress(OSError):
                    words.update(re.findall(rb"\b(?:mujoco|mjcourse|numpy)\b", path.read_bytes()))
    if b"mujoco" in words:
        return "numpy", "mujoco"
    return ("numpy",) if words else ()


# --- what a result depends on besides the script


def conditions(
    outer: Mapping[str, str], interpreter: Interpreter | None = None
) -> tuple[tuple[str, str], ...]:
    """What results depend on besides files, by name and sorted; `outer`: the tool's environment."""
    values = {f"environment variable {name}": outer[name] for name in DECISIVE if name in outer}
    version = platform.python_version() if interpreter is None else interpreter.version
    values["Python"] = f"{platform.python_implementation()} {version}"
    if interpreter is not None and interpreter.name:
        values["environment"] = interpreter.name
    c_library = ""  # whose mathematical functions Python uses
    with contextlib.suppress(OSError, ValueError):
        c_library = os.confstr("CS_GNU_LIBC_VERSION") or ""
    values["platform"] = f"{sys.platform} {platform.machine()} {c_library}".strip()
    fixed = json.dumps(_FIXED, sort_keys=True).encode()
    values["the fixed environment of scripts"] = hashlib.sha256(fixed).hexdigest()[:12]
    return tuple(sorted(values.items()))


def places(
    root: Path, outer: Mapping[str, str], interpreter: Interpreter | None = None
) -> tuple[tuple[str, str], ...]:
    """Folders of this machine, by name, whose paths a script may print; longest first."""
    folders = {
        "course": str(root),
        "library": library_folder(),
        "prefix": sys.prefix if interpreter is None else interpreter.prefix,
        "base": sys.base_prefix if interpreter is None else interpreter.base,
        "home": outer.get("HOME", ""),
    }
    return tuple(sorted(folders.items(), key=lambda item: (-len(item[1]), item[0])))


# --- versions


def python_version() -> str:
    """The version of the interpreter that runs this tool and the scripts, such as `3.11.7`."""
    return sys.version.split()[0]


@functools.cache
def engine_version() -> str:
    """The version of the installed MuJoCo, such as `3.14.0`; `none` where it is not installed."""
    return package_version("mujoco")


class _InstalledDistribution(PathDistribution):
    """That of the standard library would wait for a pipe, and never end reading a device."""

    def __init__(self, place: Path) -> None:
        super().__init__(place)
        self._place = place

    def read_text(self, filename: str | os.PathLike[str]) -> str | None:
        try:
            return read_regular(self._place / filename).decode("utf-8", "replace")
        except OSError as error:
            if lacking(error):
                raise
            return None


def installed_distributions(folders: Iterable[str], name: str = "") -> Iterator[Distribution]:
    """The distributions in folders, which may be a stranger's; all, or those of one name."""
    pattern = re.sub(r"[-_.]+", "[-_.]+", name) or ".*"
    place = re.compile(rf"(?i:{pattern}(-.*)?\.(dist|egg)-info)")
    for folder in folders:
        try:
            entries = sorted(os.listdir(folder))  # noqa: PTH208
        except OSError as error:
            if lacking(error):
                raise
            continue
        for entry in filter(place.fullmatch, entries):
            yield _InstalledDistribution(Path(folder, entry))


def package_version(name: str, folders: Iterable[str] | None = None) -> str:
    """The version of a distribution, here or in these folders; `none` where it is not installed."""
    path = list(sys.path if folders is None else folders)
    for distribution in installed_distributions(path, name):
        # What an interrupted installation left may say no version, or have no metadata.
        with contextlib.suppress(FileNotFoundError):
            metadata = distribution.metadata
            if "Version" in metadata:
                return metadata["Version"] or "none"
    return "none"


# --- the course's own environment

_OLDEST = (3, 11)
"""The oldest Python that can run the modules of this package."""
_SETTING = re.compile(r"^(\w+) *= *(.*?) *$", re.MULTILINE)


def course_environment(root: Path, course: Course) -> Parsed[Interpreter | None]:
    """The environment that the map names, or why scripts cannot run there."""
    named_path = course.python
    if named_path is None:
        return Parsed(None, ())
    python = root / named_path.path
    prefix = python.parent.parent
    if not os.access(python, os.X_OK):
        folder = named_path.path.rpartition("/bin/")[0]
        help = f"make it: `python -m venv {folder}`, then install there what scripts import"
        return _reject(named_path, f"there is no interpreter `{named_path.path}`", help)
    try:
        text = read_regular(prefix / "pyvenv.cfg").decode("utf-8", "replace")
    except OSError as error:
        problem = f"is not of a virtual environment: no pyvenv.cfg, {reason(error)}"
        return _reject(named_path, f"`{named_path.path}` {problem}")
    settings = dict(_SETTING.findall(text))
    version_text = settings.get("version") or settings.get("version_info", "")
    # Such as 3.12.1, or virtualenv's 3.12.1.final.0.
    match = re.match(r"(\d+)\.(\d+)\.\d+", version_text)
    major, minor = (int(match[1]), int(match[2])) if match is not None else (0, 0)
    if match is None or (major, minor) < _OLDEST:
        message = f"`{named_path.path}` is of Python {version_text}, and scripts need 3.11 or newer"
        return _reject(named_path, message)
    packages = str(prefix / "lib" / f"python{major}.{minor}" / "site-packages")
    engine = package_version("mujoco", (packages,))
    if engine == "none":
        required = course.engine or engine_version()
        help = f"run `{named_path.path} -m pip install mujoco=={required}`"
        return _reject(named_path, f"MuJoCo is not installed for `{named_path.path}`", help)
    base = str(Path(settings.get("home", "")).parent)
    interpreter = Interpreter("", str(python), str(prefix), base, match[0], engine, (packages,))
    return Parsed(interpreter, ())


def _reject(named_path: NamedPath, message: str, help: str = "") -> Parsed[Interpreter | None]:
    return Parsed(None, (diagnose("script-python", named_path.span, message, help=help),))


# --- the machine

_INFO = Path("/proc/cpuinfo")
_GOVERNOR = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
_NAMES = ("model name", "Model", "Hardware", "cpu model", "uarch")
"""The keys of the name in kernels for different processors, the best one first."""
_CAN_PIN = hasattr(os, "sched_setaffinity")


def machine(interpreter: Interpreter | None = None) -> Machine:
    """Versions, system and processor."""
    return Machine(
        engine=engine_version() if interpreter is None else interpreter.engine,
        python=python_version() if interpreter is None else interpreter.version,
        numpy=package_version("numpy", None if interpreter is None else interpreter.packages),
        system=f"{platform.system()} {platform.machine()}".strip(),
        cpu=cpu_name(),
        governor=_read(_GOVERNOR).strip(),
        processors=len(os.sched_getaffinity(0)) if _CAN_PIN else os.cpu_count() or 0,
    )


def cpu_name() -> str:
    """What the processor calls itself; empty where it does not say."""
    if platform.system() == "Darwin":
        command = ["/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string"]
        with contextlib.suppress(OSError):
            output = gate.finish(command, gate.environment(), seconds=10.0).output
            return _tidy(output.decode("utf-8", "replace"))
        return ""
    return find_cpu_name(_read(_INFO)) or platform.machine()  # `processor` would start `uname`


def find_cpu_name(text: str) -> str:
    """The name in a text such as that of `/proc/cpuinfo`; empty where there is none."""
    rows = (line.partition(":") for line in reversed(text.splitlines()))  # the first one counts
    fields = {key.strip(): _tidy(value) for key, _, value in rows if value.strip()}
    return next((fields[name] for name in _NAMES if name in fields), "")


def _read(path: Path) -> str:
    try:
        return path.read_text("utf-8", "replace")
    except OSError:
        return ""


def _tidy(text: str) -> str:
    return " ".join(text.split())[:100]


# --- packages

ABSENT = ""
_TOOL_PACKAGE = "coursebuild"
_FOLDERS = ("site-packages", "dist-packages")


def site_folders() -> tuple[str, ...]:
    """The folders with installed packages, which scripts see as well."""
    return tuple(path for path in sys.path if Path(path).name in _FOLDERS)


class InstalledPackages:
    """The packages that are installed for the interpreter that runs the scripts."""

    def __init__(self, store: Store, folders: Sequence[str] | None = None) -> None:
        """`folders` are those of another interpreter's packages."""
        self._folders = site_folders() if folders is None else tuple(folders)
        self._distributions = functools.cache(lambda: _map_distributions(store, self._folders))
        self.version = functools.cache(self._version)
        """The version of a module, such as `numpy 2.4.6`; empty where there is no such module."""

    def distributions(self, modules: Iterable[str]) -> tuple[tuple[str, str, str], ...]:
        """(module, distribution, version) of each top-level module that a package provides.

        Sorted by module. The standard library, `mjcourse` and what is not installed are left out.
        """
        names = sorted(set(modules))
        by_module = self._distributions() if names else {}
        rows = []
        for module in names:
            name, _, version = by_module.get(module, "").split(", ")[0].rpartition(" ")
            if name:
                rows.append((module, name, version))
        return tuple(rows)

    def _version(self, module: str) -> str:
        distribution = self._distributions().get(module)
        if distribution is not None:
            return distribution
        spec = _spec(module, self._folders) or _spec(module, [library_folder()])
        if spec is None or not spec.submodule_search_locations:
            return ABSENT if spec is None else f"files {file_state(spec.origin or '')[:16]}"
        digest = hashlib.sha256()
        for top in sorted(spec.submodule_search_locations):
            for file in sorted(Path(top).rglob("*")):
                if "__pycache__" not in file.parts and file.is_file():
                    state = file_state(str(file))
                    digest.update(f"{file.relative_to(top).as_posix()}\0{state}\0".encode())
        return f"files {digest.hexdigest()[:16]}"


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
    names = store.peek("installed", key, value_reader(dict[str, str]))
    if names is None:
        names_by_module: dict[str, set[str]] = {}
        seen_names: set[str] = set()
        for distribution in installed_distributions(folders):
            metadata = distribution.metadata  # which is read anew at each look
            name = metadata["Name"] or ""
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
                names_by_module.setdefault(module, set()).add(f"{name} {metadata['Version']}")
        names = {module: ", ".join(sorted(names)) for module, names in names_by_module.items()}
        store.put_value("installed", key, names)
    return names
