"""The frame of pages: head, site navigation, foot; and what search engines read.

Whatever needs the site's full address is left out if the course does not give that. Pages are drawn
in two steps because a page's head refers to the style sheet by a hash of its content, and the style
sheet names the fonts, which depend on the characters of all pages.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Collection, Iterable
from html import escape
from typing import TypeAlias

from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core.features import PageKind
from coursebuild.core.model import Course, Lesson
from coursebuild.core.model.fields import Author
from coursebuild.core.model.lesson_record import shown_versions
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets, Names
from coursebuild.core.pages.context import PageHead
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import renderer_for
from coursebuild.core.pages.renderer import Strings, Texts, direction
from coursebuild.core.registry import (
    added_pages,
    has_copies,
    page_copies,
    page_kind,
    parts_by_mark,
)
from coursebuild.core.text.characters import visible

PAGE_WORDS = (
    "theme.label",
    "theme.auto",
    "theme.light",
    "theme.dark",
    "code.copy",
    "code.copied",
    "code.failed",
    "offline.changed",
    "offline.again",
    "code.mark",
    "search.open",
    "search.failed",
)

FRAME_IDS = frozenset(("_words",))

LOGO_HEIGHT = 28
"""Pixels, as in the style sheet."""


def policy(json_ld: str, *, form: bool = False, evaluates: bool = False) -> str:
    """The Content-Security-Policy of a page: nothing from other hosts, no inline code or style.

    Structured data is not code, but its hash is listed, because checkers take it for code.
    """
    digest = base64.b64encode(hashlib.sha256(json_ld.encode()).digest()).decode()
    data = f" 'sha256-{digest}'" if json_ld else ""
    evaluation = " 'unsafe-eval'" if evaluates else ""
    return "; ".join(
        (
            "default-src 'self'",
            f"script-src 'self' 'wasm-unsafe-eval'{evaluation}{data}",
            "style-src 'self'",
            "img-src 'self' data: blob:",
            "worker-src 'self' blob:",
            "object-src 'none'",
            "base-uri 'none'",
            "form-action 'self'" if form else "form-action 'none'",
        )
    )


class NavLink(Struct, frozen=True):
    """An entry of the site's navigation."""

    href: str
    text: str
    current: bool


def place_of(base_url: str, path: str) -> urls.Place:
    """The place of a page: the page for missing addresses is served at any depth."""
    return urls.Place(path, urls.base_path(base_url) if path == urls.NOT_FOUND else None)


def page_title(library: Library, kind: PageKind) -> str:
    """The title of a page that a feature adds."""
    key = f"{kind.name}.title"
    return library.words(key) if library.words.has(key) else kind.name.capitalize()


def parts_of(body: str, kind: str) -> tuple[str, ...]:
    """The marks, such as `data-quiz=`, of the parts on a page of this kind."""
    return tuple(
        mark
        for mark, part in parts_by_mark().items()
        if mark in body and (not part.kinds or kind in part.kinds)
    )


class FrameInputs(Struct, frozen=True):
    """All that the frame of pages shows besides the page; a hash of it is the key of the frame."""

    language: str
    title: str
    """Of the course."""
    course_key: str
    base_url: str
    licence: str
    source: str
    """The address of the course's repository; empty where a reader cannot use it."""
    menu: tuple[tuple[str, str], ...]
    """Site paths and titles of the pages in the menu of every page, besides the home page."""
    added_pages: tuple[tuple[str, str], ...]
    versions: tuple[str, ...]
    """What the scripts ran with."""
    templates: Texts
    version: str
    is_manual: bool
    names: Names
    authors: tuple[Author, ...] = ()
    doi: str = ""

    @classmethod
    def of(cls, library: Library, names: Names) -> FrameInputs:
        """What the frame shows of a course whose shared files have these names."""
        course = library.course
        return cls(
            language=course.language or "en",
            title=course.title,
            course_key=course.key,
            base_url=course.base_url,
            licence=course.licence,
            source=course.repository if "{path}" not in course.repository else "",
            menu=tuple((urls.page_path(page), page.title) for page in library.menu),
            added_pages=tuple((k.path, page_title(library, k)) for k in added_pages(library)),
            versions=shown_versions(run.provenance for run in library.results.runs),
            templates=course.theme.template_texts,
            version=course.version,
            is_manual=course.is_manual,
            names=names,
            authors=course.authors,
            doi=course.doi,
        )


