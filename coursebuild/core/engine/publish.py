"""Publishing a site: written whole beside the old one, then swapped in, or not at all.

1. The place is checked: it is neither the project nor a folder of the author's, and holds no file
   that we did not put there. One build publishes to a place at a time.
2. The site is filled into a slot: a new folder beside the place, on the same file system. A file is
   linked from the old site if the manifest lists it under the same key and it has not changed; all
   others are made.
3. Slot and site are exchanged in one step. Where the system cannot, the old site is renamed away
   and the new one renamed in; if a build is killed between the two, the next one puts it back.
4. The old site is removed.

A site can be built again, so it is not synced to the disk: after a power cut, build again.
"""

from __future__ import annotations

import ctypes
import errno
import hashlib
import os
import stat
import sys
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from coursebuild.core.engine import manifest
from coursebuild.core.engine.manifest import MARKER, Manifest, ManifestEntry
from coursebuild.core.engine.page_pool import Workers, can_fork
from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import EffectError, PublishRefusedError, reason
from coursebuild.core.files.locks import folder_lock, remove_folder
from coursebuild.core.model.results import FileFacts, FileList, OutputFile, SiteFile
from coursebuild.core.text.regex import regex

_EXCHANGE = {"linux": "renameat2", "darwin": "renameatx_np"}
"""The system's function that swaps two paths; it takes the same arguments on both systems."""
_AT_FDCWD = {"linux": -100, "darwin": -2}
_RENAME_EXCHANGE = 2  # linux/fs.h; RENAME_SWAP in sys/stdio.h of macOS
_UNSUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EPERM)
_AUTHOR_FOLDERS = ("content", "features", "models", "examples", ".coursebuild", ".git")


def check_output_folder(root: Path, out: Path) -> Path:
    """Where the site goes: `out`, or the folder it links to; undo a killed build.

    A `PublishRefusedError` says why no site may go there.
    """
    place = Path(os.path.realpath(out))
    with folder_lock(place.parent):
        _check_place(Path(os.path.realpath(root)), out, place)
    return place


