"""What a line of text names: targets of links, mentions as in "Lesson 2.2", and numbers.

Only some schemes of links are safe on a page. Text and soft line ends that follow each other make
one run, as a mention may be broken over two lines.

Of numbers those are told that are none: with two points, a letter among the digits, a sign too many
(`check_numerals`). What may be meant is no mistake: a range such as `3..5`, a version, thousands
with points, a comma where the document writes decimals with commas.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple
from urllib.parse import unquote

from coursebuild.core.model import (
    ExampleTarget,
    Inline,
    LessonTarget,
    LevelTarget,
    Link,
    ModelTarget,
    PageTarget,
    SoftBreak,
    Target,
    TermTarget,
    Text,
    UrlTarget,
)
from coursebuild.core.model.course import Words
from coursebuild.core.model.inlines import LABEL_KINDS
from coursebuild.core.syntax.attributes import term_id
from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose, propose
from coursebuild.core.text.near import nearest
from coursebuild.core.text.source import Excerpt, Span

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")
_FORBIDDEN_SCHEMES = frozenset({"data", "file", "javascript", "vbscript"})
_PICTURE = re.compile(r"data:image/(?:avif|gif|jpeg|png|svg\+xml|webp)[;,]", re.IGNORECASE)
_BLANK = "".join(map(chr, range(33)))
_IGNORED_CHARACTER = re.compile("[\t\n\r]")
"""Characters that browsers ignore in an address, as they do those of `_BLANK` at its ends."""
_COURSE_SCHEMES = ("lesson", "model", "page", "term")
_OTHER_SCHEMES = frozenset("http https mailto ftp ftps git ssh tel".split())
"""Schemes that are no misspelt ones."""


def classify(url: str) -> Target:
    """The target of a destination as markdown-it normalises it (percent-encoded)."""
    scheme, colon, rest = url.partition(":")
    name, _, anchor = rest.partition("#")
    place = unquote(anchor) or None
    match scheme + colon:
        case "lesson:":
            return LessonTarget(unquote(name), place)
        case "page:":
            return PageTarget(unquote(name), place)
        case "model:":
            return ModelTarget(unquote(name), place)
        case "term:":
            return TermTarget(term_id(unquote(rest)))
        case _:
            return ExampleTarget(unquote(url)) if url.startswith("examples/") else UrlTarget(url)


def check_scheme(url: str, span: Span, *, image: bool = False) -> Diagnostic | None:
    """The diagnostic of a wrong scheme in a normalised destination, if it has one."""
    match = _SCHEME.match(url.strip())
    if match is None or match[1] in _COURSE_SCHEMES:
        return None
    scheme = match[1].lower()
    if scheme in _FORBIDDEN_SCHEMES:
        if image and _PICTURE.match(url.strip()):
            return None
        help = "link to an address with `https:`, to a file, or by "
        help += "`lesson:`, `page:`, `model:`, `term:`"
        return diagnose("link-scheme", span, f"`{scheme}:` is not allowed in a page", help=help)
    if scheme in LABEL_KINDS:
        help = Fix(f"did you mean `#{url}`?", f"#{url}")
        return diagnose("link-scheme", span, f"no link scheme `{match[1]}:`", help=help)
    likely = nearest(match[1], (*_COURSE_SCHEMES, "https", "mailto"))
    if likely is None or scheme in _OTHER_SCHEMES:
        return None
    fix = propose(f"{match[1]}:", f"{likely}:")
    return diagnose("link-scheme", span, f"no link scheme `{match[1]}:`", help=fix)


def check_raw_scheme(url: str, span: Span) -> Diagnostic | None:
    """The diagnostic of a wrong scheme in raw HTML, whose addresses are published unchanged."""
    url = _IGNORED_CHARACTER.sub("", url.strip(_BLANK))
    match = _SCHEME.match(url)
    if match is not None and match[1].lower() in _COURSE_SCHEMES:
        message = f"`{match[1]}:` means nothing in raw HTML"
        help = f"write the link in Markdown: `[…]({url})`"
        return diagnose("link-scheme", span, message, help=help)
    return check_scheme(url, span, image=True)


_NUMBERED = re.compile(r"(?:[^\W\d_]+ )?(\d+(?:\.\d+)+)")
"""A text that is the number of a lesson, as "Lesson 4.2"."""


def check_link_text(target: Target, children: Sequence[Inline], span: Span) -> Diagnostic | None:
    """The diagnostic of a text or address that is missing, or a text that names another lesson."""
    if target == UrlTarget(""):
        message, help = "this link has no address", "write one in the brackets behind its text"
        return diagnose("link-text", span, message, help=help)
    if not children:
        address = getattr(target, "url", None) or f"#{getattr(target, 'anchor', None) or ''}"
        if address.partition("#")[2].partition(":")[0] in LABEL_KINDS:
            return None
        message, help = "this link has no text, so no reader sees it", "write one in the brackets"
        return diagnose("link-text", span, message, help=help)
    first = children[0]
    number = _NUMBERED.fullmatch(first.text) if isinstance(first, Text) else None
    if number is None or len(children) > 1 or not isinstance(target, LessonTarget):
        return None
    message = f"the text of this link says `{number[1]}`, and it leads to `{target.id}`"
    help = "name the same lesson in both"
    return diagnose("link-text", span, message, help=help) if number[1] != target.id else None


_LESSON = r"[0-9]+(?:\.[0-9]+)+(?!\w)"
_LEVEL = r"[0-9]+(?:\.[0-9]+)*(?!\w)"

_NUMBER = re.compile(r"[0-9.]*[0-9]")


class TextPiece(NamedTuple):
    """A stretch of text in a block's content, or a soft line end (`text` is a line feed)."""

    text: str
    start: int
    end: int
    literal: bool = True
    """Whether each character stands for itself; not so for entities and escapes."""


