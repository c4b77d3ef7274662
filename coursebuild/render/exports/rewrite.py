"""The HTML of a lesson made fit for another place: other ids, other links, or written as XML.

Entry point: `Rewriter(rules).text(html)`.

1. Tags are read one by one (`tags`); attributes that only serve the page's scripts are dropped.
2. Ids and what refers to them get a prefix, headings go down.
3. Addresses of the site become slots, since where they lead in the whole depends on the other
   lessons: `filled` puts the addresses in when the whole is put together.
4. Written as XML, every element is closed, and what has no end has none.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable
from typing import TypeAlias
from urllib.parse import unquote, urlsplit

from coursebuild.render.exports.tags import VOID, End, Start, pieces
from coursebuild.values import dataclass

_OPEN, _SHUT = "\ue000", "\ue001"
"""Around a slot; pages have no such characters."""
_SLOT = re.compile(f" {_OPEN}([^{_SHUT}]*){_SHUT}")
_DROPPED = frozenset("button form template script style dialog iframe object embed".split())
_REFERRING = frozenset(
    "aria-activedescendant aria-controls aria-describedby aria-details aria-errormessage"
    " aria-flowto aria-labelledby aria-owns for headers list".split()
)
"""Attributes that hold ids."""
_IN_SVG = re.compile(r"url\(#([^)]+)\)")
_NAMESPACES = {
    "svg": "http://www.w3.org/2000/svg",
    "math": "http://www.w3.org/1998/Math/MathML",
}
_XLINK = "http://www.w3.org/1999/xlink"
_XML_NAME = re.compile(r"(?:(?:xml|xlink):)?[A-Za-z_][A-Za-z0-9_.-]*")
_FORBIDDEN = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ENDS_P = frozenset(
    "address article aside blockquote details div dl fieldset figcaption figure footer form h1 h2"
    " h3 h4 h5 h6 header hgroup hr main nav ol p pre section table ul".split()
)
_ENDS = {
    "li": ("li",),
    "dt": ("dt", "dd"),
    "dd": ("dt", "dd"),
    "tr": ("td", "th", "tr"),
    "td": ("td", "th"),
    "th": ("td", "th"),
    "tbody": ("td", "th", "tr", "thead", "tbody"),
    "tfoot": ("td", "th", "tr", "thead", "tbody"),
}
"""The open elements that a start tag closes, where their ends were left out."""


@dataclass(frozen=True, slots=True)
class Rules:
    """What is to become of a lesson."""

    path: str
    """The site path of the page that it stands on."""
    prefix: str = ""
    """Before each id."""
    down: int = 0
    """Levels that headings go down."""
    xml: bool = False
    opened: Callable[[Start], bool] = lambda start: True
    """Whether a fold is shown open."""
    pictures: frozenset[str] = frozenset()
    """Endings of the pictures that can be shown; empty where all can."""
    without: frozenset[str] = frozenset()
    """Classes of elements that are left out, with all that is in them."""
    part: str = ""
    """What is added to the names of sections, which are to be unlike those of other parts."""


class Rewriter:
    """Rewrites the HTML of one page."""

    def __init__(self, rules: Rules) -> None:
        self.rules = rules
        self.pictures: dict[str, None] = {}
        """Site paths of the pictures that are shown, in order."""
        self.elements: set[str] = set()
        """Names of all elements."""
        self._known: dict[Start, str] = {}
        self._out: list[str] = []
        self._open: list[str] = []
        self._left_out: list[str] = []
        """Open elements in one that is left out, and that one."""

    def text(self, html: str) -> str:
        """The whole."""
        for piece in pieces(html):
            if isinstance(piece, str):
                if not self._left_out:
                    self._out.append(self._characters(piece))
            elif isinstance(piece, Start):
                self._start(piece)
            else:
                self._end(piece)
        while self._open:
            self._shut()
        return "".join(self._out)

    def _characters(self, text: str) -> str:
        if not self.rules.xml:
            return text
        if "&" in text or "<" in text or ">" in text:
            from html import unescape

            text = escape(unescape(text))
        return _FORBIDDEN.sub("\ufffd", text)

    # --- tags

    def _start(self, start: Start) -> None:
        name = start.name
        if self._left_out or self._is_left_out(start):
            if name not in VOID and not start.closed:
                self._left_out.append(name)
            return
        if self.rules.xml and not _XML_NAME.fullmatch(name):
            return
        for ended in _ENDS.get(name, ("p",) if name in _ENDS_P else ()):
            if self._open and self._open[-1] == ended:
                self._shut()
        if name == "img" and not self._shows(start):
            return
        self.elements.add(name)
        written = self._known.get(start)
        if written is None:
            written = self._tag(start)
            self._known[start] = written
        self._out.append(written)
        if name not in VOID and not start.closed:
            self._open.append(name)

    def _is_left_out(self, start: Start) -> bool:
        if start.name in _DROPPED:
            return True
        without = self.rules.without
        return bool(without and not without.isdisjoint((start.get("class") or "").split()))

    def _end(self, end: End) -> None:
        if self._left_out:
            if end.name in self._left_out:
                while self._left_out.pop() != end.name:
                    pass
            return
        if end.name in self._open:
            while self._open[-1] != end.name:
                self._shut()
            self._shut()

    def _shut(self) -> None:
        self._out.append(f"</{self._lower(self._open.pop())}>")

    def _lower(self, name: str) -> str:
        """The name of an element, a heading's lower by some levels."""
        if self.rules.down and len(name) == 2 and name[0] == "h" and name[1] in "123456":
            return f"h{min(int(name[1]) + self.rules.down, 6)}"
        return name

    def _tag(self, start: Start) -> str:
        rules = self.rules
        parts = [self._lower(start.name)]
        for name, value in start.attributes:
            parts.append(self._attribute(start, name, value))
        if rules.xml and start.name in _NAMESPACES and start.get("xmlns") is None:
            parts.append(f' xmlns="{_NAMESPACES[start.name]}"')
        if start.name == "details" and start.get("open") is None and rules.opened(start):
            parts.append(' open=""')
        closed = rules.xml if start.name in VOID else start.closed
        end = "/>" if closed else ">"
        return f"<{''.join(parts)}{end}"

    def _attribute(self, start: Start, name: str, value: str | None) -> str:
        rules = self.rules
        lower = name.lower()
        if lower.startswith(("on", "data-")) or lower in ("style", "download", "loading", "srcset"):
            return ""
        if rules.xml and (lower in ("tabindex", "sizes") or not _XML_NAME.fullmatch(name)):
            return ""
        if value is None:
            return f' {name}=""' if rules.xml else f" {name}"
        if name == "id" or (name == "name" and start.name == "a"):
            value = self._id(value)
        elif name in _REFERRING:
            value = " ".join(map(self._id, value.split()))
        elif name == "aria-label" and start.name == "section" and rules.part:
            value = f"{value}, {rules.part}"
        elif name in ("href", "xlink:href", "src"):
            # A picture inside a drawing is no part of the book.
            return "" if rules.xml and start.name == "image" else self._address(name, value)
        elif "url(#" in value:
            value = _IN_SVG.sub(lambda match: f"url(#{self._id(match[1])})", value)
        return f' {name}="{self._value(value)}"'

    def _id(self, id: str) -> str:
        id = f"{self.rules.prefix}{id}"
        # In XML an id is a name.
        return xml_id(id) if self.rules.xml else id

    def _value(self, value: str) -> str:
        value = escape(value).replace('"', "&quot;")
        return _FORBIDDEN.sub("\ufffd", value) if self.rules.xml else value

    # --- addresses

    def _address(self, name: str, url: str) -> str:
        space = f' xmlns:xlink="{_XLINK}"' if name == "xlink:href" and self.rules.xml else ""
        if url.startswith("#"):
            anchor = self._id(unquote(url[1:])) if len(url) > 1 else ""
            return f'{space} {name}="#{self._value(quoted(anchor))}"'
        path, anchor = site_path(self.rules.path, url)
        if path is None:
            return f'{space} {name}="{self._value(url)}"'
        return f"{space} {_OPEN}{name} {path}#{anchor}{_SHUT}"

    def _shows(self, image: Start) -> bool:
        """Whether a picture can be shown; if not, what it shows is said in its place."""
        endings = self.rules.pictures
        path, _ = site_path(self.rules.path, image.get("src") or "")
        if path is not None and (not endings or path.lower().rpartition(".")[2] in endings):
            self.pictures[path] = None
            return True
        if not endings:
            return True
        self._out.append(self._characters(escape(image.get("alt") or "")))
        return False


