"""What a report holds, and values as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.results import TrialLine
from coursebuild.core.scripts.sensitivity import Sensitivity
from coursebuild.core.text.diagnostics import Diagnostic, sort_diagnostics
from coursebuild.core.text.source import Span


class ScriptLine(Struct, frozen=True):
    """One script, as a report lists it."""

    path: str
    lesson: str
    """Id of its lesson; for a script of a page the page's id."""
    status: str
    """`ok`, `drift`, `diverged`, or how the run ended otherwise (`failed`, `timeout`, …)."""
    seconds: float
    cached: bool
    missing: tuple[str, ...] = ()
    unproven_outputs: int = 0
    """Outputs and figures that are recorded of a script that was not run."""
    unproven_numbers: int = 0
    unrepeated: bool = False
    """Whether what is recorded of it was recorded from its only run."""

    @property
    def did_run(self) -> bool:
        """Whether it was run, now or before."""
        return self.status not in ("skipped", "norun", "unrecorded")


class Summary(Struct, frozen=True):
    """The totals."""

    lessons: int
    scripts: int
    ran: int
    """Scripts with a result, new or remembered."""
    skipped: int
    errors: int
    warnings: int
    silenced: int
    seconds: float
    cached: int = 0
    """Those of `ran` whose result is remembered, so that they were not run again."""
    unproven: int = 0
    """Scripts that were not run, so that they prove nothing."""
    reasons: tuple[str, ...] = ()
    """What kept them from it: missing modules, `norun`."""
    unrepeated: int = 0
    """Scripts that were recorded from their only run."""
    hints: int = 0


class Report(Struct, frozen=True):
    """Everything that a command reports."""

    diagnostics: tuple[Diagnostic, ...]
    scripts: tuple[ScriptLine, ...]
    summary: Summary
    remarks: tuple[str, ...] = ()
    labs: tuple[TrialLine, ...] = ()
    depends: tuple[str, ...] | None = None
    """Files outside the course's own folders that the report depends on, absolute or relative to
    its root; `None` where they are not known."""
    sensitivity: tuple[Sensitivity, ...] | None = None
    """Which printed digits hold; `None` where that was not measured."""
    hints: tuple[Diagnostic, ...] = ()
    """What is likely a mistake, which changes nothing."""
    folder: str = ""
    """Where the course lies in the repository, for services that know only this: `lectures/`."""

    @property
    def ok(self) -> bool:
        """Whether there are no errors."""
        return all(not d.is_error for d in self.diagnostics)


def with_hints(report: Report) -> tuple[Diagnostic, ...]:
    """The diagnostics of a report with its hints among them, in their order."""
    return sort_diagnostics((*report.diagnostics, *report.hints))


def unchanged_report(report: Report, remark: str) -> Report:
    """Return the same report for a later run that found nothing changed."""
    return replace(
        report,
        scripts=tuple(replace(line, cached=True) for line in report.scripts),
        labs=tuple(replace(line, cached=True) for line in report.labs),
        summary=replace(report.summary, cached=report.summary.ran),
        remarks=(remark,),
    )


def plural(count: int, noun: str) -> str:
    """A count with its noun: `1 error`, `2 errors`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def unproven_things(line: ScriptLine) -> str:
    """What nothing proves because a script was not run: `1 output and 2 bound numbers`."""
    counts = ((line.unproven_outputs, "output"), (line.unproven_numbers, "bound number"))
    return " and ".join(plural(count, noun) for count, noun in counts if count)


def summary_line(report: Report) -> str:
    """One line that says what was checked and what was found."""
    s = report.summary
    parts = [plural(s.lessons, "lesson"), f"{plural(s.ran - s.cached, 'script')} run"]
    if s.cached:
        parts.append(f"{s.cached} cached")
    if report.labs:
        parts.append(f"{plural(len(report.labs), 'lab')} tried")
    counts = [plural(s.errors, "error")] if s.errors else []
    counts += [plural(s.warnings, "warning")] if s.warnings else []
    verdict = ", ".join(counts) if counts else "everything holds"
    if s.unproven:
        was = "was" if s.unproven == 1 else "were"
        unrun = f"{plural(s.unproven, 'script')} that {was} not run ({', '.join(s.reasons)})"
        verdict = f"{verdict}, and {unrun}" if counts else f"holds, but for {unrun}"
    if s.unrepeated:
        verdict += f"; {plural(s.unrepeated, 'script')} recorded, not yet repeated"
    silenced = f" ({s.silenced} silenced)" if s.silenced else ""
    return f"{', '.join(parts)}: {verdict}{silenced}"


# --- JSON


def json_text(value: object) -> str:
    """Return a value as JSON, ending in a newline."""
    return json.dumps(plain(value), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def plain(value: object, **names: str) -> Any:
    """Convert a value to what JSON holds; infinities and NaN to `None`.

    A struct becomes an object of its fields, some under other `names`; its `span` becomes a place.
    """
    match value:
        case Diagnostic():
            return {
                "rule": value.rule,
                "severity": value.severity,
                **place_fields(value.span),
                "message": value.message,
                "label": value.label,
                "help": value.help,
                "notes": plain(value.notes),
                "edits": plain(value.edits),
                "safe": value.safe,
            }
        case Struct():
            fields: dict[str, Any] = {}
            for name in value.__struct_fields__:
                field = getattr(value, name)
                fields |= (
                    place_fields(field) if name == "span" else {names.get(name, name): plain(field)}
                )
            return fields
        case Mapping():
            return {key: plain(item) for key, item in value.items()}
        case list() | tuple():
            return [plain(item) for item in value]
        case Enum():
            return value.value
        case float() if not math.isfinite(value):
            return None
        case _:
            return value


def place_fields(span: Span | None) -> dict[str, Any]:
    """The path, the lines and the columns of a span; all `None` where it is not known."""
    names = ("path", "line", "column", "end_line", "end_column")
    return {name: None if span is None else getattr(span, name) for name in names}
