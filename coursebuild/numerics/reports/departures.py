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
    FLOORS,
    OrderRow,
    ScenarioReport,
    SceneReport,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.cases import CaseReport, ErrorLine, FigureLine
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
_PARTS = ("position", "attitude", "velocity")

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
        comparison = _Comparison(name, "", bands, found)
        for both in comparison.both("scenario", old, new):
            _scenario(comparison, *both)
    for name, before, now in _pairs(recorded.sweeps, measured.sweeps, lambda one: one.name):
        comparison = _Comparison(name, "", bands, found)
        for sweeps in comparison.both("sweep", before, now):
            _sweep(comparison, *sweeps)
    return tuple(found)


def case_departures(
    recorded: Sequence[CaseReport], measured: Sequence[CaseReport], bands: Bands
) -> tuple[Departure, ...]:
    """Everything of the hard cases that left its band, in the order of the recorded report."""
    found: list[Departure] = []
    for name, old, new in _pairs(recorded, measured, lambda one: one.name):
        comparison = _Comparison(name, "", bands, found)
        for both in comparison.both("case", old, new):
            _case(comparison, *both)
    return tuple(found)


class _Comparison(Struct, frozen=True, eq=False):
    """Compares figures of one setting, and keeps what left its band."""

    where: str
    setting: str
    bands: Bands
    found: list[Departure]

    def of(self, setting: str) -> _Comparison:
        """The same of another setting."""
        return replace(self, setting=setting)

    def both(self, what: str, old: _T | None, new: _T | None) -> Iterator[tuple[_T, _T]]:
        """Something that is in both; what is in one only is told."""
        if old is not None and new is not None:
            yield old, new
        elif old is not None or new is not None:
            first, second = ("nothing" if one is None else "there" for one in (old, new))
            self._depart(what, first, second, "the same")

    def same(self, figure: str, old: Value, new: Value) -> None:
        """What must be as it was."""
        if old != new:
            self._depart(figure, _shown(old), _shown(new), "the same")

    def near(
        self,
        figure: str,
        old: float | None,
        new: float | None,
        least: float = 0.0,
        share: float | None = None,
    ) -> None:
        """A number that may differ by a share of what it was, and by `least` in any case."""
        part = self.bands.error if share is None else share
        self._within(figure, old, new, part * abs(old or 0.0) + least, f"± {100 * part:g} %")

    def error(
        self,
        name: str,
        old: tuple[float, float] | None,
        new: tuple[float, float] | None,
        least: float,
    ) -> None:
        """An error, at its largest and at the end; none is known better than to `least`."""
        name = f"error of {name}"
        if old is None or new is None:
            self.near(name, old and old[0], new and new[0])
            return
        self.near(name, old[0], new[0], least)
        self.near(f"{name} at the end", old[1], new[1], least)

    def orders(self, old: Sequence[OrderRow], new: Sequence[OrderRow]) -> None:
        """Fitted orders."""
        band = self.bands.order
        for name, first, last in _pairs(old, new, lambda row: row.integrator):
            for part in _PARTS:
                fits = (None if row is None else getattr(row, part) for row in (first, last))
                a, b = (None if fit is None else fit.value for fit in fits)
                self.of(name)._within(f"order of {part}", a, b, band, f"± {band:g}")

    def _within(
        self, figure: str, old: float | None, new: float | None, room: float, band: str
    ) -> None:
        if (old is None) != (new is None) or (
            old is not None and new is not None and not abs(new - old) <= room
        ):
            self._depart(figure, _shown(old), _shown(new), band)

    def _depart(self, figure: str, old: str, new: str, band: str) -> None:
        self.found.append(Departure(self.where, self.setting, figure, old, new, band))


def _shown(value: Value) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float | int) else value or "nothing"


def _pairs(
    old: Sequence[_T], new: Sequence[_T], key: Callable[[_T], _K]
) -> Iterator[tuple[_K, _T | None, _T | None]]:
    """What has the same key, in the order of the first, then what only the second has."""
    first, second = {key(one): one for one in old}, {key(one): one for one in new}
    for name in first | second:
        yield name, first.get(name), second.get(name)


def _run(
    comparison: _Comparison, old: _Run, new: _Run, place: float, speed: float, *, known: bool
) -> bool:
    """What is measured of every run; whether both went alike.

    `place`, `speed`: what errors of places and velocities are not known better than. `known`:
    whether the motion can be told to its end.
    """
    comparison.same("status", status_text(old.status), status_text(new.status))
    if old.status != new.status:
        return False  # what else differs does so for that reason
    comparison.same("refsafe", old.refsafe, new.refsafe)
    for part, least in zip(_PARTS, (place, place, speed), strict=True):
        comparison.error(part, getattr(old, part), getattr(new, part), least)
    if old.status == "ok" and known:  # how a lost run ended, or a chaotic one, says nothing
        for name in ("energy_drift", "momentum_drift", "penetration"):
            pair = getattr(old, name), getattr(new, name)
            comparison.near(name.replace("_", " "), *pair, _ROUNDING)
    return True


