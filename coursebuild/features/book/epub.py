"""The whole course as an e-book (W3C, EPUB 3.3; EPUB Accessibility 1.1).

Each lesson is a chapter of XHTML, as on its page, with open folds and recorded pictures of labs.
Links between lessons lead to chapters; others lead to the site, and are plain text where the course
has no address. EPUB requires a date of last change: here a constant, for the same bytes.
"""

from __future__ import annotations

import hashlib
import posixpath
import re
import textwrap
import unicodedata
import uuid
from collections.abc import Iterator

from markupsafe import Markup
from msgspec import Struct

from coursebuild.api import CachedFile, ExportContext, Lesson, OutputFile, SiteFile, regex, urls
from coursebuild.core.model import Level
from coursebuild.core.pages.frame import citation
from coursebuild.core.pages.html_xml import to_xml
from coursebuild.core.pages.renderer import direction
from coursebuild.core.pages.theme import COURSE, accents
from coursebuild.core.text.characters import visible
from coursebuild.features.book import chapters

_MODIFICATION_TIME = "2000-01-01T00:00:00Z"
_CONTAINER = """\
<?xml version="1.0" encoding="utf-8"?>
<container xmlns="urn:oasis:names:tc:opendocument:xmlns:container" version="1.0">
<rootfiles>
<rootfile full-path="EPUB/package.opf" media-type="application/oebps-package+xml"/>
</rootfiles>
</container>
"""
_FOLDER = "EPUB/"
_XHTML = "application/xhtml+xml"
_FEATURES = ("structuralNavigation", "tableOfContents", "displayTransformability")
_STYLE_RULE = regex(r"\.s[0-9a-f]{7}\{[^{}]*\}")
"""A rule of the site's style sheet that replaces a style attribute, see `styles`."""
_FONT_FACE = regex(rf'@font-face{{font-family:"(?:{"|".join(COURSE.values())})"[^}}]*}}')
"""The rule for one of the course's own fonts in the site's style sheet."""
_FONT = regex(r'url\("(fonts/[^"]+)"\)')
_FONT_RULES = {
    "text": "body{{font-family:{},serif}}",
    "interface": ".bar,.label,.receipt,figcaption{{font-family:{},sans-serif}}",
    "code": "pre,code,samp{{font-family:{},monospace}}",
}
"""The rule that applies one of the course's own fonts, by its use."""
_COVER_SIZES, _COVER_LINES, _COVER_WIDTH = (120, 100, 84, 68, 54), 6, 1020
"""Font sizes, maximum of lines, and width in pixels: the title has the largest size that fits."""


class EpubItem(Struct, frozen=True):
    """A file of the package."""

    file: SiteFile
    type: str
    properties: str = ""
    linear: bool = False
    """Whether it is a page of the reading order."""

    @property
    def href(self) -> str:
        """Its path in the package."""
        return self.file.path.removeprefix(_FOLDER)

    @property
    def id(self) -> str:
        """Its id in the list of the package's files."""
        return f"i-{xml_id(self.href)}"


def epub_files(context: ExportContext) -> Iterator[SiteFile]:
    """Yield the files of the archive."""
    return _Epub(context).files()


