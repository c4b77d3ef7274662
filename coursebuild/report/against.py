"""What scripts do with another version of MuJoCo: values, and as text and JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from msgspec import Struct

from coursebuild.core.model.results import Change
from coursebuild.core.scripts.findings import describe_difference
from coursebuild.core.text.characters import printable, printable_lines
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.report.text import BOLD, FAINT, GREEN, RED, YELLOW, Style, location
from coursebuild.report.values import json_text, plain, plural

_STATUSES = {
    "same": "the same",
    "changed": "changed by MuJoCo {}",
    "fails": "failing with MuJoCo {}",
    "unclear": "different for an unclear reason",
    "drifted": "drifted already",
    "uncompared": "not compared",
}
"""In words, to which the other version is given."""
_COLOURS = {"same": GREEN, "changed": RED, "fails": RED}
_MOST_CHANGES = 20
"""Differences of one script that are listed."""


class ScriptComparison(Struct, frozen=True):
    """What a script does with the other version."""

    path: str
    lesson: str
    status: str
    """`same`, `changed`, `fails` (both by MuJoCo), `unclear`, `drifted` or `uncompared`."""
    reason: str = ""
    """Why it has one of the last three, as a clause."""
    changes: tuple[Change, ...] = ()
    diff: str = ""
    failure: Diagnostic | None = None


class ModelLine(Struct, frozen=True):
    """A model or MJCF block that compiles here."""

    path: str
    line: int
    error: str
    """What the other version says; empty where it compiles there too."""


class ComparisonReport(Struct, frozen=True):
    """What scripts and models do with the other version."""

    engine: str
    version: str
    python: str
    scripts: tuple[ScriptComparison, ...]
    models: tuple[ModelLine, ...]
    names: tuple[Diagnostic, ...] = ()
    """Names in the text that the other version has lost or deprecated."""


def comparison_json(report: ComparisonReport) -> str:
    """As one JSON object."""
    lost = sum(bool(model.error) for model in report.models)
    return json_text(
        {
            **plain(report, version="against"),
            "scripts": [
                {
                    **plain(script, reason="why"),
                    "by_mujoco": script.status in ("changed", "fails"),
                    "changes": [plain(change) for change in script.changes],
                    "failure": None
                    if script.failure is None
                    else {**plain(script.failure), "said": script.failure.label},
                }
                for script in report.scripts
            ],
            "names": [plain(name) for name in report.names],
            "summary": {
                **_count(report.scripts),
                "models_lost": lost,
                "names_lost": len(report.names),
            },
        }
    )


def comparison_text(report: ComparisonReport, style: Style, *, quiet: bool = False) -> str:
    """As text: what changed first, then the rest, unless `quiet` and the same, and the sums."""
    differing = [s for s in report.scripts if s.changes or s.diff or s.failure is not None]
    parts = ["\n".join(_script(s, report.version, style)) + "\n" for s in differing]
    lines = [
        f"{_verdict(s, style)} {printable(s.path)}{_because(s)}"
        for s in report.scripts
        if s not in differing and not (quiet and s.status == "same")
    ]
    lost = [model for model in report.models if model.error]
    lines += [
        f"{style.paint('fails     ', RED)} {printable(m.path)}:{m.line}"
        f"  no longer compiles: {printable(m.error)}"
        for m in lost
    ]
    lines += [
        f"{style.paint('lost      ', RED)} {location(name.span)}  {printable(name.message)}"
        for name in report.names
    ]
    if lines:
        parts.append("".join(f"{line}\n" for line in lines))
    counts = (
        f"{count} {_STATUSES[status].format(report.version)}"
        for status, count in _count(report.scripts).items()
        if count
    )
    sums = ", ".join(counts) or "nothing to compare"
    total = f"{plural(len(report.scripts), 'script')}: {sums}"
    if report.models:
        texts = plural(len(report.models), "MJCF text")
        verb = "compiles" if len(report.models) == 1 else "compile"
        total += f"; {len(report.models) - len(lost)} of {texts} {verb} there"
    head = f"MuJoCo {report.version} against {report.engine}, Python {report.python}"
    parts.append(f"{head}: {total}\n")
    return "\n".join(parts)


def _because(script: ScriptComparison) -> str:
    return f"  ({printable(script.reason)})" if script.reason else ""


def _verdict(script: ScriptComparison, style: Style) -> str:
    return style.paint(f"{script.status:<10}", _COLOURS.get(script.status, YELLOW))


def _script(script: ScriptComparison, version: str, style: Style) -> list[str]:
    """A script that does something else there."""
    engine = f"MuJoCo {version}"
    cause = _because(script) or f"  by {engine}"
    lines = [f"{_verdict(script, style)} {style.paint(printable(script.path), BOLD)}{cause}"]
    if script.failure is not None:
        span, message = script.failure.span, script.failure.message
        label = f": {script.failure.label}" if script.failure.label else ""
        lines.append(printable(f"  {span.path}:{span.line}: {message}{label}"))
    changes = sorted(script.changes, key=lambda change: (change.span.path, change.span.start))
    for change in changes[:_MOST_CHANGES]:
        text = describe_difference(change, engine)
        lines.append(printable(f"  {location(change.span)}: {text}"))
    if len(changes) > _MOST_CHANGES:
        lines.append(f"  and {plural(len(changes) - _MOST_CHANGES, 'more difference')}")
    if script.diff:
        diff = printable_lines(f"--- here\n+++ {engine}\n{script.diff}")
        lines += [style.paint(f"  {line}", FAINT) for line in diff.split("\n")]
    return lines


def _count(scripts: Iterable[ScriptComparison]) -> dict[str, int]:
    counts = Counter(script.status for script in scripts)
    return {status: counts[status] for status in _STATUSES}
