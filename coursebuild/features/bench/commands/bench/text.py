"""Speed against error of models as text: the tables of the models' pages, on a terminal.

Entry point: `bench_text(scenes, style)`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from coursebuild.features.bench.commands.grids import english, grid_lines, plain_text
from coursebuild.features.bench.figures import Grid, machine_text, power
from coursebuild.features.bench.scenarios import scenario_view
from coursebuild.numerics.reports.scene_report import (
    ScenarioReport,
    SceneReport,
    SweepReport,
    WorkPrecisionRow,
)
from coursebuild.report.terminal import BOLD, FAINT, GREEN, RED, YELLOW, Style, visible

_OWN_MARK, _FRONT_MARK = ">", "*"
_INDENT = "  "


def bench_text(scenes: Sequence[SceneReport], style: Style) -> str:
    """Write every model with its scenarios, and a blank line between models."""
    return "\n".join(_scene(scene, style) for scene in scenes)


def _scene(scene: SceneReport, style: Style) -> str:
    head = style.paint(visible(scene.model), BOLD)
    if scene.quick:
        head += "  " + style.paint("quick: fewer settings, rough times", YELLOW)
    lines = [head, *style.wrap(machine_text(english(), scene.machine), _INDENT)]
    if not scene.scenarios:
        lines.append(f"{_INDENT}nothing can move in it, so that nothing was measured")
    for scenario in scene.scenarios:
        lines += ["", *_scenario(scenario, style)]
    for sweep in scene.sweeps:
        lines += ["", *_sweep(sweep, style)]
    return "\n".join(lines) + "\n"


def _scenario(report: ScenarioReport, style: Style) -> list[str]:
    view = scenario_view(english(), report)
    lines = [_title(report.name, report.title, style)]
    for text in (*map(plain_text, view.description), *_plot_remarks(report), *report.notes):
        lines += style.wrap(text, 2 * _INDENT)
    legend = f"{_OWN_MARK} the scene's own   {_FRONT_MARK} on the Pareto front"
    lines += _table(view.settings, map(_mark, report.rows), legend, style)
    colour = GREEN if report.verdict.on_front and not report.verdict.noticeable else YELLOW
    if report.verdict.text:
        lines += ["", *style.wrap(report.verdict.text, 2 * _INDENT, colour)]
    for grid in (view.orders, view.stable):
        if grid is not None:
            lines += ["", *(f"{2 * _INDENT}{line}".rstrip() for line in grid_lines(grid, style))]
    return [*lines, *_notes(view.notes, style)]


def _sweep(sweep: SweepReport, style: Style) -> list[str]:
    view = scenario_view(english(), sweep)
    marks = (((_OWN_MARK, BOLD) if row.own else (" ", "")) for row in sweep.rows)
    head = _title(sweep.name, sweep.title, style)
    return [
        head,
        *_table(view.settings, marks, f"{_OWN_MARK} as the model is", style),
        *_notes(view.notes, style),
    ]


def _title(name: str, title: str, style: Style) -> str:
    return _INDENT + style.paint(visible(name), BOLD) + (f"  {visible(title)}" if title else "")


def _plot_remarks(report: ScenarioReport) -> Iterator[str]:
    """Say what a page says in its plot."""
    if report.figure:
        yield f"It measures {report.figure}."
    if report.velocity_floor > report.floor:
        yield f"Velocities are known to {plain_text(power(report.velocity_floor, 1))}."


def _table(
    grid: Grid, marks: Iterable[tuple[str, str]], legend: str, style: Style
) -> Iterator[str]:
    """Write the table of settings, or of values."""
    yield ""
    if not grid.rows:
        yield f"{2 * _INDENT}no setting was measured"
        return
    _, *lines = grid_lines(grid, style, tuple(marks))
    for line in (*lines, style.paint(legend, FAINT)):
        yield f"{2 * _INDENT}{line}".rstrip()


def _mark(row: WorkPrecisionRow) -> tuple[str, str]:
    code = BOLD if row.own else RED if row.status in ("diverged", "reset") else ""
    code = code or (YELLOW if row.status != "ok" else GREEN if row.front else "")
    return (_OWN_MARK if row.own else " ") + (_FRONT_MARK if row.front else " "), code


def _notes(notes: Sequence[str], style: Style) -> list[str]:
    """Write why runs were lost."""
    return ["" for _ in notes[:1]] + [
        line for note in notes for line in style.wrap(note, 2 * _INDENT, YELLOW)
    ]
