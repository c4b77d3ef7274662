"""HTML as a row of tags and texts, read as a browser's tokenizer reads it.

Entry points: `pieces(html)`; `read(mark)`, what one of its marks is; `VOID`, the elements without
an end.

Nothing is known here of what may stand in what. Short tags are read once each: a page has few
different ones and has them often.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from html import unescape
from typing import TypeAlias

from msgspec import Struct

from coursebuild.patterns import pattern

VOID = frozenset("area base br col embed hr img input link meta param source track wbr".split())


class Start(Struct, frozen=True):
    """A start tag."""

    name: str
    """In lower case, but for those of SVG."""
    attributes: tuple[tuple[str, str | None], ...]
    """Values are plain text; `None` where there is only a name. Each name once."""
    closed: bool
    """Whether it says that it has no content: `<path/>`."""

    def get(self, name: str) -> str | None:
        """The value of an attribute; `None` where there is none."""
        for key, value in self.attributes:
            if key == name:
                return value or ""
        return None


class End(Struct, frozen=True):
    """An end tag."""

    name: str


Piece: TypeAlias = Start | End | str
"""A string is text, as written: with its character references."""

_INSIDE = r"""(?:[^"'>]++|"[^"]*"|'[^']*')*+"""
"""Of a tag, behind its name."""
_NAMED = r"(?P<raw>(?ai:script|style|textarea|title|xmp|iframe|noembed|noframes)(?=[\s/>]))"
"""An element in which there are no tags."""
_ENDED = r"</(?ai:(?P=raw))(?=[\s/>])[^>]*>"
MARK = (
    r"</[a-z][a-z0-9]*+>"
    r'|<(?!s[ct]|t[ei]|xm|if|no)[a-z][a-z0-9]*+(?: [a-z-]++="[^"]*+")*+>'
    r"|<!--(?:>|->|.*?(?:-->|--!>|\Z))"
    rf"|<{_NAMED}{_INSIDE}>.*?{_ENDED}"
    rf"|</?[a-zA-Z]{_INSIDE}>"
    r"|<[!?/][^>]*>"
)
"""What is no text: a comment, an element without tags in it, a tag, a declaration. Before these,
what most of them are: tags as we write them. A dot is any character."""
_MARK = pattern(MARK, re.DOTALL)
_PARTS = pattern(
    rf"<{_NAMED}(?P<rest>{_INSIDE})>(?P<inside>.*?){_ENDED}|<(?P<tag>/?[a-zA-Z]{_INSIDE})>",
    re.DOTALL,
)
_RAW = frozenset("script style textarea title xmp iframe noembed noframes".split())
_PLAIN = pattern(r'<([a-z][a-z0-9]*+)((?: [a-z-]++="[^"&]*+")*+)>')
_PLAIN_ATTRIBUTE = pattern(r' ([a-z-]++)="([^"]*+)"')
"""A start tag as we write most of them, of which nothing else need be asked."""
_NAME = pattern(r"/?([a-zA-Z][^\s/>]*)")
_ATTRIBUTE = pattern(r"""([^\s"'>/=]+)(?:\s*=\s*("[^"]*"|'[^']*'|[^\s"'=<>`]+))?""")
_SHORT = 24
"""Characters of a mark that is remembered."""
_DROPPED = frozenset("script style xmp iframe noembed noframes".split())
_CAMEL = frozenset(
    "clipPath foreignObject linearGradient radialGradient textPath animateTransform".split()
)


def pieces(html: str) -> Iterator[Piece]:
    """Its tags and texts in order; comments, scripts and styles are left out."""
    at = 0
    for match in _MARK.finditer(html):
        if match.start() > at:
            yield html[at : match.start()]
        at = match.end()
        yield from read(match[0])
    if at < len(html):
        yield html[at:]


def read(mark: str) -> tuple[Piece, ...]:
    """What a mark is; nothing where it is left out. Another text is itself."""
    # A tag with an address or an id comes once: it would only fill the cache.
    return (_short if len(mark) < _SHORT else _read)(mark)


def _read(mark: str) -> tuple[Piece, ...]:
    plain = _PLAIN.fullmatch(mark)
    if plain is not None:
        name, attributes = plain.groups()
        found = _PLAIN_ATTRIBUTE.findall(attributes)
        if name not in _RAW and len(dict(found)) == len(found):
            return (Start(name, tuple(found), False),)
    match = _PARTS.fullmatch(mark)
    if match is None:
        return () if _MARK.fullmatch(mark) else (mark,)
    if match["tag"]:
        return (_tag(match["tag"]),)
    name = match["raw"].lower()
    if name in _DROPPED:
        return ()
    # A slash closes no such element.
    start = _tag(f"{match['raw']}{match['rest'].rstrip().rstrip('/')}")
    return start, match["inside"], End(name)


_short = functools.lru_cache(maxsize=512)(_read)


def _tag(text: str) -> Start | End:
    match = _NAME.match(text)
    assert match is not None, "the pattern of tags begins with a name"
    name = match[1] if match[1] in _CAMEL else match[1].lower()
    if text.startswith("/"):
        return End(name)
    found: dict[str, str | None] = {}
    for key, value in _ATTRIBUTE.findall(text, match.end()):
        if key not in found:
            plain = value[1:-1] if value[:1] in ('"', "'") else value
            found[key] = unescape(plain) if value else None
    return Start(name, tuple(found.items()), text.rstrip().endswith("/"))
