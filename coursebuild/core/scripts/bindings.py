"""Numbers in prose that must be what a script printed: `` `+6.6 %`{out} ``.

1. A binding depends on the nearest recorded output above it, or on the script that `{out=…}` names:
   on its recorded outputs anywhere in the course, or else on what it printed in this run.
2. The numbers of a binding must be numbers of one printed line, one after the other, each rounded
   to the digits shown: within half a unit of the last place shown. Integers must be equal.
3. Text next to the numbers (a unit, a name) narrows the choice: where it stands next to printed
   numbers as well, only those count. A binding without a number must stand in the output as text.
4. Recorded text decides, whatever this run printed: drift is reported by itself, with the bindings
   that depend on it. The run counts where recorded text leaves things out (`...`, tables), and for
   a binding that does not hold in a text that has drifted: the recorded text may be wrong.
5. Where the script right above a binding has no recorded output, the number may belong to that
   script: no number of the output further up is proposed in its place.

What a binding that does not hold is told (`_mismatch`):

1. Where the lines by which the binding held before are known, it proposes what is printed in their
   place now. A line is the same if it has the same words under the same heading, which is the last
   line above without a number; of several such lines (the rows of a table), if it begins with the
   same number. Where that is not certain, it proposes nothing.
2. Else it names the nearest number, and proposes that if no other number has the same words around
   it: any other may be another quantity.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Hashable, Iterable, Sequence
from decimal import Context, Decimal
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.bound_numbers import (
    BoundText,
    PrintedLine,
    Window,
    lines_of_run,
    printed_lines,
    shows,
    text_places,
)
from coursebuild.core.scripts.lines import canonicalize
from coursebuild.core.scripts.tables import header_unit
from coursebuild.core.text.diagnostics import Diagnostic, Fix, Note, diagnose, did_you_mean
from coursebuild.core.text.near import nearest
from coursebuild.core.text.numbers import Number, difference
from coursebuild.core.text.quantities import with_unit

_SILENT_OUTCOMES = (
    Outcome.FAILED,
    Outcome.TIMEOUT,
    Outcome.KILLED,
    Outcome.OUTPUT_LIMIT,
    Outcome.ENCODING,
    Outcome.UNRECORDED,
)
"""Those that are reported by themselves, so that no more is said of numbers bound to them."""


_LINE_END = re.compile(r"(?<!\n)\n[ \t>]*(?!\n)")


class BindingKey(Struct, frozen=True):
    """What a binding shows, and on which outputs it depends, whatever these say now."""

    text: str
    script: str
    document: str
    """Empty where the binding names the script."""
    nth: int
    """Its index among the recorded outputs of the script in the document."""
    count: int
    """How many there are: with one more or less, it is uncertain which is which."""


BindingEvidence: TypeAlias = dict[BindingKey, tuple[str, ...]]
"""The lines by which bindings held when they were last checked."""


class DependentBinding(Struct, frozen=True):
    """A binding, and the change of a recorded value that it depends on."""

    binding: model.NumberBinding
    change: Change


class PrintedOutputs:
    """What bindings depend on: the recorded outputs of a course and the runs of its scripts."""

    def __init__(
        self, verdicts: Iterable[Verdict], runs: Iterable[ScriptRun], scripts: Iterable[str] = ()
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
        for document_verdicts in self._by_document.values():
            document_verdicts.sort(key=_end_of_body)
        self.scripts = frozenset({*scripts, *self.runs, *self._by_script})
        """The paths of all scripts."""

    def of_document(self, document: model.Document) -> Sequence[Verdict]:
        """The recorded outputs of a document, in order."""
        return self._by_document.get(document.source.path, ())

    def of_binding(self, binding: model.NumberBinding) -> list[Verdict]:
        """The recorded outputs that a binding depends on."""
        if binding.script is not None:
            return self._by_script.get(binding.script, [])
        verdicts = self._by_document.get(binding.span.path, [])
        after = bisect_left(verdicts, binding.span.start + 1, key=_end_of_body)
        return verdicts[after - 1 : after] if after else []

    def key(self, binding: model.NumberBinding) -> BindingKey:
        """The key of a binding."""
        verdicts = self.of_binding(binding)
        if binding.script is not None or not verdicts:
            return BindingKey(binding.text, binding.script or "", "", 0, len(verdicts))
        (verdict,) = verdicts
        path, script = binding.span.path, verdict.recording.script or ""
        siblings = [v for v in self._by_document[path] if v.recording.script == script]
        nth = list(map(_recording_key, siblings)).index(_recording_key(verdict))
        return BindingKey(binding.text, script, path, nth, len(siblings))

    def lines(self, verdict: Verdict) -> tuple[PrintedLine, ...]:
        """The lines of a recorded output."""
        key = _recording_key(verdict)
        if key not in self._lines:
            self._lines[key] = printed_lines(verdict.recording, verdict.comparison.own_filters)
        return self._lines[key]


def _end_of_body(verdict: Verdict) -> int:
    return verdict.recording.body_span.end


def _recording_key(verdict: Verdict) -> tuple[str, int]:
    """A key that tells the recorded outputs of a course apart."""
    return verdict.recording.span.path, verdict.recording.body_span.start


def document_bindings(document: model.Document) -> tuple[model.NumberBinding, ...]:
    """The bound numbers of a document, in order: also in footnotes, tables and quizzes.

    One that ends its cell in a table has the unit of the column.
    """
    units = {
        inline.span.start: header_unit(header).text
        for table in model.find_blocks(document, model.Table)
        for row in table.rows
        for cell, header in zip(row, table.header, strict=False)
        for inline in cell.children[-1:]
    }
    bindings = (b for b in model.find_inlines(document, model.NumberBinding) if b.source is None)
    return tuple(replace(b, unit=b.unit or units.get(b.span.start, "")) for b in bindings)


def check_bindings(
    document: model.Document, outputs: PrintedOutputs, evidence: BindingEvidence | None = None
) -> tuple[Diagnostic, ...]:
    """What is wrong with the bindings of a document.

    Bindings that depend on a failed script get none: the failure itself is reported. `evidence` is
    read for the lines by which a binding held before, and gets those by which it holds now.
    """
    evidence = {} if evidence is None else evidence
    diagnostics: list[Diagnostic] = []
    for binding in document_bindings(document):
        key = outputs.key(binding)
        finding = _check(binding, outputs, evidence.get(key, ()))
        if isinstance(finding, Diagnostic):
            verdicts = [] if binding.script is not None else outputs.of_binding(binding)
            start = _end_of_body(verdicts[0]) if verdicts else binding.span.start
            scripts = [  # between it and the output further up that it depends on
                script
                for script in model.document_scripts(document)
                if start < script.span.start < binding.span.start
            ]
            if finding.rule == "binding-mismatch" and scripts and key not in evidence:
                help = f"if `{scripts[-1].path}` prints it, record its output above the number"
                finding = replace(finding, help=help, edits=())
            elif binding.script is not None and binding.script not in outputs.scripts:
                likely = nearest(binding.script, outputs.scripts)
                places = (s.span for s in model.document_scripts(document) if s.path == likely)
                notes = (Note(f"`{likely}` is here", place.first_line()) for place in places)
                finding = replace(finding, notes=(*finding.notes, *notes))
            diagnostics.append(finding)
        elif finding:
            evidence[key] = tuple(line.text for line in finding)
    return tuple(diagnostics)


def _check(
    binding: model.NumberBinding, outputs: PrintedOutputs, before: Sequence[str]
) -> Diagnostic | Sequence[PrintedLine]:
    """What is wrong with a binding, or the lines by which it holds; no lines where it is unchecked.

    `before` are those by which it held before, if that is known.
    """
    verdicts = outputs.of_binding(binding)
    path = binding.script or (verdicts[0].recording.script if verdicts else None)
    if path is None or path not in outputs.scripts:
        return _orphan_diagnostic(binding, path, outputs)
    run = outputs.runs.get(path)
    ran_well = run is not None and run.outcome is Outcome.OK
    outputs_of_run = () if run is None else (run.output_of(v.recording.part) for v in verdicts)
    printed = dict.fromkeys(outputs_of_run)
    if run is not None and (
        run.outcome in _SILENT_OUTCOMES or (verdicts and ran_well and not "".join(printed).strip())
    ):
        return ()
    if not verdicts and not ran_well:
        is_run = run is None or run.outcome is not Outcome.NORUN
        return () if is_run else _orphan_diagnostic(binding, path, outputs)
    steady = [v for v in verdicts if v.comparison.mode is not model.Mode.VOLATILE]
    lines = [line for verdict in steady for line in outputs.lines(verdict)]
    bound_text = _read_text(binding, lines)
    if _holds(bound_text, lines):
        mismatch = _wrong_unit(binding, bound_text, path, lines)
        return lines if mismatch is None else mismatch
    partial = any(
        v.comparison.ellipsis or isinstance(v.recording.body, model.Table) for v in steady
    )
    drifted = any(v.status == "drift" for v in steady)
    if (partial or drifted or not verdicts) and run is not None and ran_well:
        filters = [f for v in steady for f in v.comparison.own_filters]
        lines = [line for text in printed or [run.stdout] for line in lines_of_run(text, filters)]
        if _holds(bound_text, lines):
            return lines
    varying = [v.recording for v in verdicts if v not in steady or v.comparison.volatile]
    if varying and (
        not steady or _holds(bound_text, [n for r in varying for n in printed_lines(r)])
    ):
        message = f"`{binding.text}` is bound to an output that differs from run to run"
        help = "remove `{out}`, or narrow `volatile` so that this number is compared"
        return diagnose("binding-volatile", binding.text_span, message, help=help)
    return _mismatch(binding, path, lines, before)


def _wrong_unit(
    binding: model.NumberBinding, bound_text: BoundText, path: str, lines: Sequence[PrintedLine]
) -> Diagnostic | None:
    mismatch = bound_text.wrong_unit(lines, binding.unit or _following(binding))
    if mismatch is None:
        return None
    number, printed_text, unit_text = mismatch
    quantity = with_unit(number.text, printed_text)
    message = f"`{path}` printed `{quantity}`, and the unit here is `{unit_text}`"
    help = "write the unit that is printed, or let the script convert the number; where it is not"
    help += ' meant, write `{given="…"}` in place of `{out}`'
    return diagnose("binding-mismatch", binding.text_span, message, help=help)


def unprinted_unit(binding: model.NumberBinding, outputs: PrintedOutputs) -> str:
    """The unit of a bound number that is printed with none; empty if there is no such."""
    verdicts = outputs.of_binding(binding)
    lines = [line for verdict in verdicts for line in outputs.lines(verdict)]
    bound_text = _read_text(binding, lines)
    shown_units = bound_text.units(binding.unit or _following(binding))
    path = binding.script or (verdicts[0].recording.script if verdicts else None)
    run = outputs.runs.get(path or "")
    if not any(shown_units) or not bound_text.numbers:
        return ""
    if not bound_text.is_in(lines) and run is not None:
        lines = lines_of_run(run.stdout)
    printed_units = [w.units(lines) for w in bound_text.windows(lines) if bound_text.shows(w)]
    for at, unit in enumerate(shown_units):
        if unit and printed_units and not any(units[at] for units in printed_units):
            return unit.text
    return ""


def _following(binding: model.NumberBinding) -> str:
    """The text behind a binding, also on the next line of a quotation."""
    end = binding.span.end
    return _LINE_END.sub(" ", binding.span.source.text[end : end + 80])


def _read_text(binding: model.NumberBinding, lines: Sequence[PrintedLine]) -> BoundText:
    """The text of a binding; a comma in it may stand before decimals, or part numbers."""
    bound_text, as_printed = BoundText.of(binding.text, binding.comma), BoundText.of(binding.text)
    is_list = bound_text.comma and not _holds(bound_text, lines) and _holds(as_printed, lines)
    return as_printed if is_list else bound_text


def _holds(bound_text: BoundText, lines: Sequence[PrintedLine]) -> bool:
    if bound_text.numbers:
        return bound_text.is_in(lines)
    return next(text_places(bound_text.before, lines), None) is not None


def _orphan_diagnostic(
    binding: model.NumberBinding, path: str | None, outputs: PrintedOutputs
) -> Diagnostic:
    """A binding that has no output: none above it, no such script, or one that is not run."""
    if path is None:
        target = ", but there is no recorded output above it"
        help = "write it below the output, or name the script: `{out=examples/…}`"
    elif path in outputs.scripts:
        target = f" to `{path}`, which has no recorded output and is not run"
        help = "record its output below it"
    else:
        target = f" to `{path}`, which is not a script of the course"
        help = did_you_mean(path, outputs.scripts)
        if isinstance(help, Fix):
            help = help.at(binding.span)
    message = f"`{binding.text}` is bound{target}"
    return diagnose("binding-orphan", binding.text_span, message, help=help)


def dependent_bindings(
    verdict: Verdict, documents: Iterable[model.Document], outputs: PrintedOutputs
) -> tuple[DependentBinding, ...]:
    """The bindings of the course, in order, that depend on a changed value of a recording."""
    changes = [c for c in verdict.changes if c.kind is not DriftKind.EXTRA]
    key, lines = _recording_key(verdict), outputs.lines(verdict)
    dependents: list[DependentBinding] = []
    for binding in (b for document in documents for b in document_bindings(document)):
        if any(_recording_key(candidate) == key for candidate in outputs.of_binding(binding)):
            bound_text = BoundText.of(binding.text, binding.comma)
            places = text_places(bound_text.before, lines)
            if bound_text.numbers:
                windows = filter(bound_text.shows, bound_text.windows(lines))
                places = ((w.line, n.start, n.end) for w in windows for n in w.numbers)
            located = (line.locate(a, b) for line, a, b in places if line.locate is not None)
            spans = [(span.start, span.end) for span in located]
            overlap = (c for a, b in spans for c in changes if a < c.span.end and c.span.start < b)
            change = next(overlap, None)
            dependents += [] if change is None else [DependentBinding(binding, change)]
    return tuple(dependents)


_QUOTIENT = Context(prec=34)


def _mismatch(
    binding: model.NumberBinding, path: str, lines: Sequence[PrintedLine], before: Sequence[str]
) -> Diagnostic:
    """The diagnostic of a binding that none of these lines bears out; `before` as in `_check`."""
    bound_text = BoundText.of(binding.text, binding.comma)
    stray, label = bound_text.stray, ""
    pointed = re.sub("(?<=[0-9]),(?=[0-9])", ".", binding.text)
    with_point = BoundText.of(pointed)
    if not bound_text.numbers:
        message = f"`{binding.text}` is not in the output of `{path}`"
        help = "write it as it is printed, or remove `{out}`"
    elif stray and replace(bound_text, before="", after="").is_in(lines):
        message = f"`{path}` printed no `{stray}` beside the number in `{binding.text}`"
        help = Fix(f"remove the `{stray}`", "", stray)
    elif mismatch := _wrong_unit(binding, replace(bound_text, before="", after=""), path, lines):
        return mismatch
    elif pointed != binding.text and with_point.numbers and with_point.is_in(lines):
        message = f"`{binding.text}` has a comma where outputs have a decimal point"
        help = Fix(f"write `{pointed}`", pointed)
    else:
        label, better = _propose(bound_text, lines, list(map(PrintedLine, before)))
        message = f"`{binding.text}` is not what `{path}` printed, rounded to the digits shown"
        help = Fix(f"write `{better}`", better, safe=True) if better else ""
    return diagnose("binding-mismatch", binding.text_span, message, label=label, help=help)


def _propose(
    bound_text: BoundText, lines: Sequence[PrintedLine], before: Sequence[PrintedLine]
) -> tuple[str, str]:
    """What is printed instead, in words, and the text to write; empty where that is not certain."""
    windows = bound_text.windows(lines)
    if not windows:
        if len(bound_text.numbers) > 1 and any(line.numbers for line in lines):
            return f"no printed line has {len(bound_text.numbers)} numbers one after the other", ""
        return "no number was printed", ""
    several = len(bound_text.numbers) > 1
    nearest = min(windows, key=lambda window: _distance(bound_text.numbers, window.numbers))
    nearest_text = f"the nearest printed value{'s are' if several else ' is'} {nearest.text}"
    windows_before = [window for window in bound_text.windows(before) if bound_text.shows(window)]
    if not windows_before:
        rewritings = {bound_text.rewrite(window) for window in windows}
        certain = bound_text.has_context(nearest) and len(rewritings) == 1
        return nearest_text, rewritings.pop() if certain else ""
    text_before = windows_before[0].text
    now = [_successor(window, before, lines) for window in windows_before]
    rewritings = {bound_text.rewrite(window) if window else "" for window in now}
    if now[0] is None or len(rewritings) > 1 or ("" in rewritings and len(now) > 1):
        doubt = f"it is not certain what is printed in place of {text_before} now"
        return f"{doubt}; {nearest_text}", ""
    better = rewritings.pop()
    if better and not BoundText.of(better, bound_text.comma).is_in(lines):
        better = ""  # other numbers have its words or unit
    are, were = ("are", "were") if several else ("is", "was")
    return f"{now[0].text} {are} printed where {text_before} {were}", better


def _successor(
    window_before: Window, before: Sequence[PrintedLine], now: Sequence[PrintedLine]
) -> Window | None:
    """What is printed now where numbers were printed before; `None` where that is not certain."""
    index = next(i for i, line in enumerate(before) if line is window_before.line)
    old, new = _line_keys(before), _line_keys(now)
    first = window_before.line.numbers.index(window_before.numbers[0])
    for keys_before, keys_now in zip(old, new, strict=True):
        key = keys_before[index]
        if keys_before.count(key) == keys_now.count(key) == 1:
            line = now[keys_now.index(key)]
            return Window(line, line.numbers[first : first + len(window_before.numbers)])
    return None


def _line_keys(lines: Sequence[PrintedLine]) -> tuple[list[Hashable], list[Hashable]]:
    """Two keys of each line: its heading and words; these and, of several, its first number."""
    heading = ""
    words: list[Hashable] = []
    rows: list[Hashable] = []
    for line in lines:
        skeleton = canonicalize(line.text).skeleton.strip()
        if not line.numbers and any(map(str.isalpha, skeleton)):
            heading = skeleton
        words.append((heading, skeleton))
        label = line.numbers[0].value if len(line.numbers) > 1 else None
        rows.append((heading, skeleton, label))
    return words, rows


def _distance(
    bound_numbers: Sequence[Number], printed: Sequence[Number]
) -> tuple[Decimal, Decimal]:
    """The distance of printed numbers from bound ones: relative to their sizes, and absolute."""
    relative = absolute = Decimal()
    for s, p in zip(bound_numbers, printed, strict=True):
        if shows(s, p):
            continue
        if not (s.is_finite and p.is_finite):
            return Decimal("Infinity"), absolute
        shown_size, printed_size = s.value.copy_abs(), p.value.copy_abs()
        if size := max(shown_size, printed_size):  # `00` is 0 and not shown as it
            relative += _QUOTIENT.divide(difference(shown_size, printed_size), size)
        absolute += difference(s.value, p.value)
    return relative, absolute
