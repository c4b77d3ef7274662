"""How sensitive the outputs of scripts are to their initial states, as text and as plain values.

Entry points: `sensitivity_text(found, style)`, `sensitivity_value(found)`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, assert_never

from coursebuild.core.model.sensitivity import PERTURBATION, Doubt, Flip, Sensitivity, Standing
from coursebuild.report.plain import plain
from coursebuild.report.terminal import FAINT, GREEN, YELLOW, Style
from coursebuild.report.text import location
from coursebuild.report.values import plural

_WHY = {
    Standing.NO_MUJOCO: "it does not use MuJoCo",
    Standing.NOT_MOVED: "no simulation of it has an initial state to move",
    Standing.UNRECORDED: "nothing that it prints is recorded and compared",
    Standing.DRIFTED: "it does not print what is recorded, or does not run to its end",
    Standing.FAILED: "it does not run to its end when its initial states are moved",
}


def sensitivity_text(found: Sequence[Sensitivity], style: Style) -> str:
    """A line for each script, and one for each number of which not all digits hold."""
    lines = [f"digits that hold when initial states are moved by {PERTURBATION:.0e} (relative):"]
    for one in found:
        lines += _script(one, style)
    return "".join(line + "\n" for line in lines)


def _script(one: Sensitivity, style: Style) -> list[str]:
    if one.standing is not Standing.MEASURED:
        return [f"{style.paint('not asked', FAINT)} {one.path}  {_WHY[one.standing]}"]
    whole = one.numbers - len(one.doubts)
    verdict = "chaotic" if one.chaotic else "some" if one.doubts or one.flips else "all"
    colour = GREEN if verdict == "all" else YELLOW
    numbers = plural(one.numbers, "number")
    said = f"{whole} of {numbers}" if whole < one.numbers else numbers
    parts = [f"{said} in full"]
    if one.amplification is not None:
        parts.append(f"states end {_times(one.amplification)} times as far apart as they began")
    head = f"{style.paint(f'{verdict:<9}', colour)} {one.path}  {', '.join(parts)}"
    rows: list[Doubt | Flip] = [*one.doubts, *one.flips]
    rows.sort(key=lambda row: (row.span.path, row.span.start))
    return [head, *(f"  {_row(row)}" for row in rows)]


def _times(size: float) -> str:
    if not math.isfinite(size):
        return "without bounds, many"
    return f"{size:.0e}" if size >= 1e3 else f"{size:.2g}"


def _row(row: Doubt | Flip) -> str:
    match row:
        case Doubt():
            what = f"{row.printed}  {row.trusted} of {plural(row.digits, 'digit')}"
            what += f", print {row.instead}" if row.instead else ""
            what += f"  ({row.least} to {row.most})"
        case Flip():
            what = _flip(row)
        case _:
            assert_never(row)
    return f"{location(row.span)}  {what}" + ("" if row.compared else "  (allowed for)")


def _flip(row: Flip) -> str:
    printed, other = (" ".join(text.split()) for text in (row.printed, row.other))
    if not other:
        return f"`{printed}` is not always printed"
    return f"`{other}` is printed {f'in place of `{printed}`' if printed else 'here as well'}"


def sensitivity_value(found: Sequence[Sensitivity]) -> list[dict[str, Any]]:
    """The same as values of JSON; an amplification without bounds is `null`."""
    return [
        {
            **plain(one, standing="status"),
            "chaotic": one.chaotic,
            "doubts": [_row_value(doubt) for doubt in one.doubts],
            "flips": [_row_value(flip) for flip in one.flips],
        }
        for one in found
    ]


def _row_value(row: Doubt | Flip) -> dict[str, Any]:
    return {"file": row.span.path, **plain(row)}