class _Epub:
    def __init__(self, context: ExportContext) -> None:
        self._context = context
        self._course = context.course
        self._library = context.library
        self._language = context.course.language or "en"
        self._chapters = {
            urls.lesson_path(lesson): _lesson_name(lesson)
            for lesson in context.course.written_lessons
        }
        self._pictures: dict[str, str] = {}
        """Names of pictures in the package, by their site path."""

    def files(self) -> Iterator[SiteFile]:
        items = list(self._items())
        yield OutputFile("mimetype", b"application/epub+zip")
        yield OutputFile("META-INF/container.xml", _CONTAINER.encode())
        yield from (item.file for item in items)
        yield OutputFile(f"{_FOLDER}package.opf", self._package(items))

    def _items(self) -> Iterator[EpubItem]:
        yield _page_item("title.xhtml", self._title())
        yield _page_item("nav.xhtml", self._nav(), "nav")
        cover = OutputFile(f"{_FOLDER}cover.svg", self._cover())
        yield EpubItem(cover, chapters.PICTURES["svg"], "cover-image")
        style, site = self._style(), self._context.site()
        yield EpubItem(OutputFile(f"{_FOLDER}style.css", style.encode()), "text/css")
        folder = posixpath.dirname(chapters.style_path(self._context))
        for name in _FONT.findall(style):
            font = CachedFile(f"{_FOLDER}{name}", "", site[f"{folder}/{name}"].make)
            yield EpubItem(font, f"font/{chapters.extension(name)}")
        for number, family in enumerate(self._course.theme.fonts, 1):
            licence = OutputFile(f"{_FOLDER}fonts/licence-{number}.txt", family.licence.data)
            yield EpubItem(licence, "text/plain")
        for level in self._course.written_levels:
            body = self._library.render("book/epub-level.html", level=level)
            page = self._page(f"{level.id} {level.title}", body, "bodymatter")
            yield _page_item(_level_name(level), page)
            for lesson in level.lessons:
                place = urls.Place(urls.lesson_path(lesson))
                rules = chapters.RewriteRules(place, self._address, self._picture, xml_id)
                text = chapters.render_lesson(self._context, lesson, rules, to_xml, "_top")
                title, language = f"{lesson.id} {lesson.title}", self._course.language_of(lesson)
                chapter = self._page(title, text, "bodymatter", language)
                properties = [key for key in ("mathml", "svg") if f"<{key[:4]}".encode() in chapter]
                yield _page_item(_lesson_name(lesson), chapter, " ".join(properties))
        for path, name in self._pictures.items():
            picture = CachedFile(f"{_FOLDER}{name}", "", site[path].make)
            yield EpubItem(picture, chapters.PICTURES[chapters.extension(path)])

    def _style(self) -> str:
        theme = self._course.theme
        site = self._context.site()[chapters.style_path(self._context)].make().decode()
        style = self._context.assets.template("book/epub.css")
        for scheme, accent in zip(("light", "dark"), accents(theme), strict=True):
            if theme.accent or theme.accent_dark:
                rule = f"a{{color:{accent}}}.objectives,.callout{{border-color:{accent}}}"
                style += f"@media (prefers-color-scheme:{scheme}){{{rule}}}\n"
        uses = (_FONT_RULES[font.use].format(f'"{COURSE[font.use]}"') for font in theme.fonts)
        return "\n".join((style, *_FONT_FACE.findall(site), *uses, *_STYLE_RULE.findall(site), ""))

    # --- pages

    def _page(self, title: str, body: Markup, kind: str, language: str = "") -> bytes:
        return self._render("epub-page", language, title=title, body=body, kind=kind)

    def _render(self, template: str, language: str = "", **values: object) -> bytes:
        language = language or self._language
        text = self._library.render(
            f"book/{template}.html", language=language, direction=direction(language), **values
        )
        return visible(text).encode()

    def _cover(self) -> bytes:
        title = " ".join(self._course.title.split())
        widths = [
            1.0 if unicodedata.east_asian_width(c) in "WF" else 0.7 if c.isupper() else 0.52
            for c in title
        ]
        mean_width = sum(widths) / max(len(widths), 1) or 1.0  # in ems; an estimate without a font
        for size in _COVER_SIZES:
            lines = textwrap.wrap(title, int(_COVER_WIDTH / size / mean_width)) or [""]
            if len(lines) <= _COVER_LINES:
                break
        accent, _ = accents(self._course.theme)
        lines = lines[: 2 * _COVER_LINES]
        return self._render("cover.svg", title=title, lines=lines, size=size, accent=accent)

    def _title(self) -> bytes:
        body = self._library.render(
            "book/epub-title.html",
            title=self._course.title,
            summary=self._course.summary,
            facts=chapters.summary_line(self._context),
            licence=self._course.licence,
            authors=self._course.authors,
            citation=citation(self._course, self._library.words, self._course.base_url),
            address=self._course.base_url,
        )
        return self._page(self._course.title, body, "frontmatter")

    def _nav(self) -> bytes:
        body = self._library.render(
            "book/epub-nav.html",
            title=self._course.title,
            levels=self._course.written_levels,
            level_name=_level_name,
            lesson_name=_lesson_name,
        )
        return self._page(self._library.words("exports.contents"), body, "frontmatter")

    def _package(self, items: list[EpubItem]) -> bytes:
        course = self._course
        features = list(_FEATURES)
        features += ["MathML"] if any("mathml" in item.properties for item in items) else []
        features += ["alternativeText"] if self._pictures else []
        return self._render(
            "package.opf",
            uuid=uuid.uuid5(uuid.NAMESPACE_URL, course.base_url or f"course:{course.key}"),
            title=course.title,
            summary=course.summary,
            licence=course.licence,
            authors=course.authors,
            doi=course.doi,
            languages=dict.fromkeys(
                (self._language, *filter(None, map(course.language_of, course.written_lessons)))
            ),
            address=course.base_url,
            modified=_MODIFICATION_TIME,
            visual=bool(self._pictures),
            features=features,
            items=items,
        )

    # --- links

    def _address(self, path: str, anchor: str) -> str:
        """Return the address for a link of a chapter; empty if it has no target here."""
        name = self._chapters.get(path)
        if name is None:
            return chapters.site_address(self._context, path, anchor)
        return f"{name}#{urls.quote_anchor(xml_id(anchor))}" if anchor else name

    def _picture(self, path: str) -> str:
        """Add a picture to the package and return its address; empty if that is impossible."""
        if chapters.extension(path) not in chapters.PICTURES or path not in self._context.site():
            return ""
        digest = hashlib.sha256(path.encode()).hexdigest()[:12]
        return self._pictures.setdefault(path, f"images/{digest}.{chapters.extension(path)}")


def _page_item(name: str, page: bytes, properties: str = "") -> EpubItem:
    return EpubItem(OutputFile(f"{_FOLDER}{name}", page), _XHTML, properties, linear=True)


def xml_id(id: str) -> str:
    """Turn an id into a name of XML: other characters are written as their numbers."""
    name = re.sub(r"[^A-Za-z0-9_.-]", lambda match: f"_{ord(match[0]):x}_", id)
    return f"_{name}" if not name or name[0] in "0123456789.-" else name


def _lesson_name(lesson: Lesson) -> str:
    return _file_name(f"{lesson.id}-{lesson.slug}")


def _level_name(level: Level) -> str:
    return _file_name(f"level-{level.id}")


def _file_name(name: str) -> str:
    """Return a file name in ASCII, which every reading system accepts."""
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
        return f"{name}.xhtml"
    return f"x{hashlib.sha256(name.encode()).hexdigest()[:16]}.xhtml"
