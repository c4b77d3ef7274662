"""The whole course as an e-book: EPUB 3.

Entry point: `epub_files(course, style)`, the files of the archive.

1. Each lesson is a chapter of XHTML, drawn as on its page: formulas are MathML, folds are open,
   labs are their recorded pictures. Links between lessons lead to chapters; others lead to the site
   where the course has an address, and are plain text where it has none.
2. EPUB wants a date of last change. The same course gives the same bytes, so it is always the same,
   and says nothing.

Sources: W3C, EPUB 3.3; EPUB Accessibility 1.1.
"""

from __future__ import annotations

import hashlib
import re
import unicodedata
import uuid
from collections.abc import Iterator
from html import escape

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import Lesson, Level
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.exports.rewrite import Rules
from coursebuild.core.pages.exports.whole_course import WholeCourse
from coursebuild.core.pages.html_tree import to_xml
from coursebuild.core.text.patterns import pattern

PACKAGE = "EPUB/package.opf"
_MODIFIED = "2000-01-01T00:00:00Z"
"""See the module."""
_CONTAINER = f"""\
<?xml version="1.0" encoding="utf-8"?>
<container xmlns="urn:oasis:names:tc:opendocument:xmlns:container" version="1.0">
<rootfiles>
<rootfile full-path="{PACKAGE}" media-type="application/oebps-package+xml"/>
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
"""Of the pictures that every reading system shows."""
_XHTML = "application/xhtml+xml"
_FEATURES = ("structuralNavigation", "tableOfContents", "displayTransformability")
_STYLE_RULE = pattern(r"\.s[0-9a-f]{7}\{[^{}]*\}")
"""A rule of the site's style sheet that stands for a style in an element, see `styles`."""


class EpubItem(Struct, frozen=True):
    """A file of the package."""

    id: str
    href: str
    type: str
    properties: str = ""
    linear: bool = False
    """Whether it is a page, which is read in its place."""


def epub_files(course: WholeCourse, style: str, sheet: str) -> tuple[SiteFile, ...]:
    """The files; `style` is the e-book's style sheet, `sheet` the site path of the site's."""
    rules = _STYLE_RULE.findall(course.files[sheet]().decode())
    return tuple(_Epub(course).files("\n".join((style, *rules, ""))))


class _Epub:
    def __init__(self, course: WholeCourse) -> None:
        self._course = course
        self._library = course.library
        self._names = {urls.lesson_path(lesson): _lesson_name(lesson) for lesson in course.lessons}
        self._pictures: dict[str, str] = {}
        """Names of pictures in the package, by their site path."""

    def files(self, style: str) -> Iterator[SiteFile]:
        yield OutputFile("mimetype", b"application/epub+zip")
        yield OutputFile("META-INF/container.xml", _CONTAINER.encode())
        items = [
            EpubItem("title", "title.xhtml", _XHTML, linear=True),
            EpubItem("nav", "nav.xhtml", _XHTML, "nav", linear=True),
            EpubItem("style", "style.css", "text/css"),
            EpubItem("cover", "cover.svg", _TYPES["svg"], "cover-image"),
        ]
        yield OutputFile("EPUB/style.css", style.encode())
        yield OutputFile("EPUB/cover.svg", self._cover())
        yield OutputFile("EPUB/title.xhtml", self._title())
        yield OutputFile("EPUB/nav.xhtml", self._nav())
        for level, lessons in self._course.levels:
            name = _level_name(level)
            items.append(EpubItem(f"x-{xml_id(name)}", name, _XHTML, linear=True))
            yield OutputFile(f"EPUB/{name}", self._level(level))
            for lesson in lessons:
                chapter = self._chapter(lesson)
                items.append(_chapter_item(_lesson_name(lesson), chapter))
                yield OutputFile(f"EPUB/{_lesson_name(lesson)}", chapter)
        for path, name in self._pictures.items():
            items.append(EpubItem(f"i-{xml_id(name)}", name, _TYPES[_ending(path)]))
            yield CachedFile(f"EPUB/{name}", "", self._course.files[path])
        yield OutputFile(PACKAGE, self._package(items))

    # --- pages

    def _chapter(self, lesson: Lesson) -> bytes:
        path = urls.lesson_path(lesson)
        rules = Rules(path, self._address, self._picture, xml_id)
        text = self._course.lesson(lesson, rules, to_xml, "_top")
        return self._page(f"{lesson.id} {lesson.title}", text, "bodymatter")

    def _page(self, title: str, body: Markup, kind: str = "") -> bytes:
        language = self._library.course.language or "en"
        text = self._library.render(
            "exports/epub-page.html",
            language=language,
            direction=direction(language),
            title=title,
            body=body,
            kind=kind,
        )
        return visible(text).encode()

    def _level(self, level: Level) -> bytes:
        body = self._library.render("exports/epub-level.html", level=level)
        return self._page(f"{level.id} {level.title}", body, "bodymatter")

    def _title(self) -> bytes:
        course = self._library.course
        body = self._library.render(
            "exports/epub-title.html",
            title=course.title,
            summary=course.summary,
            facts=self._course.facts(),
            licence=course.licence,
            address=course.base_url,
        )
        return self._page(course.title, body, "frontmatter")

    def _nav(self) -> bytes:
        levels = self._course.contents(_level_name, _lesson_name)
        body = self._library.render(
            "exports/epub-nav.html",
            title=self._library.course.title,
            levels=levels,
            first=next((lesson for level in levels for lesson in level.lessons), None),
        )
        return self._page(self._library.words("exports.contents"), body, "frontmatter")

    def _cover(self) -> bytes:
        course = self._library.course
        return visible(cover(course.title, direction(course.language or "en"))).encode()

    def _package(self, items: list[EpubItem]) -> bytes:
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
            modified=_MODIFIED,
            visual=bool(self._pictures),
            features=(*features, "alternativeText") if self._pictures else features,
            items=items,
        )
        return visible(text).encode()

    # --- links

    def _address(self, path: str, anchor: str) -> str:
        """Where a link of a chapter leads; empty for nowhere."""
        name = self._names.get(path)
        if name is None:
            return self._course.site_address(path, anchor)
        return f"{name}#{urls.quoted(xml_id(anchor))}" if anchor else name

    def _picture(self, path: str) -> str:
        """Where a picture is, which is now part of the package; empty where it cannot be."""
        if _ending(path) not in _TYPES or path not in self._course.files:
            return ""
        digest = hashlib.sha256(path.encode()).hexdigest()[:12]
        name = f"images/{digest}.{_ending(path)}"
        return self._pictures.setdefault(path, name)


