"""The text of a bound number, and which printed numbers it may mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.scripts.lines import plain_text, replace_ranges
from coursebuild.core.scripts.printed_text import PrintedLine, PrintedPlace, PrintedText
from coursebuild.core.text.numbers import (
    Number,
    as_printed,
    decimal_gaps,
    group_space,
    join_thousands,
    round_like,
    scan_prose,
    within_half_unit,
    write_comma,
)
from coursebuild.core.text.quantities import (
    UnitText,
    are_different,
    is_same_unit,
    numbers_of_quantities,
    unit_behind,
)
from coursebuild.core.text.regex import regex

_STRAY = regex(r"[-+*/.,:;=_]+\d*|-?[eE][-+]+\d*|[-+][eE]\d*")
"""What beside a number is neither a unit nor a word: `-9.81-` and `0..981` have a slip."""


_DECIMALS = regex(r"\.?[0-9]{1,3}")
"""Decimals in threes, the first with their point."""
_STRAY_INSIDE = regex(r"[-+*/=_]+(?=\s)")


def shows(number: Number, printed: Number) -> bool:
    """Whether a number in prose is a printed one, rounded to the digits shown."""
    if number.is_padded and not printed.is_padded:
        return False
    if not (number.is_finite and printed.is_finite):
        return (number.value.is_nan() and printed.value.is_nan()) or number.value == printed.value
    if number.is_integer and printed.is_integer:
        return number.value == printed.value
    return within_half_unit(number, printed.value)


class BoundText(Struct, frozen=True):
    """The text of a binding: its numbers and the text around; without numbers, `before` is all."""

    text: str
    before: str
    numbers: tuple[Number, ...]
    after: str

    comma: str = ""
    """What stood before decimals, if a comma or TeX's `{,}` did; here it is a point."""
    space: str = ""
    """What parted thousands, if a space or TeX's `{,}` did; here it is a comma."""
    decimal_space: str = ""
    """What parted decimals in threes, if a space did; here nothing does."""

    @classmethod
    def of(cls, text: str, comma: bool = False, *, may_join: bool = False) -> BoundText:
        """The numbers and the plain text of a binding, in a language that may have the comma.

        `may_join`: spaces, also ordinary ones, may part thousands, and groups of decimals.
        """
        if gaps := decimal_gaps(text, comma) if may_join else ():
            without_gaps = replace_ranges(text, ((*gap, "") for gap in gaps))
            bound_text = cls.of(without_gaps, comma, may_join=True)
            return replace(bound_text, decimal_space=text[slice(*gaps[0])])
        sign = "{,}" if "{,}" in text else ","
        text = text.replace(sign, ",")
        pointed = as_printed(join_thousands(text) if may_join else text, comma)
        if pointed != text:
            sign = sign if comma else ""
            return replace(cls.of(pointed), comma=sign, space=group_space(text))
        numbers = numbers_of_quantities(text, scan_prose(text))
        if not numbers:
            return cls(text, plain_text(text), (), "")
        before, after = text[: numbers[0].start], text[numbers[-1].end :]
        thousands = "" if sign == "," else sign
        return cls(text, plain_text(before), numbers, plain_text(after), space=thousands)

    @property
    def bare(self) -> BoundText:
        """Its numbers without the words around them."""
        return replace(self, before="", after="")

    def shows(self, place: PrintedPlace) -> bool:
        """Whether the printed numbers, rounded, are those of the binding."""
        return all(map(shows, self.numbers, place.numbers))

    def rewrite(self, place: PrintedPlace) -> str:
        """The binding's text with printed numbers in it, rounded to the digits that it shows.

        Empty where its notation cannot hold a printed number, or one would be rounded to zero.
        """
        places: list[tuple[int, int, str]] = []
        for number, printed in zip(self.numbers, place.numbers, strict=True):
            rounded = round_like(number, printed.value) if printed.is_finite else None
            if rounded is None or (printed.value and not any(n.value for n in scan_prose(rounded))):
                return ""
            places.append((number.start, number.end, self.as_written(rounded)))
        return replace_ranges(self.text, places)

    def as_written(self, number: str) -> str:
        """A printed number with the decimal comma, and the spaces between digits, that it has."""
        if self.decimal_space:
            number = re.sub(
                r"\.[0-9]{4,}", lambda m: self.decimal_space.join(_DECIMALS.findall(m[0])), number
            )
        number = write_comma(number).replace(",", self.comma) if self.comma else number
        return number.replace("." if self.comma else ",", self.space) if self.space else number

    def is_in(self, outputs: Iterable[PrintedText]) -> bool:
        """Whether printed numbers that may be meant, rounded, are those of the binding."""
        return bool(self.candidates(outputs))

    def candidates(self, outputs: Iterable[PrintedText], following: str = "") -> list[PrintedPlace]:
        """The printed numbers that it may show, each place once; `following` stands behind it."""
        places = self.shown_places(outputs)
        if self.stray:
            places = [p for p in places if all(test(p) for test in self._context_tests())]
        unit = unit_behind(self.after or following)

        def has_unit(place: PrintedPlace) -> bool:
            return bool(unit) and is_same_unit(unit, place.units[-1])

        for test in (has_unit, self._is_verbatim):
            places = list(filter(test, places)) or places
        unique = {
            (p.output.heading(p.at), plain_text(p.line.text), p.first): p for p in reversed(places)
        }
        return list(reversed(unique.values()))

    def _is_verbatim(self, place: PrintedPlace) -> bool:
        """Whether the numbers are printed exactly as they are shown."""
        texts = [[plain_text(n.text) for n in numbers] for numbers in (self.numbers, place.numbers)]
        return texts[0] == texts[1]

    def shown_places(self, outputs: Iterable[PrintedText]) -> list[PrintedPlace]:
        """The printed numbers that may be meant, and are those of the binding."""
        return list(filter(self.shows, self.places(outputs)))

    def wrong_unit(
        self, places: Iterable[PrintedPlace], following: str
    ) -> tuple[Number, str, str] | None:
        """A printed number with its unit, and the unit that it has here, if that is another.

        `places` are printed numbers, and `following` is what stands behind the binding.
        """
        shown_units = self.units(following)
        difference: tuple[Number, str, str] | None = None
        for place in places if any(shown_units) else ():
            pairs = zip(place.numbers, shown_units, place.units, strict=True)
            mismatches = ((n, p.text, s.text) for n, s, p in pairs if are_different(s, p))
            difference = next(mismatches, None)
            if difference is None:
                return None
        return difference

    def units(self, following: str) -> list[UnitText]:
        """The units of its numbers, the last of which may have its own in what follows."""
        ends = [*(number.start for number in self.numbers), len(self.text)][1:]
        texts = [self.text[n.end : end] for n, end in zip(self.numbers, ends, strict=False)]
        if texts and not texts[-1].strip():
            texts[-1] = following
        return list(map(unit_behind, texts))

    @property
    def stray(self) -> str:
        """A sign beside a number that is neither a unit nor a word: `-9.81-`, `2= of 20`."""
        gaps = (_STRAY_INSIDE.match(gap) for gap in self._gaps(self.text, self.numbers))
        texts = (self.before.strip(), self.after.strip(), *(gap[0] for gap in gaps if gap))
        return next(filter(_STRAY.fullmatch, texts), "")

    @staticmethod
    def _gaps(text: str, numbers: Sequence[Number]) -> list[str]:
        """What stands between numbers of a text."""
        return [text[a.end : b.start] for a, b in pairwise(numbers)]

    def places(self, outputs: Iterable[PrintedText]) -> list[PrintedPlace]:
        """The printed numbers that may be meant: those with the same text around, if any."""
        places = [place for output in outputs for place in output.places(len(self.numbers))]
        for test in self._context_tests():
            places = list(filter(test, places)) or places
        return places

    def _context_tests(self) -> Iterator[Callable[[PrintedPlace], bool]]:
        """Tests of whether printed numbers have the same text after, and before, them."""
        if self.after:
            after, unit = re.compile(_whole_words(self.after)), unit_behind(self.after)
            if unit.text == self.after.strip():  # it need not be printed, nor be spelt so
                yield lambda place: not place.units[-1] or is_same_unit(unit, place.units[-1])
            else:
                yield lambda place: after.match(place.after) is not None
        gaps = self._gaps(self.text, self.numbers)
        if any(map(_STRAY_INSIDE.match, gaps)):
            words = [*map(plain_text, gaps)]
            yield lambda p: [*map(plain_text, self._gaps(p.line.text, p.numbers))] == words
        if self.before:
            before = re.compile(_whole_words(self.before) + r"\Z")
            reach = 4 * len(self.before) + 200
            yield lambda place: before.search(plain_text(place.before[-reach:])) is not None


def _whole_words(text: str) -> str:
    """A pattern for a text with white space of any width, not starting or ending inside a word."""
    lead = r"(?<!\w)" if text[:1].isalnum() else ""
    tail = r"(?![\w/^·²³⁻])" if text[-1:].isalnum() else ""  # `m` is no part of `m/s`
    return lead + r"\s+".join(re.escape(word) for word in text.split()) + tail


def text_places(text: str, lines: Iterable[PrintedLine]) -> Iterator[tuple[PrintedLine, int, int]]:
    """Where a text, if any, stands in printed lines: whole words, white space of any width."""
    pattern = re.compile(_whole_words(text))
    for line in lines if text else ():
        for match in pattern.finditer(line.text.replace("\u2212", "-")):
            yield line, match.start(), match.end()
