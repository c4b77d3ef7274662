"""Diagnostics as text for people: message, place, the line with the wrong part marked, help.

Columns are those of a terminal: tabs are expanded, wide characters take two cells, control
characters are shown. A line too long for the screen is cut around the marked part.
"""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence

from msgspec import Struct

from coursebuild.core.model.results import TrialLine
from coursebuild.core.scripts.sensitivity import PERTURBATION, Doubt, Flip, Sensitivity, Standing
from coursebuild.core.text.characters import cells, printable, printable_lines
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Span
from coursebuild.report.values import (
    UNASKED,
    Report,
    ScriptLine,
    plural,
    summary_line,
    unproven_things,
    unrun_reason,
)

BOLD, FAINT, GREEN, RED, YELLOW, BLUE = "1", "2", "32", "1;31", "1;33", "1;34"
_GAP = "  "
_NARROWEST = 40


class Style(Struct, frozen=True):
    """How text is shown: with ANSI colours or without, and in how many columns."""

    colour: bool = False
    width: int = 100

    def paint(self, text: str, code: str) -> str:
        """Return a text in a colour, if colours are used."""
        return f"\x1b[{code}m{text}\x1b[0m" if self.colour and text and code else text

    def wrap(self, text: str, indent: str = "", code: str = "") -> list[str]:
        """Return the lines of a paragraph, no wider than the terminal if its words allow."""
        lines = textwrap.wrap(
            printable(text),
            max(self.width, _NARROWEST),
            initial_indent=indent,
            subsequent_indent=indent + "  ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        return [self.paint(line, code) for line in lines]


def clip(text: str, room: int) -> str:
    """Return the beginning of a text that fits into `room` cells."""
    width = 0
    for index, char in enumerate(text):
        width += cells(char)
        if width > room:
            return text[:index]
    return text


class Column(Struct, frozen=True):
    """A column of a table with its cells from top to bottom."""

    title: str
    cells: tuple[str, ...]
    left: bool = False
    """Whether its cells are aligned left, as words are; numbers are aligned right."""


def table(columns: Sequence[Column]) -> list[str]:
    """The titles and rows of columns with text as lines."""
    padded_columns = []
    for column in columns:
        if not any(map(str.strip, column.cells)):
            continue
        texts = [column.title, *map(printable, column.cells)]
        width = max(map(cells, texts))
        pairs = [(text, " " * (width - cells(text))) for text in texts]
        padded_columns.append([text + pad if column.left else pad + text for text, pad in pairs])
    return [_GAP.join(row).rstrip() for row in zip(*padded_columns, strict=True)]


# --- the terminal


_MOST_OF_A_RULE = 20


def to_text(report: Report, style: Style, *, brief: bool = False) -> str:
    """The report as text: diagnostics, the scripts, and a summary line; if `brief`, no scripts."""
    if brief and report.ok and not report.diagnostics:
        return ""
    parts = list(diagnostic_paragraphs(report.diagnostics, style))
    lines = [script_line(line, style) for line in report.scripts if line.status != UNASKED]
    lines += [lab_line(line, style) for line in report.labs if line.status != UNASKED]
    if lines and not brief:
        parts.append("".join(line + "\n" for line in lines))
    if report.sensitivity and not brief:
        parts.append(sensitivity_text(report.sensitivity, style))
    if report.remarks and not brief:
        parts.append("".join(printable_lines(remark) + "\n" for remark in report.remarks))
    parts.append(style.paint(summary_line(report), GREEN if report.ok else RED) + "\n")
    return "\n".join(parts)


def diagnostic_paragraphs(diagnostics: Sequence[Diagnostic], style: Style) -> Iterator[str]:
    """The first diagnostics of each rule in each file, then how many more there are."""
    counts: Counter[tuple[str, str, str]] = Counter()
    for d in diagnostics:
        key = d.severity, d.rule, d.span.path
        counts[key] += 1
        if counts[key] <= _MOST_OF_A_RULE:
            yield diagnostic_text(d, style) + "\n"
    rest = "".join(
        f"{severity}[{rule}]: {count - _MOST_OF_A_RULE:,} more in {printable(path)}"
        "; `coursebuild check --format json` lists all\n"
        for (severity, rule, path), count in counts.items()
        if count > _MOST_OF_A_RULE
    )
    if rest:
        yield rest


def script_line(line: ScriptLine, style: Style) -> str:
    """One script: verdict, path, seconds."""
    good = line.status == "ok" or not line.did_run
    verdict = style.paint(f"{line.status:<8}", GREEN if good else RED)
    if not line.did_run:
        unproven = f"; unproven: {things}" if (things := unproven_things(line)) else ""
        return f"{verdict} {line.path}  ({unrun_reason(line)}{unproven})"
    took = "cached" if line.cached else f"{line.seconds:.2f} s"
    took += ", not yet repeated" if line.unrepeated else ""
    return f"{verdict} {line.path}  {style.paint(took, FAINT)}"


def lab_line(line: TrialLine, style: Style) -> str:
    """One lab: verdict, name, how fast it ran, what was tried, how it compares."""
    verdict = style.paint(f"{line.status:<8}", RED if line.status == "failed" else GREEN)
    if line.untried:
        return f"{verdict} {line.name}  ({line.untried})"
    parts = [] if line.steps_per_second is None else [f"{line.steps_per_second:,} steps/s"]
    parts += [plural(line.tried, "thing") + " tried"] + ([line.parity] if line.parity else [])
    parts += [line.play] if line.play else []
    parts += [f"motion fills {100 * line.fill:.1f} %"] if line.fill is not None else []
    parts += [f"falls out of the scene: {body}" for body in line.fallen]
    parts += [f"leaves its plot: {curve}" for curve in line.clipped]
    parts += [f"no Python export: {line.unexported}"] if line.unexported else []
    parts += ["cached"] if line.cached else [f"{line.seconds:.2f} s"]
    return f"{verdict} {line.name}  {style.paint(', '.join(parts), FAINT)}"


def diagnostic_text(diagnostic: Diagnostic, style: Style) -> str:
    """One diagnostic in full, without a final newline."""
    span = diagnostic.span
    colour = {"error": RED, "warning": YELLOW, "hint": BLUE}[diagnostic.severity]
    head = style.paint(f"{diagnostic.severity}[{diagnostic.rule}]", colour)
    gutter = max(len(str(span.line)), 3)
    pad = " " * gutter
    bar = style.paint("|", BLUE)
    lines = [
        f"{head}{style.paint(': ' + printable(diagnostic.message), BOLD)}",
        f"{pad[1:]}{style.paint('-->', BLUE)} {location(span)}",
    ]
    if span.source.text:
        text, at, width = _frame(span, max(style.width - gutter - 3, 40))
        marks = style.paint("^" * width, colour)
        label = f" {style.paint(printable(diagnostic.label), colour)}" if diagnostic.label else ""
        lines += [
            f"{pad} {bar}",
            f"{style.paint(f'{span.line:>{gutter}}', BLUE)} {bar} {text}".rstrip(),
            f"{pad} {bar} {' ' * at}{marks}{label}",
        ]
    for note in diagnostic.notes:
        place = f"{location(note.span)}: " if note.span is not None else ""
        lines += _remark("note", place + note.message, pad, style)
    if diagnostic.help:
        lines += _remark("help", diagnostic.help, pad, style)
    return "\n".join(lines)


def location(span: Span) -> str:
    """The place where a span begins: `content/lessons/4.2-x.md:210:26`."""
    return f"{printable(span.path)}:{span.line}:{span.column}"


def _remark(kind: str, message: str, pad: str, style: Style) -> list[str]:
    first, *rest = message.split("\n")
    lead = f"{pad} {style.paint('=', BLUE)} {style.paint(kind + ':', BOLD)} "
    indent = " " * (len(pad) + len(kind) + 5)
    return [f"{lead}{printable(first)}", *(f"{indent}{printable(line)}".rstrip() for line in rest)]


def _frame(span: Span, room: int) -> tuple[str, int, int]:
    """Return the line to show, the cell at which the marks begin, and how many there are."""
    line = span.source.line_text(span.line)
    start = span.column - 1
    end = len(line) if span.end_line > span.line else span.end_column - 1
    end = max(min(end, len(line)), start)
    first, last = 0, len(line)
    # Characters may have no width: a long line may fit.
    if len(line) > 2 * room or cells(line) > room:
        nearby = line[max(0, start - room) : start + room]
        room //= 2 if cells(nearby) > len(nearby) else 1
        if end > room - room // 4:
            first = max(0, min(start - room // 4, len(line) - room))
        last = min(len(line), first + room)
    before = "…" if first else ""
    after = "…" if last < len(line) else ""
    at = len(before) + cells(line[first:start])
    width = max(1, cells(line[start : min(end, last)]))
    return before + printable(line[first:last]) + after, at, width


# --- sensitivity

_REASONS = {
    Standing.NO_MUJOCO: "it does not use MuJoCo",
    Standing.NOT_MOVED: "no simulation of it has an initial state to move",
    Standing.UNRECORDED: "nothing that it prints is recorded and compared",
    Standing.DRIFTED: "it does not print what is recorded, or does not run to its end",
    Standing.FAILED: "it does not run to its end when its initial states are moved",
}


def sensitivity_text(sensitivities: Sequence[Sensitivity], style: Style) -> str:
    """A line for each script, and one for each number with digits that fail a test."""
    lines = [
        f"digits that repeat when initial states are moved by {PERTURBATION:.0e} (relative), and",
        "digits that are converged: half and a quarter of the timestep bear them out",
    ]
    for s in sensitivities:
        if s.standing is not Standing.MEASURED:
            lines.append(f"{style.paint('not asked', FAINT)} {s.path}  {_REASONS[s.standing]}")
            continue
        repeat = s.numbers - sum(doubt.repeat < doubt.digits for doubt in s.doubts)
        converged = s.numbers - sum(doubt.converged != doubt.digits for doubt in s.doubts)
        verdict = "chaotic" if s.chaotic else "some" if s.doubts or s.flips else "all"
        colour = GREEN if verdict == "all" else YELLOW
        parts = [f"of {plural(s.numbers, 'number')} {repeat} repeat in full"]
        parts.append(s.unhalved or f"{converged} are converged in full")
        if (size := s.amplification) is not None:
            factor = f"{size:.0e}" if size >= 1e3 else f"{size:.2g}"
            factor = factor if math.isfinite(size) else "without bounds, many"
            parts.append(f"states end {factor} times as far apart as they began")
        lines.append(f"{style.paint(f'{verdict:<9}', colour)} {s.path}  {', '.join(parts)}")
        rows: list[Doubt | Flip] = [*s.doubts, *s.flips]
        rows.sort(key=lambda row: (row.span.path, row.span.start))
        lines += (f"  {_row_text(row)}" for row in rows)
    return "".join(line + "\n" for line in lines)


def _row_text(row: Doubt | Flip) -> str:
    match row:
        case Doubt():
            text = f"{row.printed}  of {plural(row.digits, 'digit')} {row.repeat} repeat"
            measured_values = [] if row.repeat == row.digits else [f"{row.least} to {row.most}"]
            if row.converged is not None:
                text += f", {row.converged} are converged"
                measured_values.append(
                    f"half the timestep: {row.halved}, a quarter: {row.quartered}"
                )
                if row.sampled:
                    measured_values.append(f"a part of a step later off by {row.sampled}")
            text += f", print {row.instead}" if row.instead else ""
            text += f"  ({'; '.join(measured_values)})"
            is_allowed = row.repeat < row.digits and not row.compared
        case Flip():
            is_allowed = not row.compared
            printed, second = (" ".join(text.split()) for text in (row.printed, row.other))
            place = f"in place of `{printed}`" if printed else "here as well"
            text = f"`{second}` is printed {place}"
            if not second:
                text = f"`{printed}` is not always printed"
    return f"{location(row.span)}  {text}" + ("  (allowed for)" if is_allowed else "")
