"""Arithmetic in formulas: what numbers come to, and identities that are to hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.core.checks.formulas import formula_texts
from coursebuild.core.features import Feature
from coursebuild.core.model import Course, Document
from coursebuild.core.registry import note_of
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.rules import Rule
from coursebuild.core.text.source import Span
from coursebuild.features.arithmetic.chains import Finding, check_arithmetic


class PlacedFinding(Struct, frozen=True):
    """What was found in a formula, and where in the document."""

    span: Span
    finding: Finding


class ArithmeticNote(Struct, frozen=True):
    """What is to be told of the formulas of a document."""

    findings: tuple[PlacedFinding, ...]


def summary(document: Document) -> ArithmeticNote:
    """What does not hold, or was not understood."""
    return ArithmeticNote(
        tuple(
            PlacedFinding(tex.span(found.start, found.end), found)
            for tex in formula_texts(document)
            for found in check_arithmetic(tex.text)
            if found.kind != "holds"
        )
    )


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Numbers that do not come out."""
    for one in _findings(documents):
        if one.finding.kind == "wrong":
            finding = one.finding
            yield diagnose("formula-arithmetic", one.span, finding.message, help=finding.help)


def unproven(course: Course) -> Iterator[Diagnostic]:
    """Arithmetic that is not understood."""
    for one in _findings(course.documents):
        if one.finding.kind == "unread":
            message = f"this is not computed: {one.finding.message}"
            yield diagnose("formula-unread", one.span, message)


def _findings(documents: Iterable[Document]) -> Iterator[PlacedFinding]:
    for document in documents:
        yield from note_of(document, "arithmetic", ArithmeticNote, summary).findings


FEATURE = Feature(
    name="arithmetic",
    summary=summary,
    check=check,
    unproven=unproven,
    rules=(
        Rule("formula-arithmetic", "error", "A number in a formula is not what comes out."),
        Rule("formula-unread", "warning", "Arithmetic in a formula is not understood."),
    ),
)
