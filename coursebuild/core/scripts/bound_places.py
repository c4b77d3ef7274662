"""Where a bound number is found in the outputs of its script, and how it follows a new output.

1. Where its address is known (see `provenance`), what stands there counts, and nothing else. The
   words of `{out="words"}` are an address, too: those printed right before the number.
2. Else it is sought. Text next to the numbers (a unit, a name) narrows the choice, then the unit
   behind the binding, then digits that are printed exactly so. What is found at two places is
   ambiguous; its addresses are all of these, and it follows where they agree.
3. Recorded text decides, whatever this run printed. The run counts where recorded text leaves
   things out (`...`, tables), and for a number that is not in a text that has drifted.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.lesson_record import Address, Addresses, ShownValue
from coursebuild.core.model.results import Outcome, Verdict
from coursebuild.core.scripts.bound_numbers import BoundText, Window
from coursebuild.core.scripts.column_titles import ColumnTitle
from coursebuild.core.scripts.lines import plain_text
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.scripts.provenance import PrintedText, masked, shown_values
from coursebuild.core.scripts.tables import row_values
from coursebuild.core.text.diagnostics import Edit, Note


def document_bindings(document: model.Document) -> tuple[model.NumberBinding, ...]:
    """The bound numbers of a document, in order: also in footnotes, tables and quizzes.

    One that ends its cell in a table has the unit of the column.
    """
    units = {
        inline.span.start: ColumnTitle.of(header).unit.text
        for table in model.find_blocks(document, model.Table)
        for row in table.rows
        for cell, header in zip(row, table.header, strict=False)
        for inline in cell.children[-1:]
    }
    bindings = (b for b in model.find_inlines(document, model.NumberBinding) if b.source is None)
    return tuple(replace(b, unit=b.unit or units.get(b.span.start, "")) for b in bindings)


def bound_values(
    document: model.Document, outputs: PrintedOutputs
) -> tuple[tuple[model.NumberBinding, ShownValue], ...]:
    """The bound numbers of a document with what tells them apart, wherever their lines move."""
    bindings = document_bindings(document)
    texts = (
        (document.source.path, outputs.script_of(b) or "", _words_before(b), b.text)
        for b in bindings
    )
    return tuple(zip(bindings, shown_values(texts), strict=True))


def document_values(document: model.Document, outputs: PrintedOutputs) -> tuple[ShownValue, ...]:
    """The bound numbers of a document, and the rows of its recorded tables."""
    rows = (
        value
        for verdict in outputs.of_document(document)
        for value in row_values(document, verdict.recording, verdict.comparison.filters)
    )
    return (*(value for _, value in bound_values(document, outputs)), *rows)


def carried_addresses(
    addresses: Addresses, before: Sequence[ShownValue], now: Sequence[ShownValue]
) -> Addresses:
    """The addresses of the values of a lesson that was written anew, value by value."""
    pairs = zip(before, now, strict=True) if len(before) == len(now) else ()
    return {new: addresses[old] for old, new in pairs if old in addresses}


_MARKUP = re.compile(r"\{[^{}]*\}|[`*_$]")
_CONTEXT = 5
"""The words before a binding by which it is known again."""


def _words_before(binding: model.NumberBinding) -> str:
    text, start = binding.span.source.text, binding.span.start
    paragraph = re.split(r"\n\s*\n", text[max(0, start - 200) : start])[-1]
    return " ".join(masked(_MARKUP.sub("", paragraph)).split()[-_CONTEXT:])


class PrintedPlace(NamedTuple):
    """Printed numbers, and the output that they stand in."""

    text: PrintedText
    window: Window

    @property
    def address(self) -> Address | None:
        return self.text.address(self.window)

    def note(self, binding: model.NumberBinding) -> Note:
        """The line, and the edit that chooses it."""
        numbers, line = self.window.numbers, self.window.line
        span = line.locate and line.locate(numbers[0].start, numbers[-1].end)
        words = self.text.words_before(self.window)
        if not words:
            return Note(f"`{plain_text(line.text)}`", span)
        target = f"{binding.script} " if binding.script else ""
        braces = f'{{out={target}"{words}"}}'
        end = binding.text_span.end
        attribute = binding.span.source.text[end : binding.span.end]
        place = binding.span.source.span(end + attribute.find("{"), binding.span.end)
        edits = (Edit(place, braces),) if attribute.endswith("}") and "{" in attribute else ()
        return Note(f"`{braces}` chooses `{plain_text(line.text)}`", span, edits)


class BoundNumber(Struct, frozen=True):
    """A binding with the outputs in which it may be found."""

    binding: model.NumberBinding
    path: str
    text: BoundText
    groups: tuple[tuple[PrintedText, ...], ...]
    """Recorded texts, then what a run printed where that counts, too."""
    addresses: tuple[Address, ...]
    """Where it held before; none where that is not known."""

    def places(self) -> list[PrintedPlace]:
        """Where it holds: in recorded text, or else in the run."""
        for texts in self.groups:
            places = self.look_up(texts)
            if places and all(self.text.shows(place.window) for place in places):
                return places
        return []

    def look_up(self, texts: Sequence[PrintedText]) -> list[PrintedPlace]:
        """The numbers at its addresses; those that it may mean where none is known.

        None where one of the addresses is gone.
        """
        count, words = len(self.text.numbers), self.binding.words
        if words:
            return [PrintedPlace(text, w) for text in texts for w in text.find_words(words, count)]
        if self.addresses:
            places = [_find(address, texts, count) for address in self.addresses]
            return [place for place in places if place is not None] if all(places) else []
        by_line = {id(line): text for text in texts for line in text.lines}
        lines = [line for text in texts for line in text.lines]
        windows = self.text.candidates(lines, following_text(self.binding))
        return [PrintedPlace(by_line[id(window.line)], window) for window in windows]


def _find(address: Address, texts: Iterable[PrintedText], count: int) -> PrintedPlace | None:
    places = (
        PrintedPlace(text, w) for text in texts if (w := text.find(address, count)) is not None
    )
    return next(places, None)


def following_text(binding: model.NumberBinding) -> str:
    """What stands behind a binding, also on the next line of a quotation, or its own unit."""
    end = binding.span.end
    return binding.unit or _LINE_END.sub(" ", binding.span.source.text[end : end + 80])


_LINE_END = re.compile(r"(?<!\n)\n[ \t>]*(?!\n)")


def _read_text(binding: model.NumberBinding, texts: Iterable[PrintedText]) -> BoundText:
    """The text of a binding; a comma in it may stand before decimals, or part numbers."""
    with_comma, as_printed = BoundText.of(binding.text, binding.comma), BoundText.of(binding.text)
    if not with_comma.comma:
        return as_printed
    lines = [line for text in texts for line in text.lines]
    is_list = as_printed.is_in(lines) and not with_comma.is_in(lines)
    return as_printed if is_list else with_comma


def _run_texts(
    outputs: PrintedOutputs, path: str, verdicts: Sequence[Verdict]
) -> tuple[PrintedText, ...]:
    """What a script printed in this run, in the parts of these recorded outputs."""
    steady = (v for v in verdicts if v.comparison.mode is not model.Mode.VOLATILE)
    filters = [f for v in steady for f in v.comparison.own_filters]
    parts = dict.fromkeys(v.recording.part for v in verdicts) or (None,)
    return tuple(outputs.text_of_run(path, filters, part) for part in parts)


def find_texts(
    binding: model.NumberBinding, outputs: PrintedOutputs, at: tuple[Address, ...]
) -> BoundNumber:
    """A binding to a script that is known, with the outputs in which it may be found."""
    verdicts, path = outputs.of_binding(binding), outputs.script_of(binding) or ""
    run = outputs.runs.get(path)
    steady = [v for v in verdicts if v.comparison.mode is not model.Mode.VOLATILE]
    partial = any(
        v.comparison.ellipsis or isinstance(v.recording.body, model.Table) for v in steady
    )
    drifted = any(v.status == "drift" for v in steady)
    groups = [tuple(map(outputs.text, steady))]
    if (partial or drifted or not verdicts) and run is not None and run.outcome is Outcome.OK:
        groups.append(_run_texts(outputs, path, verdicts))
    texts = (text for group in groups for text in group)
    return BoundNumber(binding, path, _read_text(binding, texts), tuple(groups), at)


def follow_outputs(
    document: model.Document,
    outputs: PrintedOutputs,
    addresses: Addresses,
    text_after: Callable[[Verdict], PrintedText | None],
) -> Iterator[Edit]:
    """The edits by which bound numbers become what stands at their addresses in this run.

    `text_after` gives the lines of a recorded output as they will be; `None` where they cannot be
    written. Where an address is gone, or several of one number do not agree, nothing is written.
    """
    for binding, value in bound_values(document, outputs):
        run = outputs.runs.get(value.script)
        verdicts = outputs.of_binding(binding)
        steady = [v for v in verdicts if v.comparison.mode is not model.Mode.VOLATILE]
        if run is None or run.outcome is not Outcome.OK or (verdicts and not steady):
            continue
        bound = find_texts(binding, outputs, addresses.get(value, ()))
        texts = list(map(text_after, steady))
        if not bound.text.numbers or not (bound.addresses or binding.words) or None in texts:
            continue
        texts += _run_texts(outputs, run.path, verdicts)
        places = bound.look_up([text for text in texts if text is not None])
        rewritten = {bound.text.rewrite(place.window) for place in places}
        is_shown = all(bound.text.shows(place.window) for place in places)
        if not is_shown and len(rewritten) == 1 and (text := rewritten.pop()):
            yield Edit(binding.text_span, text)
