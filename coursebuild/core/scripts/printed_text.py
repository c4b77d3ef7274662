"""The printed lines of an output, their numbers, and where each of these stands: its address.

1. An address is the words of a printed line, the heading above it, and the number's place in the
   line. A heading is the last line above that has no number, or ends with a colon.
2. Where several lines have the same words, the numbers of the heading and those that the line
   begins with name it, as few as suffice: where all have the same heading, its numbers are `#`.
   Such a name counts only as long as none was replaced by another: `0.1` may be a setting, which
   stays, or a result that another line has by chance now.
3. Lines that nothing tells apart have one address, where they have the same number at its place.
4. The label of a number is what is printed right before it, or the title of its column. Numbers of
   two labels, or below two headings, are different quantities.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, cached_property, partial
from itertools import accumulate, chain
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.model import Filter, Recording, Table
from coursebuild.core.model.lesson_record import Address
from coursebuild.core.scripts.lines import MappedText, Side, masked, plain_text, replace_ranges
from coursebuild.core.scripts.table_cells import ColumnTitle, RowCell, table_rows
from coursebuild.core.text.numbers import Number, as_printed, has_groups, scan
from coursebuild.core.text.quantities import (
    UnitText,
    is_same_unit,
    name_of_header,
    numbers_of_quantities,
    read_unit,
    title_above,
    unit_behind,
    unit_of_printed,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span

Locate: TypeAlias = Callable[[int, int], Span]
_Words: TypeAlias = tuple[str, ...]
"""Words without the signs around them, and numbers behind a zero character."""


_IN_BRACKETS = regex(r"[(\[]([^()\[\]]+)[)\]]")
_UNIT_IN_BRACKETS = regex(r"\s*[(\[][^()\[\]]*[)\]][\s:=]*\Z")
_REST_OF_ROW = regex(r"\A(?:[-+]?\d[\d.e+-]*(?=[\s)\],])|(?:and|to)\s|[\s)\],])*")
_ARGUMENTS = regex(r"(?<=\w)[(\[][^()\[\]]*[)\]](?=\s*[=:])")
_FORBIDDEN = regex(r'["{}]')
"""What the words of `{out="words"}` cannot hold."""


class PrintedLine(Struct, frozen=True, dict=True):
    """A line of output, or a row of a recorded table with its cells joined."""

    text: str
    locate: Locate | None = None
    """Where `text[start:end]` stands in the lesson; `None` for what is not recorded."""
    is_grouped: bool = False
    """Whether commas between digits part thousands, as they all do in its output."""
    columns: tuple[tuple[int, ColumnTitle], ...] = ()
    """Of a row of a table: the end of each cell, and the title of its column."""

    def title(self, number: Number) -> ColumnTitle | None:
        """The title above a number of a table."""
        return next((title for end, title in self.columns if number.end <= end), None)

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """The numbers in it; not computed until needed, as those of most lines never are."""
        return numbers_of_quantities(self.text, scan(self.text, self.is_grouped))


class PrintedPlace(Struct, frozen=True):
    """Numbers of one printed line, one after the other."""

    output: PrintedText
    at: int
    """The index of the line."""
    numbers: tuple[Number, ...]

    @property
    def line(self) -> PrintedLine:
        return self.output.lines[self.at]

    @property
    def first(self) -> int:
        """The index of its first number in the line."""
        return self.line.numbers.index(self.numbers[0])

    @property
    def text(self) -> str:
        """The numbers as printed."""
        return ", ".join(number.text for number in self.numbers)

    @property
    def before(self) -> str:
        """What stands before them in their line."""
        return self.line.text[: self.numbers[0].start]

    @property
    def after(self) -> str:
        """What stands after them, without white space at its start."""
        return self.line.text[self.numbers[-1].end :].lstrip().replace("\u2212", "-")

    @property
    def units(self) -> list[UnitText]:
        """The units that are printed with them."""
        return [self.output.unit(self.at, number) for number in self.numbers]

    def names(self, unit: UnitText) -> bool:
        """Whether a unit stands behind their row, right before them, in brackets, or above."""
        heading = self.output.headings(self.at)
        bracketed = _IN_BRACKETS.findall(f"{heading} {self.before}")
        parts = [part for text in bracketed for part in (text, *text.split(","))]
        last = self.before.split()[-1:]
        units = [read_unit(part.strip(" :,()[]")) for part in (*parts, *heading.split(), *last)]
        unit_of_row = unit_behind(_REST_OF_ROW.sub("", self.after, count=1))
        return any(is_same_unit(unit, candidate) for candidate in (*units, unit_of_row))

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels of all numbers of the line."""
        return self.output.labels(self.at)

    def quantity(self, words: str = "") -> tuple[str, str] | None:
        """What the first of them is called: the heading, and its label or the words that name it.

        `None` where it has no label: then nothing says that it is another than one with a label.
        """
        label = words or masked(self.labels[self.first])
        return (self.output.heading(self.at), label) if any(map(str.isalpha, label)) else None

    @property
    def address(self) -> Address | None:
        """`None` where nothing tells their line from others, which have other numbers there."""
        heading, words = self.output.heading(self.at), self.output.words[self.at]
        for depth in range(-1, self.first + 1):
            name, names = self.output.names(self.at, depth)
            if names.count(name) == 1:
                return Address(words, self.first, heading, name, names if name else ())
        address = Address(words, self.first, heading)
        return address if self.output.find(address, len(self.numbers)) else None

    @property
    def span(self) -> Span | None:
        """Where they are recorded."""
        locate = self.line.locate
        return None if locate is None else locate(self.numbers[0].start, self.numbers[-1].end)


