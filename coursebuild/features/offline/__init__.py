"""The site without a network, and the page about it, which is also shown for missing pages.

The service worker is the same in every build of the same tool: what changes with a course is in the
list of files, each with the first digits of its hash unless its name has one. Of its groups,
`shell` is what every page needs, `text` what pages show, `rest` what is large or rarely needed: the
engine and the data of labs, models, scripts. Archives and books are in no group.
"""

from __future__ import annotations

import functools
import json
import textwrap
from collections.abc import Iterable, Iterator

from coursebuild.api import (
    Feature,
    FileList,
    OutputFile,
    PageKind,
    PagePart,
    SiteContext,
    step_key,
    urls,
)
from coursebuild.core.drawing.contrast import GROUNDS_LIGHT
from coursebuild.core.drawing.picture_size import picture_size
from coursebuild.core.model.course import ThemeFile
from coursebuild.core.model.results import FileFacts
from coursebuild.core.pages.assets import hashed_name, page_script
from coursebuild.core.pages.renderer import direction

PAPER = GROUNDS_LIGHT[0]
"""The background of a page in light colours."""

_FORMAT = 1
_DIGITS = 12
"""Digits of a hash in the list: enough to distinguish the versions of one file."""
_MAX_NAME = 12
"""Characters that fit below an icon."""
_COPIES = (".br", ".gz", ".zip", ".ipynb", ".md")
_PICTURES = (".svg", ".png", ".jpg", ".jpeg", ".gif", ".webp", ".avif")
_SHELL = (".css", ".js", ".svg")
_TEXT = (".html", ".webmanifest", *_PICTURES)
_SEARCH_INDEX = "search/index.js"
_LARGE = 1 << 20
"""Bytes: larger pages and pictures are only stored for those who ask for everything."""
_FOR_MACHINES = (urls.ROBOTS, urls.SITEMAP, urls.WORKER, "llms.txt")


def offline_files(site: SiteContext) -> Iterator[OutputFile | FileList]:
    """Yield all of them."""
    course, assets, names = site.library.course, site.assets, site.names
    theme = course.theme
    icons = [_entry(names.icon, theme.icon or theme.touch_icon)]
    if theme.touch_icon is not None and theme.icon is not None:
        icons.append(_entry(names.touch_icon, theme.touch_icon))
    if not (theme.icon or theme.touch_icon):
        for name, side in (("192", 192), ("512", 512), ("maskable", 512)):
            data = assets.file(f"icons/icon-{name}.png")
            file = OutputFile(hashed_name(f"assets/icon-{name}.png", data), data)
            yield file
            icons.append(_png(file.path, f"{side}x{side}"))
        icons[-1]["purpose"] = "maskable"
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
        "icons": icons,
    }
    text = json.dumps({k: v for k, v in manifest.items() if v}, ensure_ascii=False, indent=1)
    yield OutputFile(urls.MANIFEST, f"{text}\n".encode("utf-8", "replace"))
    yield OutputFile(urls.WORKER, page_script(assets.file("js/service-worker.js")))
    # What every page needs, except fonts, and the pages for when nothing else is there
    shell = {urls.HOME, "offline/index.html", urls.MANIFEST}
    shell |= {path for path in names.paths() if path.endswith(_SHELL)}
    key = step_key("list of files", names)
    yield FileList(urls.FILES, key, functools.partial(listing, frozenset(shell)))


def _entry(path: str, file: ThemeFile | None) -> dict[str, str]:
    if file is None or file.ending == "svg":
        return {"src": path, "type": "image/svg+xml", "sizes": "any"}
    width, height = picture_size(file.data) or (0, 0)
    return _png(path, f"{width}x{height}")


def _png(path: str, size: str) -> dict[str, str]:
    return {"src": path, "type": "image/png", "sizes": size}


def short_name(title: str) -> str:
    """Return as many words of a title as fit below an icon, but at least the first."""
    line = " ".join(title.split())
    lines = textwrap.wrap(line, _MAX_NAME, break_long_words=False, break_on_hyphens=False)
    # Punctuation and dashes are removed at the cut.
    return "".join(lines[:1]).rstrip(" ,;:–—-") or title


def listing(shell: frozenset[str], files: Iterable[FileFacts]) -> bytes:
    """Return the list of files, as JSON with a line for each."""
    groups: dict[str, dict[str, str]] = {"shell": {}, "text": {}, "rest": {}}
    sizes = dict.fromkeys(groups, 0)
    for file in files:
        path = file.path
        if path in _FOR_MACHINES or path.endswith(_COPIES) or path == urls.NOT_FOUND:
            continue
        is_asset = path.startswith("assets/")
        if path in shell or path.startswith("assets/fonts/"):
            group = "shell"
        elif is_asset:
            is_lab_data = path.startswith("assets/labs/") and not path.endswith(_PICTURES)
            group = "rest" if is_lab_data else "text"
        else:
            is_text = path.endswith(_TEXT) or path == _SEARCH_INDEX
            group = "text" if is_text and file.size <= _LARGE else "rest"
        is_hashed = is_asset and path.rpartition(".")[0].rpartition(".")[2] == file.digest[:8]
        groups[group][path] = "" if is_hashed else file.digest[:_DIGITS]
        sizes[group] += file.size
    parts = [f'"format": {_FORMAT}']
    for name, digests in groups.items():
        # A line for each file, as `json` writes them with an indent of 0, but faster
        text = json.dumps(digests, ensure_ascii=False, separators=(",\n", ": "))
        text = f"{{\n{text[1:-1]}\n}}" if digests else "{}"
        parts.append(f'"{name}": {{\n"bytes": {sizes[name]},\n"files": {text}\n}}')
    return ("{\n" + ",\n".join(parts) + "\n}\n").encode("utf-8", "surrogatepass")


FEATURE = Feature(
    name="offline",
    pages=(PageKind(name="offline", values=lambda library: {}, order=70, indexed=False),),
    files=offline_files,
    parts=(PagePart(mark="data-keep", bundled="offline.js", texts=("offline.live.",)),),
)
