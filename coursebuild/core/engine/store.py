"""Results that are expensive to make and depend on nothing but their key, kept in `.coursebuild/`.

1. An entry lies at `.coursebuild/KIND/KEY`, or `KIND/GROUP/KEY` where several results belong
   together. It is sealed under its name with the user's key (see `core.files.trust`), and the
   reader says which type the data must have. What somebody else wrote, or damaged, is not there.
2. It is renamed when it is whole. Nothing is lost when the folder is deleted.
3. Results of scripts and trials can be shared: they are also looked for in the shared place, if
   there is one, and sent there. Reading waits for it; up to four threads write while the work goes
   on. If it cannot be reached or takes too long, that is reported once, and it is left alone for a
   while: it costs time, but is never an error.
4. Now and then, as a command ends, the entries used longest ago are removed, down to the limit.
"""

from __future__ import annotations

import contextlib
import functools
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import msgspec
from markupsafe import Markup

from coursebuild.core.engine.shared_place import SharedPlace, in_words
from coursebuild.core.files import trust
from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import reason
from coursebuild.core.text.regex import regex
from coursebuild.core.values import DAMAGE

Value = TypeVar("Value")
T = TypeVar("T")

SIZE = 1 << 30
"""Bytes that all entries may take together."""
HASH = regex(r"[0-9a-f]{64}")
"""The name of an entry or of a group of entries."""
_USE_INTERVAL = 3600.0
"""Seconds after which the use of an entry is noted again, and a killed writer's file is removed."""
_PRUNE_INTERVAL = 3600.0
"""Seconds between two prunings."""
_PRUNE_SHARE = 16
"""A command that wrote this part of the limit, a sixteenth, prunes whatever the interval."""
_GROUP_SIZE = 8
"""Entries that a group keeps, the newest."""
_PRUNED_SHARE = 0.9
"""Part of the limit that pruning leaves in use, so that not every command has to prune."""
_TIMEOUT = 15.0
"""Seconds that a request to the shared place may take."""
_FLUSH_TIMEOUT = 60.0
"""Seconds that a command waits at its end for entries still to be sent."""
_PAUSE = 120.0
"""Seconds for which a shared place that failed is left alone."""
_WRITERS = 4


