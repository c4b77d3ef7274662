"""The unified diff of a recorded output against a run, kept to a readable size.

Entry point: `diff_text`. Lines that match under the comparison's mode are context, as recorded,
even where their characters differ; lines that a `...` stands for are left out.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from coursebuild.scripts.align import Step, StepKind
from coursebuild.scripts.traced import Side

_CONTEXT = 2
_LINES = 40
_WIDTH = 160


class _Row(Struct, frozen=True):
    mark: str
    text: str
    recorded: int
    ran: int


def shortened(text: str, width: int) -> str:
    """The text, cut to a width with an ellipsis sign at its end."""
    return text if len(text) <= width else text[: width - 1] + "…"


def diff_text(steps: Sequence[Step], recorded: Side, ran: Side) -> str:
    """The diff with two lines of context, at most 40 lines of at most 160 characters."""
    lines: list[str] = []
    more = 0
    for chunk in _chunks(steps):
        rows = [row for step in chunk for row in _rows(step, recorded, ran)]
        # All that goes comes before all that comes, as far as no common line lies between.
        rows = _sorted_rows(rows)
        header = _header(rows)
        for line in (header, *(row.mark + shortened(row.text, _WIDTH) for row in rows)):
            if len(lines) < _LINES:
                lines.append(line)
            else:
                more += 1
    if more:
        lines.append(f"… and {more} more lines")
    return "\n".join(("--- recorded", "+++ this run", *lines)) if lines else ""


def _chunks(steps: Sequence[Step]) -> list[list[Step]]:
    """Stretches of steps around changes, with their context."""
    changed = (StepKind.DIFFERS, StepKind.MISSING, StepKind.EXTRA)
    shown: set[int] = set()
    for index, step in enumerate(steps):
        if step.kind in changed:
            shown.add(index)
            for way in (-1, 1):
                near = index + way
                while (
                    0 <= near < len(steps)
                    and abs(near - index) <= _CONTEXT
                    and steps[near].kind is StepKind.SAME
                ):
                    shown.add(near)
                    near += way
    chunks: list[list[Step]] = []
    for index in sorted(shown):
        if index - 1 not in shown:
            chunks.append([])
        chunks[-1].append(steps[index])
    return chunks


def _rows(step: Step, recorded: Side, ran: Side) -> list[_Row]:
    i, j = step.recorded, step.ran
    match step.kind:
        case StepKind.SAME:
            return [_Row(" ", recorded.lines[i].text, i, j)]
        case StepKind.DIFFERS:
            return [_Row("-", recorded.lines[i].text, i, j), _Row("+", ran.lines[j].text, i, j)]
        case StepKind.MISSING:
            return [_Row("-", recorded.lines[i].text, i, j)]
        case StepKind.EXTRA:
            return [_Row("+", ran.lines[j].text, i, j)]
        case StepKind.ELLIPSIS | StepKind.ELIDED:
            return []


def _sorted_rows(rows: list[_Row]) -> list[_Row]:
    done: list[_Row] = []
    gone: list[_Row] = []
    come: list[_Row] = []
    for row in rows:
        if row.mark == " ":
            done += (*gone, *come, row)
            gone, come = [], []
        else:
            (gone if row.mark == "-" else come).append(row)
    return [*done, *gone, *come]


def _header(rows: Sequence[_Row]) -> str:
    recorded = [row for row in rows if row.mark in " -"]
    ran = [row for row in rows if row.mark in " +"]
    first_recorded = min(row.recorded for row in rows) + (1 if recorded else 0)
    first_ran = min(row.ran for row in rows) + (1 if ran else 0)
    return f"@@ -{first_recorded},{len(recorded)} +{first_ran},{len(ran)} @@"
