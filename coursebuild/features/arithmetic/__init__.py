"""Arithmetic in formulas: what numbers come to, and identities that are to hold."""

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
from coursebuild.features.arithmetic.chains import FormulaFinding, check_arithmetic
from coursebuild.features.arithmetic.expressions import NotUnderstood
from coursebuild.features.arithmetic.identities import check_identity
from coursebuild.features.arithmetic.tex import read_expression


class FormulaSummary(Struct, frozen=True):
    """What is to be told of the formulas of a document, beside the mistakes in them alone."""

    unread: tuple[tuple[Span, str], ...]
    """Places of arithmetic that is not understood, and why."""
    symbols: tuple[tuple[str, str], ...]
    """Symbols whose meaning the document says, and their units."""
    identities: tuple[Excerpt, ...]
    """Formulas that are to be checked."""


def summary(document: Document, mathml: Mathml) -> Parsed[FormulaSummary | None]:
    """What is to be told of its formulas, and numbers that do not come out."""
    unread: list[tuple[Span, str]] = []
    wrong: list[Diagnostic] = []
    for tex in formula_texts(document):
        for found in check_arithmetic(tex.text):
            span, message = tex.span(found.start, found.end), found.message
            if found.kind == "wrong":
                wrong.append(diagnose("formula-arithmetic", span, message, help=found.help))
            elif found.kind == "unread":
                unread.append((span, message))
    symbols = tuple(_symbols(document))
    identities = tuple(_identities(document))
    anything = unread or symbols or identities
    made = FormulaSummary(tuple(unread), symbols, identities) if anything else None
    return Parsed(made, tuple(wrong))


def _symbols(document: Document) -> Iterator[tuple[str, str]]:
    for inline in document_inlines(document):
        if isinstance(inline, Math) and inline.meaning is not None:
            tex = inline.tex.text
            with contextlib.suppress(NotUnderstood):
                found = read_expression(tex, 0, len(tex))
                if found.kind == "symbol":
                    yield found.text, inline.meaning.unit


def _identities(document: Document) -> Iterator[Excerpt]:
    formulas: list[Math | MathBlock] = [i for i in document_inlines(document) if type(i) is Math]
    formulas += [block for block in document_blocks(document) if isinstance(block, MathBlock)]
    return (one.tex for one in formulas if one.label is not None and one.label.check is not None)


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Formulas that are to be checked, and do not hold or are not understood."""
    known = {document.source.path: _summary_of(document) for document in course.documents}
    for document in documents:
        own = _summary_of(document)
        if own is None or not own.identities:
            continue
        units: dict[str, set[str]] = {}
        for summary in known.values():
            for name, unit in summary.symbols if summary is not None else ():
                units.setdefault(name, set()).add(unit)
        units |= {name: {unit} for name, unit in own.symbols}
        found = {name: find_unit(min(all)) for name, all in units.items() if len(all) == 1}
        dimensions = {name: unit.dimension for name, unit in found.items() if unit is not None}
        for tex in own.identities:
            for one in _identity_findings(tex.text, frozenset(dimensions.items())):
                message = one.message if one.kind == "wrong" else f"not understood: {one.message}"
                yield diagnose("formula-identity", tex.span(one.start, one.end), message)


@functools.lru_cache(maxsize=256)
def _identity_findings(
    tex: str, dimensions: frozenset[tuple[str, Dimension]]
) -> tuple[FormulaFinding, ...]:
    """As `check_identity`, which takes longer than all else while a lesson is being written."""
    return tuple(check_identity(tex, dict(dimensions)))


def _summary_of(document: Document) -> FormulaSummary | None:
    found = (document.summaries or {}).get("arithmetic")
    return found if isinstance(found, FormulaSummary) else None


def unproven(course: Course) -> Iterator[Diagnostic]:
    """Arithmetic that is not understood."""
    for document in course.documents:
        found = _summary_of(document)
        for span, reason in found.unread if found is not None else ():
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
