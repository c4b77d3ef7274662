"""Where links lead: destinations, schemes that a page must not have, and mentions.

Entry points: `classify`, `check_scheme`, `check_raw_scheme`; `may_mention`, `text_inlines` and
`link_mentions`, by which "Lesson 2.2" and "Level 18" in prose become links by themselves.

Text and soft line ends that follow each other make one run, so that a mention may be broken over
two lines. Each becomes a `Link`, whose `target_span` is the number; what is around it becomes
`Text` and `SoftBreak`.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate, groupby
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
from coursebuild.core.syntax.headings import term_id
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, nearest
from coursebuild.core.text.source import Excerpt, Span

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")
_FORBIDDEN = frozenset({"data", "file", "javascript", "vbscript"})
_PICTURE = re.compile(r"data:image/(?:avif|gif|jpeg|png|svg\+xml|webp)[;,]", re.IGNORECASE)
_BLANK = "".join(map(chr, range(33)))
_UNSEEN = re.compile("[\t\n\r]")
"""What browsers take out of an address before they read it; `_BLANK` at its ends."""
_OURS = ("lesson", "model", "page", "term")


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
    """What is wrong with the scheme of a normalised destination, if anything."""
    found = _SCHEME.match(url.strip())
    if found is None or found[1] in _OURS:
        return None
    scheme = found[1].lower()
    if scheme in _FORBIDDEN:
        if image and _PICTURE.match(url.strip()):
            return None
        help = "link to an address with `https:`, to a file, or by "
        help += "`lesson:`, `page:`, `model:`, `term:`"
        return diagnose("link-scheme", span, f"`{scheme}:` must not stand in a page", help=help)
    near = nearest(scheme, _OURS, cutoff=0.75)
    if near is None:
        return None
    message, help = f"no link scheme `{found[1]}:`", f"did you mean `{near}:`?"
    return diagnose("link-scheme", span, message, help=help)


def check_raw_scheme(url: str, span: Span) -> Diagnostic | None:
    """What is wrong with the scheme of an address in raw HTML, which is published as it is."""
    url = _UNSEEN.sub("", url.strip(_BLANK))
    found = _SCHEME.match(url)
    if found is not None and found[1].lower() in _OURS:
        message = f"`{found[1]}:` means nothing in raw HTML"
        help = f"write the link in Markdown: `[…]({url})`"
        return diagnose("link-scheme", span, message, help=help)
    return check_scheme(url, span, image=True)


_LESSON = r"[0-9]+(?:\.[0-9]+)+(?!\w)"
_LEVEL = r"[0-9]+(?:\.[0-9]+)*(?!\w)"
_BETWEEN = r"(?:,?\s+(?:and|or|to)\s+|,\s+|\s?[–-]\s?)"
_MENTIONS = re.compile(
    r"(?<![\w\\])(?:"
    rf"(Lesson)(?:\s+{_LESSON}|s\s+{_LESSON}(?:{_BETWEEN}{_LESSON})*)"
    rf"|Level(?:\s+{_LEVEL}|s\s+{_LEVEL}(?:{_BETWEEN}{_LEVEL})*))"
)
_NUMBER = re.compile(r"[0-9.]*[0-9]")


class TextPiece(NamedTuple):
    """A stretch of text in a block's content, or a soft line end (`text` is a line feed)."""

    text: str
    start: int
    end: int
    literal: bool = True
    """Whether each character stands for itself; not so for entities and escapes."""


def may_mention(text: str) -> bool:
    """Whether a text is worth searching for mentions."""
    return "Lesson" in text or "Level" in text


def text_inlines(run: Sequence[TextPiece], content: Excerpt) -> list[Inline]:
    """The run as texts and soft line ends."""
    out: list[Inline] = []
    for is_line_end, group in groupby(run, key=lambda piece: piece.text == "\n"):
        items = [*group]
        if is_line_end:
            out += [SoftBreak(content.span(item.start, item.end)) for item in items]
        else:
            span = content.span(items[0].start, items[-1].end)
            out.append(Text(span, "".join([item.text for item in items])))
    return out


def link_mentions(run: Sequence[TextPiece], content: Excerpt) -> list[Inline]:
    """The run as texts, soft line ends, and links where it mentions lessons and levels."""
    joined = "".join([item.text for item in run])
    starts = [0, *accumulate(len(item.text) for item in run)]
    out: list[Inline] = []
    at = 0
    for mentions in _MENTIONS.finditer(joined):
        for number in _NUMBER.finditer(joined, *mentions.span()):
            first = at <= mentions.start()  # whose link begins with the word
            start = mentions.start() if first else number.start()
            out += text_inlines(_cut(run, starts, at, start), content)
            children = text_inlines(_cut(run, starts, start, number.end()), content)
            target = LessonTarget(number[0], None) if mentions[1] else LevelTarget(number[0])
            digits = _cut(run, starts, *number.span())
            place = content.span(digits[0].start, digits[-1].end)
            span = children[0].span.to(children[-1].span)
            out.append(Link(span, target, place, "", tuple(children), mention=True))
            at = number.end()
    return out + text_inlines(_cut(run, starts, at, len(joined)), content)


def _cut(run: Sequence[TextPiece], starts: list[int], start: int, end: int) -> list[TextPiece]:
    """The items between two offsets of the joined text.

    An item that is not literal keeps its whole place.
    """
    out: list[TextPiece] = []
    i = bisect_right(starts, start) - 1
    while i < len(run) and starts[i] < end:
        item = run[i]
        first, last = max(start - starts[i], 0), min(end - starts[i], len(item.text))
        if last > first:
            text = item.text[first:last]
            if item.literal:
                out.append(TextPiece(text, item.start + first, item.start + last))
            else:
                out.append(item._replace(text=text))
        i += 1
    return out
