"""Ctrl-C and SIGTERM as exceptions, raised wherever the command is at the moment.

Entry point: `signals_as_exceptions`, a context manager.

There are places where such an exception must not be raised, or where it is lost:

1. A function that msgspec's C code calls to inspect a type: if it raises, the process ends with a
   segmentation fault.
2. An import: a module in C, such as MuJoCo's, fails to load or ignores the exception; and imports
   and `logging` hold locks that they would not release.
3. Functions that Python itself calls, when an object is deleted or a process was forked: Python
   drops exceptions there, and goes on.

There the signal is sent again a moment later. Also, a library in C, such as MuJoCo's, may turn the
exception into another; then the original one is raised in its place.
"""

from __future__ import annotations

import _thread
import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from types import FrameType
from typing import Any

_DELAY = 0.01
"""Seconds until a signal is sent again."""
_IMPORT = "<frozen importlib."
_LOGGING = "logging/__init__.py"


_command_frames: list[FrameType] = []
"""The frame that called `signals_as_exceptions`; its own callers do not matter."""
_raised_types: list[type[KeyboardInterrupt]] = []
"""The types of the exceptions raised since."""


class Terminated(KeyboardInterrupt):
    """SIGTERM: what the process has begun is cleaned up, as after Ctrl-C."""


@contextlib.contextmanager
def signals_as_exceptions(*, alone: bool = False) -> Iterator[None]:
    """Raise `Terminated` or `KeyboardInterrupt` when one of the signals comes.

    In another thread than the main one, this does nothing. Where Ctrl-C is ignored, it stays so.
    `alone`: the process ends after this, and then ignores the signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    default_hook = sys.unraisablehook
    _command_frames.append(sys._getframe(2))  # beyond `contextlib`

    def send_dropped_again(unraisable: Any) -> None:
        kind = unraisable.exc_type
        if issubclass(kind, KeyboardInterrupt):
            _send_later(signal.SIGTERM if kind is Terminated else signal.SIGINT)
        else:
            default_hook(unraisable)

    before = {signal.SIGTERM: signal.signal(signal.SIGTERM, _handle_signal)}
    if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_DFL):
        before[signal.SIGINT] = signal.signal(signal.SIGINT, _handle_signal)
    sys.unraisablehook = send_dropped_again
    try:
        yield
    except Exception as error:
        if _raised_types:
            raise _raised_types[-1] from error
        raise
    finally:
        sys.unraisablehook = default_hook
        _command_frames.clear()
        _raised_types.clear()
        if alone:
            _ignore_signals(before)
        else:
            for number, handler in before.items():
                signal.signal(number, handler)


def _handle_signal(number: int, frame: FrameType | None) -> None:
    if _is_unsafe(frame):
        _send_later(number)
    else:
        _raised_types.append(Terminated if number == signal.SIGTERM else KeyboardInterrupt)
        raise _raised_types[-1]


def _ignore_signals(numbers: Iterable[signal.Signals]) -> None:
    """Ignore signals for the rest of this process, which ends with the status of its command.

    Otherwise Python would end by SIGINT, after a `KeyboardInterrupt` that has passed through an
    `exec` of a text.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    for number in numbers:  # the mask is that of this thread only
        signal.signal(number, signal.SIG_IGN)


def _is_unsafe(frame: FrameType | None) -> bool:
    """Whether no exception may be raised in this frame."""
    if frame is not None and frame.f_code.co_filename.endswith(_LOGGING):
        return True
    msgspec = os.path.dirname(getattr(sys.modules.get("msgspec"), "__file__", None) or "?")  # noqa: PTH120
    outermost = _command_frames[0] if _command_frames else None
    while frame is not None and frame is not outermost:
        file = frame.f_code.co_filename
        if file.startswith((_IMPORT, msgspec + os.sep)):
            return True
        frame = frame.f_back
    return False


def _send_later(number: int) -> None:
    # Not by `threading`: the main thread may hold one of its locks.
    _thread.start_new_thread(_send, (number,))


def _send(number: int) -> None:
    time.sleep(_DELAY)
    if signal.getsignal(number) is not _handle_signal:  # the command has ended
        return
    main_thread = threading.main_thread().ident
    assert main_thread is not None
    signal.pthread_kill(main_thread, number)  # which also interrupts what it waits for