class Store:
    """The results kept for a course, here and perhaps in a shared place.

    Safe to use from several threads, and from several processes on the same folder.
    """

    def __init__(
        self,
        root: Path,
        *,
        shared: SharedPlace | None = None,
        size: int = SIZE,
        fresh: bool = False,
        timeout: float = _TIMEOUT,
    ) -> None:
        folder, self.set_aside = trust.find_store(str(root))
        """Why the folder `.coursebuild` of the course is not used; mostly empty."""
        self.folder = Path(folder)
        self.root = root
        self._key = trust.store_key(str(root))
        self.shared = shared
        self.size = size
        self.fresh = fresh
        """Whether everything is to be made again: `get` finds nothing, `put` works as usual."""
        self._lock = threading.Lock()
        self._messages: set[str] = set()
        self._pending: list[str] = []
        self._tell: Callable[[str], None] = self._pending.append
        self._bytes_written = 0
        self._timeout = timeout
        self._shared_failed = False
        self._down_until = -1.0
        self._writers = threading.Semaphore(_WRITERS)

    def listen(self, tell: Callable[[str], None]) -> None:
        """Send messages about the store to `tell`, a line each, earlier ones included."""
        with self._lock:
            self._tell = tell
            pending, self._pending = self._pending, []
        for line in pending:
            tell(line)

    def get_or_make(self, kind: str, key: str, make: Callable[[], bytes]) -> bytes:
        """The result of this kind and key: the one kept, or one made and kept now."""
        data = self.get(kind, key, bytes)
        if data is not None:
            return data
        data = make()
        if self.fresh:
            before = self.peek(kind, key, bytes)
            if before is not None and before != data:
                self._say(f"{_short(f'{kind}/{key}')} was made again and is not what was kept")
        self.put(kind, key, data)
        return data

    def get(
        self, kind: str, key: str, read: Callable[[bytes], Value | None], *, shared: bool = False
    ) -> Value | None:
        """The result of this kind and key, if an undamaged one is kept.

        `read` makes the result from its bytes; if it raises one of `DAMAGE` or returns `None`, the
        entry is damaged. A `shared` result is looked for in the shared place too.
        """
        if self.fresh:
            return None
        value = self.peek(kind, key, read)
        if value is None and self.shared is not None and shared:
            value = self._fetch(self.shared, f"{kind}/{key}", read)
        return value

    def peek(self, kind: str, key: str, read: Callable[[bytes], Value | None]) -> Value | None:
        """What this machine keeps under a key, even if everything is to be made again."""
        name = f"{kind}/{key}"
        path = f"{self.folder}/{name}"
        try:
            entry = read_regular(path)
            modified = os.stat(path).st_mtime  # noqa: PTH116 - there are many
        except OSError:
            return None
        value = _value(trust.unseal(name, entry, self._key), read)
        if value is not None and time.time() - modified > _USE_INTERVAL:
            with contextlib.suppress(OSError):
                os.utime(path)  # entries used lately are pruned last
        return value

    def put(self, kind: str, key: str, data: bytes, *, shared: bool = False) -> None:
        """Keep a result, if `shared` also in the shared place; failing to only costs time."""
        name = f"{kind}/{key}"
        self._write(name, data)
        if self.shared is None or not shared or self._is_down():
            return
        if self._writers.acquire(timeout=self._timeout):
            # A thread each, since an idle one would keep this process from forking.
            work = (self.shared, name, trust.seal(name, data, self.shared.seal_key))
            threading.Thread(target=self._send, args=work, name="shared", daemon=True).start()
        else:
            self._fail(self.shared, f"no answer within {self._timeout:g} s")

    def get_value(self, kind: str, key: str, type: type[Value]) -> Value | None:
        """A value that was kept, if it is of this type."""
        return self.get(kind, key, value_reader(type))

    def put_value(self, kind: str, key: str, value: object) -> None:
        """Keep a value as MessagePack, unless it has a text that is no UTF-8."""
        with contextlib.suppress(UnicodeEncodeError):
            self.put(kind, key, msgspec.msgpack.encode(value, enc_hook=_markup_text))

    def group(self, kind: str, key: str) -> list[str]:
        """Return the keys `GROUP/KEY` of a group, newest first, and remove all but the newest."""
        folder = self.folder / kind / key
        entries: list[tuple[float, str]] = []
        with contextlib.suppress(OSError), os.scandir(folder) as files:
            entries = [(f.stat().st_mtime, f.name) for f in files if not f.name.startswith(".")]
        entries.sort(reverse=True)
        for _, name in entries[_GROUP_SIZE:]:
            (folder / name).unlink(missing_ok=True)
        return [f"{key}/{name}" for _, name in entries[:_GROUP_SIZE]]

    def shared_group(self, kind: str, key: str) -> list[str]:
        """The keys of a group that the shared place has."""
        shared = self.shared
        if shared is None or self.fresh:
            return []
        names = self._ask(shared, lambda: shared.files.names(shared.path(f"{kind}/{key}"))) or []
        return [f"{key}/{name}" for name in sorted(names) if HASH.fullmatch(name)]

    def flush(self, seconds: float = _FLUSH_TIMEOUT) -> None:
        """Wait until everything is sent to the shared place, but not for ever."""
        if self.shared is None:
            return
        until = time.monotonic() + seconds
        with contextlib.ExitStack() as idle:
            for _ in range(_WRITERS):
                if self._is_down():
                    return
                if not self._writers.acquire(timeout=max(until - time.monotonic(), 0.0)):
                    self._fail(self.shared, f"results could not be sent in {seconds:g} s")
                    return
                idle.callback(self._writers.release)

    def close(self) -> None:
        """Wait until the shared place has all new results, and keep the store within its limit."""
        self.flush()
        if not self._bytes_written:
            return
        marker, age = self.folder / "pruned", _PRUNE_INTERVAL
        with contextlib.suppress(OSError):
            with contextlib.suppress(FileNotFoundError):
                age = time.time() - marker.stat().st_mtime
            is_full = self._bytes_written * _PRUNE_SHARE >= self.size
            if is_full or not 0.0 <= age < _PRUNE_INTERVAL:
                marker.touch()
                prune(self.folder, self.size)
        self._bytes_written = 0

    def _say(self, line: str) -> None:
        with self._lock:
            if line in self._messages:
                return
            self._messages.add(line)
            tell = self._tell
        tell(line)

    def _fetch(
        self, shared: SharedPlace, name: str, read: Callable[[bytes], Value | None]
    ) -> Value | None:
        entry = self._ask(shared, lambda: shared.files.read(shared.path(name)))
        if entry is None:
            return None
        data = trust.unseal(name, entry, shared.seal_key)
        value = _value(data, read)
        if data is None or value is None:
            self._say(f"{_short(name)} in the shared cache is damaged: it is made again")
        else:
            self._write(name, data)
        return value

    def _write(self, name: str, data: bytes) -> None:
        path, entry = self.folder / name, trust.seal(name, data, self._key)
        try:
            try:
                trust.replace_file(str(path), entry)
            except FileNotFoundError:
                trust.make_store(str(self.folder), str(self.root))
                path.parent.mkdir(parents=True, exist_ok=True)
                trust.replace_file(str(path), entry)
        except OSError as error:
            if self._key:  # else it was said at the beginning
                self._say(f"results cannot be kept in {trust.FOLDER}: {reason(error)}")
            return
        with self._lock:
            self._bytes_written += len(entry)

    # --- the shared place

    def _send(self, shared: SharedPlace, name: str, entry: bytes) -> None:
        try:
            if not self._is_down():
                shared.files.write(shared.path(name), entry)
        except Exception as error:  # libraries of clouds raise what they like
            self._fail(shared, in_words(error))
        finally:
            self._writers.release()

    def _ask(self, shared: SharedPlace, function: Callable[[], T]) -> T | None:
        """The function's result if it comes in time; a call that hangs is abandoned."""
        if self._is_down():
            return None
        results: list[T] = []
        errors: list[Exception] = []

        def work() -> None:
            try:
                results.append(function())
            except Exception as error:
                errors.append(error)

        thread = threading.Thread(target=work, name="shared", daemon=True)
        thread.start()
        thread.join(self._timeout)
        if results:
            return results[0]
        cause = in_words(errors[0]) if errors else f"no answer within {self._timeout:g} s"
        self._fail(shared, cause)
        return None

    def _is_down(self) -> bool:
        return time.monotonic() < self._down_until

    def _fail(self, shared: SharedPlace, cause: str) -> None:
        with self._lock:
            self._down_until = time.monotonic() + _PAUSE
            failed_before, self._shared_failed = self._shared_failed, True
        if not failed_before:
            self._say(f"the shared cache {shared.address} cannot be used: {cause}")


