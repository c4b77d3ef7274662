"""Holds given numbers against their sources, and lists results that are stated and not bound.

Claims with a source are found when a document is read (`claims`), and stored with it. The others
are found when they are asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.api import Course, Diagnostic, Document, Feature, Parsed, Rule, diagnose
from coursebuild.features.truth.claims import (
    Claims,
    check_sources,
    sourced_claims,
    unbound_results,
)


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Yield an error for each number that its source does not hold."""
    claims = ((document, document.summary_of(Claims)) for document in documents)
    yield from check_sources(course, [(d, c) for d, c in claims if c is not None])


def unproven(course: Course) -> Iterator[Diagnostic]:
    """Yield a warning for each result that nothing binds."""
    for _, claims in unbound_results(course):
        for claim in claims:
            message = f"`{claim.text}` is stated, and nothing gives it"
            help = f"bind it, as in `` `{claim.text}`{{out}} ``, or name its source"
            yield diagnose("number-unproven", claim.span, message, help=help)


FEATURE = Feature(
    name="truth",
    needs=("arithmetic",),
    summary=lambda document, mathml: Parsed(sourced_claims(document)),
    check=check,
    unproven=unproven,
    rules=(
        Rule("number-unproven", "warning", "No script, formula or source gives this result."),
        Rule("given-source", "error", "A number is not in the part of the course that it names."),
    ),
)
