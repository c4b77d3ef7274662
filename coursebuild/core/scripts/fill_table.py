"""The rows of a recorded table that has only a header: the printed lines that its titles name.

1. A line is a row if it has as many numbers as the table has columns, or one less and words before
   them, which are the first cell. Of more numbers, each title must name one by its words.
2. Lines are of one kind if they differ in the first cell and in their numbers only. Of several
   kinds the table means the one with whose numbers more of its words and units are printed.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import takewhile

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.scripts.bound_numbers import PrintedLine
from coursebuild.core.scripts.column_titles import ColumnTitle, PrintedRow
from coursebuild.core.scripts.lines import Side, plain_text
from coursebuild.core.scripts.provenance import PrintedText, masked
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.core.text.numbers import Number, write_comma
from coursebuild.core.text.quantities import UnitText, unit_of_printed


class _Candidate(Struct, frozen=True):
    """A line that may be a row: its numbers, and the words before them if these are a cell."""

    kind: tuple[str, ...]
    words: tuple[str, ...] | None
    numbers: tuple[Number, ...]
    units: tuple[UnitText, ...]
    line: PrintedRow


def fill_table(table: model.Table, stdout: str) -> Edit | Diagnostic:
    """The edit that writes all rows; a diagnostic where it is uncertain which lines are meant."""
    titles = [ColumnTitle.of(cell) for cell in table.header]
    kinds: dict[tuple[str, ...], list[_Candidate]] = {}
    for candidate in _candidates(titles, stdout):
        kinds.setdefault(candidate.kind, []).append(candidate)
    scores = {kind: _score(titles, lines[0]) for kind, lines in kinds.items()}
    best = [kind for kind, score in scores.items() if score == max(scores.values())]
    if len(best) != 1:
        place = table.span.first_line()
        message = "no printed line has a number for each column of this table"
        help = "print one line for each row, or write the rows by hand"
        if best:
            lines_text = " or ".join(f"`{kinds[kind][0].line.line}`" for kind in best[:3])
            message = f"its rows may be lines such as {lines_text}"
            help = "write the words and units that are printed with the numbers into the header"
        return diagnose("output-not-updatable", place, message, help=help)
    source, lines = table.span.source, kinds[best[0]]
    delimiter = re.compile(r"\n([ \t>]*)[^\r\n]*").search(source.text, table.header[-1].span.end)
    assert delimiter is not None
    write = write_comma if table.comma else str
    rows = ("| " + " | ".join(cells) + " |" for cells in _cells(titles, lines, write))
    place = source.span(delimiter.end(), max(table.span.end, delimiter.end()))
    return Edit(place, "".join(f"\n{delimiter[1]}{row}" for row in rows))


def _candidates(titles: Sequence[ColumnTitle], stdout: str) -> Iterator[_Candidate]:
    lines = list(map(plain_text, Side.of(stdout).lines))
    text = PrintedText([PrintedLine(line) for line in lines])
    for index, line in enumerate(lines):
        row = PrintedRow.of(line, text.heading(index))
        numbers = [n for n in row.numbers if not row.is_in_unit(n)]
        if not numbers:
            continue
        words = tuple(line[: numbers[0].start].split())
        rest = masked(line[numbers[0].start :])
        for has_name, columns in ((False, titles), (True, titles[1:])):
            places = [title.best_places(row) for title in columns]
            row_numbers = tuple(numbers)
            if len(numbers) > len(columns) and all(len(place) == 1 for place in places):
                row_numbers = tuple(row.numbers[place[0]] for place in places)
            if len(row_numbers) == len(columns) == len({*row_numbers}) and (words or not has_name):
                kind = (text.heading(index), rest, "" if has_name else " ".join(words))
                units = tuple(unit_of_printed(line, n, lines[:index]) for n in row_numbers)
                yield _Candidate(kind, words if has_name else None, row_numbers, units, row)


def _score(titles: Sequence[ColumnTitle], candidate: _Candidate) -> tuple[int, int]:
    columns = titles if candidate.words is None else titles[1:]
    numbers = zip(columns, candidate.numbers, candidate.units, strict=True)
    verdicts = [title.names(candidate.line, number, unit) for title, number, unit in numbers]
    return -verdicts.count(False), verdicts.count(True)


def _cells(
    titles: Sequence[ColumnTitle], lines: Sequence[_Candidate], write: Callable[[str], str]
) -> Iterator[list[str]]:
    """The cells of each row; words that stand before the numbers of all of them are none."""
    columns_of_words = zip(*(reversed(line.words or ()) for line in lines), strict=False)
    shared = sum(1 for _ in takewhile(lambda words: len({*words}) == 1, columns_of_words))
    for line in lines:
        words = line.words
        cells = [write(line.line.line[n.start : n.end]) for n in line.numbers]
        if words is not None:
            count = shared
            if len(lines) == 1:  # its label is what the next title names
                count = next((k for k, w in enumerate(reversed(words)) if not titles[1].has(w)), 0)
            name = " ".join(words[: len(words) - count] or words)
            cells.insert(0, name.replace("|", "\\|"))
        yield cells
