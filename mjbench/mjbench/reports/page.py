"""A report on a model as a page of HTML that needs nothing else: verdicts, plots, tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape

from mjbench.reports.charts import Axis, Chart, ChartLine, ChartPoint
from mjbench.reports.model_report import SceneReport
from mjbench.reports.scene_report import ScenarioReport
from mjbench.reports.terminal import Style

_COLOURS = ("#0072b2", "#b34d00", "#00795a", "#a8467f", "#7a6a00", "#5b3fb0", "#1e1e1c")
_LEFT, _RIGHT, _TOP, _BOTTOM = 70.0, 640.0, 16.0, 330.0
_STYLE = """\
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem }
pre { overflow-x: auto; font-size: 13px; line-height: 1.35 } svg { max-width: 42rem; width: 100% }
ul { padding-left: 1.2rem } li:first-child { font-weight: 600 } svg text { font-size: 12px }
"""


def scene_page(report: SceneReport) -> str:
    """The page of a model."""
    title = escape(report.model)
    parts = [
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
        '<meta name="viewport" content="width=device-width">',
        f"<style>{_STYLE}</style></head><body><h1>{title}</h1>",
    ]
    for failure in report.failures:
        text = f"{failure.part} was not measured: {failure.reason}"
        parts.append(f"<p>{escape(text)}</p>")
    for scenario in report.scenarios:
        parts += _scenario(scenario)
    parts.append(f"<p>{escape(report.machine.text)}</p></body></html>")
    return "\n".join(parts) + "\n"


def _scenario(report: ScenarioReport) -> Iterator[str]:
    from mjbench.text import scenario_lines

    yield f"<h2>{escape(report.name)}: {escape(report.title)}</h2>"
    lines = "".join(f"<li>{escape(line)}</li>" for line in report.verdict.lines)
    yield f"<ul>{lines}</ul>"
    yield from (chart_svg(chart) for chart in report.charts[:1])
    table = "\n".join(scenario_lines(report, Style(400), plot=False))
    yield f"<details><summary>All settings, limits and orders</summary><pre>{escape(table)}</pre>"
    yield "</details>"


def chart_svg(chart: Chart) -> str:
    """A chart: work across, error up, both logarithmic; empty where no run has an error."""
    points = [point for line in chart.lines for point in line.points if point.x > 0]
    errors = [math.log10(point.y) for point in points if point.y]
    if not errors:
        return ""
    works = [math.log10(point.x) for point in points]
    x = Axis(works, _RIGHT - _LEFT, 0.1)
    y = Axis(errors, _BOTTOM - _TOP, 0.3)
    parts = [
        f'<svg viewBox="0 0 650 {420 + 18 * len(chart.lines)}" role="img">',
        f"<title>{escape(chart.title)}</title><desc>{escape(chart.text)}</desc>",
        _path(f"M{_LEFT} {_TOP}V{_BOTTOM}H{_RIGHT}", "currentColor"),
        *_grid(chart, x, y),
    ]
    for number, line in enumerate(chart.lines):
        parts += _line(line, x, y)
        at, colour = _BOTTOM + 66 + 18 * number, _COLOURS[line.number % len(_COLOURS)]
        parts.append(f'<circle cx="{_LEFT + 6}" cy="{at - 4}" r="5" fill="{colour}"/>')
        parts.append(_text(_LEFT + 18, at, line.name))
    middle = f"translate(14 {(_TOP + _BOTTOM) / 2}) rotate(-90)"
    title = f'<text transform="{middle}" text-anchor="middle">{escape(chart.axes[1])}</text>'
    parts.append(_text((_LEFT + _RIGHT) / 2, _BOTTOM + 40, chart.axes[0], "middle"))
    return "".join([*parts, title, "</svg>"])


def _path(d: str, colour: str, look: str = "") -> str:
    return f'<path d="{d}" fill="none" stroke="{colour}"{look}/>'


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'


def _grid(chart: Chart, x: Axis, y: Axis) -> Iterator[str]:
    for up, text in y.ticks():
        yield _path(f"M{_LEFT} {_BOTTOM - up:.1f}H{_RIGHT}", "#ccc")
        yield _text(_LEFT - 6, _BOTTOM - up + 4, text, "end")
    for level in chart.levels:
        at = _BOTTOM - y.at(math.log10(level.y))
        if _TOP < at < _BOTTOM:
            yield _path(f"M{_LEFT} {at:.1f}H{_RIGHT}", "#555", ' stroke-dasharray="2 3"')
            yield _text(_LEFT + 6, at - 4, level.text)
    for right, text in x.ticks():
        yield _text(_LEFT + right, _BOTTOM + 18, text, "middle")


def _line(line: ChartLine, x: Axis, y: Axis) -> Iterator[str]:
    colour = _COLOURS[line.number % len(_COLOURS)]
    places = [_place(p, x, y) for p in line.points if p.y and not p.small]
    if places:
        yield _path("M" + "L".join(f"{right:.1f} {down:.1f}" for right, down in places), colour)
    for point in line.points:
        right, down = _place(point, x, y)
        if point.y is None:
            shape = f'<path d="M{right - 4:.1f} {down - 4:.1f}l8 8m0-8l-8 8" stroke="{colour}"'
            end = "path"
        else:
            radius, fill = 3 if point.small else 5, colour if point.full else "white"
            shape = f'<circle cx="{right:.1f}" cy="{down:.1f}" r="{radius}" fill="{fill}"'
            shape += f' stroke="{colour}"' + (' stroke-width="4"' if point.ringed else "")
            end = "circle"
        yield f"{shape}><title>{escape(point.title)}</title></{end}>"


def _place(point: ChartPoint, x: Axis, y: Axis) -> tuple[float, float]:
    down = _TOP if not point.y else _BOTTOM - y.at(math.log10(point.y))
    return _LEFT + x.at(math.log10(point.x)), down
