"""Raw HTML: its tags, whether they balance, and the files that it shows.

Entry points: `tags` and `tag_at` (scan), `Balance` (what is open), `find_media`.

Balance is judged with care: elements whose end tag may be left out, void elements, comments and raw
text never give a false alarm. An element must be closed in the block, list item or emphasis that it
was opened in, as the page would be torn otherwise.
"""

from __future__ import annotations

import functools
import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterator
from html import unescape
from typing import NamedTuple

from coursebuild.core.model import MediaAddress
from coursebuild.core.syntax.links import check_raw_scheme
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt, Span

VOID = frozenset("area base br col embed hr img input link meta param source track wbr".split())
_IMPLIED = frozenset("body colgroup head html tbody tfoot thead".split())
"""Elements that may be there without any tag."""
_OPTIONAL = frozenset("caption dd dt li optgroup option p rp rt td th tr".split())
"""Elements whose end tag may be left out."""
_RAW_TEXT = frozenset("script style textarea title".split())
LITERAL = frozenset("code kbd math pre samp svg".split()) | _RAW_TEXT
"""Elements in which a dollar is a dollar."""

_TAG = re.compile(r"""<(/?)([A-Za-z][A-Za-z0-9:-]*)(?=[\s/>])((?:"[^"]*"|'[^']*'|[^"'<>])*+)>""")
_ATTRIBUTE = re.compile(
    r"""\s([^\s"'<>/=]+)\s*=\s*(?:"([^"]*)"|'([^']*)'|([^\s"'<>=`]+))|\s[^\s"'<>/=]+"""
)
_LINKS = frozenset("cite href poster src xlink:href".split())
_SHOWS = frozenset("audio embed iframe img input object source track video".split())
"""Elements that show a file."""
_SHOWN = frozenset("data poster src srcset".split())
_CANDIDATE = re.compile(r"[\s,]*([^\s,]+)[^,]*")
"""An address of a `srcset`, with the size that follows it."""


class Tag(NamedTuple):
    """A tag, or a comment and the like (then `name` is empty), at `[start, end)` of a text."""

    start: int
    end: int
    name: str
    closes: bool
    complete: bool
    """Whether nothing is left open by it: a void element, or `<x/>`."""


def tag_at(text: str, at: int) -> Tag | None:
    """The tag, comment or raw-text element that begins with the `<` at `at`, if one does."""
    for mark, end in (("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>"), ("<!", ">")):
        if text.startswith(mark, at):
            found = text.find(end, at + len(mark))
            return Tag(at, len(text) if found < 0 else found + len(end), "", False, True)
    tag = _TAG.match(text, at)
    if tag is None:
        return None
    name, closes = tag[2].lower(), bool(tag[1])
    complete = name in VOID or (tag[3].endswith("/") and not closes)
    if name in _RAW_TEXT and not closes and not complete:
        ends = _ends(text, name)
        following = bisect_right(ends, tag.end())
        if following < len(ends):
            return Tag(at, ends[following], name, False, True)
    return Tag(at, tag.end(), name, closes, complete)


@functools.lru_cache(maxsize=4)
def _ends(text: str, name: str) -> list[int]:
    """Where the end tags of an element end."""
    return [end.end() for end in re.finditer(rf"</{name}\s*>", text, re.IGNORECASE)]


def tags(text: str) -> Iterator[Tag]:
    """The tags of a piece of HTML in order."""
    at = text.find("<")
    while at >= 0:
        tag = tag_at(text, at)
        if tag is not None:
            yield tag
        at = text.find("<", at + 1 if tag is None else tag.end)


class Balance:
    """Which elements are open while a document is walked."""

    def __init__(self, report: Callable[[Diagnostic], None]) -> None:
        self._report = report
        self._open: list[tuple[str, Span]] = []
        self._scopes: list[int] = [0]
        self._seen: set[str] = set()
        self._excused: Counter[str] = Counter()
        """End tags whose start tags were already reported."""

    def enter(self) -> None:
        """Begin a block or inline that elements must not reach out of."""
        self._scopes.append(len(self._open))

    def leave(self) -> None:
        """End it."""
        base = self._scopes.pop()
        if len(self._open) > base:
            self._unwind(base)

    def finish(self) -> None:
        """The text is over."""
        self._unwind(0)

    def add(self, tag: Tag, html: Excerpt) -> None:
        """Take note of a tag of a piece of HTML."""
        name, span, text = tag.name, html.span(tag.start, tag.end), html.text
        for attribute, start, end in _attributes(text, tag):
            if attribute not in _LINKS:
                continue
            wrong = check_raw_scheme(unescape(text[start:end]), html.span(start, end))
            if wrong is not None:
                self._report(wrong)
        if text.startswith("<!--", tag.start) and text.find("-->", tag.start) < 0:
            message, help = "this comment is never closed", "close it with `-->`"
            opening = html.span(tag.start, tag.start + 4)
            self._report(diagnose("html-unbalanced", opening, message, help=help))
        if not name or tag.complete or name in VOID or name in _IMPLIED:
            return
        if name in _OPTIONAL:
            if not tag.closes:
                self._seen.add(name)
            elif name not in self._seen:
                self._stray(name, span)
        elif tag.closes:
            self._close(name, span)
        else:
            self._open.append((name, span))

    def _close(self, name: str, span: Span) -> None:
        base = self._scopes[-1]
        for i in range(len(self._open) - 1, max(base, len(self._open) - 200) - 1, -1):
            if self._open[i][0] == name:
                self._unwind(i + 1)
                self._open.pop()
                return
        if self._excused[name]:
            self._excused[name] -= 1
        else:
            self._stray(name, span)

    def _unwind(self, base: int) -> None:
        for name, span in self._open[base:]:
            self._excused[name] += 1
            message = f"`<{name}>` is never closed"
            help = f"write `</{name}>` in the same block, list item or emphasis"
            self._report(diagnose("html-unbalanced", span, message, help=help))
        del self._open[base:]

    def _stray(self, name: str, span: Span) -> None:
        message = f"`</{name}>` closes an element that is not open here"
        self._report(diagnose("html-unbalanced", span, message))


def find_media(html: Excerpt) -> tuple[MediaAddress, ...]:
    """The addresses of files that HTML shows."""
    text = html.text
    return tuple(
        MediaAddress(start, end, unescape(text[start:end]), html.span(start, end))
        for tag in tags(text)
        if tag.name in _SHOWS
        for attribute in _attributes(text, tag)
        if attribute[0] in _SHOWN
        for start, end in _addresses(text, *attribute)
    )


def _attributes(text: str, tag: Tag) -> Iterator[tuple[str, int, int]]:
    """The attributes of a tag that have a value, by name, and where their values stand.

    They are read one after the other: one may stand in the value of another.
    """
    for found in _ATTRIBUTE.finditer(text, tag.start, tag.end) if tag.name else ():
        if found[1]:
            yield found[1].lower(), *found.span(found.lastindex or 0)


def _addresses(text: str, attribute: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    """Where the addresses in the value of an attribute stand."""
    if attribute == "srcset":
        for candidate in _CANDIDATE.finditer(text, start, end):
            yield candidate.span(1)
    elif start < end:
        yield start, end
