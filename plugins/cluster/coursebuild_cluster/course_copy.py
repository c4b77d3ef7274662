"""A course as a list of names and hashes, and a folder that is brought to the same state.

Entry points: `CourseReader`, of a course here; `BlobStore`, the contents of files by their hash on
a worker; `CourseFolder`, the copy that a process works in.

Hidden files stay where they are, as do sites, environments and what is no file: a script that looks
at any of it is run again where the course is (see `executor`). Links are copied as links.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from collections.abc import Iterable, Iterator, Set
from pathlib import Path, PurePosixPath

from msgspec import Struct

from coursebuild.api import is_dropping
from coursebuild_cluster.messages import Piece, pack, unpack

_NOT_COPIED = ("node_modules", "public")
_MOST_KEPT = 4 << 30
"""Bytes of files that a worker keeps, beside those that are asked for."""
_PIECE = 4 << 20
"""Bytes of a file that are sent at once."""


class CopiedFile(Struct, frozen=True, array_like=True):
    """A file of a course, or a link."""

    path: str
    """Relative to the course."""
    digest: str
    """SHA-256; empty for a link."""
    is_program: bool = False
    link: str = ""


class CourseCopy(Struct, frozen=True):
    """All of a course that scripts see on a worker."""

    name: str
    """Of its folder."""
    folders: tuple[str, ...]
    files: tuple[CopiedFile, ...]


class CourseReader:
    """Reads a course, again and again."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.copy = b""
        """The course as it was read last: a packed `CourseCopy`."""
        self.paths: dict[str, str] = {}
        """Paths of files by their digests."""

    def read(self) -> str:
        """Read the course as it is now; return the digest of its copy."""
        folders: list[str] = []
        files: list[CopiedFile] = []
        pending = [""]
        while pending:
            folder = pending.pop()
            with contextlib.suppress(OSError), os.scandir(self.root / folder) as entries:
                for entry in sorted(entries, key=lambda entry: entry.name):
                    path = folder + entry.name
                    if is_dropping(entry.name) or entry.name in _NOT_COPIED:
                        continue
                    if entry.is_symlink():
                        files.append(CopiedFile(path, "", link=os.readlink(entry.path)))  # noqa: PTH115
                    elif entry.is_dir():
                        if not Path(entry.path, "pyvenv.cfg").exists():
                            folders.append(path)
                            pending.append(f"{path}/")
                    elif entry.is_file() and (digest := _digest(entry.path)):
                        is_program = bool(entry.stat().st_mode & 0o100)
                        files.append(CopiedFile(path, digest, is_program))
        self.copy = pack(CourseCopy(self.root.name, tuple(folders), tuple(files)))
        self.paths = {file.digest: file.path for file in files if file.digest}
        return hashlib.sha256(self.copy).hexdigest()

    def digests(self) -> list[str]:
        """The digests of all that a worker needs for the course as it was read last."""
        return [*self.paths, hashlib.sha256(self.copy).hexdigest()]

    def pieces(self, digests: Iterable[str]) -> Iterator[list[Piece]]:
        """The contents with these digests, in parts that are not too large to be sent."""
        batch: list[Piece] = []
        size = 0
        for digest in digests:
            for piece in self._pieces(digest):
                batch.append(piece)
                size += len(piece.data)
                if size >= _PIECE:
                    yield batch
                    batch, size = [], 0
        yield batch

    def _pieces(self, digest: str) -> Iterator[Piece]:
        path = self.paths.get(digest)
        if path is None:
            yield Piece(digest, 0, self.copy, is_last=True)
            return
        try:
            with (self.root / path).open("rb") as file:
                offset, data = 0, file.read(_PIECE)
                while True:
                    following = file.read(_PIECE)
                    yield Piece(digest, offset, data, is_last=not following)
                    if not following:
                        return
                    offset, data = offset + len(data), following
        except OSError:  # it is gone by now, which the next reading will tell
            return


