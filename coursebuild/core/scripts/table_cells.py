"""Recorded tables: their cells as plain text with its places in the lesson, and their titles.

By the words and units of a title printed numbers are named.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model.lesson_record import ShownValue, shown_values
from coursebuild.core.scripts.lines import (
    CanonicalText,
    MappedText,
    SameNumber,
    apply_filters,
    canonicalize,
    numbers_fit,
    same_number,
)
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.macros import COMMAND
from coursebuild.core.text.numbers import (
    Number,
    as_printed,
    decimal_gaps,
    has_groups,
    join_thousands,
    only_number,
    round_like,
    scan_prose,
)
from coursebuild.core.text.quantities import (
    NO_UNIT,
    UnitText,
    are_different,
    is_same_unit,
    name_of_header,
    numbers_of_quantities,
    read_unit,
    unit_of_header,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span

_TEX_COMMA = regex(r"\{,\}")
_RUN = regex(r"\s{2,}|(?<![0-9])[^\S ]|[^\S ](?![0-9])")
"""What is one space in a cell; not what may part thousands."""
_SPACED_PAIR = regex(r"[0-9] [0-9]{3}(?![0-9])")
"""Two numbers, or one with its thousands apart."""
_ENDS = regex(r"\A\s+|\s+\Z")


class LineLayout(NamedTuple):
    """What is left of a line without the cells of a row."""

    heading: str
    parts: tuple[str, ...]
    """Before, between and after the cells."""
    columns: tuple[int, ...]


class RowCell(Struct, frozen=True):
    """A cell of a recorded table."""

    cell: model.Cell
    column: int
    mapped: MappedText
    canonical: CanonicalText
    """Without the unit."""
    unit: UnitText = NO_UNIT
    """That of its last number, if it ends with one: it need not be printed, nor be spelt so."""

    @classmethod
    def of(
        cls, cell: model.Cell, column: int, mapped: MappedText, text: str, is_grouped: bool
    ) -> RowCell:
        """A cell with its text, in which numbers are as programs print them."""
        numbers = numbers_of_quantities(text, scan_prose(text))
        end = numbers[-1].end if numbers else len(text)
        if unit := read_unit(text[end:]):
            text = text[:end]
        canonical = canonicalize(text, has_powers=True, is_grouped=is_grouped)
        return cls(cell, column, mapped, canonical, unit)

    @property
    def unit_span(self) -> Span:
        """Where its unit stands in the lesson."""
        text, end = self.mapped.text, self.canonical.numbers[-1].end
        start = len(text) - len(text[end:].lstrip())
        return Span(self.cell.span.source, *self.mapped.origin(start, len(text)))

    def span(self, number: Number) -> Span:
        """Where a number of the cell stands in the lesson."""
        return Span(self.cell.span.source, *self.mapped.origin(number.start, number.end))


ELISIONS = ("\u2026", "...")
"""A cell that is left out; a row of such cells stands for any printed rows."""


def table_rows(
    table: model.Table, filters: Iterable[model.Filter] = (), printed: str = ""
) -> tuple[tuple[RowCell, ...], ...]:
    """The body rows of a table; cells without text, or left out, and rows of such are not there.

    Commas and spaces between digits part thousands unless they do not so in what is printed.
    """
    rules = tuple(filters)
    is_grouped = "," not in printed or has_groups(printed)
    has_pairs = _SPACED_PAIR.search(printed) is not None

    def read(cell: model.Cell, column: int, mapped: MappedText) -> RowCell:
        text = mapped.text
        if not has_pairs:
            gaps = decimal_gaps(text, table.comma)
            mapped = mapped.replace_ranges(dict.fromkeys(gaps, ""))
            text = join_thousands(mapped.text)
        text = _printed_name(as_printed(text, table.comma), printed)
        return RowCell.of(cell, column, mapped, text, is_grouped)

    rows = (
        tuple(
            read(cell, column, mapped)
            for column, cell in enumerate(row)
            if (mapped := cell_text(cell, rules)).text not in ("", *ELISIONS)
        )
        for row in table.rows
    )
    return tuple(row for row in rows if row)


def _printed_name(text: str, printed: str) -> str:
    """A name as it is printed: `T\u2080` as `T0`, `\u03c9` as `omega`, `v_1` as `v1`."""
    if text in printed or scan_prose(text):
        return text
    name = "".join(map(_spell, unicodedata.normalize("NFKD", text)))
    names = (name.translate(dict.fromkeys(map(ord, signs))) for signs in ("", "\\{}", "\\{}_^"))
    return next((name for name in names if name and name in printed), text)


def elides_rows(table: model.Table) -> bool:
    """Whether a row of a table stands for printed rows that it does not show."""
    return any(all(cell_text(c, ()).text in ELISIONS for c in row) for row in table.rows)


def row_text(row: Iterable[RowCell]) -> str:
    """The cells of a row as one line."""
    return "  ".join(cell.mapped.text for cell in row)


def row_values(
    document: model.Document, recording: model.Recording, filters: Iterable[model.Filter] = ()
) -> tuple[ShownValue, ...]:
    """The rows of a recorded table as values that a lesson shows."""
    if not isinstance(recording.body, model.Table) or recording.script is None:
        return ()
    number = model.output_numbers(document)[recording.span.start]
    path, before = document.source.path, f"row of output {number}"
    rows = table_rows(recording.body, filters)
    return tuple(shown_values((path, recording.script, before, row_text(row)) for row in rows))


def cell_text(
    cell: model.Cell, filters: Iterable[model.Filter], *, formula_sign: str = ""
) -> MappedText:
    """The plain text of a cell, filtered; origins are offsets in the lesson's source.

    Marks of Markdown are gone, minus signs are hyphens, runs of white space are one space. A
    stretch that Markdown changed (entities, escapes) stands for all of itself.
    """
    stretches: list[MappedText] = []
    for inline in model.walk_inlines(cell.children, numbers=False):
        span = inline.span
        match inline:
            case model.Text():
                text = inline.text
            case model.CodeSpan():
                # Between the backticks, without padding
                markdown, text = span.text, inline.text
                edge = len(markdown) - len(markdown.lstrip("`"))
                if len(markdown) - 2 * edge == len(text) + 2:
                    edge += 1
                span = Span(span.source, span.start + edge, span.end - edge)
            case model.NumberBinding():
                text, span = inline.text, inline.text_span
            case model.Math():
                sign = MappedText.substitute_for(span.start, span.start, formula_sign)
                # What a macro stands for stands where its name does, and `{,}` is a comma.
                tex, starts = (
                    inline.tex,
                    [inline.tex.offset(at) for at in range(len(inline.tex.text))],
                )
                names = [COMMAND.match(tex.source.text, start) for start in starts]
                pairs = zip(starts, names, strict=True)
                ends = [start + 1 if name is None else name.end() for start, name in pairs]
                formula = MappedText(tex.text, starts, ends).substitute(_TEX_COMMA, ",")
                stretches += (sign, formula, sign)
                continue
            case model.Image():
                text = inline.alt
            case model.SoftBreak() | model.HardBreak():
                text = " "
            case model.RawInline():
                text = " " if inline.html.startswith("<br") else ""
            case _:
                continue
        stretches.append(
            MappedText.copy(text, span.start)
            if span.text == text
            else MappedText.substitute_for(span.start, span.end, text)
        )
    mapped = apply_filters(MappedText.join(stretches), filters)
    folded = mapped.substitute(_RUN, " ").substitute(_ENDS, "")
    return MappedText(folded.text.replace("\u2212", "-"), folded.starts, folded.ends)


def cell_matches(recorded: Number, printed: Number, comparison: model.Comparison) -> bool:
    """Whether a number in a cell is the printed one: also a `2` for `2.0`, `1,234` for `1234`."""
    if recorded.text.replace(",", "") == printed.text.replace(",", ""):
        return True
    is_exact = comparison.mode is model.Mode.EXACT or recorded.is_padded or printed.is_padded
    is_equal = not is_exact and recorded.value == printed.value
    return is_equal or same_number(recorded, printed, comparison)


def number_text(old: Number, new: Number, comparison: model.Comparison) -> str:
    """A printed number as it replaces a recorded one."""
    has_more = new.place < old.place or only_number(old.text) is None  # `3.9 × 10⁻¹¹`
    is_rounded = comparison.mode is model.Mode.DIGITS and old.is_inexact and has_more
    if is_rounded and new.is_finite:
        return round_like(old, new.value) or new.text
    if "," in old.text and re.fullmatch(r"[-+]?[\d.,]+", new.text):
        return format(new.value, "+,f" if new.text.startswith("+") else ",f")
    return new.text


def find_rows(
    row: Sequence[RowCell], line: CanonicalText, start: int, numbers_match: SameNumber
) -> Iterator[tuple[int, ...]]:
    """The ways in which the cells stand in a line in order, as whole words and numbers."""
    if not row:
        yield ()
        return
    cell, text = row[0].canonical, row[0].canonical.skeleton
    before = r"(?<!\w)" if _WORD_CHARACTER.match(text[0]) else ""
    after = r"(?!\w)" if _WORD_CHARACTER.match(text[-1]) else ""
    pattern = re.compile(f"(?={before}{re.escape(text)}{after})")
    for place in (match.start() for match in pattern.finditer(line.skeleton, start)):
        if numbers_fit(cell, line, place, numbers_match):
            for rest in find_rows(row[1:], line, place + len(text), numbers_match):
                yield (place, *rest)


_WORD_CHARACTER = regex(r"\w")
_WORD = regex(r"[^\W_]+")
_PARTS = regex(r"[,;|]|[:=](?=.*\w)")
"""Between the parts of what stands before a number."""
_SIGN = regex(r"[:=](?=\s*\Z)")
HEADER_HELP = (
    "write the unit that is printed, or put the columns in order; where a unit is not meant, mark "
    'it: `` `s`{given="…"} ``'
)
ROW_HELP = "rows, and the cells of each, stand in the order in which they are printed"


def refusal(
    span: Span, message: str, help: str = "bring the row up to date by hand", label: str = ""
) -> Diagnostic:
    """An output that cannot be brought up to date."""
    return diagnose("output-not-updatable", span, message, label=label, help=help)


class ColumnTitle(Struct, frozen=True):
    """The title of a column."""

    span: Span
    text: str
    name: str
    """The text without the unit."""
    words: frozenset[str]
    unit: UnitText
    """None where its source is said, as in `` τ (`s`{given="a guess"}) ``; so with words."""
    unit_span: Span

    @classmethod
    def of(cls, cell: model.Cell) -> ColumnTitle:
        """The words and the unit of a cell of a header."""
        title = cell_text(cell, (), formula_sign="$")
        unit = unit_of_header(title.text)
        inlines = model.walk_inlines(cell.children)
        bindings = (i for i in inlines if isinstance(i, model.NumberBinding))
        excepted_text = " ".join(i.text for i in bindings if i.source is not None)
        name, at = name_of_header(title.text)
        name, text = (part.replace("$", "") for part in (name, title.text))
        unit_span = cell.span
        if at >= 0:
            unit_span = Span(cell.span.source, *title.origin(at, at + len(unit.text)))
        words = words_of(name) - words_of(excepted_text)
        if excepted_text:
            name, unit = "", NO_UNIT
        return cls(cell.span, text, name, words, unit, unit_span)

    def has(self, word: str) -> bool:
        """Whether a printed word is one of the title, or a mere sign."""
        return not words_of(word) or words_of(word) <= self.words

    def is_printed_as(self, printed: str) -> bool:
        """Whether a printed title has the same words, whatever its unit."""
        words = words_of(printed)
        units = words_of(f"{unit_of_header(printed).text} {self.unit.text}")  # `rain_mm`
        return bool(self.words) and self.words <= words and words - self.words <= units

    def best_places(self, labels: Iterable[str]) -> list[int]:
        """The numbers of a line, by index, in whose labels most of the title's words are."""
        shared = [len(self.words & words_of(label)) for label in labels]
        most = max(shared, default=0)
        return [at for at, count in enumerate(shared) if count == most] if most else []

    def names(
        self, labels: Sequence[str], at: int, unit: UnitText, unit_of_cell: UnitText = NO_UNIT
    ) -> bool | None:
        """Whether number `at` of a line is what the title says; `None` where nothing tells.

        `labels` are those of all numbers of the line, and `unit` the unit of this one.
        """
        own_unit = unit_of_cell or self.unit
        if are_different(own_unit, unit):
            return False
        if best := self.best_places(labels):
            return at in best
        return True if is_same_unit(own_unit, unit) else None


