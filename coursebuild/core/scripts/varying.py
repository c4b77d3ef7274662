"""Times that differ between two runs of a script, and the pattern that says so on the fence.

Entry point: `varying_times`.

1. Where two lines are alike but for tokens (numbers, times of day, dates, each with its unit), the
   tokens that differ vary. One is a time if it has a unit of time or is a time of day, if a rate
   follows it, or if the word before it, or one in the heading of its column, says so.
2. Its pattern is as short as can be: the token in general, and as many of the words before it as
   are needed to match nothing that is the same in both runs.
3. Unless all that varies is a time, nothing is proposed: what is random needs a seed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Mode
from coursebuild.core.scripts.align import same_lines
from coursebuild.core.scripts.lines import Side
from coursebuild.core.text.patterns import pattern_mistake

_MOST_PATTERNS = 4
_TOKEN = re.compile(
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


class _Token(Struct, frozen=True):
    """A token in one of the lines of the first run, and what stands there in the second."""

    line: int
    matches: tuple[re.Match[str], re.Match[str]]

    @property
    def varies(self) -> bool:
        return self.matches[0][0] != self.matches[1][0]

    def is_time(self, lines: Sequence[str]) -> bool:
        """Whether it is a time, or depends on one, in these lines."""
        match = self.matches[0]
        *_, before = _TOKEN.split(match.string[: match.start()])
        above = (line for line in lines[: self.line][::-1] if not _TOKEN.search(line))
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
    tokens = _pair_tokens(first.lines, second.lines)
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


def _pair_tokens(first: Sequence[str], second: Sequence[str]) -> list[_Token]:
    """The tokens of two outputs that are alike but for these; none where they are not."""
    tokens: list[_Token] = []
    for number, lines in enumerate(zip(first, second, strict=False)):
        skeletons = {" ".join(_TOKEN.sub("0", line).split()) for line in lines}
        if len(first) != len(second) or len(skeletons) > 1:
            return []
        pairs = zip(*map(_TOKEN.finditer, lines), strict=True)
        tokens += (_Token(number, pair) for pair in pairs)
    return tokens


def _covers(pattern: str, token: _Token) -> bool:
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
