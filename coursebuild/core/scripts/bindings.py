"""Numbers in prose that must be what a script printed: `` `+6.6 %`{out} ``.

Entry points: `check_bindings` (a document), `leaning_on` (who depends on what has changed).

1. A binding depends on the nearest recorded output above it, or on the script that `{out=…}` names:
   on its recorded outputs anywhere in the course, else on what it printed in this run.
2. The numbers of a binding must be numbers of one printed line, one after the other, each rounded
   to the digits shown: within half a unit of the last place shown. Integers must be equal.
3. Text beside the numbers (a unit, a name) chooses: where it stands beside printed numbers as well,
   only those count. A binding without a number must stand in the output as text.
4. Recorded text decides, whatever this run printed: drift is reported by itself, with the bindings
   that lean on it. The run counts where recorded text leaves things out (`...`, tables), and for a
   binding that does not hold in a text that has drifted: what is recorded may be what is wrong.
5. Where the script above a binding has no recorded output, the number may be of that script: one of
   the output further up is not proposed in its place.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import (
    Document,
    Mode,
    NumberBinding,
    Script,
    Table,
    document_inlines,
    document_scripts,
)
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.bound_numbers import (
    PrintedLine,
    Shown,
    lines_of_run,
    printed_lines,
    text_places,
)
from coursebuild.core.scripts.mismatch import mismatch
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.source import Span

_FAILED = (
    Outcome.FAILED,
    Outcome.TIMEOUT,
    Outcome.KILLED,
    Outcome.OUTPUT_LIMIT,
    Outcome.ENCODING,
)


class BindingPlace(Struct, frozen=True):
    """What a binding shows, and on which outputs it leans, whatever they say now."""

    text: str
    script: str
    document: str
    """Empty where the binding names the script."""
    nth: int
    """Of the recorded outputs of the script in the document."""
    count: int
    """Of these outputs: with another one, it is not known any more which is which."""


HeldLines: TypeAlias = dict[BindingPlace, tuple[str, ...]]
"""The lines by which bindings held when that was last looked at."""


class Leaning(Struct, frozen=True):
    """A binding, and the change of a recorded value that it depends on."""

    binding: NumberBinding
    change: Change


class Printed:
    """What a binding can lean on: the recorded outputs of a course and the runs of its scripts."""

    def __init__(
        self,
        verdicts: Iterable[Verdict],
        runs: Iterable[ScriptRun],
        scripts: Iterable[str] = (),
    ) -> None:
        """`scripts` are the paths of all scripts of the course, run or not."""
        self.runs = {run.path: run for run in runs}
        self._by_script: dict[str, list[Verdict]] = {}
        self._by_document: dict[str, list[Verdict]] = {}
        self._lines: dict[tuple[str, int], tuple[PrintedLine, ...]] = {}
        for verdict in verdicts:
            recording = verdict.recording
            if recording.script is not None:
                self._by_script.setdefault(recording.script, []).append(verdict)
                self._by_document.setdefault(recording.span.path, []).append(verdict)
        for found in self._by_document.values():
            found.sort(key=_end_of_body)
        self.scripts = frozenset({*scripts, *self.runs, *self._by_script})
        """The paths of all scripts."""

    def outputs(self, document: Document) -> Sequence[Verdict]:
        """The recorded outputs of a document, in order."""
        return self._by_document.get(document.source.path, ())

    def recorded(self, binding: NumberBinding) -> list[Verdict]:
        """The recorded outputs that a binding depends on."""
        if binding.script is not None:
            return self._by_script.get(binding.script, [])
        found = self._by_document.get(binding.span.path, [])
        after = bisect_left(found, binding.span.start + 1, key=_end_of_body)
        return found[after - 1 : after] if after else []

    def place(self, binding: NumberBinding) -> BindingPlace:
        """What a binding shows, and on which outputs it leans."""
        recorded = self.recorded(binding)
        if binding.script is not None or not recorded:
            return BindingPlace(binding.text, binding.script or "", "", 0, len(recorded))
        (verdict,) = recorded
        path, script = binding.span.path, verdict.recording.script or ""
        same = [_key(v) for v in self._by_document[path] if v.recording.script == script]
        return BindingPlace(binding.text, script, path, same.index(_key(verdict)), len(same))

    def lines(self, verdict: Verdict) -> tuple[PrintedLine, ...]:
        """The lines of a recorded output."""
        key = _key(verdict)
        if key not in self._lines:
            self._lines[key] = printed_lines(verdict.recording, verdict.comparison.filters)
        return self._lines[key]


def _end_of_body(verdict: Verdict) -> int:
    return verdict.recording.body_span.end


def _key(verdict: Verdict) -> tuple[str, int]:
    """Tells the recorded outputs of a course apart."""
    return verdict.recording.span.path, verdict.recording.body_span.start


def document_bindings(document: Document) -> tuple[NumberBinding, ...]:
    """The bound numbers of a document, in order: also in footnotes, tables and quizzes."""
    inlines = document_inlines(document)
    return tuple(i for i in inlines if isinstance(i, NumberBinding) and i.source is None)


def check_bindings(
    document: Document, printed: Printed, held: HeldLines | None = None
) -> tuple[Diagnostic, ...]:
    """What is wrong with the bindings of a document.

    Nothing is said of bindings that lean on a script that failed: its failure is reported. `held`
    takes the lines by which bindings hold, and tells them of those that do not any more.
    """
    held = {} if held is None else held
    found: list[Diagnostic] = []
    for binding in document_bindings(document):
        place = printed.place(binding)
        checked = _check(binding, printed, held.get(place, ()))
        if isinstance(checked, Diagnostic):
            between = None if place in held else _script_between(document, binding, printed)
            if checked.rule == "binding-mismatch" and between is not None:
                help = f"if `{between.path}` prints it, record its output above the number"
                checked = replace(checked, help=help, edits=())
            found.append(checked)
        elif checked:
            held[place] = tuple(line.text for line in checked)
    return tuple(found)


def _check(
    binding: NumberBinding, printed: Printed, before: Sequence[str]
) -> Diagnostic | Sequence[PrintedLine]:
    """What is wrong with a binding, or the lines by which it holds, as far as it was looked at.

    `before` are those by which it held before, if that is known.
    """
    verdicts = printed.recorded(binding)
    path = binding.script or (verdicts[0].recording.script if verdicts else None)
    if path is None or path not in printed.scripts:
        return _orphan(binding, path, printed)
    run = printed.runs.get(path)
    ran_well = run is not None and run.outcome is Outcome.OK
    if run is not None and (
        run.outcome in _FAILED or (verdicts and ran_well and not run.stdout.strip())
    ):
        return ()
    if not verdicts and not ran_well:
        is_run = run is None or run.outcome is not Outcome.NORUN
        return () if is_run else _orphan(binding, path, printed)
    steady = [v for v in verdicts if v.comparison.mode is not Mode.VOLATILE]
    shown = Shown.of(binding.text)
    lines = [line for verdict in steady for line in printed.lines(verdict)]
    if _holds(shown, lines):
        return lines
    partial = any(v.comparison.ellipsis or isinstance(v.recording.body, Table) for v in steady)
    drifted = any(v.status == "drift" for v in steady)
    if (partial or drifted or not verdicts) and run is not None and ran_well:
        lines = lines_of_run(run.stdout, [f for v in steady for f in v.comparison.filters])
        if _holds(shown, lines):
            return lines
    varying = [v.recording for v in verdicts if v not in steady or v.comparison.volatile]
    if varying and (not steady or _holds(shown, [n for r in varying for n in printed_lines(r)])):
        return diagnose(
            "binding-volatile",
            binding.text_span,
            f"`{binding.text}` is bound to an output that differs from run to run",
            help="take `{out}` away, or let `volatile` leave this number in the comparison",
        )
    return mismatch(binding, path, lines, before)


def _script_between(document: Document, binding: NumberBinding, printed: Printed) -> Script | None:
    """The last script between a binding and the output further up that the binding depends on."""
    recorded = [] if binding.script is not None else printed.recorded(binding)
    start = _end_of_body(recorded[0]) if recorded else binding.span.start
    scripts = [s for s in document_scripts(document) if start < s.span.start < binding.span.start]
    return scripts[-1] if scripts else None


def _holds(shown: Shown, lines: Sequence[PrintedLine]) -> bool:
    if not shown.numbers:
        return bool(shown.before) and next(text_places(shown.before, lines), None) is not None
    return shown.is_in(lines)


def _orphan(binding: NumberBinding, path: str | None, printed: Printed) -> Diagnostic:
    """A binding that has no output: none above it, no such script, or one that is not run."""
    if path is None:
        to = ", and no recorded output stands above it"
        help = "write it below the output, or name the script: `{out=examples/…}`"
    elif path in printed.scripts:
        to = f" to `{path}`, which has no recorded output and is not run"
        help = "record its output below it"
    else:
        to = f" to `{path}`, which is no script of the course"
        help = did_you_mean(path, printed.scripts)
    message = f"`{binding.text}` is bound{to}"
    return diagnose("binding-orphan", binding.text_span, message, help=help)


def leaning_on(
    verdict: Verdict, documents: Iterable[Document], printed: Printed
) -> tuple[Leaning, ...]:
    """The bindings of the course that lean on a value of a recording that changed, in order."""
    changes = [c for c in verdict.changes if c.kind is not DriftKind.EXTRA]
    found: list[Leaning] = []
    for document in documents:
        for binding in document_bindings(document):
            for candidate in printed.recorded(binding):
                if _key(candidate) == _key(verdict):
                    places = _leans_at(binding, printed.lines(candidate))
                    change = next((c for p in places for c in changes if _overlap(p, c.span)), None)
                    if change is not None:
                        found.append(Leaning(binding, change))
    return tuple(found)


def _overlap(one: Span, other: Span) -> bool:
    return one.start < other.end and other.start < one.end


def _leans_at(binding: NumberBinding, lines: Sequence[PrintedLine]) -> Iterator[Span]:
    """Where the numbers or the text of a binding stand in a recorded output."""
    shown = Shown.of(binding.text)
    if not shown.numbers:
        for line, start, end in text_places(shown.before, lines) if shown.before else ():
            if line.locate is not None:
                yield line.locate(start, end)
        return
    for window in shown.windows(lines):
        if window.line.locate is not None and shown.shows(window):
            for number in window.numbers:
                yield window.line.locate(number.start, number.end)
