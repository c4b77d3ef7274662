"""The site as a package of ADL SCORM 1.2.

Entry points: `is_packed(path)`, whether a file of the site belongs into it; `launch_page` and
`shared_files`, what it has besides; `manifest`.

A platform opens `sco/LESSON.html`, which shows the page of the lesson in a frame and speaks to the
platform for it (`site/js/scorm.js`). So one visit lasts while the learner follows links from page
to page, and the pages are those of the site, byte for byte. Each written lesson is a SCO; all files
that are not one lesson's own are one asset that the SCOs depend on (SCORM 1.2 Content Aggregation
Model, section 2.3). A planned lesson has nothing to open, and is none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.core.model import Course, Lesson
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets, page_script
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.frame import policy
from coursebuild.core.pages.packages.xml import (
    XSI,
    Element,
    add,
    element,
    identifier,
    long_document,
)
from coursebuild.core.pages.tools import Tools

MANIFEST = "imsmanifest.xml"
FOLDER = "sco"
_CP = "http://www.imsproject.org/xsd/imscp_rootv1p1p2"
_ADL = "http://www.adlnet.org/xsd/adlcp_rootv1p2"
_MD = "http://www.imsglobal.org/xsd/imsmd_rootv1p2p1"
_SCHEMAS = f"{_CP} imscp_rootv1p1p2.xsd {_MD} imsmd_rootv1p2p1.xsd {_ADL} adlcp_rootv1p2.xsd"
_TITLE = 200
"""Characters of a title: what the schema of IMS CP 1.1.2 allows."""
_LANGSTRING = 100
_SHARED = "shared"
_COPIES = (".br", ".gz")
_MACHINES = (urls.ROBOTS, urls.SITEMAP, urls.NOT_FOUND, urls.WORKER, urls.FILES)
"""Files for servers and crawlers, and what keeps a site without a network: a platform's pages are
not this site's to keep."""


def is_packed(path: str) -> bool:
    """Whether a file of the site belongs into the package."""
    return path not in _MACHINES and not (path.startswith("assets/") and path.endswith(_COPIES))


def launch_path(lesson: Lesson) -> str:
    """The page that a platform opens: `sco/4.2-mass-and-inertia.html`."""
    return f"{FOLDER}/{lesson.id}-{lesson.slug}.html"


def written(course: Course) -> tuple[Lesson, ...]:
    """The lessons that can be opened."""
    return tuple(lesson for lesson in course.lessons if lesson.document is not None)


def shared_files(assets: Assets) -> Iterator[OutputFile]:
    """What the pages share that a platform opens."""
    yield OutputFile(f"{FOLDER}/scorm.css", assets.file("css/scorm.css"))
    yield OutputFile(f"{FOLDER}/scorm.js", page_script(assets.file("js/scorm.js")))


def launch_page(course: Course, lesson: Lesson, tools: Tools) -> bytes:
    """The page that a platform opens for a lesson."""
    language = course.language or "en"
    html = tools.render(
        "scorm.html",
        language=language,
        direction=direction(language),
        course_key=course.key,
        policy=policy(""),
        title=lesson_title(lesson),
        lesson=lesson.id,
        address=urls.Place(launch_path(lesson)).href(urls.lesson_path(lesson)),
    )
    return f"{html}\n".encode("utf-8", "replace")


def lesson_title(lesson: Lesson) -> str:
    """`4.2 Mass and inertia`."""
    return f"{lesson.id} {lesson.title}"


def manifest(course: Course, paths: Iterable[str]) -> OutputFile:
    """The package's manifest, for the files of the site that are packed."""
    lessons = written(course)
    own: dict[str, list[str]] = {f"lessons/{x.id}-{x.slug}": [] for x in lessons}
    shared: list[str] = []
    for path in paths:
        stem = path.rpartition(".")[0]
        own.get(stem, shared).append(path)
    resources = element("resources")

    def listed() -> Iterator[Element]:
        yield _resource(_SHARED, "asset", "", shared)
        for lesson in lessons:
            path = launch_path(lesson)
            files = [path, *own[f"lessons/{lesson.id}-{lesson.slug}"]]
            sco = _resource(identifier("sco.", lesson.id), "sco", path, files)
            add(sco, element("dependency", {"identifierref": _SHARED}))
            yield sco

    root = element(
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
    return OutputFile(MANIFEST, long_document(root, resources, listed()))


def _organization(course: Course) -> Element:
    """The levels with their written lessons; a level without any is left out."""
    made = element("organization", {"identifier": "organization"}, _title(course.title))
    for level in course.levels:
        lessons = [lesson for lesson in level.lessons if lesson.document is not None]
        if not lessons:
            continue
        item = element("item", {"identifier": identifier("level.", level.id)})
        add(item, _title(f"{level.id} {level.title}"), *map(_item, lessons))
        add(made, item)
    return made


def _item(lesson: Lesson) -> Element:
    given = {
        "identifier": identifier("lesson.", lesson.id),
        "identifierref": identifier("sco.", lesson.id),
        "isvisible": "true",
    }
    return element("item", given, _title(lesson_title(lesson)))


def _title(text: str) -> Element:
    return element("title", {}, _cut(text, _TITLE))


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _resource(name: str, kind: str, start: str, paths: Iterable[str]) -> Element:
    made = element("resource", {"identifier": name, "type": "webcontent", "adlcp:scormtype": kind})
    if start:
        made.set("href", urls.encode(start))
    add(made, *(element("file", {"href": urls.encode(path)}) for path in paths))
    return made


def _metadata(course: Course) -> Element:
    """What it is, and in which language (IMS Learning Resource Meta-data 1.2.1)."""
    language = course.language or "en"

    def said(name: str, text: str, most: int) -> Element | None:
        if not text.strip():
            return None
        words = element("langstring", {"xml:lang": language}, _cut(" ".join(text.split()), most))
        return element(name, {}, words)

    general = element(
        "general",
        {},
        said("title", course.title, _LANGSTRING),
        element("language", {}, language),
        said("description", course.summary, 2000),
    )
    return element(
        "metadata",
        {},
        element("schema", {}, "ADL SCORM"),
        element("schemaversion", {}, "1.2"),
        element("lom", {"xmlns": _MD}, general),
    )
