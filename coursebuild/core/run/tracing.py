"""What a script looks at while it runs, noted in its own process as it happens.

Entry point: `Tracer`, whose `install` adds an audit hook; `mujoco_tracing` tells it of the files
that MuJoCo opens without Python's knowing.

1. Events of Python's audit system say which files are opened, folders listed, modules imported and
   programs started. Whatever lies in Python or an installed package is passed over at once.
2. The rest becomes short records, each only once, in memory that is shared with the supervisor:
   they are there however the script ends. A process that the script forks appends its records to a
   file.

A record is a letter and what it is about, in bytes:

- `b`: notes are taken
- `r` and a path: a file was read, or was to be and was not there
- `l` and a path: a folder was listed
- `m` and a name: a module was imported that is not Python's own, nor of the project
- `v`, a folder of the project, a tab and names: modules that were looked for there in vain, or were
  imported before the script began, which would have found them there first
- `d` and fields between tabs: a simulation was lost (see `mujoco_watching`)
- `w` and a path, `c` and an address, each with a file of the project and a line between tabs: the
  line writes outside its temporary folder, or uses the network
- `p`: an initial state was moved, or a step halved; `s` and numbers: a state at its end (see
  `initial_state_perturbation`)
- `o` and words: why there may be more

The handlers of events use `posix` where `os` would raise an event of its own, and as little else as
they can: a script may have changed anything.
"""

from __future__ import annotations

import _imp
import contextlib
import mmap
import posix
import sys
from collections.abc import Callable, Iterable, Sequence
from importlib.machinery import PathFinder
from posixpath import normpath
from types import FrameType

_WRITING = posix.O_WRONLY | posix.O_RDWR | posix.O_CREAT | posix.O_TRUNC | posix.O_APPEND
_SYSTEM = ("/dev/", "/proc/", "/sys/")
_BOOTSTRAP = "<frozen importlib._bootstrap>"
_BOOTSTRAP_EXTERNAL = "<frozen importlib._bootstrap_external>"
_READS_UNSEEN = frozenset(
    "cv2 duckdb h5py lxml netCDF4 open3d osgeo polars pyarrow pybullet pydrake rasterio soundfile"
    " tables tensorflow torch vtk vtkmodules".split()
)
"""Packages that open files in native code, which no audit event tells of."""
_STARTS = frozenset(("multiprocessing.popen_spawn_posix", "multiprocessing.popen_forkserver"))
"""Modules that are imported when programs are to be started, which no audit event tells of."""

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
"""Of events that change files, the positions of a path and of the folder that it is relative to."""
_RELATIVE_OPENERS = frozenset(("_rmtree_safe_fd", "_rmtree_safe_fd_step", "_fwalk", "fwalk"))
"""Functions of Python's own that open a folder by its name in another that they have open."""

PROGRAMS = "it starts other programs"
WRITES = "it writes files of the project"
WRITES_OUTSIDE = "it writes files outside its temporary folder"
NETWORK = "it uses the network"
NATIVE = "it loads native code of the project"
DATABASE = "it opens a database"
LISTS_OUTSIDE = "it lists folders outside the project"
UNSEEN_MUJOCO = "it imports MuJoCo where nobody looked for that"
TOO_MUCH = "it opens too many files to keep track of"


