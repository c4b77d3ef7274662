"""What a report says, from what was measured: verdicts, fronts, charts, limits in words.

It is made once, stands in the report, and needs nothing but the report: one that was recorded can
be judged anew without measuring.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from msgspec.structs import replace

from mjbench.columns import (
    mark_dominated,
    row_ratios,
    worse_texts,
)
from mjbench.judge import (
    Starts,
    find_parts,
    five_lines,
    judge_setting,
    mark_luck,
    rival_row,
)
from mjbench.profile import profile_text
from mjbench.reports import Interval, PartFailure
from mjbench.reports.limits import largest_of, limit_text
from mjbench.reports.model_report import RIGHT, CaseReport
from mjbench.reports.scene_report import (
    ErrorQuantity,
    MeasuredSetting,
    PhaseProfile,
    ScenarioReport,
    SweepReport,
)
from mjbench.reports.shown_errors import (
    FEWEST_STEPS,
    INTEGRATORS,
    SEEN,
    STEPPED,
    is_idle,
    main_quantity,
    quantities,
    setting_text,
)
from mjbench.reports.work_charts import case_charts, case_quantities, scenario_charts, step_cost

FIGURES = (
    *("change", "parted", "figure", "penetration", "slip", "restitution", "residual"),
    *("iterations", "cost"),
)
"""The figures that a sweep has of every value."""


def derive_scenario(report: ScenarioReport, starts: Starts) -> ScenarioReport:
    """The report with all that follows from what was measured but charts.

    `starts` as for `judge_setting`.
    """
    baseline = report.own_setting
    rows = tuple(
        replace(row, name=setting_text(row.setting, baseline), idle=is_idle(row))
        for row in report.rows
    )
    figure = ErrorQuantity("figure", report.figure or "figure", report.least_figure, False)
    floors = report.floor, report.velocity_floor
    present = quantities(rows, figure, report.least_seen, floors)
    is_apart = STEPPED.name in {quantity.name for quantity in present}
    if is_apart and all(row.step_error == row.seen for row in rows):  # contacts add nothing to it
        present = tuple(quantity for quantity in present if quantity.name != SEEN.name)
    main = main_quantity(present, rows)
    stable = tuple(replace(r, shown=limit_text(r)) for r in report.stable)
    report = replace(
        report,
        rows=rows,
        stable=stable,
        quantities=tuple(
            replace(quantity, resolved=quantity.is_resolved(rows)) for quantity in present
        ),
        main="" if main is None else main.name,
        cut_short=any(
            math.isclose(row.searched[1], report.duration / FEWEST_STEPS, rel_tol=1e-9)
            for row in stable
        ),
    )
    if main is not None and report.own_row is not None:
        report = replace(report, rows=mark_luck(rows, largest_of(stable), main))
    report = replace(report, rows=tuple(mark_dominated(report)))
    if report.parts is not None:
        report = replace(report, parts=find_parts(report, report.parts))
    if report.own_row is not None:
        report = _with_lines(replace(report, verdict=judge_setting(report, starts)))
    return report


def _with_lines(report: ScenarioReport) -> ScenarioReport:
    """The report, which has its verdict, with that in five lines."""
    return replace(report, verdict=replace(report.verdict, lines=five_lines(report)))


def derive_charts(report: ScenarioReport) -> ScenarioReport:
    """The report, which has its verdict, with its charts."""
    return replace(report, charts=scenario_charts(report))


def derive_failures(report: ScenarioReport, failures: Sequence[PartFailure]) -> ScenarioReport:
    """The report with what was not measured, which its last line tells."""
    return _with_lines(replace(report, failures=tuple(failures)))


def derive_seeds(
    reports: Sequence[ScenarioReport], names: Sequence[str]
) -> tuple[ScenarioReport, ...]:
    """Reports on the same under commands from several seeds, which have these names.

    What is better under one seed is better if it is no worse under any: which one an author meets
    is chance.
    """
    by_name = {report.name: report for report in reports}
    derived = []
    for report in reports:
        verdict, number = report.verdict, report.verdict.better
        if number is not None and report.own_row is not None and report.own_row.status == "ok":
            setting = report.rows[number].setting
            reasons = {
                name: _why_worse(by_name.get(name), setting)
                for name in names
                if name != report.name
            }
            worse = next((f"in {name} {reason}" for name, reason in reasons.items() if reason), "")
            unknown = [name for name, reason in reasons.items() if reason is None]
            claim, semicolon, remark = verdict.text.partition("; ")
            claim = claim.replace(" is better: it ", " ", 1)
            if worse:
                text = f"no difference that holds: here {claim}, but {worse}{semicolon}{remark}"
            else:
                place = f"whether that holds in {', '.join(unknown)} was not measured"
                text = f"{claim} here; {place}{semicolon}{remark}"
            if worse or unknown:
                verdict = replace(verdict, better=None, text=text)
                report = _with_lines(replace(report, verdict=verdict))
        derived.append(report)
    return tuple(derived)


def _why_worse(report: ScenarioReport | None, setting: MeasuredSetting) -> str | None:
    """In what a setting is worse than the own one; empty where in nothing, `None`: not measured."""
    baseline = None if report is None else report.own_row
    rows = () if report is None else report.rows
    row = next((row for row in rows if row.setting == setting), None)
    if report is None or baseline is None or row is None:
        return None
    if baseline.status != "ok":
        return ""
    if row.status != "ok":
        return "it is lost"
    if row.parted is not None and baseline.parted is None:
        return f"it is off at {row.parted:.3g} s"
    worse = worse_texts(report, baseline, [row_ratios(report, baseline, row)])
    return worse[0] if worse else ""


def derive_profile(report: ScenarioReport, profile: tuple[PhaseProfile, ...]) -> ScenarioReport:
    """The report with where the time goes, the own setting first, and what the verdict rests on."""
    if not profile:
        return report
    rival = rival_row(report)
    rival_profile = next((p for p in profile if rival is report.rows[p.row]), None)
    text = profile_text(profile[0], rival_profile, None if rival is None else rival.cost)
    return replace(report, profile=profile, profile_text=text)


def derive_case(report: CaseReport) -> CaseReport:
    """The report on a hard case with all that follows from what was measured."""
    main = next(iter(case_quantities(report)), None)
    costs = ((name, _cost_to(report, name, RIGHT)) for name in INTEGRATORS)
    lines = tuple(replace(r, shown=limit_text(r)) for r in report.boundaries)
    return replace(
        report,
        boundaries=lines,
        charts=case_charts(report),
        main="" if main is None else main.name,
        least=0.0 if main is None else main.least,
        reached=tuple((name, cost) for name, cost in costs if cost is not None),
    )


def _cost_to(report: CaseReport, integrator: str, error: float) -> float | None:
    """Processor time for a simulated second, s, with the timestep that has a given error, m or rad.

    `None` where no run is as good. Between two runs the cost follows a power of the error. Nothing
    is extrapolated.
    """
    runs = sorted(
        (cost.value, max(pair[0] for pair in places))
        for line in report.errors
        if line.integrator == integrator and (cost := step_cost(report, line)) is not None
        if (places := [pair for pair in (line.position, line.attitude) if pair is not None])
    )
    if runs and runs[0][1] <= error:
        return runs[0][0]
    for (low_cost, high_error), (high_cost, low_error) in pairwise(runs):
        if low_error <= error < high_error:
            part = math.log(high_error / error) / math.log(high_error / low_error)
            return float(low_cost * (high_cost / low_cost) ** part)
    return None


def derive_sweep(report: SweepReport) -> SweepReport:
    """The report on a sweep with the figures to show."""
    if report.show:
        return report
    figures = []
    for name in FIGURES:
        figures_of = (getattr(row, name) for row in report.rows)
        values = [f.value if isinstance(f, Interval) else f for f in figures_of if f is not None]
        if values and max(values) > 1.01 * min(values):
            figures.append(name)
    return replace(report, show=tuple(figures))
