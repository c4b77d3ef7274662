"""Verdicts over small recordings."""

from __future__ import annotations

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.model.results import Change, DriftKind, Verdict
from coursebuild.core.scripts.compare import compare
from support.sample_lessons import EXACT, recording


def verdict(
    recorded: str,
    printed: str,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
    **lesson: str,
) -> Verdict:
    return compare(recording(recorded, **lesson), comparison, filters, printed)


def matches(recorded: str, printed: str, comparison: Comparison = EXACT) -> bool:
    found = verdict(recorded, printed, comparison)
    assert found.status in ("verified", "drift")
    assert bool(found.changes) == (found.status == "drift")
    return found.status == "verified"


def seen(change: Change) -> tuple[str, str, str, int]:
    """Class, recorded text, printed text, line of the output; the span must hold what it names."""
    if change.kind in (DriftKind.ROUNDING, DriftKind.NUMERIC, DriftKind.TEXT):
        assert change.span.text == change.recorded
    return change.kind.value, change.recorded, change.ran, change.ran_line
