"""The whole course as an e-book: EPUB 3.

Entry point: `Epub`, whose `files` are those of the archive, in order.

1. Each lesson is a chapter of XHTML, drawn as on its page: formulas are MathML, folds are open,
   labs are their recorded pictures. Links between lessons lead to chapters; others lead to the site
   where the course has an address, and are plain text where it has none.
2. EPUB wants a date of last change. The same course gives the same bytes, so it is always the same,
   and says nothing.

Sources: W3C, EPUB 3.3; EPUB Accessibility 1.1.
"""

from __future__ import annotations

import functools
import hashlib
import re
import uuid
from collections.abc import Callable, Iterable, Iterator

from markupsafe import Markup
from msgspec import Struct

from coursebuild.model import Lesson
from coursebuild.render import urls
from coursebuild.render.characters import visible
from coursebuild.render.direction import direction
from coursebuild.render.exports.addresses import filled, quoted, xml_id
from coursebuild.render.exports.archive import File
from coursebuild.render.exports.cover import cover
from coursebuild.render.exports.outline import Entry, LevelEntry, Part, facts, written
from coursebuild.render.exports.parts import OpenChapter
from coursebuild.render.library import Library
from coursebuild.render.styles import style_rules

MIMETYPE = b"application/epub+zip"
MODIFIED = "2000-01-01T00:00:00Z"
"""See the module."""
_CONTAINER = b"""\
<?xml version="1.0" encoding="utf-8"?>
<container xmlns="urn:oasis:names:tc:opendocument:xmlns:container" version="1.0">
<rootfiles>
<rootfile full-path="EPUB/package.opf" media-type="application/oebps-package+xml"/>
</rootfiles>
</container>
"""
_TYPES = {
    "gif": "image/gif",
    "jpeg": "image/jpeg",
    "jpg": "image/jpeg",
    "png": "image/png",
    "svg": "image/svg+xml",
    "webp": "image/webp",
}
_XHTML = "application/xhtml+xml"
_FEATURES = ("structuralNavigation", "tableOfContents", "displayTransformability")


class Chapter(Struct, frozen=True):
    """What the package must know of a lesson's chapter."""

    pictures: tuple[str, ...]
    mathml: bool
    svg: bool


class Item(Struct, frozen=True):
    """A file of the package."""

    id: str
    href: str
    type: str
    properties: str = ""
    linear: bool | None = None
    """Whether it is read in order; `None`: it is no page."""


