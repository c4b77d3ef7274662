"""JavaScript in this process: V8 with limits on time and memory, and Temml in it.

Entry points: `MathEngine.typeset`; `Isolate`, for other scripts.

1. An isolate is made when it is first needed, and reused. mini-racer is imported then.
2. Formulas cross the border many at a time, as JSON (see `typeset.js`).
3. When a batch hits a limit, its isolate is thrown away, and its formulas go one by one, so that
   one of them gets the blame.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import json
import re
import threading
import weakref
from collections.abc import Coroutine, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypedDict, TypeVar

from coursebuild.effects.resources import assets_dir
from coursebuild.effects.v8_start import start
from coursebuild.results import Formula, MathError

if TYPE_CHECKING:
    from py_mini_racer import MiniRacer

_MEMORY = 128 << 20
"""Bytes of JavaScript objects."""
_BATCH = 100
"""Formulas at a time; one takes about 0.3 ms."""
_BATCH_SECONDS = 20.0
_SINGLE_SECONDS = 5.0
_LONGEST_MESSAGE = 160

T = TypeVar("T")


class LimitError(Exception):
    """A script ran too long or took too much memory; its isolate should not be used any more.

    `resumable`: it can still be asked how far it came.
    """

    def __init__(self, message: str, *, resumable: bool) -> None:
        super().__init__(message)
        self.resumable = resumable


class ScriptError(Exception):
    """A script threw; the text is its message."""


class _Loop:
    """An event loop in a thread of its own, so that whoever calls may have one running itself."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._cancel_next = False
        self._thread = threading.Thread(target=self._loop.run_forever, name="v8", daemon=True)
        self._thread.start()

    def run(self, work: Coroutine[Any, Any, T], *, always: bool = False) -> T:
        """The result of a coroutine; `always`: even after `cancel`."""

        async def guarded() -> T:
            if self._cancel_next and not always:
                self._cancel_next = False
                work.close()
                raise asyncio.CancelledError
            return await work

        future = asyncio.run_coroutine_threadsafe(guarded(), self._loop)
        try:
            return future.result()
        except concurrent.futures.CancelledError:
            raise asyncio.CancelledError from None
        except BaseException:
            future.cancel()  # Ctrl-C while waiting
            raise

    def cancel(self) -> None:
        """End what runs, or else what runs next."""

        def cancel() -> None:
            tasks = asyncio.all_tasks()
            self._cancel_next = not tasks
            for task in tasks:
                task.cancel()

        with contextlib.suppress(RuntimeError):  # it is closed already
            self._loop.call_soon_threadsafe(cancel)

    def drain(self) -> None:
        """End what still runs, such as what Ctrl-C left behind, and wait until it has ended."""

        async def drained() -> None:
            tasks = asyncio.all_tasks() - {asyncio.current_task()}
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

        asyncio.run_coroutine_threadsafe(drained(), self._loop).result()

    def close(self) -> None:
        """End the thread."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


class Isolate:
    """A JavaScript context of its own, with some scripts loaded.

    Close it: a process that ends with V8 running may hang.
    """

    def __init__(self, *scripts: str, memory: int = _MEMORY) -> None:
        self._memory = memory
        self._loop = _Loop()
        self._context = self._loop.run(_make_context())
        self.close = weakref.finalize(self, _close, self._loop, self._context)
        self._context.set_hard_memory_limit(memory)
        for script in scripts:
            self._evaluate(script, _BATCH_SECONDS)

    def call(self, function: str, argument: str, seconds: float) -> str:
        """Call a global function from string to string.

        Raises:
            LimitError: it ran for more than `seconds`, or took too much memory.
            ScriptError: it threw.
        """
        result = self._evaluate(f"{function}({json.dumps(argument)})", seconds)
        if not isinstance(result, str):
            raise TypeError(f"{function} returned {type(result).__name__}, not a string")
        return result

    def stop(self) -> None:
        """From another thread: end what runs, by an `asyncio.CancelledError` there.

        Where nothing runs at this moment, it ends what runs next.
        """
        self._loop.cancel()

    def fill(self, name: str, data: bytes) -> None:
        """Hand over bytes: the scripts' global `reserve(name, size)` gives the place for them."""
        place = self._evaluate(f"reserve({json.dumps(name)}, {len(data)})", _BATCH_SECONDS)
        if not isinstance(place, memoryview):
            raise TypeError(f"reserve returned {type(place).__name__}, not an ArrayBuffer")
        place[:] = data

    def _evaluate(self, code: str, seconds: float) -> object:
        from py_mini_racer import JSEvalException, JSOOMException

        async def evaluate() -> object:
            return await asyncio.wait_for(self._context.eval_cancelable(code), seconds)

        try:
            return self._loop.run(evaluate())
        except TimeoutError:
            raise LimitError(f"ran for more than {seconds:g} s", resumable=True) from None
        except JSOOMException:
            raise LimitError(f"took more than {self._memory >> 20} MiB", resumable=False) from None
        except JSEvalException as error:
            raise ScriptError(str(error)) from None


