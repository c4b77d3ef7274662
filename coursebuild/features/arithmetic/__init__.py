"""Arithmetic in formulas: what numbers come to, and identities that are to hold."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.checks.formulas import formula_texts
from coursebuild.core.features import Feature, Mathml
from coursebuild.core.model import Course, Document
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.rules import Rule
from coursebuild.core.text.source import Span
from coursebuild.features.arithmetic.chains import check_arithmetic


class UnreadArithmetic(Struct, frozen=True):
    """What is not understood in the formulas of a document, and where."""

    places: tuple[tuple[Span, str], ...]


def summary(document: Document, mathml: Mathml) -> Parsed[UnreadArithmetic | None]:
    """What is not understood, and numbers that do not come out."""
    unread: list[tuple[Span, str]] = []
    wrong: list[Diagnostic] = []
    for tex in formula_texts(document):
        for found in check_arithmetic(tex.text):
            span, message = tex.span(found.start, found.end), found.message
            if found.kind == "wrong":
                wrong.append(diagnose("formula-arithmetic", span, message, help=found.help))
            elif found.kind == "unread":
                unread.append((span, message))
    return Parsed(UnreadArithmetic(tuple(unread)) if unread else None, tuple(wrong))


def unproven(course: Course) -> Iterator[Diagnostic]:
    """Arithmetic that is not understood."""
    for document in course.documents:
        found = (document.summaries or {}).get("arithmetic")
        for span, reason in found.places if isinstance(found, UnreadArithmetic) else ():
            yield diagnose("formula-unread", span, f"this is not computed: {reason}")


FEATURE = Feature(
    name="arithmetic",
    summary=summary,
    unproven=unproven,
    rules=(
        Rule("formula-arithmetic", "error", "A number in a formula is not what comes out."),
        Rule("formula-unread", "warning", "Arithmetic in a formula is not understood."),
    ),
)
