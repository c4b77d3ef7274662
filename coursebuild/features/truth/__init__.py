"""Holds given numbers against their sources, and lists results that are stated and not bound.

Claims with a source are found when a document is read (`claims`), and stored with it. The others
are found when they are asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.api import (
    Course,
    Diagnostic,
    Document,
    Feature,
    Mathml,
    Parsed,
    Rule,
    diagnose,
)
from coursebuild.features.truth.model import Claims


def summary(document: Document, mathml: Mathml) -> Parsed[Claims | None]:
    """The claims of a document that name a part of the course."""
    if "given" not in document.source.text:  # as a mark of a source has that word
        return Parsed(None)
    from coursebuild.features.truth.claims import sourced_claims

    return Parsed(sourced_claims(document))


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Yield an error for each number that its source does not hold."""
    claims = ((document, document.summary_of(Claims)) for document in documents)
    if sourced := [(d, c) for d, c in claims if c is not None]:
        from coursebuild.features.truth.claims import check_sources

        yield from check_sources(course, sourced)


def unproven(course: Course) -> Iterator[Diagnostic]:
    """Yield a warning for each result that nothing binds."""
    from coursebuild.features.truth.claims import unbound_results

    for _, claims in unbound_results(course):
        for claim in claims:
            message = f"`{claim.text}` is stated, and nothing gives it"
            help = f"bind it, as in `` `{claim.text}`{{out}} ``, or name its source"
            yield diagnose("number-unproven", claim.span, message, help=help)


FEATURE = Feature(
    name="truth",
    needs=("arithmetic",),
    summary=summary,
    check=check,
    unproven=unproven,
    rules=(
        Rule("number-unproven", "warning", "No script, formula or source gives this result."),
        Rule("given-source", "error", "A number is not in the part of the course that it names."),
    ),
)
