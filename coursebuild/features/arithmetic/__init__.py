"""Checks formulas: arithmetic between numbers, and identities between symbols."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.core.checks.formulas import formula_texts
from coursebuild.core.features import Feature, Mathml
from coursebuild.core.model import (
    Course,
    Document,
    Math,
    MathBlock,
    document_blocks,
    document_inlines,
)
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.rules import Rule
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.core.text.units import Dimension, find_unit
from coursebuild.features.arithmetic.chains import FormulaComparison, check_arithmetic
from coursebuild.features.arithmetic.expressions import NotUnderstood
from coursebuild.features.arithmetic.identities import check_identity
from coursebuild.features.arithmetic.tex import read_expression


class FormulaSummary(Struct, frozen=True):
    """What checks of the whole course need of a document's formulas."""

    unread: tuple[tuple[Span, str], ...]
    """Places of arithmetic that is not understood, and the reasons."""
    symbols: tuple[tuple[str, str], ...]
    """Symbols whose meaning the document declares, and their units."""
    identities: tuple[Excerpt, ...]
    """Formulas whose label says `check`."""


def summary(document: Document, mathml: Mathml) -> Parsed[FormulaSummary | None]:
    """Summarize the formulas of a document; diagnostics are for numbers that are wrong."""
    unread: list[tuple[Span, str]] = []
    diagnostics: list[Diagnostic] = []
    for tex in formula_texts(document):
        for comparison in check_arithmetic(tex.text):
            span, message = tex.span(comparison.start, comparison.end), comparison.message
            if comparison.kind == "wrong":
                mistake = diagnose("formula-arithmetic", span, message, help=comparison.help)
                diagnostics.append(mistake)
            elif comparison.kind == "unread":
                unread.append((span, message))
    symbols = tuple(_read_symbols(document))
    identities = tuple(_read_identities(document))
    is_empty = not (unread or symbols or identities)
    formulas = None if is_empty else FormulaSummary(tuple(unread), symbols, identities)
    return Parsed(formulas, tuple(diagnostics))


def _read_symbols(document: Document) -> Iterator[tuple[str, str]]:
    for inline in document_inlines(document):
        if isinstance(inline, Math) and inline.meaning is not None:
            tex = inline.tex.text
            with contextlib.suppress(NotUnderstood):
                expression = read_expression(tex, 0, len(tex))
                if expression.kind == "symbol":
                    yield expression.text, inline.meaning.unit


def _read_identities(document: Document) -> Iterator[Excerpt]:
    formulas: list[Math | MathBlock] = [i for i in document_inlines(document) if type(i) is Math]
    formulas += [block for block in document_blocks(document) if isinstance(block, MathBlock)]
    return (
        math.tex for math in formulas if math.label is not None and math.label.check is not None
    )


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each identity that does not hold or is not understood."""
    summaries = [_summary_of(document) for document in course.documents]
    for document in documents:
        document_summary = _summary_of(document)
        if document_summary is None or not document_summary.identities:
            continue
        units: dict[str, set[str]] = {}
        for summary in summaries:
            for name, unit in summary.symbols if summary is not None else ():
                units.setdefault(name, set()).add(unit)
        units |= {name: {unit} for name, unit in document_summary.symbols}
        unique = {name: find_unit(min(all)) for name, all in units.items() if len(all) == 1}
        dimensions = {name: unit.dimension for name, unit in unique.items() if unit is not None}
        for tex in document_summary.identities:
            for comparison in _check_identity(tex.text, frozenset(dimensions.items())):
                span, message = tex.span(comparison.start, comparison.end), comparison.message
                if comparison.kind != "wrong":
                    message = f"not understood: {message}"
                yield diagnose("formula-identity", span, message)


@functools.lru_cache(maxsize=256)
def _check_identity(
    tex: str, dimensions: frozenset[tuple[str, Dimension]]
) -> tuple[FormulaComparison, ...]:
    """Cached, since it is the slowest check while a lesson is edited."""
    return tuple(check_identity(tex, dict(dimensions)))


def _summary_of(document: Document) -> FormulaSummary | None:
    summary = (document.summaries or {}).get("arithmetic")
    return summary if isinstance(summary, FormulaSummary) else None


def unproven(course: Course) -> Iterator[Diagnostic]:
    """Yield a warning for each place of arithmetic that is not understood."""
    for document in course.documents:
        summary = _summary_of(document)
        for span, reason in summary.unread if summary is not None else ():
            yield diagnose("formula-unread", span, f"this is not computed: {reason}")


FEATURE = Feature(
    name="arithmetic",
    summary=summary,
    check=check,
    unproven=unproven,
    rules=(
        Rule("formula-arithmetic", "error", "A number in a formula is not what comes out."),
        Rule("formula-identity", "error", "A formula that says `check` does not hold, or may not."),
        Rule("formula-unread", "warning", "Arithmetic in a formula is not understood."),
    ),
)
