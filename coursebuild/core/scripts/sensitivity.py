"""Which printed digits repeat when initial states are moved by 1e-12, and which are converged.

1. What the runs with moved states print is compared with the recorded output, by the comparison
   that verifies it but exactly: so each number is found at its place in the lesson.
2. The spread of a number is how far the values printed in its place are from the one that the
   script prints unmoved. It repeats to the first place of which the spread is no more than half a
   unit. A number that is printed alike by all runs repeats in all its digits.
   Likewise it is converged to the first place of which its error is no more than half a unit. Three
   timesteps give two changes, of which each says what the error of a method of first order is; the
   larger one counts. Where the second is not clearly the smaller one, the values do not tend
   anywhere yet, however near the first two happen to lie: then ten times the larger one counts.
   A time that a script finds by looking at every step is right to a timestep only, and what it
   computes of that no better; no shorter steps within its own show that. It is told by runs that
   look a part of a timestep later: they print it alike, or all off by as much, where a state would
   change little by little and a time that was chosen beforehand not at all. Where a script looks
   at every tenth step, such runs mostly print alike too, and nothing tells it.
3. The final states of a pair of runs, which began in opposite directions, show how fast states
   part: relative to the largest positions and velocities since the simulation began, not to those
   that it happens to end with.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from itertools import chain, pairwise

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Course, Mode, Recording
from coursebuild.core.model.results import Change, Outcome, ScriptRun
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.lines import same_number
from coursebuild.core.scripts.printed_text import PrintedText
from coursebuild.core.text.numbers import Number, difference, only_number, round_like, unit
from coursebuild.core.text.source import Span

PERTURBATION = 1e-12
"""How far initial states are moved, relative."""
RUNS = 4
"""Runs with moved states of each script: two pairs in opposite directions, the second pair half as
far away."""
FINER_RUNS, SHIFTED_RUNS = (-1, -2), (-3, -4, -5)
"""The numbers of the runs in which each step is made as 2 and as 4, and of those in which a script
sees states of a third, of two thirds and of a whole timestep later. The whole one changes each time
that is looked for at every step; the others tell it from one between steps."""
CHAOTIC = 1e8
"""A simulation is chaotic if its states are more than this many times as far apart at the end as at
the beginning: fewer than eight of a number's sixteen digits are left."""


class Standing(enum.Enum):
    """Whether the sensitivity of a script could be measured, and if not, why."""

    MEASURED = "measured"
    NO_MUJOCO = "without-mujoco"
    NOT_MOVED = "not-moved"
    """No initial state in it could be moved."""
    UNRECORDED = "unrecorded"
    """None of its output is recorded and compared."""
    DRIFTED = "drifted"
    """It prints something other than recorded, or does not run to its end."""
    FAILED = "failed"
    """It did not run to its end with moved states."""


class Doubt(Struct, frozen=True):
    """A recorded number with digits that do not repeat, or have not converged."""

    span: Span
    printed: str
    digits: int
    """Significant digits printed."""
    repeat: int
    """How many of them stay the same when initial states are moved."""
    converged: int | None
    """How many of them are those of ever smaller timesteps; `None` where not known."""
    least: str
    most: str
    """The smallest and the largest value printed in its place with moved initial states."""
    halved: str
    """The text printed in its place with half the timestep; empty where not known."""
    quartered: str
    sampled: str
    """How far it is off where the script looks a part of a timestep later, as what is looked for at
    every step; empty for other numbers."""
    instead: str
    """The number with only the digits that repeat and converge; empty if none does, or a count."""
    compared: bool
    """Whether verification would report the difference as drift."""


class Flip(Struct, frozen=True):
    """Text between numbers that changed, disappeared or was added when states were moved."""

    span: Span
    printed: str
    other: str
    compared: bool


class Sensitivity(Struct, frozen=True):
    """The sensitivity of a script."""

    path: str
    lesson: str
    """Id of the lesson or page that it is extracted from."""
    standing: Standing
    numbers: int = 0
    amplification: float | None = None
    """The largest growth of the distance between states from beginning to end; `None` where no
    final state is known."""
    unhalved: str = ""
    """Why nothing is known about shorter timesteps; empty where something is."""
    doubts: tuple[Doubt, ...] = ()
    flips: tuple[Flip, ...] = ()

    @property
    def chaotic(self) -> bool:
        return self.amplification is not None and self.amplification > CHAOTIC


_SHRINKING = Decimal("0.75")
"""The part of a change that the next one may be where values tend to something: half in first
order, and some room."""


