"""Addresses and ids of a lesson that is brought to another place.

Entry points: `site_path`, where an address of a page leads; `filled`, a text with its addresses put
in; `quoted`, `xml_id`, `escape`, what ids and texts become.
"""

from __future__ import annotations

import functools
import posixpath
import re
from collections.abc import Callable
from typing import TypeAlias
from urllib.parse import quote, unquote, urlsplit

from coursebuild.patterns import pattern

OPEN, SHUT = "\ue000", "\ue001"
"""Around a slot, in which an address is put later. An author may write them, as icons of a font."""
_SLOT = pattern(f" {OPEN}((?:xlink:href|href|src) [^{OPEN}{SHUT}]*){SHUT}")


@functools.lru_cache(maxsize=128)
def site_path(page: str, url: str) -> tuple[str | None, str]:
    """The site path and the anchor of an address on a page; `None` where it leads elsewhere.

    A lesson is written twice, and asks the same both times.
    """
    try:
        parts = urlsplit(url)
    except ValueError:  # it is no address
        return None, ""
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
    return anchor if _AS_IT_IS.fullmatch(anchor) else quote(anchor, safe="-._~:")


def xml_id(id: str) -> str:
    """An id as a name of XML: characters that no name has are written as their numbers."""
    if _IS_XML_ID.fullmatch(id):
        return id
    name = _NO_NAME.sub(lambda match: f"_{ord(match[0]):x}_", id)
    return f"_{name}" if not name or name[0] in "0123456789.-" else name


_IS_XML_ID = pattern(r"[A-Za-z_][A-Za-z0-9_.-]*+")
_NO_NAME = pattern(r"[^A-Za-z0-9_.-]")
_AS_IT_IS = pattern(r"[A-Za-z0-9_.~:-]*+")
