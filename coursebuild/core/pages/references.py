"""Checking that every internal link, anchor, image and script of the built pages leads somewhere.

Each address is resolved from its page, as a browser would; other hosts are left alone. It must be a
file of the site, and its fragment an id of that page; otherwise the nearest one is suggested.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable
from typing import TypeAlias
from urllib.parse import unquote, urljoin, urlsplit

from msgspec import Struct

from coursebuild.core.model import linked_lines
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.html_xml import elements_with
from coursebuild.core.text.near import nearest

_ADDRESSES = {
    "a": ("href",),
    "area": ("href",),
    "audio": ("src",),
    "embed": ("src",),
    "iframe": ("src",),
    "image": ("href",),
    "img": ("src", "srcset"),
    "input": ("src",),
    "link": ("href",),
    "object": ("data",),
    "script": ("src",),
    "source": ("src", "srcset"),
    "track": ("src",),
    "use": ("href",),
    "video": ("src", "poster"),
}

_LINK_ATTRIBUTES = ("id", "name", *sorted({name for n in _ADDRESSES.values() for name in n}))

_ORIGIN = "https://site.invalid"
"""Stands for the host that serves the site."""


Reference: TypeAlias = tuple[str, str]
"""A site path and an anchor there, perhaps empty. If the address is wrong, the path is empty, and
words for what is wrong stand for the anchor."""


class BrokenLink(Struct, frozen=True):
    """An address of a page that leads nowhere."""

    page: str
    url: str
    reason: str
    """What is wrong, lower case, no full stop."""
    suggestion: str | None


def check_links(files: Iterable[OutputFile], base_url: str = "") -> tuple[BrokenLink, ...]:
    """The broken links in a site that is served at `base_url`."""
    contents = {file.path: file.data for file in files}
    pages = {
        path: ids_and_addresses(data.decode())
        for path, data in contents.items()
        if path.endswith(".html")
    }
    broken: list[BrokenLink] = []
    for path, (_, addresses, _) in pages.items():
        for url in addresses:
            resolved = _target(path, url, base_url)
            if resolved is None:
                continue
            target, anchor = resolved
            reason, suggestion = anchor, None
            if target and target not in contents:
                reason = f"no file `{target}` in the site"
                suggestion = nearest(target, contents)
            elif target:
                ids = pages[target][0] if target in pages else None
                if ids is None or anchor in ("", "top") or has_anchor(ids, anchor):
                    continue
                reason = f"`{target}` has no anchor `#{anchor}`"
                suggestion = nearest(anchor, ids)
            broken.append(BrokenLink(path, url, reason, suggestion))
    return tuple(sorted(broken, key=lambda link: (link.page, link.url)))


def ids_and_addresses(html: str) -> tuple[frozenset[str], frozenset[str], frozenset[str]]:
    """The ids in the text of a page, the addresses, and the ids that several elements have."""
    ids: set[str] = set()
    repeated_ids: set[str] = set()
    names: set[str] = set()
    addresses: set[str] = set()
    for tag, attributes in elements_with(html, _LINK_ATTRIBUTES):
        for name, value in attributes.items():
            if name == "id":
                (repeated_ids if value in ids else ids).add(value or "")
            elif name == "name" and tag == "a":
                names.add(value or "")
            elif name == "srcset" and name in _ADDRESSES.get(tag, ()):
                addresses.update(p.split()[0] for p in (value or "").split(",") if p.strip())
            elif name in _ADDRESSES.get(tag, ()):
                addresses.add(value or "")
    return frozenset(ids | names), frozenset(addresses), frozenset(repeated_ids)


def references(path: str, addresses: Iterable[str], base_url: str) -> frozenset[Reference]:
    """The targets of the addresses in a page."""
    targets = (_target(path, url, base_url) for url in addresses)
    return frozenset(target for target in targets if target is not None)


def has_anchor(ids: Collection[str], anchor: str) -> bool:
    """Whether an anchor is among ids, which may have been through `merge_line_ids`."""
    if anchor in ids:
        return True
    lines = linked_lines(anchor)
    if lines is None:
        return False
    listings = (name_lines for name in ids if (name_lines := linked_lines(name)) is not None)
    return any(stem == lines[0] and lines[2] <= last for stem, _, last in listings)


def merge_line_ids(ids: Iterable[str]) -> frozenset[str]:
    """Keep of the ids of a listing's lines only that of the last, which stands for all."""
    other_ids: set[str] = set()
    longest: dict[str, int] = {}
    for name in ids:
        lines = linked_lines(name) if ".L" in name else None
        if lines is None:
            other_ids.add(name)
            continue
        stem, _, last = lines
        if last > longest.get(stem, 0):
            longest[stem] = last
    return frozenset(other_ids | {f"{stem}.L{last}" for stem, last in longest.items()})


def _target(path: str, url: str, base_url: str) -> Reference | None:
    """The target of an address; `None` for another site."""
    if url.startswith("#") and url.isprintable():  # as most
        return path, unquote(url.strip()[1:])
    is_own = url.strip()[:1] in ("", "?", "#")
    return _resolve(path if is_own else path[: path.rfind("/") + 1], url, base_url)


@functools.lru_cache(maxsize=4096)
def _resolve(path: str, url: str, base_url: str) -> Reference | None:
    """The target of an address on a page, or on any page of a folder: all have the same menus."""
    base = urlsplit(base_url)
    folder = f"{base.path.rstrip('/')}/"
    site_host = f"{base.scheme}://{base.netloc}" if base.netloc else ""
    try:
        parts = urlsplit(urljoin(_ORIGIN + folder + urls.encode(path), url.strip()))
    except ValueError:
        return "", "the address cannot be read"
    host = f"{parts.scheme}://{parts.netloc}"
    if host not in (_ORIGIN, site_host):
        return None
    if not f"{parts.path}/".startswith(folder):
        return ("", "the address leads out of the site") if host == _ORIGIN else None
    target = unquote(parts.path[len(folder) :])
    if not target or target.endswith("/"):
        target += urls.HOME
    return target, unquote(parts.fragment)
