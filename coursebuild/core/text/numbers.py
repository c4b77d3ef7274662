"""Numbers in text: where they stand and their exact values.

1. One regular expression walks the text. Its first alternatives match what only looks like a
   number: words with digits in them (`x1`, `v3.14.0`, `UTF-8`), versions, dates, times of day,
   hexadecimal literals, hashes. They stay text, as do powers (`m^2`). No alternative can start
   inside what another one gave up, so that the walk is linear.
2. A number may carry a unit of letters (`12.5ms`); letters with a digit among them make the whole
   thing text (`4x4`).
3. Values are decimals as written: nothing is rounded on the way, so that limits such as half a
   unit of the last place are exact. What no floating-point format can hold (more than 1000
   characters, exponents of more than four digits) is text.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from decimal import Context, Decimal

from msgspec import Struct

from coursebuild.core.text.regex import regex

_SIGN = "[+\\-\u2212]"
_MAGNITUDE = rf"(?:[0-9]+(?:\.(?!\.)[0-9]*)?|\.[0-9]+)(?:[eE]{_SIGN}?[0-9]{{1,4}})?"
# No digit, no further `.1`, and no letters with a digit or underscore among them may follow.
_ENDS = r"(?![0-9])(?!\.[0-9])(?![^\W\d_]*[\d_])"
_HEX = "[0-9a-fA-F]"
_LOOKS_LIKE_A_NUMBER = "|".join(
    (
        rf"{_HEX}{{8}}(?:-{_HEX}{{4}}){{3}}-{_HEX}{{12}}(?!\w)",  # UUID
        rf"0[xXbBoO]{_HEX}\w*",  # 0x1f
        r"(?=[0-9]+[a-f])[0-9a-f]{7,}(?!\w)",  # hash
        r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}(?![0-9])(?:T[0-9:.,+\-Z]*)?",  # date
        r"[0-9]+/[0-9]+/[0-9]+(?![0-9])",  # date
        r"(?<![0-9]:)[0-9]{1,3}(?::[0-9]{2})+(?:[.,][0-9]+)?(?![0-9:])",  # time of day
        r"[0-9]+(?:\.[0-9]+){2,}[\w.]*(?:[-+:][\w.]+)*",  # version, address
        r"(?<![0-9]-)[0-9]+(?:-[0-9]+)+(?![\w.])",  # 10-20
        rf"[0-9]+(?:\.[0-9]*)?[eE]{_SIGN}?[0-9]{{5,}}",  # exponent too large
    )
)
_SPECIAL = rf"{_SIGN}?(?:nan|NaN|NAN|inf|Inf|INF|[iI]nfinity)(?!\w)"
_TOKEN = regex(
    rf"(?P<imaginary>(?<=[0-9.]){_SIGN}{_MAGNITUDE}(?=[jJ](?!\w)))"
    rf"|(?<![\w.^])(?<!\^[+\-])(?:(?P<text>{_LOOKS_LIKE_A_NUMBER})|(?P<special>{_SPECIAL})"
    rf"|(?P<number>(?:(?<![\w.)\]]){_SIGN})?{_MAGNITUDE}{_ENDS})"
    r"|(?P<word>[^\W\d]\w*(?:\.[0-9]\w*)*(?:-[0-9][\w.]*)*))"
)
_MAY_HOLD_NUMBERS = regex("[0-9]|nan|inf", re.IGNORECASE)
_GROUPS = regex(r"(?<![0-9.,])[1-9][0-9]{0,2}(?:,[0-9]{3})+(?:\.[0-9]+)?(?!,?[0-9])(?!\.[0-9])")
"""Digits as Python's format `,` writes them."""
_SPACES = "\u00a0\u2009\u202f"
_BEFORE_SPACE = r"(?<![0-9]\s)[1-9][0-9]{0,2}"
_SPACED = rf"{_BEFORE_SPACE}(?:[{_SPACES}][0-9]{{3}})+(?![{_SPACES}]?[0-9])"
_WITH_SPACES = regex(rf"(?<![\w.,]){_SPACED}(?!,[0-9])")
_WITH_COMMA = regex(
    rf"(?<![\w.,])(?:{_BEFORE_SPACE}(?:[ {_SPACES}][0-9]{{3}})+,[0-9]+|{_SPACED}"
    r"|(?:[0-9]{1,3}(?:\.[0-9]{3})+|[0-9]+),[0-9]+"
    r"|[0-9]{1,3}(?:\.[0-9]{3}){2,})(?![0-9]|[.,][0-9])"
)
_GROUP_SPACE = regex(rf"(?<=[0-9])[ {_SPACES}](?=[0-9]{{3}}(?![0-9]))")
_POINT_GROUP = regex(r"(?<![\w.,])([1-9][0-9]{0,2})\.([0-9]{3})(?![0-9]|[.,][0-9])")
_SWAPPED = str.maketrans(",.", ".,")
_DIGIT_COMMA = regex("[0-9],[0-9]")
_NOTATION = regex(
    rf"(?P<sign>{_SIGN})?(?P<whole>[0-9,]*)(?:\.(?P<decimals>[0-9]*))?"
    rf"(?:(?P<mark>[eE])(?P<power_sign>{_SIGN})?(?P<power>[0-9]+))?"
)

