"""What scripts do with another version of MuJoCo: values, and as text and JSON.

Entry points: `AgainstReport`, `against_text`, `against_json`.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct

from coursebuild.core.model.results import Change, DriftKind
from coursebuild.core.scripts.diff import shorten
from coursebuild.core.scripts.findings import closeness
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.report.terminal import (
    BOLD,
    FAINT,
    GREEN,
    RED,
    YELLOW,
    Style,
    visible,
    visible_lines,
)
from coursebuild.report.text import location
from coursebuild.report.values import json_text, plain, plural

_COLOURS = {"same": GREEN, "changed": RED, "fails": RED}
_NAMED = 20
_WIDTH = 60


class ScriptAgainst(Struct, frozen=True):
    """One script."""

    path: str
    lesson: str
    """Id of its lesson or page."""
    status: str
    """`same`, `changed`, `fails` (both by MuJoCo), `unclear`, `drifted` or `uncompared`."""
    why: str = ""
    """For the last three, a clause."""
    changes: tuple[Change, ...] = ()
    diff: str = ""
    failure: Diagnostic | None = None
    """How it failed with the other version."""


class ModelLine(Struct, frozen=True):
    """A model or MJCF block that compiles here."""

    path: str
    line: int
    error: str
    """What the other version says; empty where it compiles there too."""


class AgainstReport(Struct, frozen=True):
    """All of a comparison."""

    engine: str
    """The version of MuJoCo here."""
    other: str
    python: str
    scripts: tuple[ScriptAgainst, ...]
    models: tuple[ModelLine, ...]


def against_json(report: AgainstReport) -> str:
    """As one JSON object."""
    lost = sum(bool(model.error) for model in report.models)
    return json_text(
        {
            **plain(report, other="against"),
            "scripts": [_script_value(script) for script in report.scripts],
            "summary": {**_counts(report.scripts), "models_lost": lost},
        }
    )


_STATUSES = ("same", "changed", "fails", "unclear", "drifted", "uncompared")


def _script_value(script: ScriptAgainst) -> dict[str, object]:
    failure = script.failure
    return {
        **plain(script),
        "by_mujoco": script.status in ("changed", "fails"),
        "changes": [plain(change) for change in script.changes],
        "failure": None if failure is None else {**plain(failure), "said": failure.label},
    }


def against_text(report: AgainstReport, style: Style, *, quiet: bool = False) -> str:
    """As text: what changed first, number by number, then the rest and the sums.

    `quiet`: without the scripts that do the same.
    """
    told = [s for s in report.scripts if s.changes or s.diff or s.failure is not None]
    parts = ["\n".join(_script(s, report.other, style)) + "\n" for s in told]
    lines = [
        f"{_verdict(s, style)} {visible(s.path)}{_because(s)}"
        for s in report.scripts
        if s not in told and not (quiet and s.status == "same")
    ]
    lost = [model for model in report.models if model.error]
    lines += [
        f"{style.paint('fails     ', RED)} {visible(m.path)}:{m.line}"
        f"  no longer compiles: {visible(m.error)}"
        for m in lost
    ]
    if lines:
        parts.append("".join(f"{line}\n" for line in lines))
    parts.append(_sum(report, len(lost)) + "\n")
    return "\n".join(parts)


def _because(script: ScriptAgainst) -> str:
    return f"  ({visible(script.why)})" if script.why else ""


def _verdict(script: ScriptAgainst, style: Style) -> str:
    return style.paint(f"{script.status:<10}", _COLOURS.get(script.status, YELLOW))


def _script(script: ScriptAgainst, other: str, style: Style) -> list[str]:
    """A script that does something else there."""
    who = f"MuJoCo {other}"
    told = _because(script) or f"  by {who}"
    lines = [f"{_verdict(script, style)} {style.paint(visible(script.path), BOLD)}{told}"]
    if script.failure is not None:
        span, message = script.failure.span, script.failure.message
        said = f": {script.failure.label}" if script.failure.label else ""
        lines.append(visible(f"  {span.path}:{span.line}: {message}{said}"))
    named = sorted(script.changes, key=lambda change: (change.span.path, change.span.start))
    for change in named[:_NAMED]:
        lines.append(visible(f"  {location(change.span)}: {_change(change, who)}"))
    if len(named) > _NAMED:
        lines.append(f"  and {plural(len(named) - _NAMED, 'more difference')}")
    if script.diff:
        diff = visible_lines(f"--- here\n+++ {who}\n{script.diff}")
        lines += [style.paint(f"  {line}", FAINT) for line in diff.split("\n")]
    return lines


def _change(change: Change, who: str) -> str:
    recorded, printed = (_shown(text) for text in (change.recorded, change.printed))
    told = closeness(change)
    match change.kind:
        case DriftKind.ROUNDING | DriftKind.NUMERIC:
            return f"recorded {recorded}; {who} printed {printed}{told and f' ({told})'}"
        case DriftKind.TEXT:
            return f"recorded `{recorded}`; {who} printed `{printed}`"
        case DriftKind.MISSING:
            lines = change.recorded.count("\n") + 1
            return f"{who} did not print {plural(lines, 'line')} from `{recorded}` on"
        case DriftKind.EXTRA:
            lines = change.printed.count("\n") + 1
            return f"{who} printed {plural(lines, 'more line')} here: `{printed}`"


def _shown(text: str) -> str:
    return shorten(text.strip().split("\n")[0], _WIDTH)


def _sum(report: AgainstReport, lost: int) -> str:
    counts = _counts(report.scripts)
    words = {
        "same": "the same",
        "changed": f"changed by MuJoCo {report.other}",
        "fails": f"failing with MuJoCo {report.other}",
        "unclear": "different for a reason that is not clear",
        "drifted": "drifted already",
        "uncompared": "not compared",
    }
    told = [f"{counts[status]} {words[status]}" for status in _STATUSES if counts[status]]
    lines = f"{plural(len(report.scripts), 'script')}: {', '.join(told) or 'nothing to compare'}"
    if report.models:
        texts = plural(len(report.models), "MJCF text")
        verb = "compiles" if len(report.models) == 1 else "compile"
        lines += f"; {len(report.models) - lost} of {texts} {verb} there"
    head = f"MuJoCo {report.other} against {report.engine}, Python {report.python}"
    return f"{head}: {lines}"


def _counts(scripts: Iterable[ScriptAgainst]) -> dict[str, int]:
    counts = dict.fromkeys(_STATUSES, 0)
    for script in scripts:
        counts[script.status] += 1
    return counts