class PageFrame(Struct, frozen=True):
    """The frame around every page of a site."""

    inputs: FrameInputs
    assets: Assets
    """Files of the tool alone."""
    _words: dict[tuple[str, tuple[str, ...]], tuple[str, ...]] = field(default_factory=dict)
    """The keys of the words of scripts, by language and parts: most pages have the same."""

    def render(self, head: PageHead, parts: tuple[str, ...], body: str) -> str:
        """The whole page around a body that has these parts; see `parts_of`."""
        inputs, names, kind = self.inputs, self.inputs.names, page_kind(head.kind)
        language = head.language or inputs.language
        renderer = renderer_for(self.assets, language, inputs.templates, is_manual=inputs.is_manual)
        place = place_of(inputs.base_url, head.path)
        looks = ("figure-light", "figure-dark") if names.logo and names.logo_dark else ("", "")
        logos = zip((names.logo, names.logo_dark), looks, strict=True)
        known_parts, part_names = parts_by_mark(), dict[str, str]()
        for mark, path in names.scripts:  # one that is loaded late has a name
            if mark in parts:
                part = known_parts[mark]
                part_names[place.href(path)] = part.bundled.removesuffix(".js") if part.late else ""
        page_words = self._words.get((language, parts))
        if page_words is None:
            page_words = script_words(renderer.words.texts, parts)
            self._words[language, parts] = page_words
        is_missing = head.path == urls.NOT_FOUND
        canonical = "" if is_missing else urls.absolute(inputs.base_url, head.path)
        html = renderer.render(
            "base.html",
            frame=inputs,
            body=Markup(body),
            policy=policy(
                head.json_ld,
                form=kind is not None and kind.form,
                evaluates=any(known_parts[mark].evaluates for mark in parts),
            ),
            head_title=head_title(inputs.title, head.title, head.kind),
            description=head.description,
            social=social(inputs.title, inputs.base_url, head),
            canonical=canonical,
            json_ld=head.json_ld,
            copies=tuple(
                (copy.type, place.href(urls.copy_path(head.path, copy.ending)))
                for copy in page_copies()
                if not copy.lessons and has_copies(head.path)
            ),
            kind=head.kind,
            language=language,
            direction=direction(language),
            citation=citation(
                inputs, renderer.words, canonical, head.title if head.kind == "lesson" else ""
            ),
            root=place.href(urls.HOME).removesuffix(urls.HOME),
            robots="" if head.indexed else "noindex",
            icon=place.href(names.icon),
            style=place.href(names.style),
            fonts=tuple(place.href(path) for mark, path in names.fonts if mark in body),
            theme_script=place.href(names.theme_script),
            script=place.href(names.script),
            part_scripts=tuple((name, href) for href, name in part_names.items()),
            manifest=place.href(urls.MANIFEST),
            touch_icon=place.href(names.touch_icon) if names.touch_icon else "",
            logos=tuple((place.href(path), look) for path, look in logos if path),
            logo_size=(names.logo_width, LOGO_HEIGHT) if names.logo_width else (),
            home=place.href(urls.HOME),
            credits=place.href(names.credits),
            menu=_links(place, inputs.menu),
            own=_links(place, inputs.added_pages),
            page_words=page_words,
        )
        return f"{visible(html)}\n"


def citation(
    course: Course | FrameInputs, words: Strings, address: str = "", part: str = ""
) -> str:
    """How a course, or the part of this title, is to be cited; empty without authors and DOI."""
    if not (course.authors or course.doi):
        return ""
    link = f"https://doi.org/{course.doi}" if course.doi else address
    names = words.join(author.name for author in course.authors)
    return ". ".join(filter(None, (names, part, course.title, course.version, link)))


def script_words(keys: Collection[str], parts: Iterable[str]) -> tuple[str, ...]:
    """Those of all interface texts that a page with these parts carries for its scripts."""
    known_parts = parts_by_mark()
    used_keys = [key for mark in parts for key in known_parts[mark].texts]
    prefixes = tuple(key for key in used_keys if key.endswith("."))
    prefixed = sorted(key for key in keys if prefixes and key.startswith(prefixes))
    return (*PAGE_WORDS, *prefixed, *(key for key in used_keys if key in keys))


