"""The report on a model in other engines as pages show it."""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.pages.strings import Strings
from coursebuild.features.bench.grids import Grid, bounded, factor, grid, percent, phrase, power
from coursebuild.numerics.reports.engine_report import (
    BatchCost,
    EngineReport,
    EngineRow,
    EngineScenario,
    row_name,
)
from coursebuild.numerics.reports.scene_report import FLOORS
from coursebuild.numerics.reports.shown_errors import seconds_text, setting_text, status_text


class EngineView(Struct, frozen=True):
    """The view of a scenario in other engines."""

    title: str
    description: tuple[str, ...]
    """Sentences: the setting, the reference, what is compared with what."""
    table: Grid
    notes: tuple[str, ...]
    """What engines refuse, and what was not measured."""
    scenario: EngineScenario
    """For its plot."""


def engine_view(words: Strings, scenario: EngineScenario, report: EngineReport) -> EngineView:
    """Make the view of a scenario."""
    title = scenario.title or scenario.name
    return EngineView(
        title=title,
        description=tuple(_describe(words, scenario, report)),
        table=_table(words, scenario, words("measured.engines_of", title=title)),
        notes=tuple(_notes(words, scenario)),
        scenario=scenario,
    )


def _describe(words: Strings, scenario: EngineScenario, report: EngineReport) -> Iterator[str]:
    yield words("measured.usual", setting=setting_text(scenario.setting))
    yield words("measured.duration", time=seconds_text(scenario.duration))
    if scenario.horizon < scenario.duration:
        yield words("measured.horizon", time=seconds_text(scenario.horizon))
    key, floor = f"measured.reference_{scenario.reference}", power(scenario.floor, 1)
    yield phrase(words, key, source=scenario.source, floor=floor)
    yield words("measured.engines_cost")
    versions = dict(pair for row in scenario.rows for pair in row.versions)
    texts = (f"{name} {version}" for name, version in versions.items())
    yield words("measured.engines_versions", versions=", ".join(texts))
    if report.load >= _BUSY:
        load, count = f"{report.load:.1f}", f"{report.machine.processors}"
        yield words("measured.engines_load", load=load, processors=count)


_BUSY = 0.2
"""Processes of others from which on a machine is said to be busy."""


def _table(words: Strings, scenario: EngineScenario, label: str) -> Grid:
    rows = scenario.rows
    place, speed = FLOORS * scenario.floor, FLOORS * scenario.velocity_floor

    def errors(name: str, least: float) -> list[str]:
        pairs = [getattr(row, name) for row in rows]
        return ["" if pair is None else bounded(pair[0], least) for pair in pairs]

    counts = sorted({cost.worlds for row in rows for cost in row.costs})
    columns: list[tuple[str, list[str]]] = [
        (words("measured.engine"), [row_name(row) for row in rows]),
        (words("measured.position"), errors("position", place)),
        (words("measured.attitude"), errors("attitude", place)),
        (words("measured.velocity"), errors("velocity", speed)),
        (words("measured.apart"), ["" if r.apart is None else power(r.apart, 2) for r in rows]),
        (words("measured.energy"), [percent(row.energy_drift) for row in rows]),
        (words("measured.compile"), [_compile_text(row) for row in rows]),
        *((words("measured.worlds", n=n), [_cost_text(row, n) for row in rows]) for n in counts),
        (words("measured.remark"), [_remark(words, row) for row in rows]),
    ]
    minor = tuple(words(f"measured.{name}") for name in ("velocity", "compile"))
    return grid(label, columns, words=(words("measured.remark"),), minor=minor)


def _compile_text(row: EngineRow) -> str:
    """The longest time to compile, for any number of worlds; nothing where it is not felt."""
    times = [row.compile_seconds, *(cost.compile_seconds for cost in row.costs)]
    longest = max((seconds for seconds in times if seconds is not None), default=0.0)
    return f"{longest:.2g} s" if longest >= _FELT else ""


_FELT = 0.05
"""Seconds."""


def _cost_text(row: EngineRow, worlds: int) -> str:
    """The time of a step, and how many times that of MuJoCo in one world, or between which."""
    cost = next((cost for cost in row.costs if cost.worlds == worlds), BatchCost(worlds))
    if cost.seconds is None or cost.ratio is None:
        return "–" if cost.remark else ""
    ratio = factor(cost.ratio.value, 2)
    if cost.ratio.half_width > _UNCERTAIN:
        ratio = f"{factor(cost.ratio.low, 2)} – {factor(cost.ratio.high, 2)}"
    return Markup("{} <br>×{}").format(seconds_text(cost.seconds.value, 3), ratio)


_UNCERTAIN = 0.1
"""The relative half width of an interval from which on both of its ends are told."""


def _remark(words: Strings, row: EngineRow) -> str:
    if row.status == "ok":
        return ""
    if row.status == "diverged":
        return f"{status_text(row.status)}: {row.message}"
    return words(f"measured.{row.status}", reason=row.message)


def _notes(words: Strings, scenario: EngineScenario) -> Iterator[str]:
    for row in scenario.rows:
        for cost in row.costs:
            if cost.remark:
                yield f"{row_name(row)}, {words('measured.worlds', n=cost.worlds)}: {cost.remark}."


def engine_plots(name: str, scenario: EngineScenario) -> tuple[tuple[Markup, ...], ...]:
    """Draw the plot for wide and for narrow screens; `name` is unique on the page."""
    from coursebuild.numerics.reports.chart import NARROW_SIZE, WIDE_SIZE, chart_svg
    from coursebuild.numerics.reports.engine_report import engine_chart

    chart = engine_chart(scenario)
    if chart is None:
        return ()
    sizes = {"wide": WIDE_SIZE, "narrow": NARROW_SIZE}
    return (
        tuple(Markup(chart_svg(chart, f"{name}-{kind}", size)) for kind, size in sizes.items()),
    )
