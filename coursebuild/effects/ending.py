"""The end of a forked script's interpreter, without the part that nobody would see.

Entry point: `Ending`.

Before it exits Python gives all its memory back, object by object. In a process that shares its
memory with others, that means copying what is then thrown away, and takes as long as a short
script does. So where a script has come to its end in the ordinary way, with status 0, the process
leaves once threads have ended, exit functions have run, modules and their objects were finalized
and streams flushed. Otherwise Python exits as always, because only it knows the status.
"""

from __future__ import annotations

import ctypes
import sys

from coursebuild.effects.preload import Finder
from coursebuild.effects.tracing import Tracer

_STREAMS = ("stdout", "stderr")


class Ending:
    """Sees how a script, whose text this is, ends, and may end the process."""

    def __init__(self, finder: Finder, tracer: Tracer, script: bytes) -> None:
        self._finder = finder
        self._tracer = tracer
        self._told = b"__cached__" not in script
        """Whether the script leaves alone what tells of its end."""
        self._streams = tuple(getattr(sys, name) for name in _STREAMS)
        self._normal = False
        libc = ctypes.PyDLL(None)
        # At the end there are no builtins any more, which looking up a function would need.
        self._exit, self._write_out, self._vanish = libc.exit, libc.fflush, libc._exit

    def check(self) -> None:
        """The last exit function: whether the script ran to its end.

        Python gives the script's module the names `__file__` and `__cached__`, and takes them away
        when it has run, unless a SystemExit ended it; of another exception it keeps `last_type`.
        """
        self._finder.withdraw()
        names = getattr(sys.modules.get("__main__"), "__dict__", {})
        self._normal = (
            self._told
            and type(names.get("__loader__")).__name__ == "SourceFileLoader"
            and not names.keys() & {"__file__", "__cached__"}
            and not any(hasattr(sys, name) for name in ("last_type", "last_value", "last_exc"))
            and self._streams == tuple(getattr(sys, name, None) for name in _STREAMS)
            and self._flushed()
        )

    def leave(self) -> None:
        """Exit, if the status is known; native code that the script loaded sees it."""
        if self._normal and self._flushed():
            if self._tracer.native:
                self._exit(0)
            self._write_out(None)
            self._vanish(0)

    def _flushed(self) -> bool:
        """Write out what the script has printed; `False` where Python will have to complain."""
        try:
            for stream in self._streams:
                stream.flush()
        except (OSError, ValueError):
            return False
        return True
