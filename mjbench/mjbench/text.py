"""Reports as text for a terminal; the JSON has all of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from mjbench.machine import Machine
from mjbench.reports import Interval
from mjbench.reports.case_report import CaseReport
from mjbench.reports.diet_report import DietReport, Saving
from mjbench.reports.engine_report import EngineReport
from mjbench.reports.records import Departure
from mjbench.reports.scene_report import (
    MeasuredRun,
    OrderRow,
    ScenarioReport,
    SceneReport,
    StableRow,
    SweepReport,
    WorkPrecisionRow,
)
from mjbench.reports.shown_errors import is_idle, seconds_text, setting_text, status_text

_FIGURES = ("change", "penetration", "slip", "restitution", "residual", "iterations")
_Row = Sequence[str]


def scene_text(report: SceneReport) -> str:
    """A model: each scenario with its settings, its orders and stable timesteps; its sweeps."""
    lines = [report.model + ("  (quick: fewer settings, rough times)" if report.quick else "")]
    lines += [f"  {_machine_text(report.machine)}"]
    if not report.scenarios:
        lines.append("  nothing in it can move, so nothing was measured")
    for scenario in report.scenarios:
        lines += ["", f"  {scenario.name}: {scenario.title}", *_indent(_scenario(scenario))]
    for sweep in report.sweeps:
        lines += ["", f"  {sweep.name}: {sweep.title}", *_indent(_sweep(sweep))]
    return "\n".join(lines) + "\n"


def _scenario(report: ScenarioReport) -> Iterator[str]:
    yield f"{seconds_text(report.duration)}, against {report.source} (known to {report.floor:.1g})"
    if report.horizon < report.duration:
        yield f"chaotic: errors mean something for {seconds_text(report.horizon)}"
    yield from report.notes
    yield ""
    visible_rows = [row for row in report.rows if not is_idle(row)]
    head = ["", "setting", "cost", "error", "status"]
    yield from _table(head, [_setting(row, report) for row in visible_rows])
    yield "> the model's own   * on the Pareto front"
    if report.verdict.text:
        yield report.verdict.text
    yield from _orders(report.orders)
    yield from _stable(report.stable)


def _setting(row: WorkPrecisionRow, report: ScenarioReport) -> _Row:
    mark = (">" if row.own else " ") + ("*" if row.front else " ")
    name = setting_text(row.setting, report.own_setting)
    return mark, name, _interval(row.cost), _error(row), _status(row)


def _error(row: WorkPrecisionRow) -> str:
    """The first that is known of what is declared, seen, a position, an attitude, a velocity."""
    if row.figure is not None:
        return f"{row.figure[0]:.3g} (figure)"
    if row.seen is not None:
        return f"{row.seen:.3g} (1: visible)"
    for name in ("position", "attitude", "velocity"):
        if (pair := getattr(row, name)) is not None:
            return f"{pair[0]:.3g} ({name})"
    return ""


def _status(run: MeasuredRun) -> str:
    return "" if run.status == "ok" else "; ".join((status_text(run.status), *run.reasons))


def _orders(orders: Sequence[OrderRow]) -> Iterator[str]:
    rows = [row for row in orders if row.has_orders]
    if rows:
        yield ""
        parts = ("position", "attitude", "velocity")
        cells = [[row.integrator, *(_order(row, part) for part in parts)] for row in rows]
        yield from _table(["order of", *parts], cells)


def _order(row: OrderRow, part: str) -> str:
    fit = getattr(row, part)
    return "" if fit is None else str(fit.text)


def _stable(rows: Sequence[StableRow]) -> Iterator[str]:
    if rows:
        yield ""
        head = ["largest stable timestep", "measured", "theory", "stable again"]
        yield from _table(head, [_limit(row) for row in rows])


def _limit(row: StableRow) -> _Row:
    largest = f"all to {seconds_text(row.searched[1], 3)}"
    if row.largest is not None:
        largest = seconds_text(row.largest, 4) if row.largest else "none"
    islands = "" if row.islands is None else " to ".join(seconds_text(s, 3) for s in row.islands)
    return row.integrator, largest, seconds_text(row.theory, 5) if row.theory else "", islands


def _sweep(report: SweepReport) -> Iterator[str]:
    names = [
        name for name in _FIGURES if any(getattr(row, name) is not None for row in report.rows)
    ]
    rows = []
    for row in report.rows:
        figures = (getattr(row, name) for name in names)
        cells = ["" if value is None else f"{value:.3g}" for value in figures]
        rest = _interval(row.cost), _interval(row.throughput), _lost(row.status, row.reasons)
        rows.append([">" if row.own else "", row.parameter, row.value, *cells, *rest])
    yield from _table(["", "parameter", "value", *names, "cost", "× real time", "status"], rows)


def engines_text(report: EngineReport) -> str:
    """A model in other engines."""
    lines = [report.model, f"  {_machine_text(report.machine)}"]
    for scenario in report.scenarios:
        rows = []
        for row in scenario.rows:
            costs = [f"{cost.worlds}: {_cost(cost.seconds, cost.remark)}" for cost in row.costs]
            name = f"{row.title}, {row.bits} bits" if row.bits else row.title
            apart = "" if row.apart is None else f"{row.apart:.2g}"
            rows.append(
                [name, row.device, apart, "; ".join(costs), _lost(row.status, (row.message,))]
            )
        head = ["engine", "device", "from MuJoCo", "a step by number of worlds", "status"]
        lines += ["", f"  {scenario.name}: {scenario.title}", *_indent(_table(head, rows))]
    return "\n".join(lines) + "\n"


def _cost(seconds: Interval | None, remark: str) -> str:
    return remark if seconds is None else seconds_text(seconds.value, 3)


def _lost(status: str, reasons: Iterable[str]) -> str:
    return "" if status == "ok" else "; ".join(filter(None, (status_text(status), *reasons)))


def case_text(report: CaseReport) -> str:
    """A hard case."""
    lines = [f"{report.name}: {report.title}", f"  {_machine_text(report.machine)}"]
    reference = report.reference
    lines.append(f"  against {reference.source}, and {reference.second}")
    lines += [f"  {report.note}"] if report.note else []
    parts = [*_orders(report.orders), *_stable(report.boundaries)]
    figures = [
        [line.name, line.integrator, _number(line.measured), _number(line.exact), line.source]
        for line in report.figures
    ]
    if figures:
        parts += ["", *_table(["quantity", "integrator", "measured", "exact", "source"], figures)]
    errors = [
        [run.integrator, seconds_text(run.timestep), *_case_errors(run), _status(run)]
        for run in report.errors
    ]
    head = ["integrator", "timestep", "position", "attitude", "velocity", "status"]
    return "\n".join([*lines, *_indent([*parts, "", *_table(head, errors)])]) + "\n"


def _case_errors(run: MeasuredRun) -> list[str]:
    pairs = (run.position, run.attitude, run.velocity)
    return ["" if pair is None else f"{pair[0]:.3g}" for pair in pairs]


def diet_text(report: DietReport) -> str:
    """What a model holds that its scenarios do not need."""
    names = ", ".join(scenario.name for scenario in report.scenarios if scenario.status == "ok")
    lines = [report.model, f"  in {names or 'no scenario'}"]
    for scenario in report.scenarios:
        if scenario.status != "ok":
            lost = _lost(scenario.status, scenario.reasons)
            lines.append(f"  scenario {scenario.name}: {lost}; nothing is claimed from it")
    for finding in report.findings:
        lines += ["", f"  {finding.kind}: {finding.message}"]
        lines.append(f"    {finding.label}; {_saving(finding.saving)}")
        for reason, text in (("because", finding.proof), ("kept:", finding.kept)):
            lines += [f"    {reason} {text}"] if text else []
        lines += [f"    not a fault, because {finding.doubt}"] if finding.doubt else []
        for edit in finding.edits:
            lines.append(f"    {edit.path}:{edit.line}:{edit.column}")
            for mark, part in (("-", edit.old), ("+", edit.new)):
                lines += [
                    f"    {mark} {line.strip()}" for line in part.splitlines() if line.strip()
                ]
    for entry in report.stale:
        lines.append(f"  `{entry.finding}` no longer keeps anything ({entry.path}:{entry.line})")
    if not report.findings:
        lines += ["", "  nothing in it is proved useless"]
    if report.slim is not None:
        lines += ["", f"  without all of them: {_saving(report.slim)}"]
    return "\n".join(lines) + "\n"


def _saving(saving: Saving) -> str:
    parts = []
    if saving.time is not None:
        parts.append(f"×{saving.time:.3g} as fast" if saving.certain else "no measurable time")
    for count, place in ((saving.memory, "memory"), (saving.text, "text")):
        parts += [f"{count:,} bytes of {place}"] if count else []
    return ", ".join(parts) or "saves nothing measurable"


def departures_text(departures: Sequence[Departure]) -> str:
    """Figures that are not as they were recorded."""
    if not departures:
        return "as recorded\n"
    rows = [[d.where, d.setting, d.figure, d.recorded, d.measured, d.band] for d in departures]
    head = ["scenario", "setting", "figure", "recorded", "measured", "band"]
    return "\n".join(_table(head, rows)) + "\n"


def _machine_text(machine: Machine) -> str:
    parts = [f"MuJoCo {machine.engine}", f"Python {machine.python}", f"NumPy {machine.numpy}"]
    return ", ".join(filter(None, [*parts, machine.system, machine.cpu]))


def _interval(value: Interval | None) -> str:
    if value is None:
        return ""
    share = 100 * value.half_width
    return f"{value.value:.3g}" + (f" ± {share:.2g} %" if 0.05 <= share < 1e3 else "")


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _indent(lines: Iterable[str]) -> list[str]:
    return [f"    {line}".rstrip() for line in lines]


def _table(head: _Row, rows: Sequence[_Row]) -> list[str]:
    """Columns as wide as their longest cell; those without any are left out."""
    columns = [n for n in range(len(head)) if any(row[n].strip() for row in rows)]
    cells = [[head[n] for n in columns], *([row[n] for n in columns] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in cells
    ]
