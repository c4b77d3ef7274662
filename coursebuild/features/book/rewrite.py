"""The HTML of a lesson made fit for another place: other ids, other links, nothing for scripts.

Entry point: `rewritten(content, rules)`.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator
from urllib.parse import unquote, urlsplit

from msgspec import Struct

from coursebuild.core.pages import urls
from coursebuild.core.pages.html_tree import HtmlContent, HtmlElement

_DROPPED = frozenset(
    "button form template script style dialog iframe object embed audio video source track"
    " noembed noframes".split()
)
_WITHOUT_MARKUP = frozenset(("plaintext", "xmp"))
"""Elements in which all is text; the first has no end, and would take what follows into it."""
_NOT_PRINTED = frozenset(("anchor", "bar-tools", "plot-wide", "figure-dark", "qr"))
"""Classes of what is left out: links of headings to themselves, downloads, QR codes; of two
drawings of a plot the one that small screens cannot show, or that is for dark pages."""
_FOR_SCRIPTS = frozenset(
    "style download loading srcset sizes tabindex xmlns usemap autofocus".split()
)
_REFERRING = frozenset(
    "aria-activedescendant aria-controls aria-describedby aria-details aria-errormessage"
    " aria-flowto aria-labelledby aria-owns for headers list".split()
)
"""Attributes that hold ids."""
_ADDRESSES = frozenset(("href", "xlink:href", "src"))
_IN_SVG = re.compile(r"url\(#([^)]+)\)")


class Rules(Struct, frozen=True):
    """What is to become of a lesson."""

    path: str
    """The site path of its page."""
    address: Callable[[str, str], str]
    """Where a link to a site path and an anchor leads; empty for nowhere."""
    picture: Callable[[str], str]
    """Where the picture at a site path is; empty where it cannot be shown."""
    id: Callable[[str], str]
    """What becomes of an id."""
    lowered: int = 0
    """Levels that headings go down."""
    closed: frozenset[str] = frozenset()
    """Classes of the folds that stay closed."""
    section: str = ""
    """What is added to the names of sections, which are to be unlike those of other lessons."""


def rewritten(content: Iterable[HtmlContent], rules: Rules) -> Iterator[HtmlContent]:
    """Content of a lesson's page for another place."""
    for child in content:
        if isinstance(child, str):
            yield child
        elif child.name not in _DROPPED and not child.classes & _NOT_PRINTED:
            yield _element(child, rules)


def _element(element: HtmlElement, rules: Rules) -> HtmlContent:
    name, given = element.name, element.attributes
    if name == "img":
        path, _ = site_target(rules.path, given.get("src", ""))
        shown = rules.picture(path) if path is not None else ""
        if not shown:  # what it shows is said in its place
            return given.get("alt", "")
        given = given | {"src": shown}
    attributes = {
        key: found
        for key, value in given.items()
        if (found := _attribute(element, key, value, rules)) is not None
    }
    if name == "details" and not element.classes & rules.closed:
        attributes["open"] = ""
    if name in _WITHOUT_MARKUP:
        name = "pre"
    if len(name) == 2 and name[0] == "h" and name[1] in "123456":
        name = f"h{min(int(name[1]) + rules.lowered, 6)}"
    return HtmlElement(name, attributes, list(rewritten(element.children, rules)))


def _attribute(element: HtmlElement, name: str, value: str, rules: Rules) -> str | None:
    """What becomes of the value of an attribute; `None` where the attribute goes."""
    if name in _FOR_SCRIPTS or name.startswith(("on", "data-")):
        return None
    if name == "id" or (name == "name" and element.name == "a"):
        return rules.id(value)
    if name in _REFERRING:
        return " ".join(map(rules.id, value.split()))
    if name == "aria-label" and element.name == "section" and rules.section:
        return f"{value}, {rules.section}"
    if name == "src" and element.name == "img":
        return value
    if name in _ADDRESSES:
        # A picture inside a drawing is no part of the lesson.
        return None if element.name == "image" else _address(value, rules)
    if "url(#" in value:
        return _IN_SVG.sub(lambda match: f"url(#{rules.id(match[1])})", value)
    return value


def _address(url: str, rules: Rules) -> str | None:
    if url.startswith("#"):
        return f"#{urls.quoted(rules.id(unquote(url[1:])))}" if len(url) > 1 else "#"
    path, anchor = site_target(rules.path, url)
    return url if path is None else rules.address(path, anchor) or None


def site_target(page: str, url: str) -> tuple[str | None, str]:
    """The site path and the anchor of an address on a page; `None` where it leads elsewhere."""
    try:
        parts = urlsplit(url)
    except ValueError:  # it is no address
        return None, ""
    if parts.scheme or parts.netloc or not parts.path:
        return None, ""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(page), unquote(parts.path)))
    if parts.path.endswith("/"):
        path = posixpath.join(path, "index.html")
    return (None, "") if path.startswith(("../", "/")) else (path, unquote(parts.fragment))
