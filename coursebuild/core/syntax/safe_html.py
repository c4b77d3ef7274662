"""Raw HTML that runs nothing, loads nothing from other hosts and cannot imitate the interface.

Entry point: `find_forbidden`.

1. HTML may hold text, comments, and the elements and attributes listed here, in a form that every
   parser reads alike.
2. Nothing is removed or rewritten: what is published is the text that was judged.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import unescape

from coursebuild.core.model.inlines import ForbiddenHtml
from coursebuild.core.text.source import Excerpt

_ELEMENTS = frozenset(
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
_STYLE = re.compile(r"(?:(?!url|position)[^\\\"'@{}<>]|url\(#[\w-]+\))*+", re.IGNORECASE)
_ADDRESSES = frozenset("cite href poster src srcset xlink:href".split())
"""Attributes whose schemes and files are checked in every course."""

_ATTRIBUTE = r"""\s+([A-Za-z][A-Za-z0-9:_-]*)(?:\s*=\s*("[^"]*"|'[^']*'|[^\s"'=<>`]+))?"""
_TAG = re.compile(rf"<([A-Za-z][A-Za-z0-9-]*)((?:{_ATTRIBUTE})*+)\s*/?>")
_ATTRIBUTES = re.compile(_ATTRIBUTE)
_HARMLESS = re.compile(
    r"[^<]++|<(?![A-Za-z/!?])|</[A-Za-z][A-Za-z0-9-]*\s*>|<!--(?!-?>)(?:(?!--!?>|</title).)*+-->",
    re.DOTALL | re.IGNORECASE,
)
"""Text, the end of an element, a comment."""


def find_forbidden(html: Excerpt) -> tuple[ForbiddenHtml, ...]:
    """The parts of HTML that a page must not hold."""
    parts = _check_html(html.text)
    return tuple(ForbiddenHtml(html.span(start, end), message) for start, end, message in parts)


def _check_html(html: str) -> Iterator[tuple[int, int, str]]:
    """Yield the start, the end and the message of each part that is not allowed."""
    at = 0
    while at < len(html):
        if (tag := _TAG.match(html, at)) is not None:
            yield from _check_tag(html, tag)
            at = tag.end()
        elif (harmless := _HARMLESS.match(html, at)) is not None:
            at = harmless.end()
        elif html.startswith("<!--", at) and "-->" not in html[at:]:
            return  # an error in every course
        else:
            end = html.find(">", at) + 1 or len(html)
            yield at, end, "this is not HTML that every browser reads in the same way"
            at = end


def _check_tag(html: str, tag: re.Match[str]) -> Iterator[tuple[int, int, str]]:
    element = tag[1].lower()
    if element not in _ELEMENTS:
        yield *tag.span(), f"`<{tag[1]}>` is not allowed in a page"
        return
    for attribute in _ATTRIBUTES.finditer(html, *tag.span(2)):
        value = unescape((attribute[2] or "").strip("\"'"))
        subject = _find_forbidden_part(element, attribute[1].lower(), value)
        if subject:
            yield attribute.start(1), attribute.end(), f"{subject} is not allowed in a page"


def _find_forbidden_part(element: str, name: str, value: str) -> str:
    """The part of an attribute that is forbidden, in words; empty if it is allowed."""
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
