"""Trace, in a script's own process, what the script looks at while it runs.

1. Events of Python's audit system say which files are opened, folders listed, modules imported and
   programs started. Whatever lies in Python or an installed package is ignored at once. What MuJoCo
   opens, of which Python knows nothing, `mujoco_tracing` reports.
2. The rest becomes short records, each only once, in memory that is shared with the supervisor: so
   they survive however the script ends. A process that the script forks appends its records to a
   file.

A record is a letter and a value, in bytes:

- `b`: tracing has begun
- `r` and a path: a file was read, or was sought for reading and not there
- `l` and a path: a folder was listed
- `e` or `t`, a path, a tab and the answer: it was asked whether something exists there, or for its
  size or times (see `stat_tracing`); `x` and a path: the script has written that itself
- `m` and a name: a module was imported that is not Python's own, nor of the project
- `v`, a folder of the project, a tab and names: modules that were looked for there in vain, or that
  were imported before the script began, which would have looked for them there first
- `d` and fields between tabs: a simulation was lost (see `mujoco_watching`)
- `w` and a path, `c` and an address, each with a file of the project and a line between tabs: the
  line writes outside its temporary folder, or uses the network
- `p`: an initial state was moved, or a step changed; `s` and numbers: a state at its end; `h` and a
  number: a timestep of which some are shifted (see `perturbation` and `step_changes`)
- `o` and words: why the trace may be incomplete

The handlers of events use `posix` where `os` would raise an event itself, and as little else as
possible: a script may have changed anything.
"""

from __future__ import annotations

import _imp
import contextlib
import mmap
import posix
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from importlib.machinery import PathFinder
from posixpath import normpath
from types import FrameType

from coursebuild.core.run.stat_tracing import QuestionNotes, status

_WRITING = posix.O_WRONLY | posix.O_RDWR | posix.O_CREAT | posix.O_TRUNC | posix.O_APPEND
_SYSTEM = ("/dev/", "/proc/", "/sys/")
_BOOTSTRAP = "<frozen importlib._bootstrap>"
_BOOTSTRAP_EXTERNAL = "<frozen importlib._bootstrap_external>"
_NATIVE_READERS = frozenset(
    "cv2 duckdb h5py lxml netCDF4 open3d osgeo polars pyarrow pybullet pydrake rasterio soundfile"
    " tables tensorflow torch vtk vtkmodules".split()
)
"""Packages that open files in native code, which raises no audit event."""
_PROGRAM_STARTERS = frozenset(
    ("multiprocessing.popen_spawn_posix", "multiprocessing.popen_forkserver")
)
"""Modules that are imported to start programs, which raises no audit event."""

_CHANGES = {
    "mkdir": ((0, 2),),
    "remove": ((0, 1),),
    "rmdir": ((0, 1),),
    "chmod": ((0, 2),),
    "chown": ((0, 3),),
    "utime": ((0, 3),),
    "truncate": ((0, 0),),
    "symlink": ((1, 2),),
    "link": ((1, 3),),
    "rename": ((0, 2), (1, 3)),
}
"""For events that change files: the positions of each path and of the folder it is relative to."""
_RELATIVE_OPENERS = frozenset(("_rmtree_safe_fd", "_rmtree_safe_fd_step", "_fwalk", "fwalk"))
"""Functions of Python's that open a folder by its name, relative to another open folder."""

PROGRAMS = "it starts other programs"
WRITES = "it writes files of the project"
WRITES_OUTSIDE = "it writes files outside its temporary folder"
NETWORK = "it uses the network"
NATIVE = "it loads native code of the project"
DATABASE = "it opens a database"
LISTS_OUTSIDE = "it lists folders outside the project"
UNSEEN_MUJOCO = "it imports MuJoCo where this was not expected"
TOO_MUCH = "it opens too many files to keep track of"


