"""MuJoCo's warnings, heard as they are raised, while everything else is as if nobody heard them.

Entry point: `Warnings`, once MuJoCo has been imported.

1. The library's handler of warnings is set to one of ours, as long as the script sets none. It
   writes what MuJoCo would have written, where MuJoCo would have, but for `MUJOCO_LOG.TXT`. A step
   costs nothing more for it.
2. A handler that the script sets is called after ours, and is what the script finds set.

Ours may be called in any thread, also in one of MuJoCo's own: nothing that it does may fail.
"""

from __future__ import annotations

import ctypes
import posix
from collections.abc import Callable
from typing import Any

from coursebuild.core.run import mujoco_tracing


class Warnings:
    """Tells `heard` of the text of each warning."""

    def __init__(self, mujoco: Any, heard: Callable[[str], None]) -> None:
        self._mujoco = mujoco
        self._heard = heard
        self._theirs: Callable[[str], object] | None = None
        """The handler that the script has set."""
        self._pointer: Any = None
        """The library's handler."""
        self._ours: object = None
        self._print: Callable[[bytes], object] = _to_standard_error

    def install(self) -> None:
        """Set our handler, where this MuJoCo lets us, and see to it that it stays."""
        try:
            library = ctypes.PyDLL(self._mujoco._functions.__file__)
            pointer = ctypes.c_void_p.in_dll(library, "mju_user_warning")
        except (AttributeError, OSError, ValueError):
            return
        if pointer.value is not None:  # somebody's that was set when MuJoCo was imported
            return
        if not hasattr(library, "mju_setLogHandler"):  # before MuJoCo 3.10
            self._print = _to_standard_output()
        self._ours = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(self._raised)
        self._pointer = pointer
        pointer.value = self._address = ctypes.cast(self._ours, ctypes.c_void_p).value
        self._set, self._get = self._mujoco.set_mju_user_warning, self._mujoco.get_mju_user_warning
        for real, new in ((self._set, self._set_handler), (self._get, self._get_handler)):
            wrapper = mujoco_tracing.wrapped(new, like=real)
            mujoco_tracing.replace_function(self._mujoco, real.__name__, wrapper)

    def _raised(self, message: bytes) -> None:
        """A warning is raised, and the script has no handler."""
        try:
            self._print(message)
            self._heard(message.decode("utf-8", "replace"))
        except Exception:  # nobody would see it, in the middle of a step
            pass

    def _both(self, message: str) -> object:
        """A warning is raised, and the script has a handler."""
        self._heard(message)
        return self._theirs(message) if self._theirs is not None else None

    def _set_handler(self, *args: Any, **keywords: Any) -> None:
        theirs = args[0] if len(args) == 1 and not keywords else None
        if callable(theirs) and not hasattr(theirs, "restype"):  # not a function in C
            self._set(self._both)
            self._theirs = theirs
            return
        try:
            self._set(*args, **keywords)
        except BaseException as error:
            if error.__traceback__ is not None:
                error.__traceback__ = error.__traceback__.tb_next
            raise
        self._theirs = None
        if self._pointer.value is None:
            self._pointer.value = self._address

    def _get_handler(self, *args: Any, **keywords: Any) -> Any:
        found = self._get(*args, **keywords)
        return self._theirs if found == self._both else found


def _to_standard_error(message: bytes) -> object:
    return posix.write(2, b"WARNING: " + message + b"\n\n")


def _to_standard_output() -> Callable[[bytes], object]:
    """As MuJoCo did, through the buffers of the C library."""
    write = ctypes.PyDLL(None).printf
    return lambda message: write(b"WARNING: %s\n\n", message)
