"""The place where a store shares results with other machines: a folder, or what fsspec reaches."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote, urlsplit

from msgspec import Struct

from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import EffectError, reason, require
from coursebuild.core.files.trust import replace_file

_VERSION = "coursebuild-1"
"""The folder of entries in the shared place; change it when the format of entries changes."""
_SIGNED_VERSION = "coursebuild-1-signed"
"""The folder of signed entries, which only those who have the key can make."""
_UNSIGNED = b"unsigned"


class FolderFiles:
    """A folder, perhaps on a network file system.

    Not by fsspec, which is an extra, and whose `file://` writes a file in place: another machine
    would read half an entry.

    Paths in it are POSIX and relative. An exception of any kind means that the place failed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def read(self, path: str) -> bytes | None:
        """A file's bytes; `None` if there is none."""
        try:
            return read_regular(self.folder / path)
        except (FileNotFoundError, NotADirectoryError):
            if not self.folder.is_dir():
                self.folder.mkdir()  # or raise the reason; its parent must exist
            return None

    def write(self, path: str, data: bytes) -> None:
        """Make or replace a file, whole or not at all."""
        target = self.folder / path
        self.folder.mkdir(exist_ok=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        replace_file(str(target), data)

    def names(self, folder: str) -> list[str]:
        """The names in a folder; none if there is none."""
        try:
            return [path.name for path in (self.folder / folder).iterdir()]
        except (FileNotFoundError, NotADirectoryError):
            return []


class _RemoteFiles:
    """A place that fsspec reaches, with the interface of `FolderFiles`."""

    def __init__(self, files: Any, top: str) -> None:
        self.files = files
        self.top = top.rstrip("/")

    def read(self, path: str) -> bytes | None:
        try:
            data: bytes = self.files.cat_file(f"{self.top}/{path}")
        except (FileNotFoundError, NotADirectoryError):
            return None
        return data

    def write(self, path: str, data: bytes) -> None:
        full = f"{self.top}/{path}"
        try:
            self.files.pipe_file(full, data)
        except FileNotFoundError:  # this kind of place has folders
            self.files.makedirs(full.rpartition("/")[0], exist_ok=True)
            self.files.pipe_file(full, data)

    def names(self, folder: str) -> list[str]:
        try:
            paths = self.files.ls(f"{self.top}/{folder}", detail=False)
        except (FileNotFoundError, NotADirectoryError):
            return []
        return [PurePosixPath(str(path)).name for path in paths]


class SharedPlace(Struct, frozen=True):
    """A place of shared entries; they lie under the same names as in a store."""

    address: str
    files: FolderFiles | _RemoteFiles
    key: bytes = b""
    """The team's, with which entries are signed; mostly empty."""

    @property
    def seal_key(self) -> bytes:
        """The key of their seals; where entries are not signed, one that everybody has."""
        return self.key or _UNSIGNED

    def path(self, name: str) -> str:
        """The path of an entry or of a group."""
        return f"{_SIGNED_VERSION if self.key else _VERSION}/{name}"


def shared_place(address: str, key: bytes = b"") -> SharedPlace:
    """The place at a folder or a URL; nothing is read yet.

    With a key, the place of entries signed with it.

    Raises:
        EffectError: this installation cannot reach such a place at all.
    """
    scheme, separator, _ = address.partition("://")
    if not separator:
        return SharedPlace(address, FolderFiles(Path(address).expanduser().absolute()), key)
    if scheme == "file":
        return SharedPlace(address, FolderFiles(Path(unquote(urlsplit(address).path))), key)
    require("fsspec", "cache", f"the cache {address}")
    from fsspec.core import url_to_fs

    try:
        files, top = url_to_fs(address, use_listings_cache=False)
    except ImportError as error:
        raise EffectError(f"the cache {address} needs a package: {in_words(error)}") from None
    except ValueError as error:
        raise EffectError(f"there is no such place as {address}: {in_words(error)}") from None
    return SharedPlace(address, _RemoteFiles(files, top), key)


def in_words(error: Exception) -> str:
    """An error as the end of a sentence: one line, lower case, no full stop."""
    if isinstance(error, OSError) and error.errno:
        return reason(error)
    text = " ".join(str(error).split()).rstrip(".")
    if not text:
        return type(error).__name__
    return text if text[:2].isupper() else text[:1].lower() + text[1:]
