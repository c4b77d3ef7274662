"""Speed against error of models, as tables for people.

Entry point: `bench_text(scenes, style)`.

1. For each scenario its reference, a table of the settings, the verdict, the fitted orders and the
   largest stable timesteps; for each model the machine.
2. A table has the columns that say something in this scenario, as many as there is room for; the
   others are in the JSON.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.core.model.results import Machine
from coursebuild.features.bench.commands.bench.columns import BETTER, FRONT, OWN, VISIBLE, columns
from coursebuild.features.bench.commands.stable import (
    STABLE,
    stable_again,
    stable_cells,
    stable_meaning,
)
from coursebuild.numerics.reports.bench import (
    FittedOrder,
    MeasuredSetting,
    OrderRow,
    ScenarioReport,
    SceneReport,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.sweep import FIGURES, SweepReport, cell, shown_figures
from coursebuild.numerics.reports.text import (
    FEWEST_STEPS,
    is_cut_short,
    seconds_text,
    solving_parts,
    status_text,
    usual_setting,
)
from coursebuild.report.terminal import (
    BOLD,
    FAINT,
    GREEN,
    RED,
    YELLOW,
    Column,
    Style,
    table,
    visible,
)

_INDENT = "  "
_LEGEND = f"{OWN} the scene's own   {FRONT} on the Pareto front"
_BETTER = f"   {BETTER} a better one"
_SEEN = "visible: an error of 1 is just seen in a picture"


def bench_text(scenes: Sequence[SceneReport], style: Style) -> str:
    """Every model with its scenarios, a blank line between."""
    return "\n".join(_scene(scene, style) for scene in scenes)


def _scene(scene: SceneReport, style: Style) -> str:
    head = style.paint(visible(scene.model), BOLD)
    if scene.quick:
        head += "  " + style.paint("quick: fewer settings, rough times", YELLOW)
    lines = [head, *style.wrap(_machine(scene.machine), _INDENT)]
    if not scene.scenarios:
        lines.append(f"{_INDENT}nothing can move in it, so that nothing was measured")
    for scenario in scene.scenarios:
        lines += ["", *_scenario(scenario, style)]
    for sweep in scene.sweeps:
        lines += ["", *_sweep(sweep, style)]
    return "\n".join(lines) + "\n"


def _machine(machine: Machine) -> str:
    versions = f"MuJoCo {machine.engine}, Python {machine.python}, NumPy {machine.numpy}"
    return f"{versions}, {machine.hardware}"


def _scenario(report: ScenarioReport, style: Style) -> list[str]:
    title = f"  {visible(report.title)}" if report.title else ""
    lines = [_INDENT + style.paint(visible(report.name), BOLD) + title]
    for text in (_times(report), *_usual(report), *_reference(report), *report.notes):
        lines += style.wrap(text, 2 * _INDENT)
    lines.append("")
    lines += _rows(report, style)
    colour = GREEN if report.verdict.on_front and not report.verdict.noticeable else YELLOW
    if report.verdict.text:
        lines += ["", *style.wrap(report.verdict.text, 2 * _INDENT, colour)]
    for part in (_orders(report.orders), _stable(report, style)):
        if part:
            lines += ["", *part]
    lines += _lost(report, style)
    return lines


def _sweep(sweep: SweepReport, style: Style) -> list[str]:
    columns = [
        Column("", tuple(OWN if row.own else "" for row in sweep.rows), left=True),
        Column("parameter", tuple(row.parameter for row in sweep.rows), left=True),
        Column("value", tuple(row.value for row in sweep.rows)),
    ]
    shown = shown_figures(sweep)
    columns += [
        Column(text, tuple(cell(row, name) for row in sweep.rows), 0 if name in shown else 2)
        for name, text in FIGURES.items()
    ]
    columns.append(
        Column("status", tuple(status_text(row.status) for row in sweep.rows), left=True)
    )
    head, *lines = table(columns, max(style.width, 60) - 4)
    title = _INDENT + style.paint(visible(sweep.name), BOLD) + f"  {visible(sweep.title)}"
    lines = [style.paint(head, FAINT), *lines, style.paint(f"{OWN} as the model is", FAINT)]
    return [title, "", *(f"{2 * _INDENT}{line}".rstrip() for line in lines)]


def _times(report: ScenarioReport) -> str:
    text = seconds_text(report.duration)
    if report.horizon < report.duration:
        text += f", errors to {seconds_text(report.horizon)}"
        if report.lyapunov is not None and report.horizons is not None:
            first, last = map(seconds_text, report.horizons)
            text += f" (chaotic: nudged runs part after {first} to {last}, "
            text += f"Lyapunov exponent {report.lyapunov:.3g}/s)"
    text += f", commands held for {seconds_text(report.hold)}" if report.hold else ""
    return text + (f", measures {report.figure}" if report.figure else "")


def _usual(report: ScenarioReport) -> list[str]:
    """What every row has where it says nothing else."""
    usual = usual_setting(report.rows)
    parts = [] if usual is None else solving_parts(usual)
    return [", ".join(parts)] if parts else []


def _reference(report: ScenarioReport) -> list[str]:
    known = f"known to {report.floor:.0e}"
    if report.velocity_floor > report.floor:
        known += f", velocities to {report.velocity_floor:.0e}"
    said = [f"reference ({report.reference}, {known}): {report.source}"]
    if report.second:
        off = "" if report.agreement is None else f", which differs by {report.agreement:.1e}"
        said.append(f"second: {report.second}{off}")
    return said


# --- the table


def _rows(report: ScenarioReport, style: Style) -> list[str]:
    rows = report.rows
    if not rows:
        return [f"{2 * _INDENT}no setting was measured"]
    lines = table(columns(report), max(style.width, 60) - 4)
    painted = [style.paint(lines[0], FAINT)]
    for row, line in zip(rows, lines[1:], strict=True):
        code = BOLD if row.own else RED if row.status in ("diverged", "reset") else ""
        code = code or (YELLOW if row.status != "ok" else GREEN if row.front else "")
        painted.append(style.paint(line, code))
    legend = _LEGEND + (_BETTER if any(BETTER in line for line in lines) else "")
    below = [legend, _SEEN] if VISIBLE in lines[0] else [legend]
    return [
        f"{2 * _INDENT}{line}".rstrip()
        for line in (*painted, *(style.paint(text, FAINT) for text in below))
    ]


# --- what stands below


def _orders(orders: Sequence[OrderRow]) -> list[str]:
    shown = [one for one in orders if one.there]
    if not shown:
        return []

    def cells(name: str) -> tuple[str, ...]:
        found: list[FittedOrder | None] = [getattr(one, name) for one in shown]
        return tuple("" if fit is None else fit.text for fit in found)

    parts = ("position", "attitude", "velocity")
    columns = [Column("order of", tuple(one.integrator for one in shown), left=True)]
    columns += [Column(part, cells(part)) for part in parts]
    return [f"{2 * _INDENT}{line}".rstrip() for line in table(columns)]


def _stable(report: ScenarioReport, style: Style) -> list[str]:
    rows = report.stable
    if not rows:
        return []
    columns = [Column("integrator", tuple(one.integrator for one in rows), left=True)]
    cells = zip(*map(stable_cells, rows), strict=True)
    columns += [Column(t, told, left=True) for t, told in zip(STABLE, cells, strict=True)]
    lines = [f"{2 * _INDENT}{line}".rstrip() for line in table(columns)]
    lines.append(2 * _INDENT + style.paint(stable_meaning(rows[0]), FAINT))
    lines += [2 * _INDENT + style.paint(text, RED) for text in stable_again(rows)]
    if is_cut_short(report) and any(one.largest is None for one in rows):
        longest = seconds_text(report.duration / FEWEST_STEPS)
        text = f"longer ones than {longest} were not tried: {FEWEST_STEPS} are the whole scenario"
        lines.append(2 * _INDENT + style.paint(text, FAINT))
    return lines


def _lost(report: ScenarioReport, style: Style) -> list[str]:
    """Why runs were lost, those with the same reasons together."""
    usual = usual_setting(report.rows)
    together: dict[tuple[str, tuple[str, ...]], list[WorkPrecisionRow]] = {}
    for row in report.rows:
        if row.status != "ok":
            together.setdefault((status_text(row.status), row.reasons), []).append(row)
    told = [
        f"{_named(rows, usual)}: {'; '.join((status, *reasons))}"
        for (status, reasons), rows in together.items()
    ]
    softened = [row for row in report.rows if row.refsafe]
    if softened:
        what = "refsafe softens constraints, which makes another model"
        told.append(f"{what}: {_named(softened, usual)}")
    lines = [line for text in told for line in style.wrap(text, 2 * _INDENT, YELLOW)]
    return ["", *lines] if lines else []


def _named(rows: Sequence[WorkPrecisionRow], usual: MeasuredSetting | None) -> str:
    """Settings in words, those of an integrator together."""
    together: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        parts = ", ".join(solving_parts(row.setting, usual))
        steps = together.setdefault((row.setting.integrator, parts), [])
        steps.append(seconds_text(row.setting.timestep, 4))
    return "; ".join(
        f"{name} at {', '.join(steps)}{parts and f' with {parts}'}"
        for (name, parts), steps in together.items()
    )
