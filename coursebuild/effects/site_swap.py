"""Publishing a site whole: written beside the old one, then swapped in, or not at all.

Entry points: `check_out`, which says early whether a site may go somewhere; `publish`; `recover`,
for those who serve.

1. The place is checked: never the project or what its author wrote, never a folder with files that
   we did not put there.
2. What killed builds left beside it is removed; what a running build has there is not.
3. Every file is written into a folder beside the place, on the same file system (`site_files`).
   One that was published before under the same key, and is whole, is linked from the old site
   instead, or is there already, if the folder is that of the site before (`site_staging`); where
   all are whole, the old site stays.
4. The two folders are exchanged in one step. Where the system cannot, the old one is renamed away
   and the new one renamed in; a build that was killed between the two is mended by `recover`.
5. The old site is removed, or kept for the next build to put into it what it lacks.

A site is derived and can be built again, so it is not forced to the disk: after a power cut, build
again.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import stat
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

from msgspec import Struct, field

from coursebuild.effects.errors import EffectError, PublishRefusedError, reason
from coursebuild.effects.exchange import exchange
from coursebuild.effects.published import Entry, Published, write_published
from coursebuild.effects.site_files import write_file, writing
from coursebuild.effects.site_listing import MARKER as MARKER
from coursebuild.effects.site_listing import TRIES, foreign_files, holds, marker
from coursebuild.effects.site_staging import (
    Staging,
    beside,
    clean,
    held,
    is_alive,
    keep_spare,
    remove,
    sift,
)
from coursebuild.patterns import pattern
from coursebuild.results import FileFacts, FileList, OutputFile, SiteFile

_NO_PATH = pattern(r"(?:\A|/)\.{0,2}(?:/|\Z)|[\x00-\x1f\\]")
"""A part of a path that is empty or stands for a folder, a control character, a backslash."""
_MEDDLED = "somebody else changes what is being written"
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
        foreign = foreign_files(place)
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
    left: Callable[[Mapping[str, Entry]], object] = len,
) -> tuple[str, ...]:
    """Replace the site at `out` by these files.

    Args:
        root: the course folder.
        out: where the site goes; a link to a folder stays one.
        files: each path once; POSIX, relative, without `..`.
        listed: a file that is made of what all these are.
        jobs: copies of this process, at most, that make and write files where there are many.
        stage: is entered when the files are made.
        left: is given the entries of a site that was put there, by path.

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
        clean(place)
        with _ground(root, place, site) as (folder, kept):
            entries, made = site.write(folder, kept, jobs, stage)
            if kept.files and not holds(folder, entries):
                raise EffectError(f"the site cannot be written to {out}: {_MEDDLED}")
            folder.chmod(_mode(place))
            with held(place) as old:
                exchanged = _swap(folder, place)
                if exchanged and old is not None and len(made) < len(entries) / 2:
                    keep_spare(root, folder, old)
        clean(place)
    except OSError as error:
        raise EffectError(f"the site cannot be written to {out}: {reason(error)}") from None
    write_published(root, place, entries)
    left(entries)
    return tuple(sorted(made))


def recover(out: Path) -> None:
    """Put the last good site back, if a build was killed after renaming it away."""
    place = Path(os.path.realpath(out))
    if os.path.lexists(place) or any(is_alive(path) for path in beside(place, "new")):
        return
    whole = [path for path in beside(place, "old") if (path / MARKER).is_file()]
    if whole:
        with contextlib.suppress(OSError):  # another build was faster
            max(whole, key=lambda path: path.stat().st_mtime_ns).rename(place)


@contextmanager
def _ground(root: Path, place: Path, site: _Site) -> Iterator[tuple[Path, _Kept]]:
    """A folder beside the place, with what is in it already; what is there at the end goes."""
    staging, kept = _begun(root, place, site)
    try:
        yield staging.path, kept
    finally:
        os.close(staging.fd)
        recover(place)
        remove(staging.path)


def _begun(root: Path, place: Path, site: _Site) -> tuple[Staging, _Kept]:
    spare = Staging.spare(root, place)
    if spare is not None:
        try:
            if (place / MARKER).is_file():
                return spare, site.sift(spare.fd)
        except OSError:
            pass
        except BaseException:
            os.close(spare.fd)
            remove(spare.path)
            raise
        os.close(spare.fd)
        remove(spare.path)
    return Staging.make(place), _Kept()


def _key(file: SiteFile) -> str:
    """What a file's bytes depend on; those that are there already, on nothing but themselves."""
    if isinstance(file, OutputFile):
        return "=" + hashlib.sha256(file.data).hexdigest()
    return file.key


class _Kept(Struct, frozen=True):
    """What is in a folder before the site is written into it."""

    files: Mapping[str, Entry] = field(default_factory=dict)
    """By path; each is as it is to be."""
    folders: frozenset[str] = frozenset()


