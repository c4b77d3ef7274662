"""Tables, verses and definitions that Pandoc reads, as the Markdown that all tools read.

A grid has its cells between bars and crosses; another table has them below runs of hyphens, and
empty lines between its rows where these go over several lines. A cell is what stands between the
same columns of the text, of which a wide character takes two.
"""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, groupby, pairwise
from unicodedata import east_asian_width

from msgspec import Struct

from coursebuild.api import marks, regex
from coursebuild.features.importer.anchors import CAPTION, write_caption

_QUOTE = regex(r"(?:[ ]{0,3}>[ ]?)*")
_INDENT = regex(rf"{_QUOTE.pattern}[ ]{{0,3}}")
_GRID_RULE = regex(r"\+(?:[-=:]+\+)+")
_RULE = regex(r"[ ]{0,3}-{2,}(?:[ ]+-{2,})+[ ]*")
"""What stands above the cells of a table without bars, a run of hyphens for each column."""
_LINE = regex(r"[ ]{0,3}-{5,}[ ]*")
_FENCE = regex(r"[ \t>]*(?:(?:[-+*]|\d+[.)])[ \t]+)?(`{3,}|~{3,})")
_DELIMITERS = regex(r"\|?[ \t]*:?-+:?[ \t]*(?:\|[ \t]*:?-+:?[ \t]*)*\|?[ \t]*")
_WIDE = "\0"
"""What stands behind a character that takes two columns."""
_ITEM = regex(r"[-+*][ ]+|(?=\d+[.)][ ])")

_MOST_LINES = 2_000
"""Lines that a table may take: else a long text of what begins as one could be read without end."""

Cells = Sequence[Sequence[str]]
"""The cells of a row, each with its lines."""


class _Table(Struct, frozen=True):
    size: int
    """The lines that it takes."""
    head: Cells
    rows: Sequence[Cells]
    sides: Sequence[str]
    """For each column: `left`, `right`, `center`, or nothing."""


def rewrite_tables(text: str, leave: Callable[[int], None]) -> tuple[str, int]:
    """Return prose with its tables and verses as all tools read them, and how many there were.

    `leave` is told the line, from 0, of a grid whose bars do not stand in columns: it is a text.
    """
    lines, out, count, at, fence = text.split("\n"), list[str](), 0, 0, ""
    while at < len(lines):
        if mark := _FENCE.match(lines[at]):
            fence = "" if fence and mark[1].startswith(fence) else fence or mark[1]
        is_first = at == 0 or not lines[at - 1].strip("> ")
        may_begin = is_first and not fence and _may_begin(lines, at)
        size, new = _read_block(lines[at : at + _MOST_LINES]) if may_begin else (0, ())
        if size and not new:
            leave(at)
            lead = (_INDENT.match(lines[at]) or [""])[0]
            new = (f"{lead}```text", *lines[at : at + size], f"{lead}```")
        elif size:
            count += 1
        out += new or [lines[at]]
        at += size or 1
    return "\n".join(out), count


def _may_begin(lines: Sequence[str], at: int) -> bool:
    """Whether the line at an index, or the one below it, looks as if a table or verse began."""
    first, second = (line.lstrip("> ") for line in (*lines[at : at + 2], "")[:2])
    return first.startswith(("+", "|", "--")) or second.startswith("--")


def _read_block(lines: Sequence[str]) -> tuple[int, Sequence[str]]:
    """Return how many lines a table or verse takes, and as many new ones; none for a bad grid."""
    for pattern, read in _READERS:
        lead = (pattern.match(lines[0]) or [""])[0]
        below = [*_stripped(lines, lead)]
        if table := read(below):
            caption, caption_size = _read_caption(below[table.size :])
            rows = (map(_join, cells) for cells in table.rows)
            new = marks.table(map(_join, table.head), rows, table.sides).split("\n")
            new, size = [*caption, *new], table.size + caption_size
            return size, [(lead + line).rstrip() for line in (*new, *[""] * (size - len(new)))]
    lead = (_INDENT.match(lines[0]) or [""])[0]
    below = [*_stripped(lines, lead)]
    if verse := _read_verse(below):
        return len(verse), [lead + line for line in verse]
    return len(_find_grid(below)), ()


def _stripped(lines: Sequence[str], lead: str) -> Iterator[str]:
    """Yield the first line, and those below it that begin as it does, without that."""
    for line in lines:
        is_empty = not line.strip("> ")
        if not (is_empty or line.startswith(lead)):
            return
        yield "" if is_empty else line.removeprefix(lead)


def _read_caption(lines: Sequence[str]) -> tuple[list[str], int]:
    """Return the caption of the table that ends above, and the lines that it takes."""
    start = next((n for n, line in enumerate(lines[:2]) if line.strip()), None)
    if start is None or not CAPTION.match(lines[start].lstrip()):
        return [], 0
    end = next((n for n in range(start, len(lines)) if not lines[n].strip()), len(lines))
    caption = CAPTION.fullmatch(" ".join(line.strip() for line in lines[start:end]))
    return ([write_caption(caption), ""], end) if caption else ([], 0)


