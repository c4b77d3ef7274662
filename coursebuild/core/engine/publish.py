"""Publishing a site whole: written beside the old one, then swapped in, or not at all.

Entry points: `check_out`, which says early whether a site may go somewhere; `publish`.

1. The place is checked: never the project or what its author wrote, never a folder with files that
   we did not put there. One build publishes to a place at a time.
2. The site is filled into a slot: a folder beside the place, on the same file system. A file that
   was published before under the same key, and is whole, stays in the slot, or is linked from the
   old site; the others are made.
3. Slot and site are exchanged in one step. Where the system cannot, the old site is renamed away
   and the new one renamed in; where a build was killed between the two, the next puts it back.
4. The old site is put away in `.coursebuild/`. It is the slot of the next build, which has to put
   into it only what it lacks: to link thousands of files anew, and to remove as many, takes longer
   than to make those that an edit changes. It is believed as little as the site.

A site is derived and can be built again, so it is not forced to the disk: after a power cut, build
again.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import stat
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from msgspec import Struct

from coursebuild.core.engine.exchange import exchange
from coursebuild.core.engine.manifest import (
    FOLDER,
    MARKER,
    Manifest,
    ManifestEntry,
    foreign_files,
    holds,
    marker,
)
from coursebuild.core.engine.site_files import write_file, writing
from coursebuild.core.files.errors import EffectError, PublishRefusedError, reason
from coursebuild.core.files.locks import folder_lock
from coursebuild.core.model.results import FileFacts, FileList, OutputFile, SiteFile

_NO_PATH = re.compile(r"(?:\A|/)\.{0,2}(?:/|\Z)|[\x00-\x1f\\]")
"""A part of a path that is empty or stands for a folder, a control character, a backslash."""
_AUTHORED = ("content", "features", "models", "examples", ".coursebuild", ".git")


def check_out(root: Path, out: Path) -> Path:
    """Where the site goes: `out`, or the folder it links to. What a killed build left is mended.

    Raises:
        PublishRefusedError: a site must not go there.
    """
    place = Path(os.path.realpath(out))
    with folder_lock(place.parent):
        _check_place(Path(os.path.realpath(root)), out, place)
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
    place = check_out(root, out)
    root = Path(os.path.realpath(root))
    keyed = {file.path: (file, _key(file)) for file in _with_paths_checked(files, listed)}
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with folder_lock(place.parent):
            _check_place(root, out, place)
            site = _Site(Manifest.read(root, place), keyed, listed)
            if site.is_there():
                return ()
            return _replace(root, place, site, jobs, stage)
    except OSError as error:
        raise EffectError(f"the site cannot be written to {out}: {reason(error)}") from None


def _replace(
    root: Path,
    place: Path,
    site: _Site,
    jobs: int,
    stage: Callable[[], AbstractContextManager[None]],
) -> tuple[str, ...]:
    """Fill the slot with the site, and swap the two; gives what was written."""
    slot = _beside(place, "new")
    try:
        _open_slot(root, slot)
        entries, made = site.fill(slot, jobs, stage)
        if not holds(slot, entries):
            raise EffectError(f"somebody else changes what is being written to {place}")
        slot.chmod(_mode(place))
        _swap(slot, place)
    finally:
        _recover(place)
        _put_away(root, slot)
    Manifest(place, entries).write(root)
    return tuple(sorted(made))


class _Site(Struct, frozen=True):
    """The site that is to be, and what is known of the one that is there."""

    old: Manifest
    files: Mapping[str, tuple[SiteFile, str]]
    """By path, each with its key."""
    listed: FileList | None

    def is_there(self) -> bool:
        """Whether it is there already, whole and with nothing beside it."""
        keys = {path: key for path, (_, key) in self.files.items()}
        if self.listed is not None:
            keys[self.listed.path] = self._list_key(self.listed)
        if keys != {path: entry.key for path, entry in self.old.entries.items()}:
            return False  # as after every edit: no file is looked at for that
        place = self.old.place
        try:
            return (
                all(self.old.is_whole(path, key) for path, key in keys.items())
                and holds(place, keys)
                and (place / MARKER).read_bytes() == marker(keys)
            )
        except OSError:
            return False

    def fill(
        self, slot: Path, jobs: int, stage: Callable[[], AbstractContextManager[None]]
    ) -> tuple[dict[str, ManifestEntry], list[str]]:
        """Make the slot hold the site; gives what is in it, and the paths that are new."""
        folders = _folders([*self.files, *([self.listed.path] if self.listed else [])])
        known = {p: e for p, (_, k) in self.files.items() if (e := self.old.entry(p, k))}
        entries = _sift(f"{slot}/", "", known, frozenset(folders))
        for folder in folders:
            (slot / folder).mkdir(exist_ok=True)
            (slot / folder).chmod(0o755)  # whatever the umask is
        for path, entry in known.items():
            if path not in entries and self._link(path, entry, slot):
                entries[path] = entry
        new = [found for path, found in self.files.items() if path not in entries]
        with writing(slot, new, jobs) as written, stage():
            entries |= written()
        made = [file.path for file, _ in new]
        if self.listed is not None and self._add_list(self.listed, slot, entries):
            made.append(self.listed.path)
        write_file(f"{slot}/{MARKER}", marker(entries))
        return entries, made

    def _add_list(self, listed: FileList, slot: Path, entries: dict[str, ManifestEntry]) -> bool:
        """Add the list of all files; whether it is a new one."""
        key = self._list_key(listed)
        entry = self.old.entry(listed.path, key)
        if entry is not None and self._link(listed.path, entry, slot):
            entries[listed.path] = entry
            return False
        facts = [FileFacts(path, e.digest, e.size) for path, e in sorted(entries.items())]
        target = f"{slot}/{listed.path}"
        digest = write_file(target, listed.make(facts))
        entries[listed.path] = ManifestEntry.of(key, digest, os.lstat(target))
        return True

    def _list_key(self, listed: FileList) -> str:
        """What the list's bytes depend on: nothing of it is known before all files are."""
        lines = (f"{key} {path}" for path, (_, key) in self.files.items())
        text = "\n".join((listed.key, *lines))
        return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()

    def _link(self, path: str, entry: ManifestEntry, slot: Path) -> bool:
        """Link a file of the old site, if it is as it should be."""
        target = f"{slot}/{path}"
        try:
            os.link(f"{self.old.place}/{path}", target, follow_symlinks=False)
        except (OSError, NotImplementedError):  # it is gone, or nothing more can be linked there
            return False
        # What was linked is looked at, not what stands there: that may be another by now.
        if entry.fits(os.lstat(target)):
            return True
        Path(target).unlink()
        return False