class Tracer:
    """Notes what one script looks at.

    `root` and `temporary` are absolute; `installed` are the folders of Python and its packages.
    Records go to the shared memory; without it, and from processes that the script forks, to files
    in `overflow`. `writable` are folders that the script may write into, `figures` what it draws.
    """

    def __init__(
        self,
        root: str,
        temporary: str,
        installed: Iterable[str],
        overflow: str,
        shared: mmap.mmap | None,
        writable: Iterable[str] = (),
        figures: Iterable[str] = (),
    ) -> None:
        self.root = root.rstrip("/") + "/"
        self.temporary = temporary.rstrip("/") + "/"
        cache = posix.environ.get(b"HOME", b"/nowhere").decode("utf-8", "surrogateescape")
        self._installed = tuple(f"{folder.rstrip('/')}/" for folder in installed)
        self._packages_inside = tuple(f for f in self._installed if f.startswith(self.root))
        self._packages_around = tuple(f for f in self._installed if self.root.startswith(f))
        folders = (*_SYSTEM, self.temporary, overflow, f"{cache}/.cache/")
        self._ignored = tuple(
            folder for folder in (*folders, *self._installed) if not self.root.startswith(folder)
        )
        self._ignored_around = tuple(folder for folder in folders if self.root.startswith(folder))
        """Folders of which only the course in them counts, such as `/dev/` with `/dev/shm`."""
        self.has_mujoco = True
        """Whether MuJoCo, if the script imports it, reports the files that it opens."""
        self._shared = shared
        self._writable = tuple(f"{folder}/" for folder in writable)
        self._overflow = overflow
        self._pid = posix.getpid()
        self._is_spilling = False
        self._opened: set[object] = set()
        self._written_paths: set[str] = set()
        self._questions = QuestionNotes(self.root, self.note_question, self.note_read)
        self._asked_paths: set[str] = set()
        self._figures = frozenset(f"{self.root}{name}" for name in figures)
        self._noted_records: set[str] = set()
        self._builtin = frozenset(sys.builtin_module_names)
        self._standard = sys.stdlib_module_names
        self._is_frozen = _imp.is_frozen

    def install(self) -> None:
        """Add the audit hook, and wrap what has no events."""
        handlers: dict[str, Callable[[tuple[object, ...]], None]] = {
            "open": self._on_open,
            "import": self._on_import,
            "os.listdir": self._on_list,
            "os.scandir": self._on_scan,
            "os.chdir": self._on_change_folder,
            "ctypes.dlopen": self._on_load_library,
            "sqlite3.connect": self._on_open_database,
        }
        for name in "connect bind sendto sendmsg getaddrinfo gethostbyname gethostbyaddr".split():
            handlers[f"socket.{name}"] = self._on_network
        for name in ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "pty.spawn"):
            handlers[name] = self._on_program
        for name, paths in _CHANGES.items():
            handlers[f"os.{name}"] = partial(self._on_change, paths)
        find = handlers.get

        def hook(event: str, args: tuple[object, ...]) -> None:
            handler = find(event)
            if handler is not None:
                with contextlib.suppress(Exception):  # a script's own call must not fail for this
                    handler(args)

        sys.addaudithook(hook)
        self._questions.install()

    def begin(self, modules: Iterable[str]) -> None:
        """Begin to note; `modules` are loaded already, and will not be looked for."""
        folder = self._project_folder(sys.path[0])
        if folder is not None:
            names = sorted(name for name in modules if not self._is_frozen(name))
            self.note(f"v{folder}\t{','.join(names)}")
        self.note("b")

    def note_read(self, path: object) -> None:
        """Note that a file was opened for reading, or could not be."""
        full_path = self._relevant_path(path)
        if full_path is not None and full_path not in self._written_paths:
            self.note(f"r{full_path}")

    def note_question(self, kind: str, path: object, answer: Callable[[str], str]) -> None:
        """Note the answer to a question about a file of the project that the script did not write.

        Its kind is the letter of the record.
        """
        full_path = self._relevant_path(path)
        if full_path in self._written_paths or full_path in self._figures:
            return
        if full_path is not None and self._is_of_project(full_path):
            self._asked_paths.add(full_path)
            self.note(f"{kind}{full_path}\t{answer(full_path)}")

    def note_import(self, name: str, path: Sequence[object] | None) -> None:
        """Note that a module was looked for: in each folder up to the first that has it."""
        top, dot, _ = name.rpartition(".")
        if dot:
            package = sys.modules.get(top)
            folders: Iterable[object] = getattr(package, "__path__", ())
        elif name in self._builtin or self._is_frozen(name):
            return
        else:
            folders = sys.path if path is None else path
        last = name.rpartition(".")[2]
        for folder in list(folders):
            full_path = self._project_folder(folder)
            if full_path is None:
                continue
            candidates = f"{full_path}/{last}/__init__.py", f"{full_path}/{last}.py"
            if last.isidentifier() and not any(map(_exists, candidates)):
                self.note(f"v{full_path}\t{last}")
                continue
            for candidate in candidates:
                self.note(f"r{candidate}")
                if _exists(candidate):
                    return
        if not dot and name not in self._standard:
            self.note(f"m{name}")
            if name == "mujoco" and not self.has_mujoco:
                self.note_opaque(UNSEEN_MUJOCO)
            if name in _NATIVE_READERS and PathFinder.find_spec(name) is not None:
                self.note_opaque(f"{name}, which it imports, opens files in native code")

    def note_write(self, path: object) -> None:
        """Note that a file was written, made, changed or removed."""
        full_path = self._relevant_path(path)
        if full_path is None:
            return
        self._written_paths.add(full_path)
        if full_path in self._asked_paths:
            self.note(f"x{full_path}")
        if not f"{full_path}/".startswith(self._writable or ("\0",)):
            reason = WRITES if full_path.startswith(self.root) else WRITES_OUTSIDE
            self._note_effect("w", full_path.removeprefix(self.root), reason)

    def note_library(self, path: object) -> None:
        """Note that native code was loaded from a file, or from all files of a folder."""
        if not self.is_by_import():
            self._note_native(path)

    def _note_native(self, path: object) -> None:
        full_path = self._relevant_path(path)
        if full_path is not None:
            self.note(f"r{full_path}")
            if full_path.startswith(self.root):
                self.note_opaque(NATIVE)

    def note_opaque(self, reason: str) -> None:
        """Note why the trace may be incomplete."""
        self.note(f"o{reason}")

    def _note_effect(self, kind: str, target: str, reason: str) -> None:
        """Note an effect beyond the script, unless a package has it while it is imported."""
        line = self._project_line()
        if line is None:
            return
        self.note_opaque(reason)
        if f"{kind}{line}" not in self._noted_records:  # once for each line
            self._noted_records.add(f"{kind}{line}")
            self.note(f"{kind}{target}\t{line}")

    def is_by_import(self) -> bool:
        """Whether a package that is being imported does this, not the script."""
        return self._project_line() is None

    def _project_line(self) -> str | None:
        """The innermost line of the project that is being executed: its file, a tab, its number.

        `None` where a package is being imported.
        """
        frame: FrameType | None = sys._getframe(1)
        while frame is not None and frame.f_code.co_filename == __file__:
            frame = frame.f_back  # in the tool's own repository it is a file of the course
        while frame is not None:
            name = frame.f_code.co_filename
            if name == _BOOTSTRAP:
                return None
            if name.startswith(self.root) and not name.startswith(self._packages_inside or ("\0",)):
                return f"{name.removeprefix(self.root)}\t{frame.f_lineno}"
            frame = frame.f_back
        return "\t0"

    # --- events

    def _on_open(self, args: tuple[object, ...]) -> None:
        path, mode, flags = args
        if (path, flags) in self._opened:
            return
        if mode is None and sys._getframe(2).f_code.co_name in _RELATIVE_OPENERS:
            return  # relative to a folder that the event does not name, but that was noted before
        self._opened.add((path, flags))
        if isinstance(flags, int) and flags & _WRITING:
            if flags & posix.O_RDWR and not flags & posix.O_TRUNC:
                self.note_read(path)
            self.note_write(path)
        else:
            self.note_read(path)

    def _on_import(self, args: tuple[object, ...]) -> None:
        name, file = args[:2]
        if file is not None:
            self._note_native(file)
        elif name in _PROGRAM_STARTERS:
            self.note_opaque(PROGRAMS)

    def _on_change_folder(self, args: tuple[object, ...]) -> None:
        self._opened.clear()
        self._questions.forget()

    def _on_scan(self, args: tuple[object, ...]) -> None:
        self._on_list(args, depth=3)
        folder = self._project_folder(_path_of(args[0]))
        if folder is not None and sys._getframe(2).f_code.co_filename.startswith(self.root):
            for name in posix.listdir(folder):  # its entries say their sizes and times
                self.note_question("t", f"{folder}/{name}", status)

    def _on_list(self, args: tuple[object, ...], depth: int = 2) -> None:
        code = sys._getframe(depth).f_code
        if code.co_filename == _BOOTSTRAP_EXTERNAL:
            return  # Python is looking for a module
        full_path = self._relevant_path(_path_of(args[0]))
        if full_path is None:
            return
        if full_path == self.root[:-1] or full_path.startswith(self.root):
            self.note(f"l{full_path}")
        elif not self.is_by_import():
            self.note_opaque(LISTS_OUTSIDE)

    def _on_change(self, paths: Iterable[tuple[int, int]], args: tuple[object, ...]) -> None:
        for path_at, folder_at in paths:
            path, folder = args[path_at], args[folder_at] if folder_at else -1
            if isinstance(path, bytes):
                path = path.decode("utf-8", "surrogateescape")
            if (
                isinstance(folder, int)
                and folder >= 0
                and isinstance(path, str)
                and path[:1] != "/"
            ):
                path = f"{_descriptor_path(folder)}/{path}"  # relative to an open folder
            self.note_write(path)

    def _on_program(self, args: tuple[object, ...]) -> None:
        if not self.is_by_import():
            self.note_opaque(PROGRAMS)

    def _on_network(self, args: tuple[object, ...]) -> None:
        # The first argument is a name that is looked up, or a socket; then the address follows.
        is_lookup = len(args) < 2 or isinstance(args[0], str | bytes | None)
        address = args[0] if is_lookup else args[1]
        if isinstance(address, bytes):
            address = address.decode("utf-8", "surrogateescape")
        # A socket in the temporary folder, or with a name made up by the system, is for children.
        if isinstance(address, str) and address.startswith((self.temporary, "\0")):
            return
        if isinstance(address, tuple):
            address = ":".join(map(str, address[:2]))
        self._note_effect("c", str(address or ""), NETWORK)

    def _on_load_library(self, args: tuple[object, ...]) -> None:
        name = args[0]
        if isinstance(name, str) and "/" in name:
            self.note_library(name)

    def _on_open_database(self, args: tuple[object, ...]) -> None:
        is_file = args[0] not in (":memory:", b":memory:", "")
        if is_file and self._relevant_path(args[0]) is not None:
            self.note_opaque(DATABASE)

    # --- paths

    def _relevant_path(self, path: object) -> str | None:
        """The absolute path of something that may matter to a result; `None` if it cannot."""
        if isinstance(path, bytes):
            path = path.decode("utf-8", "surrogateescape")
        if not isinstance(path, str):
            return None  # a descriptor, whose file was opened before
        if self._is_ignored(path) and "/.." not in path:
            return None
        if not path.startswith("/"):
            path = f"{posix.getcwd()}/{path}"
        full_path = "/" + normpath(path).lstrip("/")
        if self._is_ignored(full_path) or full_path == self.temporary[:-1]:
            return None
        is_package = full_path.startswith(self._installed) and not full_path.startswith(self.root)
        return None if self._packages_around and is_package else full_path

    def _is_ignored(self, path: str) -> bool:
        is_around = path.startswith(self._ignored_around) and not path.startswith(self.root)
        return is_around or path.startswith(self._ignored)

    def _project_folder(self, folder: object) -> str | None:
        if not isinstance(folder, str):
            return None
        full_path = self._relevant_path(folder or ".")
        return full_path if full_path is not None and self._is_of_project(full_path) else None

    def _is_of_project(self, full_path: str) -> bool:
        # Packages of an environment in the course's folder count by their versions.
        return f"{full_path}/".startswith(self.root) and not f"{full_path}/".startswith(
            self._packages_inside or ("\0",)
        )

    def note(self, record: str) -> None:
        """Add a record, unless it is there already."""
        if record in self._noted_records:
            return
        self._noted_records.add(record)
        data = record.encode("utf-8", "surrogateescape") + b"\0"
        if self._shared is not None and posix.getpid() == self._pid:
            try:
                self._shared.write(data)
            except ValueError:  # there is no more room
                if TOO_MUCH not in self._noted_records:
                    self._noted_records.add(TOO_MUCH)
                    self._spill(f"o{TOO_MUCH}\0".encode())
        else:
            self._spill(data)

    def _spill(self, data: bytes) -> None:
        if self._is_spilling:  # opening the file below is an event as well
            return
        self._is_spilling = True
        try:
            with contextlib.suppress(FileExistsError):
                posix.mkdir(self._overflow)
            flags = posix.O_WRONLY | posix.O_CREAT | posix.O_APPEND | posix.O_CLOEXEC
            fd = posix.open(f"{self._overflow}/{posix.getpid()}", flags, 0o600)
            try:
                posix.write(fd, data)
            finally:
                posix.close(fd)
        finally:
            self._is_spilling = False


def _path_of(folder: object) -> object:
    """The path of a folder that is listed: given as such, as an open one, or not at all."""
    return (
        _descriptor_path(folder) if isinstance(folder, int) else "." if folder is None else folder
    )


def _descriptor_path(fd: int) -> str:
    try:
        return posix.readlink(f"/proc/self/fd/{fd}")
    except OSError:
        return "/dev/fd/unknown"


def _exists(path: str) -> bool:
    try:
        posix.stat(path)
    except (OSError, ValueError):
        return False
    return True
