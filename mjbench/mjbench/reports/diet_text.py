"""What a model could do without, as text for a terminal.

Findings stand by what they save. What saves less than 5 % is only counted, unless it is all that
there is to see: then too little would be said.
"""

from __future__ import annotations

from collections.abc import Iterator

from mjbench.reports.diet_report import (
    INTERFACE_LABEL,
    MEASURED_LABEL,
    DietReport,
    Finding,
    Saving,
    name_list,
)
from mjbench.reports.terminal import Style, count_text, printable

_EDITS, _LINES = 6, 6
"""The most changes that are shown of a finding, and the most lines of one."""
_WORTHWHILE = 1.05
"""The speedup below which a finding folds."""
_FOOTNOTE = (
    "integrator and timestep are judged against a reference, not against the model as it is: "
    "measure them with bench"
)


def diet_text(report: DietReport, command: str, declarations: str, style: Style) -> str:
    """A model; `command` looks at it, and `declarations` may say what is kept."""
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
    summary = [
        line for text in _summary(report, command, declarations) for line in style.wrap(text, "  ")
    ]
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
