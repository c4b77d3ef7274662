"""V8 as the library that mini-racer brings: a few of its C functions, bound directly.

Entry points: `library()`, the functions; `Context`, JavaScript with a thread of V8's own.

1. mini-racer's own package is not imported: it is a client of the same functions that drives them
   by an event loop in one more thread (see docs/dependencies.md). What the functions take is not
   promised from one version to the next, so that none but `VERSION` is used.
2. A task is handed to V8's thread with a number. V8 calls back with the number and a value, also
   for a task that was ended; all that this does is to put both into a queue.
3. Whoever has handed over a task waits at the queue for its number. What comes under another
   number is of a task that was given up: it is freed.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import sys
import threading
import time
from ctypes import c_char_p, c_size_t, c_uint8, c_uint64, c_void_p
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import ClassVar

from coursebuild.effects.errors import EffectError
from coursebuild.effects.versions import package_version

VERSION = "0.14.1"
"""Of mini-racer; the same as in pyproject.toml."""
_HELP = "run `pip install coursebuild` again"
_FILES = {"darwin": "libmini_racer.dylib", "win32": "mini_racer.dll"}


class StoppedError(BaseException):
    """Another thread has asked for the end of what ran.

    Like a `KeyboardInterrupt` it is no failure that anything on its way might deal with.
    """


class LimitError(Exception):
    """A script ran too long or took too much memory; its context should not be used any more.

    `resumable`: it can still be asked how far it came.
    """

    def __init__(self, message: str, *, resumable: bool) -> None:
        super().__init__(message)
        self.resumable = resumable


class ScriptError(Exception):
    """A script threw or does not parse; the text says what and where."""


class _Value(ctypes.Structure):
    """What the library says a JavaScript value to be."""

    _fields_: ClassVar = [("data", c_uint64), ("size", c_size_t), ("kind", c_uint8)]
    data: int
    """For a text, an error or a buffer: the address of its bytes."""
    size: int
    kind: int


_TEXT, _BUFFER, _OUT_OF_MEMORY = 5, 102, 202
_ERRORS = {
    200: "Unknown JavaScript error during execution",
    201: "Unknown JavaScript error during parse",
    204: "JavaScript was terminated",
    205: "Bad value passed to JavaScript engine",
    206: "No such key found in object",
}
"""Kinds of values that tell of an error, and what it is where they have no text."""

_NOTHING = "(() => 0)()"

_CALLBACK = ctypes.CFUNCTYPE(None, c_uint64, c_void_p)
_CONTEXT, _TASK, _NUMBER, _HANDLE = c_uint64, c_uint64, c_uint64, c_void_p
_FUNCTIONS = {
    "mr_init_v8": (None, c_char_p, c_char_p),
    "mr_init_context": (_CONTEXT, _CALLBACK),
    "mr_free_context": (None, _CONTEXT),
    "mr_set_hard_memory_limit": (None, _CONTEXT, c_size_t),
    "mr_alloc_string_val": (_HANDLE, _CONTEXT, c_char_p, c_uint64, c_uint8),
    "mr_free_value": (None, _CONTEXT, _HANDLE),
    "mr_eval": (_TASK, _CONTEXT, _HANDLE, _NUMBER),
    "mr_cancel_task": (None, _CONTEXT, _TASK),
}
"""What each gives and takes."""


@functools.cache
def library_path() -> Path:
    """The library's file, found without importing mini-racer.

    Raises:
        EffectError: that is not there.
    """
    found = importlib.util.find_spec("py_mini_racer")
    if found is None or found.origin is None:
        raise EffectError("mini-racer is not installed for this Python", help=_HELP)
    return Path(found.origin).with_name(_FILES.get(sys.platform, "libmini_racer.so"))


@functools.cache
def library() -> ctypes.CDLL:
    """The library, loaded into this process; nothing of it has run.

    Raises:
        EffectError: it is not there, or not the one that this module was written for.
    """
    path = library_path()
    version = package_version("mini-racer")
    if version not in (VERSION, "none"):
        raise EffectError(f"mini-racer is {version}, and has to be {VERSION}", help=_HELP)
    try:
        loaded = ctypes.CDLL(str(path))
        for name, (gives, *takes) in _FUNCTIONS.items():
            function = getattr(loaded, name)
            function.restype, function.argtypes = gives, takes
    except (OSError, AttributeError) as error:
        raise EffectError(f"mini-racer's V8 cannot be used: {error}", help=_HELP) from None
    return loaded


class Context:
    """A JavaScript context of its own, for one thread at a time; others may stop what runs.

    V8 has to be started before one is made.
    """

    def __init__(self, memory: int) -> None:
        """`memory`: how many bytes JavaScript's objects may take."""
        self._library = library()
        self._memory = memory
        self._results: SimpleQueue[tuple[int, int | None]] = SimpleQueue()
        put = self._results.put
        # Called in V8's thread, which does nothing else meanwhile. It has to live as long as V8.
        self._callback = _CALLBACK(lambda number, value: put((number, value)))
        self._turn = threading.RLock()
        """Held while a task runs."""
        self._state = threading.Lock()
        """Held while the following are looked at or changed."""
        self._number = 0
        self._task: int | None = None
        self._was_ended = self._stops_next = self._is_closed = False
        self._id: int = self._library.mr_init_context(self._callback)
        self._library.mr_set_hard_memory_limit(self._id, memory)

    def evaluate(self, code: str, seconds: float) -> str | None:
        """Run a script; its value where that is a text.

        Raises:
            LimitError: it was ended after so many seconds, or when it took too much memory.
            ScriptError: it threw.
            StoppedError: it was ended by `stop`.
        """
        with self._turn:
            address = self._run(code, seconds)
            try:
                value = self._checked(address)
                if value.kind != _TEXT:
                    return None
                return _bytes(value).decode("utf-8", "surrogatepass")
            finally:
                self._free(address)

    def fill(self, code: str, data: bytes, seconds: float) -> None:
        """Copy bytes into the ArrayBuffer of their length that is a script's value.

        Raises:
            TypeError: its value is something else; and what `evaluate` raises.
        """
        with self._turn:
            address = self._run(code, seconds)
            try:
                value = self._checked(address)
                if value.kind != _BUFFER or value.size != len(data):
                    raise TypeError(f"no ArrayBuffer of {len(data)} bytes: {code}")
                if data:
                    ctypes.memmove(value.data, data, len(data))
            finally:
                self._free(address)

    def stop(self) -> None:
        """From another thread: end what runs, or else what runs next, by a `StoppedError` there."""
        with self._state:
            self._stops_next = self._task is None
            self._end_task()

    def close(self) -> None:
        """End what runs, and free all memory; the context cannot be used any more."""
        with self._state:
            if self._is_closed:
                return
            self._is_closed = True
            self._end_task()
        with self._turn:
            self._library.mr_free_context(self._id)

    def _end_task(self) -> None:
        task = self._task
        if task is not None:
            self._was_ended = True
            # First, so that who waits hears of this, and not of what V8 makes of the end.
            self._results.put((self._number, None))
            self._library.mr_cancel_task(self._id, task)

    def _run(self, code: str, seconds: float) -> int:
        """The address of a script's value, to be freed."""
        try:
            with self._state:
                if self._is_closed:
                    raise RuntimeError("the context is closed")
                if self._stops_next:
                    self._stops_next = False
                    raise StoppedError
                if self._was_ended:
                    # It may have come to its own end just before. Then V8 would end the next one.
                    self._begin(_NOTHING)
                    self._was_ended = False
                self._task = self._begin(code)
            address = self._result(self._number, seconds)
        except BaseException:  # it is late, or this thread is interrupted
            with self._state:
                task, self._task = self._task, None
                if task is not None:
                    self._was_ended = True
                    self._library.mr_cancel_task(self._id, task)
            raise
        with self._state:
            self._task = None
            ended = self._was_ended
        if ended:  # by `stop`, when the value was on its way
            self._free(address)
            raise StoppedError
        return address

    def _begin(self, code: str) -> int:
        """Hand over a script, under the next number; the task."""
        text = code.encode()
        source = self._library.mr_alloc_string_val(self._id, text, len(text), _TEXT)
        try:
            self._number += 1
            task: int = self._library.mr_eval(self._id, source, self._number)
            return task
        finally:
            self._free(source)

    def _result(self, number: int, seconds: float) -> int:
        """Wait for the value of a task."""
        end = time.monotonic() + seconds
        while True:
            try:
                found, value = self._results.get(timeout=max(0.0, end - time.monotonic()))
            except Empty:
                raise LimitError(f"ran for more than {seconds:g} s", resumable=True) from None
            if found != number:
                self._free(value)
            elif value is None:
                raise StoppedError
            else:
                return value

    def _free(self, value: int | None) -> None:
        if value is not None:
            self._library.mr_free_value(self._id, value)

    def _checked(self, address: int) -> _Value:
        """The value at an address, unless it tells of an error."""
        value = _Value.from_address(address)
        if value.kind == _OUT_OF_MEMORY:
            raise LimitError(f"took more than {self._memory >> 20} MiB", resumable=False)
        if value.kind in _ERRORS:
            raise ScriptError(_bytes(value).decode("utf-8", "replace") or _ERRORS[value.kind])
        return value


def _bytes(value: _Value) -> bytes:
    return ctypes.string_at(value.data, value.size)