def _chapter_item(name: str, chapter: bytes) -> EpubItem:
    properties = [key for key in ("mathml", "svg") if f"<{key[:4]}".encode() in chapter]
    return EpubItem(f"x-{xml_id(name)}", name, _XHTML, " ".join(properties), linear=True)


def xml_id(id: str) -> str:
    """An id as a name of XML: characters that no name has are written as their numbers."""
    name = re.sub(r"[^A-Za-z0-9_.-]", lambda match: f"_{ord(match[0]):x}_", id)
    return f"_{name}" if not name or name[0] in "0123456789.-" else name


def _ending(path: str) -> str:
    return path.lower().rpartition(".")[2]


def _lesson_name(lesson: Lesson) -> str:
    return _file_name(f"{lesson.id}-{lesson.slug}")


def _level_name(level: Level) -> str:
    return _file_name(f"level-{level.id}")


def _file_name(name: str) -> str:
    """A file name of ASCII, which every reading system takes."""
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
        return f"{name}.xhtml"
    return f"x{hashlib.sha256(name.encode()).hexdigest()[:16]}.xhtml"


_WIDTH, _HEIGHT = 1200, 1600
_EDGE = 120
_SIZES = (120, 100, 84, 68, 54)
"""Of type; the largest is taken in which the title has few lines."""
_LINES = 6


def cover(title: str, direction: str) -> str:
    """The picture."""
    title = " ".join(title.split())
    for size in _SIZES:
        lines = _broken(title, (_WIDTH - 2 * _EDGE) / size)
        if len(lines) <= _LINES:
            break
    lines = lines[: 2 * _LINES]
    right = direction == "rtl"
    x = _WIDTH - _EDGE if right else _EDGE
    texts = "".join(
        f'<text x="{x}" y="{430 + round(1.2 * size * at)}">{escape(line)}</text>\n'
        for at, line in enumerate(lines)
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" width="{_WIDTH}"'
        f' height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}">\n'
        f"<title>{escape(title)}</title>\n"
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="#fcfbf8"/>\n'
        f'<rect x="{_EDGE}" y="250" width="{_WIDTH - 2 * _EDGE}" height="6" fill="#17487a"/>\n'
        f'<g font-family="Georgia, serif" font-size="{size}" fill="#1e1e1c"'
        f' direction="{direction}">\n'
        f"{texts}</g>\n"
        "</svg>\n"
    )


def _broken(text: str, width: float) -> list[str]:
    """Lines of at most about `width` ems; a word that is wider is cut."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if _ems(longer) <= width:
            lines[-1] = longer
            continue
        if lines[-1]:
            lines.append("")
        for character in word:
            if _ems(lines[-1] + character) > width:
                lines.append("")
            lines[-1] += character
    return lines


def _ems(text: str) -> float:
    return sum(
        0.0
        if unicodedata.combining(c)
        else 1.0
        if unicodedata.east_asian_width(c) in "WF"
        else 0.7
        if c.isupper()
        else 0.52
        for c in text
    )
