"""What makes the site an application that works without a network.

Entry point: `offline_files(site)`: the manifest, its icons and the service worker; and the list of
all files, by which the worker knows what there is.

1. The worker is the same text in every build of the same tool: what changes with a course stands in
   the list. So an edit of a page changes that page and its line in the list.
2. The list has three groups. `shell` is what every page needs, `text` what pages show, `rest` what
   is large, or for those who look closer: the engine and the data of labs, models, scripts. Copies
   of the course in other forms (archives, books) are in none.
3. A file whose name holds a hash of its content needs no other; of every other file the list holds
   the first digits of one.
"""

from __future__ import annotations

import functools
import json
import textwrap
from collections.abc import Iterable, Iterator

from coursebuild.core.drawing.contrast import GROUNDS_LIGHT
from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import Course
from coursebuild.core.model.results import FileFacts, FileList, OutputFile
from coursebuild.core.model.theme import ThemeFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.added_files import SiteContext
from coursebuild.core.pages.assets import Assets, hashed_name, page_script
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.frame import Names
from coursebuild.core.pages.theme import picture_size

PAPER = GROUNDS_LIGHT[0]
"""The ground of a page in light colours."""

_FORMAT = 1
_DIGITS = 12
"""Of a hash; what is told apart are states of one file."""
_SHORT = 12
"""Characters of a name below an icon."""
_COPIES = (".br", ".gz", ".zip", ".ipynb", ".md", ".imscc")
_PICTURES = (".svg", ".png", ".jpg", ".jpeg", ".gif", ".webp", ".avif")
_NEEDED = (".css", ".js", ".svg")
_SHOWN = (".html", ".webmanifest", *_PICTURES)
_SEARCH_INDEX = "search/index.js"
_LARGE = 1 << 20
"""Bytes: a page or picture of more is kept for those only who ask for everything."""
_MACHINES = (urls.ROBOTS, urls.SITEMAP, urls.WORKER, "llms.txt", "llms-full.txt")


def offline_files(site: SiteContext) -> Iterator[OutputFile | FileList]:
    """All of them."""
    yield from _application(site.library.course, site.assets, site.names)
    key = step_key("list of files", site.names)
    yield FileList(urls.FILES, key, functools.partial(listing, shell_of(site.names)))


def _application(course: Course, assets: Assets, names: Names) -> tuple[OutputFile, ...]:
    theme = course.theme
    pictures = [_entry(names.icon, theme.icon or theme.touch_icon)]
    if theme.touch_icon is not None and theme.icon is not None:
        pictures.append(_entry(names.touch_icon, theme.touch_icon))
    drawn: list[OutputFile] = []
    if not (theme.icon or theme.touch_icon):
        for name, side in (("192", 192), ("512", 512), ("maskable", 512)):
            drawn.append(_icon(assets, f"icon-{name}.png"))
            pictures.append(_png(drawn[-1].path, f"{side}x{side}"))
        pictures[-1]["purpose"] = "maskable"
    manifest = {
        "id": "./",
        "name": course.title,
        "short_name": short_name(course.title),
        "description": course.summary,
        "lang": course.language or "en",
        "dir": direction(course.language or "en"),
        "start_url": "./",
        "scope": "./",
        "display": "standalone",
        "theme_color": PAPER,
        "background_color": PAPER,
        "categories": ["education"],
        "icons": pictures,
    }
    text = json.dumps({k: v for k, v in manifest.items() if v}, ensure_ascii=False, indent=1)
    worker = page_script(assets.file("js/service-worker.js"))
    return (
        *drawn,
        OutputFile(urls.MANIFEST, f"{text}\n".encode("utf-8", "replace")),
        OutputFile(urls.WORKER, worker),
    )


def _entry(path: str, file: ThemeFile | None) -> dict[str, str]:
    """An icon of the manifest; the tool's own is an SVG."""
    if file is None or file.ending == "svg":
        return {"src": path, "type": "image/svg+xml", "sizes": "any"}
    width, height = picture_size(file) or (0, 0)
    return _png(path, f"{width}x{height}")


def _png(path: str, size: str) -> dict[str, str]:
    return {"src": path, "type": "image/png", "sizes": size}


def short_name(title: str) -> str:
    """As many words of a title as have room below an icon, but at least the first."""
    line = " ".join(title.split())
    lines = textwrap.wrap(line, _SHORT, break_long_words=False, break_on_hyphens=False)
    # A word that ends what was cut off joins nothing.
    return "".join(lines[:1]).rstrip(" ,;:–—-") or title


def _icon(assets: Assets, name: str) -> OutputFile:
    data = assets.file(f"icons/{name}")
    return OutputFile(hashed_name(f"assets/{name}", data), data)


# ---------------------------------------------------------------------------------- the list


def shell_of(names: Names) -> frozenset[str]:
    """What every page needs, but for the fonts, and what is there when nothing else is."""
    pages = {urls.HOME, "offline/index.html", urls.MANIFEST}
    return frozenset(pages | {path for path in names.paths() if path.endswith(_NEEDED)})


def listing(shell: frozenset[str], files: Iterable[FileFacts]) -> bytes:
    """The list of files, as JSON with a line for each."""
    groups: dict[str, dict[str, str]] = {"shell": {}, "text": {}, "rest": {}}
    sizes = dict.fromkeys(groups, 0)
    for file in files:
        group = _group(shell, file)
        if group is not None:
            groups[group][file.path] = "" if _is_lasting(file) else file.digest[:_DIGITS]
            sizes[group] += file.size
    parts = [f'"format": {_FORMAT}']
    for name, found in groups.items():
        parts.append(f'"{name}": {{\n"bytes": {sizes[name]},\n"files": {_lines(found)}\n}}')
    return ("{\n" + ",\n".join(parts) + "\n}\n").encode("utf-8", "surrogatepass")


def _lines(files: dict[str, str]) -> str:
    """A line for each file, as `json` writes with an indent of 0, but at once."""
    text = json.dumps(files, ensure_ascii=False, separators=(",\n", ": "))
    return f"{{\n{text[1:-1]}\n}}" if files else "{}"


def _group(shell: frozenset[str], file: FileFacts) -> str | None:
    path = file.path
    if path in _MACHINES or path.endswith(_COPIES) or path == urls.NOT_FOUND:
        return None
    if path in shell or path.startswith("assets/fonts/"):
        return "shell"
    if path.startswith("assets/"):
        labs = path.startswith("assets/labs/") and not path.endswith(_PICTURES)
        return "rest" if labs else "text"
    shown = path.endswith(_SHOWN) or path == _SEARCH_INDEX
    return "text" if shown and file.size <= _LARGE else "rest"


def _is_lasting(file: FileFacts) -> bool:
    """Whether the name holds the content's hash."""
    digits = file.path.rpartition(".")[0].rpartition(".")[2]
    return file.path.startswith("assets/") and digits == file.digest[:8]
