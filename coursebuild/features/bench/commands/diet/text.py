"""The diet's reports as text.

Entry points: `diet_text(reports, style)`; `diet_values(reports)`, for JSON.

A finding is shown with its label, what it saves, its place, and the change itself; what was tried
and is needed stands on one line.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.numerics.reports.diet_report import (
    DietReport,
    Finding,
    Saving,
    TextEdit,
    name_list,
)
from coursebuild.report.terminal import BOLD, FAINT, GREEN, RED, YELLOW, Style, visible
from coursebuild.report.values import plain, plural

_EDITS = 6
"""The most changes that are shown of a finding."""
_LINES = 6
"""The most lines that are shown of a change."""
_FOOTNOTE = (
    "integrator and timestep are judged against a reference, not against the model as it is: "
    "see `coursebuild bench`"
)


def diet_values(reports: Sequence[DietReport]) -> dict[str, object]:
    """Return the reports as plain values, each with whether nothing is left to be done."""
    return {"models": [plain(report) | {"ok": report.ok} for report in reports]}


def diet_text(reports: Sequence[DietReport], style: Style) -> str:
    """Write every model with its findings, and a blank line between; empty without models."""
    if not reports:
        return ""
    footnote = "".join(line + "\n" for line in style.wrap(_FOOTNOTE, "", FAINT))
    return "\n".join([*(_model(report, style) for report in reports), footnote])


def _model(report: DietReport, style: Style) -> str:
    head = style.paint(visible(report.model), BOLD)
    if report.quick:
        head += "  " + style.paint("quick: short runs, rough times", YELLOW)
    lines = [head]
    names = [scenario.name for scenario in report.scenarios if scenario.status == "ok"]
    lines += style.wrap(f"in {name_list(names)}" if names else "in no scenario", "  ")
    for scenario in report.scenarios:
        if scenario.status != "ok":
            status = f"{scenario.status}: {'; '.join(scenario.reasons)}"
            text = f"scenario {scenario.name}: {status}; nothing is claimed from it"
            lines += style.wrap(text, "  ", RED)
    for finding in report.findings:
        lines += ["", *_finding(finding, style)]
    for entry in report.stale:
        place = f"{entry.path}:{entry.line}:{entry.column}"
        text = f"`{entry.finding}` keeps nothing any more: take the entry out ({place})"
        lines += ["", *style.wrap(text, "  ", RED)]
    lines += ["", *_summary(report, style)]
    return "\n".join(lines) + "\n"


def _summary(report: DietReport, style: Style) -> list[str]:
    findings = [finding for finding in report.findings if finding.is_fault]
    fixable = [finding for finding in findings if finding.fixable]
    lines: list[str] = []
    if not report.ok:
        text = plural(len(findings), "finding") + " not explained"
        if fixable:
            text += f", {len(fixable)} of them for `coursebuild diet {report.model} --fix`"
        lines += style.wrap(text, "  ", RED)
        lines += style.wrap(_how_to_keep(report, findings), "  ", FAINT)
    else:
        lines.append("  " + style.paint("nothing in it is in vain", GREEN))
    if report.slim is not None and len(findings) > 1:
        lines += style.wrap(f"without all of them: {_saving(report.slim)}", "  ")
    if report.fixed is not None and len(fixable) > 1 and len(fixable) < len(findings):
        lines += style.wrap(f"after --fix: {_saving(report.fixed)}", "  ")
    kinds_by_reason: dict[str, list[str]] = {}
    for attempt in report.tried:
        kinds_by_reason.setdefault(attempt.reason, []).append(attempt.kind)
    for reason, kinds in kinds_by_reason.items():
        outcome = f"not found, because {reason}" if reason else "tried and needed"
        lines += style.wrap(f"{outcome}: {name_list(list(dict.fromkeys(kinds)))}", "  ", FAINT)
    return lines


def _how_to_keep(report: DietReport, findings: Sequence[Finding]) -> str:
    """Say how to keep the first of the findings."""
    if not findings:
        return ""
    first = findings[0]
    name = first.places[0].name if len(first.places) == 1 else ""
    key = f"{first.kind} {name}".strip()
    quote = "'" if '"' in key else '"'
    place = f"what is wanted has its reason in models/{report.model}.toml: [[keep]]"
    return f"{place} finding = {quote}{key}{quote}, reason = …"


def _finding(finding: Finding, style: Style) -> list[str]:
    colour = FAINT if finding.kept else RED if finding.is_fault else YELLOW
    lines = style.wrap(f"{finding.kind}: {finding.message}", "  ")
    lines[0] = lines[0].replace(finding.kind, style.paint(finding.kind, colour), 1)
    label = finding.label
    if finding.difference:
        label += f" ({finding.difference:.1e})"
    lines += style.wrap(f"{label}; {_saving(finding.saving)}", "    ")
    if finding.proof:
        lines += style.wrap(f"because {finding.proof}", "    ")
    if finding.kept:
        return [*lines, *style.wrap(f"kept: {finding.kept}", "    ")]
    for edit in finding.edits[:_EDITS]:
        lines += _edit(edit, style)
    if len(finding.edits) > _EDITS:
        lines.append(f"    … and {len(finding.edits) - _EDITS} more changes")
    if finding.doubt:
        lines += style.wrap(f"no fault, as {finding.doubt}", "    ")
    elif finding.unfixed and finding.is_fault:
        lines += style.wrap(f"not for --fix: {finding.unfixed}", "    ")
    return lines


def _edit(edit: TextEdit, style: Style) -> list[str]:
    lines = [f"    {visible(edit.path)}:{edit.line}:{edit.column}"]
    for mark, text, colour in (("-", edit.old, RED), ("+", edit.new, GREEN)):
        text_lines = [line for line in text.splitlines() if line.strip()]
        for line in text_lines[:_LINES]:
            lines.append("    " + style.paint(f"{mark} {visible(line.strip())}", colour))
        if len(text_lines) > _LINES:
            lines.append(f"    {mark} … {plural(len(text_lines) - _LINES, 'more line')}")
    return lines


def _saving(saving: Saving) -> str:
    parts = []
    if saving.time is not None:
        speed = f"×{saving.time:.3g} as fast" if saving.certain else "no measurable time"
        parts.append(speed)
    for count, place in ((saving.memory, "memory"), (saving.text, "text")):
        if count:
            fewer = "fewer" if count > 0 else "more"
            parts.append(f"{abs(count):,} bytes of {place} {fewer}")
    return ", ".join(parts) or "saves nothing that is measured"