class Epub:
    """The e-book of a course."""

    def __init__(
        self,
        library: Library,
        style: str,
        declarations: Iterable[str],
    ) -> None:
        """`style` is the style sheet, `declarations` are those written in elements of lessons."""
        self._library = library
        self._levels = written(library)
        self._css = style + style_rules(declarations)
        self._names = {
            urls.lesson_path(lesson): chapter_name(lesson)
            for part in self._levels
            for lesson in part.lessons
        }
        self._pictures: dict[str, str] = {}
        """Names of pictures in the package, by their site path."""

    @property
    def lessons(self) -> Iterator[Lesson]:
        """The lessons that are chapters, in order."""
        return (lesson for part in self._levels for lesson in part.lessons)

    @property
    def places(self) -> str:
        """All that the links of a chapter depend on."""
        return f"{self._library.course.base_url}\0{sorted(self._names.items())!r}"

    def files(
        self,
        facts: Callable[[Lesson], Chapter],
        picture: Callable[[str], bytes],
    ) -> Iterator[File]:
        """The files in order; `picture` gives the bytes at a site path.

        Those of chapters are made by whoever calls, see `chapter`.
        """
        yield File("mimetype", lambda: MIMETYPE)
        yield File("META-INF/container.xml", lambda: _CONTAINER)
        items = self._items(facts)
        opf = self._opf(items)
        yield File("EPUB/package.opf", lambda: opf)
        nav = self._nav()
        yield File("EPUB/nav.xhtml", lambda: nav)
        yield File("EPUB/style.css", self._css.encode)
        yield File("EPUB/cover.svg", self._cover)
        yield File("EPUB/title.xhtml", self._title)
        for part in self._levels:
            yield File(f"EPUB/{_level_name(part)}", functools.partial(self._level, part))
            for lesson in part.lessons:
                yield File(self.file_of(lesson), bytes)
        for path, name in self._pictures.items():
            yield File(f"EPUB/{name}", functools.partial(picture, path))

    def file_of(self, lesson: Lesson) -> str:
        """The path of a lesson's chapter in the archive."""
        return f"EPUB/{self._names[urls.lesson_path(lesson)]}"

    # --- pages

    def chapter(self, lesson: Lesson, part: OpenChapter) -> bytes:
        """A chapter with its links put in."""
        text = filled(part.text, self._address)
        return self._page(f"{lesson.id} {lesson.title}", text, "bodymatter")

    def _page(self, title: str, body: Markup | str, kind: str = "") -> bytes:
        language = self._library.course.language or "en"
        text = self._library.render(
            "exports/epub-page.html",
            language=language,
            direction=direction(language),
            title=title,
            body=Markup(body),
            kind=kind,
        )
        return visible(text).encode()

    def _level(self, part: Part) -> bytes:
        body = self._library.render("exports/epub-level.html", level=part)
        return self._page(f"{part.id} {part.title}", body, "bodymatter")

    def _title(self) -> bytes:
        course = self._library.course
        body = self._library.render(
            "exports/epub-title.html",
            title=course.title,
            summary=course.summary,
            facts=facts(self._library, len(self._names)),
            licence=course.licence,
            address=course.base_url,
        )
        return self._page(course.title, body, "frontmatter")

    def _nav(self) -> bytes:
        levels = tuple(map(self._entry, self._levels))
        body = self._library.render(
            "exports/epub-nav.html",
            title=self._library.course.title,
            levels=levels,
            first=next((lesson for level in levels for lesson in level.lessons), None),
        )
        return self._page(self._library.words("exports.contents"), body, "frontmatter")

    def _entry(self, part: Part) -> LevelEntry:
        lessons = tuple(
            Entry(lesson.id, lesson.title, self._names[urls.lesson_path(lesson)])
            for lesson in part.lessons
        )
        return LevelEntry(part.id, part.title, part.summary, "", _level_name(part), lessons)

    def _cover(self) -> bytes:
        course = self._library.course
        picture = cover(course.title, direction(course.language or "en"))
        return visible(picture).encode()

    # --- the package

    def _items(self, facts: Callable[[Lesson], Chapter]) -> list[Item]:
        items = [
            Item("nav", "nav.xhtml", _XHTML, "nav", linear=True),
            Item("style", "style.css", "text/css"),
            Item("cover", "cover.svg", _TYPES["svg"], "cover-image"),
            Item("title", "title.xhtml", _XHTML, linear=True),
        ]
        items[0], items[3] = items[3], items[0]  # the title is read first
        for part in self._levels:
            name = _level_name(part)
            items.append(Item(f"x-{xml_id(name)}", name, _XHTML, linear=True))
            for lesson in part.lessons:
                items.append(self._lesson_item(lesson, facts(lesson)))
        for path, name in self._pictures.items():
            kind = _TYPES[path.lower().rpartition(".")[2]]
            items.append(Item(f"i-{xml_id(name)}", name, kind))
        return items

    def _lesson_item(self, lesson: Lesson, chapter: Chapter) -> Item:
        name = self._names[urls.lesson_path(lesson)]
        for path in chapter.pictures:
            self._pictures.setdefault(path, _picture_name(path))
        properties = [key for key in ("mathml", "svg") if getattr(chapter, key)]
        return Item(f"x-{xml_id(name)}", name, _XHTML, " ".join(properties), linear=True)

    def _opf(self, items: list[Item]) -> bytes:
        course = self._library.course
        mathml = any("mathml" in item.properties for item in items)
        features = (*_FEATURES, "MathML") if mathml else _FEATURES
        language = course.language or "en"
        text = self._library.render(
            "exports/package.opf.html",
            language=language,
            direction=direction(language),
            uuid=uuid.uuid5(uuid.NAMESPACE_URL, course.base_url or f"course:{course.key}"),
            title=course.title,
            summary=course.summary,
            licence=course.licence,
            address=course.base_url,
            modified=MODIFIED,
            visual=bool(self._pictures),
            features=(*features, "alternativeText") if self._pictures else features,
            items=items,
        )
        return visible(text).encode()

    # --- links

    def _address(self, path: str, id: str, shown: bool) -> str:
        """Where a link of a chapter leads, or where a picture is; empty for nowhere."""
        if shown:
            return _picture_name(path)
        name = self._names.get(path)
        if name is not None:
            return f"{name}#{quoted(xml_id(id))}" if id else name
        course = self._library.course
        address = urls.absolute(course, path)
        return f"{address}#{quoted(id)}" if address and id else address


def chapter_name(lesson: Lesson) -> str:
    """The name of a lesson's chapter in the package."""
    return _name(f"{lesson.id}-{lesson.slug}", ".xhtml")


def _level_name(part: Part) -> str:
    return _name(f"level-{part.id}", ".xhtml")


def _picture_name(path: str) -> str:
    digest = hashlib.sha256(path.encode()).hexdigest()[:12]
    return f"images/{digest}.{path.lower().rpartition('.')[2]}"


def _name(name: str, ending: str) -> str:
    """A file name of ASCII, which every reading system takes."""
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
        return name + ending
    return f"x{hashlib.sha256(name.encode()).hexdigest()[:16]}{ending}"
