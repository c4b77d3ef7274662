"""HTML as a row of tags and texts, read as a browser's tokenizer reads it.

Entry point: `pieces(html)`; `VOID`, the elements without an end.

Nothing is known here of what may stand in what. Tags are read once each: a page has few different
ones and has them often.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from html import unescape
from typing import TypeAlias

from coursebuild.values import dataclass

VOID = frozenset("area base br col embed hr img input link meta param source track wbr".split())


@dataclass(frozen=True, slots=True)
class Start:
    """A start tag."""

    name: str
    """In lower case, but for those of SVG."""
    attributes: tuple[tuple[str, str | None], ...]
    """Values are plain text; `None` where there is only a name. Each name once."""
    closed: bool
    """Whether it says that it has no content: `<path/>`."""

    def get(self, name: str) -> str | None:
        """The value of an attribute; `None` where there is none."""
        return next((value or "" for key, value in self.attributes if key == name), None)


@dataclass(frozen=True, slots=True)
class End:
    """An end tag."""

    name: str


Piece: TypeAlias = Start | End | str
"""A string is text, as written: with its character references."""

_MARK = re.compile(
    r"<!--(?:>|->|.*?(?:-->|--!>|\Z))"
    r"|<(?P<raw>script|style|textarea|title|xmp|iframe|noembed|noframes)\b"
    r"""(?P<rest>(?:[^"'>]|"[^"]*"|'[^']*')*)>(?P<inside>.*?)</(?P=raw)[^>]*>"""
    r"""|<(?P<tag>/?[a-zA-Z](?:[^"'>]|"[^"]*"|'[^']*')*)>"""
    r"|<[!?/][^>]*>",
    re.DOTALL | re.IGNORECASE,
)
_NAME = re.compile(r"/?([a-zA-Z][^\s/>]*)")
_ATTRIBUTE = re.compile(r"""([^\s"'>/=]+)(?:\s*=\s*("[^"]*"|'[^']*'|[^\s"'=<>`]+))?""")
_SHORT = 24
"""Characters of a tag that is remembered."""
_DROPPED = frozenset("script style xmp iframe noembed noframes".split())


def pieces(html: str) -> Iterator[Piece]:
    """Its tags and texts in order; comments, scripts and styles are left out."""
    at = 0
    for match in _MARK.finditer(html):
        if match.start() > at:
            yield html[at : match.start()]
        at = match.end()
        if match["tag"]:
            text = match["tag"]
            # A tag with an address or an id comes once: it would only fill the cache.
            yield (_tag if len(text) < _SHORT else _read)(text)
        elif match["raw"] and match["raw"].lower() not in _DROPPED:
            yield _read(f"{match['raw']}{match['rest']}")
            yield match["inside"]
            yield End(match["raw"].lower())
    if at < len(html):
        yield html[at:]


@functools.lru_cache(maxsize=512)
def _tag(text: str) -> Start | End:
    return _read(text)


def _read(text: str) -> Start | End:
    match = _NAME.match(text)
    assert match is not None, "the pattern of tags begins with a name"
    name = match[1] if match[1] in _CAMEL else match[1].lower()
    if text.startswith("/"):
        return End(name)
    rest = text[match.end() :]
    found: dict[str, str | None] = {}
    for key, value in _ATTRIBUTE.findall(rest):
        plain = value[1:-1] if value[:1] in ('"', "'") else value
        found.setdefault(key, unescape(plain) if value else None)
    return Start(name, tuple(found.items()), rest.rstrip().endswith("/"))


_CAMEL = frozenset(
    "clipPath foreignObject linearGradient radialGradient textPath animateTransform".split()
)
