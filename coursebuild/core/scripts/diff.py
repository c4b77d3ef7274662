"""How a recorded output differs from what its script prints now: inside a line, and line by line.

1. Lines that differ in their numbers only: each pair of numbers that does not match.
2. Other lines are cut into numbers, words, signs and white space, and these are aligned: paired
   numbers are compared, the rest is text. White space that differs is reported only where nothing
   else does, because columns shift when a number gets wider.
3. A recorded line with an ellipsis that does not fit differs as a whole.

Of two runs of a script, `varying_times` gives the pattern that says on the fence which times vary:

1. Where two lines are alike but for tokens (numbers, times of day, dates, each with its unit), the
   tokens that differ vary. One is a time if it has a unit of time or is a time of day, if a rate
   follows it, or if the word before it, or one in the heading of its column, says so.
2. Its pattern is as short as can be: the token in general, and as many of the words before it as
   are needed to match nothing that is the same in both runs.
3. Unless all that varies is a time, nothing is proposed: what is random needs a seed.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Literal, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Mode, Table
from coursebuild.core.model.results import Change, DriftKind, Verdict
from coursebuild.core.scripts.align import MATCH, StepKind, align, pair, same_lines
from coursebuild.core.scripts.lines import LineMatcher, Side
from coursebuild.core.text.numbers import (
    Number,
    agreeing_digits,
    difference,
    relative_error,
    scan,
    unit,
)
from coursebuild.core.text.patterns import pattern_mistake
from coursebuild.core.text.source import Span

_PART = re.compile(r"\s+|\w+|[^\w\s]")
_SPACE, _NUMBER = 1, 4


class Difference(Struct, frozen=True):
    """A stretch of a recorded line, and the stretch of the printed line in its place."""

    start: int
    end: int
    printed_start: int
    printed_end: int
    numbers: tuple[Number, Number] | None = None
    """Recorded and printed, where both are a number."""


def number_change(
    span: Span, recorded: str, printed: str, numbers: tuple[Number, Number]
) -> Change:
    """The change of a number that stands at `span` in the lesson.

    It is rounding where a number with a point or an exponent is off by at most one unit of its last
    recorded place; a count that is off by one is not. The same value in another notation is text.
    """
    old, new = numbers
    kind = DriftKind.NUMERIC
    if old.is_finite and new.is_finite:
        gap = difference(old.value, new.value)
        if gap == 0:
            kind = DriftKind.TEXT
        elif old.is_inexact and gap <= unit(old.place):
            kind = DriftKind.ROUNDING
    error = relative_error(old.value, new.value)
    size = None if error is None else float(error)
    return Change(
        kind,
        span,
        recorded,
        printed,
        None if size == float("inf") else size,
        None if error is None else agreeing_digits(error),
    )


def find_differences(recorded: str, printed: str, matcher: LineMatcher) -> tuple[Difference, ...]:
    """Where a printed line differs from the recorded one; at least one difference."""
    pairs = matcher.pairs(recorded, printed)
    if pairs is not None:
        numeric = tuple(
            Difference(a.start, a.end, b.start, b.end, (a, b))
            for a, b in pairs
            if not matcher.numbers_match(a, b)
        )
        if numeric:
            return numeric
    if not matcher.elides(recorded):
        token_differences = _token_differences(recorded, printed, matcher)
        if token_differences:
            return token_differences
    return (Difference(0, len(recorded), 0, len(printed)),)


class _Token(Struct, frozen=True):
    start: int
    end: int
    text: str
    number: Number | None = None


def _tokens(text: str) -> Iterator[_Token]:
    at = 0
    for number in (*scan(text), None):
        stop = len(text) if number is None else number.start
        for part in _PART.finditer(text, at, stop):
            yield _Token(part.start(), part.end(), part.group())
        if number is not None:
            yield _Token(number.start, number.end, number.text, number)
            at = number.end


def _token_differences(recorded: str, printed: str, matcher: LineMatcher) -> tuple[Difference, ...]:
    left, right = list(_tokens(recorded)), list(_tokens(printed))

    def weight(i: int, j: int) -> int:
        a, b = left[i], right[j]
        if a.number is not None and b.number is not None:
            return MATCH if matcher.numbers_match(a.number, b.number) else _NUMBER
        if a.text.isspace() and b.text.isspace():
            return _SPACE
        return MATCH if a.text == b.text else 0

    differences: list[Difference] = []
    at = printed_at = 0
    pairs = pair([t.text for t in left], [t.text for t in right], weight)
    left.append(_Token(len(recorded), len(recorded), ""))
    right.append(_Token(len(printed), len(printed), ""))
    for i, j in (*pairs, (-1, -1)):
        a, b = left[i], right[j]
        if at < a.start or printed_at < b.start:
            differences.append(Difference(at, a.start, printed_at, b.start))
        if a.number is not None and b.number is not None:
            if not matcher.numbers_match(a.number, b.number):
                numbers = (a.number, b.number)
                differences.append(Difference(a.start, a.end, b.start, b.end, numbers))
        elif a.text != b.text:
            differences.append(Difference(a.start, a.end, b.start, b.end))
        at, printed_at = a.end, b.end

    # Drop white space where anything else differs; join texts with only white space between
    def is_blank(d: Difference) -> bool:
        return not (
            recorded[d.start : d.end].strip() or printed[d.printed_start : d.printed_end].strip()
        )

    merged_differences: list[Difference] = []
    for d in [d for d in differences if not is_blank(d)] or differences:
        if merged_differences and d.numbers is None:
            last = merged_differences[-1]
            gap = Difference(last.end, d.start, last.printed_end, d.printed_start)
            if last.numbers is None and is_blank(gap):
                merged_differences.pop()
                d = Difference(last.start, d.end, last.printed_start, d.printed_end)
        merged_differences.append(d)
    return tuple(merged_differences)


Mark: TypeAlias = Literal[" ", "-", "+"]
_LINES, _WIDTH = 12, 120


DiffRow: TypeAlias = tuple[Mark, list[tuple[str, bool]]]
"""A line as recorded (`-`), as printed (`+`), or both (a space): its parts, and which changed."""


def shorten(text: str, width: int) -> str:
    """The text, cut to a width with an ellipsis sign at its end."""
    return text if len(text) <= width else text[: width - 1] + "…"


def quote(text: str, width: int) -> str:
    """A line of output as a message shows it: cut, without white space at its ends."""
    return f"`{shorten(text.strip(), width)}`"


def text_diff(before: str, now: str) -> str:
    """The lines that two texts do not share, at most twelve of them."""
    lines = [
        shorten(line, _WIDTH)
        for line in difflib.unified_diff(before.splitlines(), now.splitlines(), n=0, lineterm="")
        if not line.startswith(("---", "+++", "@@"))
    ]
    if len(lines) > _LINES:
        lines[_LINES:] = [f"… and {len(lines) - _LINES} more lines"]
    return "\n".join(lines)


def diff_rows(verdict: Verdict, stdout: str) -> tuple[DiffRow, ...]:
    """The rows of a recording that a run differs from; of a table the changed cells only."""
    body = verdict.recording.body
    if isinstance(body, Table):
        cells: list[DiffRow] = []
        for change in verdict.changes:
            cells += [_row("-", text) for text in change.recorded.split("\n") if change.recorded]
            cells += [_row("+", text) for text in change.printed.split("\n") if change.printed]
        return tuple(cells)
    matcher, filters = LineMatcher(verdict.comparison), verdict.comparison.filters
    recorded, printed = Side.of(body.text, filters), Side.of(stdout, filters)
    rows: list[DiffRow] = []  # one for each line of either side, none for elided lines
    for step in align(recorded, printed, matcher):
        match step.kind:
            case StepKind.SAME | StepKind.ELLIPSIS:
                rows += (_row(" ", text) for text in recorded.raw_lines(step.recorded))
            case StepKind.DIFFERS:
                old, new = recorded.lines[step.recorded], printed.lines[step.printed]
                places = find_differences(old, new, matcher)
                rows.append(("-", _parts(old, ((d.start, d.end) for d in places))))
                ranges = ((d.printed_start, d.printed_end) for d in places)
                rows.append(("+", _parts(new, ranges)))
            case StepKind.MISSING:
                rows.append(_row("-", recorded.lines[step.recorded]))
            case StepKind.EXTRA:
                rows.append(_row("+", printed.lines[step.printed]))
            case StepKind.ELIDED:
                pass
    # Between two common lines, all removed lines come before all added ones.
    hunks = (list(group) for _, group in groupby(rows, key=lambda row: row[0] == " "))
    return tuple(row for hunk in hunks for row in sorted(hunk, key=lambda r: r[0], reverse=True))


def _row(mark: Mark, text: str) -> DiffRow:
    return mark, [(text, mark != " ")]


def _parts(text: str, ranges: Iterable[tuple[int, int]]) -> list[tuple[str, bool]]:
    parts: list[tuple[str, bool]] = []
    at = 0
    for start, end in ranges:
        parts += ((text[at:start], False), (text[start:end], True))
        at = end
    return [part for part in (*parts, (text[at:], False)) if part[0]]


# --- times that differ between two runs


_MOST_PATTERNS = 4
_VARYING = re.compile(
    r"(?<![\w.])(?P<stamp>\d{4}-\d\d-\d\d(?:[T ]\d\d(?::\d\d)+(?:[.,]\d+)?)?"
    r"|\d+(?::\d\d)+(?:[.,]\d+)?)|(?<![\w.])(?P<number>\d[\d,]*(?:\.\d*)?(?:[eE][+-]?\d+)?)"
    r"(?P<unit> *(?:ns|us|[µμ]s|ms|s|secs?|seconds?|mins?|minutes?|h|hours?)(?![\w/]))?"
)
_RATE = re.compile(
    r" *(?:[^\s\d]*/s(?:ec)?(?!\w)|[kMG]?Hz(?!\w)|fps(?!\w)|[x×] *real|(?:times +)?(?:fast|slow)er)"
)
_TIMES = (
    r"(?i)(?<![^\W_])(?:times?|timings?|took|takes|elapsed|durations?|runtime|wall|cpu|clock|date"
    r"|seconds?|secs?|[mµμun]?s|now|speed|speedup|rate|fps)(?![^\W_])"
)
_TITLE = re.compile(_TIMES)
_BEFORE = re.compile(rf"{_TIMES}(?: *[(\[][^\s()\[\]]*[)\]])?\s*[:=]?\s*(?:(?:is|was|of|at) +)?$")


class _VaryingToken(Struct, frozen=True):
    """A token in one of the lines of the first run, and what stands there in the second."""

    line: int
    matches: tuple[re.Match[str], re.Match[str]]

    @property
    def varies(self) -> bool:
        return self.matches[0][0] != self.matches[1][0]

    def is_time(self, lines: Sequence[str]) -> bool:
        """Whether it is a time, or depends on one, in these lines."""
        match = self.matches[0]
        *_, before = _VARYING.split(match.string[: match.start()])
        above = (line for line in lines[: self.line][::-1] if not _VARYING.search(line))
        return bool(
            match["stamp"]
            or match["unit"]
            or _RATE.match(match.string, match.end())
            or _BEFORE.search(before)
            or (not before.strip() and _TITLE.search(next(above, "")))
        )

    def patterns(self) -> Iterator[str]:
        """Patterns for it, each narrower than the one before."""
        match = self.matches[0]
        rate = _RATE.match(match.string, match.end())
        after = rate[0] if rate else ""
        *before, last = re.split(r"(\S+\s*)", match.string[: match.start()])
        words = [word for word in before if word] + [last] * bool(last)
        is_bare = not (match["stamp"] or match["unit"] or after)
        if match["stamp"]:
            general = re.sub(r"\d+", "[0-9]+", _literal(match[0]))
        else:
            marks = {*"".join(m["number"] for m in self.matches)} - {*"0123456789"}
            general = f"[0-9{''.join(sorted(marks - {'-'}))}{'-' * ('-' in marks)}]+"
            units = sorted({_literal(m["unit"] or "") for m in self.matches})
            general += units[0] if len(units) == 1 else f"(?:{'|'.join(units)})"
        for count in range(1 if is_bare else 0, len(words) + 1):
            context = "".join(words[len(words) - count :])
            yield _literal(context) + general + _literal(after)


def varying_times(first: Side, second: Side, comparison: Comparison) -> str:
    """The pattern that makes the outputs of two runs the same; empty if there is no good one."""
    tokens: list[_VaryingToken] = []
    if len(first.lines) != len(second.lines):
        return ""
    for number, lines in enumerate(zip(first.lines, second.lines, strict=True)):
        if len({" ".join(_VARYING.sub("0", line).split()) for line in lines}) > 1:
            return ""  # they differ in more than their numbers
        tokens += (
            _VaryingToken(number, m) for m in zip(*map(_VARYING.finditer, lines), strict=True)
        )
    varying = [token for token in tokens if token.varies]
    excluded = comparison.mode is Mode.VOLATILE or comparison.ellipsis
    if excluded or not varying or not all(token.is_time(first.lines) for token in varying):
        return ""
    patterns: list[str] = []
    for token in varying:
        if any(_covers(pattern, token) for pattern in patterns):
            continue
        constant_tokens = [t for t in tokens if not t.varies]
        fits = (
            pattern
            for pattern in token.patterns()
            if _covers(pattern, token) and not any(_covers(pattern, t) for t in constant_tokens)
        )
        patterns += [next(fits, "")]
    pattern = "|".join(patterns)
    if not all(patterns) or len(patterns) > _MOST_PATTERNS or '"' in pattern or "`" in pattern:
        return ""
    if comparison.volatile:
        pattern = f"{comparison.volatile}|{pattern}"
    if pattern_mistake(pattern):
        return ""
    filters = replace(comparison, volatile=pattern).filters
    first, second = (Side.of(side.raw, filters) for side in (first, second))
    return pattern if same_lines(first, second, comparison) else ""


def _covers(pattern: str, token: _VaryingToken) -> bool:
    """Whether a pattern matches any of a token, in either run."""
    return any(
        cover.start() < match.end() and match.start() < cover.end()
        for match in token.matches
        for cover in re.finditer(pattern, match.string)
    )


def _literal(text: str) -> str:
    """A pattern for a text; of several spaces, the width does not count."""
    words = re.escape(re.sub(r"\s\s+", "\t", text)).replace("\\\t", " +")
    return words.replace(r"\ ", " ").replace(r"\-", "-")
