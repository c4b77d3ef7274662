"""A scenario that was measured, as pages show it: of a model's page, and of a lesson's `bench`.

Entry points: `scenario_view(words, report, anchor)`, `plots`; `stable_title`, `stable_cells` and
`stable_again`, of largest stable timesteps; `lost_runs`.
"""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.pages.strings import Strings
from coursebuild.features.bench.figures import (
    Grid,
    bounded,
    factor,
    grid,
    percent,
    power,
    said,
    sentence,
)
from coursebuild.numerics.reports.bench import (
    FittedOrder,
    MeasuredRun,
    OrderRow,
    ScenarioReport,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.sweep import FIGURES, SweepReport, SweepRow, cell, shown_figures
from coursebuild.numerics.reports.text import (
    FEWEST_STEPS,
    Quantity,
    interval_text,
    is_cut_short,
    quantities,
    seconds_text,
    setting_text,
    solving_parts,
    status_text,
)

_QUANTITIES = {
    "seen": "measured.seen",
    "position": "measured.position",
    "attitude": "measured.attitude",
    "velocity": "measured.velocity",
}
ORDERS = (
    ("position", "measured.order_position"),
    ("attitude", "measured.order_attitude"),
    ("velocity", "measured.order_velocity"),
)
"""Orders that are fitted, with their titles."""


class ScenarioView(Struct, frozen=True):
    """A scenario, or a sweep."""

    anchor: str
    """Its id."""
    title: str
    settings: Grid
    """Of a sweep the values of its parameters."""
    notes: tuple[str, ...]
    """Of runs that say nothing, or of another model."""
    report: ScenarioReport | SweepReport
    """For its plot."""
    about: tuple[str, ...] = ()
    """How long it takes and what it was held against, a sentence each."""
    verdict: str = ""
    orders: Grid | None = None
    stable: Grid | None = None


def scenario_view(
    words: Strings, report: ScenarioReport | SweepReport, anchor: str = ""
) -> ScenarioView:
    """What a page shows of a scenario, or of a sweep; `anchor` is its id there, if it has one."""
    if isinstance(report, SweepReport):
        return _sweep_view(words, report, anchor)
    return ScenarioView(
        anchor=anchor,
        title=report.title or report.name,
        about=tuple(_about(words, report)),
        verdict=sentence(report.verdict.text),
        settings=_settings(words, report),
        notes=tuple(_notes(words, report)),
        orders=_orders(words, report.orders),
        stable=_stable(words, report),
        report=report,
    )


def _about(words: Strings, report: ScenarioReport) -> list[str]:
    told: list[str] = [words("measured.duration", time=seconds_text(report.duration))]
    if report.horizon < report.duration:
        told.append(words("measured.horizon", time=seconds_text(report.horizon)))
        if report.lyapunov is not None and report.horizons is not None:
            first, last = map(seconds_text, report.horizons)
            rate = power(report.lyapunov)
            told.append(said(words, "measured.chaotic", first=first, last=last, rate=rate))
    if report.hold:
        told.append(words("measured.hold", time=seconds_text(report.hold)))
    parts = [] if report.own_setting is None else solving_parts(report.own_setting)
    if parts:
        told.append(words("measured.usual", setting=", ".join(parts)))
    reference, floor = f"measured.reference_{report.reference}", power(report.floor, 1)
    told.append(said(words, reference, source=report.source, floor=floor))
    if report.second:
        told.append(words("measured.second", source=report.second))
    if report.agreement is not None:
        told.append(said(words, "measured.agreement", difference=power(report.agreement, 2)))
    return told


def _settings(words: Strings, report: ScenarioReport) -> Grid:
    rows = report.rows

    def error(quantity: Quantity) -> tuple[str, list[str]]:
        found: list[str] = [bounded(quantity.value_of(row), quantity.least) for row in rows]
        key = _QUANTITIES.get(quantity.name)
        return quantity.label if key is None else words(key), found

    remarks, speed, time = map(words, ("measured.remark", "measured.realtime", "measured.seconds"))
    columns: list[tuple[str, list[str]]] = [
        (
            words("measured.setting"),
            [setting_text(row.setting, report.own_setting) for row in rows],
        ),
        (words("measured.cost"), ["" if r.cost is None else interval_text(r.cost) for r in rows]),
        (speed, [factor(row.realtime) for row in rows]),
        (time, ["" if r.seconds is None else seconds_text(r.seconds.value, 3) for r in rows]),
        *(error(quantity) for quantity in quantities(report) if quantity.is_resolved(rows)),
        (words("measured.energy"), [percent(row.energy_drift) for row in rows]),
        (words("measured.momentum"), [power(row.momentum_drift, 2) for row in rows]),
        (words("measured.depth"), [power(row.penetration or None, 2) for row in rows]),
        (words("measured.slip"), [power(row.slip, 2) for row in rows]),
        (words("measured.model_error"), [power(row.model_error, 2) for row in rows]),
        (remarks, [_remark(words, report, row) for row in rows]),
    ]
    marked = tuple(n for n, row in enumerate(rows) if row.own)
    label = words("measured.settings", title=report.title or report.name)
    return grid(label, columns, words=(remarks,), minor=(speed, time), marked=marked)


def _remark(words: Strings, report: ScenarioReport, row: WorkPrecisionRow) -> str:
    parts = [words("measured.own")] if row.own else []
    if row.status != "ok":
        parts.append(status_text(row.status))
    if row.refsafe:
        parts.append("refsafe")
    if row.front:
        parts.append(words("measured.front"))
    elif row.dominated_by is not None:
        better = report.rows[row.dominated_by].setting
        parts.append(words("measured.better", setting=setting_text(better, row.setting)))
    return "; ".join(parts)


def _notes(words: Strings, report: ScenarioReport) -> list[str]:
    """Why runs were lost, and which are of another model."""
    notes = lost_runs((setting_text(row.setting, report.own_setting), row) for row in report.rows)
    softened = [setting_text(row.setting, report.own_setting) for row in report.rows if row.refsafe]
    if softened:
        notes.append(words("measured.refsafe", settings="; ".join(softened)))
    return notes


def lost_runs(runs: Iterable[tuple[str, MeasuredRun | SweepRow]]) -> list[str]:
    """Why runs were lost, those with the same reasons together; each with its name."""
    together: dict[tuple[str, ...], list[str]] = {}
    for name, run in runs:
        if run.status != "ok":
            together.setdefault((status_text(run.status), *run.reasons), []).append(name)
    return [f"{'; '.join(names)}: {'; '.join(told)}." for told, names in together.items()]


def _orders(words: Strings, orders: tuple[OrderRow, ...]) -> Grid | None:
    shown = [one for one in orders if one.has_orders]
    if not shown:
        return None
    columns = [(words("measured.integrator"), [one.integrator for one in shown])]
    for name, key in ORDERS:
        found: list[FittedOrder | None] = [getattr(one, name) for one in shown]
        cells = ["" if fit is None else fit.text for fit in found]
        columns.append((words(key), cells))
    return grid(words("measured.orders"), columns)


def _stable(words: Strings, report: ScenarioReport) -> Grid | None:
    rows = report.stable
    if not rows:
        return None
    short = is_cut_short(report)

    def remark(one: StableRow) -> str:
        if one.largest is None and short:
            return words("measured.stable_short", steps=FEWEST_STEPS)
        return stable_again(words, one)

    names = [one.integrator for one in rows]
    cells = [stable_cells(words, one) for one in rows]
    titles = ("measured.integrator", *STABLE, "measured.remark")
    told = (names, *map(list, zip(*cells, strict=True)), [remark(one) for one in rows])
    columns = [(words(key), column) for key, column in zip(titles, told, strict=True)]
    return grid(stable_title(words, rows[0]), columns, words=(words("measured.remark"),))


STABLE = ("measured.largest", "measured.steps", "measured.tried")
"""Titles of `stable_cells`."""


def stable_title(words: Strings, row: StableRow) -> str:
    """What a table of largest stable timesteps shows, and what is called stable."""
    time = seconds_text(row.duration)
    if row.energy is None:
        return words("measured.stable", time=time)
    return words("measured.stable_energy", time=time, energy=f"{row.energy:.3g}")


def stable_cells(words: Strings, row: StableRow) -> tuple[str, str, str]:
    """A largest stable timestep, the steps of a run with it, and what was tried up to it."""
    low, high = (seconds_text(float(f"{step:.3g}")) for step in row.searched)
    largest = words("measured.stable_all", time=high)
    if row.largest == 0:
        largest = words("measured.stable_none", time=low)
    elif row.largest is not None:
        largest = seconds_text(row.largest)
    tried = words("measured.tried_from", count=row.tried, time=low) if row.tried else ""
    return largest, str(row.steps), tried


def stable_again(words: Strings, row: StableRow) -> str:
    """Where timesteps beyond are stable again; empty where none is."""
    if row.islands is None:
        return ""
    first, last = (seconds_text(float(f"{step:.3g}")) for step in row.islands)
    return words("measured.islands", first=first, last=last)


def _sweep_view(words: Strings, sweep: SweepReport, anchor: str) -> ScenarioView:
    columns = [
        (words("measured.parameter"), [row.parameter for row in sweep.rows]),
        (words("measured.value"), [row.value for row in sweep.rows]),
        *((name, [cell(row, key) for row in sweep.rows]) for key, name in FIGURES.items()),
    ]
    minor = tuple(name for key, name in FIGURES.items() if key not in shown_figures(sweep))
    marked = tuple(n for n, row in enumerate(sweep.rows) if row.own)
    notes = lost_runs((f"{row.parameter} {row.value}", row) for row in sweep.rows)
    table = grid(sweep.title, columns, minor=minor, marked=marked)
    return ScenarioView(anchor, sweep.title, table, tuple(notes), sweep)


def plots(name: str, report: ScenarioReport | SweepReport) -> tuple[Markup, ...]:
    """A plot for wide and narrow screens; `name` is that of no other one there."""
    from coursebuild.numerics.reports.plot import plot_svg  # which few pages need
    from coursebuild.numerics.reports.sweep_plot import sweep_svg

    found = (
        sweep_svg(report, name=f"{name}-{kind}", narrow=kind == "narrow")
        if isinstance(report, SweepReport)
        else plot_svg(report, name=f"{name}-{kind}", narrow=kind == "narrow")
        for kind in ("wide", "narrow")
    )
    return tuple(Markup(svg) for svg in found if svg)
