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

from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import TypeAlias, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.scenarios import Bands
from coursebuild.numerics.reports.bench import (
    OrderRow,
    ScenarioReport,
    SceneReport,
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
_Run = TypeVar("_Run", WorkPrecisionRow, ErrorLine)


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
        if both := comparing.both("scenario", old, new):
            _scenario(comparing, *both)
    return tuple(found)


def case_departures(
    recorded: Sequence[CaseReport], measured: Sequence[CaseReport], bands: Bands
) -> tuple[Departure, ...]:
    """Everything of the hard cases that left its band, in the order of the recorded report."""
    found: list[Departure] = []
    for name, old, new in _pairs(recorded, measured, lambda one: one.name):
        comparing = _Comparing(name, "", bands, found)
        if both := comparing.both("case", old, new):
            _case(comparing, *both)
    return tuple(found)


class _Comparing(Struct, frozen=True, eq=False):
    """Compares figures of one setting, and keeps what left its band."""

    where: str
    setting: str
    bands: Bands
    found: list[Departure]

    def of(self, setting: str) -> _Comparing:
        """The same of another setting."""
        return replace(self, setting=setting)

    def both(self, what: str, old: _T | None, new: _T | None) -> tuple[_T, _T] | None:
        """Something that is in both; what is in one only is told."""
        if old is not None and new is not None:
            return old, new
        if old is not None or new is not None:
            there = ["nothing" if one is None else "there" for one in (old, new)]
            self._depart(what, there[0], there[1], "the same")
        return None

    def same(self, figure: str, old: Value, new: Value) -> None:
        """What must be as it was."""
        if old != new:
            self._depart(figure, _shown(old), _shown(new), "the same")

    def near(
        self, figure: str, old: float | None, new: float | None, share: float, least: float = 0.0
    ) -> None:
        """A number that may differ by a share of what it was, and by `least` in any case."""
        self._within(figure, old, new, share * abs(old or 0.0) + least, f"± {100 * share:g} %")

    def error(
        self,
        name: str,
        old: tuple[float, float] | None,
        new: tuple[float, float] | None,
        least: float,
    ) -> None:
        """An error, at its largest and at the end; none is known better than to `least`."""
        share = self.bands.error
        if old is None or new is None:
            a, b = (None if pair is None else pair[0] for pair in (old, new))
            self.near(f"error of {name}", a, b, share)
            return
        for where, a, b in zip(("", " at the end"), old, new, strict=True):
            self.near(f"error of {name}{where}", a, b, share, least)

    def order(self, name: str, old: float | None, new: float | None) -> None:
        """A fitted order."""
        band = self.bands.order
        self._within(f"order of {name}", old, new, band, f"± {band:g}")

    def _within(
        self, figure: str, old: float | None, new: float | None, room: float, band: str
    ) -> None:
        if old is None and new is None:
            return
        if old is None or new is None or not abs(new - old) <= room:
            self._depart(figure, _shown(old), _shown(new), band)

    def _depart(self, figure: str, old: str, new: str, band: str) -> None:
        self.found.append(Departure(self.where, self.setting, figure, old, new, band))


def _shown(value: Value) -> str:
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
    first, second = {key(one): one for one in old}, {key(one): one for one in new}
    for name in first | second:
        yield name, first.get(name), second.get(name)


# --- models


def _scenario(comparing: _Comparing, old: ScenarioReport, new: ScenarioReport) -> None:
    comparing.near("duration", old.duration, new.duration, _SAME)
    comparing.near("hold", old.hold, new.hold, _SAME)
    comparing.near("horizon", old.horizon, new.horizon, comparing.bands.error)
    comparing.same("reference", old.reference, new.reference)
    comparing.same("figure", old.figure, new.figure)
    place = FLOORS * max(old.floor, new.floor)
    speed = FLOORS * max(old.velocity_floor, new.velocity_floor)
    known = all(one.horizon >= one.duration * (1 - _SAME) for one in (old, new))
    for setting, before, after in _pairs(old.rows, new.rows, lambda row: row.setting):
        one = comparing.of(setting_text(setting))
        if rows := one.both("setting", before, after):
            _row(one, *rows, place, speed, known=known)
    _orders(comparing, old.orders, new.orders)
    for name, limit, now in _pairs(old.stable, new.stable, lambda row: row.integrator):
        one = comparing.of(name)
        if limits := one.both("largest stable timestep", limit, now):
            _largest(one, *limits)


def _row(
    comparing: _Comparing,
    old: WorkPrecisionRow,
    new: WorkPrecisionRow,
    place: float,
    speed: float,
    *,
    known: bool,
) -> None:
    """Compare a setting; `known`: whether the motion can be told to its end.

    `place`, `speed`: what errors of places and velocities are not known better than.
    """
    comparing.same("own setting", old.own, new.own)
    if not _run(comparing, old, new, place, speed, known=known):
        return
    share = comparing.bands.error
    comparing.error("figure", old.figure, new.figure, place)
    comparing.near("visible error", old.seen, new.seen, share, _INVISIBLE)
    comparing.near("model error", old.model_error, new.model_error, share, place + _ROUNDING)
    if old.status == "ok" and known:
        comparing.near("slip", old.slip, new.slip, share, _ROUNDING)


def _run(
    comparing: _Comparing, old: _Run, new: _Run, place: float, speed: float, *, known: bool = True
) -> bool:
    """What is measured of every run; whether both went alike."""
    comparing.same("status", status_text(old.status), status_text(new.status))
    if old.status != new.status:
        return False  # what else differs does so for that reason
    comparing.same("refsafe", old.refsafe, new.refsafe)
    comparing.error("position", old.position, new.position, place)
    comparing.error("attitude", old.attitude, new.attitude, place)
    comparing.error("velocity", old.velocity, new.velocity, speed)
    if old.status == "ok" and known:  # how a lost run ended, or a chaotic one, says nothing
        for name in ("energy_drift", "momentum_drift", "penetration"):
            a, b = getattr(old, name), getattr(new, name)
            comparing.near(name.replace("_", " "), a, b, comparing.bands.error, _ROUNDING)
    return True


def _orders(comparing: _Comparing, old: Sequence[OrderRow], new: Sequence[OrderRow]) -> None:
    for name, first, last in _pairs(old, new, lambda row: row.integrator):
        for part in ("position", "attitude", "velocity"):
            a, b = (None if row is None else getattr(row, part) for row in (first, last))
            comparing.of(name).order(part, a, b)


def _largest(
    comparing: _Comparing, old: StableRow | BoundaryLine, new: StableRow | BoundaryLine
) -> None:
    name = "largest stable timestep"
    if old.largest is None or new.largest is None:
        a, b = ("all" if x.largest is None else seconds_text(x.largest) for x in (old, new))
        comparing.same(name, a, b)
    else:
        comparing.near(name, old.largest, new.largest, _STABLE)
    comparing.same("monotone", old.monotone, new.monotone)


# --- hard cases


def _case(comparing: _Comparing, old: CaseReport, new: CaseReport) -> None:
    floors = [case.reference.floor for case in (old, new) if case.reference is not None]
    least = FLOORS * max(floors, default=0.0)
    for name, limit, now in _pairs(old.boundaries, new.boundaries, lambda line: line.integrator):
        one = comparing.of(name)
        if limits := one.both("largest stable timestep", limit, now):
            before, after = limits
            _largest(one, before, after)
            one.same("beyond", status_text(before.beyond), status_text(after.beyond))
            one.near("growth", before.growth, after.growth, comparing.bands.error)
    figures = _pairs(old.figures, new.figures, lambda line: (line.name, line.integrator))
    for (figure, name), first, last in figures:
        one = comparing.of(name)
        if lines := one.both(figure, first, last):
            _figure(one, *lines, least)
    _orders(comparing, old.orders, new.orders)
    runs = _pairs(old.errors, new.errors, lambda line: (line.integrator, line.timestep))
    for (name, timestep), run, again in runs:
        one = comparing.of(f"{name} at {seconds_text(timestep)}")
        if pair := one.both("run", run, again):
            _run(one, *pair, least, least)


def _figure(comparing: _Comparing, old: FigureLine, new: FigureLine, least: float) -> None:
    """What is known exactly is compared by how far it is off, and what is not by its size."""
    share = comparing.bands.error
    comparing.near(f"exact {old.name}", old.exact, new.exact, _SAME)
    if old.exact is None or new.exact is None or old.measured is None or new.measured is None:
        comparing.near(old.name, old.measured, new.measured, share, _ROUNDING)
        return
    size = max(abs(old.exact), abs(old.measured))
    off = (old.measured - old.exact, new.measured - new.exact)
    comparing.near(f"{old.name}, against theory", *off, share, _ROUNDING * size + least)