def _join(lines: Sequence[str]) -> str:
    """Return the lines of a cell as one: a paragraph or an item begins behind a break."""
    parts = [""]
    for line in (line.replace(_WIDE, "").strip() for line in lines):
        item = _ITEM.match(line)
        if not line or item:
            parts.append("")
        mark = "• " if item and item[0] else ""
        parts[-1] = f"{parts[-1]} {mark}{line[item.end() if item else 0 :]}".strip()
    return re.sub(r"(?<!\\)\|", r"\\|", "<br>".join(part for part in parts if part))


def _widened(lines: Sequence[str]) -> list[str]:
    return [
        "".join(c + _WIDE * (east_asian_width(c) in "WF") for c in line.rstrip()) for line in lines
    ]


# --- grids


def _find_grid(lines: Sequence[str]) -> list[str]:
    """Return the lines of the grid that begins here, down to its last rule; none without one."""
    if not _GRID_RULE.fullmatch(lines[0].rstrip()):
        return []
    ends = (n for n, line in enumerate(lines) if not re.match(r"[+|].*[+|]\s*$", line))
    grid = _widened(lines[: next(ends, len(lines))])
    while not _GRID_RULE.fullmatch(grid[-1]):
        del grid[-1]
    return grid if len(grid) > 2 else []


def _read_grid(lines: Sequence[str]) -> _Table | None:
    grid = _find_grid(lines)
    rules = [number for number, line in enumerate(grid) if _GRID_RULE.fullmatch(line)]
    if not grid:
        return None
    bounds = sorted({n for rule in rules for n, sign in enumerate(grid[rule]) if sign == "+"})
    if any(len(line) != bounds[-1] + 1 for line in grid):
        return None  # its bars do not stand in columns
    rows = [
        _grid_cells(grid[first + 1 : last], bounds)
        for first, last in pairwise(rules)
        if last > first + 1
    ]
    double = next((rule for rule in rules[:-1] if "=" in grid[rule]), 0)
    count = sum(rule < double for rule in rules)
    head = [[*chain.from_iterable(cells)] for cells in zip(*rows[:count], strict=True)]
    sides = [
        {(":", ":"): "center", (":", "-"): "left", ("-", ":"): "right"}.get(
            (part[:1], part[-1:]), ""
        )
        for part in re.split(r"\+", grid[double].replace("=", "-"))[1:-1]
    ]
    sides += [""] * (len(bounds) - 1 - len(sides))
    return _Table(len(grid), head or [[]] * (len(bounds) - 1), rows[count:], sides)


def _grid_cells(lines: Sequence[str], bounds: Sequence[int]) -> Cells:
    """Return the cells of a row; one over several columns stands in the first of them."""
    cells: list[list[str]] = [[] for _ in bounds[1:]]
    for line in lines:
        edges = [bound for bound in bounds if line[bound : bound + 1] in ("|", "+")]
        for first, last in pairwise(edges):
            text = line[first + 1 : last]
            is_rule = len(text) > 1 and not text.strip("-=:")  # below a cell over several rows
            cells[bounds.index(first)].append("" if is_rule else text)
    return cells


# --- tables below hyphens


def _read_ruled(lines: Sequence[str]) -> _Table | None:
    rule = next((n for n, line in enumerate(lines[:12]) if _RULE.fullmatch(line)), None)
    is_long = bool(_LINE.fullmatch(lines[0]))
    if rule is None or not all(line.strip() for line in lines[:rule]) or rule > (11 * is_long or 1):
        return None
    starts = [run.start() for run in re.finditer("-+", lines[rule])]
    has_end = is_long or rule == 0
    end = next(
        (
            n
            for n in range(rule + 1, len(lines))
            if (
                _LINE.fullmatch(lines[n]) or _RULE.fullmatch(lines[n])
                if has_end
                else not lines[n].strip()
            )
        ),
        None if has_end else len(lines),
    )
    if end is None or end == rule + 1 or not lines[rule + 1].strip():
        return None
    body = _widened(lines[rule + 1 : end])
    if not has_end and _RULE.fullmatch(body[-1]):
        del body[-1]
    head = _widened(lines[is_long:rule])
    edges = [0, *starts[1:], max(map(len, (*body, *head, lines[rule])))]
    if any(
        re.match(r"[^\s\0]{2}", line[edge - 1 : edge + 1]) for edge in edges[1:-1] for line in body
    ):
        return None  # a word stands where one column ends
    groups = [[*group] for is_text, group in groupby(body, lambda s: bool(s.strip())) if is_text]
    is_of_lines = has_end and len(groups) > 1
    rows = [
        _split(group, edges) for group in (groups if is_of_lines else ([line] for line in body))
    ]
    cells = _split(head, edges)
    ends = [run.end() for run in re.finditer("-+", lines[rule])]
    sides = [
        _side(next((line for line in column if line.strip()), ""), edge, start, stop)
        for column, edge, start, stop in zip(
            cells if head else rows[0], edges[:-1], starts, ends, strict=True
        )
    ]
    return _Table(end + has_end, cells, rows, sides)