async def _make_context() -> MiniRacer:
    # Made inside a running loop, a context needs no thread of its own, and can be interrupted.
    from py_mini_racer import MiniRacer

    start()
    return MiniRacer()


def _close(loop: _Loop, context: MiniRacer) -> None:
    async def close() -> None:
        context.close()

    loop.drain()
    loop.run(close(), always=True)
    loop.close()


class _Failure(TypedDict):
    message: str
    position: int | None


class MathEngine:
    """Typesets formulas; a context manager. May be used by several threads, one at a time."""

    def __init__(self) -> None:
        self._isolate: Isolate | None = None
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free V8's memory; the engine can be used again."""
        if self._isolate is not None:
            self._isolate.close()
            self._isolate = None

    def typeset(self, formulas: Sequence[Formula]) -> list[str | MathError]:
        """The MathML of each formula, or why there is none; no macro outlives its formula.

        Raises:
            EffectError: Temml is not there.
        """
        with self._lock:
            return [
                result
                for start in range(0, len(formulas), _BATCH)
                for result in self._batch(formulas[start : start + _BATCH])
            ]

    def _batch(self, formulas: Sequence[Formula]) -> Iterator[str | MathError]:
        try:
            yield from self._call(
                formulas, _BATCH_SECONDS if len(formulas) > 1 else _SINGLE_SECONDS
            )
        except LimitError as error:
            self.close()
            if len(formulas) > 1:
                for formula in formulas:
                    yield from self._batch([formula])
            else:
                yield MathError(f"the formula {error}", None)

    def _call(self, formulas: Sequence[Formula], seconds: float) -> list[str | MathError]:
        if self._isolate is None:
            self._isolate = Isolate(*_scripts())
        request = json.dumps([{"tex": f.tex, "display": f.display} for f in formulas])
        replies: list[str | _Failure] = json.loads(self._isolate.call("typeset", request, seconds))
        return [_result(f, reply) for f, reply in zip(formulas, replies, strict=True)]


def _scripts() -> tuple[str, ...]:
    paths = (assets_dir() / "temml" / "temml.min.js", Path(__file__).with_name("typeset.js"))
    return tuple(path.read_text(encoding="utf-8") for path in paths)


def _result(formula: Formula, reply: str | _Failure) -> str | MathError:
    if isinstance(reply, str):
        return reply
    position = reply["position"]
    if position is not None:
        position = _code_points(formula.tex, position)
    return MathError(readable(reply["message"]), position)


def _code_points(text: str, utf16: int) -> int:
    """An offset in UTF-16 units as one in code points."""
    return len(text.encode("utf-16-le")[: 2 * utf16].decode("utf-16-le", "ignore"))


_WORDING = (
    (re.compile(r"^Unsupported function name: "), "unknown command "),
    (re.compile(r"^Expected 'EOF', got (.*)$", re.DOTALL), r"unexpected \1"),
    (re.compile(r"^Too many expansions.*$", re.DOTALL), "a macro expands without end"),
    (re.compile(r"'EOF'"), "the end of the formula"),
    (re.compile(r"^it "), "the formula "),
)
_CAPITAL = re.compile(r"^[A-Z](?=[a-z]*\b)")


def readable(message: str) -> str:
    """Temml's message in our style: lower case, one line, no full stop, not too long."""
    message = " ".join(message.removeprefix("ParseError:").split())
    for pattern, words in _WORDING:
        message = pattern.sub(words, message)
    message = _CAPITAL.sub(lambda m: m.group().lower(), message)
    if len(message) > _LONGEST_MESSAGE:
        message = message[: _LONGEST_MESSAGE - 1] + "…"
    return message.rstrip(".")