def _largest(comparison: _Comparison, old: StableRow, new: StableRow) -> None:
    name = "largest stable timestep"
    if old.largest is None or new.largest is None:
        a, b = ("all" if x.largest is None else seconds_text(x.largest) for x in (old, new))
        comparison.same(name, a, b)
    else:
        sharp = old.monotone and new.monotone
        comparison.near(name, old.largest, new.largest, share=_STABLE if sharp else _FUZZY)
    comparison.same("monotone", old.monotone, new.monotone)


# --- models


def _scenario(comparison: _Comparison, old: ScenarioReport, new: ScenarioReport) -> None:
    comparison.near("duration", old.duration, new.duration, share=_SAME)
    comparison.near("hold", old.hold, new.hold, share=_SAME)
    comparison.near("horizon", old.horizon, new.horizon)
    comparison.same("reference", old.reference, new.reference)
    comparison.same("figure", old.figure, new.figure)
    place = FLOORS * max(old.floor, new.floor)
    speed = FLOORS * max(old.velocity_floor, new.velocity_floor)
    known = all(one.horizon >= one.duration * (1 - _SAME) for one in (old, new))
    for setting, before, after in _pairs(old.rows, new.rows, lambda row: row.setting):
        one = comparison.of(setting_text(setting))
        for rows in one.both("setting", before, after):
            _row(one, *rows, place, speed, known=known)
    comparison.orders(old.orders, new.orders)
    for name, limit, now in _pairs(old.stable, new.stable, lambda row: row.integrator):
        one = comparison.of(name)
        for limits in one.both("largest stable timestep", limit, now):
            _largest(one, *limits)


def _row(
    comparison: _Comparison,
    old: WorkPrecisionRow,
    new: WorkPrecisionRow,
    place: float,
    speed: float,
    *,
    known: bool,
) -> None:
    comparison.same("own setting", old.own, new.own)
    if not _run(comparison, old, new, place, speed, known=known):
        return
    comparison.error("figure", old.figure, new.figure, place)
    comparison.near("visible error", old.seen, new.seen, _INVISIBLE)
    comparison.near("model error", old.model_error, new.model_error, place + _ROUNDING)
    if old.status == "ok" and known:
        comparison.near("slip", old.slip, new.slip, _ROUNDING)


def _sweep(comparison: _Comparison, old: SweepReport, new: SweepReport) -> None:
    for setting, before, after in _pairs(old.rows, new.rows, lambda r: (r.parameter, r.value)):
        if setting[0] == "threads":
            continue
        one = comparison.of(" ".join(setting))
        for rows in one.both("value", before, after):
            one.same("status", *(status_text(row.status) for row in rows))
            for name in ("change", "penetration", "slip", "restitution"):
                one.near(name, getattr(rows[0], name), getattr(rows[1], name), _INVISIBLE)


# --- hard cases


def _case(comparison: _Comparison, old: CaseReport, new: CaseReport) -> None:
    both = old.reference, new.reference
    place = FLOORS * max(max(one.position, one.attitude) for one in both)
    speed = FLOORS * max(one.velocity for one in both)
    for name, limit, now in _pairs(old.boundaries, new.boundaries, lambda line: line.integrator):
        one = comparison.of(name)
        for before, after in one.both("largest stable timestep", limit, now):
            _largest(one, before, after)
            one.same("beyond", status_text(before.beyond), status_text(after.beyond))
            if before.monotone and after.monotone:
                one.near("growth", before.growth, after.growth)
    figures = _pairs(old.figures, new.figures, lambda line: (line.name, line.integrator))
    for (figure, name), first, last in figures:
        one = comparison.of(name)
        for lines in one.both(figure, first, last):
            _figure(one, *lines, place)
    comparison.orders(old.orders, new.orders)
    runs = _pairs(old.errors, new.errors, lambda line: (line.integrator, line.timestep))
    for (name, timestep), run, again in runs:
        one = comparison.of(f"{name} at {seconds_text(timestep)}")
        for pair in one.both("run", run, again):
            _run(one, *pair, place, speed, known=True)


def _figure(comparison: _Comparison, old: FigureLine, new: FigureLine, least: float) -> None:
    """What is known exactly is compared by how far it is off, and what is not by its size."""
    comparison.near(f"exact {old.name}", old.exact, new.exact, share=_SAME)
    if old.exact is None or new.exact is None or old.measured is None or new.measured is None:
        comparison.near(old.name, old.measured, new.measured, _ROUNDING)
        return
    size = max(abs(old.exact), abs(old.measured))
    off = old.measured - old.exact, new.measured - new.exact
    comparison.near(f"{old.name}, against theory", *off, _ROUNDING * size + least)