def _split(lines: Sequence[str], edges: Sequence[int]) -> Cells:
    return [[line[first:last] for line in lines] for first, last in pairwise(edges)]


def _side(text: str, edge: int, start: int, end: int) -> str:
    """Where the words of a column stand above its hyphens."""
    if not text.strip():
        return ""
    is_left = edge + len(text) - len(text.lstrip()) <= start
    is_right = edge + len(text.rstrip()) >= end
    if is_left or is_right:
        return "" if is_left and is_right else "left" if is_left else "right"
    return "center"


# --- verses


def _read_verse(lines: Sequence[str]) -> list[str]:
    """Return the lines of a poem or an address, each behind a bar; none if there is no such."""
    size = next((n for n, line in enumerate(lines) if not re.match(r"\|[ ]", line)), len(lines))
    verse = [line[2:].rstrip() for line in lines[:size]]
    if size < 2 or any(line.endswith("|") or _DELIMITERS.fullmatch(line) for line in verse):
        return []
    indented = (re.sub("^ +", lambda blanks: "\u00a0" * len(blanks[0]), line) for line in verse)
    *first, last = indented
    return [*(f"{line}\\" for line in first), last]


_READERS = ((_INDENT, _read_grid), (_QUOTE, _read_ruled))
"""What reads tables, and what stands before each of their lines."""


_BAR = regex(r"(?<!\\)\|")


def cut_rows(lines: Sequence[str], leave: Callable[[int, str], None]) -> Iterator[str]:
    """Yield lines, of which the rows of tables have no more cells than the heads: none is shown.

    `leave` is told the line, from 0, and the cells that are cut off, if there is a word in them.
    """
    width, width_above, fence = 0, 0, ""
    for number, line in enumerate(lines):
        if mark := _FENCE.match(line):
            fence = "" if fence and mark[1].startswith(fence) else fence or mark[1]
        row = line.strip("> \t")
        bars = [bar.start() for bar in _BAR.finditer(line)]
        cells = len(bars) + 1 - row.startswith("|") - (len(row) > 1 and row.endswith("|"))
        if fence or not bars:
            width = 0
        elif not width and _DELIMITERS.fullmatch(row):
            width = cells if cells == width_above else 0
        elif cells > width > 0:
            end = bars[width - (not row.startswith("|"))] + 1
            if rest := line[end:].strip("| \t"):
                leave(number, rest)
            line = line[:end]
        width_above = cells
        yield line


MEANING = regex(
    r"^(?<![^\n]\n)(?P<term>(?![|:#>\s<]|[-*+][ ])[^\n]*[^\s\n])[ \t]*\n"
    r"(?P<meanings>(?:\n?:[ \t]+\S[^\n]*\n?(?:(?:\n*[ ]{2,}|(?!:)(?=[^\s:]))[^\n]+\n?)*)+)",
    re.MULTILINE,
)
"""A term in a paragraph of its own, and what it means, once or more, each behind a colon."""


def write_meanings(match: re.Match[str]) -> str:
    """Return what a term means, as paragraphs of which the first begins with the term."""
    meanings = re.split(r"^:[ \t]+", match["meanings"].lstrip("\n"), flags=re.MULTILINE)[1:]
    parts = (textwrap.dedent(f"    {part.lstrip()}").strip() for part in meanings)
    lines = (re.sub(r"^[ ]{2,4}", "", part, flags=re.MULTILINE) for part in parts)
    return f"**{match['term'].removesuffix(':')}**: " + "\n\n".join(lines) + "\n"


_EXAMPLE = regex(r"^([ ]{0,3})\(@([\w-]*)\)(?=[ \t]+\S)", re.MULTILINE)


def number_examples(text: str) -> str:
    """Return a text in which the items of Pandoc's lists of examples have their numbers.

    These go on through the text, and are what `(@label)` stands for in it.
    """
    numbers: dict[str, int] = {}
    for number, example in enumerate(_EXAMPLE.finditer(text), 1):
        numbers.setdefault(example[2] or str(number), number)
    count = itertools.count(1)
    text = _EXAMPLE.sub(lambda example: f"{example[1]}{next(count)}.", text)
    return re.sub(
        r"\(@([\w-]+)\)", lambda m: f"({numbers[m[1]]})" if m[1] in numbers else m[0], text
    )
