"""Work spread over forked copies of this process.

Entry points: `Pool`, a context manager; `can_fork`, whether there can be any copies.

1. A copy is forked with all that this process has read and imported, and answers one request at a
   time with the function that it was made with. What it remembers from one request to the next
   stays in it.
2. `run` hands each request to the copy that is named for it, or to the first that is free, and
   gives the answers in the order of the requests, whatever the copies' timing.
3. What a copy did not answer, because it died, is answered here. What the function raises in a
   copy is raised here.
4. The copies are killed when the work is over, however it ends. They have nothing to save, and
   where this process is killed they see it and end.
"""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import selectors
import signal
import struct
import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, Generic, NoReturn, Self, TypeVar

from coursebuild.values import dataclass, field

Ask = TypeVar("Ask")
Answer = TypeVar("Answer")

_LENGTH = struct.Struct("<Q")
_UNFORKABLE = ("py_mini_racer", "mujoco")
"""Libraries whose threads do not come along into a copy."""


def can_fork() -> bool:
    """Whether this process can be copied: it has one thread, and nothing that a copy breaks."""
    if not hasattr(os, "fork") or sys.platform == "darwin":
        return False
    return threading.active_count() == 1 and not any(name in sys.modules for name in _UNFORKABLE)


@dataclass(eq=False, slots=True)
class _Copy:
    process: int
    requests: int
    answers: int
    """File descriptors."""
    buffer: bytearray = field(default_factory=bytearray)
    busy: int | None = None
    """The number of the request that it works on."""


