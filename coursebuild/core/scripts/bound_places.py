"""Where a bound number is found in the outputs of its script, and how it follows a new output.

1. Where its address is known (see `printed_text`), what stands there counts, and nothing else. The
   words of `{out="words"}` are an address where they are printed before one number only; of several
   they choose.
2. Else it is sought, by `candidates` alone. Text next to the numbers (a unit, a name) narrows the
   choice, then the unit behind the binding, then digits that are printed exactly so. What is found
   at two places has both as addresses, and follows where they agree; it is ambiguous if they are
   not of one quantity.
3. Recorded text decides, whatever this run printed. The run counts where recorded text leaves
   things out (`...`, tables), and for a number that is not in a text that has drifted.
4. A number that nothing binds is proposed to be bound (`find_printed`) where a printed one, rounded
   to its digits, is the same, and is near in words: their sentences share one, or their units are
   the same. This is likely only: nothing is written but what a human accepts.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.lesson_record import Address, Addresses, ShownValue, shown_values
from coursebuild.core.model.results import Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.bound_numbers import BoundText
from coursebuild.core.scripts.lines import masked, plain_text
from coursebuild.core.scripts.printed_outputs import PrintedOutputs, end_of_body
from coursebuild.core.scripts.printed_text import PrintedPlace, PrintedText
from coursebuild.core.scripts.table_cells import ColumnTitle, row_values
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Note
from coursebuild.core.text.numbers import part_thousands
from coursebuild.core.text.quantities import is_same_unit, unit_behind, unit_of_label
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span


def document_bindings(document: model.Document) -> tuple[model.NumberBinding, ...]:
    """The bound numbers of a document, in order: also in footnotes, tables and quizzes.

    One that ends its cell in a table has the unit of the column. One that depends on an output
    without a readable script is left out: that mistake is reported by itself.
    """
    units = {
        inline.span.start: ColumnTitle.of(header).unit.text
        for table in model.find_blocks(document, model.Table)
        for row in table.rows
        for cell, header in zip(row, table.header, strict=False)
        for inline in model.walk_inlines(cell.children)
        if isinstance(inline, model.NumberBinding) and _ends_cell(inline, cell)
    }
    recordings = model.find_blocks(document, model.Recording)
    outputs = sorted((recording.span.start, bool(recording.script)) for recording in recordings)
    return tuple(
        replace(b, unit=b.unit or units.get(b.span.start, ""))
        for b in model.find_inlines(document, model.NumberBinding)
        if b.source is None
        and (b.script or [True, *(is_read for at, is_read in outputs if at < b.span.start)][-1])
    )


def _ends_cell(binding: model.NumberBinding, cell: model.Cell) -> bool:
    """Whether nothing but marks stands behind a number; in a formula it is all, or the result."""
    text, span = cell.span.source.text, binding.span
    ends = _MARKS.fullmatch(text[span.end : cell.span.end]) is not None
    formula = text[cell.span.start : span.start].rpartition("$")[2]
    return ends and (not binding.is_in_formula or _RELATION.fullmatch(formula) is not None)


_MARKS = regex(r"[\s*_~$]*")
_RELATION = regex(r"(?:.*(?:[=≈]|\\approx))?\s*")


def bound_values(
    document: model.Document, outputs: PrintedOutputs
) -> tuple[tuple[model.NumberBinding, ShownValue], ...]:
    """The bound numbers of a document with what tells them apart, wherever their lines move."""
    bindings = document_bindings(document)
    texts = []
    for binding in bindings:
        text, start = binding.span.source.text, binding.span.start
        paragraph = re.split(r"\n\s*\n", text[max(0, start - 200) : start])[-1]
        words = " ".join(masked(_MARKUP.sub("", paragraph)).split()[-_CONTEXT:])
        script = outputs.script_of(binding) or ""
        texts.append((document.source.path, script, words, binding.text))
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


def moved_values(
    document: model.Document, outputs: PrintedOutputs, before: Addresses, now: Addresses
) -> Iterator[str]:
    """What is to be told of bound numbers that show another printed number than before.

    What they showed stands in the document no more; the words before them are as they were. Where
    the words of an author choose the new number, and not the old one, it is no mistake.
    """
    pairs = bound_values(document, outputs)
    lost = before.keys() - {value for _, value in pairs}
    new = [pair for pair in pairs if pair[1] in now.keys() - before.keys()]
    of_place: dict[ShownValue, list[ShownValue]] = {}
    for value in (*lost, *(value for _, value in new)):
        of_place.setdefault(replace(value, text=""), []).append(value)
    for binding, value in new:
        old, *rest = of_place[replace(value, text="")]
        if rest != [value] or old not in before:
            continue
        bound = BoundNumber(binding, outputs, now[value])
        was = BoundNumber(replace(binding, text=old.text), outputs, before[old]).places()
        place = bound.places()[0]
        lead = f"`{old.text}` gave way to `{binding.text}` in line {binding.span.line}, which"
        if any(n.place < p.place for n, p in zip(bound.text.numbers, place.numbers, strict=True)):
            yield f"{lead} has more digits than are printed: {place.text}"
        elif was and not {*before[old]} & {*now[value]}:
            yield f"{lead} is printed elsewhere: {place_note(binding, place, was).message}"


def reworded_addresses(
    addresses: Addresses, verdicts: Iterable[Verdict], outputs: PrintedOutputs
) -> Addresses:
    """The addresses in recorded outputs of which this run prints other words, and no other number.

    Each number then stands in its line as before, so that what it is called now is its address. Not
    so where words moved to another line: then nobody knows whether lines changed places.
    """
    texts: dict[str, list[tuple[PrintedText, PrintedText]]] = {}
    for verdict in verdicts:
        script, part = verdict.recording.script or "", verdict.recording.part
        if isinstance(verdict.recording.body, model.Table) or verdict.status != "drift":
            continue
        before = outputs.text(verdict)
        now = outputs.text_of_run(script, verdict.comparison.own_filters, part)
        old, new = before.words, now.words
        pairs = zip(old, new, strict=False)
        # No line has the words that another line had before.
        are_new = all(a == b or (a not in new and b not in old) for a, b in pairs)
        if before.numbers == now.numbers and are_new:
            texts.setdefault(script, []).append((before, now))
    reworded = {
        value: tuple(_reword(address, texts[value.script]) for address in places)
        for value, places in addresses.items()
        if value.script in texts
    }
    return {value: now for value, now in reworded.items() if now != addresses[value]}


def _reword(address: Address, texts: Iterable[tuple[PrintedText, PrintedText]]) -> Address:
    for before, now in texts:
        if (place := before.find(address, 1)) is not None:
            numbers = now.lines[place.at].numbers[place.first : place.first + 1]
            return PrintedPlace(now, place.at, numbers).address or address
    return address


_MARKUP = regex(r"\{[^{}]*\}|[`*_$]")
_CONTEXT = 5
"""The words before a binding by which it is known again."""


def place_note(
    binding: model.NumberBinding, place: PrintedPlace, rivals: Iterable[PrintedPlace]
) -> Note:
    """The line of a printed number, and the edit that chooses it among others."""
    line = plain_text(place.line.text)
    words = place.output.words_before(place, rivals)
    is_lost = binding.is_in_formula and (
        "$" in words or "\\" in words
    )  # which would end or change it
    if not words or is_lost:
        return Note(f"`{line}`", place.span)
    mark = binding.mark(binding.script or "", words)
    return Note(f"`{mark}` chooses `{line}`", place.span, mark_edits(binding, mark))


def mark_edits(binding: model.NumberBinding, mark: str) -> tuple[Edit, ...]:
    """The edit that writes another mark at a bound number; none where it has no braces."""
    source, start, end = binding.span.source, binding.span.start, binding.text_span.end
    if binding.is_in_formula:
        opening = source.span(start, binding.text_span.start - 1)
        backslashes = opening.text.partition("out")[0]  # two in a string of JSON
        return (Edit(opening, f"{backslashes}{mark[1:]}"),)
    attribute = source.text[end : binding.span.end]
    braces = source.span(end + attribute.find("{"), binding.span.end)
    is_whole = attribute.endswith("}") and "{" in attribute
    is_whole &= binding.span.contains(binding.text_span)  # and not in a formula
    quoted_mark = mark.replace('"', '\\"') if binding.in_string else mark
    return (Edit(braces, quoted_mark),) if is_whole else ()


class BoundNumber(Struct, frozen=True, dict=True):
    """A binding with the outputs in which it may be found."""

    binding: model.NumberBinding
    outputs: PrintedOutputs
    addresses: tuple[Address, ...] = ()
    """Where it held before; none where that is not known."""

    @cached_property
    def verdicts(self) -> list[Verdict]:
        """The recorded outputs that it depends on."""
        return self.outputs.of_binding(self.binding)

    @property
    def path(self) -> str:
        """The script that it depends on; empty where there is none above it."""
        return self.outputs.script_of(self.binding) or ""

    @property
    def run(self) -> ScriptRun | None:
        return self.outputs.runs.get(self.path)

    @property
    def ran_well(self) -> bool:
        return self.run is not None and self.run.outcome is Outcome.OK

    @cached_property
    def steady(self) -> list[Verdict]:
        """Those of the recorded outputs that are compared."""
        return [v for v in self.verdicts if v.comparison.mode is not model.Mode.VOLATILE]

    @cached_property
    def recorded(self) -> list[PrintedText]:
        return list(map(self.outputs.text, self.steady))

    @property
    def printed(self) -> list[PrintedText]:
        """What this run printed in the parts of the recorded outputs; nothing if it failed."""
        filters = [f for v in self.steady for f in v.comparison.own_filters]
        parts = dict.fromkeys(v.recording.part for v in self.verdicts) or (None,)
        texts = (self.outputs.text_of_run(self.path, filters, part) for part in parts)
        return list(texts) if self.ran_well else []

    @cached_property
    def groups(self) -> list[list[PrintedText]]:
        """Recorded texts, then what the run printed where that counts, too."""
        counts = not self.verdicts or any(
            v.comparison.ellipsis
            or v.status == "drift"
            or isinstance(v.recording.body, model.Table)
            for v in self.steady
        )
        return [self.recorded, self.printed] if counts and self.ran_well else [self.recorded]

    @cached_property
    def text(self) -> BoundText:
        """Its text; a comma or a space between its digits may belong to one number, or part two.

        One that may be either is two numbers only where these are recorded, and not the one. In a
        language with a decimal comma, a point parts thousands where a whole number is printed.
        """
        binding, texts = self.binding, [text for group in self.groups for text in group]
        number_text = BoundText.of(binding.text, binding.comma, may_join=True)
        for comma in (False, binding.comma):
            several = BoundText.of(binding.text, comma)
            if (
                len(several.numbers) > len(number_text.numbers)  # not `4,096`
                and several.is_in(self.recorded)
                and not number_text.is_in(texts)
            ):
                return several
        grouped_text = part_thousands(binding.text)
        if grouped_text == binding.text or not binding.comma:
            return number_text
        single = replace(BoundText.of(grouped_text), comma=",")
        count, words = len(single.numbers), binding.words
        places = [place for a in self.addresses if (place := _find(a, texts, count)) is not None]
        places += (p for text in texts if words for p in text.find_words(words, count))
        is_whole = bool(places) and all(n.is_integer for p in places for n in p.numbers)
        is_shown = single.is_in(texts) and not number_text.is_in(texts)
        return single if is_whole or is_shown else number_text

    @property
    def following(self) -> str:
        """What stands behind it, also on the next line of a quotation, or its own unit.

        Where no unit stands there, the one of a label that ends before it, as in `v (m/s):`.
        """
        text, end = self.binding.span.source.text, self.binding.span.end
        rest = self.binding.unit or _LINE_END.sub(" ", text[end : end + 80].removeprefix("$"))
        label = text[: self.binding.span.start].rpartition("\n")[2].rstrip(" *_")
        is_label = label.endswith((":", "=")) and not unit_behind(rest)
        is_label &= not self.binding.is_in_formula
        return (is_label and unit_of_label(label).text) or rest

    def places(self) -> list[PrintedPlace]:
        """Where it holds: in recorded text, or else in the run, if only that has its unit."""
        choices: list[list[PrintedPlace]] = []
        for outputs in self.groups:
            places = self.look_up(outputs)
            if places and all(map(self.text.shows, places)):
                choices.append(places)
        of_unit = (p for p in choices if self.text.wrong_unit(p, self.following) is None)
        return next(of_unit, choices[0] if choices else [])

    @property
    def current_places(self) -> list[PrintedPlace]:
        """The numbers at its addresses in recorded text, or else in the run."""
        return next(filter(None, map(self.look_up, self.groups)), [])

    def look_up(self, outputs: Sequence[PrintedText]) -> list[PrintedPlace]:
        """The numbers at its addresses; those that it may mean where none is known.

        None where one of the addresses is gone.
        """
        count, words = len(self.text.numbers), self.binding.words
        at_addresses = [_find(address, outputs, count) for address in self.addresses]
        places = [place for place in at_addresses if place is not None]
        if not words:
            is_gone = len(places) < len(at_addresses)
            return [] if is_gone else places or self.text.candidates(outputs, self.following)
        behind_words = [p for output in outputs for p in output.find_words(words, count)]
        if len(behind_words) == 1:
            return behind_words
        known_places = [place for place in places if place in behind_words]
        chosen_places = known_places or [*filter(self.text.shows, behind_words)] or behind_words
        called_places = [p for p in chosen_places if p.output.is_called(p.at, p.first, words)]
        return called_places or chosen_places

    def contradicts_words(
        self, places: Sequence[PrintedPlace], outputs: Sequence[PrintedText]
    ) -> bool:
        """Whether it is printed where it was, and its words choose other numbers now."""
        count = len(self.text.numbers)
        known_places = [_find(address, outputs, count) for address in self.addresses]
        is_known = bool(self.binding.words) and any(known_places)
        return is_known and not any(place in places for place in known_places)

    def contradicts_itself(
        self, places: Sequence[PrintedPlace], outputs: Sequence[PrintedText]
    ) -> bool:
        """Whether its words choose one number, and it shows another printed one, or the negative.

        It has not held yet, so only a human knows which of the two is meant.
        """
        if self.addresses or not places or all(map(self.text.shows, places)):
            return False
        unsigned = [re.sub("[-−+]", "", t) for t in (self.text.text, self.text.rewrite(places[0]))]
        return unsigned[0] == unsigned[1] or self.text.bare.is_in(outputs)


_LINE_END = regex(r"(?<!\n)\n[ \t>]*(?!\n)")


def _find(address: Address, outputs: Iterable[PrintedText], count: int) -> PrintedPlace | None:
    places = (output.find(address, count) for output in outputs)
    return next((place for place in places if place is not None), None)


_WORD = regex(r"[^\W\d_]{4,}")
_SENTENCE_END = regex(r"(?<=[.!?:])\s+(?=[^\W\d_a-z])|\n\s*\n|\n(?=[-*|>#])")


def find_printed(
    diagnostic: Diagnostic, document: model.Document, outputs: PrintedOutputs
) -> Diagnostic:
    """Return the diagnostic of an unbound number with the edit that binds it."""
    span = diagnostic.span
    texts = model.find_inlines(document, model.Text)
    if not any(text.span.contains(span) for text in texts):  # in a formula, in code
        return diagnostic
    bound = BoundText.of(span.text, document.comma)
    if len(bound.numbers) != 1:
        return diagnostic
    before, after = _sentence(span)
    verdicts = outputs.of_document(document)
    above = [verdict for verdict in verdicts if end_of_body(verdict) <= span.start]
    groups: list[tuple[str, Sequence[Verdict]]] = [("", above[-1:])]
    paths = dict.fromkeys(v.recording.script or "" for v in (*reversed(above), *verdicts))
    groups += ((path, [v for v in verdicts if v.recording.script == path]) for path in paths)
    for path, group in groups:
        printed = list(map(outputs.text, group))
        places = bound.candidates(printed, after)
        near_places = [p for p in places if _is_near(p, before, after)]
        if not near_places:
            continue
        place = max(near_places, key=lambda p: len(_words(_context(p)) & _words(before + after)))
        if target := _target(path, place, places):
            script = path or group[0].recording.script
            help = f"`{script}` printed it: `{plain_text(place.line.text)}`"
            edits = (Edit(span, f"`{span.text}`{target}"),)
            return replace(diagnostic, help=f"{help}; write `` {edits[0].text} ``", edits=edits)
    return diagnostic


def _target(path: str, place: PrintedPlace, places: Sequence[PrintedPlace]) -> str:
    """The attribute that binds a number to a printed one; empty where none tells it from others."""
    quantities = {rival.quantity() for rival in places}
    words = ""
    if len(places) > 1 and len(quantities) > 1:
        words = place.output.words_before(place, places)
        if not words or "`" in words:  # which would begin code
            return ""
    value = " ".join((*([path] if path else []), *([f'"{words}"'] if words else [])))
    return f"{{out={value}}}" if value else "{out}"


def _sentence(span: Span) -> tuple[str, str]:
    """What stands before and behind a number in its sentence."""
    text = span.source.text
    before = _SENTENCE_END.split(text[max(0, span.start - 400) : span.start])[-1]
    return before, _SENTENCE_END.split(text[span.end : span.end + 400])[0]


def _words(text: str) -> set[str]:
    return {word.casefold() for word in _WORD.findall(text)}


def _context(place: PrintedPlace) -> str:
    return f"{place.output.headings(place.at)} {place.output.heading(place.at)} {place.line.text}"


def _is_near(place: PrintedPlace, before: str, after: str) -> bool:
    unit = unit_behind(after)
    if unit and is_same_unit(unit, place.units[-1]):
        return True
    return bool(_words(_context(place)) & _words(before + after))