_LONGEST = 1000
_EXACT = Context(prec=40_000)
_QUOTIENT = Context(prec=34)

_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻", "0123456789+-")
_RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_POWER = regex(
    rf"\s*(?:[×·]|\\cdot|\\times)\s*10(?:\^\{{?(?P<caret>{_SIGN}?[0-9]{{1,4}})\}}?|(?P<raised>[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{{1,4}}))(?!\w)"
)

_UNREAD = regex(rf"\^\W*[0-9]+|(?P<bad>(?<![\w)\]]){_SIGN}(?={_SIGN}+\.?[0-9])|[0-9]+)")


class Number(Struct, frozen=True):
    """A number and the half-open range `[start, end)` of its text."""

    start: int
    end: int
    text: str
    value: Decimal
    """Exact; NaN and infinities for `nan` and `inf`."""
    place: int
    """Power of ten of the last written place: -3 for `6.641`, -4 for `1.5e-3`, 0 for `nan`."""
    is_integer: bool
    """Written without a point and without an exponent."""

    @property
    def is_finite(self) -> bool:
        """Whether it is neither `nan` nor `inf`."""
        return self.value.is_finite()

    @property
    def is_padded(self) -> bool:
        """Whether a zero stands before its first digit, as nobody writes it by hand."""
        return bool(re.match(r"\D?0[0-9]", self.text))

    @property
    def is_inexact(self) -> bool:
        """Whether it has a point or an exponent, so that it stands for a rounded value."""
        return self.is_finite and not self.is_integer


def has_groups(text: str) -> bool:
    """Whether all commas between digits part thousands, as those of a list of numbers do not."""
    return "," in text and _DIGIT_COMMA.search(_GROUPS.sub("", text)) is None


@functools.lru_cache(maxsize=8192)
def scan(text: str, is_grouped: bool = False) -> tuple[Number, ...]:
    """The numbers of a text, in order; if it is grouped, `1,234.5` is one."""
    numbers: list[Number] = []
    for match in _TOKEN.finditer(text) if _MAY_HOLD_NUMBERS.search(text) else ():
        kind = match.lastgroup
        if kind not in ("number", "imaginary", "special"):
            continue
        start, end = match.span()
        if is_grouped and numbers and start < numbers[-1].end:
            continue
        if is_grouped and kind == "number":
            groups = _GROUPS.match(text, end - len(match[0].lstrip("+-\u2212")))
            end = end if groups is None else groups.end()
        if end - start <= _LONGEST:
            digits = text[start:end]
            value = Decimal(digits.replace("\u2212", "-").replace(",", ""))
            exponent = value.as_tuple().exponent
            place = exponent if isinstance(exponent, int) else 0
            is_integer = value.is_finite() and not any(c in digits for c in ".eE")
            numbers.append(Number(start, end, digits, value, place, is_integer))
    return tuple(numbers)


