"""The columns of a scenario's table: settings, errors, other figures, cost, and how it went.

Entry point: `columns(report)`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from coursebuild.numerics.reports.bench import (
    FLOORS,
    MeasuredSetting,
    ScenarioReport,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.text import (
    quantities,
    seconds_text,
    solving_parts,
    status_text,
    telling,
    usual_setting,
)
from coursebuild.report.terminal import Column

OWN, FRONT, BETTER = ">", "*", "→"
"""The scene's own setting, on the Pareto front, and before the number of a better row."""
VISIBLE = "visible"
_ERRORS = ("figure", "position", "attitude", "velocity")
_Show = Callable[[WorkPrecisionRow], str]


def columns(report: ScenarioReport) -> list[Column]:
    """Every column, from left to right; those of low rank are the more important ones."""
    return [*_settings(report), *_errors(report), *_figures(report), *_judged(report)]


def _settings(report: ScenarioReport) -> Iterator[Column]:
    usual = usual_setting(report.rows)
    numbers = tuple(f"{n + 1}" for n in range(len(report.rows)))
    yield _column(report, "", 0, _marks, left=True)
    yield Column("#", numbers, 0)
    yield _column(report, "integrator", 0, lambda row: row.setting.integrator, left=True)
    yield _column(report, "timestep", 0, lambda row: seconds_text(row.setting.timestep, 4))
    yield _column(report, "with", 0, lambda row: _with(row, usual), left=True)


def _errors(report: ScenarioReport) -> Iterator[Column]:
    told = telling(report)
    first = "" if told is None else told.name
    least = {one.name: one.least for one in quantities(report)}

    def show(name: str, which: int) -> _Show:
        def cell(row: WorkPrecisionRow) -> str:
            pair: tuple[float, float] | None = getattr(row, name)
            return "" if pair is None else _error(pair[which], least.get(name, 0.0))

        return cell

    def rank(name: str) -> int:
        """Errors that are nowhere above the floor say little."""
        pairs = [pair for row in report.rows if (pair := getattr(row, name)) is not None]
        above = any(pair[0] > least.get(name, 0.0) * (1 + 1e-9) for pair in pairs)
        return 0 if name == first else 2 if above else 7

    yield _column(report, VISIBLE, 0 if first == "seen" else 2, lambda row: _number(row.seen))
    for name in _ERRORS:
        yield _column(report, name, rank(name), show(name, 0))
    for name in _ERRORS:
        yield _column(report, f"{name} at end", 9, show(name, 1))


def _figures(report: ScenarioReport) -> Iterator[Column]:
    yield _column(report, "energy", 3, lambda row: _drift(row.energy_drift))
    yield _column(report, "momentum", 5, lambda row: _number(row.momentum_drift))
    yield _column(report, "mean energy", 5, lambda row: _drift(row.mean_energy))
    yield _column(report, "depth", 5, lambda row: _number(row.penetration or None))
    yield _column(report, "slip", 5, lambda row: _number(row.slip))
    large = any(_large_model_error(row, report.floor) for row in report.rows)
    yield _column(report, "model error", 1 if large else 5, lambda row: _number(row.model_error))
    yield _column(report, "cost", 0, lambda row: _number(row.cost.value if row.cost else None, 3))
    yield _column(report, "±", 4, _width)
    costs = any(row.cost is not None for row in report.rows)
    yield _column(report, "× real time", 4 if costs else 0, lambda row: _speed(row.realtime))
    yield _column(report, "time per s", 6, _time)


def _large_model_error(row: WorkPrecisionRow, floor: float) -> bool:
    """Whether it is beyond what can be told, and no less than what the timestep adds."""
    if row.model_error is None or row.model_error <= FLOORS * floor * (1 + 1e-9):
        return False
    pairs = (row.position, row.attitude)
    return all(pair is None or row.model_error >= pair[0] for pair in pairs)


def _judged(report: ScenarioReport) -> Iterator[Column]:
    yield _column(report, "growth", 7, lambda row: _number(row.growth, 7))
    yield _column(report, "status", 0, lambda row: status_text(row.status), left=True)
    yield _column(report, "refsafe", 5, lambda row: "yes" if row.refsafe else "")
    yield _column(report, "", 1, _better)


def _column(
    report: ScenarioReport, title: str, rank: int, show: _Show, *, left: bool = False
) -> Column:
    return Column(title, tuple(show(row) for row in report.rows), rank, left)


def _marks(row: WorkPrecisionRow) -> str:
    return (OWN if row.own else " ") + (FRONT if row.front else " ")


def _with(row: WorkPrecisionRow, usual: MeasuredSetting | None) -> str:
    """Solver, iterations and cone where they are not those of the scene, in few words."""
    parts = solving_parts(row.setting, usual)
    return ", ".join(
        part.removesuffix("ations").removesuffix("ation").removesuffix(" cone") for part in parts
    )


def _better(row: WorkPrecisionRow) -> str:
    return "" if row.dominated_by is None else f"{BETTER}{row.dominated_by + 1}"


def _error(value: float, least: float) -> str:
    """An error in three digits; those at the floor are only known to be under it."""
    under = least > 0 and value <= least * (1 + 1e-9)
    return f"<{least:.1e}" if under else f"{value:.2e}"


def _number(value: float | None, digits: int = 2) -> str:
    if value is None:
        return ""
    plain = 10**digits <= abs(value) < 1e5
    return f"{value:.0f}" if plain else f"{value:.{digits}g}"


def _width(row: WorkPrecisionRow) -> str:
    """Half the interval of the cost."""
    return "" if row.cost is None or row.own else f"{100 * row.cost.half_width:.2g} %"


def _time(row: WorkPrecisionRow) -> str:
    return "" if row.seconds is None else seconds_text(row.seconds.value, 3)


def _drift(value: float | None) -> str:
    """A relative change in per cent, with its sign."""
    if value is None:
        return ""
    percent = 100 * value
    return f"{percent:+.3f} %" if 1e-3 <= abs(percent) < 1e4 else f"{percent:+.1e} %"


def _speed(value: float | None) -> str:
    return "" if value is None else f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
