"""Figures of a new measurement that left their band about the recorded ones.

Entry points: `scene_departures(record, measurement, bench)`, `case_departures`.

1. Figures of accuracy are compared; times, and what follows from them, never are.
2. An error has left its band when it differs from the recorded one by more than the band's share of
   it and ten floors of the reference: smaller differences come from the reference, or rounding.
3. Drifts, depths and slips are those of the whole scenario. Where it is chaotic, they are not
   compared: rounding alone changes them.
4. Words and flags must be as they were.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.model.scenarios import BenchTable
from coursebuild.numerics.reports.case_report import CaseReport
from coursebuild.numerics.reports.scene_report import (
    FLOORS,
    FigureLine,
    MeasuredRun,
    OrderRow,
    ScenarioReport,
    SceneReport,
    StableRow,
    SweepReport,
)
from coursebuild.numerics.reports.shown_errors import seconds_text, setting_text, status_text

_STABLE = 0.01
"""Relative band of a largest stable timestep: a bisection ends where its bounds are near."""
_FUZZY = 0.2
"""The same where timesteps beyond are stable again, or other starts have other limits: rounding
decides which is lost first."""
_ROUNDING = 1e-9
"""The absolute difference that drifts and depths may have: rounding differs between processors."""
_INVISIBLE = 1e-6
"""The absolute difference that visible errors may have, where 1 is just visible."""
_TIGHT_BAND = 1e-9
_BENCH = BenchTable()
"""The bands of hard cases."""
_PARTS = ("position", "attitude", "velocity")


class Departure(Struct, frozen=True):
    """A figure that is not what was recorded."""

    where: str
    """The scenario, or the hard case."""
    setting: str
    """In words; empty for figures of all settings together."""
    figure: str
    recorded: str
    measured: str
    band: str
    """The band that the figure should be in, in words."""


class RecordCheck(Struct, frozen=True):
    """A recorded report compared with a new measurement."""

    name: str
    """The model, or `stability`."""
    path: str
    """The file of the recorded report."""
    departures: tuple[Departure, ...]
    remarks: tuple[str, ...] = ()
    """Other differences, which are no mistake by themselves."""


class _Figure(Struct, frozen=True):
    """A figure to compare, and the band about it."""

    value: float | str | bool | None
    share: float | None = None
    """The relative difference that it may have; `None`: it must be the same."""
    least: float = 0.0
    """The absolute difference that it may have in any case."""

    @property
    def band(self) -> str:
        """In words."""
        if self.share is None:
            return "the same"
        return f"± {100 * self.share:g} %" if self.share else f"± {self.least:g}"


_Figures: TypeAlias = dict[str, _Figure]
_Table: TypeAlias = dict[tuple[str, str], _Figures]
"""Figures by the setting or integrator ("" for the whole), and by the kind of that key."""
_Report: TypeAlias = dict[tuple[str, str, str], _Figures]
"""The same of all scenarios, or hard cases, with their names first."""


def scene_departures(
    record: SceneReport, measurement: SceneReport, bench: BenchTable
) -> tuple[Departure, ...]:
    """Everything of a model that left its band, in the order of the recorded report."""

    def figures(report: SceneReport) -> _Report:
        tables = [(scenario.name, _scenario(scenario, bench)) for scenario in report.scenarios]
        return _by_name([*tables, *((sweep.name, _sweep(sweep, bench)) for sweep in report.sweeps)])

    return tuple(_departures(figures(record), figures(measurement)))


def case_departures(
    record: Sequence[CaseReport], measurement: Sequence[CaseReport]
) -> tuple[Departure, ...]:
    """Everything of the hard cases that left its band, in the order of the recorded report."""
    old, new = (
        _by_name((case.name, _case(case)) for case in cases) for cases in (record, measurement)
    )
    return tuple(_departures(old, new))


def _by_name(tables: Iterable[tuple[str, _Table]]) -> _Report:
    return {(name, *key): figures for name, table in tables for key, figures in table.items()}


def _departures(record: _Report, measurement: _Report) -> Iterator[Departure]:
    """Entries that only one report has, and in common entries the figures that left their band."""
    missing: set[str] = set()
    for place, setting, kind in {**record, **measurement}:
        old, new = (report.get((place, setting, kind)) for report in (record, measurement))
        if old is not None and new is not None:
            for name, texts in _compare_figures(old, new):
                yield Departure(place, setting, name, *texts)
        elif place not in missing:
            before, now = ("nothing" if figures is None else "there" for figures in (old, new))
            yield Departure(place, setting, kind, before, now, "the same")
            missing |= set() if setting else {place}  # its settings go with it


def _compare_figures(old: _Figures, new: _Figures) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """The figures of both that differ: recorded, measured, and the band, in words."""
    for name in (name for name in old if name in new):
        a, b = old[name], new[name]
        wider = a if (a.share or 0, a.least) >= (b.share or 0, b.least) else b
        band, differs = wider.band, a.value != b.value
        if isinstance(a.value, float | int) and isinstance(b.value, float | int):
            room = max(a.least, b.least) + (wider.share or 0.0) * abs(a.value)
            differs = differs if wider.share is None else not abs(b.value - a.value) <= room
        elif isinstance(a.value, str) or isinstance(b.value, str):
            band = "the same"
        if differs:
            yield name, (*(_value_text(figure.value, band) for figure in (a, b)), band)  # type: ignore[misc]
            if name == "status":
                return  # what else differs does so for that reason


def _value_text(value: float | str | bool | None, band: str) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float | int):
        return seconds_text(value) if band == "the same" else f"{value:.6g}"
    return value or "nothing"


def _error(name: str, error: tuple[float, float] | None, share: float, least: float) -> _Figures:
    """An error, at its largest and at the end; none is known better than to `least`."""
    if error is None:
        return {f"error of {name}": _Figure(None, share, least)}
    return {
        f"error of {name}": _Figure(error[0], share, least),
        f"error of {name} at the end": _Figure(error[1], share, least),
    }


def _run(
    run: MeasuredRun, share: float, place: float, speed: float, *, predictable: bool
) -> _Figures:
    """The figures of a run.

    `place`, `speed`: the floors of errors of places and velocities. `predictable`: whether the
    reference reaches the end.
    """
    figures = {"status": _Figure(status_text(run.status)), "refsafe": _Figure(run.refsafe)}
    for part, least in zip(_PARTS, (place, place, speed), strict=True):
        figures |= _error(part, getattr(run, part), share, least)
    if run.status == "ok" and predictable:  # how a lost run ended, or a chaotic one, says nothing
        for name in ("energy_drift", "momentum_drift", "penetration"):
            figures[name.replace("_", " ")] = _Figure(getattr(run, name), share, _ROUNDING)
    return figures


def _orders(rows: Sequence[OrderRow], band: float) -> _Table:
    table: _Table = {}
    for row in rows:
        fits = {part: getattr(row, part) for part in _PARTS}
        table[row.integrator, "order"] = {
            f"order of {part}": _Figure(None if fit is None else fit.value, 0.0, band)
            for part, fit in fits.items()
        }
    return table


def _largest(row: StableRow) -> _Figures:
    largest = "all" if row.largest is None else row.largest
    low, high = row.bracket or (1.0, 1.0)
    is_sharp = row.monotone and high <= low * (1 + _STABLE)
    return {
        "largest stable timestep": _Figure(largest, _STABLE if is_sharp else _FUZZY),
        "monotone": _Figure(row.monotone),
    }


def _scenario(report: ScenarioReport, bench: BenchTable) -> _Table:
    share = bench.band
    place, speed = FLOORS * report.floor, FLOORS * report.velocity_floor
    predictable = report.horizon >= report.duration * (1 - _TIGHT_BAND)
    table: _Table = {
        ("", "scenario"): {
            "duration": _Figure(report.duration, _TIGHT_BAND),
            "hold": _Figure(report.hold, _TIGHT_BAND),
            "horizon": _Figure(report.horizon, share),
            "reference": _Figure(report.reference),
            "figure": _Figure(report.figure),
        }
    }
    for row in report.rows:
        figures = {"own setting": _Figure(row.own)}
        figures |= _run(row, share, place, speed, predictable=predictable)
        figures |= _error("figure", row.figure, share, place)
        figures["visible error"] = _Figure(row.seen, share, _INVISIBLE)
        figures["model error"] = _Figure(row.model_error, share, place + _ROUNDING)
        if row.status == "ok" and predictable:
            figures["slip"] = _Figure(row.slip, share, _ROUNDING)
        table[setting_text(row.setting), "setting"] = figures
    table |= _orders(report.orders, bench.order_band)
    return table | {(row.integrator, "stable timestep"): _largest(row) for row in report.stable}


def _sweep(sweep: SweepReport, bench: BenchTable) -> _Table:
    return {("", "sweep"): {}} | {
        (f"{row.parameter} {row.value}", "value"): {
            "status": _Figure(status_text(row.status)),
            **{
                name: _Figure(getattr(row, name), bench.band, _INVISIBLE)
                for name in ("change", "penetration", "slip", "restitution")
            },
        }
        for row in sweep.rows
        if row.parameter != "threads"
    }


def _case(case: CaseReport) -> _Table:
    reference, share = case.reference, _BENCH.band
    place, speed = FLOORS * max(reference.position, reference.attitude), FLOORS * reference.velocity
    table: _Table = {("", "case"): {}}
    for line in case.boundaries:
        figures = _largest(line) | {"beyond": _Figure(status_text(line.beyond))}
        if line.monotone:
            figures["growth"] = _Figure(line.growth, share)
        table[line.integrator, "stable timestep"] = figures
    for figure in case.figures:
        table[figure.integrator, figure.name] = _figure(figure, share, place)
    table |= _orders(case.orders, _BENCH.order_band)
    for run in case.errors:
        name = f"{run.integrator} at {seconds_text(run.timestep)}"
        table[name, "run"] = _run(run, share, place, speed, predictable=True)
    return table


def _figure(line: FigureLine, share: float, least: float) -> _Figures:
    """A quantity that theory gives is compared by its error, another by its size."""
    figures = {f"exact {line.name}": _Figure(line.exact, _TIGHT_BAND)}
    if line.exact is None:
        return figures | {line.name: _Figure(line.measured, share, _ROUNDING)}
    error = None if line.measured is None else line.measured - line.exact
    room = _ROUNDING * max(abs(line.exact), abs(line.measured or 0.0)) + least
    return figures | {f"{line.name}, against theory": _Figure(error, share, room)}