def point_decimals(text: str) -> str:
    """A text of the same length, with points for the commas before decimals.

    Points and spaces that part thousands become commas: `1.234,5` is `1,234.5`, as programs print
    it; an ordinary space only where it stands before decimals, as two numbers may have it between.
    """
    return _WITH_COMMA.sub(lambda match: re.sub(r"\s", ",", match[0].translate(_SWAPPED)), text)


def part_thousands(text: str) -> str:
    """A text with a comma for a point that parts thousands, if it is no decimal point: `12.345`."""
    return _POINT_GROUP.sub(r"\1,\2", text)


def join_thousands(text: str) -> str:
    """A text with no-break spaces for those that may part thousands."""
    return _GROUP_SPACE.sub("\u202f", text)


def decimal_gaps(text: str, comma: bool) -> list[tuple[int, int]]:
    """The spaces between decimals in groups of three, as in `0.006 694 38`: start and end."""
    group = rf"(?<![0-9])[0-9]+[.{',' * comma}](?:[0-9]{{3}}[ {_SPACES}])+[0-9]{{1,3}}(?![0-9/.,])"
    space = re.compile(rf"[ {_SPACES}]")
    numbers = re.finditer(group, text)
    return [gap.span() for number in numbers for gap in space.finditer(text, *number.span())]


def group_space(text: str) -> str:
    """The space that parts the thousands of a number; empty where none does."""
    return next(iter(_GROUP_SPACE.findall(text)), "")


def as_printed(text: str, comma: bool) -> str:
    """A text of the same length in which numbers are as programs print them.

    Thin and no-break spaces that part thousands become commas. `comma`: its language may have one
    before decimals.
    """
    if comma:
        return point_decimals(text)
    return _WITH_SPACES.sub(lambda match: re.sub(r"\s", ",", match[0]), text)


def write_comma(text: str) -> str:
    """A number as a program prints it, with a comma before its decimals."""
    return text.translate(_SWAPPED)


def only_number(text: str) -> Number | None:
    """The number that makes up the whole text, if one does."""
    numbers = scan(text.strip())
    return numbers[0] if len(numbers) == 1 and numbers[0].text == text.strip() else None


def scan_prose(text: str) -> tuple[Number, ...]:
    """The numbers of a text that a person wrote: `3.9 × 10⁻¹¹` and `3.9·10^-11` are one number."""
    return with_powers(text, scan(text, has_groups(text)))


def with_powers(text: str, scanned_numbers: Iterable[Number]) -> tuple[Number, ...]:
    """The numbers of a text, each with the power of ten that follows it."""
    numbers: list[Number] = []
    for number in scanned_numbers:
        if numbers and number.start < numbers[-1].end:
            continue
        power = _POWER.match(text, number.end)
        if power is None or not number.is_finite:
            numbers.append(number)
            continue
        exponent = power["caret"] or power["raised"].translate(_SUPERSCRIPTS)
        shift = int(exponent.replace("\u2212", "-"))
        start, end = number.start, power.end()
        value, place = number.value.scaleb(shift, _EXACT), number.place + shift
        numbers.append(Number(start, end, text[start:end], value, place, is_integer=False))
    return tuple(numbers)


def find_unread(text: str) -> tuple[int, int] | None:
    """Where a text that is to give numbers has one that is none: `O.1 kg`, `0..5 s`, `--2 m`.

    Powers of units, versions, dates and what else only looks like a number are as they are meant.
    """
    tokens = [*_TOKEN.finditer(text)]
    if all(token["word"] for token in tokens):
        tokens = []
    for piece in _UNREAD.finditer(text):
        if piece["bad"] and not any(t.start() <= piece.start() < t.end() for t in tokens):
            start = max(text.rfind(" ", 0, piece.start()) + 1, 0)
            return start, start + len(text[start:].split()[0])
    return None