class BlobStore:
    """Contents of files by their SHA-256."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    def missing(self, digests: Iterable[str]) -> list[str]:
        """Those that are not here. What nobody asked for goes where it takes much room."""
        asked_digests = set(digests)
        entries = [entry for entry in os.scandir(self.folder) if entry.is_file()]
        if sum(entry.stat().st_size for entry in entries) > _MOST_KEPT:
            for entry in entries:
                if entry.name not in asked_digests:
                    os.unlink(entry.path)  # noqa: PTH108
        return sorted(asked_digests.difference(os.listdir(self.folder)))  # noqa: PTH208

    def put(self, piece: Piece, sender: str) -> None:
        """Take a piece; the content is here once all of them came, if it is what was said."""
        part = self.folder / f"{sender}.part"
        with part.open("r+b" if piece.offset else "wb") as file:
            file.seek(piece.offset)
            file.write(piece.data)
        if piece.is_last:
            with part.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            if digest == piece.digest:
                part.rename(self.folder / digest)
            else:  # it has changed since it was asked for
                part.unlink()

    def get(self, digest: str) -> bytes:
        """The content with a digest.

        Raises:
            OSError: it is not here.
        """
        return self.path(digest).read_bytes()

    def path(self, digest: str) -> Path:
        """The file with a content."""
        return self.folder / digest


class CourseFolder:
    """A copy of a course."""

    def __init__(self, folder: Path, blobs: BlobStore) -> None:
        self._folder, self._blobs = folder, blobs
        self._digest, self._copy = "", CourseCopy("", (), ())
        self._states: dict[str, tuple[CopiedFile, tuple[int, ...]]] = {}
        """Each file as it was written, and its state then."""
        self.root = folder

    def bring_to(self, digest: str) -> None:
        """Let the copy be as a course that is named by its digest, whatever has been done in it.

        Raises:
            OSError: there is no room for it, or a part of it is not here.
            ValueError: it would not stay in its folder.
        """
        if digest != self._digest:
            copy = unpack(self._blobs.get(digest), CourseCopy)
            paths = [copy.name, *copy.folders, *(file.path for file in copy.files)]
            if any(Path(path).is_absolute() or ".." in PurePosixPath(path).parts for path in paths):
                raise ValueError("a path leads out of the course")
            self._digest, self._copy = digest, copy
        copy = self._copy
        self.root = self._folder / copy.name
        self.root.mkdir(mode=0o700, parents=True, exist_ok=True)
        files = {file.path: file for file in copy.files}
        present = self._remove_others(files.keys(), set(copy.folders))
        for folder in sorted(copy.folders):
            if folder not in present:
                (self.root / folder).mkdir()
        for path, file in files.items():
            if self._states.get(path) != (file, present.get(path, ())):
                self._write(file)
                self._states[path] = file, _state((self.root / path).lstat())

    def changes(self, folders: Iterable[str]) -> Iterator[tuple[str, bytes]]:
        """Files in these folders that are not as they were copied."""
        for folder in folders:
            for place, _, names in os.walk(self.root / folder):
                for name in sorted(names):
                    file = Path(place, name)
                    path = file.relative_to(self.root).as_posix()
                    entry = self._states.get(path)
                    if file.is_symlink() or not file.is_file() or is_dropping(name):
                        continue
                    if entry is None or entry[1] != _state(file.lstat()):
                        yield path, file.read_bytes()

    def _remove_others(self, files: Set[str], folders: Set[str]) -> dict[str, tuple[int, ...]]:
        """Remove what is not to be there; the states of all the rest."""
        present: dict[str, tuple[int, ...]] = {}
        pending = [""]
        while pending:
            folder = pending.pop()
            with os.scandir(self.root / folder) as entries:
                for entry in list(entries):
                    path, is_folder = folder + entry.name, entry.is_dir(follow_symlinks=False)
                    if path in (folders if is_folder else files):
                        present[path] = _state(entry.stat(follow_symlinks=False))
                        if is_folder:
                            pending.append(f"{path}/")
                    elif is_folder:
                        shutil.rmtree(entry.path)
                    else:
                        os.unlink(entry.path)  # noqa: PTH108
        return present

    def _write(self, file: CopiedFile) -> None:
        target = self.root / file.path
        with contextlib.suppress(FileNotFoundError):
            target.unlink()
        if not file.digest:
            target.symlink_to(file.link)
            return
        shutil.copyfile(self._blobs.path(file.digest), target)
        target.chmod(0o755 if file.is_program else 0o644)


def _digest(path: str) -> str:
    """The SHA-256 of a file; empty for one that cannot be read."""
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def _state(status: os.stat_result) -> tuple[int, ...]:
    """What changes when a file does."""
    return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino, status.st_mode
