"""Reports as files, and how a new measurement differs from them.

1. Keys are sorted, and every measured row is a line, so that a difference between two versions of a
   file says what changed. The same report gives the same bytes.
2. Reading is strict: a file that lacks a field, has one more, or points at a row that is not there
   was not written by this tool.
3. Figures of accuracy are compared; times, and what follows from them, never are. An error has left
   its band when it differs from the recorded one by more than the band's share of it and ten floors
   of the reference: smaller differences come from the reference, or rounding.
4. Drifts, depths and slips are those of the whole scenario. Where it is chaotic, they are not
   compared: rounding alone changes them. Words and flags must be as they were.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Generic, TypeAlias, TypeVar

import msgspec
from msgspec import Struct

from mjbench.declarations import BenchTable
from mjbench.reports import model_report, scene_report
from mjbench.reports.diet_report import DietReport
from mjbench.reports.model_report import CaseReport, EngineReport
from mjbench.reports.shown_errors import seconds_text, setting_text, status_text

VERSION = 5
"""Goes up when files that were written before cannot be read any more."""

_T = TypeVar("_T")


class RecordError(Exception):
    """Why a file is no report that can be used, without the file's name."""


class ReportKind(Struct, Generic[_T], frozen=True):
    """A kind of report, and its file."""

    name: str
    """Of the command that makes it, perhaps with an option."""
    field: str
    """The key of the report in its file."""
    type: type[_T]

    def encode(self, report: _T) -> bytes:
        """The file."""
        value = {"holds": f"mjbench {self.name}", "version": VERSION, self.field: report}
        return (_text(msgspec.to_builtins(value, order="sorted"), 0, 0) + "\n").encode()

    def decode(self, data: bytes) -> _T:
        """Read a file; a `RecordError` where it holds no such report."""
        fields = [("holds", str), ("version", int), (self.field, self.type)]
        file = msgspec.defstruct("File", fields, forbid_unknown_fields=True)
        head = _head(data)
        if head.get("holds") != f"mjbench {self.name}":
            raise RecordError(f"holds no report of `mjbench {self.name}`")
        if (version := head.get("version")) != VERSION:
            raise RecordError(f"has version {version} of its format, and this one is {VERSION}")
        try:
            report: _T = getattr(msgspec.convert(head, file), self.field)
        except (msgspec.ValidationError, RecursionError) as error:
            raise RecordError(f"is damaged: {error}") from None
        return report


BENCH = ReportKind("bench", "scene", model_report.SceneReport)
ENGINES = ReportKind("bench --engines", "engines", EngineReport)
DIET = ReportKind("diet", "diet", DietReport)
STABILITY: ReportKind[tuple[CaseReport, ...]] = ReportKind(
    "stability", "cases", tuple[CaseReport, ...]
)


def read_report(data: bytes) -> Any:
    """Read a file with a report of any kind; a `RecordError` where it holds none."""
    name = _head(data).get("holds")
    kinds: tuple[ReportKind[Any], ...] = (BENCH, DIET, ENGINES, STABILITY)
    for kind in kinds:
        if name == f"mjbench {kind.name}":
            return kind.decode(data)
    raise RecordError("holds no report of mjbench")


def _head(data: bytes) -> dict[str, Any]:
    """The keys and values of a file; a `RecordError` where it is no JSON."""
    try:
        value = msgspec.json.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RecordError(f"is damaged: {error}") from None
    return value if isinstance(value, dict) else {}


def _text(value: Any, indent: int, lists: int) -> str:
    """A value as JSON over several lines; small values and rows take one."""
    inner, is_row = " " * (indent + 1), lists >= 2
    if isinstance(value, dict) and not is_row:
        is_flat = not any(isinstance(part, dict | list | tuple) and part for part in value.values())
        is_row = is_flat and len(_flat(value)) <= 80
    if isinstance(value, dict) and value and not is_row:
        items = [f"{_flat(key)}: {_text(value[key], indent + 1, lists)}" for key in sorted(value)]
    elif isinstance(value, list | tuple) and any(isinstance(part, dict) for part in value):
        items = [_text(part, indent + 1, lists + 1) for part in value]
    else:
        return _flat(value)
    left, right = "{}" if isinstance(value, dict) else "[]"
    return left + "".join(f"\n{inner}{item}," for item in items)[:-1] + f"\n{' ' * indent}{right}"


def _flat(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, sort_keys=True)


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


class _Figure(Struct, frozen=True):
    """A figure to compare, and the band about it."""

    value: float | str | bool | None
    share: float | None = None
    """The relative difference that it may have; `None`: it must be the same."""
    least: float = 0.0
    """The absolute difference that it may have in any case."""


_Figures: TypeAlias = dict[str, _Figure]
_Table: TypeAlias = dict[tuple[str, str], _Figures]
"""Figures by the setting or integrator ("" for the whole), and by the kind of that key."""
_Report: TypeAlias = dict[tuple[str, str, str], _Figures]
"""The same of all scenarios, or hard cases, with their names first."""


