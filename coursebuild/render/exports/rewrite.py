"""The HTML of a lesson made fit for another place: other ids, other links, or written as XML.

Entry point: `Rewriter(rules).text(html)`.

1. What is the same everywhere is copied in long runs (`cut`). Other tags are read once each
   (`tags`); attributes that only serve the page's scripts are dropped.
2. Ids and what refers to them get a prefix, headings go down.
3. Addresses of the site become slots, since where they lead in the whole depends on the other
   lessons: `addresses.filled` puts them in when the whole is put together.
4. Written as XML, every element is closed, and what has no end has none.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import TypeAlias
from urllib.parse import unquote

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.patterns import pattern
from coursebuild.render.exports.addresses import OPEN, SHUT, escape, quoted, site_path, xml_id
from coursebuild.render.exports.attributes import (
    ADDRESS,
    ID,
    IDS,
    OF_PAGES,
    OF_SCRIPTS,
    XML_NAME,
    use_of,
)
from coursebuild.render.exports.cut import MATHML, Cut
from coursebuild.render.exports.tags import VOID, End, Piece, Start, read
from coursebuild.render.formulas import Woven

_DROPPED = frozenset("button form template script style dialog iframe object embed".split())
_SIMPLE = pattern('[^&<>"\\x00-\\x1f\ud800-\udfff\ufffe\uffff]*+')
"""A value that is the same everywhere."""
_IN_SVG = pattern(r"url\(#([^)]+)\)")
_NAMESPACES = {
    "svg": "http://www.w3.org/2000/svg",
    "math": MATHML,
}
_XLINK = "http://www.w3.org/1999/xlink"
_FORBIDDEN = pattern("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
"""What XML has not; said so since to compile a set takes as long as there are characters in it."""
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


_Written: TypeAlias = tuple[int, str, str, tuple[str, ...]]
"""What becomes of a mark: its kind, the name of its element, what is written, and the elements that
it ends where their ends were left out."""
_START, _END, _BETWEEN, _LEFT_OUT = range(4)
"""Kinds: what opens and closes an element, what does neither, what opens one that is left out."""
_NOTHING: _Written = (_BETWEEN, "", "", ())
_OWN = pattern(
    r'<([a-z][a-z0-9]*+)((?: (?!id=|href=|data-)[a-z-]++="[^"&]*+")*+) (id|href)="([^"&]*+)"'
    r'((?: (?!id=|href=|data-)[a-z-]++="[^"&]*+")*+)>'
)
"""A start tag as we write most of those with a value of their own: the element, the attributes
before, the one with that value, which is next, and the attributes after."""
_SLOT = "own."
"""Stands for that attribute; the names of the others have no dot."""
_BY_VALUE = frozenset(("details", "img"))
"""Elements of which an attribute may decide more than what is written in its place."""
_Shape: TypeAlias = tuple[int, str, str, str, tuple[str, ...]]
"""What becomes of such tags, whatever the value: as above, but what is written in two parts. Where
the second is empty, nothing of the tag is."""
_SHORT = 120
"""Characters of a mark that is remembered for other pages."""
_MANY = 1000
"""How many are remembered."""


class Rules(Struct, frozen=True):
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
        known = _everywhere(replace(rules, path="", prefix="", part=""))
        self._everywhere, self._shapes = known
        self._known = self._everywhere.copy()
        self._here = False
        """Whether what was written just now is so on this page only."""
        self._out: list[str] = []
        self._open: list[str] = []

    def text(self, html: str) -> str:
        """The whole."""
        return self.of(Cut(Woven((html,))))

    def of(self, cut: Cut) -> str:
        """The same of what was cut, for another rewriter too perhaps."""
        known, out, open_ = self._known, self._out, self._open
        prefix = self._value(self._id("")) if self.rules.prefix else ""
        rest = zip(cut.moved(prefix, xml=self.rules.xml), cut.marks, strict=True)
        for run, mark in rest:
            out.append(run)
            found = known.get(mark)
            if found is None:
                found = known[mark] = self._learnt(mark, cut)
            kind, name, written, ends = found
            if kind == _END:
                if open_ and open_[-1] == name:
                    open_.pop()
                    out.append(written)
                else:
                    self._end(name)
                continue
            if kind == _LEFT_OUT:
                _skip(name, rest, cut)
                continue
            if ends and open_ and open_[-1] in ends:
                for ended in ends:
                    if open_ and open_[-1] == ended:
                        self._shut()
            out.append(written)
            if kind == _START:
                open_.append(name)
        while open_:
            self._shut()
        return "".join(out)

    def _end(self, name: str) -> None:
        if name in self._open:
            while self._open[-1] != name:
                self._shut()
            self._shut()

    def _shut(self) -> None:
        self._out.append(f"</{self._lower(self._open.pop())}>")

    # --- tags

    def _learnt(self, mark: str, cut: Cut) -> _Written:
        own = _OWN.fullmatch(mark)
        if own is not None and (shaped := self._shaped(*own.groups())) is not None:
            return shaped
        self._here = len(mark) > _SHORT
        written = self._written(cut.read(mark))
        if not self._here and len(self._everywhere) < _MANY:
            self._everywhere[mark] = written
        return written

    def _shaped(self, name: str, before: str, own: str, value: str, after: str) -> _Written | None:
        """What becomes of a tag like `_OWN`; `None` where it must be looked at as a whole."""
        at = name, before, own, after
        if at not in self._shapes:
            if len(self._shapes) >= _MANY:
                self._shapes.clear()
            self._shapes[at] = self._shape(name, before, after)
        shape = self._shapes[at]
        if shape is None:
            return None
        kind, name, start, end, ends = shape
        written = f"{start}{self._attribute(name, own, value)}{end}" if end else start
        return kind, name, written, ends

    def _shape(self, name: str, before: str, after: str) -> _Shape | None:
        self._here = name in _BY_VALUE
        kind, name, written, ends = self._written(read(f'<{name}{before} {_SLOT}=""{after}>'))
        start, _, end = written.partition(f' {_SLOT}=""')
        return None if self._here else (kind, name, start, end, ends)

    def _written(self, found: tuple[Piece, ...]) -> _Written:
        """What becomes of a mark; of one outside of what is left out."""
        if not found:
            return _NOTHING
        first, *rest = found
        if isinstance(first, str):
            self._here = True
            return _BETWEEN, "", self._characters(first), ()
        if isinstance(first, End):
            return _END, first.name, f"</{self._lower(first.name)}>", ()
        kind, name, written, ends = self._start(first)
        if rest and kind == _START:  # it has no tags in it
            inside = "".join(self._characters(piece) for piece in rest if isinstance(piece, str))
            return _BETWEEN, name, f"{written}{inside}</{name}>", ends
        return (_BETWEEN, name, "", ()) if rest else (kind, name, written, ends)

    def _characters(self, text: str) -> str:
        if not self.rules.xml:
            return text
        if "&" in text or "<" in text or ">" in text:
            from html import unescape

            text = escape(unescape(text))
        return _FORBIDDEN.sub("\ufffd", text)

    def _start(self, start: Start) -> _Written:
        name = start.name
        alone = name in VOID or start.closed
        if self._is_left_out(start):
            return _NOTHING if alone else (_LEFT_OUT, name, "", ())
        if self.rules.xml and not XML_NAME.fullmatch(name):
            return _NOTHING
        ends = _ENDS.get(name, ("p",) if name in _ENDS_P else ())
        if name == "img" and not self._shows(start):
            return _BETWEEN, name, self._characters(escape(start.get("alt") or "")), ()
        return _BETWEEN if alone else _START, name, self._tag(start), ends

    def _is_left_out(self, start: Start) -> bool:
        if start.name in _DROPPED:
            return True
        without = self.rules.without
        return bool(without and not without.isdisjoint((start.get("class") or "").split()))

    def _lower(self, name: str) -> str:
        """The name of an element, a heading's lower by some levels."""
        if self.rules.down and len(name) == 2 and name[0] == "h" and name[1] in "123456":
            return f"h{min(int(name[1]) + self.rules.down, 6)}"
        return name

    def _tag(self, start: Start) -> str:
        rules, name = self.rules, start.name
        text = f"<{self._lower(name)}"
        for key, value in start.attributes:
            text += self._attribute(name, key, value)
        if rules.xml and name in _NAMESPACES and start.get("xmlns") is None:
            text += f' xmlns="{_NAMESPACES[name]}"'
        if name == "details" and start.get("open") is None and rules.opened(start):
            text += ' open=""'
        closed = rules.xml if name in VOID else start.closed
        return f"{text}/>" if closed else f"{text}>"

    def _attribute(self, element: str, name: str, value: str | None) -> str:
        rules, use = self.rules, use_of(name)
        if use == OF_SCRIPTS or (use == OF_PAGES and rules.xml):
            return ""
        if value is None:
            # A name with a prefix would have to be declared, and says nothing without a value.
            return ("" if ":" in name else f' {name}=""') if rules.xml else f" {name}"
        if use == ID or (name == "name" and element == "a"):
            value = self._id(value)
        elif use == IDS:
            value = " ".join(map(self._id, value.split()))
        elif name == "aria-label" and element == "section":
            self._here = True
            value = f"{value}, {rules.part}" if rules.part else value
        elif use == ADDRESS:
            # A picture inside a drawing is no part of the book.
            return "" if rules.xml and element == "image" else self._address(name, value)
        elif "url(#" in value:
            value = _IN_SVG.sub(lambda match: f"url(#{self._id(match[1])})", value)
        return f' {name}="{self._value(value)}"'

    def _id(self, id: str) -> str:
        self._here = True
        id = self.rules.prefix + id
        # In XML an id is a name.
        return xml_id(id) if self.rules.xml else id

    def _value(self, value: str) -> str:
        if _SIMPLE.fullmatch(value):
            return value
        value = escape(value).replace('"', "&quot;")
        return _FORBIDDEN.sub("\ufffd", value) if self.rules.xml else value

    # --- addresses

    def _address(self, name: str, url: str) -> str:
        self._here = True
        space = f' xmlns:xlink="{_XLINK}"' if name == "xlink:href" and self.rules.xml else ""
        if url.startswith("#"):
            anchor = self._id(unquote(url[1:])) if len(url) > 1 else ""
            return f'{space} {name}="#{self._value(quoted(anchor))}"'
        path, anchor = site_path(self.rules.path, url)
        if path is None:
            return f'{space} {name}="{self._value(url)}"'
        return f"{space} {OPEN}{name} {path}#{anchor}{SHUT}"

    def _shows(self, image: Start) -> bool:
        """Whether a picture can be shown; if not, what it shows is said in its place."""
        self._here = True
        endings = self.rules.pictures
        path, _ = site_path(self.rules.path, image.get("src") or "")
        if path is not None and (not endings or path.lower().rpartition(".")[2] in endings):
            self.pictures[path] = None
            return True
        return not endings


@functools.lru_cache(maxsize=8)
def _everywhere(
    rules: Rules,
) -> tuple[dict[str, _Written], dict[tuple[str, str, str, str], _Shape | None]]:
    """What is the same on all pages: most tags have no address and no id, or nothing else."""
    return {}, {}


def _skip(name: str, rest: Iterator[tuple[str, str]], cut: Cut) -> None:
    """Go behind the end of an element that has begun."""
    open_ = [name]
    for _, mark in rest:
        for piece in cut.read(mark):
            if isinstance(piece, Start):
                if piece.name not in VOID and not piece.closed:
                    open_.append(piece.name)
            elif isinstance(piece, End) and piece.name in open_:
                while open_.pop() != piece.name:
                    pass
        if not open_:
            return