def value_reader(type: type[Value]) -> Callable[[bytes], Value]:
    """A function that reads the bytes of a value of this type."""
    return functools.partial(msgspec.msgpack.decode, type=type, dec_hook=_make_markup)


def _markup_text(value: object) -> str:
    if isinstance(value, Markup):
        return str(value)
    raise TypeError(f"a {type(value).__qualname__} cannot be kept")


def _make_markup(kind: type, value: object) -> Markup:
    if kind is Markup and isinstance(value, str):
        return Markup(value)
    raise TypeError(f"no {kind.__qualname__} can be read")


def _value(data: bytes | None, read: Callable[[bytes], Value | None]) -> Value | None:
    """The result that an entry's data holds; `None` where the data is missing or damaged."""
    try:
        return None if data is None else read(data)
    except DAMAGE:
        return None


def _short(name: str) -> str:
    kind, _, key = name.partition("/")
    return f"the entry {kind}/{key[:12]}…" if len(key) > 12 else f"the entry {name}"


# --- the limit


def prune(folder: Path, limit: int) -> None:
    """Remove the entries used longest ago until the rest takes at most `limit` bytes.

    Only files named by a hash are entries. Other processes may write, read and prune meanwhile:
    one that misses a removed entry makes it again.
    """
    with os.scandir(folder) as entries:
        kinds = [kind.path for kind in entries if kind.is_dir(follow_symlinks=False)]
    files = sorted(file for kind in kinds for file in _entries(kind, time.time() - _USE_INTERVAL))
    total = sum(size for _, _, size in files)
    enough = limit if total <= limit else limit * _PRUNED_SHARE
    for _, path, size in files:
        if total <= enough:
            break
        total -= size
        with contextlib.suppress(OSError):
            os.unlink(path)  # noqa: PTH108 - ten thousand of them


def _entries(folder: str, long_ago: float) -> Iterator[tuple[float, str, int]]:
    """The entries in a folder: when each was used last, its path and its size.

    Temporary files that a killed writer left before `long_ago` are removed.
    """
    with contextlib.suppress(OSError), os.scandir(folder) as files:
        for entry in files:
            if entry.is_dir(follow_symlinks=False) and HASH.fullmatch(entry.name):
                yield from _entries(entry.path, long_ago)
                with contextlib.suppress(OSError):  # it is not empty
                    os.rmdir(entry.path)  # noqa: PTH106
            elif entry.is_file(follow_symlinks=False):
                status = entry.stat(follow_symlinks=False)
                if HASH.fullmatch(entry.name):
                    yield status.st_mtime, entry.path, status.st_size
                elif entry.name.startswith(trust.TEMPORARY) and status.st_mtime < long_ago:
                    os.unlink(entry.path)  # noqa: PTH108