def sensitivity(
    course: Course,
    path: str,
    owner: str,
    recordings: Iterable[Recording],
    base: ScriptRun,
    moved_runs: Sequence[ScriptRun],
    finer_runs: Sequence[ScriptRun] = (),
    shifted_runs: Sequence[ScriptRun] = (),
) -> Sensitivity:
    """What runs of a script with moved states, and with shorter steps, show of its output.

    `base` is its ordinary run; there are no `moved_runs` where they would have no point.
    `finer_runs`: with half and with a quarter of the timestep, or none; `shifted_runs`: with states
    of a part of a timestep later, or none.
    """
    compared = _compared_recordings(course, recordings)
    standing = _standing(compared, base, moved_runs)
    if standing is not Standing.MEASURED:
        return Sensitivity(path, owner, standing)
    reason_unhalved = _reason_unhalved(finer_runs)
    if reason_unhalved:
        finer_runs = shifted_runs = ()
    elif not all(r.outcome is Outcome.OK and r.trace is not None for r in shifted_runs):
        shifted_runs = ()
    other_runs = moved_runs, finer_runs, shifted_runs
    findings = [
        finding
        for recording, comparison in compared
        for finding in _find_doubts(recording, comparison, base, other_runs)
    ]
    numbers = sum(
        len(line.numbers)
        for recording, comparison in compared
        for line in PrintedText.of_recording(recording, comparison.own_filters).lines
    )
    doubts = tuple(finding for finding in findings if isinstance(finding, Doubt))
    flips = tuple(finding for finding in findings if isinstance(finding, Flip))
    size = amplification(moved_runs)
    return Sensitivity(path, owner, standing, numbers, size, reason_unhalved, doubts, flips)


def _reason_unhalved(runs: Sequence[ScriptRun]) -> str:
    """Why runs with shorter steps show nothing, in words; else empty."""
    if not runs:
        return "it was not run with shorter timesteps"
    for run, part in zip(runs, ("half", "a quarter of"), strict=True):
        if run.outcome is not Outcome.OK:
            return f"it does not run to its end with {part} the timestep"
        if run.trace is None or not run.trace.is_perturbed:
            return "no step of it can be halved"
    return ""


def is_worth_moving(course: Course, recordings: Iterable[Recording], base: ScriptRun) -> bool:
    """Whether runs of a script with moved states can show anything."""
    return _standing(_compared_recordings(course, recordings), base) is Standing.MEASURED


def _compared_recordings(
    course: Course, recordings: Iterable[Recording]
) -> list[tuple[Recording, Comparison]]:
    pairs = ((recording, course.comparison_of(recording)) for recording in recordings)
    return [(r, comparison) for r, comparison in pairs if comparison.mode is not Mode.VOLATILE]


def _standing(
    recordings: Sequence[tuple[Recording, Comparison]],
    base: ScriptRun,
    moved_runs: Sequence[ScriptRun] | None = None,
) -> Standing:
    if base.trace is not None and "mujoco" not in base.trace.modules:
        return Standing.NO_MUJOCO
    if base.outcome is not Outcome.OK:
        return Standing.DRIFTED
    if not recordings:
        return Standing.UNRECORDED
    if any(compare(r, c, base.output_of(r.part)).status == "drift" for r, c in recordings):
        return Standing.DRIFTED
    if moved_runs is None:
        return Standing.MEASURED
    if any(run.outcome is not Outcome.OK for run in moved_runs):
        return Standing.FAILED
    if not any(run.trace is not None and run.trace.is_perturbed for run in moved_runs):
        return Standing.NOT_MOVED
    return Standing.MEASURED


# --- numbers


def _find_doubts(
    recording: Recording,
    comparison: Comparison,
    base: ScriptRun,
    runs: tuple[Sequence[ScriptRun], Sequence[ScriptRun], Sequence[ScriptRun]],
) -> Iterator[Doubt | Flip]:
    """Numbers and texts of a recording that moved, finer and shifted runs change, in order."""
    exact = replace(comparison, mode=Mode.EXACT)

    def find_changes(run: ScriptRun) -> dict[tuple[int, int], Change]:
        changes = compare(recording, exact, run.output_of(recording.part)).changes
        return {(change.span.start, change.span.end): change for change in changes}

    changes_of_base = find_changes(base)
    changes_by_run = [find_changes(run) for run in chain(*runs)]
    first_changes = {place: c for changes in changes_by_run[::-1] for place, c in changes.items()}
    for place, first_change in sorted(first_changes.items()):
        recorded = first_change.recorded
        printed, *values = (
            changes[place].printed if place in changes else recorded
            for changes in (changes_of_base, *changes_by_run)
        )
        moved_end, finer_end = len(runs[0]), len(runs[0]) + len(runs[1])
        start_values, finer = values[:moved_end], values[moved_end:finer_end]
        tick = _sampling_step(printed, values[finer_end:])
        if tick or any(value != printed for value in values[:finer_end]):
            yield from _judge_number(
                first_change.span, (recorded, printed), start_values, finer, tick, comparison
            )


def _sampling_step(printed: str, shifted: Sequence[str]) -> Decimal | None:
    """How far a number is off, as printed, where a script looks a part of a timestep later.

    `None` where it is not, or each part of a timestep moves it by another distance, as a state.
    """
    number = only_number(printed)
    numbers = [n for value in shifted if (n := only_number(value)) is not None]
    if number is None or not numbers or len(numbers) < len(shifted):
        return None
    if not all(n.is_finite for n in (number, *numbers)):
        return None
    distances = {difference(number.value, n.value) for n in numbers} - {Decimal(0)}
    # What moves on by two units in a whole timestep is on its way after a part of it.
    is_step = len(distances) == 1 and min(distances) >= 2 * unit(number.place)
    return min(distances) if is_step else None


