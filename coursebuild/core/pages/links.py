"""Every internal link, anchor, image and script of the built pages leads somewhere.

Entry points: `check_links(files, base_url)`, which gives what is broken, sorted by page;
`ids_and_addresses`, `references` and `has`, by which it is known beforehand that nothing is.

1. Each page is read once by a real parser: its ids, and the addresses in it.
2. Each address is resolved as a browser would, from the page that has it; those on other hosts are
   left alone.
3. It must be a file of the site, and its fragment an id of that page. What is nearest is proposed.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import TypeAlias
from urllib.parse import unquote, urljoin, urlsplit

from msgspec import Struct

from coursebuild.core.model import linked_lines
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.html_tree import elements_with
from coursebuild.core.text.diagnostics import nearest

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
"""Attributes that hold addresses, by element."""

_NOTED = ("id", "name", *sorted({name for names in _ADDRESSES.values() for name in names}))
"""Attributes that may hold an id or an address."""

_ORIGIN = "https://site.invalid"
"""Stands for wherever the site is served from."""


Reference: TypeAlias = tuple[str, str]
"""A site path and an anchor there, or the empty text; an empty path: the address cannot be right.
"""


class BrokenLink(Struct, frozen=True):
    """An address of a page that leads nowhere."""

    page: str
    """Site path of the page."""
    url: str
    """As it is written there."""
    reason: str
    """What is wrong, lower case, no full stop."""
    near: str | None
    """The nearest file or id that is there."""


def check_links(files: Iterable[OutputFile], base_url: str = "") -> tuple[BrokenLink, ...]:
    """What is broken in a site that is served at `base_url`."""
    contents = {file.path: file.data for file in files}
    pages = {
        path: ids_and_addresses(data.decode())
        for path, data in contents.items()
        if path.endswith(".html")
    }
    ids = {path: found for path, (found, _) in pages.items()}
    broken = (
        problem
        for path, (_, addresses) in pages.items()
        for url in addresses
        if (problem := _problem(path, url, contents.keys(), ids, base_url)) is not None
    )
    return tuple(sorted(broken, key=lambda one: (one.page, one.url)))


def ids_and_addresses(html: str) -> tuple[frozenset[str], frozenset[str]]:
    """The ids in the text of a page, and the addresses in it."""
    ids: set[str] = set()
    addresses: set[str] = set()
    for tag, attributes in elements_with(html, _NOTED):
        for name, value in attributes.items():
            if name == "id" or (name == "name" and tag == "a"):
                ids.add(value or "")
            elif name in _ADDRESSES.get(tag, ()):
                several = name == "srcset"
                addresses.update(_srcset(value or "") if several else (value or "",))
    return frozenset(ids), frozenset(addresses)


def references(path: str, addresses: Iterable[str], base_url: str) -> frozenset[Reference]:
    """Where the addresses of a page lead."""
    found: set[Reference] = set()
    for url in addresses:
        target = _target(path, url, base_url)
        if target is not None:
            found.add(target if isinstance(target, tuple) else ("", target))
    return frozenset(found)


def has(ids: Collection[str], anchor: str) -> bool:
    """Whether an anchor is among ids, of which those of lines may be `without_lines`."""
    if anchor in ids:
        return True
    lines = linked_lines(anchor)
    if lines is None:
        return False
    others = (other for name in ids if (other := linked_lines(name)) is not None)
    return any(stem == lines[0] and lines[2] <= last for stem, _, last in others)


def without_lines(ids: Iterable[str]) -> frozenset[str]:
    """Ids with the last line of each listing for all of its lines."""
    kept: set[str] = set()
    longest: dict[str, int] = {}
    for name in ids:
        lines = linked_lines(name) if ".L" in name else None
        if lines is None:
            kept.add(name)
            continue
        stem, _, last = lines
        if last > longest.get(stem, 0):
            longest[stem] = last
    return frozenset(kept | {f"{stem}.L{last}" for stem, last in longest.items()})


@functools.lru_cache(maxsize=8)
def _base(base_url: str) -> tuple[str, str]:
    """The folder that a site is served from, and the host; empty where that is not known."""
    parts = urlsplit(base_url)
    host = f"{parts.scheme}://{parts.netloc}" if parts.netloc else ""
    return f"{parts.path.rstrip('/')}/", host


def _target(path: str, url: str, base_url: str) -> Reference | str | None:
    """The file and the anchor of an address; why it has none; `None` where it leads elsewhere."""
    folder, own = _base(base_url)
    try:
        parts = urlsplit(urljoin(_ORIGIN + folder + urls.encode(path), url.strip()))
    except ValueError:
        return "the address cannot be read"
    host = f"{parts.scheme}://{parts.netloc}"
    if host not in (_ORIGIN, own):
        return None
    if not f"{parts.path}/".startswith(folder):
        return "the address leads out of the site" if host == _ORIGIN else None
    target = unquote(parts.path[len(folder) :])
    if not target or target.endswith("/"):
        target += urls.HOME
    return target, unquote(parts.fragment)


def _problem(
    path: str,
    url: str,
    files: Collection[str],
    ids: Mapping[str, Collection[str]],
    base_url: str,
) -> BrokenLink | None:
    def broken(reason: str, near: str | None = None) -> BrokenLink:
        return BrokenLink(path, url, reason, near)

    found = _target(path, url, base_url)
    if found is None:
        return None
    if isinstance(found, str):
        return broken(found)
    target, anchor = found
    if target not in files:
        return broken(f"no file `{target}` in the site", nearest(target, files, cutoff=0.7))
    if anchor in ("", "top") or target not in ids or has(ids[target], anchor):
        return None
    return broken(f"`{target}` has no anchor `#{anchor}`", nearest(anchor, ids[target]))


def _srcset(value: str) -> Iterator[str]:
    return (part.split()[0] for part in value.split(",") if part.strip())
