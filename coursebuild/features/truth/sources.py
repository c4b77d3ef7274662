"""Numbers that are given with a file of the course as their source: the file must hold them.

Entry points: `named_numbers`, for a document; `check_sources`, for the course. A source that is no
path is for readers to judge. A file may have a number in the unit of the text or in base units, and
with more digits; a model may have half of it, since MJCF writes radii and half-lengths.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.scripts.numbers import scan_prose
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.source import Span
from coursebuild.core.text.units import find_unit
from coursebuild.features.arithmetic.expressions import Expression
from coursebuild.features.arithmetic.numerals import read_numeral
from coursebuild.features.arithmetic.statements import read_statements

_PATH = re.compile(r"[\w.-]+(?:/[\w.-]+)+\.[a-z]+")
_NUMBER = re.compile(r"(?<![\w.])(?:\d+(?:_\d{3})*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_UNIT = re.compile(r"\s*([^\W\d][^\d]*|°|%)$")


class NamedNumber(Struct, frozen=True):
    """A number whose source is a file."""

    span: Span
    path: str
    text: str
    values: tuple[tuple[float, float], ...]
    """Its value and one unit of its last place: as literals, and in base units."""

    def is_in(self, numbers: Iterable[float]) -> bool:
        """Whether one of these, rounded to its digits, is this number."""
        return any(
            2 * abs(abs(number) - abs(value)) <= step * (1 + 1e-9)
            for number in numbers
            for value, step in self.values
        )


def named_numbers(inlines: Iterable[model.Inline]) -> Iterator[NamedNumber]:
    """Yield the numbers of a document whose source is a path."""
    for inline in inlines:
        source = getattr(inline, "source", None) or ""
        if _PATH.fullmatch(source) is None:
            continue
        if isinstance(inline, model.NumberBinding):
            numbers = tuple(scan_prose(inline.text))
            unit_text = _UNIT.search(inline.text, numbers[-1].end) if numbers else None
            unit = find_unit(unit_text[1]) if unit_text is not None else None
            size = float(unit.size) if unit is not None else 1.0
            for number in numbers:
                value, step = float(number.value), 10.0**number.place
                values = (value, step), (value * size, step * size)
                yield NamedNumber(inline.text_span, source, number.text, values)
        elif isinstance(inline, model.Math):
            sides = (s for statement in read_statements(inline.tex.text) for s in statement.sides)
            for side in sides:
                expression = side.expression if side.is_numeric else None
                numeral = read_numeral(expression) if isinstance(expression, Expression) else None
                if numeral is not None:
                    pair, size = (
                        (float(numeral.value), float(numeral.step)),
                        float(numeral.unit_size),
                    )
                    values = (pair[0] / size, pair[1] / size), pair
                    text = inline.tex.text[side.start : side.end].strip()
                    yield NamedNumber(inline.tex.span(side.start, side.end), source, text, values)


def check_sources(course: model.Course, numbers: Iterable[NamedNumber]) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each number that its file does not hold."""
    scripts = (s for document in course.documents for s in model.document_scripts(document))
    texts = {f"models/{file.name}.xml": file.source.text for file in course.models}
    texts |= {script.path: script.code.text for script in scripts}
    numbers_by_path: dict[str, set[float]] = {}
    for number in numbers:
        if number.path not in texts:
            message = f"`{number.path}` is no script and no model of this course"
            help = did_you_mean(number.path, texts)
            yield diagnose("given-source", number.span, message, help=help)
            continue
        if number.path not in numbers_by_path:
            matches = _NUMBER.finditer(texts[number.path])
            literals = {float(match[0].replace("_", "").rstrip(".")) for match in matches}
            doubles = {2 * value for value in literals if number.path.endswith(".xml")}
            numbers_by_path[number.path] = literals | doubles
        if not number.is_in(numbers_by_path[number.path]):
            message = f"`{number.path}` has no number `{number.text}`"
            help = "bind the number to an output, or name where it is from"
            yield diagnose("given-source", number.span, message, help=help)
