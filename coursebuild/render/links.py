"""Every internal link, anchor, image and script of the built pages leads somewhere.

Entry point: `check_links(files, base_url)`, which gives what is broken, sorted by page and place.

1. Each page is read once by a real parser: its ids, and the addresses in it with their lines.
2. Each address is resolved as a browser would, from the page that has it; those on other hosts are
   left alone.
3. It must be a file of the site, and its fragment an id of that page. What is nearest is proposed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from urllib.parse import unquote, urljoin, urlsplit

from coursebuild.diagnostics import nearest
from coursebuild.render import urls
from coursebuild.results import OutputFile

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

_ORIGIN = "https://site.invalid"
"""Stands for wherever the site is served from."""


@dataclass(frozen=True, slots=True)
class BrokenLink:
    """An address of a page that leads nowhere."""

    page: str
    """Site path of the page."""
    line: int
    """Its line in the page, from 1."""
    url: str
    """As it is written there."""
    reason: str
    """What is wrong, lower case, no full stop."""
    near: str | None
    """The nearest file or id that is there."""


@dataclass(frozen=True, slots=True)
class _Address:
    url: str
    line: int


@dataclass(frozen=True, slots=True)
class _Page:
    ids: frozenset[str]
    addresses: tuple[_Address, ...]


def check_links(files: Iterable[OutputFile], base_url: str = "") -> tuple[BrokenLink, ...]:
    """What is broken in a site that is served at `base_url`."""
    contents = {file.path: file.data for file in files}
    pages = {path: _read(data) for path, data in contents.items() if path.endswith(".html")}
    base = urlsplit(base_url)
    root = f"{_ORIGIN}{base.path.rstrip('/')}/"
    own = f"{base.scheme}://{base.netloc}" if base.netloc else None
    broken = (
        problem
        for path, page in pages.items()
        for address in page.addresses
        if (problem := _problem(path, address, contents.keys(), pages, root, own)) is not None
    )
    return tuple(sorted(broken, key=lambda b: (b.page, b.line, b.url)))


def _problem(
    path: str,
    address: _Address,
    files: Iterable[str],
    pages: Mapping[str, _Page],
    root: str,
    own: str | None,
) -> BrokenLink | None:
    def broken(reason: str, near: str | None = None) -> BrokenLink:
        return BrokenLink(path, address.line, address.url, reason, near)

    try:
        url = urlsplit(urljoin(root + urls.encode(path), address.url.strip()))
    except ValueError:
        return broken("the address cannot be read")
    host = f"{url.scheme}://{url.netloc}"
    if host not in (_ORIGIN, own):
        return None
    folder = urlsplit(root).path
    if not f"{url.path}/".startswith(folder):
        return broken("the address leads out of the site") if host == _ORIGIN else None
    target = unquote(url.path[len(folder) :])
    if not target or target.endswith("/"):
        target += urls.HOME
    if target not in files:
        return broken(f"no file `{target}` in the site", nearest(target, files, cutoff=0.7))
    anchor = unquote(url.fragment)
    if not anchor or anchor == "top" or target not in pages or anchor in pages[target].ids:
        return None
    return broken(f"`{target}` has no anchor `#{anchor}`", nearest(anchor, pages[target].ids))


class _Reader(HTMLParser):
    """Collects ids and addresses."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.ids: set[str] = set()
        self.addresses: list[_Address] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element's id and addresses."""
        wanted = _ADDRESSES.get(tag, ())
        for name, value in attrs:
            if value is None:
                continue
            if name == "id" or (name == "name" and tag == "a"):
                self.ids.add(value)
            elif name == "srcset" and name in wanted:
                self.addresses += [_Address(url, self.getpos()[0]) for url in _srcset(value)]
            elif name in wanted:
                self.addresses.append(_Address(value, self.getpos()[0]))


def _srcset(value: str) -> Iterator[str]:
    for part in value.split(","):
        if part.strip():
            yield part.split()[0]


def _read(data: bytes) -> _Page:
    reader = _Reader()
    reader.feed(data.decode())
    reader.close()
    return _Page(frozenset(reader.ids), tuple(reader.addresses))
