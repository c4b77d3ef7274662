"""What is measured now against what was recorded: figures that left their band.

Entry points: `scene_departures(recorded, measured, bench)`, `case_departures`.

1. Figures that say how accurate something is are compared, times and what follows from them never.
2. An error has left its band when it differs from the recorded one by more than the band's share of
   it and ten floors of the reference: what is smaller is the reference's, or rounding.
3. Drifts, depths and slips are those of the whole scenario. Where it is chaotic, they are not
   compared: rounding alone changes them.
4. What is words or yes or no must be as it was.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.model.scenarios import BenchTable
from coursebuild.numerics.reports.bench import (
    FLOORS,
    MeasuredRun,
    OrderRow,
    ScenarioReport,
    SceneReport,
    StableRow,
)
from coursebuild.numerics.reports.cases import CaseReport, FigureLine
from coursebuild.numerics.reports.sweep import SweepReport
from coursebuild.numerics.reports.text import seconds_text, setting_text, status_text

_STABLE = 0.01
"""Relative band of a largest stable timestep: a bisection ends where its bounds are near."""
_FUZZY = 0.2
"""The same where timesteps beyond are stable again: rounding decides which is lost first."""
_ROUNDING = 1e-9
"""What drifts and depths may differ by whatever they were: rounding differs between processors."""
_INVISIBLE = 1e-6
"""What errors in a picture may differ by, where 1 is just visible."""
_SAME = 1e-9
_BENCH = BenchTable()
"""The bands of hard cases."""
_PARTS = ("position", "attitude", "velocity")


class Departure(Struct, frozen=True):
    """A figure that is not what was recorded."""

    where: str
    """The scenario, or the hard case."""
    setting: str
    """In words; empty for what is said of all settings."""
    figure: str
    recorded: str
    measured: str
    band: str
    """What would have been well."""


class Checked(Struct, frozen=True):
    """A recorded report, held against what was measured."""

    name: str
    """The model, or `stability`."""
    path: str
    """Where the recorded report is."""
    departures: tuple[Departure, ...]
    remarks: tuple[str, ...] = ()
    """What else differs, and is no mistake by itself."""


class _Figure(Struct, frozen=True):
    """Something that is compared."""

    value: float | str | bool | None
    share: float | None = None
    """What it may differ by, relative; `None`: it must be the same."""
    least: float = 0.0
    """What it may differ by in any case."""

    @property
    def band(self) -> str:
        """In words."""
        if self.share is None:
            return "the same"
        return f"± {100 * self.share:g} %" if self.share else f"± {self.least:g}"


_Figures: TypeAlias = dict[str, _Figure]
_Table: TypeAlias = dict[tuple[str, str], _Figures]
"""Figures by what they are of, a setting or an integrator, and by what that is in the report; those
of no setting are of the whole."""
_Report: TypeAlias = dict[tuple[str, str, str], _Figures]
"""The same of all scenarios, or hard cases, by their names."""


def scene_departures(
    recorded: SceneReport, measured: SceneReport, bench: BenchTable
) -> tuple[Departure, ...]:
    """Everything of a model that left its band, in the order of the recorded report."""

    def figures(report: SceneReport) -> _Report:
        tables = [(one.name, _scenario(one, bench)) for one in report.scenarios]
        return _by_name([*tables, *((one.name, _sweep(one, bench)) for one in report.sweeps)])

    return tuple(_departures(figures(recorded), figures(measured)))


def case_departures(
    recorded: Sequence[CaseReport], measured: Sequence[CaseReport]
) -> tuple[Departure, ...]:
    """Everything of the hard cases that left its band, in the order of the recorded report."""
    old, new = (_by_name((one.name, _case(one)) for one in c) for c in (recorded, measured))
    return tuple(_departures(old, new))


def _by_name(tables: Iterable[tuple[str, _Table]]) -> _Report:
    return {(name, *key): figures for name, table in tables for key, figures in table.items()}


def _departures(recorded: _Report, measured: _Report) -> Iterator[Departure]:
    """What is in one only is told, and of what is in both the figures that left their band."""
    gone: set[str] = set()
    for where, setting, kind in {**recorded, **measured}:
        old, new = (one.get((where, setting, kind)) for one in (recorded, measured))
        if old is not None and new is not None:
            for name, told in _compared(old, new):
                yield Departure(where, setting, name, *told)
        elif where not in gone:
            before, now = ("nothing" if one is None else "there" for one in (old, new))
            yield Departure(where, setting, kind, before, now, "the same")
            gone |= set() if setting else {where}  # its settings go with it


def _compared(old: _Figures, new: _Figures) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Figures that both have, and are not alike: recorded, measured, and the band."""
    for name in (name for name in old if name in new):
        a, b = old[name], new[name]
        wide = a if (a.share or 0, a.least) >= (b.share or 0, b.least) else b
        band, unlike = wide.band, a.value != b.value
        if isinstance(a.value, float | int) and isinstance(b.value, float | int):
            room = max(a.least, b.least) + (wide.share or 0.0) * abs(a.value)
            unlike = unlike if wide.share is None else not abs(b.value - a.value) <= room
        elif isinstance(a.value, str) or isinstance(b.value, str):
            band = "the same"
        if unlike:
            yield name, (*(_shown(one.value, band) for one in (a, b)), band)  # type: ignore[misc]
            if name == "status":
                return  # what else differs does so for that reason


