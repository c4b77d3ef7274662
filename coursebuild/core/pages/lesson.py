"""The page of a lesson: its place in the course, prerequisites, text, and neighbours.

Entry points: `lesson_inputs`, and for a planned lesson `stub_inputs`.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.model import Document, Lesson, Level, document_scripts
from coursebuild.core.pages import meta, urls
from coursebuild.core.pages.document_inputs import document_inputs
from coursebuild.core.pages.graph import neighbourhood
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.owner_links import owner_links
from coursebuild.core.pages.page_inputs import PageHead, PageInputs
from coursebuild.core.registry import page_copies


class LessonLink(Struct, frozen=True):
    """A lesson as pages show it, its own page included."""

    id: str
    title: str
    href: str
    status: str
    minutes: int | None
    further: int | None
    summary: str
    needs: tuple[LessonLink, ...] = ()
    objectives: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    """Other names, which no page shows."""
    quiz_index: str = ""
    """Its questions; see `Library.quiz_index`."""


class LevelView(Struct, frozen=True):
    """A level and its lessons."""

    id: str
    title: str
    summary: str
    href: str
    lessons: tuple[LessonLink, ...]
    written_count: int


def lesson_link(
    library: Library, place: urls.Place, lesson: Lesson, *, whole: bool = False
) -> LessonLink:
    """A lesson as a link from a place; with `whole`, with all its details."""
    needs = lesson.prerequisites if whole else ()
    return LessonLink(
        lesson.id,
        lesson.title,
        place.href(urls.lesson_path(lesson)),
        lesson.status,
        lesson.minutes,
        lesson.further,
        lesson.summary,
        tuple(lesson_link(library, place, library.lessons[need]) for need in needs),
        lesson.objectives if whole else (),
        lesson.aliases if whole else (),
        library.quiz_index.get(lesson.path, "") if whole else "",
    )


def level_view(
    library: Library, place: urls.Place, level: Level, *, whole: bool = False
) -> LevelView:
    """A level with its lessons, linked from a place; `whole` as in `lesson_link`."""
    return LevelView(
        level.id,
        level.title,
        level.summary,
        place.href(urls.level_path(level)),
        tuple(lesson_link(library, place, lesson, whole=whole) for lesson in level.lessons),
        sum(lesson.status != "planned" for lesson in level.lessons),
    )


def lesson_inputs(library: Library, lesson: Lesson, document: Document) -> PageInputs:
    """The inputs of the page of a written lesson; its document's summary is enough."""
    place = urls.Place(urls.lesson_path(lesson))
    scripts = tuple((script.path, place.href(script.path)) for script in document_scripts(document))
    values = {
        **_common(library, place, lesson),
        "scripts": scripts,
        "scripts_zip": place.href(urls.lesson_zip_path(lesson)) if scripts else None,
        "copies": tuple(
            (copy.text, place.href(urls.copy_path(place.path, copy.ending)), copy.download)
            for copy in page_copies()
        ),
        "edit": edit_address(library, lesson.path),
    }
    data = meta.lesson_data(library, lesson)
    return PageInputs(
        PageHead(place.path, "lesson", lesson.title, lesson.summary, data),
        "lesson.html",
        values,
        document_inputs=document_inputs(library, place, document),
    )


def stub_inputs(library: Library, lesson: Lesson) -> PageInputs:
    """The inputs of the page of a planned lesson, with the lessons to read meanwhile."""
    place = urls.Place(urls.lesson_path(lesson))
    readable = tuple(
        lesson_link(library, place, need)
        for need in _ancestors(library, lesson)
        if need.document is not None
    )
    values = {**_common(library, place, lesson), "readable": readable}
    head = PageHead(place.path, "stub", lesson.title, lesson.summary, indexed=False)
    return PageInputs(head, "stub.html", values)


def _common(library: Library, place: urls.Place, lesson: Lesson) -> dict[str, object]:
    """The values that the pages of written and planned lessons share."""
    order, position = library.order, library.positions[lesson.id]
    return {
        "lesson": lesson_link(library, place, lesson, whole=True),
        "level": level_view(library, place, library.levels[lesson.level]),
        "home": place.href(urls.HOME),
        "leads": tuple(
            lesson_link(library, place, follower) for follower in library.leads[lesson.id]
        ),
        "graph": neighbourhood(library, place, lesson),
        "referrers": owner_links(place, library.referrers.get(lesson.id, ())),
        "previous": lesson_link(library, place, order[position - 1]) if position else None,
        "following": lesson_link(library, place, order[position + 1])
        if position + 1 < len(order)
        else None,
    }


def _ancestors(library: Library, lesson: Lesson) -> tuple[Lesson, ...]:
    """All lessons that a lesson builds on, in the order of the course."""
    ids: set[str] = set()
    stack = list(lesson.prerequisites)
    while stack:
        need = stack.pop()
        if need not in ids:
            ids.add(need)
            stack += library.lessons[need].prerequisites
    return tuple(ancestor for ancestor in library.order if ancestor.id in ids)


def edit_address(library: Library, path: str) -> str | None:
    """The address where a file of the course can be edited.

    `{path}` in the repository's address stands for the file; without it, the address is that of a
    repository on a host with the usual paths.
    """
    repository = library.course.repository
    if not repository:
        return None
    if "{path}" in repository:
        return repository.replace("{path}", urls.encode(path))
    middle = "/-/edit/main/" if "gitlab" in repository else "/edit/main/"
    return repository.rstrip("/") + middle + urls.encode(path)
