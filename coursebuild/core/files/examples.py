"""Writing the lessons' scripts to `examples/`, but never over a file that somebody changed there.

1. The manifest `examples/.extracted.json` holds the SHA-256 of what was last written to each path.
   A file with such a hash is ours; any other content is somebody's, and is reported with a diff,
   never overwritten. If the manifest is lost or damaged, the tool only becomes more careful.
2. Before a file changes, the manifest gets its new hash beside the old one; afterwards it keeps the
   new one only. If the tool is killed in between, the file has one of the two.
3. A script that no lesson has any more is removed if it is ours.
"""

from __future__ import annotations

import contextlib
import enum
import hashlib
import os
import re
import stat
from collections.abc import Mapping
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild.core.files import errors
from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import EffectError, FileChangedError, OutsideProjectError
from coursebuild.core.files.write import remove_leftovers, resolve_inside, write_atomic

FOLDER = "examples"
MANIFEST = f"{FOLDER}/.extracted.json"


class Obstacle(enum.Enum):
    """Why a script was not written or removed."""

    EDITED = "edited"
    """It was extracted once and changed by hand since."""
    FOREIGN = "foreign"
    """Something else stands at its path, which was never extracted (or the manifest is lost)."""
    ORPHAN = "orphan"
    """It was extracted once and changed by hand, and no lesson has it any more."""
    LINK = "link"
    """A link stands in its way."""
    FOLDER = "folder"
    """A folder stands at its path, or a file where its folder should be."""


class BlockedFile(Struct, frozen=True):
    """A path that was left alone."""

    path: str
    obstacle: Obstacle
    current: str
    """The content of the file, other bytes than UTF-8 as `\\xNN`; empty for a link or a folder."""
    diff: str
    """Unified diff from the lesson's block to the file; empty where there is nothing to compare."""
    diverged: bool = False
    """Whether, besides an edited file, the lesson's block was changed since it was extracted."""


class ExamplesReport(Struct, frozen=True):
    """The paths of all scripts by outcome, sorted."""

    written: tuple[str, ...]
    unchanged: tuple[str, ...]
    removed: tuple[str, ...]
    blocked: tuple[BlockedFile, ...]


def write_examples(root: Path, scripts: Mapping[str, bytes]) -> ExamplesReport:
    """Bring `examples/` up to date with every script of the course, by its path below it.

    The caller holds the lock of the course's folder.

    Raises:
        EffectError: the folder cannot be written, or leads out of the project.
    """
    root = root.resolve()
    try:
        resolve_inside(root, FOLDER)
    except OutsideProjectError:
        raise OutsideProjectError(f"{FOLDER}/ is a link that leads out of the project") from None
    hashes_by_path: dict[str, tuple[str, ...]] = {}  # those that each extracted file may have
    try:
        hashes_by_path = msgspec.json.decode(read_regular(root / MANIFEST), type=_Manifest).files
    except OSError as error:
        # An empty manifest would make all files look edited, now and later.
        if errors.lacking(error):
            raise
    except ValueError:
        pass  # it is damaged
    if not all(p.startswith(f"{FOLDER}/") and ".." not in p.split("/") for p in hashes_by_path):
        hashes_by_path = {}
    if not scripts and not hashes_by_path:
        return ExamplesReport((), (), (), ())
    try:
        return _Update(root, hashes_by_path, scripts).run()
    except OSError as error:
        place = os.path.relpath(error.filename, root) if error.filename else FOLDER
        raise EffectError(f"{place} cannot be written: {errors.reason(error)}") from None


