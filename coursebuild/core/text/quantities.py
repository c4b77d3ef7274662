"""The unit of a number in a line of text: behind it, in its label or above its column.

Entry points: `printed_unit(line, start, end)`, `unit_of_column(line, start, above)`, for what a
program printed; `unit_behind(text)`, `unit_of_header(text)`, for what an author writes;
`are_different(left, right)`, which is certain.

1. What has two readings is read in both: `m` is a metre or a minute, `C` a coulomb or a degree.
   Units differ if no reading of one is a reading of the other.
2. What may be no unit is none: `T` in `l 2.0 T 2.8` and `m` in `m = 2 n = 3` are names, as is `t`
   in `x(t)`; `in` is a word before another one, and `min` beside `max` a minimum.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Sequence
from fractions import Fraction

from msgspec import Struct

from coursebuild.core.text.numbers import Number, only_number, scan
from coursebuild.core.text.regex import regex
from coursebuild.core.text.unit_table import LEVELS, NAMES
from coursebuild.core.text.units import PER, Unit, find_units, is_name, write_quantities

_SECOND_READINGS = {
    "m": ("min",),
    "°": ("°C", "°F"),
}
"""What a symbol means in text besides."""
_RAISED = regex("[\\^⁻]")
_MAGNITUDES = frozenset("BGMP")
"""In text they count billions and millions more often than they are units."""
_SIGNS = frozenset(("/", "·", "⋅", "*", *PER, "pour", "square", "cubic", "sq", "cu"))
"""After these, more of a unit must follow."""
_AND = ("and", "und", "et", "y")
_PER_UNIT = regex(r"/[^\W\d_]")
_DIVISOR = regex(rf"\A(?:/|(?:{'|'.join(PER)}) )(?=[^\W\d_])")
"""How a unit begins that is 1 over another, as in `3 /s` and `3 per second`."""
_GAP = regex(r"[ \t]{2,}|\t")
_NEXT_COLUMN = regex(r"[ \t]{2,}|\t|[ \t]?\|[ \t]?|,(?=[^\W\d])")
_REACH = 80
_LONGEST_PRODUCT = 6
_CLOSING = ".,;:!?”\"'*_`|>}"
_UPRIGHT = regex(r"\$([^$]*\\(?:mathrm|text|textrm)[^$]*)\$")
_NUMBER = r"[-+−]?[0-9.]++(?:[eE][-+]?[0-9]++)?"
_SPREAD = regex(rf"[ \t]?(?:±|\+/?-|–|\.\.+|to)[ \t]*{_NUMBER}(?=[ \t)\]])[ \t]*[)\]]?(?! ?%)")
"""A number that shares its unit with the one before: `83.4 ± 0.2 m`, `(83.4 .. 85.0) m`.

