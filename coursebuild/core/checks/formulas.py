"""The formulas of a course, and diagnostics of those that do not parse.

Entry points: `course_formulas(course)`; `document_formulas` and `check_formulas` for one
document.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from coursebuild.core.model import Course, Document, find_formulas
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt


def _formula_uses(document: Document) -> Iterator[tuple[Formula, Excerpt]]:
    """Every formula with its TeX in the text; empty ones were reported by the parser."""
    for _, formula in find_formulas(document):
        if formula.tex.text.strip():
            yield Formula(formula.tex.text, formula.display), formula.tex


def course_formulas(course: Course) -> tuple[Formula, ...]:
    """Each different formula of the course, in order of first use."""
    return tuple(dict.fromkeys(f for d in course.documents for f in document_formulas(d)))


def document_formulas(document: Document) -> tuple[Formula, ...]:
    """Each different formula of one document, in order of first use."""
    return tuple(dict.fromkeys(formula for formula, _ in _formula_uses(document)))


def check_formulas(
    document: Document, typeset: Mapping[Formula, str | MathError]
) -> tuple[Diagnostic, ...]:
    """One diagnostic for each place where a formula that does not parse stands."""
    diagnostics: list[Diagnostic] = []
    if not any(isinstance(result, MathError) for result in typeset.values()):
        return ()
    for formula, tex in _formula_uses(document):
        result = typeset[formula]
        if not isinstance(result, MathError):
            continue
        span = tex.span()
        if result.position is not None:
            at = min(result.position, len(tex.text) - 1)
            span = tex.span(at, at + 1)
        diagnostics.append(
            diagnose("math-syntax", span, f"the formula does not parse: {result.message}")
        )
    return tuple(diagnostics)
