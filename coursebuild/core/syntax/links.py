"""Where links lead: destinations, schemes that a page must not have, and mentions.

Entry points: `classify`, `check_scheme`, `check_raw_scheme`; `may_mention`, `plain` and
`with_mentions`, by which "Lesson 2.2" and "Level 18" in prose become links by themselves.

Text and soft line ends that follow each other make one run, so that a mention may be broken over
two lines. Each becomes a `Link`, whose `target_span` is the number; what is around it becomes
`Text` and `SoftBreak`.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import accumulate
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
    found = _SCHEME.match(url)
    scheme = found[1] if found else ""
    if scheme in _OURS:
        name, mark, anchor = url[len(scheme) + 1 :].partition("#")
        place = unquote(anchor) if mark and anchor else None
        if scheme == "lesson":
            return LessonTarget(unquote(name), place)
        if scheme == "page":
            return PageTarget(unquote(name), place)
        if scheme == "term":
            return TermTarget(term_id(unquote(url[len(scheme) + 1 :])))
        return ModelTarget(unquote(name), place)
    if url.startswith("examples/"):
        return ExampleTarget(unquote(url))
    return UrlTarget(url)


def check_scheme(url: str, span: Span, *, image: bool = False) -> Diagnostic | None:
    """What is wrong with the scheme of a normalised destination, if anything."""
    found = _SCHEME.match(url.strip())
    if found is None or found[1] in _OURS:
        return None
    scheme = found[1].lower()
    if scheme in _FORBIDDEN:
        if image and _PICTURE.match(url.strip()):
            return None
        return diagnose(
            "link-scheme",
            span,
            f"`{scheme}:` must not stand in a page",
            help="link to an address with `https:`, to a file, or by "
            "`lesson:`, `page:`, `model:`, `term:`",
        )
    near = nearest(scheme, _OURS, cutoff=0.75)
    if near is None:
        return None
    return diagnose(
        "link-scheme", span, f"no link scheme `{found[1]}:`", help=f"did you mean `{near}:`?"
    )


def check_raw_scheme(url: str, span: Span) -> Diagnostic | None:
    """What is wrong with the scheme of an address in raw HTML, which is published as it is."""
    url = _UNSEEN.sub("", url.strip(_BLANK))
    found = _SCHEME.match(url)
    if found is not None and found[1].lower() in _OURS:
        message = f"`{found[1]}:` means nothing in raw HTML"
        help = f"write the link in Markdown: `[…]({url})`"
        return diagnose("link-scheme", span, message, help=help)
    return check_scheme(url, span, image=True)


_LESSON = r"[0-9]+(?:\.[0-9]+)+"
_LEVEL = r"[0-9]+(?:\.[0-9]+)*"
_FIRST = re.compile(rf"(?<![\w\\])(?:(Lessons?)\s+({_LESSON})|(Levels?)\s+({_LEVEL}))(?!\w)")
_BETWEEN = r"(?:,?\s+(?:and|or|to)\s+|,\s+|\s?[–-]\s?)"
_NEXT = {
    "Lessons": re.compile(rf"{_BETWEEN}({_LESSON})(?!\w)"),
    "Levels": re.compile(rf"{_BETWEEN}({_LEVEL})(?!\w)"),
}


class TextPiece(NamedTuple):
    """A stretch of text in a block's content, or a soft line end (`text` is a line feed)."""

    text: str
    start: int
    end: int
    literal: bool = True
    """Whether each character stands for itself; not so for entities and escapes."""


class _Mention(NamedTuple):
    start: int
    end: int
    id_start: int
    id: str
    is_lesson: bool


def may_mention(text: str) -> bool:
    """Whether a text is worth searching for mentions."""
    return "Lesson" in text or "Level" in text


def plain(run: Sequence[TextPiece], content: Excerpt) -> list[Inline]:
    """The run as texts and soft line ends."""
    out: list[Inline] = []
    text: list[TextPiece] = []
    for item in run:
        if item.text != "\n":
            text.append(item)
            continue
        if text:
            out.append(_text(text, content))
            text = []
        out.append(SoftBreak(content.span(item.start, item.end)))
    if text:
        out.append(_text(text, content))
    return out


def _text(items: list[TextPiece], content: Excerpt) -> Text:
    joined = "".join([item.text for item in items])
    return Text(content.span(items[0].start, items[-1].end), joined)


def with_mentions(run: Sequence[TextPiece], content: Excerpt) -> list[Inline]:
    """The run as texts, soft line ends, and links where it mentions lessons and levels."""
    joined = "".join([item.text for item in run])
    if not may_mention(joined):
        return plain(run, content)
    starts = [0, *accumulate(len(item.text) for item in run)]
    out: list[Inline] = []
    at = 0
    for mention in _mentions(joined):
        out += plain(_cut(run, starts, at, mention.start), content)
        children = tuple(plain(_cut(run, starts, mention.start, mention.end), content))
        number = _cut(run, starts, mention.id_start, mention.end)
        target = LessonTarget(mention.id, None) if mention.is_lesson else LevelTarget(mention.id)
        place = content.span(number[0].start, number[-1].end)
        span = children[0].span.to(children[-1].span)
        out.append(Link(span, target, place, "", children, mention=True))
        at = mention.end
    return out + plain(_cut(run, starts, at, len(joined)), content)


def _mentions(text: str) -> Iterator[_Mention]:
    at = 0
    while found := _FIRST.search(text, at):
        is_lesson = found[1] is not None
        group = 2 if is_lesson else 4
        yield _Mention(found.start(), found.end(), found.start(group), found[group], is_lesson)
        at = found.end()
        more = _NEXT.get(found[1] or found[3])
        while more is not None and (found := more.match(text, at)):
            yield _Mention(found.start(1), found.end(), found.start(1), found[1], is_lesson)
            at = found.end()


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
