"""Publishing a site: written whole beside the old one, then swapped in, or not at all.

Entry points: `check_output_folder`, which says early whether a site may go somewhere; `publish`.

1. The place is checked: it is neither the project nor a folder of the author's, and holds no file
   that we did not put there. One build publishes to a place at a time.
2. The site is filled into a slot: a folder beside the place, on the same file system. A file that
   was published before under the same key, and is whole, stays in the slot, or is linked from the
   old site; the others are made.
3. Slot and site are exchanged in one step. Where the system cannot, the old site is renamed away
   and the new one renamed in; if a build is killed between the two, the next one puts it back.
4. The old site is put away in `.coursebuild/`, as the slot of the next build, which then has to add
   only what is missing: linking thousands of files, and removing as many, takes longer than making
   the few that an edit changes. Its files are checked as those of the site are.

A site can be built again, so it is not synced to the disk: after a power cut, build again.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import stat
import sys
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from coursebuild.core.engine.manifest import (
    MARKER,
    Manifest,
    foreign_files,
    holds,
)
from coursebuild.core.engine.slot import NewSite, new_site, open_slot, put_away, remove
from coursebuild.core.files.errors import EffectError, PublishRefusedError, reason
from coursebuild.core.files.locks import folder_lock
from coursebuild.core.model.results import FileList, SiteFile

_EXCHANGE = {"linux": "renameat2", "darwin": "renameatx_np"}
"""The system's function that swaps two paths; it takes the same arguments on both systems."""
_AT_FDCWD = {"linux": -100, "darwin": -2}
_RENAME_EXCHANGE = 2  # linux/fs.h; RENAME_SWAP in sys/stdio.h of macOS
_UNSUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EPERM)
_AUTHOR_FOLDERS = ("content", "features", "models", "examples", ".coursebuild", ".git")


def check_output_folder(root: Path, out: Path) -> Path:
    """Return where the site goes: `out`, or the folder it links to; undo a killed build.

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
    file_list: FileList | None = None,
    *,
    jobs: int = 1,
    stage: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> tuple[str, ...]:
    """Replace the site at `out` by these files.

    Args:
        root: the course folder.
        out: where the site goes; a link to a folder stays one.
        files: each path once; POSIX, relative, without `..`.
        file_list: a file that lists all the others.
        jobs: how many copies of this process, at most, make and write files where there are many.
        stage: a context that is entered while the files are made.

    Returns:
        The paths of the files that were written, sorted; the others have not changed.

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
            site = new_site(Manifest.read(root, place), files, file_list)
            if site.is_there():
                return ()
            return _replace(root, place, site, jobs, stage)
    except OSError as error:
        raise EffectError(f"the site cannot be written to {out}: {reason(error)}") from None


def _replace(
    root: Path,
    place: Path,
    site: NewSite,
    jobs: int,
    stage: Callable[[], AbstractContextManager[None]],
) -> tuple[str, ...]:
    """Fill the slot with the site and swap the two; return the paths that were written."""
    slot = _sibling(place, "new")
    try:
        open_slot(root, slot)
        entries, paths = site.fill(slot, jobs, stage)
        if not holds(slot, entries):
            raise EffectError(f"somebody else changes what is being written to {place}")
        slot.chmod(_mode(place))
        _swap(slot, place)
    finally:
        _recover(place)
        put_away(root, slot)
    Manifest(place, entries).write(root)
    return tuple(sorted(paths))


# --- the place


def _check_place(root: Path, out: Path, place: Path) -> None:
    path = Path(os.path.normpath(root / out))
    if path.is_relative_to(root) and not place.is_relative_to(root):
        raise PublishRefusedError(
            f"{out} is a link that leads out of the project",
            help="a course may bring such a link: name the folder itself by `--out`",
        )
    if root.is_relative_to(place):
        relation = "is the project itself" if place == root else "holds the project"
        raise PublishRefusedError(
            f"{out} {relation}", help="publish to a folder of its own, such as `public`"
        )
    for name in _AUTHOR_FOLDERS:
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
        rest = f" and {len(foreign) - 3} more" if len(foreign) > 3 else ""
        raise PublishRefusedError(
            f"{out} holds files that coursebuild did not put there: {', '.join(foreign[:3])}{rest}",
            help="move them away, or publish to another folder",
        )


def _swap(slot: Path, place: Path) -> None:
    """Move the new site to the place, and the old one to the slot."""
    if not os.path.lexists(place):
        slot.rename(place)
    elif not exchange(slot, place):
        old = _sibling(place, "old")
        remove(old)
        place.rename(old)
        slot.rename(place)
        old.rename(slot)


def exchange(a: Path, b: Path) -> bool:
    """Swap two folders in one step; return `False` where the system or file system cannot.

    Raises:
        OSError: the system can, but refused.
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
        remove(old)
    elif (old / MARKER).is_file():
        old.rename(place)


def _mode(place: Path) -> int:
    """The permissions of the site's folder: those it has already, else the usual ones."""
    with contextlib.suppress(FileNotFoundError):
        return stat.S_IMODE(place.stat().st_mode)
    return 0o755


def _sibling(place: Path, suffix: str) -> Path:
    """A folder of ours beside the place: `new`, the slot while it is filled, or `old`."""
    return place.with_name(f".{place.name}.coursebuild-{suffix}")
