"""Publishing a site whole: written beside the old one, then swapped in, or not at all.

Entry points: `check_out`, which says early whether a site may go somewhere; `publish`; `recover`,
for those who serve.

1. The place is checked: never the project or what its author wrote, never a folder with files that
   we did not put there.
2. What killed builds left beside it is removed; what a running build has there is not.
3. Every file is written into a fresh folder beside the place, on the same file system
   (`site_files`). One that was published before under the same key, and is whole, is linked from
   the old site instead; where all are, the old site stays.
4. The two folders are exchanged in one step. Where the system cannot, the old one is renamed away
   and the new one renamed in; a build that was killed between the two is mended by `recover`.
5. The old site is removed.

A site is derived and can be built again, so it is not forced to the disk: after a power cut, build
again.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import shutil
import stat
import unicodedata
from collections.abc import Callable, Container, Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from coursebuild.effects.errors import EffectError, PublishRefusedError, reason
from coursebuild.effects.exchange import exchange
from coursebuild.effects.locks import is_abandoned, try_lock
from coursebuild.effects.published import Entry, Published, write_published
from coursebuild.effects.site_files import write_file, writing
from coursebuild.results import FileFacts, FileList, OutputFile, SiteFile
from coursebuild.values import dataclass

MARKER = ".coursebuild-site"
"""A file in every site: a line that says what it is, then the path of every file of the site."""
_HEADER = "site built by coursebuild; every file listed here may be replaced"
_JUNK = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
"""What file managers strew about."""
_TRIES = 100
"""How often to start again when another build publishes to the same place."""
_AUTHORED = ("content", "models", "examples", ".coursebuild", ".git")


def check_out(root: Path, out: Path) -> Path:
    """Where the site goes: `out`, or the folder it links to.

    Raises:
        PublishRefusedError: a site must not go there.
    """
    place = Path(os.path.realpath(out))
    root = Path(os.path.realpath(root))
    if root.is_relative_to(place):
        what = "is the project itself" if place == root else "holds the project"
        raise PublishRefusedError(
            f"{out} {what}", help="publish to a folder of its own, such as `public`"
        )
    for name in _AUTHORED:
        if place.is_relative_to(os.path.realpath(root / name)):
            raise PublishRefusedError(f"{out} lies in {name}/ of the project, where no site may go")
    # One look each: another build may rename the site away between two.
    with contextlib.suppress(OSError):
        if not stat.S_ISDIR(place.stat().st_mode):
            raise PublishRefusedError(f"{out} is not a folder")
    if os.path.ismount(place):
        raise PublishRefusedError(
            f"{out} is a mount point, which cannot be swapped", help="publish to a folder inside it"
        )
    try:
        foreign = _foreign(place)
    except OSError as error:
        raise EffectError(f"{out} cannot be read: {reason(error)}") from None
    if foreign:
        named = ", ".join(foreign[:3]) + (
            f" and {len(foreign) - 3} more" if len(foreign) > 3 else ""
        )
        raise PublishRefusedError(
            f"{out} holds files that coursebuild did not put there: {named}",
            help="move them away, or publish to another folder",
        )
    return place


def publish(
    root: Path,
    out: Path,
    files: Iterable[SiteFile],
    listed: FileList | None = None,
    *,
    jobs: int = 1,
    stage: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> tuple[str, ...]:
    """Replace the site at `out` by these files.

    Args:
        root: the course folder.
        out: where the site goes; a link to a folder stays one.
        files: each path once; POSIX, relative, without `..`.
        listed: a file that is made of what all these are.
        jobs: copies of this process, at most, that make and write files where there are many.
        stage: is entered when the files are made.

    Returns:
        The paths of the files that were written, sorted: the others are as they were.

    Raises:
        PublishRefusedError: a site must not go there.
        EffectError: it cannot be written; the old site is still there.
        ValueError: a path is none that a site may have (a bug of the caller).
    """
    recover(out)
    place = check_out(root, out)
    root = Path(os.path.realpath(root))
    keyed = tuple((file, _key(file)) for file in files)
    site = _Site(Published.read(root, place), keyed, listed)
    if site.is_there():
        return ()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        _clean(place)
        staging = _Staging.make(place)
        try:
            entries, made = site.write(staging.path, jobs, stage)
            staging.path.chmod(_mode(place))
            _swap(staging.path, place)
        finally:
            os.close(staging.fd)
            recover(out)
            _remove(staging.path)
        _clean(place)
    except OSError as error:
        raise EffectError(f"the site cannot be written to {out}: {reason(error)}") from None
    write_published(root, place, entries)
    return tuple(sorted(made))


def recover(out: Path) -> None:
    """Put the last good site back, if a build was killed after renaming it away."""
    place = Path(os.path.realpath(out))
    if os.path.lexists(place) or any(_is_alive(path) for path in _beside(place, "new")):
        return
    whole = [path for path in _beside(place, "old") if (path / MARKER).is_file()]
    if whole:
        with contextlib.suppress(OSError):  # another build was faster
            max(whole, key=lambda path: path.stat().st_mtime_ns).rename(place)


@dataclass(frozen=True, slots=True)
class _Staging:
    """A fresh folder beside the place; open and locked as long as its builder lives."""

    path: Path
    fd: int

    @classmethod
    def make(cls, place: Path) -> _Staging:
        while True:
            path = place.with_name(f".{place.name}.new-{os.urandom(4).hex()}")
            path.mkdir(0o700)
            try:
                fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
                try_lock(fd)
            except FileNotFoundError:  # another build took it for abandoned before it was locked
                continue
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(fd), path.stat()):
                    return cls(path, fd)
            os.close(fd)


def _key(file: SiteFile) -> str:
    """What a file's bytes depend on; those that are there already, on nothing but themselves."""
    if isinstance(file, OutputFile):
        return "=" + hashlib.sha256(file.data).hexdigest()
    return file.key


