"""The scene diet as text for people.

Entry points: `diet_text(reports, style)`; `diet_values(reports)`, for JSON.

A finding is told with its label, what it saves, where it is, and the change itself; what was tried
and is needed is told in a line.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.numerics.reports.diet import DietReport, Finding, Saving, TextEdit, name_list
from coursebuild.report.terminal import BOLD, FAINT, GREEN, RED, YELLOW, Style, visible
from coursebuild.report.values import plain, plural

_EDITS = 6
"""Changes that are shown of a finding."""
_LINES = 6
"""Lines that are shown of what a change takes out."""
_JUDGED = (
    "integrator and timestep are judged against a reference, not against the model as it is: "
    "see `coursebuild bench`"
)


def diet_values(reports: Sequence[DietReport]) -> dict[str, object]:
    """Everything that was found, and for each model whether nothing is left to be done."""
    return {"models": [plain(one) | {"ok": one.ok} for one in reports]}


def diet_text(reports: Sequence[DietReport], style: Style) -> str:
    """Every model with its findings, a blank line between; empty where there is none."""
    if not reports:
        return ""
    judged = "".join(line + "\n" for line in style.wrap(_JUDGED, "", FAINT))
    return "\n".join([*(_model(one, style) for one in reports), judged])


def _model(report: DietReport, style: Style) -> str:
    head = style.paint(visible(report.model), BOLD)
    if report.quick:
        head += "  " + style.paint("quick: short runs, rough times", YELLOW)
    lines = [head]
    tried = [one.name for one in report.scenarios if one.status == "ok"]
    lines += style.wrap(f"in {name_list(tried)}" if tried else "in no scenario", "  ")
    for one in report.scenarios:
        if one.status != "ok":
            why = "; ".join(one.reasons)
            told = f"scenario {one.name}: {one.status}: {why}; nothing is claimed from it"
            lines += style.wrap(told, "  ", RED)
    for finding in report.findings:
        lines += ["", *_finding(finding, style)]
    for stale in report.stale:
        place = f"{stale.path}:{stale.line}:{stale.column}"
        told = f"`{stale.finding}` keeps nothing any more: take the entry out ({place})"
        lines += ["", *style.wrap(told, "  ", RED)]
    lines += ["", *_summary(report, style)]
    return "\n".join(lines) + "\n"


def _summary(report: DietReport, style: Style) -> list[str]:
    open_ones = [one for one in report.findings if one.is_fault]
    fixable = [one for one in open_ones if one.fixable]
    lines: list[str] = []
    if not report.ok:
        said = plural(len(open_ones), "finding") + " not explained"
        if fixable:
            said += f", {len(fixable)} of them for `coursebuild diet {report.model} --fix`"
        lines += style.wrap(said, "  ", RED)
        lines += style.wrap(_keep(report, open_ones), "  ", FAINT)
    else:
        lines.append("  " + style.paint("nothing in it is in vain", GREEN))
    if report.slim is not None and len(open_ones) > 1:
        lines += style.wrap(f"without all of them: {_saving(report.slim)}", "  ")
    if report.fixed is not None and len(fixable) > 1 and len(fixable) < len(open_ones):
        lines += style.wrap(f"after --fix: {_saving(report.fixed)}", "  ")
    by_reason: dict[str, list[str]] = {}
    for one in report.tried:
        by_reason.setdefault(one.reason, []).append(one.kind)
    for reason, kinds in by_reason.items():
        shown = name_list(list(dict.fromkeys(kinds)))
        told = f"not found, because {reason}" if reason else "tried and needed"
        lines += style.wrap(f"{told}: {shown}", "  ", FAINT)
    return lines


def _keep(report: DietReport, found: Sequence[Finding]) -> str:
    """How to keep the first of the findings."""
    if not found:
        return ""
    first = found[0]
    name = first.places[0].name if len(first.places) == 1 else ""
    key = f"{first.kind} {name}".strip()
    quote = "'" if '"' in key else '"'
    told = f"what is wanted has its reason in models/{report.model}.toml: [[keep]]"
    return f"{told} finding = {quote}{key}{quote}, reason = …"


def _finding(one: Finding, style: Style) -> list[str]:
    colour = FAINT if one.kept else RED if one.is_fault else YELLOW
    lines = style.wrap(f"{one.kind}: {one.message}", "  ")
    lines[0] = lines[0].replace(one.kind, style.paint(one.kind, colour), 1)
    label = one.label
    if one.difference:
        label += f" ({one.difference:.1e})"
    lines += style.wrap(f"{label}; {_saving(one.saving)}", "    ")
    if one.proof:
        lines += style.wrap(f"because {one.proof}", "    ")
    if one.kept:
        return [*lines, *style.wrap(f"kept: {one.kept}", "    ")]
    for edit in one.edits[:_EDITS]:
        lines += _edit(edit, style)
    if len(one.edits) > _EDITS:
        lines.append(f"    … and {len(one.edits) - _EDITS} more changes")
    if one.doubt:
        lines += style.wrap(f"no fault, as {one.doubt}", "    ")
    elif one.unfixed and one.is_fault:
        lines += style.wrap(f"not for --fix: {one.unfixed}", "    ")
    return lines


def _edit(edit: TextEdit, style: Style) -> list[str]:
    lines = [f"    {visible(edit.path)}:{edit.line}:{edit.column}"]
    for mark, text, colour in (("-", edit.old, RED), ("+", edit.new, GREEN)):
        shown = [line for line in text.splitlines() if line.strip()]
        for line in shown[:_LINES]:
            lines.append("    " + style.paint(f"{mark} {visible(line.strip())}", colour))
        if len(shown) > _LINES:
            lines.append(f"    {mark} … {plural(len(shown) - _LINES, 'more line')}")
    return lines


def _saving(saving: Saving) -> str:
    parts = []
    if saving.time is not None:
        sure = f"×{saving.time:.3g} as fast" if saving.certain else "no measurable time"
        parts.append(sure)
    for count, where in ((saving.memory, "memory"), (saving.text, "text")):
        if count:
            fewer = "fewer" if count > 0 else "more"
            parts.append(f"{abs(count):,} bytes of {where} {fewer}")
    return ", ".join(parts) or "saves nothing that is measured"