Not so `0.5 ± 0.8 %`, which may be relative.
"""
_SPREAD_BEFORE = regex(rf"[=:)\]\s]\s*{_NUMBER}[ \t]?(?:±|\+/?-)[ \t]*\Z")
"""What stands between the label of a number and its uncertainty: `v (m/s): 83.4 ± `."""
_REST_OF_LIST = regex(rf"(?:[,; \t]++{_NUMBER})*[ \t]*[)\]]")
_BEGIN_OF_LIST = frozenset("([ \t,;+-−.eE0123456789")
"""What may stand in a list before a number of it."""
_REFERENCE = regex(r" ?\[[\^@][^\[\]]*\]")
"""A footnote or a source behind a unit."""
_FRACTION = (regex(r"\\[td]?frac\s*\{([^{}]*)\}\s*\{([^{}]*)\}"), r"(\1)/(\2)")
_TEX_SIGNS = (
    (regex(r"\^\{([-−]?\d+)\}"), r"^\1"),
    _FRACTION,
    (regex(r"\\(?:mathrm|text|textrm|operatorname)\s*(?:\{([^{}]*)\}|(\w))"), r" \1\2"),
    (regex(r"\^?\{?\\(?:circ|degree)\}?"), "°"),
    (regex(r"(?:°|\b(?:degrees?|deg|Grad)\b)\s*([CF])(?:elsius|ahrenheit)?\b"), r"°\1"),
    (regex(r"\*\*"), "^"),
    (regex(r"\\cdot"), "·"),
    (regex(r"\\mu\s*"), "µ"),
    (regex(r"\\Omega"), "Ω"),
    _FRACTION,
    (regex(r"\\%"), "%"),
    (regex(r"\\[,;:! ]|[~$]"), " "),
    (regex(r"\(\s+"), "("),
)
_BRACKET = regex(r"(?P<before>(?<!/)|[^/])[(\[](?P<unit>(?:[^()\[\]]|\([^()]*\))*)[)\]]\s*\Z")
_BRACKET_WITH_WORDS = regex(
    r"\A[^()\[\]\s]*?(?P<before>.?)[(\[](?P<unit>(?!min,)[^()\[\],]+)"
    r"(?:, [^\W\d_][^()\[\]]{2,}[)\]]|[)\]] of [^()\[\]]*)\Z"
)
"""`E (J, in total)`, `E [J] of the ball`; behind a comma another label may stand."""
_BEHIND_COMMA = regex(r"[^\W\d_]{2}|.*[/^²³°A-Z].*|[a-z]+s")
"""What is a unit behind a comma, as in `duration, ms`; another word may be one as well."""
_SOLIDUS = regex(r"\s*/\s*(?P<unit>\([^()]*\)|[^/=:]+)\Z")
_DENOMINATOR = regex(r"(?<=\w/)\([^()]*\)")
"""As in `c in J/(g K)`, a part of a unit and not the unit in brackets."""
_SYMBOL_OVER = regex(
    r"\$(?:(?!\\(?:mathrm|text))[^$/])+"
    r"(?:\$\s*/\s*(?!\s|\$(?!\\(?:mathrm|text)))|/\s*\\(?:mathrm|text))"
)
"""`$T$ / s`: what is upright is a unit, and what is not is none, where `T / s` may be one."""
_BEFORE_UNIT = regex(r"[\s/(\[,]+(?:in\s+)?\$?(?:\\(?:mathrm|text)\s*\{?)?\Z")
_IN_WORDS = regex(r"(?P<symbol>\S+)\s+in\s+(?P<unit>\S+)\Z")
_SYMBOL = regex(r"\w{1,2}|\\[a-z]+")
_TO_NUMBER = regex(r"[=:≈]?[\s\[(,;|]*(?:[-+−]?[0-9.]+(?:[eE][-+−]?[0-9]+)?[\s,;|]+)*[-+−]?\Z")
"""From the end of a label to a number, perhaps past other numbers."""
_CELLS = (
    regex(r"\u2026|[^\s|;,\u2026](?:(?!\s\s|\s*[\t|;,]|\u2026).)*"),
    regex(r"\u2026|[^\s|;,\u2026]+(?: ?[(\[](?:[^()\[\]]|\([^()\[\]]*\))*[)\]])?"),
)
"""Cells of a row, with wide gaps or signs between them, and with single spaces.

`\u2026` is one, without gaps: what varies from run to run stands there.
"""
_SEPARATOR = regex(r"[\t|;,\u2026]")
_RULE = regex(r"[\s\-=+|:─━═┼]*")


class UnitText(Struct, frozen=True):
    """A unit as it is written, and what it may be; false for none."""

    text: str = ""
    readings: tuple[Unit, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.readings)


NO_UNIT = UnitText()


@functools.lru_cache(maxsize=1024)
def read_unit(text: str) -> UnitText:
    """The unit that a whole text is, with all its readings; texts repeat what they measure."""
    text = plain_unit(text)
    readings = [*find_units(text)] if text.strip("()1 ") else []
    divisor = "" if readings else _DIVISOR.sub("", text)
    if divisor not in ("", text) and not is_name(divisor):
        symbols = divisor, *_SECOND_READINGS.get(NAMES.get(divisor, divisor), ())
        readings = [unit for symbol in symbols for unit in find_units(f"1 per {symbol}")]
    if (symbol := NAMES.get(text, text)) in LEVELS:
        readings = [Unit(Fraction(1), ((symbol, Fraction(1)),))]  # it has no size, but a name
    for reading in _SECOND_READINGS.get(symbol, ()):
        readings += find_units(reading)
    return UnitText(text, tuple(readings))


def plain_unit(tex: str) -> str:
    r"""The text of a unit that may be written in TeX: `\mathrm{m\,s^{-1}}` is `m s^{-1}`."""
    tex = write_quantities(tex)
    for sign, replacement in _TEX_SIGNS:
        tex = sign.sub(replacement, tex)
    return " ".join(tex.split())


def with_unit(number: str, unit: str) -> str:
    """Return a number's text with its unit; only the degree stands at the digits."""
    return f"{number}{unit}" if unit in ("", "°") else f"{number} {unit}"