class Tracer:
    """Takes notes for one script.

    `root` and `temporary` are absolute; `installed` are the folders of Python and its packages.
    Records go to the shared memory; without it, and from processes that the script forks, to files
    in `overflow`. `writable` are folders that the script may write into.
    """

    def __init__(
        self,
        root: str,
        temporary: str,
        installed: Iterable[str],
        overflow: str,
        shared: mmap.mmap | None,
        writable: Iterable[str] = (),
    ) -> None:
        self.root = root.rstrip("/") + "/"
        self.temporary = temporary.rstrip("/") + "/"
        cache = posix.environ.get(b"HOME", b"/nowhere").decode("utf-8", "surrogateescape")
        self._installed = tuple(f"{folder.rstrip('/')}/" for folder in installed)
        self._inside = tuple(f for f in self._installed if f.startswith(self.root))
        self._around = tuple(f for f in self._installed if self.root.startswith(f))
        self._ignored = (
            *_SYSTEM,
            self.temporary,
            overflow,
            f"{cache}/.cache/",
            *(f for f in self._installed if f not in self._around),
        )
        self.has_mujoco = True
        """Whether MuJoCo tells of the files that it opens, if it is imported."""
        self._shared = shared
        self._writable = tuple(f"{folder}/" for folder in writable)
        self._overflow = overflow
        self._pid = posix.getpid()
        self._busy = False
        self._seen: set[object] = set()
        self._written: set[str] = set()
        self._noted: set[str] = set()
        self._builtin = frozenset(sys.builtin_module_names)
        self._standard = sys.stdlib_module_names
        self._is_frozen = _imp.is_frozen

    def install(self) -> None:
        """Begin."""
        handlers: dict[str, Callable[[tuple[object, ...]], None]] = {
            "open": self._open,
            "import": self._import,
            "os.listdir": self._list,
            "os.scandir": self._list,
            "os.chdir": lambda args: self._seen.clear(),
            "ctypes.dlopen": self._load,
            "sqlite3.connect": self._connect,
            "socket.connect": self._network,
            "socket.bind": self._network,
            "socket.sendto": self._network,
            "socket.sendmsg": self._network,
            "socket.getaddrinfo": self._network,
            "socket.gethostbyname": self._network,
            "socket.gethostbyaddr": self._network,
        }
        for name in ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "pty.spawn"):
            handlers[name] = self._program
        for name, paths in _CHANGES.items():
            handlers[f"os.{name}"] = self._changer(paths)
        find = handlers.get

        def hook(event: str, args: tuple[object, ...]) -> None:
            handler = find(event)
            if handler is not None:
                with contextlib.suppress(Exception):  # a script's own call must not fail for this
                    handler(args)

        sys.addaudithook(hook)

    def begin(self, modules: Iterable[str]) -> None:
        """Take notes; these modules are there already, and are looked for nowhere."""
        folder = self._project_folder(sys.path[0])
        if folder is not None:
            names = sorted(name for name in modules if not self._is_frozen(name))
            self.note(f"v{folder}\t{','.join(names)}")
        self.note("b")

    def read(self, path: object) -> None:
        """A file was opened for reading, or an attempt was made."""
        at = self._relevant(path)
        if at is not None and at not in self._written:
            self.note(f"r{at}")

    def imported(self, name: str, path: Sequence[object] | None) -> None:
        """A module was looked for: it depends on what stands, or does not, in earlier folders."""
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
            at = self._project_folder(folder)
            if at is None:
                continue
            candidates = f"{at}/{last}/__init__.py", f"{at}/{last}.py"
            if last.isidentifier() and not any(map(_exists, candidates)):
                self.note(f"v{at}\t{last}")
                continue
            for candidate in candidates:
                self.note(f"r{candidate}")
                if _exists(candidate):
                    return
        if not dot and name not in self._standard:
            self.note(f"m{name}")
            if name == "mujoco" and not self.has_mujoco:
                self.opaque(UNSEEN_MUJOCO)
            if name in _READS_UNSEEN and PathFinder.find_spec(name) is not None:
                self.opaque(f"{name}, which it imports, opens files in native code")

    def write(self, path: object) -> None:
        """A file was written, made, changed or removed."""
        at = self._relevant(path)
        if at is None:
            return
        self._written.add(at)
        if not f"{at}/".startswith(self._writable or ("\0",)):
            inside = at.startswith(self.root)
            self._effect("w", at.removeprefix(self.root), WRITES if inside else WRITES_OUTSIDE)

    def library(self, path: object) -> None:
        """Native code was loaded from a file, or from all in a folder."""
        at = self._relevant(path)
        if at is not None and not self.by_import():
            self.note(f"r{at}")
            if at.startswith(self.root):
                self.opaque(NATIVE)

    def opaque(self, why: str) -> None:
        """There may be more than is noted."""
        self.note(f"o{why}")

    def _effect(self, kind: str, what: str, why: str) -> None:
        """Something beyond the script is changed or asked, unless a package does while imported."""
        line = self._line()
        if line is None:
            return
        self.opaque(why)
        if f"{kind}{line}" not in self._noted:  # once for each line
            self._noted.add(f"{kind}{line}")
            self.note(f"{kind}{what}\t{line}")

    def by_import(self) -> bool:
        """Whether what happens is done by a package while it is imported, not by the script."""
        return self._line() is None

    def _line(self) -> str | None:
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
            if name.startswith(self.root) and not name.startswith(self._inside or ("\0",)):
                return f"{name.removeprefix(self.root)}\t{frame.f_lineno}"
            frame = frame.f_back
        return "\t0"

    # --- events

    def _open(self, args: tuple[object, ...]) -> None:
        path, mode, flags = args
        if (path, flags) in self._seen:
            return
        if mode is None and sys._getframe(2).f_code.co_name in _RELATIVE_OPENERS:
            return  # relative to a folder that the event does not name; that folder is known
        self._seen.add((path, flags))
        if isinstance(flags, int) and flags & _WRITING:
            if flags & posix.O_RDWR and not flags & posix.O_TRUNC:
                self.read(path)
            self.write(path)
        else:
            self.read(path)

    def _import(self, args: tuple[object, ...]) -> None:
        name, file, path = args[:3]
        if file is not None:
            at = self._relevant(file)
            if at is not None:
                self.note(f"r{at}")
                if at.startswith(self.root):
                    self.opaque(NATIVE)
        elif isinstance(name, str):
            if name in _STARTS:
                self.opaque(PROGRAMS)
            self.imported(name, path if isinstance(path, list) else None)

    def _list(self, args: tuple[object, ...]) -> None:
        code = sys._getframe(2).f_code
        if code.co_filename == _BOOTSTRAP_EXTERNAL:
            return  # it looks for a module
        path = args[0] if args[0] is not None else "."
        at = self._relevant(_of_descriptor(path) if isinstance(path, int) else path)
        if at is None:
            return
        if at == self.root[:-1] or at.startswith(self.root):
            self.note(f"l{at}")
        elif not self.by_import():
            self.opaque(LISTS_OUTSIDE)

    def _changer(self, paths: tuple[tuple[int, int], ...]) -> Callable[[tuple[object, ...]], None]:
        def change(args: tuple[object, ...]) -> None:
            for path, folder in paths:
                self.write(_below(args[folder] if folder else -1, args[path]))

        return change

    def _program(self, args: tuple[object, ...]) -> None:
        if not self.by_import():
            self.opaque(PROGRAMS)

    def _network(self, args: tuple[object, ...]) -> None:
        named = len(args) < 2 or isinstance(args[0], str | bytes | None)
        address = args[0] if named else args[1]  # a name that is looked up, or that of a socket
        if isinstance(address, bytes):
            address = address.decode("utf-8", "surrogateescape")
        # A socket in its own folder, or with a name that the system made up, is for its children.
        if isinstance(address, str) and address.startswith((self.temporary, "\0")):
            return
        if isinstance(address, tuple):
            address = ":".join(map(str, address[:2]))
        self._effect("c", str(address or ""), NETWORK)

    def _load(self, args: tuple[object, ...]) -> None:
        name = args[0]
        if isinstance(name, str) and "/" in name:
            self.library(name)

    def _connect(self, args: tuple[object, ...]) -> None:
        if args[0] not in (":memory:", b":memory:", "") and self._relevant(args[0]) is not None:
            self.opaque(DATABASE)

    # --- paths

    def _relevant(self, path: object) -> str | None:
        """The absolute path of something whose content may matter; `None` where it does not."""
        if isinstance(path, bytes):
            path = path.decode("utf-8", "surrogateescape")
        if not isinstance(path, str):
            return None  # a descriptor, whose file was opened before
        if path.startswith(self._ignored) and "/.." not in path:
            return None
        if not path.startswith("/"):
            path = f"{posix.getcwd()}/{path}"
        at = _normal(path)
        if at.startswith(self._ignored) or at == self.temporary[:-1]:
            return None
        if self._around and not at.startswith(self.root) and at.startswith(self._installed):
            return None
        return at

    def _project_folder(self, folder: object) -> str | None:
        if not isinstance(folder, str):
            return None
        at = self._relevant(folder or ".")
        if at is None or not f"{at}/".startswith(self.root):
            return None
        # An environment in the folder of the course holds packages, which count by their versions.
        return None if f"{at}/".startswith(self._inside or ("\0",)) else at

    def note(self, record: str) -> None:
        """Add a record, unless it is there already."""
        if record in self._noted:
            return
        self._noted.add(record)
        data = record.encode("utf-8", "surrogateescape") + b"\0"
        if self._shared is not None and posix.getpid() == self._pid:
            try:
                self._shared.write(data)
            except ValueError:  # there is no more room
                if TOO_MUCH not in self._noted:
                    self._noted.add(TOO_MUCH)
                    self._spill(f"o{TOO_MUCH}\0".encode())
        else:
            self._spill(data)

    def _spill(self, data: bytes) -> None:
        if self._busy:  # this is its own opening of a file, which is an event as well
            return
        self._busy = True
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
            self._busy = False


def _normal(path: str) -> str:
    """An absolute path without `.`, `..` and repeated slashes."""
    return "/" + normpath(path).lstrip("/")


def _below(folder: object, path: object) -> object:
    """A path that may be relative to a folder given as a descriptor."""
    if isinstance(path, bytes):
        path = path.decode("utf-8", "surrogateescape")
    if not isinstance(folder, int) or folder < 0 or not isinstance(path, str) or path[:1] == "/":
        return path
    return f"{_of_descriptor(folder)}/{path}"


def _of_descriptor(fd: int) -> str:
    """The path of a file that is open, where the system tells."""
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
