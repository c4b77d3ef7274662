"""JavaScript in this process: V8 with limits on time and memory, and Temml in it.

Entry points: `MathEngine.typeset`; `Isolate`, for other scripts.

1. An isolate is made when it is first needed, and reused. V8 is started then.
2. Formulas cross the border many at a time, as JSON (see `typeset.js`).
3. When a batch hits a limit, its isolate is thrown away, and its formulas go one by one, so that
   one of them gets the blame.
"""

from __future__ import annotations

import json
import re
import threading
import weakref
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Self, TypedDict

from coursebuild.effects.resources import assets_dir
from coursebuild.effects.v8_library import Context, LimitError
from coursebuild.effects.v8_start import start
from coursebuild.results import Formula, MathError

_MEMORY = 128 << 20
"""Bytes of JavaScript objects."""
_BATCH = 100
"""Formulas at a time; one takes about 0.3 ms."""
_BATCH_SECONDS = 20.0
_SINGLE_SECONDS = 5.0
_LONGEST_MESSAGE = 160


class Isolate:
    """A JavaScript context of its own, with some scripts loaded.

    Close it: a process that ends with V8 running may hang.
    """

    def __init__(self, *scripts: str, memory: int = _MEMORY) -> None:
        start()
        self._context = Context(memory)
        self.close = weakref.finalize(self, self._context.close)
        for script in scripts:
            self._context.evaluate(script, _BATCH_SECONDS)

    def call(self, function: str, argument: str, seconds: float) -> str:
        """Call a global function from string to string.

        Raises:
            LimitError: it ran for more than `seconds`, or took too much memory.
            ScriptError: it threw.
        """
        result = self._context.evaluate(f"{function}({json.dumps(argument)})", seconds)
        if result is None:
            raise TypeError(f"{function} returned no string")
        return result

    def stop(self) -> None:
        """From another thread: end what runs, by a `StoppedError` there.

        Where nothing runs at this moment, it ends what runs next.
        """
        self._context.stop()

    def fill(self, name: str, data: bytes) -> None:
        """Hand over bytes: the scripts' global `reserve(name, size)` gives the place for them."""
        place = f"reserve({json.dumps(name)}, {len(data)})"
        self._context.fill(place, data, _BATCH_SECONDS)


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

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free V8's memory; the engine can be used again."""
        if self._isolate is not None:
            self._isolate.close()
            self._isolate = None

    def typeset(self, formulas: Sequence[Formula]) -> list[str | MathError]:
        """The MathML of each formula, or why there is none; no macro outlives its formula.

        Raises:
            EffectError: Temml or V8 is not there.
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
    units = text.encode("utf-16-le", "surrogatepass")[: 2 * utf16]
    return len(units.decode("utf-16-le", "ignore"))


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