@dataclass(frozen=True, slots=True)
class _Site:
    """The site that is to be, and the one that is there."""

    old: Published
    files: tuple[tuple[SiteFile, str], ...]
    """Each with its key."""
    listed: FileList | None

    def is_there(self) -> bool:
        """Whether it is there already, whole and with nothing beside it."""
        keys = [(file.path, key) for file, key in self.files]
        if self.listed is not None:
            keys.append((self.listed.path, self._list_key(self.listed)))
        paths = {path for path, _ in keys}
        if len(paths) != len(keys) or paths != self.old.entries.keys():
            return False
        if not all(self.old.is_whole(path, key) for path, key in keys):
            return False
        try:
            found = [path for path in _files(self.old.place) if path != MARKER]
            marker = (self.old.place / MARKER).read_bytes()
        except OSError:
            return False
        return len(found) == len(paths) and paths.issuperset(found) and marker == _marker(paths)

    def write(
        self, folder: Path, jobs: int, stage: Callable[[], AbstractContextManager[None]]
    ) -> tuple[dict[str, Entry], list[str]]:
        """Fill a folder; gives its record, and what is new in it."""
        folders, paths = {""}, set[str]()
        entries: dict[str, Entry] = {}
        new: list[tuple[SiteFile, str]] = []
        for file, key in self.files:
            target = _room(folder, file.path, folders, paths)
            if self._linked(file.path, key, target):
                digest = self.old.entries[file.path].digest
                entries[file.path] = Entry.of(key, digest, os.lstat(target))
            else:
                new.append((file, key))
        with writing(folder, new, jobs) as written, stage():
            entries |= written()
        made = [file.path for file, _ in new]
        if self.listed is not None:
            listed, key = self.listed, self._list_key(self.listed)
            target = _room(folder, listed.path, folders, paths)
            if self._linked(listed.path, key, target):
                entries[listed.path] = Entry.of(
                    key, self.old.entries[listed.path].digest, os.lstat(target)
                )
            else:
                facts = [FileFacts(p, e.digest, e.size) for p, e in sorted(entries.items())]
                digest = write_file(target, (listed.make(facts),))
                entries[listed.path] = Entry.of(key, digest, os.lstat(target))
                made.append(listed.path)
        write_file(f"{folder}/{MARKER}", (_marker(entries),))
        return entries, made

    def _list_key(self, listed: FileList) -> str:
        """What the list's bytes depend on: nothing of it is known before all files are."""
        text = "\n".join((listed.key, *(f"{key} {file.path}" for file, key in self.files)))
        return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()

    def _linked(self, path: str, key: str, target: str) -> bool:
        """Link a file of the old site that is as it should be."""
        if not self.old.is_whole(path, key):
            return False
        try:
            os.link(f"{self.old.place}/{path}", target, follow_symlinks=False)
        except (OSError, NotImplementedError):  # a file system without links, or too many of them
            return False
        # Somebody may have written to it since it was looked at, or may do so through a link of
        # theirs: then it is made anew.
        if self.old.is_whole(path, key):
            return True
        Path(target).unlink()
        return False


