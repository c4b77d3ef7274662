"""Numbers that a text states and nothing binds: where a script of the lesson printed them.

1. A number is proposed to be bound where a printed one, rounded to its digits, is the same, and is
   near in words: their sentences share one, or their units are the same.
2. Where none is the same, but what is printed has words before its number that all stand before
   the number of the sentence as well, the two may contradict each other: a note says so.

Both are likely only. Nothing is written but what a human accepts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.results import Verdict
from coursebuild.core.scripts.bound_numbers import BoundText
from coursebuild.core.scripts.lines import plain_text
from coursebuild.core.scripts.printed_outputs import PrintedOutputs, end_of_body
from coursebuild.core.scripts.printed_text import PrintedPlace
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Note
from coursebuild.core.text.quantities import is_same_unit, unit_behind
from coursebuild.core.text.source import Span

_WORD = re.compile(r"[^\W\d_]{4,}")
_SENTENCE_END = re.compile(r"(?<=[.!?:])\s+(?=[^\W\d_a-z])|\n\s*\n|\n(?=[-*|>#])")
_BEFORE = 60
"""Characters before a number that say what it is."""


def find_printed(
    diagnostic: Diagnostic, document: model.Document, outputs: PrintedOutputs
) -> Diagnostic:
    """Return the diagnostic of an unbound number with the edit that binds it, or with a note."""
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
    printed_texts = [outputs.text(verdict) for verdict in verdicts]
    rivals = [
        p for text in printed_texts for p in text.places(1) if _contradicts(p, bound, before, after)
    ]
    lines = dict.fromkeys(plain_text(place.line.text) for place in rivals)
    if len(lines) != 1:
        return diagnostic
    note = Note(f"a script of this lesson printed `{next(iter(lines))}`", rivals[0].span)
    return replace(diagnostic, notes=(*diagnostic.notes, note))


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


def _contradicts(place: PrintedPlace, bound: BoundText, before: str, after: str) -> bool:
    """Whether a printed number has the words of a stated one, and is another."""
    label = _words(place.labels[place.first])
    unit, printed_unit = unit_behind(after), place.units[-1]
    has_other_unit = bool(unit and printed_unit) and not is_same_unit(unit, printed_unit)
    if not label or has_other_unit or not label <= _words(before[-_BEFORE:]):
        return False
    numbers = list(_numbers(f"{before} {after}"))
    return not bound.shows(place) and not any(number.shows(place) for number in numbers)


def _numbers(text: str) -> Iterator[BoundText]:
    for word in re.findall(r"[-+\u2212]?\d+(?:[.,]\d+)*", text):
        number = BoundText.of(word)
        if len(number.numbers) == 1:
            yield number
