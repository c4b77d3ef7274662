"""The paths of pages and files in the site, and addresses from one page to another.

A site path is plain text, POSIX, relative to the site's root; it is percent-encoded only as part of
an address. Every address is relative, so that the site works in any folder, from a disk and under
any base; the page for missing addresses is served at every depth, so its addresses begin with the
path of the course's base address instead.
"""

from __future__ import annotations

import functools
import posixpath
from urllib.parse import quote, unquote, urlsplit

from msgspec import Struct

from coursebuild.core.model import Lesson, Level, Owner, Page, local_file
from coursebuild.core.text.regex import regex

HOME = "index.html"
NOT_FOUND = "404.html"
EXAMPLES_ZIP = "examples.zip"
MODELS = "models/index.html"
NUMERICS = "numerics/index.html"
"""In a folder that no page of a course can occupy."""
SITEMAP = "sitemap.xml"
ROBOTS = "robots.txt"
MANIFEST = "manifest.webmanifest"
VERSIONS = "versions.json"
"""The versions of the course that are published: where sites stand beside each other, the list is
replaced by that of all."""
WORKER = "service-worker.js"
"""In the root, since a worker serves its own folder."""
FILES = "files.json"


def lesson_path(lesson: Lesson) -> str:
    """`lessons/4.2-mass-and-inertia.html`."""
    return f"lessons/{lesson.id}-{lesson.slug}.html"


def lesson_zip_path(lesson: Lesson) -> str:
    """`lessons/4.2-mass-and-inertia.zip`: the scripts of one lesson."""
    return f"lessons/{lesson.id}-{lesson.slug}.zip"


def copy_path(page: str, ending: str) -> str:
    """`lessons/4.2-mass-and-inertia.md`: a copy of a page, by the ending of its name."""
    return page.removesuffix(".html") + ending


def level_path(level: Level) -> str:
    """`levels/4.html`."""
    return f"levels/{level.id}.html"


def model_page_path(name: str) -> str:
    """`models/tumbling_box.html`."""
    return f"models/{name}.html"


def model_file_path(name: str) -> str:
    """`models/tumbling_box.xml`: the model itself."""
    return f"models/{name}.xml"


def page_path(page: Page) -> str:
    """`about.html`; the page `home` opens the home page."""
    return HOME if page.is_home else f"{page.id}.html"


def owner_path(owner: Owner) -> str:
    """The page of a lesson, or another page."""
    return lesson_path(owner) if isinstance(owner, Lesson) else page_path(owner)


def file_path(path: str) -> str:
    """`files/lessons/sketch.svg`: a file of the course; what a model includes stays beside it."""
    return path if path.startswith("models/") else "files/" + path.removeprefix("content/")


def dark_path(path: str) -> str:
    """`files/lessons/flip.dark.svg`: a drawing of the course for dark pages."""
    return f"{file_path(path).removesuffix('.svg')}.dark.svg"


def absolute(base_url: str, path: str) -> str:
    """The full address of a site path; empty if the course has no base address."""
    if not base_url:
        return ""
    return base_url.rstrip("/") + "/" + encode("" if path == HOME else path)


def base_path(base_url: str) -> str:
    """The path of a course's base address, with a slash at both ends."""
    path = urlsplit(base_url).path.strip("/")
    return f"/{path}/" if path else "/"


_UNRESERVED = regex("[A-Za-z0-9/~._+@,-]*+")


def encode(path: str) -> str:
    """A site path as part of an address; colons are encoded, since one may read as a scheme."""
    return path if _UNRESERVED.fullmatch(path) else quote(path, safe="/~-._+@,")


def quote_anchor(anchor: str) -> str:
    """An anchor as part of an address."""
    return quote(anchor, safe="-._~:")


@functools.lru_cache(maxsize=1 << 14)  # the pages of a folder link to the same ones
def _relative(path: str, folder: str) -> str:
    """The address of a site path from the pages of a folder."""
    ends, starts = path.split("/"), folder.split("/") if folder else []
    shared = 0
    while shared < min(len(ends) - 1, len(starts)) and ends[shared] == starts[shared]:
        shared += 1
    return encode("/".join([".."] * (len(starts) - shared) + ends[shared:]))


class Place(Struct, frozen=True):
    """A page that addresses are relative to."""

    path: str
    root: str | None = None
    """The prefix of every address; `None` to make addresses relative to `path`."""

    def href(self, path: str, anchor: str | None = None) -> str:
        """The address of a site path, and of an anchor there."""
        fragment = f"#{quote(anchor, safe='')}" if anchor else ""
        if self.root is not None:
            return self.root + encode("" if path == HOME else path) + fragment
        if path == self.path:
            return fragment or encode(posixpath.basename(path))
        return _relative(path, self.path.rpartition("/")[0]) + fragment

    def target(self, address: str) -> tuple[str | None, str]:
        """The site path and anchor of an address on the page; `None` if it leads elsewhere."""
        try:
            parts = urlsplit(address)
        except ValueError:  # it is no address
            return None, ""
        if parts.scheme or parts.netloc or not parts.path:
            return None, ""
        path = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), unquote(parts.path)))
        if parts.path.endswith("/"):
            path = posixpath.join(path, "index.html")
        return (None, "") if path.startswith(("../", "/")) else (path, unquote(parts.fragment))


def file_address(place: Place, path: str, url: str) -> str:
    """An address as written; that of a file of the course becomes its place in the site."""
    parts = urlsplit(url)
    if parts.scheme or parts.netloc or not parts.path:
        return url
    site_path = file_path(local_file(url, path))
    return place.href(site_path) + url[len(url.split("#", 1)[0].split("?", 1)[0]) :]
