"""Ctrl-C and SIGTERM as exceptions, which come wherever the command is at the moment.

Entry point: `heeded`, a context manager.

There are places that such an exception must not come to, or where it is lost:

1. A function that msgspec's C code calls, to learn what a type has in it: where that raises, the
   process ends with a segmentation fault.
2. An import: of a module in C, such as MuJoCo's, that cannot begin, nothing can be said but that,
   or it goes on as if nothing had come; and what imports and `logging` do between taking a lock and
   giving it back.
3. What Python calls by itself, when an object goes or a process was forked: it drops what is raised
   there, and goes on.

From there the signal comes again a moment later. And a library in C, such as MuJoCo's, may make
another exception of it, which is made into the one that it was.
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

_AGAIN = 0.01
"""Seconds until a signal comes again."""
_IMPORT = "<frozen importlib."
_NOT_IN = "logging/__init__.py"


_own: list[FrameType] = []
"""The caller of `heeded`; what has called that does not matter."""
_raised: list[type[KeyboardInterrupt]] = []
"""What was raised since."""


class Terminated(KeyboardInterrupt):
    """Somebody asked this process to end: what it has begun is cleaned up, as after Ctrl-C."""


@contextlib.contextmanager
def heeded(*, alone: bool = False) -> Iterator[None]:
    """Raise `Terminated` or `KeyboardInterrupt` where one of the signals comes.

    Nothing is changed in another thread than the main one. Ctrl-C stays without effect where it
    was. `alone`: the process ends with this; a signal that comes so late changes nothing any more.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    drop = sys.unraisablehook
    _own.append(sys._getframe(2))  # beyond `contextlib`

    def dropped(unraisable: Any) -> None:
        kind = unraisable.exc_type
        if issubclass(kind, KeyboardInterrupt):
            _come_again(signal.SIGTERM if kind is Terminated else signal.SIGINT)
        else:
            drop(unraisable)

    before = {signal.SIGTERM: signal.signal(signal.SIGTERM, _hear)}
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        before[signal.SIGINT] = signal.signal(signal.SIGINT, _hear)
    sys.unraisablehook = dropped
    try:
        yield
    except Exception as error:
        if _raised:
            raise _raised[-1] from error
        raise
    finally:
        sys.unraisablehook = drop
        _own.clear()
        _raised.clear()
        if alone:
            _hear_no_more(before)
        else:
            for number, handler in before.items():
                signal.signal(number, handler)


def _hear(number: int, frame: FrameType | None) -> None:
    if _must_wait(frame):
        _come_again(number)
    else:
        _raised.append(Terminated if number == signal.SIGTERM else KeyboardInterrupt)
        raise _raised[-1]


def _hear_no_more(numbers: Iterable[signal.Signals]) -> None:
    """For the rest of this process, which has a status to end with.

    After a `KeyboardInterrupt` that went through an `exec` of a text Python would kill itself by
    SIGINT in its place.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    for number in numbers:  # other threads do not block them
        signal.signal(number, signal.SIG_IGN)


def _must_wait(frame: FrameType | None) -> bool:
    """Whether an exception must not come here."""
    if frame is not None and frame.f_code.co_filename.endswith(_NOT_IN):
        return True
    msgspec = os.path.dirname(getattr(sys.modules.get("msgspec"), "__file__", None) or "?")  # noqa: PTH120
    began = _own[0] if _own else None
    while frame is not None and frame is not began:
        file = frame.f_code.co_filename
        if file.startswith((_IMPORT, msgspec + os.sep)):
            return True
        frame = frame.f_back
    return False


def _come_again(number: int) -> None:
    # Without `threading`, of whose locks the main thread may hold one.
    _thread.start_new_thread(_send, (number,))


def _send(number: int) -> None:
    time.sleep(_AGAIN)
    if signal.getsignal(number) is not _hear:  # the command is through
        return
    main = threading.main_thread().ident
    assert main is not None
    signal.pthread_kill(main, number)  # which ends what it waits for
