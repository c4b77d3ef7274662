"""Speed against error of models, as tables for people.

Entry point: `bench_text(scenes, style)`.

1. For each scenario its reference, a table of the settings, the verdict, the fitted orders and the
   largest stable timesteps, in the words of the model's page; for each model the machine.
2. The table of settings has the columns that say something in this scenario, as many as there is
   room for; the others are in the JSON.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from coursebuild.features.bench.commands.bench.columns import BETTER, FRONT, OWN, VISIBLE, columns
from coursebuild.features.bench.commands.grids import english, grid_lines, plain_text
from coursebuild.features.bench.figures import power, where
from coursebuild.features.bench.scenarios import scenario_view
from coursebuild.numerics.reports.bench import ScenarioReport, SceneReport
from coursebuild.numerics.reports.sweep import FIGURES, SweepReport, cell, shown_figures
from coursebuild.numerics.reports.text import status_text
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
    lines = [head, *style.wrap(where(english(), scene.machine), _INDENT)]
    if not scene.scenarios:
        lines.append(f"{_INDENT}nothing can move in it, so that nothing was measured")
    for scenario in scene.scenarios:
        lines += ["", *_scenario(scenario, style)]
    for sweep in scene.sweeps:
        lines += ["", *_sweep(sweep, style)]
    return "\n".join(lines) + "\n"


def _scenario(report: ScenarioReport, style: Style) -> list[str]:
    view = scenario_view(english(), report, "")
    title = f"  {visible(report.title)}" if report.title else ""
    lines = [_INDENT + style.paint(visible(report.name), BOLD) + title]
    for text in (*map(plain_text, view.about), *_also(report), *report.notes):
        lines += style.wrap(text, 2 * _INDENT)
    lines += ["", *_rows(report, style)]
    colour = GREEN if report.verdict.on_front and not report.verdict.noticeable else YELLOW
    if report.verdict.text:
        lines += ["", *style.wrap(report.verdict.text, 2 * _INDENT, colour)]
    for grid in (view.orders, view.stable):
        if grid is not None:
            lines += ["", *(f"{2 * _INDENT}{line}".rstrip() for line in grid_lines(grid, style))]
    if view.notes:
        lines.append("")
    for note in view.notes:
        lines += style.wrap(note, 2 * _INDENT, YELLOW)
    return lines


def _also(report: ScenarioReport) -> Iterator[str]:
    """What a page says with its plot."""
    if report.figure:
        yield f"It measures {report.figure}."
    if report.velocity_floor > report.floor:
        yield f"Velocities are known to {plain_text(power(report.velocity_floor, 1))}."


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
