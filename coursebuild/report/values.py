"""What a report holds.

Entry point: `Report`; `summary_line(report)` is its last line as text.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.text.diagnostics import Diagnostic, Severity

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


class LabLine(Struct, frozen=True):
    """One lab, as a report lists it."""

    name: str
    title: str
    lesson: str
    status: str
    """`ok` or `failed`."""
    seconds: float
    """Wall time of its trial."""
    steps_per_second: int | None
    tried: int
    """How many things were tried."""
    parity: str
    """How it compares with native MuJoCo, in words."""
    cached: bool
    unexported: str = ""
    """Why its page offers no Python script, in words."""


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
    labs: tuple[LabLine, ...] = ()
    depends: tuple[str, ...] | None = None
    """Files that all of this depends on beside those in the course's own folders, absolute or
    relative to its root; `None` where they are not known."""

    sensitivity: tuple[Sensitivity, ...] | None = None
    """Which printed digits hold; `None` where nobody asked."""

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong (warnings do not count)."""
        return all(d.severity is not Severity.ERROR for d in self.diagnostics)


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
