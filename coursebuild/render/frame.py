"""A page without its frame, and the frame: head, site navigation, foot.

Entry points: `Draft`, what the modules of the single kinds of page make; `frame(library, draft,
names)`, the finished text; `frame_around`, what stands before and after the body.

Pages are drawn in two steps because a page's head names the style sheet by its content, and the
style sheet holds the fonts' names, which depend on every character of every page.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping

from markupsafe import Markup

from coursebuild.render import meta, urls
from coursebuild.render.characters import visible
from coursebuild.render.draft import Draft as Draft
from coursebuild.render.library import Library
from coursebuild.values import dataclass

PAGE_WORDS = (
    "theme.label",
    "theme.auto",
    "theme.light",
    "theme.dark",
    "code.copy",
    "code.copied",
    "code.failed",
)
"""Interface texts that the page's script shows."""

_LAB_WORDS = ("lab.live.", "overlay.")
"""Beginnings of the keys of what running labs say."""

LIVE_LAB = "data-script="
"""What a page with a lab that runs has in it."""


@dataclass(frozen=True, slots=True)
class Names:
    """Site paths of the files that every page refers to."""

    style: str
    theme_script: str
    script: str
    icon: str
    credits: str


def policy(json_ld: str) -> str:
    """The Content-Security-Policy of a page: nothing from elsewhere, no code or style in the page.

    Structured data is no code, but is named by its hash, since checkers take it for some.
    """
    digest = base64.b64encode(hashlib.sha256(json_ld.encode()).digest()).decode()
    data = f" 'sha256-{digest}'" if json_ld else ""
    return "; ".join(
        (
            "default-src 'self'",
            f"script-src 'self' 'wasm-unsafe-eval'{data}",
            "style-src 'self'",
            "img-src 'self' data: blob:",
            "worker-src 'self' blob:",
            "object-src 'none'",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


@dataclass(frozen=True, slots=True)
class NavLink:
    """An entry of the site's navigation."""

    href: str
    text: str
    current: bool


def place_of(library: Library, path: str) -> urls.Place:
    """The place of a page: the page for missing addresses is served at any depth."""
    return urls.Place(path, urls.base_path(library.course) if path == urls.NOT_FOUND else None)


def frame(library: Library, draft: Draft, names: Names) -> str:
    """The finished text of a page."""
    before, after = frame_around(library, draft, names, live=LIVE_LAB in draft.body)
    return before + visible(draft.body) + after


_HERE = Markup("<!--here-->")


def frame_around(library: Library, draft: Draft, names: Names, *, live: bool) -> tuple[str, str]:
    """What stands before and after the body of a page; `live`: whether labs run on it."""
    course = library.course
    place = place_of(library, draft.path)
    values: Mapping[str, object] = {
        "kind": draft.kind,
        "body": _HERE,
        "language": course.language or "en",
        "policy": policy(draft.json_ld),
        "head_title": meta.head_title(course, draft.title, draft.kind),
        "description": draft.description,
        "robots": "" if draft.indexed else "noindex",
        "social": meta.social(library, draft.path, draft.title, draft.description, draft.og_type),
        "canonical": urls.absolute(course, draft.path) if draft.path != urls.NOT_FOUND else "",
        "json_ld": draft.json_ld,
        "icon": place.href(names.icon),
        "style": place.href(names.style),
        "theme_script": place.href(names.theme_script),
        "script": place.href(names.script),
        "home": place.href(urls.HOME),
        "credits": place.href(names.credits),
        "menu": _navigation(library, place, menu=True),
        "more": _navigation(library, place, menu=False),
        "course": course,
        "source": course.repository if "{path}" not in course.repository else "",
        "results": library.results,
        "page_words": _page_words(library, live=live),
    }
    # Nothing else has angle brackets there: texts are escaped, and so is the structured data.
    before, _, after = visible(library.render("base.html", **values)).partition(_HERE)
    return before, f"{after}\n"


def _page_words(library: Library, *, live: bool) -> tuple[str, ...]:
    """Keys of the texts that the page carries for its scripts."""
    if not live:
        return PAGE_WORDS
    labs = sorted(key for key in library.words.keys if key.startswith(_LAB_WORDS))
    return (*PAGE_WORDS, *labs, "lab.plot", "lab.value", "lab.time", "lab.overlays", "lab.untitled")


def _navigation(library: Library, place: urls.Place, *, menu: bool) -> tuple[NavLink, ...]:
    """Links to the pages that are in the menu, or to the others."""
    pages = (page for page in library.course.pages if page.menu is menu)
    paths = ((urls.page_path(page), page.title) for page in pages)
    return tuple(NavLink(place.href(path), title, path == place.path) for path, title in paths)
