"""The pages around the lessons: home, levels, models, other pages, and that of missing addresses.

Entry points: `home_draft`, `level_draft`, `model_draft`, `page_draft`, `not_found_draft`.
"""

from __future__ import annotations

from dataclasses import dataclass

from coursebuild.model import (
    Document,
    Lesson,
    Level,
    MjcfModel,
    Page,
    Paragraph,
    Status,
    plain_text,
)
from coursebuild.render import meta, urls
from coursebuild.render.context import PageContext
from coursebuild.render.frame import Draft, place_of
from coursebuild.render.highlight import highlight
from coursebuild.render.labs import number
from coursebuild.render.lesson import LessonLink, article, contents, edit_address, lesson_link
from coursebuild.render.library import Library, ModelUse
from coursebuild.results import ModelFacts


@dataclass(frozen=True, slots=True)
class LevelView:
    """A level and its lessons."""

    id: str
    title: str
    summary: str
    href: str
    lessons: tuple[LessonLink, ...]
    written: int


@dataclass(frozen=True, slots=True)
class Named:
    """A link with its text, and a remark on it."""

    href: str
    text: str
    remark: str = ""


def home_draft(library: Library) -> Draft:
    """The home page: the course map."""
    course = library.course
    place = urls.Place(urls.HOME)
    written = [lesson for lesson in course.lessons if lesson.document is not None]
    body = library.render(
        "home.html",
        course=course,
        levels=tuple(_level_view(library, place, level) for level in course.levels),
        start=lesson_link(library, place, written[0]) if written else None,
        total=len(course.lessons),
        written=len(written),
        models=tuple(
            Named(place.href(urls.model_page_path(m.name)), m.name) for m in course.models
        ),
        scripts=len(library.scripts),
        scripts_zip=place.href(urls.EXAMPLES_ZIP) if library.scripts else None,
    )
    return Draft(
        urls.HOME, "home", course.title, course.summary, body, json_ld=meta.course_data(library)
    )


def level_draft(library: Library, level: Level) -> Draft:
    """The page of a level."""
    place = urls.Place(urls.level_path(level))
    levels = library.course.levels
    at = levels.index(level)
    view = _level_view(library, place, level)
    body = library.render(
        "level.html",
        home=place.href(urls.HOME),
        level=view,
        entries=tuple(zip(level.lessons, view.lessons, strict=True)),
        previous=_level_link(library, place, levels[at - 1]) if at else None,
        following=_level_link(library, place, levels[at + 1]) if at + 1 < len(levels) else None,
    )
    return Draft(
        place.path,
        "level",
        f"{library.words('level.label', id=level.id)}: {level.title}",
        level.summary,
        body,
    )


def _level_link(library: Library, place: urls.Place, level: Level) -> Named:
    label = library.words("level.label", id=level.id)
    return Named(place.href(urls.level_path(level)), level.title, label)


def _level_view(library: Library, place: urls.Place, level: Level) -> LevelView:
    return LevelView(
        level.id,
        level.title,
        level.summary,
        place.href(urls.level_path(level)),
        tuple(lesson_link(library, place, lesson, needs=True) for lesson in level.lessons),
        sum(lesson.status is not Status.PLANNED for lesson in level.lessons),
    )


def model_draft(library: Library, model: MjcfModel) -> Draft:
    """The page of a model: what it holds, its text, where it is used."""
    words = library.words
    place = urls.Place(urls.model_page_path(model.name))
    compiled = library.models.get(model.name)
    title = words("model.title", name=model.name)
    body = library.render(
        "model.html",
        home=place.href(urls.HOME),
        name=model.name,
        path=model.source.path,
        title=title,
        href=place.href(urls.model_file_path(model.name)),
        facts=_facts(library, compiled.facts) if compiled is not None and compiled.facts else (),
        code=highlight("xml", model.source.text.rstrip()),
        uses=tuple(_use_link(library, place, use) for use in library.uses[model.name]),
    )
    return Draft(place.path, "model", title, "", body)


def _facts(library: Library, facts: ModelFacts) -> tuple[tuple[str, str], ...]:
    """What a compiled model holds, as pairs of words."""
    words = library.words
    unnamed = words("model.unnamed")
    rows = (
        (words("model.bodies"), str(facts.bodies)),
        (words("model.geoms"), str(facts.geoms)),
        (words("model.joints"), str(facts.joints)),
        (words("model.coordinates"), str(facts.nq)),
        (words("model.freedom"), str(facts.nv)),
        (words("model.actuators"), str(facts.nu)),
        (words("model.mass"), f"{number(facts.total_mass)} kg"),
        (words("model.timestep"), f"{number(facts.timestep)} s"),
        (words("model.integrator"), facts.integrator),
        (words("model.keyframes"), ", ".join(name or unnamed for name in facts.keyframes)),
        (words("model.sites"), ", ".join(name or unnamed for name in facts.sites)),
        (words("model.includes"), ", ".join(facts.includes)),
    )
    return tuple((label, value) for label, value in rows if value)


def _use_link(library: Library, place: urls.Place, use: ModelUse) -> Named:
    words = library.words
    ways = (
        ("model.by_lab", use.by_lab),
        ("model.by_script", use.by_script),
        ("model.by_link", use.by_link),
    )
    remark = ", ".join(words(key) for key, is_so in ways if is_so)
    if isinstance(use.owner, Lesson):
        text = f"{words('lesson.label', id=use.owner.id)}: {use.owner.title}"
        return Named(place.href(urls.lesson_path(use.owner)), text, remark)
    return Named(place.href(urls.page_path(use.owner)), use.owner.title, remark)


def page_draft(library: Library, page: Page, document: Document) -> Draft:
    """A page that is no lesson."""
    place = urls.Place(urls.page_path(page))
    context = PageContext.of(library, place, document)
    body = context.template(
        "page.html",
        title=page.title,
        contents=contents(context, document),
        article=article(context, document),
        edit=edit_address(library, page.path),
    )
    return Draft(place.path, "page", page.title, _first_sentences(document), body)


def _first_sentences(document: Document) -> str:
    """The first paragraph, cut at a word: what search engines show."""
    first = next((b for b in document.blocks if isinstance(b, Paragraph)), None)
    text = " ".join(plain_text(first.children).split()) if first is not None else ""
    return text if len(text) <= 200 else text[:200].rsplit(" ", 1)[0] + " …"


def not_found_draft(library: Library) -> Draft:
    """The page for missing addresses."""
    place = place_of(library, urls.NOT_FOUND)
    body = library.render("notfound.html", home=place.href(urls.HOME))
    return Draft(
        urls.NOT_FOUND, "notfound", library.words("notfound.title"), "", body, indexed=False
    )
