"""Warnings of printed digits that are noise.

A warning is given where the verification would take a difference for drift: what a tolerance or
`digits` allows for is no mistake. Nor is a number that moved no further than its initial states
did: more than about twelve of its digits cannot be judged, unless it has more than the fifteen
that any floating-point number holds.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator

from coursebuild.core.scripts.diff import limit_notes, quote
from coursebuild.core.scripts.sensitivity import PERTURBATION, Sensitivity, round_to
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.numbers import only_number
from coursebuild.core.text.source import Span

_MAX_NOTES = 20
_AS_MOVED = 11
"""Digits that repeat of a number that moves at most ten times as far as the initial states."""
_EXACT_DIGITS = sys.float_info.dig
_WIDTH = 40


def noise_warnings(sensitivity: Sensitivity) -> Iterator[Diagnostic]:
    """A warning where the verification compares what moved states change."""
    warnings: list[tuple[Span, str]] = []
    for doubt in sensitivity.doubts:
        if not doubt.compared or (doubt.repeat >= _AS_MOVED and doubt.digits <= _EXACT_DIGITS):
            continue
        text = "no digit repeats"
        if doubt.repeat:
            text = "1 digit repeats" if doubt.repeat == 1 else f"{doubt.repeat} digits repeat"
            number = only_number(doubt.printed)
            instead = "" if number is None else round_to(number, doubt.repeat)
            text += f", print {instead}" if instead else ""
        warnings.append((doubt.span, f"{text}: printed from {doubt.least} to {doubt.most}"))
    for flip in (flip for flip in sensitivity.flips if flip.compared):
        text = f"printed as {quote(flip.other, _WIDTH)} too"
        if not flip.other.strip():
            text = "not always printed"
        elif not flip.printed.strip():
            text = f"{quote(flip.other, _WIDTH)} is printed here as well"
        warnings.append((flip.span, text))
    warnings.sort(key=lambda warning: (warning[0].path, warning[0].start))
    if not warnings:
        return
    (span, label), *rest = warnings
    notes = limit_notes([Note(text, place) for place, text in rest], _MAX_NOTES)
    if sensitivity.chaotic:
        size, growth = sensitivity.amplification, "its states part without bounds"
        if size is not None and math.isfinite(size):
            growth = f"states end {size:.0e} times as far apart as they began"
        notes.append(Note(f"its simulation is chaotic: {growth}"))
    yield diagnose(
        "output-noise",
        span,
        f"`{sensitivity.path}` prints digits that are noise: a change of its initial states by "
        f"{PERTURBATION:.0e} changes them",
        label=label,
        help=(
            "print what holds: fewer digits, a shorter run, a mean of many runs"
            if sensitivity.chaotic
            else "print fewer digits, or say how to compare: `digits`, or `rtol` and `atol`"
        ),
        notes=notes,
    )