def scene_departures(
    record: model_report.SceneReport, measurement: model_report.SceneReport, bench: BenchTable
) -> tuple[Departure, ...]:
    """Everything of a model that left its band, in the order of the recorded report."""

    def figures(report: model_report.SceneReport) -> _Report:
        tables = [(scenario.name, _scenario(scenario, bench)) for scenario in report.scenarios]
        for sweep in report.sweeps:
            table: _Table = {("", "sweep"): {}}
            for row in sweep.rows:
                parts = {"status": _Figure(status_text(row.status))}
                for name in ("change", "parted", "penetration", "slip", "restitution"):
                    parts[name] = _Figure(getattr(row, name), bench.band, _INVISIBLE)
                table[f"{row.parameter} {row.value}", "value"] = parts
            tables.append((sweep.name, table))
        return _by_name(tables)

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
            for name in (name for name in old if name in new):
                if (texts := _compare(old[name], new[name])) is not None:
                    yield Departure(place, setting, name, *texts)
                    if name == "status":
                        break  # what else differs does so for that reason
        elif place not in missing:
            before, now = ("nothing" if figures is None else "there" for figures in (old, new))
            yield Departure(place, setting, kind, before, now, "the same")
            missing |= set() if setting else {place}  # its settings go with it


def _compare(a: _Figure, b: _Figure) -> tuple[str, str, str] | None:
    """What was recorded and measured, and the band, in words; `None` where they agree."""
    if a.share is None or isinstance(a.value, str | None) or isinstance(b.value, str | None):
        is_step = isinstance(a.value, str) or isinstance(b.value, str)  # beside `all` or `none`
        before, now = (_text_of(value, is_step=is_step) for value in (a.value, b.value))
        return None if a.value == b.value else (before, now, "the same")
    share, least = max(a.share, b.share or 0.0), max(a.least, b.least)
    if abs(b.value - a.value) <= least + share * abs(a.value):
        return None
    band = f"± {100 * share:g} %" if share else f"± {least:g}"
    return f"{a.value:.6g}", f"{b.value:.6g}", band


def _text_of(value: float | str | bool | None, *, is_step: bool) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float | int):
        return seconds_text(value) if is_step else f"{value:.6g}"
    return value or "nothing"


def _error(name: str, error: tuple[float, float] | None, share: float, least: float) -> _Figures:
    """An error, at its largest and at the end; none is known better than to `least`."""
    values = {"": None} if error is None else {"": error[0], " at the end": error[1]}
    return {f"error of {name}{moment}": _Figure(v, share, least) for moment, v in values.items()}


def _run(
    run: scene_report.MeasuredRun, share: float, place: float, speed: float, *, predictable: bool
) -> _Figures:
    """The figures of a run, with the floors of errors of places and velocities.

    `predictable`: whether the reference reaches the end.
    """
    figures = {"status": _Figure(status_text(run.status)), "refsafe": _Figure(run.refsafe)}
    for part, least in zip(_PARTS, (place, place, speed), strict=True):
        figures |= _error(part, getattr(run, part), share, least)
    if run.status == "ok" and predictable:  # how a lost run ended, or a chaotic one, says nothing
        for name in ("energy_drift", "momentum_drift", "penetration"):
            figures[name.replace("_", " ")] = _Figure(getattr(run, name), share, _ROUNDING)
    return figures


def _orders(rows: Sequence[scene_report.OrderRow], band: float) -> _Table:
    table: _Table = {}
    for row in rows:
        fits = {part: getattr(row, part) for part in _PARTS}
        table[row.integrator, "order"] = {
            f"order of {part}": _Figure(None if fit is None else fit.value, 0.0, band)
            for part, fit in fits.items()
        }
    return table


def _largest(row: scene_report.StableRow) -> _Figures:
    low, high = row.bracket or (1.0, 1.0)
    is_sharp = row.monotone and high <= low * (1 + _STABLE)
    return {
        "largest stable timestep": _Figure(row.largest, _STABLE if is_sharp else _FUZZY),
        "monotone": _Figure(row.monotone),
    }


def _scenario(report: scene_report.ScenarioReport, bench: BenchTable) -> _Table:
    share = bench.band
    place, speed = scene_report.FLOORS * report.floor, scene_report.FLOORS * report.velocity_floor
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
        if row.parted is None:  # else the last digit of the start decides how far apart they are
            figures |= _error("figure", row.figure, share, place)
            figures["visible error"] = _Figure(row.seen, share, _INVISIBLE)
        figures["model error"] = _Figure(row.model_error, share, place + _ROUNDING)
        if row.status == "ok" and predictable:
            figures["slip"] = _Figure(row.slip, share, _ROUNDING)
        table[setting_text(row.setting), "setting"] = figures
    table |= _orders(report.orders, bench.order_band)
    return table | {(row.integrator, "stable timestep"): _largest(row) for row in report.stable}


def _case(case: CaseReport) -> _Table:
    reference, share = case.reference, _BENCH.band
    place, speed = (
        scene_report.FLOORS * max(reference.position, reference.attitude),
        scene_report.FLOORS * reference.velocity,
    )
    table: _Table = {("", "case"): {}}
    for line in case.boundaries:
        table[line.integrator, "stable timestep"] = _largest(line)
    for figure in case.figures:
        exact, value = figure.exact, figure.measured
        figures = {f"exact {figure.name}": _Figure(exact, _TIGHT_BAND)}
        if exact is None:
            figures[figure.name] = _Figure(value, share, _ROUNDING)
        else:  # what theory gives is compared by its error
            error = None if value is None else value - exact
            room = _ROUNDING * max(abs(exact), abs(value or 0.0)) + place
            figures[f"{figure.name}, against theory"] = _Figure(error, share, room)
        table[figure.integrator, figure.name] = figures
    table |= _orders(case.orders, _BENCH.order_band)
    for run in case.errors:
        name = f"{run.integrator} at {seconds_text(run.timestep)}"
        table[name, "run"] = _run(run, share, place, speed, predictable=True)
    return table
