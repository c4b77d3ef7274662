"""Work spread over forked copies of this process.

Entry points: `Pool`, a context manager; `can_fork`, whether there can be any copies; `beside`, for
one thing that is made in a copy while this process goes on.

1. A copy is forked with all that this process has read and imported, and answers one request at a
   time with the function that it was made with. What it remembers from one request to the next
   stays in it.
2. `run` hands each request to the copy that is named for it, or to the first that is free, and
   gives the answers in the order of the requests, whatever the copies' timing. Requests may be made
   while the copies answer earlier ones.
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
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, Generic, NoReturn, Self, TypeVar

from msgspec import Struct, field

Ask = TypeVar("Ask")
Answer = TypeVar("Answer")

_LENGTH = struct.Struct("<Q")
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_PART = 1 << 16
"""Bytes that are read at once: as much as a pipe holds."""


def can_fork() -> bool:
    """Whether this process can be copied: it has one thread, and nothing that a copy breaks."""
    if not hasattr(os, "fork") or sys.platform == "darwin":
        return False
    # Threads do not come along into a copy, and MuJoCo has some of its own.
    return threading.active_count() == 1 and "mujoco" not in sys.modules


@contextlib.contextmanager
def beside(make: Callable[[], Answer]) -> Iterator[Callable[[], Answer]]:
    """Begin to make something in a copy of this process; what is given waits for it, once.

    It is made here where there can be no copy, or where that has died or failed.
    """
    made: list[Answer] = []
    with Pool[None, Answer](
        lambda _: made[0] if made else make(),
        int(can_fork()),
        begin=lambda: made.append(make()),
    ) as pool:
        yield lambda: pool.run([(None, None)])[0][0]


class _Copy(Struct, eq=False):
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

        `begin` is called in each copy before its first request. Of the files that are open here
        only the first three are open in the copies.
        """
        self._answer = answer
        self._begin = begin
        self._copies: list[_Copy | None] = []
        try:
            gc.freeze()  # what there is now is not looked through in the copies
            for _ in range(count):
                self._fork()
        except OSError:  # no room for another process
            pass
        except BaseException:
            self.close()
            raise
        finally:
            gc.unfreeze()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def count(self) -> int:
        """How many copies there were at the beginning."""
        return len(self._copies)

    def run(
        self, requests: Iterable[tuple[int | None, Ask]]
    ) -> tuple[list[Answer], list[int | None]]:
        """The answers, in the order of the requests, and which copy gave each.

        A request comes with the number of the copy that should answer it, if any. The next one is
        asked for, and so made, whenever there is no answer to take.
        """
        work = _Work(iter(requests), len(self._copies))
        try:
            self._work(work)
        except BaseException:  # an answer that is still to come would be taken for a later one
            self.close()
            raise
        for index, request in enumerate(work.requests):
            if index not in work.answers:
                work.answers[index] = (self._answer(request[1]), None)
        found = [work.answers[index] for index in range(len(work.requests))]
        return [answer for answer, _ in found], [number for _, number in found]

    def _work(self, work: _Work) -> None:
        """Have all answered by copies, as long as there are any."""
        with selectors.DefaultSelector() as selector:
            for number, copy in enumerate(self._copies):
                if copy is not None:
                    selector.register(copy.answers, selectors.EVENT_READ, number)
            while True:
                goes_on = work.take()
                for number, copy in enumerate(self._copies):
                    if copy is not None and copy.busy is None:
                        self._next(work, number)
                if not goes_on and all(c is None or c.busy is None for c in self._copies):
                    break
                for key, _ in selector.select(0 if goes_on else None):
                    copy = self._copies[key.data]
                    if copy is not None and not self._read(work, key.data, copy):
                        selector.unregister(copy.answers)
                        self._lose(key.data)

    def close(self) -> None:
        """End them: all of them at once, since giving back their memory takes a while."""
        for copy in self._copies:
            if copy is not None:
                _kill(copy)
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
            part = os.read(copy.answers, _PART)
        except OSError:
            part = b""
        if not part:
            return False
        buffer = copy.buffer
        buffer += part
        if len(buffer) >= _whole(buffer) and copy.busy is not None:
            copy.buffer = bytearray()
            good, value = pickle.loads(memoryview(buffer)[_LENGTH.size :])
            if not good:
                raise value
            work.answers[copy.busy] = (value, number)
            copy.busy = None
        return True

    def _lose(self, number: int) -> None:
        copy, self._copies[number] = self._copies[number], None
        if copy is None:
            return
        for fd in (copy.requests, copy.answers):
            with contextlib.suppress(OSError):
                os.close(fd)
        _kill(copy)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(copy.process, 0)

    def _fork(self) -> None:
        inward, requests = os.pipe()
        answers, outward = os.pipe()
        # A signal for all of the terminal's processes must not do in the copy what it does here.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        try:
            process = os.fork()
            if process == 0:
                _serve(self._begin, self._answer, inward, outward, before)
            self._copies.append(_Copy(process, requests, answers))
        except OSError:
            os.close(requests)
            os.close(answers)
            raise
        finally:
            os.close(inward)
            os.close(outward)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Work:
    """Requests that are still to be answered, and the answers."""

    def __init__(self, requests: Iterator[tuple[int | None, Any]], count: int) -> None:
        self.requests: list[tuple[int | None, Any]] = []
        """Those that were taken."""
        self.answers: dict[int, tuple[Any, int | None]] = {}
        self._coming = requests
        self._own: list[deque[int]] = [deque() for _ in range(count)]
        self._free: deque[int] = deque()

    def take(self) -> bool:
        """Take one more request; false where there is none."""
        request = next(self._coming, None)
        if request is None:
            return False
        number = request[0]
        queue = self._own[number] if number is not None and number < len(self._own) else self._free
        queue.append(len(self.requests))
        self.requests.append(request)
        return True

    def next(self, number: int) -> int | None:
        """The next request for a copy."""
        for queue in (self._own[number], self._free):
            if queue:
                return queue.popleft()
        return None


def _kill(copy: _Copy) -> None:
    with contextlib.suppress(OSError):
        os.kill(copy.process, signal.SIGKILL)


def _serve(
    begin: Callable[[], None],
    answer: Callable[[Any], Any],
    inward: int,
    outward: int,
    blocked: Collection[int],
) -> NoReturn:
    """What a copy does until its input ends; `blocked`: signals that it is to block then."""
    status = 1
    try:
        # Ctrl-C is for the process that has forked it, which ends it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
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
    for fd in sorted(fd for fd in kept if fd >= start):  # below where a stream was closed
        os.closerange(start, fd)
        start = fd + 1
    os.closerange(start, 1 << 16)


def _write(fd: int, data: bytes) -> None:
    parts = _LENGTH.pack(len(data)), data
    done = os.writev(fd, parts)
    if done < _LENGTH.size + len(data):
        rest = memoryview(b"".join(parts))[done:]
        while rest:
            rest = rest[os.write(fd, rest) :]


def _read(fd: int) -> memoryview | None:
    """What was sent, of which nothing follows before it is answered; `None` at the end."""
    data: bytes | bytearray = os.read(fd, _PART)
    if data and len(data) < _whole(data):
        data = bytearray(data)
        while len(data) < _whole(data):
            part = os.read(fd, _PART)
            if not part:
                return None
            data += part
    return memoryview(data)[_LENGTH.size :] if data else None


def _whole(data: bytes | bytearray) -> int:
    """How many bytes there will be, by the first of them."""
    known = len(data) >= _LENGTH.size
    return _LENGTH.size + (_LENGTH.unpack_from(data)[0] if known else 1)
