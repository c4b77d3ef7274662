"""`coursebuild explain FILE:LINE`: where the values that a line of a lesson shows come from.

Nothing is run: an address is what was remembered when the value last held, or else is found in the
recorded text.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.model import Course, Document, NumberBinding, Table, find_inlines
from coursebuild.core.model.lesson_record import known_addresses
from coursebuild.core.scripts.bindings import check_bindings
from coursebuild.core.scripts.bound_places import BoundNumber, bound_values
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.scripts.printed_text import describe_line
from coursebuild.core.scripts.table_cells import table_rows
from coursebuild.core.scripts.tables import row_values
from coursebuild.core.text.characters import printable
from coursebuild.core.text.source import Span
from coursebuild.pipeline.options import UsageError
from coursebuild.report.text import location
from coursebuild.report.values import plural


class ValueOrigin(Struct, frozen=True):
    """Where a shown value comes from."""

    text: str
    script: str = ""
    """Empty for one that its author gives."""
    places: tuple[str, ...] = ()
    """The printed line in words, and the place in it; several where the author chose none."""
    recorded: tuple[str, ...] = ()
    """Where these are recorded in the lesson."""
    source: str = ""
    """That of a given value."""


def value_origins(course: Course, path: str, line: int) -> tuple[ValueOrigin, ...]:
    """The values that a line of a lesson or page shows."""
    document = next((d for _, d in course.shown_texts if d.source.path == path), None)
    if document is None:
        raise UsageError(f"{path} is no lesson or page of this course, and binds no number")
    if line > len(document.source.line_starts):
        raise UsageError(f"{path} has no line {line}")
    paths = [extraction.path for extraction in extract(course).value]
    addresses = known_addresses(course.records)
    outputs = PrintedOutputs(verify(course, (), addresses), (), paths)
    check_bindings(document, outputs, addresses)

    def is_there(span: Span) -> bool:
        return span.line <= line <= span.end_line

    origins = [*_given_values(document)]
    for binding, value in bound_values(document, outputs):
        at = addresses.get(value, ())
        bound = BoundNumber(binding, outputs, at)
        places = [place for texts in bound.groups for place in bound.look_up(texts)]
        spans = [place.span for place in places if place.span is not None]
        texts = tuple(f"number {a.place + 1} of {describe_line(a)}" for a in at)
        origin = ValueOrigin(binding.text, value.script, texts, tuple(map(location, spans)))
        origins.append((binding.span, origin))
    for verdict in outputs.of_document(document):
        body, filters = verdict.recording.body, verdict.comparison.filters
        rows = table_rows(body, filters) if isinstance(body, Table) else ()
        for row, value in zip(rows, row_values(document, verdict.recording, filters), strict=True):
            at = addresses.get(value, ())
            texts = tuple(f"number {a.place + 1} of {describe_line(a)}" for a in at)
            span = row[0].cell.span.to(row[-1].cell.span)
            origins.append((span, ValueOrigin(value.text, value.script, texts)))
    return tuple(origin for span, origin in origins if is_there(span))


def _given_values(document: Document) -> Iterator[tuple[Span, ValueOrigin]]:
    for number in find_inlines(document, NumberBinding):
        if number.source is not None:
            source = number.source or "no source"
            yield number.span, ValueOrigin(number.text, source=source)


def origins_text(place: str, origins: tuple[ValueOrigin, ...]) -> str:
    """What is known of the values on a line, as text for people."""
    lines = [f"{printable(place)} shows {plural(len(origins), 'value') if origins else 'no value'}"]
    for origin in origins:
        if not origin.script:
            answer = f"given: {origin.source}" if origin.source else "bound to no script"
            lines.append(f"  `{printable(origin.text)}` is {answer}")
            continue
        places = origin.places or ("a line that is not known yet: run `coursebuild check`",)
        lines.append(f"  `{printable(origin.text)}` is printed by {printable(origin.script)}")
        lines += [f"    {printable(text)}" for text in places]
        lines += [f"    recorded at {printable(at)}" for at in origin.recorded]
    return "\n".join(lines) + "\n"