def _shown(value: float | str | bool | None, band: str) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float | int):
        return seconds_text(value) if band == "the same" else f"{value:.6g}"
    return value or "nothing"


def _error(name: str, found: tuple[float, float] | None, share: float, least: float) -> _Figures:
    """An error, at its largest and at the end; none is known better than to `least`."""
    if found is None:
        return {f"error of {name}": _Figure(None, share, least)}
    return {
        f"error of {name}": _Figure(found[0], share, least),
        f"error of {name} at the end": _Figure(found[1], share, least),
    }


def _run(run: MeasuredRun, share: float, place: float, speed: float, *, known: bool) -> _Figures:
    """What is measured of every run.

    `place`, `speed`: what errors of places and velocities are not known better than. `known`:
    whether the motion can be told to its end.
    """
    found = {"status": _Figure(status_text(run.status)), "refsafe": _Figure(run.refsafe)}
    for part, least in zip(_PARTS, (place, place, speed), strict=True):
        found |= _error(part, getattr(run, part), share, least)
    if run.status == "ok" and known:  # how a lost run ended, or a chaotic one, says nothing
        for name in ("energy_drift", "momentum_drift", "penetration"):
            found[name.replace("_", " ")] = _Figure(getattr(run, name), share, _ROUNDING)
    return found


def _orders(rows: Sequence[OrderRow], band: float) -> _Table:
    found: _Table = {}
    for row in rows:
        fits = {part: getattr(row, part) for part in _PARTS}
        found[row.integrator, "order"] = {
            f"order of {part}": _Figure(None if fit is None else fit.value, 0.0, band)
            for part, fit in fits.items()
        }
    return found


def _largest(row: StableRow) -> _Figures:
    largest = "all" if row.largest is None else row.largest
    return {
        "largest stable timestep": _Figure(largest, _STABLE if row.monotone else _FUZZY),
        "monotone": _Figure(row.monotone),
    }


def _scenario(report: ScenarioReport, bench: BenchTable) -> _Table:
    share = bench.band
    place, speed = FLOORS * report.floor, FLOORS * report.velocity_floor
    known = report.horizon >= report.duration * (1 - _SAME)
    found: _Table = {
        ("", "scenario"): {
            "duration": _Figure(report.duration, _SAME),
            "hold": _Figure(report.hold, _SAME),
            "horizon": _Figure(report.horizon, share),
            "reference": _Figure(report.reference),
            "figure": _Figure(report.figure),
        }
    }
    for row in report.rows:
        figures = {"own setting": _Figure(row.own)}
        figures |= _run(row, share, place, speed, known=known)
        figures |= _error("figure", row.figure, share, place)
        figures["visible error"] = _Figure(row.seen, share, _INVISIBLE)
        figures["model error"] = _Figure(row.model_error, share, place + _ROUNDING)
        if row.status == "ok" and known:
            figures["slip"] = _Figure(row.slip, share, _ROUNDING)
        found[setting_text(row.setting), "setting"] = figures
    found |= _orders(report.orders, bench.order_band)
    return found | {(row.integrator, "stable timestep"): _largest(row) for row in report.stable}


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
    known, share = case.reference, _BENCH.band
    place, speed = FLOORS * max(known.position, known.attitude), FLOORS * known.velocity
    found: _Table = {("", "case"): {}}
    for line in case.boundaries:
        figures = _largest(line) | {"beyond": _Figure(status_text(line.beyond))}
        if line.monotone:
            figures["growth"] = _Figure(line.growth, share)
        found[line.integrator, "stable timestep"] = figures
    for figure in case.figures:
        found[figure.integrator, figure.name] = _figure(figure, share, place)
    found |= _orders(case.orders, _BENCH.order_band)
    for run in case.errors:
        name = f"{run.integrator} at {seconds_text(run.timestep)}"
        found[name, "run"] = _run(run, share, place, speed, known=True)
    return found


def _figure(line: FigureLine, share: float, least: float) -> _Figures:
    """What is known exactly is compared by how far it is off, and what is not by its size."""
    found = {f"exact {line.name}": _Figure(line.exact, _SAME)}
    if line.exact is None:
        return found | {line.name: _Figure(line.measured, share, _ROUNDING)}
    off = None if line.measured is None else line.measured - line.exact
    room = _ROUNDING * max(abs(line.exact), abs(line.measured or 0.0)) + least
    return found | {f"{line.name}, against theory": _Figure(off, share, room)}