def are_different(left: UnitText, right: UnitText) -> bool:
    """Whether both are units, and certainly not the same one."""
    return bool(left) and bool(right) and not is_same_unit(left, right)


def is_same_unit(left: UnitText, right: UnitText) -> bool:
    """Whether both are units, and may be the same one."""
    return any(a.is_same(b) for a in left.readings for b in right.readings)


def printed_unit(line: str, start: int, end: int) -> UnitText:
    """The unit of the number at `line[start:end]` in what a program printed, in its own line.

    It stands behind the number or its list, or in the label before it.
    """
    rest_of_list = _REST_OF_LIST.match(line, end)
    bracket = max(line.rfind(sign, 0, start) for sign in "([")
    if rest_of_list is not None and bracket >= 0 and {*line[bracket:start]} <= _BEGIN_OF_LIST:
        end = rest_of_list.end()  # `(83.4, 85.0) m`
    unit = unit_behind(line, end, has_names=line[:1].isalpha())
    label = line[max(0, start - _REACH) : start]
    spread = _SPREAD_BEFORE.search(label)
    return unit or unit_of_label(line[:start] if spread is None else label[: spread.start() + 1])


def unit_behind(text: str, at: int = 0, *, has_names: bool = False) -> UnitText:
    """The unit that stands behind a number, at a place of a text: as many words as are a product.

    `has_names`: names may stand before the numbers of the text, as in `l 2.0 T 2.8`.
    """
    if column := _NEXT_COLUMN.match(text, at):  # the last one may be that of units
        unit = read_unit(text[column.end() : at + _REACH])
        return unit if unit and len(unit.text) > 1 and not is_name(unit.text) else NO_UNIT
    if spread := _SPREAD.match(text, at):
        at = spread.end()
    rest = _UPRIGHT.sub(lambda match: plain_unit(match[1]), text[at : at + _REACH])
    rest = re.sub(r"\A-(?=[^\W\d_])|&nbsp;|\\(?= )", " ", rest)  # `a 2-kg ball`
    rest = _REFERENCE.sub("", rest)
    phrase = _GAP.split(rest.lstrip("*_` \n"))[0]
    phrase = re.sub(r"\A\[([^\[\]]*)\]", r"(\1)", phrase)
    words = phrase.split()[: _LONGEST_PRODUCT + 1]
    unit = NO_UNIT
    for count, word in enumerate(words[:_LONGEST_PRODUCT], 1):
        if word.startswith("(") and count > 1 and words[count - 2] not in _SIGNS:
            break  # a remark
        product = " ".join(words[:count])
        bare = _without_closing(product)
        follows = words[count] if bare == product and count < len(words) else ""
        is_open = bare.count("(") > bare.count(")") or word in _SIGNS
        longer = read_unit(bare)
        may_not_follow = r"[=:\d.+−]|-(?!>)" if has_names or count > 1 else "[=:]"
        is_certain = re.match(may_not_follow, follows) is None
        is_certain &= count == 1 or not word.endswith(":")  # a label, as in `3 kg N: 1`
        if longer and not unit:
            is_word = is_name(bare) and follows.strip("|") != ""
            is_word |= bare in ("d", "min") and _has_maximum(text)
            if is_word or not is_certain or bare in _MAGNITUDES:
                return NO_UNIT
            unit = longer
        elif longer and (is_name(_without_closing(word)) or not is_certain):
            one_word = UnitText("", find_units(bare.replace(" ", "")))  # `kWh` for `kW h`
            if not one_word or are_different(one_word, longer):
                unit = UnitText(unit.text, unit.readings + longer.readings)  # `m in`
                if not _RAISED.search(follows):  # as in `mg h L⁻¹`
                    break
            unit = longer
        elif longer:
            unit = longer
        if not longer and not is_open and words[count - 2] in PER:
            return NO_UNIT  # `degrees per step`
        if word in _AND and not {*PER}.isdisjoint(words[:count]):
            return NO_UNIT if read_unit(_without_closing(follows)) else unit  # `mg per kg and day`
        if bare != product or not (longer or is_open):
            break
    is_attached = at > 0 and text[at : at + 1].isalpha()
    if is_attached and (len(unit.text) == 1 or is_name(unit.text)):
        return unit if "." in text[:at].split()[-1] else NO_UNIT  # `4A` and `2d`
    return unit


