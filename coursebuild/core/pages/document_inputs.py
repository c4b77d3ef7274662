"""What the page of a document looks up in the course and in its results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model import Document, Lesson, Level, Owner, document_scripts
from coursebuild.core.model.lesson_record import shown_versions
from coursebuild.core.model.results import Outcome
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import (
    DocumentInputs,
    PageHead,
    PageInputs,
    ShownDownload,
    ShownRun,
    ShownVerdict,
)
from coursebuild.core.pages.frame import lesson_data
from coursebuild.core.pages.graph import neighbourhood
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.numbering import name_elsewhere, number_prefix
from coursebuild.core.registry import citations, code_links, kind_of_block, page_copies, page_kind
from coursebuild.core.text.characters import visible


def document_inputs(
    library: Library, place: urls.Place, document: model.Document, number_prefix: str = ""
) -> DocumentInputs:
    """Everything that a document's page shows besides its text; a summary of it is enough."""
    path = document.source.path
    blocks = tuple(model.document_blocks(document))
    feature_blocks = [block for block in blocks if isinstance(block, model.FeatureBlock)]
    recordings = [block for block in blocks if isinstance(block, model.Recording)]
    models = dict.fromkeys(name for block in feature_blocks for name in block.models())
    link_targets = (link.target for link in model.find_inlines(document, model.Link))
    targets = dict.fromkeys((*link_targets, *map(model.ModelTarget, models)))
    bindings = model.find_inlines(document, model.NumberBinding)
    # The paths of the scripts in the document or named there, with the lines it quotes of each
    lines_by_script: dict[str, set[int]] = {b.script: set() for b in bindings if b.script}
    for block in blocks:
        if isinstance(block, model.Script):
            lines_by_script.setdefault(block.path, set())
        elif isinstance(block, model.Recording) and block.script is not None:
            lines_by_script.setdefault(block.script, set())
        elif isinstance(block, model.FeatureBlock):
            for script, line in block.quoted_lines():
                lines_by_script.setdefault(script, set()).add(line)
    runs: dict[str, ShownRun] = {}
    for script, numbers in lines_by_script.items():
        if (run := library.runs.get(script)) is not None:
            lines = run.stdout.split("\n")
            quotes = tuple(
                (n, visible(lines[n - 1].rstrip()) if 1 <= n <= len(lines) else None)
                for n in (sorted(numbers) if run.outcome is Outcome.OK else ())
            )
            versions = shown_versions([run.provenance])
            runs[script] = ShownRun(
                run.outcome, run.missing, quotes, run.recorded, run.unrepeated, versions
            )
    paths = (script.path for script in document_scripts(document))
    downloads = {path: library.downloads[path] for path in paths if path in library.downloads}
    names = {target: name_elsewhere(library, path, target) for target in targets}
    verdicts = ((block.span.start, library.verdict(block)) for block in recordings)
    trials = ((block.span.start, library.trial_value(block)) for block in feature_blocks)
    values = ((block, kind_of_block(block).values) for block in feature_blocks)
    pictures = library.course.pictures
    files = [model.local_file(i.url, path) for i in model.find_inlines(document, model.Image)]
    return DocumentInputs(
        engine=library.results.engine,
        hrefs={target: address(library, place, path, target) for target in targets},
        names={target: name for target, name in names.items() if name},
        number_prefix=number_prefix,
        callouts={b.kind: library.callout(b.kind) for b in blocks if isinstance(b, model.Callout)},
        runs=runs,
        downloads={
            path: ShownDownload(
                place.href(download.path),
                download.path.rpartition("/")[2],
                download.entry,
                download.packages,
                download.unknown_modules,
                download.state == "ran",
            )
            for path, download in downloads.items()
            if download.state != "failed"
        },
        verdicts={at: ShownVerdict(v.status, v.comparison, v.rows) for at, v in verdicts if v},
        trials={start: value for start, value in trials if value is not None},
        blocks={b.span.start: make(library, place, b) for b, make in values if make is not None},
        citations=citations(library, place, document),
        code_links=code_links(library, place, document),
        pictures={file: pictures[file] for file in files if file in pictures},
        absent_files=frozenset(files) - {*library.course.files},
        keyframes={n: library.facts[n].keyframes for n in models if n in library.facts},
        address=urls.absolute(library.course.base_url, place.path),
    )


def address(library: Library, place: urls.Place, path: str, target: model.Target) -> str:
    """The address of a link's target, relative to a place; empty where the course has no such.

    `path` is that of the document.
    """
    target = model.resolve(target, library.course, path)
    match target:
        case model.LessonTarget():
            lesson = library.lessons.get(target.id)
            return place.href(urls.lesson_path(lesson), target.anchor) if lesson else ""
        case model.LevelTarget():
            level = library.levels.get(target.id)
            return place.href(urls.level_path(level)) if level else ""
        case model.ModelTarget():
            return place.href(urls.model_page_path(target.name), target.anchor)
        case model.PageTarget():
            page = library.pages.get(target.id)
            return place.href(urls.page_path(page), target.anchor) if page else ""
        case model.ExampleTarget():
            return place.href(target.path)
        case model.TermTarget():
            owner = library.terms.get(target.id)
            return place.href(urls.owner_path(owner), f"term:{target.id}") if owner else ""
        case model.UrlTarget():
            return urls.file_address(place, path, target.url)


