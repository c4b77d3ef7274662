"""The site as a package of ADL SCORM 1.2, for learning platforms.

A platform opens `sco/LESSON.html`, which shows the page of the lesson in a frame and speaks to the
platform for it (`site/js/scorm.js`). So one visit lasts while the learner follows links. The pages
are those of the site but for their manifest, without which a page asks for no service worker. Each
written lesson is a SCO; the files that belong to no single lesson are one asset on which the SCOs
depend (Content Aggregation Model, section 2.3).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from coursebuild.api import (
    ExportContext,
    Exporter,
    Feature,
    Lesson,
    OutputFile,
    SiteFile,
    regex,
    urls,
)
from coursebuild.core.pages.assets import page_script
from coursebuild.core.pages.frame import policy
from coursebuild.core.pages.html_xml import identifier, render_xml
from coursebuild.core.pages.renderer import direction

_COPIES = (".br", ".gz")
_MACHINES = (urls.ROBOTS, urls.SITEMAP, urls.NOT_FOUND, urls.WORKER, urls.FILES, urls.MANIFEST)
"""Files for servers and crawlers, and the service worker's, which could not cache a platform's
pages."""
_MANIFEST = regex(rb'<link rel="manifest" [^>]*>\n')


def package_files(context: ExportContext) -> Iterator[SiteFile]:
    """Yield the files of the site, a page that opens each lesson, and the manifest."""
    files: list[SiteFile] = [
        OutputFile(path, _MANIFEST.sub(b"", file.make(), 1)) if path.endswith(".html") else file
        for path, file in context.site().items()
        if path not in _MACHINES and not (path.startswith("assets/") and path.endswith(_COPIES))
    ]
    script = page_script(context.assets.file("js/scorm.js"))
    files.append(OutputFile("sco/scorm.css", context.assets.file("css/scorm.css")))
    files.append(OutputFile("sco/scorm.js", script))
    yield from files
    for lesson in context.course.written_lessons:
        language = context.course.language_of(lesson) or "en"
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
        yield OutputFile(_start_path(lesson), f"{html}\n".encode("utf-8", "replace"))
    course, shared = context.course, list[str]()
    lesson_files = {
        f"lessons/{x.id}-{x.slug}": (x, [_start_path(x)]) for x in course.written_lessons
    }
    for path in sorted(file.path for file in files):
        page = lesson_files.get(path.rpartition(".")[0])
        (shared if page is None else page[1]).append(path)
    manifest = render_xml(
        Path(__file__).with_name("manifest.jinja"),
        course=course,
        language=course.language or "en",
        levels=course.written_levels,
        lesson_files=lesson_files.values(),
        shared=shared,
        identifier=identifier,
        encode=urls.encode,
    )
    yield OutputFile("imsmanifest.xml", manifest)


def _start_path(lesson: Lesson) -> str:
    return f"sco/{lesson.id}-{lesson.slug}.html"


SCORM = Exporter(
    name="scorm",
    summary="the course as SCORM 1.2",
    file="course-scorm.zip",
    mark="imsmanifest.xml",
    make=package_files,
)
FEATURE = Feature(name="scorm", exporters=(SCORM,))