class PrintedName(NamedTuple):
    """What a printed number is called: by what stands before it in its line, or above it."""

    before: str
    """From the number before it, behind that one's unit."""
    above: str
    number: str
    unit: UnitText

    @property
    def label(self) -> str:
        """The last part of what stands before it."""
        return _PARTS.split(self.before)[-1].lstrip(" ([{")

    @property
    def text(self) -> str:
        """The title above it, or its label."""
        return self.above or self.label.rstrip(" :=")

    @property
    def reading(self) -> str:
        """It with its number, as printed."""
        return f"{self.above} {self.number}" if self.above else f"{self.label}{self.number}"

    @property
    def is_certain(self) -> bool:
        """Whether it is of this number alone: a word may also stand behind one, or name a list."""
        return bool(self.above or _SIGN.search(self.label))

    def may_follow(self, number: PrintedName) -> bool:
        """Whether it may be a word behind the number before it."""
        is_signed_alike = {*_SIGN.findall(self.label)} & {*_SIGN.findall(number.label)}
        is_word = self.before.lstrip()[:1].isalnum() and not _PARTS.search(self.before)
        return is_word and not is_signed_alike and not self.above


def misplaced_titles(
    titles: Sequence[ColumnTitle], numbers: Sequence[PrintedName], places: Mapping[int, int]
) -> Iterator[tuple[int, int, bool]]:
    """The columns whose title is the name of another number of the line, and of which one.

    `places`: the index in the line of the number of each column. Whether it is certain comes last:
    a name may be of what follows as well, and a word may stand behind its number; not so if
    another title of the line shows where its names stand.
    """
    verdicts: list[tuple[int, int, bool]] = []
    title_at = {place: titles[column] for column, place in places.items()}
    for column, place in places.items():
        title, own_name = titles[column], numbers[place]
        text = squeeze(title.text)
        matches = [
            at
            for at, name in enumerate(numbers)
            if text == squeeze(name.above) or squeeze(name.text) == squeeze(title.name) != ""
        ]
        matches = matches or [a for a, n in enumerate(numbers) if title.is_printed_as(n.text)]
        at = matches[0] if matches and place not in matches else place
        if at < place and (own_name.above or words_of(own_name.text)):
            are_titles = any(title.is_printed_as(own_name.text) for title in titles)
            is_certain = own_name.is_certain or are_titles
        elif at > place:
            is_next = not any(words_of(name.before) for name in numbers[place + 1 : at])
            is_certain = not (is_next and numbers[at].may_follow(own_name))
            own_words = title_at[at].words if at in title_at else frozenset()
            phrase = words_of(" ".join(name.before for name in numbers[:at]))
            if not is_certain and numbers[at].is_certain and own_words and own_words <= phrase:
                continue  # `rms error after 40 steps: 0.002`
        else:
            continue
        has_unit = is_same_unit(title.unit, numbers[at].unit)
        is_certain |= has_unit and not is_same_unit(title.unit, own_name.unit)
        verdicts.append((column, at, is_certain))
    any_certain = any(is_certain for *_, is_certain in verdicts)
    return ((column, at, any_certain) for column, at, _ in verdicts)


def squeeze(title: str) -> str:
    """A title without spaces: `t = 10 s` is `t=10 s`."""
    return "".join(title.split())


@lru_cache(maxsize=4096)
def words_of(text: str) -> frozenset[str]:
    """The words of a title, in one notation: `T\u2080` is `t0`, and `\u03c4` is `tau`.

    A letter alone keeps its case: `T` is not `t`.
    """
    words = _WORD.findall("".join(map(_spell, unicodedata.normalize("NFKD", text))))
    return frozenset(w.casefold() if len(w) > 1 else w for w in words if not w.isdecimal())


def _spell(character: str) -> str:
    name = unicodedata.name(character, "")
    if not name.startswith("GREEK"):
        return character
    word = name.rpartition(" ")[2]
    return word.capitalize() if character.isupper() else word.lower()