def _links(place: urls.Place, pages: Iterable[tuple[str, str]]) -> tuple[NavLink, ...]:
    return tuple(NavLink(place.href(path), title, path == place.path) for path, title in pages)


Json: TypeAlias = "str | int | list[Json] | dict[str, Json]"


def head_title(course_title: str, title: str, kind: str) -> str:
    """The title for the browser's tab: the page, then the course."""
    return title if kind == "home" or title == course_title else f"{title} · {course_title}"


def social(course_title: str, base_url: str, head: PageHead) -> tuple[tuple[str, str], ...]:
    """Open Graph properties."""
    pairs = (
        ("og:type", "article" if head.kind == "lesson" else "website"),
        ("og:site_name", course_title),
        ("og:title", head.title),
        ("og:description", head.description),
        ("og:url", urls.absolute(base_url, head.path)),
    )
    return tuple((name, value) for name, value in pairs if value)


def course_data(library: Library) -> Markup:
    """Structured data of the home page: the course and its written lessons."""
    course = library.course
    parts: list[Json] = [
        _resource(library, lesson) for lesson in course.lessons if lesson.status != "planned"
    ]
    return _script("Course", {**_course(course), "hasPart": parts})


def lesson_data(library: Library, lesson: Lesson) -> Markup:
    """Structured data of a lesson."""
    whole: dict[str, Json] = {"@type": "Course", **_course(library.course)}
    return _script("LearningResource", {**_resource(library, lesson), "isPartOf": whole})


def _course(course: Course) -> dict[str, Json]:
    return _filled(
        {
            "name": course.title,
            "description": course.summary,
            "inLanguage": course.language,
            "url": urls.absolute(course.base_url, urls.HOME),
            "author": _people(course),
            "identifier": f"https://doi.org/{course.doi}" if course.doi else "",
        }
    )


def _resource(library: Library, lesson: Lesson) -> dict[str, Json]:
    needs: list[Json] = [library.lessons[need].title for need in lesson.prerequisites]
    return _filled(
        {
            "@type": "LearningResource",
            "name": lesson.title,
            "description": lesson.summary,
            "url": urls.absolute(library.course.base_url, urls.lesson_path(lesson)),
            "inLanguage": library.course.language_of(lesson),
            "learningResourceType": "lesson",
            "teaches": list(lesson.objectives),
            "competencyRequired": needs,
            "timeRequired": f"PT{lesson.minutes}M" if lesson.minutes else "",
            "license": library.course.licence,
            "author": _people(library.course),
        }
    )


def _people(course: Course) -> list[Json]:
    people = ({"name": author.name, "@id": author.address} for author in course.authors)
    return [{"@type": "Person", **_filled({**person})} for person in people]


def _filled(data: dict[str, Json]) -> dict[str, Json]:
    return {key: value for key, value in data.items() if value not in ("", [])}


def _script(kind: str, data: dict[str, Json]) -> Markup:
    """JSON for a `script` element, with nothing in it that could end the element."""
    data = {"@context": "https://schema.org", "@type": kind, **data}
    text = visible(json.dumps(data, ensure_ascii=False, separators=(",", ":")))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def sitemap(course: Course, paths: Iterable[str]) -> bytes:
    """The sitemap of the given pages; the course must have a base address."""
    addresses = (escape(urls.absolute(course.base_url, path), quote=False) for path in paths)
    rows = "".join(f"<url><loc>{address}</loc></url>\n" for address in addresses)
    head = '<?xml version="1.0" encoding="UTF-8"?>\n'
    space = "http://www.sitemaps.org/schemas/sitemap/0.9"
    return f'{head}<urlset xmlns="{space}">\n{rows}</urlset>\n'.encode()


def versions(course: Course) -> bytes:
    """The list of versions of a course with one: this one, whose site is where the list is."""
    return f"{json.dumps([{'version': course.version, 'root': './'}])}\n".encode()


def robots(course: Course) -> bytes:
    """A robots.txt that allows everything and names the sitemap."""
    lines = ["User-agent: *", "Allow: /"]
    if course.base_url:
        lines.append(f"Sitemap: {urls.absolute(course.base_url, urls.SITEMAP)}")
    return ("\n".join(lines) + "\n").encode()