MAX_LINKS = 12
"""The most links that a list shows; it says how many more there are."""


class OwnerLink(Struct, frozen=True):
    """A lesson or page as a link."""

    href: str
    id: str
    """The id of a lesson; empty for a page."""
    title: str


class OwnerLinks(Struct, frozen=True):
    """A list of links, with the number of those left out."""

    visible: tuple[OwnerLink, ...]
    omitted: int


def owner_link(place: urls.Place, owner: Owner, anchor: str = "") -> OwnerLink:
    """The link to a lesson or page, or to an anchor there."""
    id = owner.id if isinstance(owner, Lesson) else ""
    return OwnerLink(place.href(urls.owner_path(owner), anchor or None), id, owner.title)


def owner_links(place: urls.Place, owners: Sequence[Owner], anchor: str = "") -> OwnerLinks:
    """The links to lessons and pages, or to an anchor that each of them has."""
    visible = tuple(owner_link(place, owner, anchor) for owner in owners[:MAX_LINKS])
    return OwnerLinks(visible, max(0, len(owners) - MAX_LINKS))


def added_page(library: Library, place: urls.Place, name: str) -> str:
    """The address of the page of this name that a feature adds; empty if there is none."""
    kind = page_kind(name)
    return place.href(kind.path) if kind is not None and kind.exists(library) else ""


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
    inputs = document_inputs(library, place, document, number_prefix(lesson.id))
    scripts = tuple((path, download.href) for path, download in inputs.downloads.items())
    values = {
        **_common(library, place, lesson),
        "scripts": scripts,
        "scripts_zip": place.href(urls.lesson_zip_path(lesson)) if scripts else None,
        "copies": tuple(
            (copy.text, place.href(urls.copy_path(place.path, copy.ending)), copy.download)
            for copy in page_copies()
        ),
        "services": tuple(
            service
            for copy in page_copies()
            for service in copy.services(library.course, urls.copy_path(place.path, copy.ending))
        ),
        "edit": edit_address(library, lesson.path),
    }
    data = lesson_data(library, lesson)
    return PageInputs(
        PageHead(
            place.path,
            "lesson",
            lesson.title,
            lesson.summary,
            data,
            language=lesson.language or "",
        ),
        "lesson.html",
        values,
        document_inputs=inputs,
    )


def stub_inputs(library: Library, lesson: Lesson) -> PageInputs:
    """The inputs of the page of a planned lesson, with the lessons to read meanwhile."""
    place = urls.Place(urls.lesson_path(lesson))
    ids: set[str] = set()  # of all lessons that it builds on
    stack = list(lesson.prerequisites)
    while stack:
        need = stack.pop()
        if need not in ids:
            ids.add(need)
            stack += library.lessons[need].prerequisites
    readable = tuple(
        lesson_link(library, place, need)
        for need in library.order
        if need.id in ids and need.document is not None
    )
    values = {**_common(library, place, lesson), "readable": readable}
    head = PageHead(place.path, "stub", lesson.title, lesson.summary, indexed=False)
    return PageInputs(head, "stub.html", values)


def _common(library: Library, place: urls.Place, lesson: Lesson) -> dict[str, object]:
    """The values that the pages of written and planned lessons share."""
    return {
        "lesson": lesson_link(library, place, lesson, whole=True),
        "level": level_view(library, place, library.levels[lesson.level]),
        # Lessons of other levels stay out: a new lesson would change every page of the course.
        "levels": tuple(
            (level.id, level.title, place.href(urls.level_path(level)))
            for level in library.course.levels
        ),
        "home": place.href(urls.HOME),
        "leads": tuple(
            lesson_link(library, place, follower) for follower in library.leads[lesson.id]
        ),
        "graph": neighbourhood(library, place, lesson),
        "referrers": owner_links(place, library.referrers.get(lesson.id, ())),
        "steps": tuple(_steps(library, place, lesson)),
    }


def _steps(
    library: Library, place: urls.Place, lesson: Lesson
) -> Iterator[tuple[str, str, LessonLink]]:
    """The title of each path, its relation, and the next lesson there that can be read.

    The first path is the map, without a title; of others, steps are left out that are the map's.
    """
    map_steps: dict[str, Lesson] = {}
    paths = [("", library.order, library.positions[lesson.id])]
    for path in library.course.paths:
        if lesson.id in path.lessons:
            lessons = tuple(library.lessons[id] for id in path.lessons)
            paths.append((path.title, lessons, path.lessons.index(lesson.id)))
    for title, lessons, position in paths:
        for way, side in ("prev", lessons[:position][::-1]), ("next", lessons[position + 1 :]):
            step = next((x for x in side if x.document is not None), None)
            if step is not None and step is not map_steps.get(way):
                map_steps |= {} if title else {way: step}
                yield title, way, lesson_link(library, place, step)


def edit_address(library: Library, path: str) -> str | None:
    """The address where a file can be edited; `{path}` in the repository's stands for it."""
    repository = library.course.repository
    if not repository:
        return None
    if "{path}" in repository:
        return repository.replace("{path}", urls.encode(path))
    middle = "/-/edit/main/" if "gitlab" in repository else "/edit/main/"
    return repository.rstrip("/") + middle + urls.encode(path)
