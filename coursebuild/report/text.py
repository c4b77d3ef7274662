"""Diagnostics as text for people: message, place, the line with the wrong part marked, help.

Entry points: `to_text(report, style)`, `diagnostic_text(diagnostic, style)`.

1. The frame shows the first line of the span; carets mark the part of it that is wrong.
2. Columns are those of a terminal: tabs are expanded, wide characters take two cells, control
   characters are shown.
3. A line too long for the screen is cut around the marked part.
"""

from __future__ import annotations

import unicodedata

from msgspec import Struct

from coursebuild.diagnostics import Diagnostic, Severity
from coursebuild.report.values import LabLine, Report, ScriptLine, plural, summary_line
from coursebuild.source import Span

_TAB = 4


class Style(Struct, frozen=True):
    """How text is shown: with ANSI colours or without, and in how many columns."""

    colour: bool = False
    width: int = 100

    def paint(self, text: str, code: str) -> str:
        """`text` in a colour, where there is colour."""
        return f"\x1b[{code}m{text}\x1b[0m" if self.colour and text else text


_BOLD, _RED, _YELLOW, _BLUE, _GREEN, _FAINT = "1", "1;31", "1;33", "1;34", "32", "2"


def to_text(report: Report, style: Style) -> str:
    """Each diagnostic, the scripts, and a summary line."""
    parts = [diagnostic_text(d, style) + "\n" for d in report.diagnostics]
    lines = [script_line(line, style) for line in report.scripts]
    lines += [lab_line(line, style) for line in report.labs]
    if lines:
        parts.append("".join(line + "\n" for line in lines))
    if report.sensitivity:
        from coursebuild.report.sensitivity import sensitivity_text

        parts.append(sensitivity_text(report.sensitivity, style.paint))
    if report.remarks:
        parts.append("".join(visible_lines(remark) + "\n" for remark in report.remarks))
    colour = _GREEN if report.ok else _RED
    parts.append(style.paint(summary_line(report), colour) + "\n")
    return "\n".join(parts)


def script_line(line: ScriptLine, style: Style) -> str:
    """One script: verdict, path, seconds."""
    good = line.status in ("ok", "skipped", "norun")
    verdict = style.paint(f"{line.status:<8}", _GREEN if good else _RED)
    if line.status == "norun":
        return f"{verdict} {line.path}  (not run)"
    if line.status == "skipped":
        return f"{verdict} {line.path}  (needs {', '.join(line.missing)})"
    took = "cached" if line.cached else f"{line.seconds:.2f} s"
    return f"{verdict} {line.path}  {style.paint(took, _FAINT)}"


def lab_line(line: LabLine, style: Style) -> str:
    """One lab: verdict, name, how fast it ran, what was tried, how it compares."""
    verdict = style.paint(f"{line.status:<8}", _GREEN if line.status == "ok" else _RED)
    parts = [] if line.steps_per_second is None else [f"{line.steps_per_second:,} steps/s"]
    if line.status == "ok" and line.tried == 0:
        return f"{verdict} {line.name}  {style.paint('not tried: a kind of its own', _FAINT)}"
    parts += [plural(line.tried, "thing") + " tried"] + ([line.parity] if line.parity else [])
    parts += [f"no Python export: {line.unexported}"] if line.unexported else []
    parts += ["cached"] if line.cached else [f"{line.seconds:.2f} s"]
    return f"{verdict} {line.name}  {style.paint(', '.join(parts), _FAINT)}"


def diagnostic_text(diagnostic: Diagnostic, style: Style) -> str:
    """One diagnostic in full, without a final newline."""
    span = diagnostic.span
    colour = _RED if diagnostic.severity is Severity.ERROR else _YELLOW
    head = style.paint(f"{diagnostic.severity.value}[{diagnostic.rule}]", colour)
    gutter = max(len(str(span.line)), 3)
    pad = " " * gutter
    bar = style.paint("|", _BLUE)
    lines = [
        f"{head}{style.paint(': ' + visible(diagnostic.message), _BOLD)}",
        f"{pad[1:]}{style.paint('-->', _BLUE)} {span.path}:{span.line}:{span.column}",
    ]
    if span.source.text:
        text, at, width = _frame(span, max(style.width - gutter - 3, 40))
        marks = style.paint("^" * width, colour)
        label = f" {style.paint(visible(diagnostic.label), colour)}" if diagnostic.label else ""
        lines += [
            f"{pad} {bar}",
            f"{style.paint(f'{span.line:>{gutter}}', _BLUE)} {bar} {text}".rstrip(),
            f"{pad} {bar} {' ' * at}{marks}{label}",
        ]
    for note in diagnostic.notes:
        place = (
            f"{note.span.path}:{note.span.line}:{note.span.column}: "
            if note.span is not None
            else ""
        )
        lines += _remark("note", place + note.message, pad, style)
    if diagnostic.help:
        lines += _remark("help", diagnostic.help, pad, style)
    return "\n".join(lines)


def _remark(kind: str, message: str, pad: str, style: Style) -> list[str]:
    first, *rest = message.split("\n")
    lead = f"{pad} {style.paint('=', _BLUE)} {style.paint(kind + ':', _BOLD)} "
    indent = " " * (len(pad) + len(kind) + 5)
    return [f"{lead}{visible(first)}", *(f"{indent}{visible(line)}".rstrip() for line in rest)]


def visible(text: str) -> str:
    """Text with control characters shown as symbols, so that it cannot change the terminal."""
    return "".join(_cell(ch) for ch in text)


def visible_lines(text: str) -> str:
    """The same for a text of several lines."""
    return "\n".join(visible(line) for line in text.split("\n"))


def _cell(ch: str) -> str:
    code = ord(ch)
    if ch == "\t":
        return " " * _TAB
    if code < 0x20:
        return chr(0x2400 + code)
    if code == 0x7F:
        return "\u2421"
    if unicodedata.category(ch) in ("Cc", "Cf", "Cs", "Zl", "Zp"):
        return "\ufffd" if ch != "\u200d" else ch
    return ch


def _cells(ch: str) -> int:
    """Terminal cells that the character takes."""
    if ch == "\t":
        return _TAB
    if unicodedata.combining(ch) or ch == "\u200d":
        return 0
    return 2 if unicodedata.east_asian_width(ch) in ("W", "F") else 1


def _frame(span: Span, room: int) -> tuple[str, int, int]:
    """The line to show, the cell at which the marks begin, and how many there are."""
    line = span.source.line_text(span.line)
    start = span.column - 1
    end = len(line) if span.end_line > span.line else span.end_column - 1
    end = max(min(end, len(line)), start)
    first, last = _window(line, start, end, room)
    before = "…" if first else ""
    after = "…" if last < len(line) else ""
    at = len(before) + sum(_cells(ch) for ch in line[first:start])
    width = max(1, sum(_cells(ch) for ch in line[start : min(end, last)]))
    return before + visible(line[first:last]) + after, at, width


def _window(line: str, start: int, end: int, room: int) -> tuple[int, int]:
    """The part of the line to show.

    All of it where it fits, else a stretch around the marked part.
    """
    if sum(_cells(ch) for ch in line[: room + 1]) <= room:
        return 0, len(line)
    room //= 2 if any(_cells(ch) > 1 for ch in line[max(0, start - room) : start + room]) else 1
    first = max(0, min(start - room // 4, len(line) - room))
    if end <= room - room // 4:
        first = 0
    return first, min(len(line), first + room)
