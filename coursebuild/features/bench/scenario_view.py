"""Reports as pages show them: of a scenario, of a sweep, and of a scenario in other engines."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model.measurements import (
    FLOORS,
    BatchCost,
    EngineReport,
    EngineRow,
    EngineScenario,
    ErrorQuantity,
    FittedOrder,
    MeasuredRun,
    OrderRow,
    Reach,
    ScenarioReport,
    StableRow,
    SweepReport,
    SweepRow,
    WorkPrecisionRow,
)
from coursebuild.core.pages.renderer import Strings
from coursebuild.features.bench import grids
from coursebuild.features.bench.shown_errors import (
    FIGURES,
    cell,
    horizon_error_text,
    interval_text,
    row_name,
    seconds_text,
    setting_text,
    solving_parts,
)

_FEWEST_STEPS = 20
"""Steps of a scenario at the longest timestep that is tried for stability."""
_QUANTITIES = {
    "step_error": "measured.step_error",
    "seen": "measured.seen",
    "position": "measured.position",
    "attitude": "measured.attitude",
    "velocity": "measured.velocity",
}
_ORDERS = {
    "position": "measured.order_position",
    "attitude": "measured.order_attitude",
    "velocity": "measured.order_velocity",
}
"""Fitted orders, with the keys of their titles."""


class ScenarioView(Struct, frozen=True):
    """The view of a scenario, or of a sweep."""

    anchor: str
    """Its id on the page."""
    title: str
    settings: grids.Grid
    """The table of settings; of a sweep, of its parameters."""
    notes: tuple[str, ...]
    """Remarks on runs that failed, or whose model was changed."""
    report: ScenarioReport | SweepReport
    """The report, for its plot."""
    description: tuple[str, ...] = ()
    """Sentences: how long it lasts, and with what it was compared."""
    verdict: str = ""
    orders: grids.Grid | None = None
    stable: grids.Grid | None = None


def scenario_view(
    words: Strings, report: ScenarioReport | SweepReport, anchor: str = ""
) -> ScenarioView:
    """Make the view of a scenario or a sweep; `anchor` is its id on the page, if it has one."""
    if isinstance(report, SweepReport):
        names = {key: words.translate(name) for key, name in FIGURES.items()}
        columns = [
            (words("measured.parameter"), [row.parameter for row in report.rows]),
            (words("measured.value"), [row.value for row in report.rows]),
            *((name, [cell(row, key) for row in report.rows]) for key, name in names.items()),
        ]
        minor = tuple(name for key, name in names.items() if key not in report.show)
        own_rows = tuple(n for n, row in enumerate(report.rows) if row.own)
        notes = lost_runs(words, ((f"{row.parameter} {row.value}", row) for row in report.rows))
        table = grids.grid(report.title, columns, minor=minor, highlights=own_rows)
        return ScenarioView(anchor, report.title, table, tuple(notes), report)
    notes = lost_runs(words, ((row.name, row) for row in report.rows))
    softened = [words.translate(row.name) for row in report.rows if row.refsafe]
    if softened:
        notes.append(words("measured.refsafe", settings="; ".join(softened)))
    rows = []
    for row in report.stable:
        remark = stable_again(words, row)
        if row.largest == "all" and report.cut_short:
            remark = words("measured.stable_short", steps=_FEWEST_STEPS)
        rows.append((row.integrator, (*stable_cells(words, row), remark)))
    label = stable_title(words, report.stable) if rows else ""
    return ScenarioView(
        anchor=anchor,
        title=report.title or report.name,
        description=tuple(_describe(words, report)),
        verdict=grids.sentence(words.translate(report.verdict.text)),
        settings=_settings_table(words, report),
        notes=tuple(notes),
        orders=orders_table(words, words("measured.orders"), report.orders),
        stable=integrator_table(words, label, (*STABLE, "measured.remark"), rows),
        report=report,
    )


def _describe(words: Strings, report: ScenarioReport) -> list[str]:
    sentences: list[str] = [
        words("measured.duration", time=words.decimals(seconds_text(report.duration)))
    ]
    if report.horizon < report.duration:
        sentences.append(
            words("measured.horizon", time=words.decimals(seconds_text(report.horizon)))
        )
        if report.lyapunov is not None and report.horizons is not None:
            texts = (*map(seconds_text, report.horizons), horizon_error_text(report.horizon_error))
            first, last, error = map(words.decimals, texts)
            rate = grids.power(report.lyapunov)
            values = {"first": first, "last": last, "rate": rate, "error": error}
            sentences.append(grids.phrase(words, "measured.chaotic", **values))
    if report.hold:
        sentences.append(words("measured.hold", time=words.decimals(seconds_text(report.hold))))
    parts = [] if report.own_setting is None else solving_parts(report.own_setting)
    if parts:
        sentences.append(words("measured.usual", setting=words.translate(", ".join(parts))))
    reference, floor = f"measured.reference_{report.reference}", grids.power(report.floor, 1)
    sentences.append(grids.phrase(words, reference, source=report.source, floor=floor))
    if report.second:
        sentences.append(words("measured.second", source=report.second))
    if report.agreement is not None:
        sentences.append(
            grids.phrase(words, "measured.agreement", difference=grids.power(report.agreement, 2))
        )
    return sentences


def _settings_table(words: Strings, report: ScenarioReport) -> grids.Grid:
    rows = [row for row in report.rows if not row.idle]

    def error_column(quantity: ErrorQuantity) -> tuple[str, list[str]]:
        values = (getattr(row, quantity.name) for row in rows)
        sizes = (value[0] if isinstance(value, tuple) else value for value in values)
        errors: list[str] = [grids.bounded(size, quantity.least) for size in sizes]
        key = _QUANTITIES.get(quantity.name)
        return words.translate(quantity.label) if key is None else words(key), errors

    names = ("remark", "realtime", "seconds", "evaluations", "iterations")
    remarks, speed, time, evaluations, iterations = (words(f"measured.{name}") for name in names)
    columns: list[tuple[str, list[str]]] = [
        (
            words("measured.setting"),
            [words.translate(row.name) for row in rows],
        ),
        (words("measured.cost"), ["" if r.cost is None else interval_text(r.cost) for r in rows]),
        (speed, [grids.factor(row.realtime) for row in rows]),
        (time, ["" if r.seconds is None else seconds_text(r.seconds.value, 3) for r in rows]),
        (evaluations, [grids.whole_number(row.evaluations or None) for row in rows]),
        (iterations, [grids.whole_number(row.iterations) for row in rows]),
        (
            words(
                "measured.parted", error=words.decimals(horizon_error_text(report.horizon_error))
            ),
            ["" if r.parted is None else seconds_text(r.parted, 3) for r in rows],
        ),
        *(error_column(quantity) for quantity in report.quantities if quantity.resolved),
        (words("measured.energy"), [grids.percent(row.energy_drift) for row in rows]),
        (words("measured.momentum"), [grids.power(row.momentum_drift, 2) for row in rows]),
        (words("measured.depth"), [grids.power(row.penetration or None, 2) for row in rows]),
        (words("measured.slip"), [grids.power(row.slip, 2) for row in rows]),
        (words("measured.model_error"), [grids.power(row.model_error, 2) for row in rows]),
        (remarks, [_remark(words, report, row) for row in rows]),
    ]
    own_rows = tuple(n for n, row in enumerate(rows) if row.own)
    label = words("measured.settings", title=report.title or report.name)
    minor = (speed, time, evaluations, iterations)
    return grids.grid(label, columns, words=(remarks,), minor=minor, highlights=own_rows)


def _remark(words: Strings, report: ScenarioReport, row: WorkPrecisionRow) -> str:
    parts = [words("measured.own")] if row.own else []
    if row.status != "ok":
        parts.append(words.translate(row.status))
    if row.refsafe:
        parts.append("refsafe")
    if row.lucky:
        parts.append(words("measured.lucky"))
    elif row.front:
        parts.append(words("measured.front"))
    elif row.dominated_by is not None:
        name = report.rows[row.dominated_by].name
        parts.append(words("measured.better", setting=words.translate(name)))
    return "; ".join(parts)


def lost_runs(words: Strings, runs: Iterable[tuple[str, MeasuredRun | SweepRow]]) -> list[str]:
    """Say why runs were lost; runs with the same reasons stand together."""
    names_by_reasons: dict[tuple[str, ...], list[str]] = {}
    for name, run in runs:
        if run.status != "ok":
            reasons = tuple(map(words.translate, (run.status, *run.reasons)))
            names_by_reasons.setdefault(reasons, []).append(words.translate(name))
    groups = names_by_reasons.items()
    return [f"{'; '.join(names)}: {'; '.join(reasons)}." for reasons, names in groups]


def orders_table(
    words: Strings, label: str, orders: Iterable[OrderRow], *, merge: bool = False
) -> grids.Grid | None:
    """Make a table of fitted orders; `None` if there are none."""
    rows = []
    for row in orders:
        fits: list[FittedOrder | None] = [getattr(row, name) for name in _ORDERS]
        if row.has_orders:
            rows.append((row.integrator, tuple("" if fit is None else fit.text for fit in fits)))
    return integrator_table(words, label, tuple(_ORDERS.values()), rows, merge=merge)


def integrator_table(
    words: Strings,
    label: str,
    titles: Sequence[str],
    rows: Sequence[grids.NamedRow],
    *,
    merge: bool = False,
    parts: tuple[grids.FigurePart, ...] = (),
) -> grids.Grid | None:
    """Make a table of integrators; `None` without rows.

    `titles`: keys of the columns' titles; `merge`: integrators with the same cells share a row.
    """
    if not rows:
        return None
    rows = grids.merge_rows(rows) if merge else rows
    columns = [(words("measured.integrator"), [name for name, _ in rows])]
    columns += [(words(key), [cells[n] for _, cells in rows]) for n, key in enumerate(titles)]
    return grids.grid(label, columns, words=(words("measured.remark"),), parts=parts)


STABLE = (
    "measured.largest",
    "measured.near",
    "measured.through",
    "measured.theory",
)
"""Keys of the titles of `stable_cells`."""


def stable_title(words: Strings, rows: Sequence[StableRow]) -> str:
    """Title a table of largest stable timesteps: it says which runs count as stable."""
    durations = sorted(row.duration for row in rows)
    times = (seconds_text(float(f"{time:.3g}")) for time in (durations[0], durations[-1]))
    time, energy = words.decimals(" – ".join(dict.fromkeys(times))), rows[0].energy
    if energy is None:
        return words("measured.stable", time=time)
    return words("measured.stable_energy", time=time, energy=words.decimals(grids.factor(energy)))


def stable_cells(words: Strings, row: StableRow) -> tuple[str, ...]:
    """Write a largest stable timestep, and what else is known of it."""
    return (
        _reach(words, row.largest, row) if isinstance(row.largest, str) else row.shown,
        _reach(words, row.near, row),
        _reach(words, row.through, row),
        _theory(words, row.theory),
    )


def _reach(words: Strings, limit: Reach | None, row: StableRow) -> str:
    """A largest timestep, and where it is none, what was tried."""
    low, high = (seconds_text(float(f"{step:.3g}")) for step in row.searched)
    match limit:
        case None:
            return ""
        case "all":
            return words("measured.stable_all", time=high)
        case "none":
            return words("measured.stable_none", time=low)
        case _:  # rounded down: beyond it runs are lost
            unit = 10.0 ** (math.floor(math.log10(limit)) - 1)
            return seconds_text(math.floor(limit / unit * (1 + 1e-9)) * unit, 2)


def _theory(words: Strings, limit: Reach | None) -> str:
    if isinstance(limit, str):
        return words(f"numerics.{limit}")
    return "" if limit is None else seconds_text(limit, 5)


def stable_again(words: Strings, row: StableRow) -> str:
    """Say where larger timesteps are stable again; empty if none is."""
    if row.islands is None:
        return ""
    texts = (seconds_text(float(f"{step:.3g}")) for step in row.islands)
    first, last = map(words.decimals, texts)
    if first == last:
        return words("measured.island", time=first)
    return words("measured.islands", first=first, last=last)


class EngineView(Struct, frozen=True):
    """The view of a scenario in other engines."""

    title: str
    description: tuple[str, ...]
    """Sentences: the setting, the reference, what is compared with what."""
    table: grids.Grid
    notes: tuple[str, ...]
    """What was not measured."""
    scenario: EngineScenario
    """For its plot."""


_BUSY = 0.2
"""Processes of others from which on a machine is said to be busy."""
_FELT = 0.05
"""Seconds from which on it is said how long an engine compiles."""
_UNCERTAIN = 0.1
"""The relative half width of an interval from which on both of its ends are told."""


def engine_view(words: Strings, scenario: EngineScenario, report: EngineReport) -> EngineView:
    """Make the view of a scenario in other engines."""
    title = scenario.title or scenario.name
    description = [
        words("measured.usual", setting=words.translate(setting_text(scenario.setting))),
        words("measured.duration", time=words.decimals(seconds_text(scenario.duration))),
    ]
    if scenario.horizon < scenario.duration:
        description.append(
            words("measured.horizon", time=words.decimals(seconds_text(scenario.horizon)))
        )
    key, floor = f"measured.reference_{scenario.reference}", grids.power(scenario.floor, 1)
    description.append(grids.phrase(words, key, source=scenario.source, floor=floor))
    description.append(words("measured.engines_cost"))
    versions = dict(pair for row in scenario.rows for pair in row.versions)
    texts = (f"{name} {version}" for name, version in versions.items())
    description.append(words("measured.engines_versions", versions=", ".join(texts)))
    if report.load >= _BUSY:
        load, count = f"{report.load:.1f}", f"{report.machine.processors}"
        description.append(words("measured.engines_load", load=load, processors=count))
    return EngineView(
        title=title,
        description=tuple(description),
        table=_engine_table(words, scenario, words("measured.engines_of", title=title)),
        notes=tuple(
            f"{words.translate(row_name(row))}, "
            f"{words('measured.worlds', n=cost.worlds)}: {cost.remark}."
            for row in scenario.rows
            for cost in row.costs
            if cost.remark
        ),
        scenario=scenario,
    )


def _engine_table(words: Strings, scenario: EngineScenario, label: str) -> grids.Grid:
    rows = scenario.rows
    place, speed = FLOORS * scenario.floor, FLOORS * scenario.velocity_floor

    def errors(name: str, least: float) -> list[str]:
        pairs = [getattr(row, name) for row in rows]
        return ["" if pair is None else grids.bounded(pair[0], least) for pair in pairs]

    def compile_text(row: EngineRow) -> str:
        times = [row.compile_seconds, *(cost.compile_seconds for cost in row.costs)]
        longest = max((seconds for seconds in times if seconds is not None), default=0.0)
        return f"{longest:.2g} s" if longest >= _FELT else ""

    def remark(row: EngineRow) -> str:
        if row.status == "ok":
            return ""
        if row.status == "diverged":
            return f"{words.translate(row.status)}: {row.message}"
        key = "unsupported" if row.status == "unsupported" else "failed"
        return words(f"measured.{key}", reason=row.message)

    counts = sorted({cost.worlds for row in rows for cost in row.costs})
    columns: list[tuple[str, list[str]]] = [
        (words("measured.engine"), [words.translate(row_name(row)) for row in rows]),
        (words("measured.position"), errors("position", place)),
        (words("measured.attitude"), errors("attitude", place)),
        (words("measured.velocity"), errors("velocity", speed)),
        (words("measured.apart"), [grids.power(row.apart, 2) for row in rows]),
        (words("measured.energy"), [grids.percent(row.energy_drift) for row in rows]),
        (words("measured.compile"), [compile_text(row) for row in rows]),
        *((words("measured.worlds", n=n), [_cost_text(row, n) for row in rows]) for n in counts),
        (words("measured.remark"), [remark(row) for row in rows]),
    ]
    minor = tuple(words(f"measured.{name}") for name in ("velocity", "energy", "compile"))
    return grids.grid(label, columns, words=(words("measured.remark"),), minor=minor)


def _cost_text(row: EngineRow, worlds: int) -> str:
    """The time of a step, and how many times that of MuJoCo in one world, or between which."""
    cost = next((cost for cost in row.costs if cost.worlds == worlds), BatchCost(worlds))
    if cost.seconds is None or cost.ratio is None:
        return "–" if cost.remark else ""
    ratio = grids.factor(cost.ratio.value, 2)
    if cost.ratio.half_width > _UNCERTAIN:
        ratio = f"{grids.factor(cost.ratio.low, 2)} – {grids.factor(cost.ratio.high, 2)}"
    return Markup("{} <br>×{}").format(seconds_text(cost.seconds.value, 3), ratio)


def plots(
    words: Strings, name: str, report: ScenarioReport | SweepReport | EngineScenario
) -> tuple[tuple[Markup, ...], ...]:
    """Draw the plots, each for wide and for narrow screens; `name` is unique on the page."""
    from coursebuild.features.bench import report_plots  # late: few pages need it

    def draw(kind: str) -> tuple[str, ...]:
        key, narrow = f"{name}-{kind}", kind == "narrow"
        if isinstance(report, ScenarioReport):
            return report_plots.plot_svgs(report, words, name=key, narrow=narrow)
        if isinstance(report, SweepReport):
            svg = report_plots.sweep_svg(report, words, name=key, narrow=narrow)
        else:
            svg = report_plots.engine_svg(report, words, name=key, narrow=narrow)
        return (svg,) if svg else ()

    pairs = zip(draw("wide"), draw("narrow"), strict=True)
    return tuple(tuple(map(Markup, pair)) for pair in pairs)