def _marker(paths: Iterable[str]) -> bytes:
    return "\n".join([_HEADER, *sorted(paths), ""]).encode()


def _check_path(path: str, written: Container[str]) -> None:
    parts = path.split("/")
    if (
        any(part in ("", ".", "..") for part in parts)
        or any(c < " " or c == "\\" for c in path)
        or path == MARKER
    ):
        raise ValueError(f"{path!r} is no path that a site may have")
    if path in written:
        raise ValueError(f"the site has two files {path}")


def _room(folder: Path, path: str, folders: set[str], paths: set[str]) -> str:
    """Where a file is to be, in a folder that is there."""
    _check_path(path, paths)
    paths.add(path)
    parent = path.rpartition("/")[0]
    if parent not in folders:
        _make_folders(folder, parent, folders)
    return f"{folder}/{path}"


def _make_folders(folder: Path, path: str, made: set[str]) -> None:
    parent = path.rpartition("/")[0]
    if parent not in made:
        _make_folders(folder, parent, made)
    (folder / path).mkdir()
    (folder / path).chmod(0o755)
    made.add(path)


def _swap(staging: Path, place: Path) -> None:
    """Put the new site at the place; the old one is then where that was, or is named old."""
    for _ in range(_TRIES):
        if os.path.lexists(place):
            if exchange(staging, place):
                return
            old = place.with_name(f".{place.name}.old-{os.urandom(4).hex()}")
            with contextlib.suppress(FileNotFoundError):  # another build is between its two renames
                place.rename(old)
        try:
            staging.rename(place)
            return
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
        # Another build put its site there just now; ours replaces it.
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))


def _mode(place: Path) -> int:
    """The permissions of the site's folder: those that it has, else the usual ones."""
    with contextlib.suppress(FileNotFoundError):
        return stat.S_IMODE(place.stat().st_mode)
    return 0o755


def _foreign(place: Path) -> list[str]:
    """Files at the place that no build of ours put there; sorted."""
    for _ in range(_TRIES):
        try:
            before = place.stat()
            found = _foreign_once(place)
            if os.path.samestat(before, place.stat()):
                return found
        except FileNotFoundError:
            if not place.exists():
                return []
        # Another build swapped its site in while we looked.
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))


def _foreign_once(place: Path) -> list[str]:
    missing: FileNotFoundError | None = None
    header, listed = "", list[str]()
    try:
        header, *listed = (place / MARKER).read_text(encoding="utf-8").split("\n")
    except FileNotFoundError as error:
        missing = error
    except (IsADirectoryError, UnicodeDecodeError):
        pass
    found = list(_files(place))
    if missing and MARKER in found:
        raise missing  # the site was away when its list was to be read
    ours = {MARKER, *map(_normal, listed)} if header == _HEADER else set[str]()
    return sorted(path for path in found if _normal(path) not in ours)


def _normal(path: str) -> str:
    """The path with its letters composed: some file systems of macOS take them apart."""
    return path if path.isascii() else unicodedata.normalize("NFC", path)


def _files(folder: Path, prefix: str = "") -> Iterator[str]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                yield from _files(Path(entry.path), f"{prefix}{entry.name}/")
            elif entry.name not in _JUNK:
                yield f"{prefix}{entry.name}"


def _beside(place: Path, kind: str) -> list[Path]:
    """Folders beside the place that a build made: `new` being written, `old` replaced."""
    start = f".{place.name}.{kind}-"
    try:
        with os.scandir(place.parent) as entries:
            return sorted(
                Path(entry.path)
                for entry in entries
                if entry.name.startswith(start)
                and len(entry.name) == len(start) + 8
                and entry.is_dir(follow_symlinks=False)
            )
    except OSError:
        return []


def _is_alive(staging: Path) -> bool:
    """Whether the build that writes this folder still runs."""
    try:
        fd = os.open(staging, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        return not is_abandoned(fd)
    finally:
        os.close(fd)


def _clean(place: Path) -> None:
    """Remove what builds that are no more left beside the place."""
    for path in _beside(place, "new"):
        if not _is_alive(path):
            _remove(path)
    if place.exists():  # else the old site may be all there is
        for path in _beside(place, "old"):
            _remove(path)


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
