"""Numbers in a text that are none: with two points, a letter among the digits, a sign too many.

Entry point: `check_numerals`. What may be meant is no mistake: a range such as `3..5`, a version,
thousands with points, a comma where the document writes decimals with commas.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Sequence

from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.source import Excerpt

_UNIT = (
    r"(?:°C?|%|‰|(?:rad|mrad|deg|min|[kMG]?Hz|k?Pa|[kcmµμn]?m|[kmµμ]?g|[mµμn]?s|k?[NJW])"
    r"(?![\w'’]))"
)
"""Units that are no words, and that no version or section is likely to stand before."""
_BEGIN = r"(?<![\w.,])"
_SIGNS = r"[-+\u2212]"
_FORMS = (
    # two signs where one point was meant
    rf"{_BEGIN}\d+(?:,\.|,,)\d+(?!\d|[.,]\d)|{_BEGIN}0\.,\d+(?!\d|[.,]\d)",
    rf"{_BEGIN}(?P<first>\d+)\.\.(?P<last>\d+)(?!\d|[.,]\d)",
    r"(?<![\w.,)\]])\.\d+\.\d+(?![\w.])",
    # a letter for a digit
    rf"{_BEGIN}(?:[Oo]\.\d+|\d+\.(?:\d*[oO]|l)\d*|\d+[oOl]\d*\.\d+)(?![\w(]|\.\w)",
    # an exponent
    rf"{_BEGIN}\d[\d.]*(?:[eE](?:{_SIGNS}{{2,}}\d+|{_SIGNS}(?![\w+\u2212-]))|[-\u2212][eE]\d+"
    rf"|[eE]{{2}}{_SIGNS}\d+)",
    r"(?<=10)[⁺⁻]{2,}[⁰¹²³⁴-⁹]+",
)
_BEFORE_UNITS = (
    rf"{_BEGIN}(?!\d{{1,3}}(?:\.\d{{3}})+(?!\d))\d+(?:\.\d+){{2,}}(?=[ \u00a0]|\Z)",
    rf"{_BEGIN}0(?:[;/>]| \.|\. )\d+",
    rf"{_BEGIN}0{{2,}}\.\d+|{_BEGIN}(?<![-+:/])0\d+",
    rf"{_BEGIN}l\.\d+",
)
"""What is wrong only where a unit follows."""
_COMMA = rf"{_BEGIN}(?:0,\d+|\d+,\d{{1,2}})(?= {_UNIT})"
_POINT = rf"{_BEGIN}\d+\.\d+(?=`?(?:\{{[^{{}}\n]*\}})? {_UNIT})"
_LATE_POINT = rf"{_BEGIN}\d+\.\d+\.(?= (?:rad|[ckm]m|kg|ms|k?Hz)(?!\w))"
_SWAPPED_UNIT = r"(?<=\d )(?:rda|ard|mrda|mard|Hkz|kzH|oml|mlo|imn|mni|dge|edg)(?!\w)"


@functools.cache
def _pattern(*, is_alone: bool) -> re.Pattern[str]:
    """A pattern for all forms; `is_alone` where the text is a number and perhaps its unit."""
    end = r"|\Z" if is_alone else ""
    follows = rf"(?=[ \u00a0\u202f]?(?:{_UNIT}{end}))"
    before_units = rf"(?:{'|'.join(_BEFORE_UNITS)}){follows}"
    in_prose = rf"(?P<comma>{_COMMA})|{_LATE_POINT}|{_SWAPPED_UNIT}"
    alone = rf"|\A{_SIGNS}{{2,}}\d[\d.]*|\d[\d.]*\.(?=\Z| [^\W\d])" if is_alone else ""
    return re.compile("|".join((*_FORMS, before_units, in_prose)) + alone)


_HINT = re.compile(r"[\d.][.,;>/⁺⁻ ]|[eE][-+\u2212eE]|\d[oOl]|[Ool]\.\d|0\d|\d[-\u2212][eE]")
"""What all of them have somewhere, so that most texts are passed over quickly."""


def check_numerals(
    content: Excerpt, texts: Sequence[tuple[int, str]], *, is_alone: bool = False
) -> Iterator[Diagnostic]:
    """Report numbers of texts, each with its offset in the content, that cannot be read."""
    for at, text in texts:
        if _HINT.search(text) is None:
            continue
        for match in _pattern(is_alone=is_alone).finditer(text):
            first, last, number = match["first"], match["last"], match[0]
            has_unit = is_alone or re.match(f" ?{_UNIT}", text[match.end() :]) is not None
            may_be_range = first and (last[0] != "0" or len(first) == len(last))
            if may_be_range and int(first) < int(last) and not (first == "0" and has_unit):
                continue
            if match["comma"] and not _is_alone_with_comma(content.source.text):
                continue
            message = f"`{number}` cannot be read as a number or a unit"
            help = "a number is written as in `0.5` or `1e-5`, a range as in `3–5`; put what is "
            help += "neither into backticks"
            new = re.sub(r"[.,;>/]{1,2}|\s?\.\s?", ".", number, count=1)
            is_decimal = re.fullmatch(r"\d+\.\d+", new) is not None
            fix = Fix(help, new if is_decimal and new != number else None)
            span = content.span(at + match.start(), at + match.end())
            yield diagnose("number-form", span, message, help=fix)


def _is_alone_with_comma(text: str) -> bool:
    """Whether a document has one decimal with a comma before a unit, and others with points."""
    return len(re.findall(_COMMA, text)) == 1 and len(re.findall(_POINT, text)) > 2