class _Update:
    """One run: record what is planned, do it, record what was done."""

    def __init__(
        self, root: Path, known_hashes: Mapping[str, tuple[str, ...]], scripts: Mapping[str, bytes]
    ) -> None:
        self.root = root
        self.known_hashes = known_hashes
        """By path: the hashes that our file may have."""
        self.scripts = scripts
        self.current: dict[str, bytes | None] = {}
        """The content on the disk of the files to be written or removed."""
        self.manifest: dict[str, tuple[str, ...]] = {}
        self.written: list[str] = []
        self.unchanged: list[str] = []
        self.removed: list[str] = []
        self.blocked: list[BlockedFile] = []

    def run(self) -> ExamplesReport:
        for path in sorted(self.scripts.keys() | self.known_hashes.keys()):
            self._plan(path)
        (self.root / FOLDER).mkdir(exist_ok=True)
        folders = {FOLDER, *(path.rpartition("/")[0] for path in self.scripts)}
        remove_leftovers(self.root / folder for folder in folders)
        if self.written or self.removed:
            hashes = {path: self.manifest.get(path, ()) for path in (*self.manifest, *self.removed)}
            for path, new_hashes in hashes.items():
                all_hashes = (*new_hashes, *self.known_hashes.get(path, ()))
                hashes[path] = tuple(dict.fromkeys(all_hashes))
            _save_manifest(self.root, hashes)
        for path in list(self.written):
            new, old = self.scripts[path], self.current[path]
            try:
                write_atomic(self.root, path, new, expected=old, durable=False)
            except FileChangedError:  # somebody saved it since, maybe another run of the tool
                now = self._look(path)[1]
                if now != new:
                    self.written.remove(path)
                    self._block(path, Obstacle.EDITED, now)
        for path in list(self.removed):
            full = self.root / path
            if full.read_bytes() != self.current[path]:
                self.removed.remove(path)
                self._block(path, Obstacle.ORPHAN, full.read_bytes())
                continue
            full.unlink()
            with contextlib.suppress(OSError):  # the folder holds something else
                for folder in full.relative_to(self.root).parents[:-2]:
                    (self.root / folder).rmdir()
        _save_manifest(self.root, self.manifest)
        blocked = tuple(sorted(self.blocked, key=lambda b: b.path))
        return ExamplesReport(
            tuple(self.written), tuple(self.unchanged), tuple(self.removed), blocked
        )

    def _plan(self, path: str) -> None:
        new, known_hashes = self.scripts.get(path), self.known_hashes.get(path)
        obstacle, current = self._look(path)
        if new is None and (obstacle is not None or current is None):
            return  # gone, or no longer ours
        # An empty file is nobody's work: a power cut may empty one that was just written.
        if current and current != new and _hash(current) not in (known_hashes or ()):
            if new is None:
                obstacle = Obstacle.ORPHAN
            else:
                obstacle = Obstacle.FOREIGN if known_hashes is None else Obstacle.EDITED
        if obstacle is not None:
            self._block(path, obstacle, current)
            return
        self.current[path] = current
        if new is None:
            self.removed.append(path)
        else:
            self.manifest[path] = (_hash(new),)
            (self.unchanged if current == new else self.written).append(path)

    def _look(self, path: str) -> tuple[Obstacle | None, bytes | None]:
        """What is at a path: an obstacle, or the bytes of a file, or nothing."""
        folders = [i for i, c in enumerate(path) if c == "/"][1:]  # not `examples` itself
        try:
            for end in (*folders, len(path)):
                mode = os.lstat(f"{self.root}/{path[:end]}").st_mode
                if stat.S_ISLNK(mode):
                    return Obstacle.LINK, None
                if not (stat.S_ISREG if end == len(path) else stat.S_ISDIR)(mode):
                    return Obstacle.FOLDER, None
            with open(f"{self.root}/{path}", "rb", buffering=0) as file:  # noqa: PTH123
                return None, file.read()
        except (FileNotFoundError, NotADirectoryError):
            return None, None

    def _block(self, path: str, obstacle: Obstacle, current: bytes | None) -> None:
        if path in self.known_hashes:
            self.manifest[path] = self.known_hashes[path]
        else:
            self.manifest.pop(path, None)
        text, new = _decode(current or b""), self.scripts.get(path)
        diff = ""
        if current is not None:
            names = f"{path} (in the lesson)", f"{path} (on the disk)"
            diff = unified_diff(_decode(new or b""), text, *names)
        is_new = new is not None and _hash(new) not in self.known_hashes.get(path, ())
        diverged = obstacle is Obstacle.EDITED and is_new
        self.blocked.append(BlockedFile(path, obstacle, text, diff, diverged))


def unified_diff(old: str, new: str, old_name: str, new_name: str) -> str:
    """The difference between two texts as `diff -u` writes it; empty if there is none."""
    import difflib

    return "".join(
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
        for line in difflib.unified_diff(_lines(old), _lines(new), old_name, new_name)
    )


def _lines(text: str) -> list[str]:
    """Split a text at LF only, keeping line ends: a form feed in a script is no line end."""
    return re.findall(r"[^\n]*\n|[^\n]+", text)


def _decode(data: bytes) -> str:
    return data.decode("utf-8", "backslashreplace")


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


class _Manifest(Struct, frozen=True):
    version: int
    files: dict[str, tuple[str, ...]]


def _save_manifest(root: Path, manifest: Mapping[str, tuple[str, ...]]) -> None:
    text = msgspec.json.encode(_Manifest(1, dict(sorted(manifest.items()))))
    data = msgspec.json.format(text, indent=1) + b"\n"
    path = root / MANIFEST
    while True:
        try:
            current: bytes | None = read_regular(path)
        except FileNotFoundError:
            current = None
        except OSError as error:
            raise errors.EffectError(f"{MANIFEST} cannot be read: {errors.reason(error)}") from None
        if current == data:
            return
        with contextlib.suppress(FileChangedError):  # by another run, where there are no locks
            write_atomic(root, MANIFEST, data, expected=current, durable=False)
            return
