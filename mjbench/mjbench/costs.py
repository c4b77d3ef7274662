"""What settings cost, which of them are worth it, and what that says of the scene's own.

1. A job is a scenario from its beginning to its end, so that each setting is timed on its own
   states; what takes little time is repeated.
2. A round makes every job once, forwards and backwards in turn: what slows the machine for a while
   slows all.
3. Of the times of each job the lowest tenth counts: it forgets those that were disturbed, and does
   not hang on a single lucky one. Intervals come from rounds drawn again at random (bootstrap).
4. Only an error that falls as more work is done says what a setting does: one that is smaller than
   that of a shorter timestep, or of more iterations, is luck, and so is one beyond the largest
   stable timestep. An advantage has to hold from starts nearby too.

The clock is best the processor time of the thread, which stands still while others run.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.pilot import apply, with_setting
from mjbench.problem import Array, Scenario
from mjbench.reports import Interval
from mjbench.reports.scene_report import MeasuredSetting, RowVerdict, WorkPrecisionRow
from mjbench.reports.shown_errors import (
    ERROR_SLACK,
    SEEN,
    FrontPoint,
    Quantity,
    Rows,
    front_point,
    seconds_text,
    setting_text,
)
from mjbench.scene import Scene
from mjbench.simulation import STATE, full_state, initial_data, silent

Clock: TypeAlias = Callable[[], int]
"""Time so far, in ns."""
Job: TypeAlias = Callable[[], None]
"""Does what is timed, always the same amount."""

MIN_ROUNDS, MAX_ROUNDS = 8, 60
"""Rounds."""
_BUDGET, _QUICK_BUDGET = 20e9, 2e9
"""ns after which no round begins that is not among the fewest."""
_TARGET_WIDTH = 0.01
"""Relative half width of the widest interval at which rounds end."""
_SHORTEST = 1_000_000
"""ns that a job takes at least."""
_DRAWS = 200
"""Times that rounds are drawn again, for an interval."""


class Timing(Struct, frozen=True):
    """The time of a job."""

    nanoseconds: Interval
    ratio: Interval
    """Its time over that of the baseline."""

    @property
    def certain(self) -> bool:
        """Whether the ratio differs from 1 by more than 3 % and the measurement's uncertainty."""
        differs = not self.ratio.low <= 1.0 <= self.ratio.high
        return differs and abs(self.ratio.value - 1.0) > 0.03


def time_jobs(
    jobs: Sequence[Job], baseline: int, clock: Clock, *, quick: bool = False
) -> tuple[Timing, ...]:
    """Time jobs, of which number `baseline` is what the others are compared with."""
    times = np.zeros((MAX_ROUNDS, len(jobs)))
    budget, began = _QUICK_BUDGET if quick else _BUDGET, clock()
    gc_was_enabled = gc.isenabled()
    gc.disable()
    try:
        repeats = []
        for job in jobs:  # how often it must be made to take long enough, which warms caches too
            count = 1
            while _time_job(job, count, clock) < _SHORTEST and count < 1 << 12:
                count *= 2
            repeats.append(count)
        for turn in range(MAX_ROUNDS):
            order = range(len(jobs))
            for index in order if turn % 2 else reversed(order):
                times[turn, index] = _time_job(jobs[index], repeats[index], clock)
            if turn + 1 < MIN_ROUNDS:
                continue
            timings = _timings(times[: turn + 1] / repeats, baseline)
            widest = max((timing.ratio.half_width for timing in timings), default=0.0)
            if widest <= _TARGET_WIDTH or clock() - began > budget:
                break
    finally:
        if gc_was_enabled:
            gc.enable()
    return timings


def _time_job(job: Job, times: int, clock: Clock) -> int:
    before = clock()
    for _ in range(times):
        job()
    return clock() - before