class Pool(Generic[Ask, Answer]):
    """Forked processes that all answer with the same function, or none."""

    def __init__(
        self,
        answer: Callable[[Ask], Answer],
        count: int,
        begin: Callable[[], None] = lambda: None,
    ) -> None:
        """Fork `count` copies now; with none, or where that fails, all is answered here.

        `begin` is called in each copy before its first request.
        """
        self._answer = answer
        self._begin = begin
        self._copies: list[_Copy | None] = []
        try:
            gc.freeze()  # what there is now is not looked through in the copies
            for _ in range(count):
                self._copies.append(self._fork())
        except OSError:  # no room for another process
            pass
        except BaseException:
            self.close()
            raise
        finally:
            gc.unfreeze()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def count(self) -> int:
        """How many copies there were at the beginning."""
        return len(self._copies)

    def run(
        self, requests: Sequence[tuple[int | None, Ask]]
    ) -> tuple[list[Answer], list[int | None]]:
        """The answers, in the order of the requests, and which copy gave each.

        A request comes with the number of the copy that should answer it, if any.
        """
        work = _Work(requests, len(self._copies))
        with selectors.DefaultSelector() as selector:
            for number, copy in enumerate(self._copies):
                if copy is not None:
                    selector.register(copy.answers, selectors.EVENT_READ, number)
                    self._next(work, number)
            while any(copy is not None and copy.busy is not None for copy in self._copies):
                for key, _ in selector.select():
                    number = key.data
                    copy = self._copies[number]
                    if copy is None:
                        continue
                    if self._read(work, number, copy):
                        if copy.busy is None:
                            self._next(work, number)
                    else:
                        selector.unregister(copy.answers)
                        self._lose(number)
        for index, request in enumerate(requests):
            if index not in work.answers:
                work.answers[index] = (self._answer(request[1]), None)
        found = [work.answers[index] for index in range(len(requests))]
        return [answer for answer, _ in found], [number for _, number in found]

    def close(self) -> None:
        """End them."""
        for number in range(len(self._copies)):
            self._lose(number)

    def _next(self, work: _Work, number: int) -> None:
        copy = self._copies[number]
        index = work.next(number)
        if copy is None or index is None:
            return
        data = pickle.dumps(work.requests[index][1], pickle.HIGHEST_PROTOCOL)
        copy.busy = index
        with contextlib.suppress(OSError):  # it is dead, as reading from it will show
            _write(copy.requests, data)

    def _read(self, work: _Work, number: int, copy: _Copy) -> bool:
        """Take what it wrote; false where it has ended."""
        try:
            part = os.read(copy.answers, 1 << 20)
        except OSError:
            part = b""
        if not part:
            return False
        buffer = copy.buffer
        buffer += part
        if len(buffer) >= _LENGTH.size:
            end = _LENGTH.size + _LENGTH.unpack_from(buffer)[0]
            if len(buffer) >= end and copy.busy is not None:
                good, value = pickle.loads(bytes(buffer[_LENGTH.size : end]))
                if not good:
                    raise value
                work.answers[copy.busy] = (value, number)
                copy.busy = None
                copy.buffer = bytearray()
        return True

    def _lose(self, number: int) -> None:
        copy, self._copies[number] = self._copies[number], None
        if copy is None:
            return
        for fd in (copy.requests, copy.answers):
            with contextlib.suppress(OSError):
                os.close(fd)
        with contextlib.suppress(OSError):
            os.kill(copy.process, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(copy.process, 0)

    def _fork(self) -> _Copy:
        inward, requests = os.pipe()
        answers, outward = os.pipe()
        try:
            process = os.fork()
        except OSError:
            for fd in (inward, requests, answers, outward):
                os.close(fd)
            raise
        if process == 0:
            _serve(self._begin, self._answer, inward, outward)
        os.close(inward)
        os.close(outward)
        return _Copy(process, requests, answers)


class _Work:
    """Requests that are still to be answered, and the answers."""

    def __init__(self, requests: Sequence[tuple[int | None, Any]], count: int) -> None:
        self.requests = requests
        self.answers: dict[int, tuple[Any, int | None]] = {}
        self._own: list[deque[int]] = [deque() for _ in range(count)]
        self._free: deque[int] = deque()
        for index, (number, _) in enumerate(requests):
            queue = self._own[number] if number is not None and number < count else self._free
            queue.append(index)

    def next(self, number: int) -> int | None:
        """The next request for a copy."""
        for queue in (self._own[number], self._free):
            if queue:
                return queue.popleft()
        return None


def _serve(
    begin: Callable[[], None], answer: Callable[[Any], Any], inward: int, outward: int
) -> NoReturn:
    """What a copy does until its input ends."""
    status = 1
    try:
        # Ctrl-C is for the process that has forked it, which ends it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        _close_others(inward, outward)
        begin()
        while (data := _read(inward)) is not None:
            try:
                reply = pickle.dumps((True, answer(pickle.loads(data))), pickle.HIGHEST_PROTOCOL)
            except BaseException as error:
                error.add_note(f"in a copy of this process:\n{traceback.format_exc()}")
                reply = _failure(error)
            _write(outward, reply)
        status = 0
    finally:
        os._exit(status)


def _failure(error: BaseException) -> bytes:
    try:
        data = pickle.dumps((False, error), pickle.HIGHEST_PROTOCOL)
        pickle.loads(data)
    except Exception:
        text = f"{type(error).__name__}: {error}"
        return pickle.dumps((False, RuntimeError(text)), pickle.HIGHEST_PROTOCOL)
    return data


def _close_others(*kept: int) -> None:
    """Close what locks and other copies are held by, lest this one outlive its parent with them."""
    start = 3
    for fd in sorted(kept):
        os.closerange(start, fd)
        start = fd + 1
    os.closerange(start, 1 << 16)


def _write(fd: int, data: bytes) -> None:
    rest = memoryview(_LENGTH.pack(len(data)) + data)
    while rest:
        rest = rest[os.write(fd, rest) :]


def _read(fd: int) -> bytes | None:
    head = _exactly(fd, _LENGTH.size)
    return None if head is None else _exactly(fd, _LENGTH.unpack(head)[0])


def _exactly(fd: int, size: int) -> bytes | None:
    data = bytearray()
    while len(data) < size:
        part = os.read(fd, size - len(data))
        if not part:
            return None
        data += part
    return bytes(data)
