"""What a report holds, and values as JSON has them.

Entry points: `Report`; `summary_line(report)`, its last line as text; `plain`, `json_text`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.results import TrialLine
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Span

if TYPE_CHECKING:
    from coursebuild.core.model.sensitivity import Sensitivity


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
    """For a skipped one: the modules that are not there."""


class Summary(Struct, frozen=True):
    """The totals."""

    lessons: int
    scripts: int
    ran: int
    """Scripts with a result, of now or of before."""
    skipped: int
    errors: int
    warnings: int
    silenced: int
    seconds: float
    cached: int = 0
    """Of `ran`: those whose result is remembered, so that they were not run again."""


class Report(Struct, frozen=True):
    """Everything that one command found."""

    diagnostics: tuple[Diagnostic, ...]
    scripts: tuple[ScriptLine, ...]
    summary: Summary
    remarks: tuple[str, ...] = ()
    """What was done, a line each, such as the files written."""
    labs: tuple[TrialLine, ...] = ()
    depends: tuple[str, ...] | None = None
    """Files that all of this depends on beside those in the course's own folders, absolute or
    relative to its root; `None` where they are not known."""

    sensitivity: tuple[Sensitivity, ...] | None = None
    """Which printed digits hold; `None` where nobody asked."""

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong (warnings do not count)."""
        return all(not d.is_error for d in self.diagnostics)


def unchanged_report(report: Report, remark: str) -> Report:
    """The same report, for a later run that found nothing changed and ran nothing."""
    return replace(
        report,
        scripts=tuple(replace(line, cached=True) for line in report.scripts),
        labs=tuple(replace(line, cached=True) for line in report.labs),
        summary=replace(report.summary, cached=report.summary.ran),
        remarks=(remark,),
    )


def plural(count: int, noun: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def summary_line(report: Report) -> str:
    """One line: what was checked and what was found."""
    s = report.summary
    parts = [plural(s.lessons, "lesson"), f"{plural(s.ran - s.cached, 'script')} run"]
    if s.cached:
        parts.append(f"{s.cached} cached")
    if report.labs:
        parts.append(f"{plural(len(report.labs), 'lab')} tried")
    if s.skipped:
        parts.append(f"{s.skipped} skipped")
    found = [plural(s.errors, "error")] if s.errors else []
    found += [plural(s.warnings, "warning")] if s.warnings else []
    verdict = ", ".join(found) if found else "everything holds"
    silenced = f" ({s.silenced} silenced)" if s.silenced else ""
    return f"{', '.join(parts)}: {verdict}{silenced}"


# --- JSON


def json_text(value: object) -> str:
    """A value as JSON, ending in a newline."""
    return json.dumps(plain(value), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def plain(value: object, **names: str) -> Any:
    """A value as dictionaries, lists, texts and numbers; what is no finite number is `None`.

    A struct is an object of its fields, under other names where `names` has some. Its `span` are
    the path, the line and the columns, as fields of the object itself.
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
            return {key: plain(one) for key, one in value.items()}
        case list() | tuple():
            return [plain(one) for one in value]
        case Enum():
            return value.value
        case float() if not math.isfinite(value):
            return None
        case _:
            return value


def place_fields(span: Span | None) -> dict[str, Any]:
    """Where something stands; all `None` where that is not known."""
    if span is None:
        return dict.fromkeys(("path", "line", "column", "end_line", "end_column"))
    return {
        "path": span.path,
        "line": span.line,
        "column": span.column,
        "end_line": span.end_line,
        "end_column": span.end_column,
    }
