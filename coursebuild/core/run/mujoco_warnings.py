"""Observe MuJoCo's warnings as they are raised, without any other effect on the script.

Entry point: `Warnings`, once MuJoCo has been imported.

1. As long as the script sets no handler of warnings, the library has one of ours. It writes what
   MuJoCo would have written, in the same place, except for `MUJOCO_LOG.TXT`. A step does not become
   slower.
2. A handler that the script sets is called after ours; the script sees only its own.

Our handler may be called in any thread, also in MuJoCo's own: it must never fail.
"""

from __future__ import annotations

import ctypes
import posix
from collections.abc import Callable
from typing import Any

from coursebuild.core.run import mujoco_tracing


class Warnings:
    """Calls `on_warning` with the text of each warning."""

    def __init__(self, mujoco: Any, on_warning: Callable[[str], None]) -> None:
        self._mujoco = mujoco
        self._on_warning = on_warning
        self._script_handler: Callable[[str], object] | None = None
        """The handler that the script has set."""
        self._pointer: Any = None
        """The library's handler."""
        self._our_handler: object = None
        self._print: Callable[[bytes], object] = _to_standard_error

    def install(self) -> None:
        """Set our handler, where this MuJoCo allows it, and keep it set."""
        try:
            library = ctypes.PyDLL(self._mujoco._functions.__file__)
            pointer = ctypes.c_void_p.in_dll(library, "mju_user_warning")
        except (AttributeError, OSError, ValueError):
            return
        if pointer.value is not None:  # another handler, set when MuJoCo was imported
            return
        if not hasattr(library, "mju_setLogHandler"):  # before MuJoCo 3.10
            self._print = _to_standard_output()
        self._our_handler = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(self._print_warning)
        self._pointer = pointer
        pointer.value = self._address = ctypes.cast(self._our_handler, ctypes.c_void_p).value
        self._set, self._get = self._mujoco.set_mju_user_warning, self._mujoco.get_mju_user_warning
        for real, new in ((self._set, self._set_handler), (self._get, self._get_handler)):
            wrapper = mujoco_tracing.wrap_function(new, like=real)
            mujoco_tracing.replace_function(self._mujoco, real.__name__, wrapper)

    def _print_warning(self, message: bytes) -> None:
        """Handle a warning where the script has set no handler."""
        try:
            self._print(message)
            self._on_warning(message.decode("utf-8", "replace"))
        except Exception:  # nobody would see it, in the middle of a step
            pass

    def _pass_to_script(self, message: str) -> object:
        """Handle a warning where the script has set a handler."""
        self._on_warning(message)
        return self._script_handler(message) if self._script_handler is not None else None

    def _set_handler(self, *args: Any, **keywords: Any) -> None:
        handler = args[0] if len(args) == 1 and not keywords else None
        if callable(handler) and not hasattr(handler, "restype"):  # not a function in C
            self._set(self._pass_to_script)
            self._script_handler = handler
            return
        try:
            self._set(*args, **keywords)
        except BaseException as error:
            if error.__traceback__ is not None:
                error.__traceback__ = error.__traceback__.tb_next
            raise
        self._script_handler = None
        if self._pointer.value is None:
            self._pointer.value = self._address

    def _get_handler(self, *args: Any, **keywords: Any) -> Any:
        handler = self._get(*args, **keywords)
        return self._script_handler if handler == self._pass_to_script else handler


def _to_standard_error(message: bytes) -> object:
    return posix.write(2, b"WARNING: " + message + b"\n\n")


def _to_standard_output() -> Callable[[bytes], object]:
    """A function that prints as MuJoCo did, through the buffers of the C library."""
    write = ctypes.PyDLL(None).printf
    return lambda message: write(b"WARNING: %s\n\n", message)
