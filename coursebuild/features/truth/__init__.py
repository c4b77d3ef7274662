"""Measures how much of a course is proven: numbers that are bound, computed or given with a source.

The claims of a document are counted when it is read (`claims`), and stored with it. The fence
`truth` shows them lesson by lesson, and `[verify] truth` in the course map requires a share.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.core.features import Feature
from coursebuild.core.model import Course, Document, Lesson
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.rules import Rule
from coursebuild.features.truth.claims import Claims, course_claims, document_claims, sum_claims
from coursebuild.features.truth.sources import check_sources
from coursebuild.features.truth.table import KIND

_TEXTS = """\
[truth]
part = "Lesson or page"
numbers = "Numbers"
bound = "Printed by a script"
computed = "Computed"
given = "Given, with a source"
unsourced = "Given without a source"
open = "Unproven"
share = "Proven"
all = "All"
"""


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Yield an error if less is proven than the map asks for, or a source lacks its number."""
    yield from _check_share(course, ())
    for document in documents:
        claims = (document.summaries or {}).get("truth")
        if isinstance(claims, Claims) and claims.named:
            yield from check_sources(course, claims.named)


def check_runs(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic]:
    """Yield the same error if only numbers of scripts that were not run make up the share."""
    if not any(_check_share(course, ())):
        yield from _check_share(course, runs)


def _check_share(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic]:
    if course.truth is None:
        return
    claims = sum_claims(claims for _, claims in course_claims(course, runs))
    if claims.proven < course.truth * claims.all:
        required = f"{100 * course.truth:g} %"
        message = f"{claims.share} of the numbers are proven; the course requires {required}"
        help = f"`coursebuild check --truth` lists the other {claims.all - claims.proven}"
        yield diagnose("truth-share", course.truth_span, message, help=help)


def unproven(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic | str]:
    """Yield the share of proven numbers by lesson, and each number that nothing proves."""
    rows = [
        (owner.id if isinstance(owner, Lesson) else owner.title, claims)
        for owner, claims in course_claims(course, runs)
    ]
    for name, claims in (*rows, ("all", sum_claims(claims for _, claims in rows))):
        if claims.all:
            yield (
                f"{name}: {claims.share} of {claims.all} numbers proven: {claims.bound} bound,"
                f" {claims.computed} computed, {claims.given} given with a source;"
                f" {len(claims.unsourced)} given without, {len(claims.open)} with no proof"
            )
    for _, claims in rows:
        for place in claims.open:
            yield diagnose("number-unproven", place, f"nothing proves `{place.text}`")
        for place in claims.unsourced:
            message = f"`{place.text}` is given without a source"
            help = 'name it, as in `{given="models/pendulum.xml"}` or `{given="chosen"}`'
            yield diagnose("number-unproven", place, message, help=help)


FEATURE = Feature(
    name="truth",
    needs=("arithmetic",),
    fences=(KIND,),
    summary=lambda document, mathml: Parsed(document_claims(document)),
    check=check,
    check_runs=check_runs,
    unproven=unproven,
    texts={"en": _TEXTS},
    rules=(
        Rule("number-unproven", "warning", "A number that nothing in the course proves."),
        Rule("given-source", "error", "A number is not in the file that is named as its source."),
        Rule("truth-share", "error", "Fewer numbers are proven than the course map asks for."),
        Rule("truth-text", "error", "A `truth` fence holds a text, which nothing reads."),
    ),
)
