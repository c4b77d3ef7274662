"""Targets of links, as an address or a mention names them.

1. Of addresses only some schemes are safe on a page.
2. Mentions of lessons and levels, as in "Lesson 2.2", become links. Text and soft line ends that
   follow each other make one run, as a mention may be broken over two lines.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
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
    RawInline,
    SoftBreak,
    Target,
    TermTarget,
    Text,
    UrlTarget,
    plain_text,
)
from coursebuild.core.model.course import Words
from coursebuild.core.model.inlines import LABEL_KINDS
from coursebuild.core.syntax.attributes import term_id
from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

_SCHEME = regex(r"([A-Za-z][A-Za-z0-9+.-]*):")
_FORBIDDEN_SCHEMES = frozenset({"data", "file", "javascript", "vbscript"})
_PICTURE = regex(r"data:image/(?:avif|gif|jpeg|png|svg\+xml|webp)[;,]", re.IGNORECASE)
_BLANK = "".join(map(chr, range(33)))
_IGNORED_CHARACTER = regex("[\t\n\r]")
"""Characters that browsers ignore in an address, as they do those of `_BLANK` at its ends."""
_COURSE_SCHEMES = ("lesson", "model", "page", "term")


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
    if scheme in _FORBIDDEN_SCHEMES or len(scheme) == 1:  # `C:/Users/me/a.csv`
        if image and _PICTURE.match(url.strip()):
            return None
        help = "link to an address with `https:`, to a file, or by "
        help += "`lesson:`, `page:`, `model:`, `term:`"
        return diagnose("link-scheme", span, f"`{scheme}:` is not allowed in a page", help=help)
    if scheme in LABEL_KINDS:
        help = Fix(f"did you mean `#{url}`?", f"#{url}")
        return diagnose("link-scheme", span, f"no link scheme `{match[1]}:`", help=help)
    return None


def check_raw_scheme(url: str, span: Span) -> Diagnostic | None:
    """The diagnostic of a wrong scheme in raw HTML, whose addresses are published unchanged."""
    url = _IGNORED_CHARACTER.sub("", url.strip(_BLANK))
    match = _SCHEME.match(url)
    if match is not None and match[1].lower() in _COURSE_SCHEMES:
        message = f"`{match[1]}:` means nothing in raw HTML"
        help = f"write the link in Markdown: `[…]({url})`"
        return diagnose("link-scheme", span, message, help=help)
    return check_scheme(url, span, image=True)


def check_link_text(target: Target, children: Sequence[Inline], span: Span) -> Diagnostic | None:
    """The diagnostic of a text or an address that is missing."""
    address = getattr(target, "url", None) or f"#{getattr(target, 'anchor', None) or ''}"
    help = "write one in the brackets"
    if target == UrlTarget(""):
        message, help = "this link has no address", f"{help} behind its text"
    elif not children and ":" not in address.partition("#")[2]:  # else it may show a number
        message = "this link has no text, so no reader sees it"
    else:
        return None
    return diagnose("link-text", span, message, help=help)


_LESSON = r"[0-9]+(?:\.[0-9]+)+(?!\w)"
_LEVEL = r"[0-9]+(?:\.[0-9]+)*(?!\w)"

_NUMBER = regex(r"[0-9.]*[0-9]")


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


def named_lesson(children: tuple[Inline, ...], words: Words) -> str:
    """The lesson that a whole text names, as `Lesson 1.2`; empty for any other text."""
    if any(isinstance(child, RawInline) for child in children):  # a comment that parts the two
        return ""
    text = plain_text(children)
    match, numbers = _mentions(words).fullmatch(text), _NUMBER.findall(text)
    return numbers[0] if match and match[1] and len(numbers) == 1 else ""


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