def _with_paths_checked(files: Iterable[SiteFile], listed: FileList | None) -> Iterator[SiteFile]:
    seen = set[str]() if listed is None else {listed.path}
    for file in files:
        path = file.path
        if _NO_PATH.search(path) or path == MARKER:
            raise ValueError(f"{path!r} is no path that a site may have")
        if path in seen:
            raise ValueError(f"the site has two files {path}")
        seen.add(path)
        yield file


def _key(file: SiteFile) -> str:
    """What a file's bytes depend on; those that are there already, on nothing but themselves."""
    if isinstance(file, OutputFile):
        return "=" + hashlib.sha256(file.data).hexdigest()
    return file.key


def _folders(paths: Iterable[str]) -> list[str]:
    """The folders that files need, each after the one that it lies in."""
    found = {path.rpartition("/")[0] for path in paths}
    for folder in list(found):
        while folder := folder.rpartition("/")[0]:
            found.add(folder)
    return sorted(found - {""})


# --- the place


def _check_place(root: Path, out: Path, place: Path) -> None:
    if root.is_relative_to(place):
        what = "is the project itself" if place == root else "holds the project"
        raise PublishRefusedError(
            f"{out} {what}", help="publish to a folder of its own, such as `public`"
        )
    for name in _AUTHORED:
        if place.is_relative_to(os.path.realpath(root / name)):
            raise PublishRefusedError(f"{out} lies in {name}/ of the project, where no site may go")
    _recover(place)
    if os.path.lexists(place) and not place.is_dir():
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
        more = f" and {len(foreign) - 3} more" if len(foreign) > 3 else ""
        raise PublishRefusedError(
            f"{out} holds files that coursebuild did not put there: {', '.join(foreign[:3])}{more}",
            help="move them away, or publish to another folder",
        )


def _swap(slot: Path, place: Path) -> None:
    """Put the new site at the place, and the old one where the new one was."""
    if not os.path.lexists(place):
        slot.rename(place)
    elif not exchange(slot, place):
        old = _beside(place, "old")
        _remove(old)
        place.rename(old)
        slot.rename(place)
        old.rename(slot)


def _recover(place: Path) -> None:
    """Put the last good site back, if a build was killed after renaming it away."""
    old = _beside(place, "old")
    if os.path.lexists(place):
        _remove(old)
    elif (old / MARKER).is_file():
        old.rename(place)


def _mode(place: Path) -> int:
    """The permissions of the site's folder: those that it has, else the usual ones."""
    with contextlib.suppress(FileNotFoundError):
        return stat.S_IMODE(place.stat().st_mode)
    return 0o755


# --- the slot


def _beside(place: Path, what: str) -> Path:
    """A folder of ours beside the place: `new`, the slot while it is filled; `old`."""
    return place.with_name(f".{place.name}.coursebuild-{what}")


def _open_slot(root: Path, slot: Path) -> None:
    """Have the folder that the site is filled into: one that is left, or an empty one."""
    if not os.path.lexists(slot):
        with contextlib.suppress(OSError):  # there is none, or it is on another file system
            (root / FOLDER / "spare").rename(slot)
    if not slot.is_dir() or slot.is_symlink():
        with contextlib.suppress(FileNotFoundError):
            slot.unlink()
        slot.mkdir()
    slot.chmod(0o700)


def _put_away(root: Path, slot: Path) -> None:
    """Keep the slot for the next build, where it is in nobody's way."""
    with contextlib.suppress(OSError):
        slot.chmod(0o700)  # one that may not be written cannot be moved elsewhere
        with contextlib.suppress(OSError):
            slot.rename(root / FOLDER / "spare")
            return
        _remove(slot)


def _sift(
    folder: str, prefix: str, known: Mapping[str, ManifestEntry], folders: Container[str]
) -> dict[str, ManifestEntry]:
    """Remove from a folder all but files that are as they should be; gives these.

    Args:
        folder: its path, with a slash behind it.
        prefix: its path in the site, likewise.
        known: what the files should be, by path.
        folders: those that may stay.
    """
    kept: dict[str, ManifestEntry] = {}
    with os.scandir(folder) as entries:
        found = list(entries)
    for entry in found:
        path = prefix + entry.name
        expected = known.get(path)
        if not entry.is_dir(follow_symlinks=False):
            if expected is not None and expected.fits(entry.stat(follow_symlinks=False)):
                kept[path] = expected
            else:
                os.unlink(entry.path)  # noqa: PTH108 - thousands of them
        elif path in folders:
            os.chmod(entry.path, 0o755)  # noqa: PTH101
            kept |= _sift(f"{entry.path}/", f"{path}/", known, folders)
        else:
            _remove(Path(entry.path))
    return kept


def _remove(folder: Path) -> None:
    """Remove a folder, as far as that can be done."""
    with contextlib.suppress(OSError):
        folder.chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)
