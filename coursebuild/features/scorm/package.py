"""The site as a package of ADL SCORM 1.2.

Entry point: `package_files(context)`.

A platform opens `sco/LESSON.html`, which shows the page of the lesson in a frame and speaks to the
platform for it (`site/js/scorm.js`). So one visit lasts while the learner follows links from page
to page, and the pages are those of the site, byte for byte. Each written lesson is a SCO; all files
that are not one lesson's own are one asset that the SCOs depend on (SCORM 1.2 Content Aggregation
Model, section 2.3). A planned lesson has nothing to open, and is none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.core.model import Course, Lesson
from coursebuild.core.model.results import OutputFile, SiteFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.assets import page_script
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.frame import policy
from coursebuild.core.pages.xml import XSI, Element, add, document, element, identifier

_CP = "http://www.imsproject.org/xsd/imscp_rootv1p1p2"
_ADL = "http://www.adlnet.org/xsd/adlcp_rootv1p2"
_MD = "http://www.imsglobal.org/xsd/imsmd_rootv1p2p1"
_SCHEMAS = f"{_CP} imscp_rootv1p1p2.xsd {_MD} imsmd_rootv1p2p1.xsd {_ADL} adlcp_rootv1p2.xsd"
_TITLE, _LANGSTRING, _DESCRIPTION = 200, 100, 2000
"""Characters that the schemas of IMS CP 1.1.2 and IMS MD 1.2.1 allow."""
_SHARED = "shared"
_COPIES = (".br", ".gz")
_MACHINES = (urls.ROBOTS, urls.SITEMAP, urls.NOT_FOUND, urls.WORKER, urls.FILES)
"""Files for servers and crawlers, and what keeps a site without a network: a platform's pages are
not this site's to keep."""


def package_files(context: ExportContext) -> Iterator[SiteFile]:
    """The files of the site, a page that opens each lesson, and the manifest."""
    files: list[SiteFile] = [file for path, file in context.site().items() if _is_packed(path)]
    script = page_script(context.assets.file("js/scorm.js"))
    files.append(OutputFile("sco/scorm.css", context.assets.file("css/scorm.css")))
    files.append(OutputFile("sco/scorm.js", script))
    yield from files
    for lesson in _written(context.course.lessons):
        yield OutputFile(_start_path(lesson), _start_page(context, lesson))
    root = _manifest(context.course, sorted(file.path for file in files))
    yield OutputFile("imsmanifest.xml", document(root, pretty=True))


def _is_packed(path: str) -> bool:
    return path not in _MACHINES and not (path.startswith("assets/") and path.endswith(_COPIES))


def _written(lessons: Iterable[Lesson]) -> list[Lesson]:
    return [lesson for lesson in lessons if lesson.document is not None]


def _start_path(lesson: Lesson) -> str:
    return f"sco/{lesson.id}-{lesson.slug}.html"


def _start_page(context: ExportContext, lesson: Lesson) -> bytes:
    language = context.course.language or "en"
    html = context.library.render(
        "scorm/start.html",
        language=language,
        direction=direction(language),
        course_key=context.course.key,
        policy=policy(""),
        title=f"{lesson.id} {lesson.title}",
        lesson=lesson.id,
        address=urls.Place(_start_path(lesson)).href(urls.lesson_path(lesson)),
    )
    return f"{html}\n".encode("utf-8", "replace")


# --------------------------------------------------------------------------------- the manifest


def _manifest(course: Course, paths: Iterable[str]) -> Element:
    lessons = _written(course.lessons)
    own: dict[str, list[str]] = {f"lessons/{x.id}-{x.slug}": [] for x in lessons}
    shared: list[str] = []
    for path in paths:
        own.get(path.rpartition(".")[0], shared).append(path)
    resources = element("resources", {}, _resource(_SHARED, "asset", shared))
    for lesson in lessons:
        start = _start_path(lesson)
        files = [start, *own[f"lessons/{lesson.id}-{lesson.slug}"]]
        sco = _resource(identifier("sco.", lesson.id), "sco", files, start)
        add(sco, element("dependency", {"identifierref": _SHARED}))
        add(resources, sco)
    return element(
        "manifest",
        {
            "xmlns": _CP,
            "xmlns:adlcp": _ADL,
            "xmlns:xsi": XSI,
            "xsi:schemaLocation": _SCHEMAS,
            "identifier": identifier("course.", course.key),
            "version": "1.1",
        },
        _metadata(course),
        element("organizations", {"default": "organization"}, _organization(course)),
        resources,
    )


def _organization(course: Course) -> Element:
    """The levels with their written lessons; a level without any is left out."""
    made = element("organization", {"identifier": "organization"}, _title(course.title))
    for level in course.levels:
        lessons = _written(level.lessons)
        if lessons:
            title = _title(f"{level.id} {level.title}")
            level_id = {"identifier": identifier("level.", level.id)}
            add(made, element("item", level_id, title, *map(_item, lessons)))
    return made


def _item(lesson: Lesson) -> Element:
    given = {
        "identifier": identifier("lesson.", lesson.id),
        "identifierref": identifier("sco.", lesson.id),
        "isvisible": "true",
    }
    return element("item", given, _title(f"{lesson.id} {lesson.title}"))


def _title(text: str) -> Element:
    return element("title", {}, _cut(text, _TITLE))


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _resource(name: str, kind: str, paths: Iterable[str], start: str = "") -> Element:
    given = {"identifier": name, "type": "webcontent", "adlcp:scormtype": kind}
    if start:
        given["href"] = urls.encode(start)
    return element(
        "resource", given, *(element("file", {"href": urls.encode(path)}) for path in paths)
    )


def _metadata(course: Course) -> Element:
    """What it is, and in which language (IMS Learning Resource Meta-data 1.2.1)."""
    language = course.language or "en"

    def localized(name: str, text: str, most: int) -> Element | None:
        text = " ".join(text.split())
        if not text:
            return None
        return element(name, {}, element("langstring", {"xml:lang": language}, _cut(text, most)))

    general = element(
        "general",
        {},
        localized("title", course.title, _LANGSTRING),
        element("language", {}, language),
        localized("description", course.summary, _DESCRIPTION),
    )
    return element(
        "metadata",
        {},
        element("schema", {}, "ADL SCORM"),
        element("schemaversion", {}, "1.2"),
        element("lom", {"xmlns": _MD}, general),
    )
