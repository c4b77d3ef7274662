"""Observe MuJoCo's warnings as they are raised, without any other effect on the script.

Entry point: `Warnings`, once MuJoCo has been imported.

MuJoCo's handler of warnings is ours, and a step does not become slower. It calls the handler that
the script has set, which is the only one that the script sees; or else writes what MuJoCo would
have written, in the same place, except for `MUJOCO_LOG.TXT`.

Our handler may be called in any thread, also in MuJoCo's own.
"""

from __future__ import annotations

import posix
from collections.abc import Callable
from typing import Any

from coursebuild.core.run import mujoco_tracing


class Warnings:
    """Calls `on_warning`, which must never fail, with the text of each warning."""

    def __init__(self, mujoco: Any, on_warning: Callable[[str], None]) -> None:
        self._on_warning = on_warning
        self._script_handler: Callable[[str], object] | None = None
        """The handler that the script has set."""
        self._set, self._get = mujoco.set_mju_user_warning, mujoco.get_mju_user_warning
        if self._get() is not None:  # set when MuJoCo was imported
            return
        self._set(self._handle)
        for real, new in ((self._set, self._set_handler), (self._get, self._get_handler)):
            wrapper = mujoco_tracing.wrap_function(new, like=real)
            mujoco_tracing.replace_function(mujoco, real.__name__, wrapper)

    def _handle(self, message: str) -> object:
        self._on_warning(message)
        if self._script_handler is not None:
            return self._script_handler(message)
        return posix.write(2, f"WARNING: {message}\n\n".encode("utf-8", "replace"))

    def _set_handler(self, *args: Any, **keywords: Any) -> None:
        handler = args[0] if len(args) == 1 and not keywords else None
        ours = callable(handler) and not hasattr(handler, "restype")  # not a function in C
        try:
            self._set(*((self._handle,) if ours else args), **keywords)
        except BaseException as error:
            if error.__traceback__ is not None:
                error.__traceback__ = error.__traceback__.tb_next
            raise
        self._script_handler = handler if ours else None
        if self._get() is None:
            self._set(self._handle)

    def _get_handler(self, *args: Any, **keywords: Any) -> Any:
        handler = self._get(*args, **keywords)
        return self._script_handler if handler == self._handle else handler