def site_path(page: str, url: str) -> tuple[str | None, str]:
    """The site path and the anchor of an address on a page; `None` where it leads elsewhere."""
    parts = urlsplit(url)
    if parts.scheme or parts.netloc or not parts.path:
        return None, ""
    folder = posixpath.dirname(page)
    path = posixpath.normpath(posixpath.join(folder, unquote(parts.path)))
    if parts.path.endswith("/"):
        path = posixpath.join(path, "index.html")
    return (None, "") if path.startswith(("../", "/")) else (path, unquote(parts.fragment))


Address: TypeAlias = Callable[[str, str, bool], str]
"""Gives the address of a site path and an anchor; empty for none. The last says whether it is of a
picture that is shown, and no link."""


def filled(text: str, address: Address) -> str:
    """A rewritten text with its addresses put in."""

    def put(match: re.Match[str]) -> str:
        name, _, rest = match[1].partition(" ")
        path, _, anchor = rest.partition("#")
        found = address(path, anchor, name == "src")
        return f' {name}="{escape(found).replace(chr(34), "&quot;")}"' if found else ""

    return _SLOT.sub(put, text)


def escape(text: str) -> str:
    """Text as XML."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def quoted(anchor: str) -> str:
    """An anchor as part of an address."""
    from urllib.parse import quote

    return quote(anchor, safe="-._~:")


def xml_id(id: str) -> str:
    """An id as a name of XML: characters that no name has are written as their numbers."""
    if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", id):
        return id
    name = "".join(c if re.match(r"[A-Za-z0-9_.-]", c) else f"_{ord(c):x}_" for c in id)
    return name if re.match("[A-Za-z_]", name) else f"_{name}"
