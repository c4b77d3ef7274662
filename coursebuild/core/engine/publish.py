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
from coursebuild.core.engine.slot import NewSite, open_slot, put_away, remove, with_keys
from coursebuild.core.files.errors import EffectError, PublishRefusedError, reason
from coursebuild.core.files.locks import folder_lock
from coursebuild.core.model.results import FileList, SiteFile

_EXCHANGE = {"linux": "renameat2", "darwin": "renameatx_np"}
"""Names of the system's function that swaps two paths, which takes the same arguments in both."""
_AT_FDCWD = {"linux": -100, "darwin": -2}
_RENAME_EXCHANGE = 2  # linux/fs.h; RENAME_SWAP in sys/stdio.h of macOS
_UNSUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EPERM)
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
    keyed = with_keys(files, listed)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with folder_lock(place.parent):
            _check_place(root, out, place)
            site = NewSite(Manifest.read(root, place), keyed, listed)
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
    """Fill the slot with the site, and swap the two; gives what was written."""
    slot = _beside(place, "new")
    try:
        open_slot(root, slot)
        entries, made = site.fill(slot, jobs, stage)
        if not holds(slot, entries):
            raise EffectError(f"somebody else changes what is being written to {place}")
        slot.chmod(_mode(place))
        _swap(slot, place)
    finally:
        _recover(place)
        put_away(root, slot)
    Manifest(place, entries).write(root)
    return tuple(sorted(made))


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
        remove(old)
        place.rename(old)
        slot.rename(place)
        old.rename(slot)


def exchange(a: Path, b: Path) -> bool:
    """Swap two folders in one step; gives whether the system, and the file system, can.

    Raises:
        OSError: they can, and refused.
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
    """Put the last good site back, if a build was killed after renaming it away."""
    old = _beside(place, "old")
    if os.path.lexists(place):
        remove(old)
    elif (old / MARKER).is_file():
        old.rename(place)


def _mode(place: Path) -> int:
    """The permissions of the site's folder: those that it has, else the usual ones."""
    with contextlib.suppress(FileNotFoundError):
        return stat.S_IMODE(place.stat().st_mode)
    return 0o755


def _beside(place: Path, what: str) -> Path:
    """A folder of ours beside the place: `new`, the slot while it is filled; `old`."""
    return place.with_name(f".{place.name}.coursebuild-{what}")
