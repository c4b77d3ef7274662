"""What is measured now against what was recorded: figures that left their band.

Entry points: `scene_departures(recorded, measured, bands)`, `case_departures`.

1. Figures that say how accurate something is are compared, times and what follows from them never.
2. An error has left its band when it differs from the recorded one by more than the band's share of
   it and ten floors of the reference: what is smaller is the reference's, or rounding.
3. Drifts, depths and slips are those of the whole scenario. Where it is chaotic, they are not
   compared: rounding alone changes them.
4. What is words or yes or no must be as it was.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from typing import TypeAlias, TypeVar

from msgspec import Struct

from coursebuild.model.scenarios import Bands
from coursebuild.numerics.reports.bench import (
    OrderRow,
    ScenarioReport,
    SceneReport,
    Setting,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.cases import BoundaryLine, CaseReport, ErrorLine, FigureLine
from coursebuild.numerics.reports.points import FLOORS, seconds_text, setting_text, status_text

_STABLE = 0.01
"""Relative band of a largest stable timestep: a bisection ends where its bounds are near."""
_ROUNDING = 1e-9
"""What drifts and depths may differ by whatever they were: rounding differs between processors."""
_INVISIBLE = 1e-6
"""What errors in a picture may differ by, where 1 is just visible."""
_SAME = 1e-9

Value: TypeAlias = float | str | bool | None
_T = TypeVar("_T")
_K = TypeVar("_K", bound=Hashable)


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


def scene_departures(
    recorded: SceneReport, measured: SceneReport, bands: Bands
) -> tuple[Departure, ...]:
    """Everything of a model that left its band, in the order of the recorded report."""
    found: list[Departure] = []
    for name, old, new in _pairs(recorded.scenarios, measured.scenarios, lambda one: one.name):
        comparing = _Comparing(name, "", bands, found)
        if comparing.both("scenario", old, new) and old is not None and new is not None:
            _scenario(comparing, old, new)
    return tuple(found)


def case_departures(
    recorded: Sequence[CaseReport], measured: Sequence[CaseReport], bands: Bands
) -> tuple[Departure, ...]:
    """Everything of the hard cases that left its band, in the order of the recorded report."""
    found: list[Departure] = []
    for name, old, new in _pairs(recorded, measured, lambda one: one.name):
        comparing = _Comparing(name, "", bands, found)
        if comparing.both("case", old, new) and old is not None and new is not None:
            _case(comparing, old, new)
    return tuple(found)


class _Comparing:
    """Compares figures of one setting, and keeps what left its band."""

    def __init__(self, where: str, setting: str, bands: Bands, found: list[Departure]) -> None:
        self.where = where
        self.setting = setting
        self.bands = bands
        self.found = found

    def of(self, setting: str) -> _Comparing:
        """The same of another setting."""
        return _Comparing(self.where, setting, self.bands, self.found)

    def both(self, what: str, old: object, new: object) -> bool:
        """Whether something is in both; what is in one only is told."""
        if (old is None) != (new is None):
            there = ["nothing" if one is None else "there" for one in (old, new)]
            self._tell(what, there[0], there[1], "the same")
        return old is not None and new is not None

    def same(self, figure: str, old: Value, new: Value) -> None:
        """What must be as it was."""
        if old != new:
            self._tell(figure, _said(old), _said(new), "the same")

    def near(
        self, figure: str, old: float | None, new: float | None, share: float, least: float
    ) -> None:
        """A number that may differ by a share of what it was, and by `least` in any case."""
        if old is None and new is None:
            return
        band = f"± {100 * share:g} %"
        if old is None or new is None or not abs(new - old) <= share * abs(old) + least:
            self._tell(figure, _said(old), _said(new), band)

    def error(
        self, name: str, old: tuple[float, float] | None, new: tuple[float, float] | None, lo: float
    ) -> None:
        """An error, at its largest and at the end; none is known better than to `lo`."""
        if old is None or new is None:
            if old != new:
                shown = [None if pair is None else pair[0] for pair in (old, new)]
                self.near(f"error of {name}", shown[0], shown[1], self.bands.error, 0.0)
            return
        for where, a, b in zip(("", " at the end"), old, new, strict=True):
            self.near(f"error of {name}{where}", a, b, self.bands.error, lo)

    def order(self, name: str, old: float | None, new: float | None) -> None:
        """A fitted order."""
        band = self.bands.order
        if old is None and new is None:
            return
        if old is None or new is None or not abs(new - old) <= band:
            self._tell(f"order of {name}", _said(old), _said(new), f"± {band:g}")

    def _tell(self, figure: str, old: str, new: str, band: str) -> None:
        self.found.append(Departure(self.where, self.setting, figure, old, new, band))


def _said(value: Value) -> str:
    match value:
        case None:
            return "nothing"
        case bool():
            return "yes" if value else "no"
        case str():
            return value or "nothing"
        case _:
            return f"{value:.6g}"


def _pairs(
    old: Sequence[_T], new: Sequence[_T], key: Callable[[_T], _K]
) -> Iterator[tuple[_K, _T | None, _T | None]]:
    """What has the same key, in the order of the first, then what only the second has."""
    first: Mapping[_K, _T] = {key(one): one for one in old}
    second: Mapping[_K, _T] = {key(one): one for one in new}
    for name in (*first, *(name for name in second if name not in first)):
        yield name, first.get(name), second.get(name)


# --- models


def _scenario(comparing: _Comparing, old: ScenarioReport, new: ScenarioReport) -> None:
    comparing.near("duration", old.duration, new.duration, _SAME, 0.0)
    comparing.near("hold", old.hold, new.hold, _SAME, 0.0)
    comparing.near("horizon", old.horizon, new.horizon, comparing.bands.error, 0.0)
    comparing.same("reference", old.reference, new.reference)
    comparing.same("figure", old.figure, new.figure)
    least = (
        FLOORS * max(old.floor, new.floor),
        FLOORS * max(old.velocity_floor, new.velocity_floor),
    )
    known = all(one.horizon >= one.duration * (1 - _SAME) for one in (old, new))

    def setting_of(row: WorkPrecisionRow) -> Setting:
        return row.setting

    for setting, before, after in _pairs(old.rows, new.rows, setting_of):
        one = comparing.of(setting_text(setting))
        if one.both("setting", before, after) and before is not None and after is not None:
            _row(one, before, after, least, known=known)
    _orders(comparing, old.orders, new.orders)
    for name, limit, now in _pairs(old.stable, new.stable, lambda row: row.integrator):
        one = comparing.of(name)
        if one.both("largest stable timestep", limit, now) and limit and now:
            _largest(one, limit, now)


def _row(
    comparing: _Comparing,
    old: WorkPrecisionRow,
    new: WorkPrecisionRow,
    least: tuple[float, float],
    *,
    known: bool,
) -> None:
    """`known`: whether the motion can be told to its end."""
    comparing.same("own setting", old.own, new.own)
    comparing.same("status", status_text(old.status), status_text(new.status))
    if old.status != new.status:
        return  # what else differs does so for that reason
    comparing.same("refsafe", old.refsafe, new.refsafe)
    for name in ("figure", "position", "attitude"):
        comparing.error(name, getattr(old, name), getattr(new, name), least[0])
    comparing.error("velocity", old.velocity, new.velocity, least[1])
    share = comparing.bands.error
    comparing.near("visible error", old.seen, new.seen, share, _INVISIBLE)
    comparing.near("model error", old.model_error, new.model_error, share, least[0] + _ROUNDING)
    if old.status != "ok" or not known:
        return  # how a lost run ended, or a chaotic one, says nothing
    comparing.near("energy drift", old.energy_drift, new.energy_drift, share, _ROUNDING)
    comparing.near("momentum drift", old.momentum_drift, new.momentum_drift, share, _ROUNDING)
    comparing.near("penetration", old.penetration, new.penetration, share, _ROUNDING)
    comparing.near("slip", old.slip, new.slip, share, _ROUNDING)


def _orders(comparing: _Comparing, old: Sequence[OrderRow], new: Sequence[OrderRow]) -> None:
    for name, first, last in _pairs(old, new, lambda row: row.integrator):
        for part in ("position", "attitude", "velocity"):
            a, b = (None if row is None else getattr(row, part) for row in (first, last))
            comparing.of(name).order(part, a, b)


def _largest(
    comparing: _Comparing, old: StableRow | BoundaryLine, new: StableRow | BoundaryLine
) -> None:
    if old.largest is None or new.largest is None:
        shown = ["all" if x.largest is None else seconds_text(x.largest) for x in (old, new)]
        comparing.same("largest stable timestep", shown[0], shown[1])
    else:
        comparing.near("largest stable timestep", old.largest, new.largest, _STABLE, 0.0)
    comparing.same("monotone", old.monotone, new.monotone)


# --- hard cases


def _case(comparing: _Comparing, old: CaseReport, new: CaseReport) -> None:
    floors = [case.reference.floor for case in (old, new) if case.reference is not None]
    least = FLOORS * max(floors, default=0.0)
    for name, limit, now in _pairs(old.boundaries, new.boundaries, lambda line: line.integrator):
        one = comparing.of(name)
        if one.both("largest stable timestep", limit, now) and limit and now:
            _largest(one, limit, now)
            one.same("beyond", status_text(limit.beyond), status_text(now.beyond))
            one.near("growth", limit.growth, now.growth, comparing.bands.error, 0.0)

    def name_of(line: FigureLine) -> tuple[str, str]:
        return line.name, line.integrator

    for (figure, name), first, last in _pairs(old.figures, new.figures, name_of):
        one = comparing.of(name)
        if one.both(figure, first, last) and first and last:
            _figure(one, first, last, least)
    _orders(comparing, old.orders, new.orders)

    def run_of(line: ErrorLine) -> tuple[str, float]:
        return line.integrator, line.timestep

    for (name, timestep), run, rerun in _pairs(old.errors, new.errors, run_of):
        one = comparing.of(f"{name} at {seconds_text(timestep)}")
        if one.both("run", run, rerun) and run and rerun:
            _error_line(one, run, rerun, least)


def _figure(comparing: _Comparing, old: FigureLine, new: FigureLine, least: float) -> None:
    """What is known exactly is compared by how far it is off, and what is not by its size."""
    share = comparing.bands.error
    if None in (old.exact, new.exact, old.measured, new.measured):
        comparing.near(f"exact {old.name}", old.exact, new.exact, _SAME, 0.0)
        comparing.near(old.name, old.measured, new.measured, share, _ROUNDING)
        return
    assert old.exact is not None and new.exact is not None
    assert old.measured is not None and new.measured is not None
    comparing.near(f"exact {old.name}", old.exact, new.exact, _SAME, 0.0)
    size = max(abs(old.exact), abs(old.measured))
    off = (old.measured - old.exact, new.measured - new.exact)
    comparing.near(f"{old.name}, against theory", *off, share, _ROUNDING * size + least)


def _error_line(comparing: _Comparing, old: ErrorLine, new: ErrorLine, least: float) -> None:
    comparing.same("status", status_text(old.status), status_text(new.status))
    if old.status != new.status:
        return
    comparing.same("refsafe", old.refsafe, new.refsafe)
    for name in ("position", "attitude", "velocity"):
        comparing.error(name, getattr(old, name), getattr(new, name), least)
    if old.status == "ok":
        share = comparing.bands.error
        comparing.near("energy drift", old.energy_drift, new.energy_drift, share, _ROUNDING)
        comparing.near("momentum drift", old.momentum_drift, new.momentum_drift, share, _ROUNDING)
        comparing.near("penetration", old.penetration, new.penetration, share, _ROUNDING)
