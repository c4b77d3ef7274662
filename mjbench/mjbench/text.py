"""Reports as text for a terminal: the verdict first, then the table, then the plot.

The JSON has all of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from mjbench.columns import rounded_text
from mjbench.profile import profile_lines
from mjbench.reports import Interval
from mjbench.reports.charts import ON_FRONT, plot_lines
from mjbench.reports.diet_report import (
    INTERFACE_LABEL,
    MEASURED_LABEL,
    DietReport,
    Finding,
    Saving,
    name_list,
)
from mjbench.reports.limits import reach_text
from mjbench.reports.model_report import BatchCost, CaseReport, EngineReport, SceneReport
from mjbench.reports.records import Departure
from mjbench.reports.scene_report import (
    FLOORS,
    OrderRow,
    ScenarioReport,
    StableRow,
    SweepReport,
    WorkPrecisionRow,
)
from mjbench.reports.shown_errors import (
    horizon_error_text,
    interval_text,
    seconds_text,
    setting_text,
    status_text,
)
from mjbench.reports.terminal import Style, count_text, fitted_table, indented, printable

_PLAIN = Style()
_HEADS = {
    "step_error": "seen of steps",
    "seen": "seen (1: just)",
    "position": "position",
    "attitude": "attitude",
    "velocity": "velocity",
}
"""Short titles of figures; plots have the long ones."""


def scene_text(report: SceneReport, style: Style = _PLAIN) -> str:
    """A model: the verdicts of all scenarios, then each with its table, plot and limits."""
    quick = "  (quick: fewer settings, rough times)" if report.quick else ""
    lines = [style.strong(report.model) + quick]
    if not report.scenarios and not report.failures:
        lines.append("  nothing in it can move, so nothing was measured")
    for scenario in report.scenarios:
        title = "" if scenario.title == scenario.name else f": {scenario.title}"
        lines += [f"  {style.strong(scenario.name)}{title}"]
        for line in scenario.verdict.lines:
            lines += style.wrap(line, "    ")
    for failure in report.failures:
        lines += style.wrap(f"{failure.part} was not measured: {failure.reason}", "  ")
    for scenario in report.scenarios:
        lines += [
            "",
            f"  {style.strong(scenario.name)}",
            *indented(scenario_lines(scenario, style.inner(4))),
        ]
    for sweep in report.sweeps:
        title = f"  {style.strong(sweep.name)}: {sweep.title}"
        lines += ["", title, *indented(_sweep(sweep, style))]
    lines += ["", *style.wrap(report.machine.text, "  ")]
    return printable("\n".join(lines) + "\n")


def scenario_lines(report: ScenarioReport, style: Style, *, plot: bool = True) -> Iterator[str]:
    """A scenario without its verdict: settings, the plot, limits, orders, what is known."""
    yield from _settings(report, style)
    for chart in report.charts[:1] if plot else ():
        yield ""
        yield from plot_lines(chart, style.width)
    yield from profile_lines(report.profile, report.profile_text, style)
    yield from _stable(report.stable, style, "theory at rest")
    yield from _orders(report.orders, style)
    figures: dict[tuple[str, str], list[str]] = {}
    for line in report.figures:
        exact = "" if line.exact is None else f", in theory {line.exact:.6g} ({line.source})"
        value = f"{_number(line.measured)} {line.unit}".strip()
        value = "none" if line.measured is None else value
        figures.setdefault((line.name, value + exact), []).append(line.integrator)
    for (figure, words), integrators in figures.items():
        yield from style.wrap(f"{figure} under {', '.join(integrators)}: {words}")
    yield ""
    basis = f"over {seconds_text(report.duration)}, against {report.source}"
    basis += f" (known to {report.floor:.1g}, velocities to {report.velocity_floor:.1g})"
    for note in (basis, *report.notes):
        yield from style.wrap(note)


def _settings(report: ScenarioReport, style: Style) -> Iterator[str]:
    rows = [row for row in report.rows if not row.idle]
    columns: list[tuple[str, list[str]]] = [
        (
            "",
            [(">" if r.own else " ") + ("*" if r.front else "~" if r.lucky else " ") for r in rows],
        ),
        ("setting", [r.name for r in rows]),
        ("cost", [interval_text(r.cost) for r in rows]),
    ]
    for quantity in report.quantities:
        if quantity.resolved:
            cells = [_error(row, quantity.name, quantity.least) for row in rows]
            columns.append((_HEADS.get(quantity.name, quantity.label), cells))
    off = horizon_error_text(report.horizon_error)
    columns += [
        (
            f"off by {off} at",
            ["" if r.parted is None else seconds_text(r.parted, 3) for r in rows],
        ),
        (
            "energy drift",
            ["" if r.energy_drift is None else f"{100 * r.energy_drift:+.2g} %" for r in rows],
        ),
        ("creep (m)", ["" if not r.slip else f"{r.slip:.2g}" for r in rows]),
        ("depth (m)", ["" if not r.penetration else f"{r.penetration:.2g}" for r in rows]),
        ("× real time", ["" if r.realtime is None else f"{r.realtime:.3g}" for r in rows]),
    ]
    yield from fitted_table(columns, style.width)
    yield f"> the model's own   * {ON_FRONT}" + "   ~ luck" * any(row.lucky for row in rows)
    remarks: dict[str, list[str]] = {}
    for row in rows:
        if remark := _lost(row.status, row.reasons) or row.lucky:
            remarks.setdefault(remark, []).append(row.name)
    for reason, names in remarks.items():
        yield from style.wrap(f"{'; '.join(names)}: {reason}")


def _error(row: WorkPrecisionRow, name: str, least: float) -> str:
    if row.status != "ok":
        return status_text(row.status)
    value = getattr(row, name)
    value = value[0] if isinstance(value, tuple) else value
    if value is None:
        return ""
    return f"< {least:.2g}" if least and value <= least * (1 + 1e-9) else f"{value:.3g}"


def _orders(orders: Sequence[OrderRow], style: Style) -> Iterator[str]:
    rows = [row for row in orders if row.position or row.attitude or row.velocity]
    if rows:
        yield ""
        columns = [("order of", [row.integrator for row in rows])]
        for part in ("position", "attitude", "velocity"):
            fits = [getattr(row, part) for row in rows]
            columns.append((part, ["" if fit is None else fit.text for fit in fits]))
        yield from fitted_table(columns, style.width)


def _stable(rows: Sequence[StableRow], style: Style, theory: str = "theory") -> Iterator[str]:
    if not rows:
        return
    yield ""
    columns = [
        ("largest timestep", [row.integrator for row in rows]),
        ("bounded", [row.shown for row in rows]),
        ("near small steps", [reach_text(row.near, row.searched) for row in rows]),
        ("nothing goes through", [reach_text(row.through, row.searched) for row in rows]),
        (theory, [_theory(row) for row in rows]),
    ]
    yield from fitted_table(columns, style.width)
    reasons: dict[str, list[str]] = {}
    for row in rows:
        for text in (row.reason, row.near_reason, row.through_reason):
            if text:
                reasons.setdefault(text, []).append(row.integrator)
    for reason, names in reasons.items():
        yield from style.wrap(f"beyond it {', '.join(dict.fromkeys(names))}: {reason}")


def _theory(row: StableRow) -> str:
    limit = row.theory
    return seconds_text(limit, 5) if isinstance(limit, float) else reach_text(limit, row.searched)


def _sweep(report: SweepReport, style: Style) -> Iterator[str]:
    rows = report.rows
    columns = [
        ("", [">" if row.own else "" for row in rows]),
        ("parameter", [row.parameter for row in rows]),
        ("value", [row.value for row in rows]),
    ]
    for name in report.show:
        columns.append((_HEADS.get(name, name), [_figure(getattr(row, name)) for row in rows]))
    columns.append(("status", [_lost(row.status, row.reasons) for row in rows]))
    yield from fitted_table(columns, style.width - 4)


def _figure(value: Interval | float | None) -> str:
    return f"{value:.3g}" if isinstance(value, float) else interval_text(value)


def engines_text(report: EngineReport, style: Style = _PLAIN) -> str:
    """A model in other engines."""
    lines = [style.strong(report.model), f"  {report.machine.text}"]
    for scenario in report.scenarios:
        rows = scenario.rows
        bits = [f"{row.bits} bits" if row.bits else "" for row in rows]
        names = [
            ", ".join(filter(None, (row.title, part, row.label)))
            for row, part in zip(rows, bits, strict=True)
        ]
        rates = ["; ".join(map(_rate, row.costs)) for row in rows]
        places = [[pair[0] for pair in (row.position, row.attitude) if pair] for row in rows]
        least = FLOORS * scenario.floor * (1 + 1e-9)
        errors = [max(place, default=None) for place in places]
        columns = [
            ("engine", names),
            ("errs by", ["" if e is None else f"{'< ' * (e <= least)}{e:.2g}" for e in errors]),
            ("from MuJoCo", ["" if r.apart is None else f"{r.apart:.2g}" for r in rows]),
            ("steps a second, by number of worlds", rates),
        ]
        lines += ["", f"  {style.strong(scenario.name)}: {scenario.title}"]
        setting = f"{setting_text(scenario.setting)}, over {seconds_text(scenario.duration)}"
        lines += style.wrap(f"{setting}, against {scenario.source}", "    ")
        lines += indented(fitted_table(columns, style.width - 4))
        for name, row in zip(names, rows, strict=True):
            if row.message:
                lines += style.wrap(f"{name}: {row.status}, {row.message}", "    ")
    return printable("\n".join(lines) + "\n")


def _rate(cost: BatchCost) -> str:
    time = cost.seconds
    return f"{cost.worlds}: {cost.remark if time is None else rounded_text(1 / time.value, 3)}"


def _lost(status: str, reasons: Iterable[str]) -> str:
    return "" if status == "ok" else "; ".join(filter(None, (status_text(status), *reasons)))


def case_text(report: CaseReport, style: Style = _PLAIN) -> str:
    """A hard case."""
    lines = [f"{style.strong(report.name)}  case {report.case}: {report.title}"]
    costs = [f"{name} {seconds_text(cost, 3)}" for name, cost in report.reached]
    if costs:
        text = f"to err by 0.001, a simulated second takes {', '.join(costs)}"
        lines += style.wrap(text, "  ")
    reference = report.reference
    lines += style.wrap(f"against {reference.source}, and {reference.second}", "  ")
    lines += style.wrap(report.note, "  ") if report.note else []
    inner = style.inner(4)
    parts = [*_orders(report.orders, inner), *_stable(report.boundaries, inner)]
    figures = report.figures
    if figures:
        columns = [
            ("quantity", [line.name for line in figures]),
            ("integrator", [line.integrator for line in figures]),
            ("measured", [_number(line.measured) for line in figures]),
            ("exact", [_number(line.exact) for line in figures]),
            ("source", [line.source for line in figures]),
        ]
        parts += ["", *fitted_table(columns, inner.width)]
    parts.append("")
    for chart in report.charts[:1]:
        parts += plot_lines(chart, inner.width)
    lines += style.wrap(report.machine.text, "  ")
    return "\n".join([*lines, *indented(parts)]) + "\n"


def departures_text(departures: Sequence[Departure]) -> str:
    """Figures that are not as they were recorded."""
    if not departures:
        return "as recorded\n"
    names = ("where", "setting", "figure", "recorded", "measured", "band")
    columns = [(name, [getattr(d, name) for d in departures]) for name in names]
    return "\n".join(fitted_table(columns, _WIDEST)) + "\n"


_WIDEST = 1000
"""Figures that differ are shown whole."""


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


AnyReport: TypeAlias = SceneReport | EngineReport | DietReport | CaseReport


def report_text(
    report: AnyReport,
    style: Style,
    command: str = "mjbench diet MODEL",
    declarations: str = "MODEL.toml",
) -> str:
    """A report of any kind; `command` and `declarations` as for `diet_text`, `{}` is its model."""
    match report:
        case SceneReport():
            return scene_text(report, style)
        case EngineReport():
            return engines_text(report, style)
        case DietReport():
            model = report.model
            return diet_text(report, command.format(model), declarations.format(model), style)
        case CaseReport():
            return case_text(report, style)


_EDITS, _LINES = 6, 6
"""The most changes that are shown of a finding, and the most lines of one."""
_WORTHWHILE = 1.05
"""The speedup below which a finding folds."""
_FOOTNOTE = (
    "integrator and timestep are judged against a reference, not against the model as it is: "
    "measure them with bench"
)


def diet_text(
    report: DietReport, command: str, declarations: str, style: Style, *, is_stopped: bool = False
) -> str:
    """A model; `command` looks at it, and `declarations` may say what is kept.

    Of one at which it stopped looking nothing is summed up.
    """
    quick = "  (quick: short runs and rough times)" if report.quick else ""
    lines = [style.strong(report.model) + quick]
    names = [scenario.name for scenario in report.scenarios if scenario.status == "ok"]
    lines += style.wrap(f"in {name_list(names)}" if names else "in no scenario", "  ")
    for scenario in report.scenarios:
        if scenario.status != "ok":
            status = f"{scenario.status}: {'; '.join(scenario.reasons)}"
            lost = f"scenario {scenario.name}: {status}; nothing is claimed from it"
            lines += style.wrap(lost, "  ")
    parts = [finding for finding in report.findings if finding.label != INTERFACE_LABEL]
    notable = [f for f in parts if f.is_fault or f.kept or (f.saving.time or 0.0) >= _WORTHWHILE]
    for finding in notable:
        lines += ["", *_finding(finding, command, style)]
    if small := [finding.message for finding in parts if finding not in notable]:
        text = f"saves less than 5 %, or no time that was measured: {'; '.join(small)}"
        lines += ["", *style.wrap(text, "  ")]
    for finding in report.findings:
        if finding.label == INTERFACE_LABEL:
            text = f"interface: {finding.message}, of the code that was looked at: "
            text += f"whoever drives the model may; {saving_text(finding.saving)}"
            lines += ["", *style.wrap(text, "  ")]
    for entry in report.stale:
        place = f"{entry.path}:{entry.line}:{entry.column}"
        text = f"`{entry.finding}` no longer keeps anything: remove the entry ({place})"
        lines += ["", *style.wrap(text, "  ")]
    texts = () if is_stopped else _summary(report, command, declarations)
    summary = [line for text in texts for line in style.wrap(text, "  ")]
    lines += ["", *summary] if summary else []
    return printable("\n".join([*lines, "", *style.wrap(_FOOTNOTE)]) + "\n")


def _summary(report: DietReport, command: str, declarations: str) -> Iterator[str]:
    faults = [finding for finding in report.findings if finding.is_fault]
    fixable = [finding for finding in faults if finding.fixable]
    if faults:
        text = f"{count_text(len(faults), 'finding')} not explained"
        yield text + (f", {len(fixable)} of them for `{command} --fix`" if fixable else "")
        first = faults[0]
        name = first.places[0].name if len(first.places) == 1 else ""
        key = f"{first.kind} {name}".strip()
        quote = "'" if '"' in key else '"'
        text = f"give the reason for what you keep in {declarations}: "
        yield f"{text}[[keep]] finding = {quote}{key}{quote}, reason = …"
    elif report.ok and all(finding.kept for finding in report.findings):
        yield f"nothing {'else ' if report.findings else ''}in it is proved useless"
    elif report.ok:
        yield "nothing in it is proved useless; what is named above was not needed in what was run"
    kinds_by_reason: dict[str, list[str]] = {}
    found_kinds = {finding.kind for finding in report.findings}
    for attempt in report.tried:
        things = f" {name_list(attempt.places)}" if attempt.kind in found_kinds else ""
        kinds_by_reason.setdefault(attempt.reason, []).append(attempt.kind + things)
    for reason, kinds in kinds_by_reason.items():
        outcome = f"not found, because {reason}" if reason else "tried and needed"
        yield f"{outcome}: {name_list(list(dict.fromkeys(kinds)))}"


def _finding(finding: Finding, command: str, style: Style) -> Iterator[str]:
    first, *rest = style.wrap(f"{finding.kind}: {finding.message}", "  ")
    yield first.replace(finding.kind, style.strong(finding.kind), 1)
    yield from rest
    label = finding.label
    if finding.starts and label == MEASURED_LABEL:
        label += f" (in {count_text(finding.starts, 'run')}"
        label += f"; at most {finding.shown})" if finding.shown else ", to the bit)"
    label += "; in what is left, " if finding.in_rest else "; "
    yield from style.wrap(label + saving_text(finding.saving), "    ")
    if finding.proof:
        yield from style.wrap(f"because {finding.proof}", "    ")
    if finding.kept:
        yield from style.wrap(f"kept: {finding.kept}", "    ")
        return
    yield from style.wrap(f"shown by `{command} --only {finding.kind}`", "    ")
    for edit in finding.edits[:_EDITS]:
        yield f"    {edit.path}:{edit.line}:{edit.column}"
        for mark, text in (("-", edit.old), ("+", edit.new)):
            text_lines = [line for line in text.splitlines() if line.strip()]
            for line in text_lines[:_LINES]:
                yield f"    {mark} {line.strip()}"
            if len(text_lines) > _LINES:
                yield f"    {mark} … {count_text(len(text_lines) - _LINES, 'more line')}"
    if len(finding.edits) > _EDITS:
        yield f"    … and {len(finding.edits) - _EDITS} more changes"
    if finding.doubt:
        yield from style.wrap(f"not a fault, because {finding.doubt}", "    ")
    elif finding.unfixed and finding.is_fault:
        yield from style.wrap(f"not for --fix: {finding.unfixed}", "    ")


def saving_text(saving: Saving) -> str:
    """What a change saves, in words."""
    parts = []
    if saving.time is not None:
        parts.append(f"×{saving.time:.3g} as fast" if saving.certain else "no measurable time")
    for count, place in ((saving.memory, "memory"), (saving.text, "text")):
        if count:
            fewer = "fewer" if count > 0 else "more"
            parts.append(f"{abs(count):,} bytes of {place} {fewer}")
    return ", ".join(parts) or "saves nothing measurable"
