"""Turn a process into a script that finds what a bare `python examples/x.py` finds, and is traced.

Only four things differ from a bare Python: there is one more frame below the script's own, that of
`script_main`; `sys.modules` holds modules of the standard library that the script has not imported;
modules of the project are compiled from their sources, whatever `__pycache__` holds; and a few
functions of `os` are wrapped (`stat_tracing`).
"""

from __future__ import annotations

import atexit
import builtins
import contextlib
import ctypes
import gc
import importlib
import io
import mmap
import os
import site
import subprocess
import sys
import traceback
from collections.abc import Mapping, Sequence
from importlib import machinery
from importlib.machinery import FileFinder, ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType
from typing import Any, TypedDict

from coursebuild.core.run import mujoco_tracing, mujoco_watching, perturbation, step_changes
from coursebuild.core.run.matplotlib_watching import FigureWatch
from coursebuild.core.run.part_marks import PartMark, compile_parts
from coursebuild.core.run.tracing import Tracer

_IMPORTS = {"numpy": ("numpy", "numpy.random"), "mujoco": ("numpy", "mujoco")}
"""The modules that are imported for a package; importing them has no effect that a script sees."""


class _SourceLoader(SourceFileLoader):
    """Compiles a module's source, whatever `__pycache__` holds for it.

    A stranger may have put other code there, and what was compiled before an edit within the same
    second passes for up to date.
    """

    def path_stats(self, path: Any) -> Any:
        """Give none, so that Python finds nothing compiled that fits, and keeps nothing."""
        raise OSError


def _read_sources_in(root: str) -> None:
    """From now on, import modules of the project from their sources, but not what is installed."""
    installed = sys.path_hooks[-1]
    of_project = FileFinder.path_hook(
        (machinery.ExtensionFileLoader, machinery.EXTENSION_SUFFIXES),
        (_SourceLoader, machinery.SOURCE_SUFFIXES),
        (machinery.SourcelessFileLoader, machinery.BYTECODE_SUFFIXES),
    )

    def find_in(folder: str) -> Any:
        path = f"{os.path.abspath(folder)}/"  # noqa: PTH100 (time counts)
        is_installed = not path.startswith(f"{root}/") or "/site-packages/" in path
        return (installed if is_installed else of_project)(folder)

    sys.path_hooks[-1] = find_in
    sys.path_importer_cache.clear()


class Job(TypedDict):
    """What to run."""

    root: str
    """Working directory."""
    path: str
    """The script, relative to it."""
    args: list[str]
    timeout: float
    """Seconds."""
    requires: list[str]
    """Modules without which it is not run."""
    packages: list[str]
    """Packages that are worth importing before the script runs."""
    environment: dict[str, str]
    scratch: str
    """Where the script's temporary folder is made; removed after the last supervisor."""
    library: str
    """A folder to import `mjcourse` from, where it is not installed."""
    folders: list[str]
    """Folders of the project to import from, before all other packages."""
    writes: list[str]
    """Folders of the project that the script may write into."""
    copies: list[tuple[str, str]]
    """In a sandbox, these folders, each with the folder to copy its content from."""
    figures: list[str]
    """Names of files that it draws, in its working directory."""
    memory: int
    """MiB that it may take."""
    part_lines: list[int]
    """The lines at which its parts but the first begin."""
    part_mark: str
    """What stands in its output between two of them, in hexadecimal digits."""
    keeps_going: bool
    """Whether it goes on after a part that fails."""
    commands: list[list[str]]
    """What runs it, one after the other, in place of Python."""
    perturbation: int
    """The direction in which initial states are moved (`perturbation`); 0: none;
    below, steps are changed (`step_changes.change_steps`)."""


