"""What a report holds, and values as JSON."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping
from enum import Enum
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.results import TrialLine
from coursebuild.core.scripts.sensitivity import Sensitivity
from coursebuild.core.text.diagnostics import Diagnostic, sort_diagnostics
from coursebuild.core.text.source import Span

UNASKED = "unasked"
"""The status of what a command was not asked to run; it counts, and the terminal does not list it.
"""


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
    reasons: tuple[str, ...] = ()
    """What kept it from running: missing modules, `norun`, no runner."""

    @property
    def did_run(self) -> bool:
        """Whether it was run, now or before."""
        return not self.reasons


class Summary(Struct, frozen=True):
    """What a report comes to. Exit status and last line are both read from it."""

    lessons: int
    scripts: int
    ran: int
    """Scripts with a result, new or remembered."""
    failed: int
    """Scripts and labs that did not do what they should."""
    skipped: int
    tried: int
    """Labs that were tried."""
    untried: int
    errors: int
    warnings: int
    silenced: int
    seconds: float
    cached: int
    """Those of `ran` whose result is remembered, so that they were not run again."""
    unproven: int
    """Scripts that were not run, so that they prove nothing."""
    reasons: tuple[str, ...]
    """What kept scripts and labs from it: missing modules, `norun`."""
    unrepeated: int
    """Scripts that were recorded from their only run."""
    hints: int
    part: str
    """The part of the work that was done, as `2/8`; empty for all of it."""
    outdated: int
    """Files that are not what they would be after the command, which was only to say so."""

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong, so that the command succeeds."""
        return not (self.errors or self.failed or self.outdated)

    def verdict(self) -> str:
        """What was found, in words: all holds only where all was run and nothing is wrong."""
        counts = [plural(self.errors, "error")] if self.errors else []
        if self.failed and not self.errors:
            counts.append(f"{self.failed} failed")
        counts += [f"{plural(self.outdated, 'file')} to update"] if self.outdated else []
        counts += [plural(self.warnings, "warning")] if self.warnings else []
        left_out = [_were_not(self.unproven, "script", "run")] if self.unproven else []
        left_out += [_were_not(self.untried, "lab", "tried")] if self.untried else []
        exceptions = f"{' and '.join(left_out)} ({', '.join(self.reasons)})" if left_out else ""
        part = f"part {self.part} of the work" if self.part else ""
        if counts:
            text = ", ".join(counts) + (f" in {part}" if part else "")
            text += f", and {exceptions}" if exceptions else ""
        elif exceptions:
            text = f"{part} holds, but for {exceptions}".lstrip()
        else:
            assert self.ok, self
            text = f"{part or 'everything'} holds"
        if self.unrepeated:
            text += f"; {plural(self.unrepeated, 'script')} recorded, not yet repeated"
        return text + (f" ({self.silenced} silenced)" if self.silenced else "")


def _were_not(count: int, noun: str, done: str) -> str:
    return f"{plural(count, noun)} that {'was' if count == 1 else 'were'} not {done}"


class Report(Struct, frozen=True):
    """Everything that a command reports."""

    diagnostics: tuple[Diagnostic, ...]
    scripts: tuple[ScriptLine, ...]
    labs: tuple[TrialLine, ...] = ()
    lessons: int = 0
    """How many it is about."""
    silenced: int = 0
    """How many warnings the map silences."""
    seconds: float = 0.0
    remarks: tuple[str, ...] = ()
    part: str = ""
    """The part of the work that was done, as `2/8`; empty for all of it."""
    depends: tuple[str, ...] | None = None
    """Files outside the course's own folders that the report depends on, absolute or relative to
    its root; `None` where they are not known."""
    sensitivity: tuple[Sensitivity, ...] | None = None
    """Which printed digits hold; `None` where that was not measured."""
    hints: tuple[Diagnostic, ...] = ()
    """What is likely a mistake, which changes nothing."""
    outdated: int = 0
    """How many files a command would change that was only to say so."""
    folder: str = ""
    """Where the course lies in the repository, for services that know only this: `lectures/`."""

    @property
    def summary(self) -> Summary:
        """What its diagnostics, scripts and labs come to."""
        severities = Counter(d.severity for d in self.diagnostics)
        run_lines = [line for line in self.scripts if line.did_run]
        unrun = [line for line in self.scripts if not line.did_run]
        trial_lines = [line for line in self.labs if not line.untried]
        statuses = [*(line.status for line in run_lines), *(line.status for line in trial_lines)]
        untried = [line.untried for line in self.labs if line.untried]
        reasons = [*(reason for line in unrun for reason in line.reasons), *untried]
        return Summary(
            lessons=self.lessons,
            scripts=len(self.scripts),
            ran=len(run_lines),
            failed=sum(status != "ok" for status in statuses),
            skipped=sum(line.status == "skipped" for line in unrun),
            tried=len(trial_lines),
            untried=len(untried),
            errors=severities["error"],
            warnings=severities["warning"],
            silenced=self.silenced,
            seconds=self.seconds,
            cached=sum(line.cached for line in run_lines),
            unproven=len(unrun),
            reasons=tuple(dict.fromkeys(reasons)),
            unrepeated=sum(line.unrepeated for line in self.scripts),
            hints=len(self.hints),
            part=self.part,
            outdated=self.outdated,
        )

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return self.summary.ok


def with_hints(report: Report) -> tuple[Diagnostic, ...]:
    """The diagnostics of a report with its hints among them, in their order."""
    return sort_diagnostics((*report.diagnostics, *report.hints))


def unchanged_report(report: Report, remark: str) -> Report:
    """Return the same report for a later run that found nothing changed."""
    return replace(
        report,
        scripts=tuple(replace(line, cached=True) for line in report.scripts),
        labs=tuple(replace(line, cached=True) for line in report.labs),
        remarks=(remark,),
    )


def plural(count: int, noun: str) -> str:
    """A count with its noun: `1 error`, `2 errors`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def unproven_things(line: ScriptLine) -> str:
    """What nothing proves because a script was not run: `1 output and 2 bound numbers`."""
    counts = ((line.unproven_outputs, "output"), (line.unproven_numbers, "bound number"))
    return " and ".join(plural(count, noun) for count, noun in counts if count)


def unrun_reason(line: ScriptLine) -> str:
    """Why a script was not run: `needs torch`, or what its fence or the course says."""
    return f"needs {', '.join(line.missing)}" if line.missing else ", ".join(line.reasons)


def summary_line(report: Report) -> str:
    """One line that says what was checked and what was found."""
    s = report.summary
    parts = [plural(s.lessons, "lesson"), f"{plural(s.ran - s.cached, 'script')} run"]
    if s.cached:
        parts.append(f"{s.cached} cached")
    if s.tried:
        parts.append(f"{plural(s.tried, 'lab')} tried")
    return f"{', '.join(parts)}: {s.verdict()}"


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