def publish(
    root: Path,
    out: Path,
    files: Iterable[SiteFile],
    file_list: FileList | None = None,
    *,
    jobs: int = 1,
    stage: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> tuple[str, ...]:
    """Replace the site at `out` by these files; return the paths of those that were written.

    They are sorted; the others have not changed. Paths are POSIX, relative, without `..`, each
    once. `out` may be a link to a folder, and stays one. `file_list` lists all the others. `jobs`
    is how many copies of this process, at most, make and write files where there are many; `stage`
    is entered meanwhile.

    Raises:
        PublishRefusedError: a site must not go there.
        EffectError: it cannot be written; the old site is still there.
        ValueError: a path is not valid in a site (a bug of the caller).
    """
    place = check_output_folder(root, out)
    root = Path(os.path.realpath(root))
    files = tuple(files)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with folder_lock(place.parent):
            _check_place(root, out, place)
            site = _NewSite(Manifest.read(root, place), files, file_list)
            if site.is_there():
                return ()
            slot = _sibling(place, "new")
            try:
                remove_folder(slot)
                slot.mkdir(0o700)
                entries, paths = site.fill(slot, jobs, stage)
                if not manifest.holds(slot, entries):
                    message = f"another process is changing what is being written to {place}"
                    raise EffectError(message)
                slot.chmod(stat.S_IMODE(place.stat().st_mode) if place.exists() else 0o755)
                if not os.path.lexists(place):
                    slot.rename(place)
                elif not exchange(slot, place):
                    old = _sibling(place, "old")
                    place.rename(old)
                    slot.rename(place)
            finally:
                _recover(place)
                remove_folder(slot)
            Manifest(place, entries).write(root)
            return tuple(sorted(paths))
    except OSError as error:
        raise EffectError(f"the site cannot be written to {out}: {reason(error)}") from None


# --- the place


def _check_place(root: Path, out: Path, place: Path) -> None:
    path = Path(os.path.normpath(root / out))

    def refuse(problem: str, help: str = "") -> PublishRefusedError:
        return PublishRefusedError(f"{out} {problem}", help=help)

    if path.is_relative_to(root) and not place.is_relative_to(root):
        help = "such a link may come with a course: name the folder itself with `--out`"
        raise refuse("is a link that leads out of the project", help)
    if root.is_relative_to(place):
        relation = "is the project itself" if place == root else "holds the project"
        raise refuse(relation, "publish to a folder of its own, such as `public`")
    for name in _AUTHOR_FOLDERS:
        if place.is_relative_to(os.path.realpath(root / name)):
            raise refuse(f"lies in {name}/ of the project, which cannot hold a site")
    _recover(place)
    if os.path.lexists(place) and not place.is_dir():
        raise refuse("is not a folder")
    if os.path.ismount(place):
        raise refuse("is a mount point, which cannot be swapped", "publish to a folder inside it")
    try:
        foreign = manifest.foreign_files(place)
    except OSError as error:
        raise EffectError(f"{out} cannot be read: {reason(error)}") from None
    if foreign:
        names = ", ".join(foreign[:3]) + (f" and {len(foreign) - 3} more" if foreign[3:] else "")
        problem = f"holds files that coursebuild did not put there: {names}"
        raise refuse(problem, "move them away, or publish to another folder")


def exchange(a: Path, b: Path) -> bool:
    """Swap two folders in one step; return `False` where the system or file system cannot.

    An `OSError` says that it can, but refused.
    """
    try:
        native = getattr(ctypes.CDLL(None, use_errno=True), _EXCHANGE[sys.platform])
    except (KeyError, OSError, AttributeError):
        return False
    at = _AT_FDCWD[sys.platform]
    if native(at, os.fsencode(a), at, os.fsencode(b), ctypes.c_uint(_RENAME_EXCHANGE)) == 0:
        return True
    code = ctypes.get_errno()
    if code in _UNSUPPORTED:
        return False
    raise OSError(code, os.strerror(code), str(a), None, str(b))


def _recover(place: Path) -> None:
    """Put the last good site back if a build was killed after renaming it away."""
    old = _sibling(place, "old")
    if os.path.lexists(place):
        remove_folder(old)
    elif (old / MARKER).is_file():
        old.rename(place)


def _sibling(place: Path, suffix: str) -> Path:
    """A folder of ours beside the place: `new`, the slot, or `old`."""
    return place.with_name(f".{place.name}.coursebuild-{suffix}")


# --- the slot

_NO_PATH = regex(r"(?:\A|/)\.{0,2}(?:/|\Z)|[\x00-\x1f\\]")
"""What no path may have: an empty part, `.` or `..`, a control character, a backslash."""
_MIN_FOR_COPIES = 128
"""How many files make it worth starting copies of this process."""
_TASK_SIZE = 16
"""How many files a copy writes for one request."""
_MAX_COPIES = 4
"""The most copies: more would wait for the disk."""


class _NewSite:
    """The site to be published, and the manifest of the one that is there.

    Raises:
        ValueError: a path is not valid in a site, or two files have the same.
    """

    def __init__(
        self, old: Manifest, files: Iterable[SiteFile], file_list: FileList | None
    ) -> None:
        self.old = old
        self.file_list = file_list
        self.files: dict[str, SiteFile] = {}
        """By path, without the file list."""
        self.keys: dict[str, str] = {}
        """The key of each file by its path, that of the file list included."""
        for file in files:
            path = file.path
            if _NO_PATH.search(path) or path == MARKER:
                raise ValueError(f"{path!r} is not a path that a site may have")
            if path in self.files or (file_list is not None and path == file_list.path):
                raise ValueError(f"the site has two files {path}")
            self.files[path] = file
            if isinstance(file, OutputFile):
                self.keys[path] = f"={hashlib.sha256(file.data).hexdigest()}"
            else:
                self.keys[path] = file.key
        if file_list is not None:
            # Of the keys of all files, since the list names all of them.
            lines = (file_list.key, *(f"{key} {path}" for path, key in self.keys.items()))
            data = "\n".join(lines).encode("utf-8", "surrogatepass")
            self.keys[file_list.path] = hashlib.sha256(data).hexdigest()

    def is_there(self) -> bool:
        """Whether the published site is already this one, whole and without other files."""
        if self.keys != {path: entry.key for path, entry in self.old.entries.items()}:
            return False  # the usual case after an edit, found without looking at any file
        place = self.old.place
        try:
            return (
                all(self.old.is_whole(path, key) for path, key in self.keys.items())
                and manifest.holds(place, self.keys)
                and read_regular(place / MARKER) == manifest.marker(self.keys)
            )
        except OSError:
            return False

    def fill(
        self, slot: Path, jobs: int, stage: Callable[[], AbstractContextManager[None]]
    ) -> tuple[dict[str, ManifestEntry], list[str]]:
        """Fill the slot with the site; return its entries and the paths that were written."""
        folders = {path.rpartition("/")[0] for path in self.keys}
        for folder in list(folders):
            while folder := folder.rpartition("/")[0]:
                folders.add(folder)
        for folder in sorted(folders - {""}):  # each after its parent
            (slot / folder).mkdir()
            (slot / folder).chmod(0o755)  # whatever the umask is
        entries = {
            path: entry
            for path, key in self.keys.items()
            if (entry := self.old.entry(path, key)) and self._link(path, entry, slot)
        }
        new_paths = [path for path in self.keys if path not in entries]
        new_files = [self.files[path] for path in new_paths if path in self.files]

        def share(start: int) -> list[ManifestEntry]:
            return [self._write(slot, file) for file in new_files[start : start + _TASK_SIZE]]

        can_share = jobs > 1 and len(new_files) >= _MIN_FOR_COPIES and can_fork()
        with Workers(share, min(jobs, _MAX_COPIES) if can_share else 0) as workers, stage():
            parts = workers.map((None, start) for start in range(0, len(new_files), _TASK_SIZE))
            new_entries = (entry for part, _ in parts for entry in part)
            entries |= {f.path: entry for f, entry in zip(new_files, new_entries, strict=True)}
        if self.file_list is not None and self.file_list.path not in entries:
            facts = [FileFacts(path, e.digest, e.size) for path, e in sorted(entries.items())]
            path = self.file_list.path
            entries[path] = self._write(slot, OutputFile(path, self.file_list.make(facts)))
        _write_file(f"{slot}/{MARKER}", manifest.marker(entries))
        return entries, new_paths

    def _link(self, path: str, entry: ManifestEntry, slot: Path) -> bool:
        target = f"{slot}/{path}"
        try:
            os.link(f"{self.old.place}/{path}", target, follow_symlinks=False)
        except (OSError, NotImplementedError):  # it is gone, or nothing more can be linked there
            return False
        # Look at the link, not at the old file, which may have been replaced meanwhile.
        if entry.fits(os.lstat(target)):
            return True
        Path(target).unlink()
        return False

    def _write(self, slot: Path, file: SiteFile) -> ManifestEntry:
        target, data = f"{slot}/{file.path}", file.make()
        try:
            _write_file(target, data)
        except FileExistsError:  # half a file, if a copy died
            Path(target).unlink()
            _write_file(target, data)
        digest = hashlib.sha256(data).hexdigest()
        return ManifestEntry.of(self.keys[file.path], digest, os.lstat(target))


def _write_file(path: str, data: bytes) -> None:
    with open(path, "xb") as file:  # noqa: PTH123 - thousands of them
        file.write(data)
        os.fchmod(file.fileno(), 0o644)  # whatever the umask is
