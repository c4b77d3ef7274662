"""Raw HTML: its tags, whether they balance, and the files that it shows.

Entry points: `tags` and `tag_at`, which scan; `Balance`, which tracks open elements; `find_media`;
`find_address`, the place of an address.

Elements whose end tag may be left out, void elements, comments and raw text never give a false
alarm. An element must be closed in the block, list item or emphasis in which it was opened, as it
would break the structure of the page otherwise.
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
_IMPLIED_ELEMENTS = frozenset("body colgroup head html tbody tfoot thead".split())
"""Elements that exist without any tag."""
_OPTIONAL = frozenset("caption dd dt li optgroup option p rp rt td th tr".split())
"""Elements whose end tag may be left out."""
_RAW_TEXT = frozenset("script style textarea title".split())
LITERAL = frozenset("code kbd math pre samp svg".split()) | _RAW_TEXT
"""Elements in which a dollar is a dollar."""

_TAG = re.compile(r"""<(/?)([A-Za-z][A-Za-z0-9:-]*)(?=[\s/>])((?:"[^"]*"|'[^']*'|[^"'<>])*+)>""")
_ATTRIBUTE = re.compile(
    r"""\s([^\s"'<>/=]+)\s*=\s*(?:"([^"]*)"|'([^']*)'|([^\s"'<>=`]+))|\s[^\s"'<>/=]+"""
)
_LINK_ATTRIBUTES = frozenset("cite href poster src xlink:href".split())
_MEDIA_ELEMENTS = frozenset("audio embed iframe img input object source track video".split())
"""Elements that show a file."""
_MEDIA_ATTRIBUTES = frozenset("data poster src srcset".split())
_CANDIDATE = re.compile(r"[\s,]*([^\s,]+)[^,]*")
"""An address of a `srcset`, with the size that follows it."""


class Tag(NamedTuple):
    """A tag, or a comment and the like (then `name` is empty), at `[start, end)` of a text."""

    start: int
    end: int
    name: str
    is_end_tag: bool
    is_complete: bool
    """Whether it needs no end tag: a void element, or `<x/>`."""


def tag_at(text: str, at: int) -> Tag | None:
    """The tag, comment or raw-text element that begins with the `<` at `at`, if one does."""
    for mark, mark_end in (("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>"), ("<!", ">")):
        if text.startswith(mark, at):
            position = text.find(mark_end, at + len(mark))
            return Tag(at, len(text) if position < 0 else position + len(mark_end), "", False, True)
    tag = _TAG.match(text, at)
    if tag is None:
        return None
    name, is_end_tag = tag[2].lower(), bool(tag[1])
    is_complete = name in VOID or (tag[3].endswith("/") and not is_end_tag)
    if name in _RAW_TEXT and not is_end_tag and not is_complete:
        ends = _end_tag_ends(text, name)
        following = bisect_right(ends, tag.end())
        if following < len(ends):
            return Tag(at, ends[following], name, False, True)
    return Tag(at, tag.end(), name, is_end_tag, is_complete)


@functools.lru_cache(maxsize=4)
def _end_tag_ends(text: str, name: str) -> list[int]:
    """The offsets at which the end tags of an element end."""
    return [match.end() for match in re.finditer(rf"</{name}\s*>", text, re.IGNORECASE)]


def tags(text: str) -> Iterator[Tag]:
    """The tags of a piece of HTML in order."""
    at = text.find("<")
    while at >= 0:
        tag = tag_at(text, at)
        if tag is not None:
            yield tag
        at = text.find("<", at + 1 if tag is None else tag.end)


class Balance:
    """The elements that are open while a document is walked."""

    def __init__(self, report: Callable[[Diagnostic], None]) -> None:
        self._report = report
        self._open: list[tuple[str, Span]] = []
        self._scopes: list[int] = [0]
        self._opened_names: set[str] = set()
        self._reported: Counter[str] = Counter()
        """How many start tags without end were reported, so that a late end tag is no mistake."""

    def enter(self) -> None:
        """Begin a block or inline in which elements opened there must be closed."""
        self._scopes.append(len(self._open))

    def leave(self) -> None:
        """End the block or inline that was entered last."""
        base = self._scopes.pop()
        if len(self._open) > base:
            self._unwind(base)

    def finish(self) -> None:
        """Report what is still open at the end of the text."""
        self._unwind(0)

    def add(self, tag: Tag, html: Excerpt) -> None:
        """Record a tag of a piece of HTML, and report its mistakes."""
        name, span, text = tag.name, html.span(tag.start, tag.end), html.text
        for attribute, start, end in _attributes(text, tag):
            if attribute not in _LINK_ATTRIBUTES:
                continue
            diagnostic = check_raw_scheme(unescape(text[start:end]), html.span(start, end))
            if diagnostic is not None:
                self._report(diagnostic)
        if text.startswith("<!--", tag.start) and text.find("-->", tag.start) < 0:
            message, help = "this comment is never closed", "close it with `-->`"
            opening = html.span(tag.start, tag.start + 4)
            self._report(diagnose("html-unbalanced", opening, message, help=help))
        if not name or tag.is_complete or name in VOID or name in _IMPLIED_ELEMENTS:
            return
        if name in _OPTIONAL:
            if not tag.is_end_tag:
                self._opened_names.add(name)
            elif name not in self._opened_names:
                self._report_stray(name, span)
        elif tag.is_end_tag:
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
        if self._reported[name]:
            self._reported[name] -= 1
        else:
            self._report_stray(name, span)

    def _unwind(self, base: int) -> None:
        for name, span in self._open[base:]:
            self._reported[name] += 1
            message = f"`<{name}>` is never closed"
            help = f"write `</{name}>` in the same block, list item or emphasis"
            self._report(diagnose("html-unbalanced", span, message, help=help))
        del self._open[base:]

    def _report_stray(self, name: str, span: Span) -> None:
        message = f"`</{name}>` closes an element that is not open here"
        self._report(diagnose("html-unbalanced", span, message))


def find_media(html: Excerpt) -> tuple[MediaAddress, ...]:
    """The addresses of files that HTML shows."""
    text = html.text
    return tuple(
        MediaAddress(start, end, unescape(text[start:end]), html.span(start, end))
        for tag in tags(text)
        if tag.name in _MEDIA_ELEMENTS
        for attribute in _attributes(text, tag)
        if attribute[0] in _MEDIA_ATTRIBUTES
        for start, end in _addresses(text, *attribute)
    )


def find_address(text: str, url: str) -> tuple[int, int] | None:
    """The place where HTML first names an address in an attribute, however it is escaped there."""
    places = (
        place
        for tag in tags(text)
        for attribute in _attributes(text, tag)
        for place in _addresses(text, *attribute)
        if attribute[0] in _LINK_ATTRIBUTES | _MEDIA_ATTRIBUTES
    )
    return next((place for place in places if unescape(text[slice(*place)]) == url), None)


def _attributes(text: str, tag: Tag) -> Iterator[tuple[str, int, int]]:
    """The names of the attributes with a value, and where these values stand.

    They are read one after the other, as the text of one may occur in the value of another.
    """
    for match in _ATTRIBUTE.finditer(text, tag.start, tag.end) if tag.name else ():
        if match[1]:
            yield match[1].lower(), *match.span(match.lastindex or 0)


def _addresses(text: str, attribute: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    """The places of the addresses in the value of an attribute."""
    if attribute == "srcset":
        for candidate in _CANDIDATE.finditer(text, start, end):
            yield candidate.span(1)
    elif start < end:
        yield start, end
