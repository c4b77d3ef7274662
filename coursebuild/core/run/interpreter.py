"""Which script this interpreter is about to run: found in its configuration, and changed there.

Entry point: `Interpreter`.

A Python that has started and not yet come to its script holds the script's path and arguments in
its `PyConfig`. The functions that set these are public; where in the structure they are is not, and
differs between versions, so it is found out: the process was started with a path that occurs
nowhere else, and the pointers that lead to it are the ones. After that everything, from reading the
file to the traceback and the exit status, is Python's own doing.

Source: PEP 587, "Python Initialization Configuration".
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
from collections.abc import Iterator, Sequence

_CONFIG_BYTES = 2048
"""More than `PyConfig` takes."""
_STATE_BYTES = 1 << 20
"""More than the interpreter's state takes, of which it is a part."""
_POINTER = ctypes.sizeof(ctypes.c_void_p)


class _Status(ctypes.Structure):
    """`PyStatus`."""

    _fields_ = (
        ("kind", ctypes.c_int),
        ("function", ctypes.c_char_p),
        ("message", ctypes.c_char_p),
        ("exitcode", ctypes.c_int),
    )


class UnknownInterpreterError(Exception):
    """This Python keeps its configuration somewhere else."""


class Interpreter:
    """This process, before it has come to its script.

    Raises:
        UnknownInterpreterError: where the script's path is kept was not found.
    """

    def __init__(self) -> None:
        placeholder, count = sys.orig_argv[-len(sys.argv)], len(sys.argv)
        with _Memory() as memory:
            found = None
            for start, size in _places():
                found = memory.find(start, size, placeholder, count)
                if found is not None:
                    break
        if found is None:
            raise UnknownInterpreterError("its configuration was not found")
        config, path, argv = found
        api = ctypes.pythonapi
        api.PyConfig_SetString.restype = _Status
        api.PyConfig_SetWideStringList.restype = _Status
        self._set_path = functools.partial(
            api.PyConfig_SetString, ctypes.c_void_p(config), ctypes.c_void_p(path)
        )
        self._set_argv = functools.partial(
            api.PyConfig_SetWideStringList, ctypes.c_void_p(config), ctypes.c_void_p(argv)
        )

    def become(self, path: str, argv: Sequence[str]) -> None:
        """Let this process run the script at an absolute path when it comes to that."""
        items = (ctypes.c_wchar_p * len(argv))(*argv)
        for done in (
            self._set_path(ctypes.c_wchar_p(path)),
            self._set_argv(ctypes.c_ssize_t(len(argv)), items),
        ):
            if done.kind:
                raise MemoryError(done.message)
        sys.argv = list(argv)
        sys.orig_argv = [sys.orig_argv[0], *argv]


def _places() -> Iterator[tuple[int, int]]:
    """Where the configuration may be: address and size in bytes."""
    api = ctypes.pythonapi
    api.PyInterpreterState_Get.restype = ctypes.c_void_p
    state = api.PyInterpreterState_Get()
    try:
        get = api._PyInterpreterState_GetConfig
    except AttributeError:
        pass
    else:
        get.restype = ctypes.c_void_p
        yield get(ctypes.c_void_p(state)), _CONFIG_BYTES
    yield state, _STATE_BYTES


class _Memory:
    """Reads this process's memory: an address that is none is an error and no crash."""

    def __enter__(self) -> _Memory:
        self._libc = ctypes.CDLL(None, use_errno=True)
        self._read, self._write = os.pipe()
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._read)
        os.close(self._write)

    def peek(self, address: int, size: int) -> bytes:
        """What is there; empty where nothing is. At most what a pipe holds (4 kB)."""
        count = self._libc.write(self._write, ctypes.c_void_p(address), ctypes.c_size_t(size))
        return os.read(self._read, count) if count > 0 else b""

    def find(
        self, start: int, size: int, placeholder: str, count: int
    ) -> tuple[int, int, int] | None:
        """The start, and the addresses of the script's path and of the list of arguments."""
        wide = bytes(ctypes.create_unicode_buffer(placeholder))
        path = argv = 0
        before = 0
        for offset in range(0, size, 4096):
            page = self.peek(start + offset, min(4096, size - offset))
            for i, word in enumerate(memoryview(page[: len(page) & -_POINTER]).cast("P")):
                here = start + offset + i * _POINTER
                if word >= 1 << 16 and word % 4 == 0:
                    if not path and self.peek(word, len(wide)) == wide:
                        path = here
                    elif not argv and before == count:
                        first = int.from_bytes(self.peek(word, _POINTER), sys.byteorder)
                        if first and self.peek(first, len(wide)) == wide:
                            argv = here - _POINTER
                if path and argv:
                    return start, path, argv
                before = word
            if not page:
                return None
        return None
