"""The scene diet as text for people and as JSON.

Entry points: `diet_text(reports, style)`, `diet_report`, `diet_values` (JSON).

A finding is told with its label, what it saves, where it is, and the change itself; what was tried
and is needed is told in a line.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence

import msgspec

from coursebuild.diagnostics import Diagnostic
from coursebuild.numerics.reports.diet import IDENTICAL, DietReport, Finding, Saving, TextEdit
from coursebuild.numerics.reports.records import Failure
from coursebuild.report.checked import failure_text
from coursebuild.report.text import Style, diagnostic_text, visible
from coursebuild.report.values import plural

_BOLD, _RED, _YELLOW, _GREEN, _FAINT = "1", "1;31", "1;33", "32", "2"
_NAMES = 6
"""Names that a message lists."""
_EDITS = 6
"""Changes that are shown of a finding."""
_LINES = 6
"""Lines that are shown of what a change takes out."""
_JUDGED = (
    "integrator and timestep are judged against a reference, not against the model as it is: "
    "see `coursebuild bench`"
)


def diet_report(
    reports: Sequence[DietReport],
    diagnostics: Sequence[Diagnostic],
    failures: Sequence[Failure],
    remarks: Sequence[str],
    style: Style,
) -> str:
    """As text: what is wrong first, then what was found."""
    parts = [diagnostic_text(one, style) + "\n" for one in diagnostics]
    parts += [failure_text(one, style) for one in failures]
    if reports:
        parts.append(diet_text(reports, style))
    if remarks:
        parts.append("".join(visible(one) + "\n" for one in remarks))
    return "\n".join(parts) or "there is no model to look at\n"


def diet_values(
    reports: Sequence[DietReport],
    diagnostics: Sequence[Diagnostic],
    failures: Sequence[Failure],
    remarks: Sequence[str],
) -> str:
    """As one JSON object."""
    value = {
        "models": [msgspec.to_builtins(one) | {"ok": one.ok} for one in reports],
        "diagnostics": [
            {
                "rule": one.rule,
                "message": one.message,
                "path": one.span.path,
                "line": one.span.line,
                "column": one.span.column,
                "help": one.help,
            }
            for one in diagnostics
        ],
        "failures": [msgspec.to_builtins(one) for one in failures],
        "remarks": list(remarks),
    }
    return json.dumps(value, ensure_ascii=True, indent=2, allow_nan=False) + "\n"


def diet_text(reports: Sequence[DietReport], style: Style) -> str:
    """Every model with its findings, a blank line between."""
    judged = "".join(line + "\n" for line in _painted(_JUDGED, style, "", _FAINT))
    return "\n".join([*(_model(one, style) for one in reports), judged])


def _model(report: DietReport, style: Style) -> str:
    lines = [style.paint(visible(report.model), _BOLD) + _quick(report, style)]
    tried = [one.name for one in report.scenarios if one.status == "ok"]
    lines += _wrapped(f"in {_listed(tried)}" if tried else "in no scenario", style, "  ")
    for one in report.scenarios:
        if one.status != "ok":
            why = "; ".join(one.reasons)
            told = f"scenario {one.name}: {one.status}: {why}; nothing is claimed from it"
            lines += _painted(told, style, "  ", _RED)
    for finding in report.findings:
        lines += ["", *_finding(finding, style)]
    for stale in report.stale:
        place = f"{stale.path}:{stale.line}:{stale.column}"
        told = f"`{stale.finding}` keeps nothing any more: take the entry out ({place})"
        lines += ["", *_painted(told, style, "  ", _RED)]
    lines += ["", *_summary(report, style)]
    return "\n".join(lines) + "\n"


def _quick(report: DietReport, style: Style) -> str:
    return "  " + style.paint("quick: short runs, rough times", _YELLOW) if report.quick else ""


def _summary(report: DietReport, style: Style) -> list[str]:
    open_ones = [one for one in report.findings if one.counts]
    fixable = [one for one in open_ones if one.fixable]
    lines: list[str] = []
    if not report.ok:
        said = plural(len(open_ones), "finding") + " not explained"
        if fixable:
            said += f", {len(fixable)} of them for `coursebuild diet {report.model} --fix`"
        lines += _painted(said, style, "  ", _RED)
        lines += _faint(_keep(report, open_ones), style)
    else:
        lines.append("  " + style.paint("nothing in it is in vain", _GREEN))
    if report.slim is not None and len(open_ones) > 1:
        lines += _wrapped(f"without all of them: {_saving(report.slim)}", style, "  ")
    if report.fixed is not None and len(fixable) > 1 and len(fixable) < len(open_ones):
        lines += _wrapped(f"after --fix: {_saving(report.fixed)}", style, "  ")
    by_reason: dict[str, list[str]] = {}
    for one in report.tried:
        by_reason.setdefault(one.reason, []).append(one.kind)
    for reason, kinds in by_reason.items():
        shown = _listed(list(dict.fromkeys(kinds)))
        told = f"not found, because {reason}" if reason else "tried and needed"
        lines += _faint(f"{told}: {shown}", style)
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
    colour = _FAINT if one.kept else _RED if one.counts else _YELLOW
    lines = _wrapped(f"{style.paint(one.kind, colour)}: {visible(one.message)}", style, "  ")
    label = one.label
    if one.label != IDENTICAL and one.difference:
        label += f" ({one.difference:.1e})"
    lines += _wrapped(f"{label}; {_saving(one.saving)}", style, "    ")
    if one.proof:
        lines += _wrapped(f"because {one.proof}", style, "    ")
    if one.kept:
        return [*lines, *_wrapped(f"kept: {one.kept}", style, "    ")]
    for edit in one.edits[:_EDITS]:
        lines += _edit(edit, style)
    if len(one.edits) > _EDITS:
        lines.append(f"    … and {len(one.edits) - _EDITS} more changes")
    if one.doubt:
        lines += _wrapped(f"no fault, as {one.doubt}", style, "    ")
    elif one.unfixed and one.counts:
        lines += _wrapped(f"not for --fix: {one.unfixed}", style, "    ")
    return lines


def _edit(edit: TextEdit, style: Style) -> list[str]:
    lines = [f"    {visible(edit.path)}:{edit.line}:{edit.column}"]
    for mark, text, colour in (("-", edit.old, _RED), ("+", edit.new, _GREEN)):
        shown = [line for line in text.splitlines() if line.strip()]
        for line in shown[:_LINES]:
            lines.append("    " + style.paint(f"{mark} {visible(line.strip())}", colour))
        if len(shown) > _LINES:
            lines.append(f"    {mark} … {plural(len(shown) - _LINES, 'more line')}")
    return lines


def _saving(saving: Saving) -> str:
    parts = []
    if saving.time is not None:
        sure = f"×{saving.time:.3g} as fast" if saving.certain else "no time that can be told"
        parts.append(sure)
    for count, where in ((saving.memory, "memory"), (saving.text, "text")):
        if count:
            fewer = "fewer" if count > 0 else "more"
            parts.append(f"{abs(count):,} bytes of {where} {fewer}")
    return ", ".join(parts) or "saves nothing that is measured"


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_NAMES])
    more = len(names) - _NAMES
    return shown + (f" and {more} more" if more > 0 else "")


def _faint(text: str, style: Style) -> list[str]:
    return _painted(text, style, "  ", _FAINT)


def _painted(text: str, style: Style, indent: str, colour: str) -> list[str]:
    return [style.paint(line, colour) for line in _wrapped(visible(text), style, indent)]


def _wrapped(text: str, style: Style, indent: str) -> list[str]:
    return textwrap.wrap(
        text,
        max(style.width, 40),
        initial_indent=indent,
        subsequent_indent=indent + "  ",
        break_long_words=False,
        break_on_hyphens=False,
    )
