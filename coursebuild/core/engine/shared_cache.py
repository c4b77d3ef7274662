"""Results shared between machines: a folder, or any place that fsspec knows (`s3://…`).

Entry point: `shared_cache(address)` returns the `SharedCache` that a `Memo` uses.

1. It holds entries of memos under the same names; the memo that reads an entry verifies it.
2. Reading waits for the place. Up to four threads write while the work goes on.
3. A place that cannot be reached or takes too long is reported once and left alone for a while:
   it costs time, but is never an error.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import Any, TypeVar
from urllib.parse import unquote, urlsplit

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.trust import replace_file

_VERSION = "coursebuild-1"
"""The folder of entries in the shared place; change it when the format of entries changes."""
_SIGNED_VERSION = "coursebuild-1-signed"
"""The folder of signed entries, which only those who have the key can make."""
_UNSIGNED = b"unsigned"
_TIMEOUT = 15.0
"""Seconds that a request may take."""
_FLUSH_TIMEOUT = 60.0
"""Seconds that a command waits at its end for entries still to be sent."""
_PAUSE = 120.0
"""Seconds for which a place that failed is left alone."""
_WRITERS = 4

T = TypeVar("T")


class FolderPlace:
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
            return (self.folder / path).read_bytes()
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


class RemotePlace:
    """A place that fsspec reaches, with the interface of `FolderPlace`."""

    def __init__(self, files: Any, top: str) -> None:
        self.files = files
        self.top = top.rstrip("/")

    def read(self, path: str) -> bytes | None:
        """A file's bytes; `None` if there is none."""
        try:
            data: bytes = self.files.cat_file(f"{self.top}/{path}")
        except (FileNotFoundError, NotADirectoryError):
            return None
        return data

    def write(self, path: str, data: bytes) -> None:
        """Make or replace a file."""
        full = f"{self.top}/{path}"
        try:
            self.files.pipe_file(full, data)
        except FileNotFoundError:  # this kind of place has folders
            self.files.makedirs(full.rpartition("/")[0], exist_ok=True)
            self.files.pipe_file(full, data)

    def names(self, folder: str) -> list[str]:
        """The names in a folder; none if there is none."""
        try:
            paths = self.files.ls(f"{self.top}/{folder}", detail=False)
        except (FileNotFoundError, NotADirectoryError):
            return []
        return [PurePosixPath(str(path)).name for path in paths]


def shared_cache(address: str, key: bytes = b"") -> SharedCache:
    """The cache at a folder or a URL; nothing is read yet.

    With a key, the cache of entries signed with it.

    Raises:
        EffectError: this installation cannot reach such a place at all.
    """
    scheme, separator, _ = address.partition("://")
    if not separator:
        return SharedCache(address, FolderPlace(Path(address).expanduser().absolute()), key)
    if scheme == "file":
        return SharedCache(address, FolderPlace(Path(unquote(urlsplit(address).path))), key)
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise EffectError(
            f"the cache {address} needs the package fsspec",
            help="run `pip install 'coursebuild[cache]'`",
        ) from None
    try:
        files, top = url_to_fs(address, use_listings_cache=False)
    except ImportError as error:
        raise EffectError(f"the cache {address} needs a package: {_words(error)}") from None
    except ValueError as error:
        raise EffectError(f"there is no place like {address}: {_words(error)}") from None
    return SharedCache(address, RemotePlace(files, top), key)


class SharedCache:
    """A place where entries are shared; its failures raise no exception."""

    def __init__(
        self,
        address: str,
        place: FolderPlace | RemotePlace,
        key: bytes = b"",
        timeout: float = _TIMEOUT,
    ) -> None:
        self.address = address
        self.place = place
        self.key = key or _UNSIGNED
        """The key of their seals; where entries are not signed, one that everybody has."""
        self._folder = _SIGNED_VERSION if key else _VERSION
        self.timeout = timeout
        self.tell: Callable[[str], None] = lambda line: None
        """Called once, with a message, when the place cannot be used."""
        self._was_reported = False
        self._down_until = -1.0
        self._lock = threading.Lock()
        self._writers = threading.Semaphore(_WRITERS)

    def read(self, name: str) -> bytes | None:
        """An entry; `None` where there is none or the place fails."""
        return self._ask(lambda: self.place.read(f"{self._folder}/{name}"), None)

    def names(self, folder: str) -> list[str]:
        """The names of the entries in a group."""
        return self._ask(lambda: self.place.names(f"{self._folder}/{folder}"), [])

    def write(self, name: str, entry: bytes) -> None:
        """Send an entry in the background; wait only while many others are being sent."""
        if self._is_down():
            return
        if self._writers.acquire(timeout=self.timeout):
            # A thread each, since an idle one would keep this process from forking.
            work = (name, entry)
            threading.Thread(target=self._send, args=work, name="shared cache", daemon=True).start()
        else:
            self._fail(f"no answer within {self.timeout:g} s")

    def flush(self, seconds: float = _FLUSH_TIMEOUT) -> None:
        """Wait until everything is sent, but not for ever."""
        until = time.monotonic() + seconds
        with contextlib.ExitStack() as idle:
            for _ in range(_WRITERS):
                if self._is_down():
                    return
                if not self._writers.acquire(timeout=max(until - time.monotonic(), 0.0)):
                    self._fail(f"results could not be sent in {seconds:g} s")
                    return
                idle.callback(self._writers.release)

    def _send(self, name: str, entry: bytes) -> None:
        try:
            if not self._is_down():
                self.place.write(f"{self._folder}/{name}", entry)
        except Exception as error:  # libraries of clouds raise what they like
            self._fail(_words(error))
        finally:
            self._writers.release()

    def _ask(self, function: Callable[[], T], otherwise: T) -> T:
        """The function's result if it comes in time; a call that hangs is abandoned."""
        if self._is_down():
            return otherwise
        result: list[T] = []
        trouble: list[Exception] = []

        def work() -> None:
            try:
                result.append(function())
            except Exception as error:
                trouble.append(error)

        thread = threading.Thread(target=work, name="shared cache", daemon=True)
        thread.start()
        thread.join(self.timeout)
        if result:
            return result[0]
        self._fail(_words(trouble[0]) if trouble else f"no answer within {self.timeout:g} s")
        return otherwise

    def _is_down(self) -> bool:
        return time.monotonic() < self._down_until

    def _fail(self, cause: str) -> None:
        with self._lock:
            self._down_until = time.monotonic() + _PAUSE
            was_reported, self._was_reported = self._was_reported, True
        if not was_reported:
            self.tell(f"the shared cache {self.address} cannot be used: {cause}")


def _words(error: Exception) -> str:
    """An error as the end of a sentence: one line, lower case, no full stop."""
    if isinstance(error, OSError) and error.errno:
        return reason(error)
    text = " ".join(str(error).split()).rstrip(".")
    if not text:
        return type(error).__name__
    return text if text[:2].isupper() else text[:1].lower() + text[1:]
