"""Checks formulas: numbers, symbols with values, units, and identities between symbols.

What computes is imported when there is a formula: it takes a tenth of a small course's check.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from msgspec import Struct

from coursebuild.api import (
    Course,
    Diagnostic,
    Document,
    Excerpt,
    Feature,
    Fix,
    Mathml,
    Parsed,
    Rule,
    Span,
    diagnose,
)
from coursebuild.core.model import find_formulas
from coursebuild.core.text.units import Dimension, find_unit

if TYPE_CHECKING:
    from coursebuild.features.arithmetic.evaluate import FormulaComparison

_OTHER_NUMBERS = (
    "where other numbers are meant, as in floating-point, binary or remainders, write"
    ' `{%sgiven="IEEE 754"}` or the like after the formula'
)


class FormulaSummary(Struct, frozen=True):
    """What checks of the whole course need of a document's formulas."""

    symbols: tuple[tuple[str, str], ...]
    """Symbols whose meaning the document declares, and their units."""
    identities: tuple[tuple[Excerpt, str, Span], ...]
    """Formulas whose label says `check`, their domains and where these stand."""
    results: tuple[tuple[Span, Span], ...] = ()
    """The sides of relations that hold, or whose dimensions fit, each with the sign between."""


def summary(document: Document, mathml: Mathml) -> Parsed[FormulaSummary | None]:
    """Summarize the formulas of a document; diagnostics are for numbers that are wrong."""
    if not find_formulas(document):
        return Parsed(None)
    from coursebuild.features.arithmetic.symbol_values import check_formulas, read_symbols

    identities: list[tuple[Excerpt, str, Span]] = []
    results: list[tuple[Span, Span]] = []
    symbols, comparisons = read_symbols(document), check_formulas(document)
    diagnostics = list(symbols.diagnostics)
    for _, formula in find_formulas(document):
        tex = formula.tex
        label, is_inline = formula.label, not formula.display
        if label is not None and label.domain is not None:
            identities.append((tex, label.conditions or "", label.domain.span()))
        for comparison in comparisons.get(tex.span().start, ()):
            span, message = tex.span(comparison.start, comparison.end), comparison.message
            if comparison.sign is not None:
                start, end = comparison.sign
                results.append((tex.span(comparison.start, end), tex.span(start, comparison.end)))
            elif comparison.kind == "wrong":
                point = "{,}" if "{,}" in span.text else "."
                texts = (span.text.replace(point, "."), comparison.result)
                are_plain = all(re.fullmatch(r"-?[\d.]+", text) for text in texts)
                label_text = "" if is_inline else "#eq:name "
                help = "; ".join(filter(None, (comparison.help, _OTHER_NUMBERS % label_text)))
                fix = Fix(help, comparison.result.replace(".", point) if are_plain else None)
                mistake = diagnose("formula-arithmetic", span, message, help=fix)
                diagnostics.append(mistake)
    units = tuple((symbol.name, symbol.unit_text) for symbol in symbols.declarations.values())
    formulas = FormulaSummary(units, tuple(identities), tuple(results))
    is_empty = not (units or identities or results)
    return Parsed(None if is_empty else formulas, tuple(diagnostics))


def proofs(document: Document) -> tuple[tuple[Span, Span], ...]:
    """Return the sides of the relations of a document that hold, or whose dimensions fit."""
    document_summary = document.summary_of(FormulaSummary)
    return () if document_summary is None else document_summary.results


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each identity that does not hold or is not understood."""
    summaries = [document.summary_of(FormulaSummary) for document in course.documents]
    for document in documents:
        document_summary = document.summary_of(FormulaSummary)
        if document_summary is None or not document_summary.identities:
            continue
        from coursebuild.features.arithmetic.expressions import NotUnderstood

        units: dict[str, set[str]] = {}
        for summary in summaries:
            for name, unit in summary.symbols if summary is not None else ():
                units.setdefault(name, set()).add(unit)
        units |= {name: {unit} for name, unit in document_summary.symbols}
        unique = {name: find_unit(min(all)) for name, all in units.items() if len(all) == 1}
        dimensions = {name: unit.dimension for name, unit in unique.items() if unit is not None}
        for tex, domain, place in document_summary.identities:
            try:
                comparisons = _compare_at_points(tex.text, domain, frozenset(dimensions.items()))
            except NotUnderstood as error:
                message = f"this condition is not computed: {error.reason}"
                help = 'write conditions on symbols, as in `check="x > 0, n \\ne 1"`'
                yield diagnose("formula-identity", place, message, help=help)
                continue
            for comparison in comparisons:
                span, message = tex.span(comparison.start, comparison.end), comparison.message
                if comparison.kind != "wrong":
                    message = f"this is not computed: {message}"
                yield diagnose("formula-identity", span, message, help=comparison.help)


@functools.lru_cache(maxsize=256)
def _compare_at_points(
    tex: str, domain: str, dimensions: frozenset[tuple[str, Dimension]]
) -> tuple[FormulaComparison, ...]:
    """Cached, since it is the slowest check while a lesson is edited."""
    from coursebuild.features.arithmetic.identities import check_identity, read_domain

    return tuple(check_identity(tex, dict(dimensions), read_domain(domain)))


FEATURE = Feature(
    name="arithmetic",
    summary=summary,
    check=check,
    proofs=proofs,
    rules=(
        Rule("formula-arithmetic", "error", "A number in a formula is not the result."),
        Rule(
            "formula-identity",
            "error",
            "A formula marked `check` does not hold, or cannot be checked.",
        ),
        Rule(
            "symbol-value", "error", "A symbol has two values in a section, or cannot have a value."
        ),
    ),
)
