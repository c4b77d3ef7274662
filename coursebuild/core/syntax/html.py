"""Raw HTML: its tags, whether they balance, the files that it shows, and what it must not hold.

Elements whose end tag may be left out, void elements, comments and raw text never give a false
alarm. An element must be closed in the block, list item or emphasis in which it was opened, as it
would break the structure of the page otherwise.

Raw HTML runs nothing, loads nothing from other hosts and cannot imitate the interface: it may hold
text, comments, and the elements and attributes listed here, in a form that every parser reads
alike. Nothing is removed or rewritten: what is published is the text that was judged.
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
from coursebuild.core.model.inlines import ForbiddenHtml
from coursebuild.core.syntax.link_targets import check_raw_scheme
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

VOID = frozenset("area base br col embed hr img input link meta param source track wbr".split())
_IMPLIED_ELEMENTS = frozenset("body colgroup head html tbody tfoot thead".split())
"""Elements that exist without any tag."""
_OPTIONAL = frozenset("caption dd dt li optgroup option p rp rt td th tr".split())
_RAW_TEXT = frozenset("script style textarea title".split())
LITERAL = frozenset("code kbd math pre samp svg".split()) | _RAW_TEXT
"""Elements in which a dollar is a dollar."""

_TAG = regex(r"""<(/?)([A-Za-z][A-Za-z0-9:-]*)(?=[\s/>])((?>(?:"[^"]*"|'[^']*'|[^"'<>])*))>""")
_ATTRIBUTE = regex(
    r"""\s([^\s"'<>/=]+)\s*=\s*(?:"([^"]*)"|'([^']*)'|([^\s"'<>=`]+))|\s[^\s"'<>/=]+"""
)
_LINK_ATTRIBUTES = frozenset("cite href poster src xlink:href".split())
_MEDIA_ELEMENTS = frozenset("audio embed iframe img input object source track video".split())
_MEDIA_ATTRIBUTES = frozenset("data poster src srcset".split())
_CANDIDATE = regex(r"[\s,]*([^\s,]+)[^,]*")
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
        is_picture = name == "img" and not tag.is_end_tag
        if is_picture and not any(name == "alt" for name, *_ in _attributes(text, tag)):
            message, help = "the image has no alternative text", 'write what it shows: `alt="…"`'
            self._report(diagnose("image-alt", span, message, help=help))
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
        elif not tag.is_end_tag:
            self._open.append((name, span))
        else:
            first = max(self._scopes[-1], len(self._open) - 200)
            openings = range(len(self._open) - 1, first - 1, -1)
            at = next((i for i in openings if self._open[i][0] == name), None)
            if at is not None:
                self._unwind(at + 1)
                self._open.pop()
            elif self._reported[name]:
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
    return tuple(
        MediaAddress(start, end, unescape(html.text[start:end]), html.span(start, end))
        for element, attribute, start, end in _addresses(html.text)
        if element in _MEDIA_ELEMENTS and attribute in _MEDIA_ATTRIBUTES
    )


def find_address(text: str, url: str) -> tuple[int, int] | None:
    """The place where HTML first names an address in an attribute, however it is escaped there."""
    for _, attribute, start, end in _addresses(text):
        is_address = attribute in _LINK_ATTRIBUTES | _MEDIA_ATTRIBUTES
        if is_address and unescape(text[start:end]) == url:
            return start, end
    return None


def _attributes(text: str, tag: Tag) -> Iterator[tuple[str, int, int]]:
    """The attributes with a value, and its place; in order, as a value may hold others."""
    for match in _ATTRIBUTE.finditer(text, tag.start, tag.end) if tag.name else ():
        if match[1]:
            yield match[1].lower(), *match.span(match.lastindex or 0)


def _addresses(text: str) -> Iterator[tuple[str, str, int, int]]:
    """The element and the attribute of each address, and its place."""
    for tag in tags(text):
        for attribute, start, end in _attributes(text, tag):
            if attribute == "srcset":
                for candidate in _CANDIDATE.finditer(text, start, end):
                    yield tag.name, attribute, *candidate.span(1)
            elif start < end:
                yield tag.name, attribute, start, end


ELEMENTS = frozenset(
    "a abbr address article aside audio b bdi bdo big blockquote br caption center cite code col "
    "colgroup data dd del details dfn div dl dt em figcaption figure footer h1 h2 h3 h4 h5 h6 "
    "header hgroup hr i img ins kbd li mark meter nav ol p picture pre progress q rp rt ruby s "
    "samp section small source span strike strong sub summary sup table tbody td tfoot th thead "
    "time tr track tt u ul var video wbr "
    # SVG
    "circle clippath defs desc ellipse g line lineargradient marker mask path pattern polygon "
    "polyline radialgradient rect stop svg symbol text textpath title tspan use "
    # MathML
    "math menclose merror mfrac mi mmultiscripts mn mo mover mpadded mphantom mprescripts mroot "
    "mrow ms mspace msqrt mstyle msub msubsup msup mtable mtd mtext mtr munder munderover none "
    "semantics".split()
)
_WORDS = frozenset(
    "abbr align alt autoplay border cellpadding cellspacing class colspan compact "
    "controls coords datetime decoding default dir display download headers height hidden "
    "high hreflang id itemprop kind label lang loading loop low max media min muted nowrap open "
    "optimum playsinline preload rel reversed role rowspan rules scope sizes span srclang start "
    "tabindex target title "
    "translate type valign value width xml:lang xml:space xmlns xmlns:xlink "
    # SVG and MathML
    "accent accentunder clippathunits columnalign columnspan columnspacing cx cy d depth dx dy "
    "fence focusable form fr fx fy gradienttransform gradientunits lengthadjust linethickness "
    "lspace mathsize mathvariant markerheight markerunits markerwidth maskcontentunits maskunits "
    "maxsize minsize movablelimits notation offset orient pathlength patterncontentunits "
    "patterntransform patternunits points preserveaspectratio r refx refy rowalign rowspacing "
    "rspace rx ry scriptlevel separator spreadmethod startoffset stretchy symmetric textlength "
    "transform version viewbox voffset x x1 x2 y y1 y2".split()
)
"""Attributes with any value."""
_STYLES = frozenset(
    "background-color bgcolor clip-path clip-rule color displaystyle dominant-baseline fill "
    "fill-opacity fill-rule font-family font-size font-style font-weight letter-spacing marker-end "
    "marker-mid marker-start mask mathbackground mathcolor opacity paint-order shape-rendering "
    "stop-color stop-opacity stroke stroke-dasharray stroke-dashoffset stroke-linecap "
    "stroke-linejoin stroke-miterlimit stroke-opacity stroke-width style text-anchor "
    "text-decoration text-rendering vector-effect visibility word-spacing writing-mode".split()
)
"""Attributes whose value is CSS, or is read as such."""
_STYLE = regex(r"(?>(?:(?!url|position)[^\\\"'@{}<>]|url\(#[\w-]+\))*)", re.IGNORECASE)
_ADDRESSES = _LINK_ATTRIBUTES | {"srcset"}
"""Attributes whose schemes and files are checked in every course."""

_STRICT_ATTRIBUTE = r"""\s+([A-Za-z][A-Za-z0-9:_-]*)(?:\s*=\s*("[^"]*"|'[^']*'|[^\s"'=<>`]+))?"""
_STRICT_TAG = regex(rf"<([A-Za-z][A-Za-z0-9-]*)((?>(?:{_STRICT_ATTRIBUTE})*))\s*/?>")
_ATTRIBUTES = regex(_STRICT_ATTRIBUTE)
_HARMLESS = regex(
    r"[^<]++|<(?![A-Za-z/!?])|</[A-Za-z][A-Za-z0-9-]*\s*>|<!--(?!-?>)(?>(?:(?!--!?>|</title).)*)-->",
    re.DOTALL | re.IGNORECASE,
)
"""Text, the end of an element, a comment."""


def find_forbidden(html: Excerpt) -> tuple[ForbiddenHtml, ...]:
    """The parts of HTML that a page must not hold."""
    text, at = html.text, 0
    parts: list[tuple[int, int, str]] = []
    while at < len(text):
        if (tag := _STRICT_TAG.match(text, at)) is not None:
            element, end = tag[1].lower(), tag.end()
            if element not in ELEMENTS:
                parts.append((at, end, f"`<{tag[1]}>` is not allowed in a page"))
                at = end
                continue
            for attribute in _ATTRIBUTES.finditer(text, *tag.span(2)):
                value = unescape((attribute[2] or "").strip("\"'"))
                subject = _find_forbidden_part(element, attribute[1].lower(), value)
                if subject:
                    message = f"{subject} is not allowed in a page"
                    parts.append((attribute.start(1), attribute.end(), message))
        elif (harmless := _HARMLESS.match(text, at)) is not None:
            end = harmless.end()
        elif text.startswith("<!--", at) and "-->" not in text[at:]:
            break  # an error in every course
        else:
            end = text.find(">", at) + 1 or len(text)
            parts.append((at, end, "this is not HTML that every browser reads in the same way"))
        at = end
    return tuple(ForbiddenHtml(html.span(start, end), message) for start, end, message in parts)


def _find_forbidden_part(element: str, name: str, value: str) -> str:
    """The forbidden part of an attribute, in words; empty if it is allowed."""
    if "</title" in value.lower():  # ends a `<title>` of HTML even inside quotes
        return f"`{name}` with the end of a title"
    if name in _ADDRESSES:
        outside = element == "use" and not value.startswith("#")
        return f"`<use>` of another file, `{value}`," if outside else ""
    if name == "name":  # on an image it would hide a property of `document`
        return "" if element in ("a", "details") else "the attribute `name`"
    if name in _STYLES:
        return "" if _STYLE.fullmatch(value) else f"`{name}` with such a value"
    return "" if name in _WORDS or name.startswith("aria-") else f"the attribute `{name}`"