def _has_maximum(text: str) -> bool:
    """Whether `min` is a minimum."""
    return "max" in text.casefold()


def _without_closing(text: str) -> str:
    """A text without the marks of the sentence, and the brackets, that end behind it."""
    bare = text.rstrip(_CLOSING)
    while any(bare.count(end) > bare.count(begin) for begin, end in ("()", "[]")):
        bare = bare[:-1].rstrip(_CLOSING)
    return bare


def numbers_of_quantities(text: str, numbers: Iterable[Number]) -> tuple[Number, ...]:
    """The numbers of a text but for the 1 of a unit, as in `0.5 1/s`."""
    quantities: list[Number] = []
    for number in numbers:
        follows = bool(quantities) and not text[quantities[-1].end : number.start].strip()
        if not (follows and number.text == "1" and _PER_UNIT.match(text, number.end)):
            quantities.append(number)
    return tuple(quantities)


def unit_of_header(text: str) -> UnitText:
    """The unit in a label or the header of a column: `τ (min)`, `v [m/s]`, `t / s`, `time in s`."""
    is_symbol = _SYMBOL_OVER.match(text) is not None
    text = plain_unit(text[-2 * _REACH :])
    text = _DENOMINATOR.sub(lambda match: match[0].replace(" ", "·"), text)
    bracket = _BRACKET_WITH_WORDS.search(text) or _BRACKET.search(text)
    if bracket is not None:
        unit = read_unit(bracket["unit"].rstrip("."))
        is_letter = len(unit.text) == 1
        is_index = bracket["before"].strip() != "" and is_letter
        is_round = text.rstrip().endswith(")")
        if is_index or (is_letter and is_round and is_name(unit.text)):
            return NO_UNIT  # `x(t)`, `y[m]` and `error (h)`
        return NO_UNIT if unit.text == "min" and _has_maximum(text) else unit
    in_words, quotient = _IN_WORDS.search(text), _SOLIDUS.search(text)
    *before, last = text.split() or [""]
    if before and (_BEHIND_COMMA.fullmatch(last) if before[-1][-1] == "," else "/" in last[1:]):
        unit = read_unit(last)  # `speed km/h`, but not `at 200 rad/s`
        if unit and before[0][0].isalpha() and not only_number(before[-1]):
            return NO_UNIT if all(map(is_name, unit.text.split("/"))) else unit
    if in_words is not None:
        unit = read_unit(in_words["unit"])  # `F in N`, but not `change in V`
        is_certain = len(unit.text) > 1 or _SYMBOL.fullmatch(in_words["symbol"]) is not None
    elif quotient is not None:
        unit = read_unit(quotient["unit"])
        is_unit_itself = find_units(text) or ("/" in last and find_units(last))  # `at 200 rad/s`
        is_certain = is_symbol or not (is_unit_itself or unit.text in _SECOND_READINGS)
    else:
        return NO_UNIT
    is_certain &= not is_name(unit.text) and not (unit.text == "min" and _has_maximum(text))
    return unit if is_certain else NO_UNIT


def name_of_header(text: str) -> tuple[str, int]:
    """A label or header without its unit, as `gain` of `gain / dB`; where that begins, or -1."""
    unit = read.text.replace(" ", "·") if (read := unit_of_header(text)) else ""
    whole = text.replace(" ", "·")  # `J/(kg K)`
    pattern = rf"(?<![^\W\d_]){re.escape(unit)}(?![^\W\d_])"
    at = max((match.start() for match in re.finditer(pattern, whole)), default=whole.rfind(unit))
    if not unit or at <= 0:
        return text, at if unit else -1
    words_behind = text[at + len(unit) :].lstrip(")]}$ ")
    return " ".join(filter(None, (_BEFORE_UNIT.sub("", text[:at]), words_behind))), at


def unit_of_label(before: str) -> UnitText:
    """The unit in the label that ends right before a number, or the list that it stands in."""
    return unit_of_header(_TO_NUMBER.sub("", before[-_REACH:], count=1))