class PrintedText:
    """The lines of one output."""

    def __init__(self, lines: Iterable[PrintedLine]) -> None:
        self.lines = tuple(lines)
        self.labels = cache(self._read_labels)
        self.leads = cache(self._read_leads)
        self.contexts = cache(self._read_contexts)
        self._headings: list[int] = []
        """The index of the heading of each line; -1 for none."""
        heading = -1
        for at, line in enumerate(self.lines):
            self._headings.append(heading)
            words = self.words[at]
            if any(map(str.isalpha, words)) and (not line.numbers or words.endswith(":")):
                heading = at

    @classmethod
    def of_run(cls, stdout: str, filters: Iterable[Filter] = ()) -> PrintedText:
        """What a run printed."""
        lines = Side.of(stdout, filters).lines
        is_grouped = has_groups("\n".join(lines))
        return cls(PrintedLine(line, None, is_grouped) for line in lines)

    @classmethod
    def of_recording(cls, recording: Recording, filters: Iterable[Filter] = ()) -> PrintedText:
        """A recorded output; without filters, as the author sees it."""
        body = recording.body
        if isinstance(body, Table):
            return cls.of_rows(body, table_rows(body))
        side = Side.of(body.text, filters)
        is_grouped = has_groups("\n".join(side.lines))

        def locate(at: int, start: int, end: int) -> Span:
            return body.span(*side.origin(at, start, end))

        lines = enumerate(side.lines)
        return cls(PrintedLine(line, partial(locate, at), is_grouped) for at, line in lines)

    @classmethod
    def of_rows(cls, table: Table, rows: Sequence[Sequence[RowCell]]) -> PrintedText:
        """The rows of a table as lines, with the titles of its columns."""
        titles = list(map(ColumnTitle.of, table.header))
        texts = [" ".join(as_printed(c.mapped.text, table.comma) for c in row) for row in rows]
        is_grouped, lines = has_groups("\n".join(texts)), []
        gap = MappedText.substitute_for(0, 0, " ")

        def locate(mapped: MappedText, start: int, end: int) -> Span:
            return Span(table.span.source, *mapped.origin(start, end))

        for row, text in zip(rows, texts, strict=True):
            ends = accumulate(len(cell.mapped.text) + 1 for cell in row)
            columns = tuple((end - 1, titles[c.column]) for end, c in zip(ends, row, strict=True))
            mapped = MappedText.join([part for cell in row for part in (gap, cell.mapped)][1:])
            lines.append(PrintedLine(text, partial(locate, mapped), is_grouped, columns))
        return cls(lines)

    # --- what is printed with a number

    @cached_property
    def words(self) -> list[str]:
        """The words of each line, with `#` for numbers."""
        return [masked(line.text, line.is_grouped) for line in self.lines]

    @property
    def numbers(self) -> tuple[tuple[str, ...], ...]:
        """The numbers of each line, as they are printed."""
        return tuple(tuple(number.text for number in line.numbers) for line in self.lines)

    def heading(self, at: int) -> str:
        """The heading of a line, by its index; behind its own where it has those words twice."""
        return self._names_of_headings[self._headings[at]]

    @cached_property
    def _names_of_headings(self) -> dict[int, str]:
        places = sorted({*self._headings} - {-1})
        counts = Counter(self.words[at] for at in places)
        names = {-1: ""}
        for at in places:
            words, outer = self.words[at], self._headings[at]
            is_told = outer >= 0 and self.words[outer] != words and not self.lines[at].numbers
            is_named = counts[words] > 1 and is_told
            names[at] = f"{self.words[outer]} / {words}" if is_named else words
        return names

    def headings(self, at: int) -> str:
        """The heading of a line behind its own: what stands above a table, and its titles."""
        line = self._headings[at]
        return f"{self.heading(line)} {self.heading(at)}" if line >= 0 else ""

    def title(self, at: int, number: Number) -> str:
        """The title of the column that a number stands in; empty where there is none."""
        if (title := self.lines[at].title(number)) is not None:
            return title.text
        first = heading = self._headings[at]
        if heading < 0 or self.words[heading].endswith(":"):
            return ""
        while first > max(0, heading - 2) and self._headings[first] == first - 1:
            first -= 1
        headers = [line.text for line in self.lines[first : heading + 1]]
        return title_above(self.lines[at].text, number, headers[::-1])

    def unit(self, at: int, number: Number) -> UnitText:
        """The unit that is printed with a number."""
        above = [line.text for line in self.lines[:at]]
        title = self.lines[at].title(number)
        unit = unit_of_printed(self.lines[at].text, number, above)
        return unit if unit or title is None else title.unit

    def _read_labels(self, at: int) -> tuple[str, ...]:
        """The labels of the numbers of a line: what stands before them, and above."""
        pairs = zip(self.leads(at), self.lines[at].numbers, strict=True)
        return tuple(f"{lead} {self.title(at, number)}".strip() for lead, number in pairs)

    def _read_leads(self, at: int) -> list[str]:
        """What stands before the numbers of a line, behind the one before with its unit.

        Those in a name, as in `T(0.25) = 79.3`, are no values: nothing stands before them.
        """
        text, start, leads = self.lines[at].text, 0, []
        arguments = [match.span() for match in _ARGUMENTS.finditer(text)]
        for number in self.lines[at].numbers:
            if any(a < number.start < b for a, b in arguments):
                leads.append("")
                continue
            leads.append(text[start : number.start])
            start = number.end
            if unit := unit_behind(text, start):
                rest = text[start:].lstrip()
                word = unit.text if rest.startswith(unit.text) else rest.partition(" ")[0]
                start = len(text) - len(rest) + len(word)
        return leads

    # --- addresses

    @cached_property
    def _by_words(self) -> dict[tuple[str, str], list[int]]:
        lines: dict[tuple[str, str], list[int]] = {}
        for at, words in enumerate(self.words):
            heading = self._headings[at]
            names = {self.heading(at), self.words[heading] if heading >= 0 else ""}
            for name in names:  # records may hold the shorter one
                lines.setdefault((name, words), []).append(at)
        return lines

    def names(self, at: int, depth: int) -> tuple[str, tuple[str, ...]]:
        """The name of a line, of so many of its numbers, and those of all lines of its words."""
        siblings = self._by_words[self.heading(at), self.words[at]]
        in_heading = len({self._numbers(self._headings[sibling]) for sibling in siblings}) > 1
        names = (self._name(sibling, depth, in_heading) for sibling in siblings)
        return self._name(at, depth, in_heading), tuple(names)

    def find(self, address: Address, count: int) -> PrintedPlace | None:
        """What stands at an address, `count` numbers; `None` where that is not certain."""
        lines = self._by_words.get((address.heading, address.line), [])
        if address.name and lines:
            depth = len(address.name.split()) - len(self._numbers(self._headings[lines[0]]))
            in_heading = not address.name.startswith("#")
            names = [self._name(at, depth, in_heading) for at in lines]
            is_intact = {*names} <= {*address.names} or {*names} >= {*address.names}
            pairs = zip(lines, names, strict=True)
            lines = [at for at, name in pairs if is_intact and name == address.name]
        end = address.place + count
        places = [
            PrintedPlace(self, at, self.lines[at].numbers[address.place : end]) for at in lines
        ]
        is_certain = len({place.text for place in places}) == 1
        return places[0] if is_certain and len(places[0].numbers) == count else None

    def _numbers(self, at: int) -> tuple[str, ...]:
        numbers = self.lines[at].numbers if at >= 0 else ()
        return tuple(format(number.value.normalize(), "f") for number in numbers)

    def _name(self, at: int, depth: int, in_heading: bool) -> str:
        """The numbers of a line's heading and the first `depth` of its own; none for depth -1.

        `in_heading`: whether those of the heading count.
        """
        heading, numbers = self._numbers(self._headings[at]), self._numbers(at)
        heading = heading if in_heading else ("#",) * len(heading)
        return "" if depth < 0 else " ".join(heading + numbers[:depth])

    # --- words that an author types

    def find_words(self, words: str, count: int) -> list[PrintedPlace]:
        """The numbers, `count` in a row, that have these words right before them, or as a title.

        In the words `#` stands for any number; signs around them do not count. What leaves words
        out is read so only where no number has the words as they are.
        """
        sought = _split(words)
        for kind in (0, 1):
            contexts = ((p, self.contexts(p.at, p.first)[kind]) for p in self.places(count))
            if matches := [p for p, some in contexts if any(_ends_with(c, sought) for c in some)]:
                return matches
        return []

    def places(self, count: int) -> Iterator[PrintedPlace]:
        """All runs of so many numbers of one line."""
        for at, line in enumerate(self.lines):
            for first in range(len(line.numbers) - count + 1):
                yield PrintedPlace(self, at, line.numbers[first : first + count])

    def is_called(self, at: int, first: int, words: str) -> bool:
        """Whether words are all that is printed right before a number, or all of its title."""
        title = self.title(at, self.lines[at].numbers[first])
        names = (self.leads(at)[first], title, name_of_header(title)[0])
        return _split(words) in map(_split, names)

    def words_before(self, place: PrintedPlace, rivals: Iterable[PrintedPlace] = ()) -> str:
        """The fewest words that tell printed numbers from the others of the output and `rivals`.

        Where none do, those that tell them from the rivals; empty where that is impossible, too.
        """
        rivals = [*rivals]
        groups = filter(None, ([*self.places(1), *rivals], rivals))
        return next(filter(None, (self._words_among(group, place) for group in groups)), "")

    def _words_among(self, places: Iterable[PrintedPlace], place: PrintedPlace) -> str:
        address = self, place.at, place.first
        rivals = {(p.output, p.at, p.first) for p in places} - {address}
        outputs = dict.fromkeys((self, *(output for output, _, _ in rivals)))
        in_heading = len(_split(self.heading(place.at)))
        choices: list[tuple[bool, bool, int, str]] = []

        def is_alone(text: str) -> bool:
            matches = (p for output in outputs for p in output.find_words(text, 1))
            addresses = {(p.output, p.at, p.first) for p in matches}
            return address in addresses and rivals.isdisjoint(addresses)

        for context in chain(*self.contexts(place.at, place.first)):
            numbers = [at for at, word in enumerate(context) if word.startswith("\0")]
            plain_words = ["#" if at in numbers else word for at, word in enumerate(context)]
            row_words = [*plain_words]
            for at in [at for at in numbers if at >= in_heading][:1]:  # it may name its line
                row_words[at] = context[at].removeprefix("\0")
            for words in (plain_words, row_words):
                for start in range(len(words) - 1, -1, -1):
                    is_unit = start - 1 in numbers and bool(unit_behind(words[start]))
                    text = " ".join(words[start:])
                    if words[start] == "#" or is_unit:
                        continue
                    if _FORBIDDEN.search(text):
                        break
                    if is_alone(text):
                        is_result = words is row_words  # a number may be another tomorrow
                        choices.append((is_result, "#" in text, len(words) - start, text))
                        break
        if choices:
            return min(choices, key=lambda choice: choice[:3])[3]
        lead = self.leads(place.at)[place.first] or self.title(place.at, place.numbers[0])
        label = " ".join(word.removeprefix("\0") for word in _split(lead))
        is_shared = any(output.is_called(line, first, label) for output, line, first in rivals)
        return "" if is_shared or _FORBIDDEN.search(label) else label

    def _read_contexts(self, at: int, first: int) -> tuple[list[_Words], list[_Words]]:
        """All words before a number, also the heading's, and again with the title of the column.

        Then with the label right behind what its row begins with. It may stand without its unit.
        """
        line = self.lines[at]
        number = line.numbers[first]
        heading, title = self.heading(at), self.title(at, number)
        before = f"{heading} {line.text[: number.start]}"
        whole, abridged = [before, f"{before} {title}"] if title else [before], list[str]()
        if first > 0:
            end = line.numbers[0].end + len(unit_behind(line.text, line.numbers[0].end).text) + 1
            above = self.heading(self._headings[at]) if line.title(number) is None else ""
            label = title or self.leads(at)[first]
            abridged += (f"{words} {line.text[:end]} {label}" for words in (heading, above))
            if title:
                abridged += (f"{above} {title}", f"{line.text[: line.numbers[0].start]} {title}")

        def read(texts: Sequence[str]) -> list[_Words]:
            bare_texts = [_UNIT_IN_BRACKETS.sub("", text) for text in texts]
            bare_title = name_of_header(title)[0]
            bare_texts += (text.removesuffix(title) + bare_title for text in texts if title)
            return list(dict.fromkeys(map(_split, (*texts, *bare_texts))))

        return read(whole), read(abridged)


def _split(text: str) -> _Words:
    places = ((n.start, n.end, f" \0{plain_text(n.text)} ") for n in scan(text))
    words = (word.strip('=:,;()[]|<>~/"') for word in replace_ranges(text, places).split())
    return tuple(filter(None, words))


def _ends_with(context: _Words, sought: _Words) -> bool:
    """Whether words end with others, in which `#` is any number."""
    return 0 < len(sought) <= len(context) and all(
        word == sought_word or (sought_word == "#" and word.startswith("\0"))
        for word, sought_word in zip(reversed(context), reversed(sought), strict=False)
    )