class _Site(Struct, frozen=True):
    """The site that is to be, and the one that is there."""

    old: Published
    files: tuple[tuple[SiteFile, str], ...]
    """Each with its key."""
    listed: FileList | None

    def is_there(self) -> bool:
        """Whether it is there already, whole and with nothing beside it."""
        entries = self.old.entries
        keys = {file.path: key for file, key in self.files}
        if any(path not in entries or entries[path].key != key for path, key in keys.items()):
            return False  # as after every edit: no file is looked at for that
        if self.listed is not None:
            keys[self.listed.path] = self._list_key(self.listed)
        paths = keys.keys()
        if len(keys) != len(self.files) + (self.listed is not None) or paths != entries.keys():
            return False
        if not all(self.old.is_whole(path, key) for path, key in keys.items()):
            return False
        try:
            listing = (self.old.place / MARKER).read_bytes()
            return holds(self.old.place, paths) and listing == marker(paths)
        except OSError:
            return False

    def sift(self, folder: int) -> _Kept:
        """Remove from an open folder what the site is not to have, or not as it is there."""
        known: dict[str, Entry] = {}
        for file, key in self.files:
            entry = self.old.entries.get(file.path)
            if entry is not None and entry.key == key:
                known[file.path] = entry
        parents = {file.path.rpartition("/")[0] for file, _ in self.files}
        folders = {path[:end] for path in parents for end in _ends(path)}
        files, there = sift(folder, known, folders)
        return _Kept(files, frozenset(there))

    def write(
        self,
        folder: Path,
        kept: _Kept,
        jobs: int,
        stage: Callable[[], AbstractContextManager[None]],
    ) -> tuple[dict[str, Entry], list[str]]:
        """Fill a folder; gives its record, and what is new in it."""
        folders, paths = {"", *kept.folders}, set[str]()
        entries: dict[str, Entry] = {}
        new: list[tuple[SiteFile, str]] = []
        for file, key in self.files:
            path = file.path
            there = kept.files.get(path)
            if there is not None and path not in paths:
                paths.add(path)
                entries[path] = there
                continue
            target = _room(folder, path, folders, paths)
            linked = self._linked(path, key, target)
            if linked is not None:
                entries[path] = linked
            else:
                new.append((file, key))
        with writing(folder, new, jobs) as written, stage():
            entries |= written()
        made = [file.path for file, _ in new]
        if self.listed is not None:
            listed, key = self.listed, self._list_key(self.listed)
            target = _room(folder, listed.path, folders, paths)
            linked = self._linked(listed.path, key, target)
            if linked is not None:
                entries[listed.path] = linked
            else:
                facts = [FileFacts(p, e.digest, e.size) for p, e in sorted(entries.items())]
                digest = write_file(target, (listed.make(facts),))
                entries[listed.path] = Entry.of(key, digest, os.lstat(target))
                made.append(listed.path)
        write_file(f"{folder}/{MARKER}", (marker(entries),))
        return entries, made

    def _list_key(self, listed: FileList) -> str:
        """What the list's bytes depend on: nothing of it is known before all files are."""
        text = "\n".join((listed.key, *(f"{key} {file.path}" for file, key in self.files)))
        return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()

    def _linked(self, path: str, key: str, target: str) -> Entry | None:
        """Link a file of the old site that is as it should be; gives its entry."""
        entry = self.old.entries.get(path)
        if entry is None or entry.key != key:
            return None
        try:
            os.link(f"{self.old.place}/{path}", target, follow_symlinks=False)
        except (OSError, NotImplementedError):  # it is gone, or nothing more can be linked there
            return None
        # What was linked is looked at, not what stands there: that may be another by now. Somebody
        # may have written to it, or do so through a link of theirs: then it is made anew.
        seen = entry.seen(os.lstat(target))
        if seen is None:
            Path(target).unlink()
        return seen


def _ends(path: str) -> list[int]:
    """Where the paths of a folder, and of those that it lies in, end in its path."""
    return [*(at for at, letter in enumerate(path) if letter == "/"), len(path)]


def _check_path(path: str, written: Container[str]) -> None:
    if _NO_PATH.search(path) or path == MARKER:
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


def _swap(staging: Path, place: Path) -> bool:
    """Put the new site at the place; the old one is then where that was, or is named old.

    Returns:
        Whether it is where the new one was.
    """
    for _ in range(TRIES):
        if os.path.lexists(place):
            if exchange(staging, place):
                return True
            old = place.with_name(f".{place.name}.old-{os.urandom(4).hex()}")
            with contextlib.suppress(FileNotFoundError):  # another build is between its two renames
                place.rename(old)
        try:
            staging.rename(place)
            return False
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