def may_mention(text: str, words: Words) -> bool:
    """Whether a text is worth searching for mentions."""
    return any(word in text for names in _mention_names(words) for word in names)


def _mention_names(words: Words) -> tuple[tuple[str, ...], ...]:
    return words.lesson, words.lessons, words.level, words.levels


@lru_cache(maxsize=8)
def _mentions(words: Words) -> re.Pattern[str]:
    """The pattern of mentions; its group is there if they are of lessons."""
    lesson, lessons, level, levels, conjunctions = (
        "|".join(map(re.escape, names)) for names in (*_mention_names(words), words.conjunctions)
    )
    # Arabic writes "and" and the number without a space.
    joint = rf"(?:[,،]?\s+(?:{conjunctions})\s*|[,،]\s+|\s?[–-]\s?)"
    return re.compile(
        r"(?<![\w\\])(?:"
        rf"((?:{lesson})\s+{_LESSON}|(?:{lessons})\s+{_LESSON}(?:{joint}{_LESSON})*)"
        rf"|(?:{level})\s+{_LEVEL}|(?:{levels})\s+{_LEVEL}(?:{joint}{_LEVEL})*)"
    )


def text_inlines(run: Sequence[TextPiece], content: Excerpt) -> list[Inline]:
    """The run as texts and soft line ends."""
    inlines: list[Inline] = []
    for is_line_end, group in groupby(run, key=lambda piece: piece.text == "\n"):
        pieces = [*group]
        if is_line_end:
            inlines += [SoftBreak(content.span(piece.start, piece.end)) for piece in pieces]
        else:
            span = content.span(pieces[0].start, pieces[-1].end)
            inlines.append(Text(span, "".join([piece.text for piece in pieces])))
    return inlines


def link_mentions(run: Sequence[TextPiece], content: Excerpt, words: Words) -> list[Inline]:
    """The run as texts, soft line ends, and links where it mentions lessons and levels."""
    chars = [
        TextPiece(char, piece.start + i, piece.start + i + 1)
        if piece.literal
        else piece._replace(text=char)
        for piece in run
        for i, char in enumerate(piece.text)
    ]
    text = "".join([char.text for char in chars])
    inlines: list[Inline] = []
    position = 0
    for mentions in _mentions(words).finditer(text):
        for number in _NUMBER.finditer(text, *mentions.span()):
            is_first = position <= mentions.start()  # its link includes the word
            start, end = mentions.start() if is_first else number.start(), number.end()
            inlines += text_inlines(chars[position:start], content)
            target = LessonTarget(number[0], None) if mentions[1] else LevelTarget(number[0])
            children = text_inlines(chars[start:end], content)
            span = content.span(chars[start].start, chars[end - 1].end)
            place = content.span(chars[number.start()].start, chars[end - 1].end)
            inlines.append(Link(span, target, place, "", tuple(children), mention=True))
            position = end
    return inlines + text_inlines(chars[position:], content)


# --- numbers that are none

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
    # a sign
    r"(?<![\w)\u2212-])(?:\u2212{2,}|--)\d[\d.]*",
)
_BEFORE_UNITS = (
    rf"{_BEGIN}(?!\d{{1,3}}(?:\.\d{{3}})+(?!\d))\d+(?:\.\d+){{2,}}(?=[ \u00a0]|\Z)",
    rf"{_BEGIN}0(?:[;/>]| \.|\. )\d+",
    rf"{_BEGIN}0{{2,}}\.\d+|{_BEGIN}(?<![-+:/])(?<![\dhn°][ \u00a0\u202f])0\d+",
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


_HINT = re.compile(
    r"\d(?:[oOl]|,[\d.,]|[;>/]\d|[\u207a\u207b]{2}|\.(?:[.,oOl]|\d+(?:\.[\d ]|[oOl]))|\. \d| \.\d"
    r"|[.\d]*[-\u2212]?[eE]| [a-zA-Z]{3,4}(?!\w)|(?<=[Ool]\.\d)|(?<=[-\u2212]{2}\d)"
    r"|(?<=(?<!\w)\.\d)|(?<=(?<![\w.,])0\d))"
)
"""What all of them have at one of their digits, so that most texts are passed over quickly."""


def check_numerals(
    content: Excerpt, texts: Sequence[tuple[int, str]], *, is_alone: bool = False
) -> Iterator[Diagnostic]:
    """Report numbers of texts, each with its offset in the content, that cannot be read."""
    for at, text in texts:
        if not is_alone and _HINT.search(text) is None:
            continue
        for match in _pattern(is_alone=is_alone).finditer(text):
            first, last, number = match["first"], match["last"], match[0]
            has_unit = is_alone or re.match(f" ?{_UNIT}", text[match.end() :]) is not None
            may_be_range = first and (last[0] != "0" or len(first) == len(last))
            if may_be_range and int(first) < int(last) and not (first == "0" and has_unit):
                continue
            if match["comma"]:  # a mistake if it is the only one, and others have points
                whole = content.source.text
                if len(re.findall(_COMMA, whole)) != 1 or len(re.findall(_POINT, whole)) < 3:
                    continue
            message = f"`{number}` cannot be read as a number or a unit"
            help = "a number is written as in `0.5` or `1e-5`, a range as in `3–5`; put what is "
            help += "neither into backticks"
            new = re.sub(r"[.,;>/]{1,2}|\s?\.\s?", ".", number, count=1)
            is_decimal = re.fullmatch(r"\d+\.\d+", new) is not None
            fix = Fix(help, new if is_decimal and new != number else None)
            span = content.span(at + match.start(), at + match.end())
            yield diagnose("number-form", span, message, help=fix)