def _judge_number(
    span: Span,
    texts: tuple[str, str],
    values: Sequence[str],
    finer: Sequence[str],
    tick: Decimal | None,
    comparison: Comparison,
) -> Iterator[Doubt | Flip]:
    """What moved states and shorter steps say of a number or text.

    `texts` are what is recorded and what was printed; `values` were printed with moved states,
    `finer` with half and with a quarter of the timestep. `tick`: see `_sampling_step`.
    """
    recorded, printed = texts
    recorded_number, number = only_number(recorded), only_number(printed)
    numbers = [n for value in values if (n := only_number(value)) is not None]
    other_value = next((value for value in values if value != printed), None)
    if number is None or recorded_number is None or len(numbers) < len(values):
        if other_value is not None:
            yield Flip(span, printed, other_value, compared=True)
        return
    compared = any(not same_number(recorded_number, n, comparison) for n in numbers)
    repeat, least, most = _digits(number), number.text, number.text
    if other_value is not None:
        repeat, most = 0, "no number"
        if all(n.is_finite for n in (number, *numbers)):
            spread = max(difference(number.value, n.value) for n in numbers)
            if spread == 0:  # the same value in another form, such as -0.0
                yield Flip(span, printed, other_value, compared)
                return
            ordered_numbers = sorted((number, *numbers), key=lambda n: n.value)
            least, most = ordered_numbers[0].text, ordered_numbers[-1].text
            repeat = _count_repeating(number, spread)
    converged = _count_converged(number, finer) if finer else None
    if converged is not None and tick is not None:
        converged = min(converged, _count_repeating(number, tick))
    halved, quartered = (text.strip() for text in finer or ("", ""))
    yield Doubt(
        span,
        number.text,
        _digits(number),
        repeat,
        converged,
        least,
        most,
        halved,
        quartered,
        "" if tick is None else f"{float(tick):.6g}",
        round_to(number, repeat if converged is None else min(repeat, converged)),
        compared,
    )


def _count_converged(number: Number, finer: Sequence[str]) -> int:
    """How many digits runs with half and with a quarter of the timestep bear out."""
    numbers = [number, *(n for text in finer if (n := only_number(text)) is not None)]
    if len(numbers) < 3 or not all(n.is_finite for n in numbers):
        return 0
    first, second = (difference(a.value, b.value) for a, b in pairwise(numbers))
    error = max(2 * first, 4 * second)
    if second > _SHRINKING * first and second > unit(number.place):
        error = 10 * max(first, second)
    return _count_repeating(number, error) if error else _digits(number)


def _digits(number: Number) -> int:
    """Significant digits of a number as printed; for zero, those behind the point and one more."""
    if not number.is_finite:
        return 0
    if number.value == 0:
        return max(0, -number.place) + 1
    return number.value.adjusted() - number.place + 1


def _count_repeating(number: Number, spread: Decimal) -> int:
    """How many digits repeat: the spread is at most half a unit of the last of them."""
    if number.value == 0:
        return 0
    place = (spread * 2).adjusted()
    if unit(place) < spread * 2:
        place += 1
    return min(_digits(number), max(0, number.value.adjusted() - place + 1))


def round_to(number: Number, digits: int) -> str:
    """A printed number with so many significant digits; empty for no digits, and for a count."""
    if digits < 1 or number.is_integer or not number.is_finite:
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


def amplification(moved_runs: Sequence[ScriptRun]) -> float | None:
    """The largest factor by which states are farther apart at the end than at the beginning."""
    # By run and `MjData`: final positions and velocities, each with the size to compare by
    ends: list[dict[int, list[tuple[float, list[float]]]]] = []
    for run in moved_runs:
        ends.append({})
        for state in () if run.trace is None else run.trace.states:
            number, length, *words = state.split()
            position, velocity, *end = map(float.fromhex, words)
            at = int(length)
            ends[-1][int(number)] = [(position, end[:at]), (velocity, end[at:])]
    factors: list[float] = []
    for pair, (first, second) in enumerate(zip(ends[::2], ends[1::2], strict=True)):
        initial_gap = 2 * PERTURBATION * 0.5**pair
        for data in first.keys() & second.keys():
            pairs = zip(first[data], second[data], strict=True)
            for (size, mine), (other_size, theirs) in pairs:
                if mine and len(mine) == len(theirs):
                    gap = max(abs(a - b) for a, b in zip(mine, theirs, strict=True))
                    growth = gap / (max(size, other_size, *map(abs, mine)) or 1.0)
                    factors.append(growth / initial_gap if math.isfinite(growth) else math.inf)
    return max(factors, default=None)
