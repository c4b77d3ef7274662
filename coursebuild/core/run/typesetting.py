"""Formulas to MathML: Temml in QuickJS, or many in V8, with limits on time and memory.

QuickJS starts within a millisecond, needs no thread and no addresses that it does not use, and may
be forked. V8 takes a fifth of its time for a formula, but to start as long as QuickJS takes for 60
to 300. So V8 typesets what comes after the first formulas, where it can start, and QuickJS judges:
what V8 refuses, QuickJS typesets again, and what could exceed QuickJS's stack, which is the smaller
one, never comes to V8. Their bytes are the same.

Formulas are typeset many at a time, as JSON (see `typeset.js`). When a batch exceeds a limit of
QuickJS, its context is thrown away, and its formulas are typeset one by one, to find the one to
blame.
"""

from __future__ import annotations

import json
import re
import resource
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coursebuild.core.files.errors import EffectError, LackError
from coursebuild.core.files.resources import assets_dir
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.text.macros import DEFINED
from coursebuild.core.text.units import write_quantities

if TYPE_CHECKING:
    from coursebuild.core.run.v8 import Isolate

_MEMORY = 128
"""MiB."""
_STACK = 4 << 20
"""Bytes at most: what the deepest formula takes that browsers draw."""
_BATCH = 100
"""Formulas at a time; one takes about 0.3 ms."""
_MANY = 5_000
"""Characters of the formulas that QuickJS typesets in the time in which V8 starts."""
_SHALLOW = 400
"""Characters of a formula that can be nested as deep as it is long: half of what QuickJS takes."""
_MOST_REMEMBERED = 2000
"""Formulas; they take 1 to 2 kB each."""
_BATCH_SECONDS = 20
_SINGLE_SECONDS = 5
_LONGEST_MESSAGE = 160


class MathEngine:
    """Typesets formulas. May be used by several threads, one at a time."""

    def __init__(self) -> None:
        self._context: Any = None
        self._isolate: Isolate | None = None
        self._has_v8 = True
        self._length = 0
        self._mathml: dict[Formula, str] = {}
        """Of formulas typeset before: half of those of a text stand in another one, too."""
        self._lock = threading.RLock()

    def close(self) -> None:
        """End V8 with its threads, so that this process can be forked; the engine still works."""
        with self._lock:
            self._length = 0
            if self._isolate is not None:
                self._isolate.close()
                self._isolate = None

    def typeset(self, formulas: Sequence[Formula]) -> list[str | MathError]:
        """The MathML of each formula, or why there is none; no macro outlives its formula.

        Raises:
            EffectError: Temml or QuickJS is not installed, or has too small a stack.
        """
        with self._lock:
            results: dict[Formula, str | MathError] = {
                formula: self._mathml[formula] for formula in formulas if formula in self._mathml
            }
            new = [formula for formula in dict.fromkeys(formulas) if formula not in results]
            if new and self._has_v8 and self._length >= _MANY:
                results |= self._typeset_in_v8(new)
            self._length += sum(len(formula.tex) for formula in new)
            remaining_formulas = [formula for formula in new if formula not in results]
            for start in range(0, len(remaining_formulas), _BATCH):
                batch = remaining_formulas[start : start + _BATCH]
                results.update(zip(batch, self._batch(batch), strict=True))
            if len(self._mathml) > _MOST_REMEMBERED:
                self._mathml.clear()
            # Not an error: a formula that took too long may not do so again.
            self._mathml |= {f: html for f in new if isinstance(html := results[f], str)}
            return [results[formula] for formula in formulas]

    def _typeset_in_v8(self, formulas: Sequence[Formula]) -> dict[Formula, str]:
        """The MathML of those formulas that V8 typesets as QuickJS would, if V8 can be used."""
        from coursebuild.core.run.v8 import Isolate, LimitError, ScriptError

        shallow = [f for f in formulas if len(f.tex) <= _SHALLOW and not DEFINED.search(f.tex)]
        try:
            self._isolate = self._isolate or Isolate(*_scripts())
            replies = self._isolate.call("typeset", _jobs(shallow), _BATCH_SECONDS)
        except (EffectError, LimitError, ScriptError, MemoryError, OSError, RuntimeError):
            self._has_v8 = False
            self.close()
            return {}
        pairs = zip(shallow, json.loads(replies), strict=True)
        return {formula: reply for formula, reply in pairs if isinstance(reply, str)}

    def _batch(self, formulas: Sequence[Formula]) -> Iterator[str | MathError]:
        import _quickjs

        context = self._context = self._context or _start()
        context.set_time_limit(_BATCH_SECONDS if len(formulas) > 1 else _SINGLE_SECONDS)
        try:
            replies = json.loads(context.eval("typeset")(_jobs(formulas)))
        except _quickjs.JSException as error:  # no formula throws: it is a limit
            self._context = None
            if len(formulas) == 1:
                yield MathError(f"the formula cannot be typeset ({readable(str(error))})", None)
                return
            for formula in formulas:
                yield from self._batch([formula])
            return
        for formula, reply in zip(formulas, replies, strict=True):
            if isinstance(reply, str):
                yield reply
                continue
            position = reply["position"]
            if position is not None:  # in UTF-16 units
                units = formula.tex.encode("utf-16-le", "surrogatepass")[: 2 * position]
                position = len(units.decode("utf-16-le", "ignore"))
            yield MathError(readable(reply["message"]), position)


def _jobs(formulas: Sequence[Formula]) -> str:
    return json.dumps(
        [{"tex": write_quantities(f.tex), "source": f.tex, "display": f.display} for f in formulas]
    )


def _scripts() -> Iterator[str]:
    for path in (assets_dir() / "temml" / "temml.min.js", Path(__file__).with_name("typeset.js")):
        yield path.read_text(encoding="utf-8")


def _start() -> Any:
    """A context that knows `typeset`.

    Raises:
        EffectError: Temml or QuickJS is not installed.
        LackError: threads have so small a stack that a formula could exceed it.
    """
    stack = resource.getrlimit(resource.RLIMIT_STACK)[0]
    if stack == resource.RLIM_INFINITY:
        stack = 2 << 20  # of a thread, then
    if stack < 2 << 20:
        message = f"formulas need a stack of 2 MiB, and this process may have {stack >> 10} KiB"
        raise LackError(message, help="`ulimit -s 8192` raises the limit")
    try:
        import _quickjs  # not `quickjs`, which starts a thread: the process could not be forked
    except ImportError as error:
        message = f"QuickJS cannot be used: {error}"
        raise EffectError(message, help="run `pip install coursebuild` again") from None
    context = _quickjs.Context()
    context.set_memory_limit(_MEMORY << 20)
    context.set_max_stack_size(min(_STACK, stack // 2))
    for script in _scripts():
        context.eval(script)
    return context


_WORDING = (
    (
        re.compile(r"""^(?:Unsupported [\w ]+: |Function "|Got [\w ]+: ')\\?(.+?)(?:" is.*|')?$"""),
        r"unknown command \\\1",
    ),
    (re.compile(r"^Can't use function '(.+)' in text mode$"), r"\1 cannot stand in text"),
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