def _timings(times: Array, baseline: int) -> tuple[Timing, ...]:
    """The timings of jobs, from the times (n, jobs) of n rounds."""
    count = len(times)
    resamples = np.random.default_rng(0).integers(count, size=(_DRAWS, count))
    lowest = np.quantile(times, 0.1, axis=0)
    redrawn = np.quantile(times[resamples], 0.1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios, redrawn_ratios = (
            lowest / lowest[baseline],
            redrawn / redrawn[:, baseline : baseline + 1],
        )
    return tuple(
        Timing(_interval(lowest[n], redrawn[:, n]), _interval(ratios[n], redrawn_ratios[:, n]))
        for n in range(times.shape[1])
    )


def _interval(value: float, redrawn: Array) -> Interval:
    low, high = np.quantile(redrawn, (0.025, 0.975)).tolist()
    return Interval(float(value), min(low, float(value)), max(high, float(value)))


def costs(
    model: Any,
    scene: Scene,
    settings: Sequence[MeasuredSetting],
    baseline: int,
    clock: Clock,
    *,
    quick: bool = False,
) -> tuple[Timing, ...]:
    """The costs of a scenario under some settings, relative to number `baseline` of them."""
    variant = with_setting(model, settings[baseline])

    def job(setting: MeasuredSetting) -> Job:
        run = scenario_job(variant, [scene.scenario], setting.timestep)

        def work() -> None:
            apply(variant, setting, model)
            run()

        return work

    with silent():
        return time_jobs([job(setting) for setting in settings], baseline, clock, quick=quick)


def scenario_job(
    model: Any,
    scenarios: Sequence[Scenario],
    timestep: float,
    *,
    states: Sequence[Array] | None = None,
    actuators: Sequence[int] | None = None,
) -> Job:
    """A job that runs scenarios.

    `states`: full ones to begin in, else those of the scenarios; `actuators`: those commanded, else
    all.
    """
    data, commanded = mujoco.MjData(model), slice(None) if actuators is None else list(actuators)
    if states is None:
        states = [full_state(model, initial_data(scenario, model)) for scenario in scenarios]
    runs = []
    for scenario, state in zip(scenarios, states, strict=True):
        parts = [
            (np.array(command)[commanded] if command else None, round((end - begin) / timestep))
            for begin, end, command in scenario.holds()
        ]
        runs.append((state, parts))

    def job() -> None:
        for state, parts in runs:
            if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
                mujoco.mj_resetData(model, data)  # a state does not say who sleeps
            mujoco.mj_setState(model, data, state, STATE)
            for command, steps in parts:
                if command is not None:
                    data.ctrl[:] = command
                mujoco.mj_step(model, data, steps)

    return job


_WORTH_SAYING = 0.1
"""An advantage that is smaller in both respects is none on another day."""
_NEGLIGIBLE = 0.01
"""The share of the scene's own error below which others may rise, as those of rounding do."""


def mark_luck(
    rows: Rows, limits: Mapping[str, float], quantity: Quantity = SEEN
) -> tuple[WorkPrecisionRow, ...]:
    """Rows that say where their errors are luck.

    `limits`: the largest stable timesteps (s) under the scene's own solver, by integrator.
    """
    own_row = next(row for row in rows if row.own)
    least = max(quantity.least, _NEGLIGIBLE * (quantity.value_of(own_row) or 0.0))
    slack = 1 + ERROR_SLACK
    marked_rows = []
    for row in rows:
        setting, place = row.setting, quantity.value_of(row)
        limit = limits.get(setting.integrator, math.inf)
        luck, is_usual = "", setting.solver_settings == own_row.setting.solver_settings
        if place is not None and is_usual and setting.timestep > limit * (1 + 1e-9):
            luck = "the shortest timestep that was tried is lost"
            if limit:
                luck = f"it is beyond its largest stable timestep, {seconds_text(limit, 3)}"
        for rival in rows:
            dear, error, work = rival.setting, quantity.value_of(rival), ""
            if dear == replace(setting, timestep=dear.timestep):
                work = "shorter timesteps" if dear.timestep < setting.timestep else ""
            elif dear == replace(setting, iterations=dear.iterations):
                work = "more iterations" if dear.iterations > setting.iterations else ""
            elif dear == replace(setting, cone=own_row.setting.cone):
                luck = luck or _luck_of_cone(row, rival, quantity)
            if luck or not work or row.status != "ok":
                continue
            known_until = math.inf if row.parted is None else (1 - _WORTH_SAYING) * row.parted
            if rival.parted is not None and rival.parted < known_until:
                luck = f"with {work} it is off sooner"
            elif place is not None and error is not None and error > max(place * slack, least):
                luck = f"its error rises with {work}"
        marked_rows.append(replace(row, lucky=luck))
    return tuple(marked_rows)


def _luck_of_cone(row: WorkPrecisionRow, rival: WorkPrecisionRow, quantity: Quantity) -> str:
    """Why a smaller error than under the scene's own cone is luck; empty where it is none.

    Where the model under that cone errs no less, it has cancelled with the error of the timestep.
    """

    def is_less(error: float | None, than: float | None) -> bool:
        return error is not None and than is not None and error * (1 + ERROR_SLACK) < than

    if row.model_error is None or not is_less(quantity.value_of(row), quantity.value_of(rival)):
        return ""
    is_nearer = rival.model_error is None or is_less(row.model_error, rival.model_error)
    return "" if is_nearer else "in small steps that cone errs no less"


def verdict(
    rows: Rows,
    noticeable: Sequence[bool | None],
    quantity: Quantity = SEEN,
    holds: Callable[[MeasuredSetting], bool] = lambda _: True,
    horizon_error: str = "0.1",
) -> RowVerdict:
    """The verdict on the scene's own setting.

    `noticeable`: whether a learner sees the error of each row; `None` where that is not known.
    `holds`: whether the advantage of another setting holds from starts nearby too.
    """
    own_index = next(number for number, row in enumerate(rows) if row.own)
    row, is_noticeable = rows[own_index], noticeable[own_index]
    if row.reasons:
        return _verdict_of_lost(rows, row, quantity)
    error = None if is_noticeable is None else row.seen
    remark = "; whether the scene's own error can be seen is not known"
    if error is not None:
        least = quantity.least if quantity.name == SEEN.name else 0.0
        remark = _describe_error(rows, noticeable, row, error, least)
    own_place = front_point(row, quantity)
    if row.parted is not None:
        text = _verdict_of_chaos(rows, row, horizon_error)
        return RowVerdict(False, None, None, None, is_noticeable, text)
    if not any(map(quantity.value_of, rows)):
        text = "no setting can be called better: none errs, as where nothing moves"
        return RowVerdict(False, None, None, None, is_noticeable, text)
    if own_place is None:
        text = "nothing was timed, so no setting can be called better"
        return RowVerdict(False, None, None, None, is_noticeable, text + remark)
    if row.dominated_by is None and row.lucky:
        text = f"nothing can be said of the scene's own setting: {row.lucky}"
        return RowVerdict(False, None, None, None, is_noticeable, text + remark)
    if row.dominated_by is None:
        text = _describe_lucky(rows, own_place, quantity)
        text = text or "no other setting is cheaper without being less accurate"
        return RowVerdict(True, None, None, None, is_noticeable, text + remark)
    better = rows[row.dominated_by]
    better_place = front_point(better, quantity)
    assert better_place is not None
    are_unresolved = max(own_place.error, better_place.error) <= quantity.least
    if are_unresolved and {is_noticeable, noticeable[row.dominated_by]} != {False}:
        text = "no setting can be called better: the reference resolves no error of "
        text += f"{setting_text(better.setting, row.setting)}, or of the scene's own setting"
        return RowVerdict(False, None, None, None, is_noticeable, text + remark)
    ratios = (
        better_place.cost.value / own_place.cost.value,
        better_place.error / own_place.error if own_place.error else 1.0,
    )
    name, is_small = setting_text(better.setting, row.setting), min(ratios) > 1 - _WORTH_SAYING
    if is_small or not holds(better.setting):
        text = f"no difference that holds: {name} {_describe_ratios(*ratios)} here"
        text += ", which is within what such runs differ by" if is_small else ""
        text += "" if is_small else ", but is no better from starts nearby"
        return RowVerdict(True, None, None, None, is_noticeable, text + remark)
    text = f"{name} is better: it {_describe_ratios(*ratios)}"
    if are_unresolved:
        text += ", as far as the reference resolves"
    elif better_place.error <= quantity.least:
        text += ", or more: the reference resolves no more"
    return RowVerdict(False, row.dominated_by, *ratios, is_noticeable, text + remark)


def _describe_lucky(rows: Rows, own_place: FrontPoint, quantity: Quantity) -> str:
    """The cheapest setting that is better only by luck; empty if there is none."""
    points = [(point, row) for row in rows if row.lucky and (point := front_point(row, quantity))]
    better = [(p, r) for p, r in points if p.is_cheaper(own_place) and p.beats(own_place)]
    if not better:
        return ""
    place, row = min(better, key=lambda pair: pair[0].cost.value)
    cost = place.cost.value / own_place.cost.value
    ratios = _describe_ratios(cost, place.error / own_place.error if own_place.error else 1.0)
    name = setting_text(row.setting, next(r.setting for r in rows if r.own))
    return f"no difference that holds: {name} {ratios} here, but {row.lucky}"


def _verdict_of_chaos(rows: Rows, row: WorkPrecisionRow, error: str) -> str:
    text = f"the motion is chaotic: it is {error} from the exact one at {row.parted:.3g} s"
    usable = [r for r in rows if r.status == "ok" and not r.lucky]
    whole = [r for r in usable if r.parted is None and r.seen is not None]
    if whole:
        cheapest = min(whole, key=lambda r: r.cost.value if r.cost else float(r.evaluations))
        return f"{text}; under {setting_text(cheapest.setting)} not before the horizon"
    best = max(usable, key=lambda r: r.parted or 0.0, default=row)
    if (best.parted or 0.0) > (row.parted or 0.0):
        text += f", under {setting_text(best.setting)} at {best.parted:.3g} s"
    return text


def _verdict_of_lost(rows: Rows, row: WorkPrecisionRow, quantity: Quantity) -> RowVerdict:
    text = f"the scene does not run under its own setting, {setting_text(row.setting)}: "
    text += "; ".join(row.reasons)
    candidates = [(p, n) for n, r in enumerate(rows) if r.front and (p := front_point(r, quantity))]
    if not candidates:
        return RowVerdict(False, None, None, None, None, text)
    better = min(candidates, key=lambda c: (c[0].error, c[0].cost.value, c[1]))[1]
    text += f"; {setting_text(rows[better].setting)} is the most accurate that does"
    unseen = [(p.cost.value, n) for p, n in candidates if (rows[n].seen or 0.0) < 1]
    cost, cheapest = min(unseen, default=(0.0, better))
    if cheapest != better:
        share = cost / next(p.cost.value for p, n in candidates if n == better)
        text += f", {setting_text(rows[cheapest].setting)} the cheapest without an error that is "
        text += f"seen, at {share:.2g} of its cost"
    return RowVerdict(False, better, None, None, None, text)


def _two_digits(number: float) -> str:
    """A factor with two digits and no exponent where zeros do: `610`."""
    return f"{float(f'{number:.2g}'):g}"


def _describe_ratios(cost: float, error: float) -> str:
    cheap = "takes no more time" if cost <= 1.005 else "takes about as long"
    if cost < 1 / 1.005:
        cheap = f"takes {cost:.2g} of the time"
    exact = "errs no more" if error <= 1.005 else "errs hardly more"
    if error < 1 / (1 + ERROR_SLACK):
        exact = f"errs {_two_digits(1 / error)} times less" if 1 / error < 1e4 else "errs far less"
    return f"{cheap} and {exact}"


def _describe_error(
    rows: Rows,
    noticeable: Sequence[bool | None],
    own_row: WorkPrecisionRow,
    error: float,
    least: float,
) -> str:
    """Whether the own error is seen, and where it is, the cheapest setting with one that is not."""
    if not error:
        return "; the scene's own setting makes no error"
    if error < 1:
        size = f"{'less than ' if error <= least else ''}{error:.2g}"
        return f"; the scene's own error cannot be seen: it is {size} of what an eye can tell"
    times_seen = _two_digits(error)
    text = f"; the scene's own error can be seen: it is {times_seen} times what an eye can tell"
    unseen = [r for r in rows if r.seen is not None and r.seen < 1 and r.cost and not r.lucky]
    if own_row.cost is None:
        return text
    if unseen:
        cost, first = min((r.cost.value, n) for n, r in enumerate(unseen) if r.cost)
        name = setting_text(unseen[first].setting, own_row.setting)
        times = cost / own_row.cost.value
        share = f"{_two_digits(times)} times" if abs(times - 1) > ERROR_SLACK else "about"
        text += f"; the cheapest without one that is seen is {name}, at {share} its cost"
    elif all(n for r, n in zip(rows, noticeable, strict=True) if r.seen is not None):
        text += ", and that of every other setting too"
    return text
