"""An output that differs from one run to the next.

Entry point: `unstable`.
"""

from __future__ import annotations

from coursebuild.diagnostics import Diagnostic, Note, diagnose
from coursebuild.model import Comparison, Recording, Table
from coursebuild.scripts.align import Step, StepKind, align
from coursebuild.scripts.difftext import shortened
from coursebuild.scripts.lines import LineMatcher
from coursebuild.scripts.traced import Side

_NAMED = 10
_WIDTH = 80


def unstable(recording: Recording, first: Side, second: Side, comparison: Comparison) -> Diagnostic:
    """Names the lines that differ between two runs.

    `first` is what would be recorded, or is, and matches the first run.
    """
    steps = align(first, second, LineMatcher(comparison))
    line_starts = second.line_starts()
    lines: list[str] = []
    for step in steps:
        text = _difference(step, first, second, line_starts)
        if text:
            lines.append(text)
    notes = [Note(text) for text in lines[:_NAMED]]
    if len(lines) > _NAMED:
        more = len(lines) - _NAMED
        notes.append(Note(f"and {more} more {'line' if more == 1 else 'lines'}"))
    return diagnose(
        "output-unstable",
        recording.caption_span,
        "two runs of the script printed different lines",
        help=_TABLE_HELP if isinstance(recording.body, Table) else _HELP,
        notes=notes,
    )


_REPEATABLE = "make the script print the same each time (a fixed seed, no clock)"
_HELP = (
    f"{_REPEATABLE}, put `volatile` on the fence, elide what varies by `ellipsis` and `...`,"
    " or filter it by `[[verify.filter]]` in content/course.toml"
)
_TABLE_HELP = f"{_REPEATABLE}, or record the output in a `text` fence with `volatile`"


def _difference(step: Step, first: Side, second: Side, line_starts: list[int]) -> str:
    match step.kind:
        case StepKind.DIFFERS:
            number = second.raw_line(step.ran, line_starts)
            a, b = first.lines[step.recorded].text, second.lines[step.ran].text
            return f"line {number}: {_quoted(a)} in one run, {_quoted(b)} in the next"
        case StepKind.MISSING:
            return f"{_quoted(first.lines[step.recorded].text)} was printed in the first run only"
        case StepKind.EXTRA:
            return f"{_quoted(second.lines[step.ran].text)} was printed in the second run only"
        case StepKind.SAME | StepKind.ELLIPSIS | StepKind.ELIDED:
            return ""


def _quoted(text: str) -> str:
    return f"`{shortened(text.strip(), _WIDTH)}`"
