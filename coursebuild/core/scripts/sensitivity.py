"""Which printed digits repeat when initial states are moved by 1e-12, and which are converged.

Entry points: `sensitivity` (a script), `noise` (the warnings).

1. What the runs with moved states print is held against the recorded output by the comparison that
   verifies it, but to the letter: so each number is found at its place in the lesson, in text and
   in tables, past ellipses and filters.
2. The spread of a number is how far the values printed in its place are from the one that the
   script prints unmoved. It repeats to the first place of which the spread is no more than half a
   unit. A number that is printed alike by all runs repeats in all its digits.
   Likewise it is converged to the first place of which twice its change with half the timestep is
   no more than half a unit: so large is the error of a method of first order, and that of others
   smaller.
3. States at the end of runs of a pair, which began in opposite directions, tell how fast they part:
   compared by the largest positions and velocities since the simulation began, not by those that
   it happens to end with.
4. A warning is given where the verification would take a difference for drift: what a tolerance or
   `digits` allows for is no mistake. Nor is a number that came no further than its initial states
   were moved: more than about twelve of its digits cannot be judged, unless it has more than the
   fifteen that any floating-point number holds.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal

from msgspec.structs import replace

from coursebuild.core.model import Comparison, Course, Mode, Recording
from coursebuild.core.model.results import Change, Outcome, ScriptRun
from coursebuild.core.model.sensitivity import (
    PERTURBATION,
    Doubt,
    Flip,
    Sensitivity,
    Standing,
)
from coursebuild.core.scripts.bound_numbers import printed_lines
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import quoted
from coursebuild.core.scripts.lines import same_number
from coursebuild.core.scripts.numbers import Number, difference, round_like, scan, unit
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Span

_NAMED = 20
_AS_MOVED = 11
"""Digits that hold of a number that is moved ten times as far as the initial states, or less."""
_HELD = sys.float_info.dig
_WIDTH = 40


def sensitivity(
    course: Course,
    path: str,
    owner: str,
    recordings: Iterable[Recording],
    base: ScriptRun,
    moved: Sequence[ScriptRun],
    halved: ScriptRun | None = None,
) -> Sensitivity:
    """What the runs of a script with moved states, and with halved steps, say of what it prints.

    `base` is its run as it is; `moved` are none where there was no point in them.
    """
    compared = _compared(course, recordings)
    standing = _standing(course, compared, base, moved)
    if standing is not Standing.MEASURED:
        return Sensitivity(path, owner, standing)
    unhalved = _unhalved(halved)
    half = None if unhalved else halved
    found = [one for each in compared for one in _doubtful(course, *each, base, moved, half)]
    numbers = sum(len(line.numbers) for r, c in compared for line in printed_lines(r, c.filters))
    doubts = tuple(one for one in found if isinstance(one, Doubt))
    flips = tuple(one for one in found if isinstance(one, Flip))
    size = amplification(moved)
    return Sensitivity(path, owner, standing, numbers, size, unhalved, doubts, flips)


def _unhalved(run: ScriptRun | None) -> str:
    """Why a run with halved steps says nothing."""
    if run is None:
        return "it was not run with half the timestep"
    if run.outcome is not Outcome.OK:
        return "it does not run to its end with half the timestep"
    return "" if run.trace is not None and run.trace.moved else "no step of it can be halved"


def worth_moving(course: Course, recordings: Iterable[Recording], base: ScriptRun) -> bool:
    """Whether runs of a script with moved states can say anything."""
    return _standing(course, _compared(course, recordings), base) is Standing.MEASURED


def _compared(
    course: Course, recordings: Iterable[Recording]
) -> list[tuple[Recording, Comparison]]:
    """The recorded outputs that are compared, and how."""
    both = ((recording, recording.comparison or course.comparison) for recording in recordings)
    return [(r, comparison) for r, comparison in both if comparison.mode is not Mode.VOLATILE]


def _standing(
    course: Course,
    compared: Sequence[tuple[Recording, Comparison]],
    base: ScriptRun,
    moved: Sequence[ScriptRun] | None = None,
) -> Standing:
    if base.trace is not None and "mujoco" not in base.trace.modules:
        return Standing.NO_MUJOCO
    if base.outcome is not Outcome.OK:
        return Standing.DRIFTED
    if not compared:
        return Standing.UNRECORDED
    if any(compare(*each, course.filters, base.stdout).status == "drift" for each in compared):
        return Standing.DRIFTED
    if moved is None:
        return Standing.MEASURED
    if any(run.outcome is not Outcome.OK for run in moved):
        return Standing.FAILED
    if not any(run.trace is not None and run.trace.moved for run in moved):
        return Standing.NOT_MOVED
    return Standing.MEASURED


# --- numbers


def _doubtful(
    course: Course,
    recording: Recording,
    comparison: Comparison,
    base: ScriptRun,
    moved: Sequence[ScriptRun],
    halved: ScriptRun | None,
) -> Iterator[Doubt | Flip]:
    """Numbers and texts of a recording that moved states or halved steps change, in order."""
    exact = replace(comparison, mode=Mode.EXACT)

    def changes(run: ScriptRun) -> dict[tuple[int, int], Change]:
        found = compare(recording, exact, course.filters, run.stdout).changes
        return {(change.span.start, change.span.end): change for change in found}

    unmoved, others = changes(base), [changes(run) for run in moved]
    half = {} if halved is None else changes(halved)
    for place in sorted({place for other in (*others, half) for place in other}):
        first = next(other[place] for other in (*others, half) if place in other)
        recorded = first.recorded
        printed, *values = (
            other[place].ran if place in other else recorded for other in (unmoved, *others)
        )
        after = half[place].ran if place in half else recorded
        if any(value != printed for value in values):
            known = None if halved is None else after
            yield _judged(first.span, recorded, printed, values, known, comparison)
        elif halved is not None and after != printed and (number := _number(printed)) is not None:
            yield _unconverged(first.span, number, after)


def _judged(
    span: Span,
    recorded: str,
    printed: str,
    values: Sequence[str],
    halved: str | None,
    comparison: Comparison,
) -> Doubt | Flip:
    number, held_against = _number(printed), _number(recorded)
    numbers = [each for value in values if (each := _number(value)) is not None]
    other = next(value for value in values if value != printed)
    if number is None or held_against is None or len(numbers) < len(values):
        return Flip(span, printed, other, compared=True)
    compared = any(not same_number(held_against, each, comparison) for each in numbers)
    finite = sorted((each for each in (number, *numbers) if each.finite), key=lambda n: n.value)
    repeat, ends = 0, (number.text, "no number")
    if len(finite) > len(numbers):
        spread = max(difference(number.value, each.value) for each in numbers)
        if spread == 0:  # the same value in another form, such as -0.0
            return Flip(span, printed, other, compared)
        repeat, ends = _holding(number, spread), (finite[0].text, finite[-1].text)
    converged = None if halved is None else _converged(number, halved)
    return Doubt(
        span,
        number.text,
        _digits(number),
        repeat,
        converged,
        *ends,
        (halved or "").strip(),
        _rounded(number, repeat if converged is None else min(repeat, converged)),
        compared,
    )


def _unconverged(span: Span, number: Number, halved: str) -> Doubt:
    """A number that only half the timestep changes."""
    digits, converged, text = _digits(number), _converged(number, halved), number.text
    instead = _rounded(number, converged)
    return Doubt(
        span, text, digits, digits, converged, text, text, halved.strip(), instead, compared=False
    )


def _converged(number: Number, halved: str) -> int:
    """How many digits half the timestep bears out."""
    other = _number(halved)
    if other is None or not other.finite or not number.finite:
        return 0
    change = difference(number.value, other.value)
    return _holding(number, 2 * change) if change else _digits(number)


def _number(text: str) -> Number | None:
    """The number that a text is."""
    found = scan(text.strip())
    return found[0] if len(found) == 1 and found[0].text == text.strip() else None


def _digits(number: Number) -> int:
    """Significant digits of a number as it is printed; of zero those behind the point, and one."""
    if not number.finite:
        return 0
    if number.value == 0:
        return max(0, -number.place) + 1
    return number.value.adjusted() - number.place + 1


def _holding(number: Number, spread: Decimal) -> int:
    """How many digits hold: the spread is at most half a unit of the last of them."""
    if number.value == 0:
        return 0
    place = (spread * 2).adjusted()
    if unit(place) < spread * 2:
        place += 1
    return min(_digits(number), max(0, number.value.adjusted() - place + 1))


def _rounded(number: Number, digits: int) -> str:
    """A printed number with so many significant digits; empty for none, and for a count.

    In its own notation, where that can say so; a large number with few digits gets an exponent.
    """
    if digits < 1 or number.integer or not number.finite:
        return ""
    decimals = digits - 1 - number.value.adjusted()
    mantissa, mark, power = number.text.lower().partition("e")
    if mark:
        decimals = digits - 1
    elif decimals < 0:
        decimals, power = digits - 1, "+00"
    sign = mantissa[0] if mantissa[0] in "+-\u2212" else ""
    like = f"{sign}0.{'0' * decimals}" if decimals else f"{sign}0"
    like += f"{'E' if 'E' in number.text else 'e'}{power}" if power else ""
    return round_like(replace(number, text=like), number.value) or ""


# --- states


def amplification(moved: Sequence[ScriptRun]) -> float | None:
    """How many times as far apart states are at the end as they were at the beginning, at most."""
    ends = [_ends(run) for run in moved]
    found: list[float] = []
    for pair, (one, other) in enumerate(zip(ends[::2], ends[1::2], strict=True)):
        apart = 2 * PERTURBATION * 0.5**pair
        for number in one.keys() & other.keys():
            found += _growth(one[number], other[number], apart)
    return max(found, default=None)


def _ends(run: ScriptRun) -> dict[int, list[tuple[float, list[float]]]]:
    """For each `MjData` its positions and velocities at the end, with what they are compared by."""
    states = () if run.trace is None else run.trace.states
    found: dict[int, list[tuple[float, list[float]]]] = {}
    for state in states:
        number, length, *words = state.split()
        position, velocity, *end = map(float.fromhex, words)
        at = int(length)
        found[int(number)] = [(position, end[:at]), (velocity, end[at:])]
    return found


def _growth(
    one: list[tuple[float, list[float]]], other: list[tuple[float, list[float]]], apart: float
) -> Iterator[float]:
    for (size, mine), (other_size, theirs) in zip(one, other, strict=True):
        if not mine or len(mine) != len(theirs):
            continue
        gap = max(abs(a - b) for a, b in zip(mine, theirs, strict=True))
        largest = max(size, other_size, *map(abs, mine)) or 1.0
        yield gap / largest / apart if math.isfinite(gap / largest) else math.inf


# --- warnings


def noise(found: Sensitivity) -> Iterator[Diagnostic]:
    """A warning where the verification compares what moved states change."""
    told = [
        (doubt.span, _doubt(doubt))
        for doubt in found.doubts
        if doubt.compared and (doubt.repeat < _AS_MOVED or doubt.digits > _HELD)
    ]
    told += [(flip.span, _flip(flip)) for flip in found.flips if flip.compared]
    told.sort(key=lambda each: (each[0].path, each[0].start))
    if not told:
        return
    (span, label), *others = told
    notes = [Note(text, place) for place, text in others[:_NAMED]]
    if len(others) > _NAMED:
        notes.append(Note(f"and {len(others) - _NAMED} more"))
    if found.chaotic:
        notes.append(Note(f"its simulation is chaotic: {parting(found)}"))
    yield diagnose(
        "output-noise",
        span,
        f"`{found.path}` prints digits that are noise: a change of its initial states by "
        f"{PERTURBATION:.0e} changes them",
        label=label,
        help=(
            "print what holds: fewer digits, a shorter run, a mean of many runs"
            if found.chaotic
            else "print fewer digits, or say how to compare: `digits`, or `rtol` and `atol`"
        ),
        notes=notes,
    )


def parting(found: Sensitivity) -> str:
    """How fast the states of a script part, in words."""
    size = found.amplification
    if size is None or not math.isfinite(size):
        return "its states part without bounds"
    return f"states end {size:.0e} times as far apart as they began"


def _doubt(doubt: Doubt) -> str:
    between = f"printed from {doubt.least} to {doubt.most}"
    if not doubt.repeat:
        return f"no digit repeats: {between}"
    repeat = "1 digit repeats" if doubt.repeat == 1 else f"{doubt.repeat} digits repeat"
    number = _number(doubt.printed)
    instead = "" if number is None else _rounded(number, doubt.repeat)
    return f"{repeat}{f', print {instead}' if instead else ''}: {between}"


def _flip(flip: Flip) -> str:
    if not flip.other.strip():
        return "not always printed"
    if not flip.printed.strip():
        return f"{quoted(flip.other, _WIDTH)} is printed here as well"
    return f"printed as {quoted(flip.other, _WIDTH)} too"