def difference(a: Decimal, b: Decimal) -> Decimal:
    """`|a - b|`, exact; both are finite."""
    return _EXACT.abs(_EXACT.subtract(a, b))


def unit(place: int) -> Decimal:
    """One unit of a place: `10**place`, exact."""
    return Decimal((0, (1,), place))


def within_half_unit(number: Number, value: Decimal) -> bool:
    """Whether `value` is within half a unit of the last place of `number`, borders included."""
    gap = difference(number.value, value)
    return _EXACT.add(gap, gap) <= unit(number.place)


def within_tolerance(recorded: Decimal, value: Decimal, rtol: Decimal, atol: Decimal) -> bool:
    """Whether `|value - recorded| <= atol + rtol * |recorded|`, exactly; all finite."""
    return difference(recorded, value) <= _EXACT.add(
        atol, _EXACT.multiply(rtol, _EXACT.abs(recorded))
    )


def relative_error(recorded: Decimal, printed: Decimal) -> Decimal | None:
    """`|printed - recorded| / |recorded|` to 34 digits; `None` where it does not exist."""
    if not (recorded.is_finite() and printed.is_finite()) or recorded == 0:
        return None
    return _QUOTIENT.divide(difference(recorded, printed), _EXACT.abs(recorded))


def agreeing_digits(error: Decimal) -> int | None:
    """Leading digits that agree: `floor(-log10(error))`, at least 0; `None` for no error at all."""
    if error == 0:
        return None
    power = error.adjusted()
    return max(0, -power if error == unit(power) else -power - 1)


def round_like(sample: Number, value: Decimal) -> str | None:
    """`value` (finite) rounded to as many decimals as `sample` shows, in its notation.

    A plus sign and a U+2212 minus are kept where `sample` has them, exponents keep their width.
    `None` where the notation is none of a finite number (`nan`).
    """
    match = _NOTATION.fullmatch(sample.text)
    if match is None:
        return _round_with_power(sample, value)
    decimals = len(match["decimals"] or "")
    if match["mark"]:
        mantissa, _, power = f"{abs(value):.{decimals}e}".partition("e")
        width = len(match["power"])
        sign = match["power_sign"] or ""
        minus_power = "\u2212" if sign == "\u2212" else "-"
        shown_sign = minus_power if int(power) < 0 else "+" if sign == "+" or width > 1 else ""
        exponent = f"{match['mark']}{shown_sign}{abs(int(power)):0{width}d}"
    else:
        grouping = "," if "," in match["whole"] else ""
        mantissa, exponent = f"{abs(value):{grouping}.{decimals}f}", ""
    if match["decimals"] == "":
        mantissa += "."
    if not match["whole"]:
        mantissa = mantissa.removeprefix("0")
    negative = value < 0 and any(c in "123456789" for c in mantissa)
    minus = "\u2212" if match["sign"] == "\u2212" else "-"
    return f"{minus if negative else '+' if match['sign'] == '+' else ''}{mantissa}{exponent}"


def _round_with_power(sample: Number, value: Decimal) -> str | None:
    """`value` in a notation such as `3.9 × 10⁻¹¹`; `None` where its factor is not from 1 to 10."""
    text, power = sample.text, _POWER.search(sample.text)
    factor = None if power is None else only_number(text[: power.start()])
    if power is None or factor is None or not 1 <= abs(factor.value) < 10 or not value:
        return None
    rounded, _, exponent = f"{value:.{-factor.place}e}".partition("e")
    power_text, group = str(int(exponent)), "caret" if power["caret"] else "raised"
    if group == "raised":
        power_text = power_text.translate(_RAISED)
    elif "\u2212" in power["caret"]:
        power_text = power_text.replace("-", "\u2212")
    ten = text[power.start() : power.start(group)]
    return f"{round_like(factor, Decimal(rounded))}{ten}{power_text}{text[power.end(group) :]}"