class PreloadedPackages:
    """Packages that were imported before a script, and the finder that gives them to it.

    They are hidden from the script until it imports them, so that the trace shows what it imports.
    """

    def __init__(self) -> None:
        self.is_broken = False
        """Whether importing a package fails: then scripts run without this, and fail themselves."""
        self._groups: dict[str, dict[str, ModuleType]] = {}
        """For each package the modules that importing it loads, without the standard library."""
        self._tracer: Tracer | None = None

    def load(self, packages: Sequence[str]) -> None:
        """Import packages."""
        excluded = sys.stdlib_module_names | {"coursebuild"}
        for package in packages:
            if package in self._groups:
                continue
            before = set(sys.modules)
            try:
                # MuJoCo's import starts Python, perhaps in the course's folder (see `gate`).
                os.environ["PYTHONSAFEPATH"] = "1"
                for name in _IMPORTS[package]:
                    importlib.import_module(name)
            except ModuleNotFoundError as error:  # a script that asks for it says so
                self.is_broken = self.is_broken or error.name != package
            except BaseException:
                self.is_broken = True
            finally:
                del os.environ["PYTHONSAFEPATH"]
            new = [
                n for n in sys.modules if n not in before and n.partition(".")[0] not in excluded
            ]
            group = self._groups.get("numpy", {}) if package == "mujoco" else {}
            self._groups[package] = group | {name: sys.modules[name] for name in new}
            if package == "mujoco" and "mujoco" in sys.modules:
                mujoco_tracing.wrap(sys.modules["mujoco"])
                mujoco_watching.watch(sys.modules["mujoco"])

    def names(self) -> frozenset[str]:
        """The top-level modules already loaded, which Python seeks in no folder any more."""
        names = {name.partition(".")[0] for name in sys.modules} - {"__main__", "coursebuild"}
        return frozenset(names.difference(sys.builtin_module_names))

    def module(self, name: str) -> Any:
        """A preloaded module; `None` where there is no such."""
        return self._group(name).get(name)

    def _group(self, name: str) -> dict[str, ModuleType]:
        return next((group for group in self._groups.values() if name in group), {})

    def offer(self, tracer: Tracer) -> None:
        """Hide the packages, and give them back to this process as it imports them."""
        self._tracer = tracer
        modules = {n: m for group in self._groups.values() for n, m in group.items()}
        self._hide(modules)
        sys.meta_path.insert(0, self)
        if (random := modules.get("numpy.random")) is not None:
            random.seed()
        # They are never freed at the end of the script: that would take longer than most scripts.
        atexit.register(_write_lines_at_once)
        atexit.register(self._hide, modules)
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(modules))

    def _hide(self, modules: Mapping[str, ModuleType]) -> None:
        for name in modules:
            sys.modules.pop(name, None)

    def find_spec(
        self, name: str, path: Sequence[object] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """A spec that gives the preloaded module, if Python would find the same.

        Whoever looks for a module asks here first, whether to import it or not: so it is noted.
        """
        if self._tracer is not None:
            with contextlib.suppress(Exception):  # a script's own call must not fail for this
                self._tracer.note_import(name, path)
        module = self.module(name) if target is None else None
        if module is None or "." in name:
            return None
        spec = PathFinder.find_spec(name)
        if spec is None or spec.origin != getattr(module.__spec__, "origin", None):
            return None
        return ModuleSpec(name, self, origin=spec.origin)  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module itself."""
        module: ModuleType = self.module(spec.name)
        self._spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the script all modules that importing this one loads."""
        module.__spec__ = self._spec
        group = self._group(module.__name__)
        sys.modules.update(group)
        for name in group:
            if "." not in name and group[name].__spec__ is not None and self._tracer is not None:
                self._tracer.note_import(name, None)


def _write_lines_at_once() -> None:
    """Write what objects print while they are freed at the end.

    A package that is never freed may refer to a stream, as a default argument; then the stream is
    not freed either, and what it still holds would be lost.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, OSError, ValueError):  # replaced, or closed
            stream.reconfigure(line_buffering=True)  # type: ignore[union-attr]


class ScriptProcess:
    """The script that this process turns into."""

    def __init__(
        self,
        job: Job,
        environment: Mapping[str, str],
        shared: mmap.mmap | None,
        preloaded: PreloadedPackages,
    ) -> None:
        self.job = job
        self.path = f"{job['root']}/{job['path']}"
        self.main = ModuleType("__main__")
        self.names: dict[str, Any] = vars(self.main)
        self._environment = environment
        self._shared = shared
        self._preloaded = preloaded

    def compile_script(self) -> CodeType:
        """Set up this process, whose working folder is the script's; return the code to execute."""
        job, preloaded = self.job, self._preloaded
        arguments = [job["path"], *job["args"]]
        sys.argv, sys.orig_argv[1:] = arguments, arguments
        os.environ["TMPDIR"] = self._environment["TMPDIR"]  # the rest is as it was at the start
        library = self._environment.get("PYTHONPATH")
        if library is not None and "PYTHONPATH" not in os.environ:
            os.environ["PYTHONPATH"] = library
            sys.path[:0] = library.split(os.pathsep)
        sys.path.insert(0, os.path.dirname(self.path))  # noqa: PTH120
        self.names |= {
            "__builtins__": builtins,
            "__file__": self.path,
            "__cached__": None,
            "__loader__": SourceFileLoader("__main__", self.path),
            "__annotations__": {},
        }
        tracer = self._tracer()
        mujoco_tracing.tracer = tracer
        mujoco, numpy = preloaded.module("mujoco"), preloaded.module("numpy")
        tracer.has_mujoco = mujoco is not None
        if job["perturbation"] and mujoco is not None:
            if job["perturbation"] < 0:
                step_changes.change_steps(mujoco, numpy, job["perturbation"])
            else:
                perturbation.perturb(mujoco, numpy, job["perturbation"])
        for name in [name for name in sys.modules if name.partition(".")[0] == "coursebuild"]:
            del sys.modules[name]
        sys.modules["__main__"] = self.main
        standard = preloaded.names() & sys.stdlib_module_names
        preloaded.offer(tracer)
        atexit.unregister(gc.freeze)  # a script ends like any other process of Python
        atexit.register(mujoco_watching.finish)
        with open(self.path, "rb") as file:  # noqa: PTH123 (time counts)
            text = file.read()
        if job["figures"]:
            redirect_figures(job, self._environment["TMPDIR"])
        _read_sources_in(job["root"])
        tracer.install()
        tracer.begin(standard)
        if job["commands"]:
            self.names["run"] = self._run_commands
            return compile("run()", "<runner>", "exec")
        if job["part_lines"] or job["keeps_going"]:
            mark, keeps_going = PartMark(bytes.fromhex(job["part_mark"])), job["keeps_going"]
            return compile_parts(text, self.path, job["part_lines"], mark, keeps_going=keeps_going)
        return compile(text, self.path, "exec", dont_inherit=True)

    def _run_commands(self) -> None:
        """Become the last of the commands that run a script of another language, after the others.

        `{file}` in an argument is the script's path, `{folder}` the temporary folder of this run;
        the script's arguments follow those of the last command.
        """
        folder, path, commands = self._environment["TMPDIR"], self.job["path"], self.job["commands"]
        for number, command in enumerate(commands, 1):
            words = [w.replace("{file}", path).replace("{folder}", folder) for w in command]
            try:
                if number == len(commands):
                    os.execvp(words[0], [*words, *self.job["args"]])
                status = subprocess.call(words, stdin=subprocess.DEVNULL)
            except OSError as error:
                sys.exit(f"{words[0]} cannot be started: {error.strerror}")
            if status:
                sys.exit(abs(status))

    def _tracer(self) -> Tracer:
        folders = {os.path.dirname(os.__file__), *site.getsitepackages()}  # noqa: PTH120
        folders.update(f for f in sys.path if f.endswith(("/site-packages", "/dist-packages")))
        if site.ENABLE_USER_SITE:
            folders.add(site.getusersitepackages())
        installed = sorted({f for folder in folders for f in (folder, os.path.realpath(folder))})
        root, library = self.job["root"], self.job["library"]
        if "PYTHONPATH" in self._environment and not f"{library}/".startswith(f"{root}/"):
            installed.append(f"{library}/mjcourse")  # unless the project itself holds it
        temporary, job = self._environment["TMPDIR"], self.job
        overflow = notes_folder(temporary)
        effects = job["writes"], job["figures"]
        return Tracer(root, temporary, installed, overflow, self._shared, *effects)


def notes_folder(temporary: str) -> str:
    """The folder for notes that shared memory cannot hold, given the temporary folder."""
    return f"{temporary}.notes"


def figure_path(temporary: str, name: str) -> str:
    """Where a figure is drawn, given the script's temporary folder."""
    return f"{temporary}/figures-of-this-script/{name}"


def redirect_figures(job: Job, temporary: str) -> None:
    """From now on, write figures to the script's temporary folder: two runs share no files."""
    root = job["root"].rstrip("/")
    paths = {f"{root}/{name}": figure_path(temporary, name) for name in job["figures"]}
    os.mkdir(os.path.dirname(next(iter(paths.values()))))  # noqa: PTH102, PTH120 (time counts)
    real_open = builtins.open
    sys.meta_path.insert(1, FigureWatch(paths))  # the first one notes what is imported

    def open_figure(file: Any, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
        if isinstance(file, str | os.PathLike):
            path = paths.get(os.path.abspath(file))  # noqa: PTH100
            if path is not None and ("r" not in mode or os.path.exists(path)):  # noqa: PTH110
                file = path
        return real_open(file, mode, *args, **kwargs)

    builtins.open = io.open = open_figure


def report_error(error: BaseException) -> None:
    """Print what ended a script as Python does, without the frame that has executed it."""
    frames = error.__traceback__.tb_next if error.__traceback__ is not None else None
    if frames is not None and frames.tb_frame.f_code.co_filename == __file__:
        frames = None  # it was not even compiled
    try:
        sys.excepthook(type(error), error.with_traceback(frames), frames)
    except BaseException:
        traceback.print_exc()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
