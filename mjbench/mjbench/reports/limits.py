"""Largest stable timesteps in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mjbench.reports import Reach, reach_bound
from mjbench.reports.scene_report import ScenarioReport, StableRow, WorkPrecisionRow
from mjbench.reports.shown_errors import seconds_text

_TOGETHER, _MOST_DIGITS, _FEW_DIGITS = 0.1, 4, 2
"""How far theory at rest may be above runs, relative, and the most digits of a limit: few where
longer timesteps are stable again."""


def limit_text(row: StableRow) -> str:
    """The largest stable timestep with the digits on which theory and all runs agree.

    Theory at rest counts up to a tenth above: else the motion is lost far from rest. Where limits
    have islands, there are two: others may lie between timesteps that were tried. It is never
    above them all: whoever takes it would lose the run. Where two digits do not hold, it is the
    least limit, and what allows more is said: the own start, theory, or elsewhere, another start or
    another time.
    """
    if row.bracket is None or row.largest == "none":
        return reach_text(row.largest, row.searched)
    low, high = row.bracket
    if isinstance(row.theory, float) and row.theory < high * (1 + _TOGETHER):
        low, high = min(low, row.theory), max(high, row.theory)
    if low <= 0:
        return f"none from every start; from its own {reach_text(row.largest, row.searched)}"
    least = max(high - low, low * 10.0**-_MOST_DIGITS)
    digits = math.floor(math.log10(low)) - math.ceil(math.log10(least) - 1e-9) + 1
    digits = digits if row.islands is None else min(digits, _FEW_DIGITS)
    if digits < 2:
        most = _floor_text(high)
        if row.theory == high:
            reason = f"theory allows {most}"
        elif reach_bound(row.largest) >= 0.99 * high:
            reason = f"from its own start {most}"
        else:
            reason = f"elsewhere {most}"
        return f"{_floor_text(low)}; {reason}"
    value = float(f"{low:.{digits}g}")
    if value > high:
        value -= 10.0 ** (math.floor(math.log10(low)) + 1 - digits)
    return seconds_text(value, digits)


def reach_text(limit: Reach | None, searched: tuple[float, float]) -> str:
    """A limit, and where it is none, what was tried; empty where it was not measured."""
    if limit is None:
        return ""
    if limit == "all":
        return f"all to {seconds_text(searched[1], 3)}"
    if limit == "none":
        return f"none from {seconds_text(searched[0], 3)} on"
    assert isinstance(limit, float)
    return _floor_text(limit)


def _floor_text(limit: float) -> str:
    """A limit in two digits, never above it: beyond it runs are lost."""
    unit = 10.0 ** (math.floor(math.log10(limit)) - 1)
    return seconds_text(math.floor(limit / unit * (1 + 1e-9)) * unit, 2)


def stability_text(report: ScenarioReport) -> str:
    """How long the timestep of the own integrator may be, and for what."""
    baseline = report.own_setting
    row = next((r for r in report.stable if baseline and r.integrator == baseline.integrator), None)
    if row is None:
        return ""
    low, high = (seconds_text(step, 3) for step in row.searched)
    bound, _, own_bound = row.shown.partition("; ")
    answers: dict[str, list[str]] = {}
    for limit, words, reason in (
        (row.largest, "bounded", ""),
        (row.near, "near the motion of small steps", row.near_reason),
        (row.through, "with nothing going through", row.through_reason),
    ):
        is_bound = words == "bounded" or row.largest == "all"
        if limit is None or not (is_bound or reach_bound(limit) < reach_bound(row.largest)):
            continue  # not asked, or as long as it stays bounded
        text = bound if words == "bounded" else reach_text(limit, row.searched)
        if text[:1].isdigit():
            text = f"the steps tried to {text}"
        else:
            is_all = text.startswith("all")
            text = f"every step tried, to {high}" if is_all else f"no step from {low} on"
        text = f"at {text}" + (f" ({reason})" if reason else "")
        if own_bound:  # what else is asked is asked of the own start alone
            words += " from every start" if words == "bounded" else " from its own"
        answers.setdefault(text, []).append(words)
    stays = "; ".join(f"{_enumerate(words)} {text}" for text, words in answers.items())
    return f"{row.integrator} stays {stays}"


def _enumerate(words: Sequence[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def largest_of(rows: Sequence[StableRow]) -> dict[str, float]:
    """The largest stable timesteps by integrator, of those that have one."""
    return {r.integrator: reach_bound(r.largest) for r in rows if r.largest != "all"}


def stray_timestep(report: ScenarioReport, rival: WorkPrecisionRow) -> str:
    """The timestep from which on a setting may leave the motion of small steps, in words.

    Empty where its own timestep is not longer, and where the scene's own setting leaves it too. Of
    commands nothing is known: they are late at timesteps that do not divide the time they hold for.
    """
    near = {} if report.hold else {row.integrator: row.near for row in report.stable}

    def limit(row: WorkPrecisionRow) -> float:
        reach = near.get(row.setting.integrator)
        return math.inf if reach is None else reach_bound(reach)

    baseline = next(row for row in report.rows if row.own)
    stays = [row.setting.timestep <= limit(row) * (1 + 1e-9) for row in (baseline, rival)]
    return seconds_text(limit(rival), 2) if stays == [True, False] else ""
