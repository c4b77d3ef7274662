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
from coursebuild.core.scripts.lines import Side, masked, plain_text
from coursebuild.core.scripts.printed_text import PrintedLine, PrintedPlace, PrintedText
from coursebuild.core.scripts.table_cells import ColumnTitle, refusal
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.numbers import write_comma


class _Candidate(Struct, frozen=True):
    """A line that may be a row: its numbers, and the words before them if these are a cell."""

    kind: tuple[str, ...]
    words: tuple[str, ...] | None
    places: tuple[PrintedPlace, ...]

    @property
    def line(self) -> str:
        return plain_text(self.places[0].line.text)


def fill_table(table: model.Table, stdout: str) -> Edit | Diagnostic:
    """The edit that writes all rows; a diagnostic where it is uncertain which lines are meant."""
    titles = [ColumnTitle.of(cell) for cell in table.header]
    output = PrintedText(map(PrintedLine, Side.of(stdout).lines))
    labels = list(map(output.labels, range(len(output.lines))))
    is_named = any(title.best_places(line) for title in titles for line in labels)
    kinds: dict[tuple[str, ...], list[_Candidate]] = {}
    for candidate in _candidates(titles, output):
        kinds.setdefault(candidate.kind, []).append(candidate)
    scores = {kind: _score(titles, lines[0]) for kind, lines in kinds.items()}
    best = [kind for kind, score in scores.items() if score == max(scores.values())]
    words = ["".join(kinds[kind][0].places[0].labels) for kind in best if not scores[kind][1]]
    if is_named and any(map(str.isalpha, "".join(words))):
        best = []  # they have other words than the titles, and other lines have these
    place = table.span.first_line()
    if len(best) != 1:
        message = "no printed line has a number for each column of this table"
        help = "print a line for each row, with the words of the header, or write the rows by hand"
        if best:
            lines_text = " or ".join(f"`{kinds[kind][0].line}`" for kind in best[:3])
            message = f"its rows may be lines such as {lines_text}"
            help = "write the words and units that are printed with the numbers into the header"
        return refusal(place, message, help)
    source, lines = table.span.source, kinds[best[0]]
    for line in lines:
        if sorted(line.places, key=lambda place: place.first) != [*line.places]:
            message = f"the numbers of these columns are printed in another order, in `{line.line}`"
            return refusal(place, message, "put the columns in this order")
    delimiter = re.compile(r"\n([ \t>]*)[^\r\n]*").search(source.text, table.header[-1].span.end)
    assert delimiter is not None
    write = write_comma if table.comma else str
    rows = ("| " + " | ".join(cells) + " |" for cells in _cells(titles, lines, write))
    place = source.span(delimiter.end(), max(table.span.end, delimiter.end()))
    return Edit(place, "".join(f"\n{delimiter[1]}{row}" for row in rows))


def _candidates(titles: Sequence[ColumnTitle], output: PrintedText) -> Iterator[_Candidate]:
    for at, line in enumerate(output.lines):
        if not line.numbers:
            continue
        words = tuple(line.text[: line.numbers[0].start].split())
        rest = masked(line.text[line.numbers[0].start :])
        for has_name, columns in ((False, titles), (True, titles[1:])):
            places_of_titles = [title.best_places(output.labels(at)) for title in columns]
            numbers = line.numbers
            if len(numbers) > len(columns) and all(len(place) == 1 for place in places_of_titles):
                numbers = tuple(line.numbers[place[0]] for place in places_of_titles)
            if len(numbers) == len(columns) == len({*numbers}) and (words or not has_name):
                kind = (output.heading(at), rest, "" if has_name else " ".join(words))
                places = tuple(PrintedPlace(output, at, (number,)) for number in numbers)
                yield _Candidate(kind, words if has_name else None, places)


def _score(titles: Sequence[ColumnTitle], candidate: _Candidate) -> tuple[int, int]:
    columns = titles if candidate.words is None else titles[1:]
    pairs = zip(columns, candidate.places, strict=True)
    verdicts = [title.names(place.labels, place.first, place.units[0]) for title, place in pairs]
    return -verdicts.count(False), verdicts.count(True)


def _cells(
    titles: Sequence[ColumnTitle], lines: Sequence[_Candidate], write: Callable[[str], str]
) -> Iterator[list[str]]:
    """The cells of each row; words that stand before the numbers of all of them are none."""
    columns_of_words = zip(*(reversed(line.words or ()) for line in lines), strict=False)
    shared = sum(1 for _ in takewhile(lambda words: len({*words}) == 1, columns_of_words))
    for line in lines:
        words = line.words
        cells = [write(place.text) for place in line.places]
        if words is not None:
            count = shared
            if len(lines) == 1:  # its label is what the next title names
                count = next((k for k, w in enumerate(reversed(words)) if not titles[1].has(w)), 0)
            name = " ".join(words[: len(words) - count] or words)
            cells.insert(0, name.replace("|", "\\|"))
        yield cells