def unit_of_printed(line: str, number: Number, above: Sequence[str]) -> UnitText:
    """The unit of a printed number: that in its own line, of its column, or in the heading.

    A heading stands above the rows that the line is one of: `error (mm):`, then `x 1.96`. Its unit
    is that of the number that ends its row, with no other number right before it. Rows are the
    lines below, as far as they are indented, or all have the words of the first one.
    """
    unit = printed_unit(line, number.start, number.end)
    unit = unit or unit_of_column(line, number.start, above)
    if unit:
        return unit
    label = line[: number.start].split()
    if line[number.end :].strip() or (label and only_number(label[-1])):
        return NO_UNIT
    for count, heading in enumerate(reversed(above), 1):
        if scan(heading) and not heading.rstrip().endswith(":"):
            continue
        rows = [*above[len(above) - count + 1 :], line]
        is_heading = heading.rstrip().endswith(":") or not label
        margin = len(heading) - len(heading.lstrip())
        are_indented = all(len(row) - len(row.lstrip()) > margin for row in rows)
        are_alike = all(_words(row) == _words(line) for row in rows)
        are_rows = is_heading and (are_indented or are_alike)
        return unit_of_header(heading.rstrip().removesuffix(":")) if are_rows else NO_UNIT
    return NO_UNIT


def _words(line: str) -> list[str]:
    return [word for word in line.split() if not only_number(word)]


def unit_of_column(line: str, start: int, above: Sequence[str]) -> UnitText:
    """The unit in the header above a number of a row; none if it is uncertain which is its own.

    `above`: the lines above the row, the last of which stands right above.
    """
    for header in reversed(above):
        if _RULE.fullmatch(header) and header.strip():
            continue
        title = title_of_column(line, start, header, has_names=True)
        if not title or only_number(title) is None:
            return unit_of_header(title)
    return NO_UNIT


def title_of_column(line: str, start: int, header: str, *, has_names: bool = False) -> str:
    """The title in a header above a number of a row, in whose cell no words stand before it.

    Empty where the two may have other columns: where numbers share a cell that does not stand
    below one title, or a row has one cell more and these do not stand below titles. Words with
    single spaces may be a sentence: they are titles only above a row of nothing but numbers, with
    `has_names` behind its first cell, or where they line up with its cells.
    """
    for pattern in _CELLS:
        row = [*pattern.finditer(_with_signs_of(header, line))]
        titles = [*pattern.finditer(_with_signs_of(line, header))]
        column = next((i for i, cell in enumerate(row) if cell.end() > start), 0)
        shift = len(row) - len(titles)  # the names of rows may have no title
        if column < shift or len(titles) < 2 or shift not in (0, 1):
            continue
        if not all(map(only_number, line[row[column].start() : start].split())):
            continue
        pairs = [*zip(row[shift:], titles, strict=True)]
        are_aligned = all(a.start() == b.start() or a.end() == b.end() for a, b in pairs)
        are_below = all(a.start() < b.end() and b.start() < a.end() for a, b in pairs)
        are_parted = _SEPARATOR.search(line) is not None or are_below
        if any(all(map(only_number, c[0].split()[-2:])) for c in row if " " in c[0].strip()):
            counts = {len(_CELLS[1].findall(text)) for text in (line, header)}
            if len(counts) == 1 or not are_below:
                continue  # each of the numbers in one cell may have its own title
        is_table = pattern is _CELLS[0] and (shift == 0 or are_parted)
        are_numbers = shift == 0 and all(only_number(cell[0]) for cell in row[has_names:])
        if is_table or are_aligned or are_numbers:
            title = titles[column - shift]
            return header[title.start() : title.end()]
    return ""


def title_above(row: str, number: Number, headers: Sequence[str]) -> str:
    """The title of a printed number's column, in the nearest of the headers above its row.

    In frames of pandas the row of an index may stand between, and a title of several columns above.
    """
    for at, header in enumerate(headers[:2]):
        if title := title_of_column(row, number.start, header):
            groups = [_title_of_group(number.end, header, above) for above in headers[at + 1 :][:1]]
            return " ".join(filter(None, (*groups, title)))
    return ""


def _title_of_group(end: int, header: str, above: str) -> str:
    """The title of several columns, for the one whose cells end at `end`.

    It ends with the first of its columns. Where no title stands twice below, it tells nothing.
    """
    groups, titles = ([*_CELLS[0].finditer(text)] for text in (above, header))
    ends = {title.end() for title in titles}
    are_groups = groups[1:] and {group.end() for group in groups} <= ends and end in ends
    if not are_groups or len({title[0] for title in titles}) == len(titles):
        return ""
    return next((group[0] for group in reversed(groups) if group.end() <= end), "")


def _with_signs_of(neighbour: str, line: str) -> str:
    """A line whose cells are parted only by signs that another one has as well."""
    return "".join("_" if sign in "|;," and sign not in neighbour else sign for sign in line)
