"""The list of all pages of a site, in order, and the inputs of those that are no lesson.

An entry works with any library of the same course: edits change documents, but the pages stay the
same as long as the course map does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.core.features import ModelPart
from coursebuild.core.model import (
    Document,
    FeatureBlock,
    Lesson,
    Level,
    MjcfModel,
    Owner,
    Page,
    document_blocks,
    find_blocks,
    listing_anchor,
)
from coursebuild.core.model.fields import CoursePath
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import AddedParts, HighlightedFile, PageHead, PageInputs
from coursebuild.core.pages.document_inputs import (
    LessonLink,
    document_inputs,
    edit_address,
    lesson_inputs,
    lesson_link,
    level_view,
    stub_inputs,
)
from coursebuild.core.pages.frame import course_data, page_title, place_of
from coursebuild.core.pages.graph import level_graph
from coursebuild.core.pages.library import Library
from coursebuild.core.registry import added_pages, kind_of_block, model_parts, page_kind


class PageEntry(Struct, frozen=True):
    """A page of a site."""

    path: str
    kind: str
    """One of `CORE_PAGES`, or the name of a `PageKind`."""
    id: str = ""
    """The id of its level, lesson, model, page or part; empty if it is the only one or the first of
    its kind."""

    def inputs(self, library: Library) -> PageInputs:
        """The inputs of the page; summaries of documents are enough."""
        kind = page_kind(self.kind)
        if kind is None:
            match self.kind:
                case "home":
                    return home_inputs(library, self.document(library))
                case "level":
                    return level_inputs(library, library.levels[self.id])
                case "lesson":
                    entry_lesson = library.lessons[self.id]
                    if entry_lesson.document is None:
                        return stub_inputs(library, entry_lesson)
                    return lesson_inputs(library, entry_lesson, entry_lesson.document)
                case "models":
                    return gallery_inputs(library)
                case "model":
                    model = next(model for model in library.course.models if model.name == self.id)
                    return model_inputs(library, model)
                case "page":
                    page = library.pages[self.id]
                    assert page.document is not None, "a page without a document is not in the list"
                    return page_inputs(library, page, page.document)
                case _:
                    return not_found_inputs(library)
        key = f"{kind.name}.description"
        description = library.words(key) if library.words.has(key) else ""
        title, home = page_title(library, kind), urls.Place(self.path).href(urls.HOME)
        if self.id:
            values = {"home": home, **kind.part_values(library, self.id)}
            title, template = str(values["title"]), f"{kind.name}-part.html"
        else:
            values = {"home": home, **kind.values(library)}
            template = "added.html" if kind.draw is not None else f"{kind.name}.html"
        head = PageHead(self.path, kind.name, title, description, indexed=kind.indexed)
        return PageInputs(head, template, values)

    def may_show_notes(self, library: Library) -> bool:
        """Whether its inputs may depend on summaries by features (`Feature.summary`)."""
        if self.kind not in ("level", "lesson", "page", "notfound"):
            return True
        document = self.document(library)
        blocks = () if document is None else document_blocks(document)
        feature_blocks = (block for block in blocks if isinstance(block, FeatureBlock))
        return any(kind_of_block(block).values is not None for block in feature_blocks)

    def document(self, library: Library) -> Document | None:
        """The document that it shows, if any."""
        match self.kind:
            case "lesson":
                return library.lessons[self.id].document
            case "page" | "home":
                page = library.pages.get(self.id)
                return None if page is None else page.document
            case _:
                return None


def page_list(library: Library) -> Iterator[PageEntry]:
    """The pages of the site of a course."""
    course = library.course
    yield PageEntry(urls.HOME, "home", "home")
    for level in course.levels:
        yield PageEntry(urls.level_path(level), "level", level.id)
    for lesson in library.order:
        yield PageEntry(urls.lesson_path(lesson), "lesson", lesson.id)
    if library.gallery:
        yield PageEntry(library.gallery, "models")
    for model in course.models:
        yield PageEntry(urls.model_page_path(model.name), "model", model.name)
    for kind in added_pages(library):
        yield PageEntry(kind.path, kind.name)
        for part in kind.parts(library):
            yield PageEntry(kind.part_path(part), kind.name, part)
    for page in course.pages:
        if page.document is not None and not page.is_home:
            yield PageEntry(urls.page_path(page), "page", page.id)
    yield PageEntry(urls.NOT_FOUND, "notfound")


class NamedLink(Struct, frozen=True):
    """A link with its text and a remark."""

    href: str
    text: str
    remark: str = ""


class PictureLink(Struct, frozen=True):
    """A picture of a block, with a link to the block."""

    src: str
    width: int
    height: int
    title: str
    href: str
    film: str = ""
    """The address of a moving picture, relative to the page."""


class LessonCard(Struct, frozen=True):
    """A written lesson as a card."""

    link: LessonLink
    level: str
    picture: PictureLink | None


class CardGroup(Struct, frozen=True):
    """Lessons of a path, with the picture that stands for it, or all that are in none."""

    title: str
    summary: str
    picture: PictureLink | None
    cards: tuple[LessonCard, ...]


class Gallery(Struct, frozen=True):
    """A page with several pictures."""

    title: str
    href: str
    pictures: tuple[PictureLink, ...]


class ModelCard(Struct, frozen=True):
    """A model in the gallery."""

    name: str
    description: str
    href: str
    picture: PictureLink | None
    lessons: tuple[LessonLink, ...]


def home_inputs(library: Library, document: Document | None) -> PageInputs:
    """The inputs of the home page: what can be read, and the whole plan, opened by its document."""
    course = library.course
    place = urls.Place(urls.HOME)
    written_lessons = [lesson for lesson in library.order if lesson.document is not None]
    cards, galleries = {}, []
    for lesson in written_lessons:
        pictures = _pictures_of(library, place, lesson)
        link = lesson_link(library, place, lesson, whole=True)
        level = library.levels[lesson.level].title
        cards[lesson.id] = LessonCard(link, level, pictures[0] if pictures else None)
    for page in library.menu:
        pictures = _pictures_of(library, place, page)
        if len(pictures) > 1:
            galleries.append(Gallery(page.title, place.href(urls.page_path(page)), pictures))
    card_groups = tuple(_card_groups(course.paths, cards))
    values = {
        "title": course.title,
        "summary": course.summary,
        "paths": tuple(group for group in card_groups if group.title),
        "card_groups": card_groups,
        "galleries": tuple(galleries),
        "levels": tuple(level_view(library, place, level, whole=True) for level in course.levels),
        "start": lesson_link(library, place, written_lessons[0]) if written_lessons else None,
        "written": len(written_lessons),
        "models": len(course.models),
        "gallery": place.href(library.gallery) if library.gallery else "",
        "numerics": place.href(urls.NUMERICS) if library.reports.cases else "",
        "article": "",  # without a document
        "scripts": len(library.scripts),
        "scripts_zip": place.href(urls.EXAMPLES_ZIP) if library.scripts else None,
    }
    head = PageHead(urls.HOME, "home", course.title, course.summary, course_data(library))
    inputs = None if document is None else document_inputs(library, place, document)
    return PageInputs(head, "home.html", values, inputs)


def _card_groups(
    paths: Iterable[CoursePath], cards: Mapping[str, LessonCard]
) -> Iterator[CardGroup]:
    """Yield the cards of each path, then of the lessons in none."""
    rest = dict(cards)
    for path in paths:
        steps = [cards[name] for name in path.lessons if name in cards]
        own_card = cards.get(path.picture or "")
        candidates = steps if own_card is None else [own_card]
        pictures = [card.picture for card in candidates if card.picture is not None]
        if steps:
            picture = pictures[-1] if pictures else None
            yield CardGroup(path.title, path.summary, picture, tuple(steps))
        for name in path.lessons:
            rest.pop(name, None)
    if rest:
        yield CardGroup("", "", None, tuple(rest.values()))


def _pictures_of(library: Library, place: urls.Place, owner: Owner) -> tuple[PictureLink, ...]:
    """The pictures of a document's blocks in order, with addresses relative to a place."""
    links = []
    for block in find_blocks(owner.document, FeatureBlock) if owner.document is not None else ():
        picture = kind_of_block(block).picture(block, library.trial_value(block))
        if picture is not None:
            src = place.href(picture.path)
            href = place.href(urls.owner_path(owner), picture.anchor)
            film = place.href(picture.film) if picture.film else ""
            size = picture.width, picture.height
            links.append(PictureLink(src, *size, picture.title, href, film))
    return tuple(links)


def level_inputs(library: Library, level: Level) -> PageInputs:
    """The inputs of the page of a level."""
    place = urls.Place(urls.level_path(level))
    levels = library.course.levels
    position = next(i for i, candidate in enumerate(levels) if candidate.id == level.id)
    values = {
        "home": place.href(urls.HOME),
        "level": level_view(library, place, level, whole=True),
        "graph": level_graph(library, place, level),
        "previous": _level_link(library, place, levels[position - 1]) if position else None,
        "following": _level_link(library, place, levels[position + 1])
        if position + 1 < len(levels)
        else None,
    }
    label = library.words("level.label", id=level.id)
    title = library.words("site.pair", first=label, second=level.title)
    head = PageHead(place.path, "level", title, level.summary)
    return PageInputs(head, "level.html", values)


def _level_link(library: Library, place: urls.Place, level: Level) -> NamedLink:
    label = library.words("level.label", id=level.id)
    return NamedLink(place.href(urls.level_path(level)), level.title, label)


def gallery_inputs(library: Library) -> PageInputs:
    """The inputs of the page of all models."""
    place, cards = urls.Place(library.gallery), []
    for model in library.course.models:
        href = place.href(urls.model_page_path(model.name))
        pictures = (part.picture(library, model) for part in model_parts().values())
        view, picture = next(filter(None, pictures), None), None
        if view is not None:
            src = place.href(view.path)
            picture = PictureLink(src, view.width, view.height, model.name, href)
        owners = [use.owner for use in library.uses[model.name]]
        lessons = tuple(lesson_link(library, place, o) for o in owners if isinstance(o, Lesson))
        cards.append(ModelCard(model.name, model.description, href, picture, lessons))
    values = {"home": place.href(urls.HOME), "models": tuple(cards)}
    words = library.words
    head = PageHead(place.path, "models", words("models.title"), words("models.description"))
    return PageInputs(head, "models.html", values)


def model_inputs(library: Library, model: MjcfModel) -> PageInputs:
    """The inputs of the page of a model: description, facts, uses, text."""
    place, words = urls.Place(urls.model_page_path(model.name)), library.words
    title = words("model.title", name=model.name)
    facts = library.facts.get(model.name)
    parts = {} if facts is None else model_parts()
    rows: list[tuple[str, str]] = []
    if facts is not None:
        unnamed = words("model.unnamed")
        rows = [
            (words("model.bodies"), str(facts.bodies)),
            (words("model.geoms"), str(facts.geoms)),
            (words("model.joints"), str(facts.joints)),
            (words("model.coordinates"), str(facts.nq)),
            (words("model.freedom"), str(facts.nv)),
            (words("model.actuators"), str(facts.nu)),
            (words("model.mass"), f"{words.number(facts.total_mass)} kg"),
            (words("model.timestep"), f"{words.number(facts.timestep)} s"),
            (words("model.integrator"), facts.integrator),
            (words("model.keyframes"), words.join(name or unnamed for name in facts.keyframes)),
            (words("model.sites"), words.join(name or unnamed for name in facts.sites)),
            (words("model.includes"), words.join(facts.includes)),
        ]
    further_rows = [row for part in parts.values() for row in part.facts(library, model)]
    values_by_part = {name: part.values(library, place, model) for name, part in parts.items()}
    uses = []
    for use in library.uses[model.name]:
        text = use.owner.title
        if isinstance(use.owner, Lesson):
            label = words("lesson.label", id=use.owner.id)
            text = words("site.pair", first=label, second=text)
        href = place.href(urls.owner_path(use.owner))
        uses.append(NamedLink(href, text, words.join(map(words, use.ways))))
    values = {
        "home": place.href(urls.HOME),
        "gallery": place.href(library.gallery) if library.gallery else "",
        "name": model.name,
        "path": model.source.path,
        "anchor": listing_anchor(model.source.path),
        "title": title,
        "href": place.href(urls.model_file_path(model.name)),
        "facts": (*((label, value) for label, value in rows if value), *further_rows),
        "code": HighlightedFile("xml", model.source.text.rstrip(), model.source.path),
        "about": model.description,
        "opening": _added_parts(parts, values_by_part, opens=True),
        "added": _added_parts(parts, values_by_part, opens=False),
        "uses": tuple(uses),
    }
    return PageInputs(PageHead(place.path, "model", title, model.description), "model.html", values)


def _added_parts(
    parts: Mapping[str, ModelPart], values: Mapping[str, Struct | None], *, opens: bool
) -> AddedParts:
    pairs = ((name, values[name]) for name, part in parts.items() if part.opens is opens)
    return AddedParts({name: value for name, value in pairs if value is not None})


def page_inputs(library: Library, page: Page, document: Document) -> PageInputs:
    """The inputs of a page that is not a lesson; its document's summary is enough."""
    place = urls.Place(urls.page_path(page))
    pages = [p for p in library.course.pages if p.section and not p.is_home] if page.section else []
    links = {p.id: NamedLink(place.href(urls.page_path(p)), p.title) for p in pages}
    order = list(links)
    position = order.index(page.id) if page.id in order else 0
    values = {
        "title": page.title,
        "edit": edit_address(library, page.path),
        "current": page.id,
        "sections": tuple(
            (title, tuple((p.id, links[p.id]) for p in pages if p.section == title))
            for title in dict.fromkeys(p.section for p in pages)
        ),
        "previous": links[order[position - 1]] if position else None,
        "following": links[order[position + 1]] if position + 1 < len(order) else None,
    }
    return PageInputs(
        PageHead(place.path, "page", page.title, "", language=page.language or ""),
        "page.html",
        values,
        document_inputs=document_inputs(library, place, document),
    )


def not_found_inputs(library: Library) -> PageInputs:
    """The inputs of the page for missing addresses."""
    place = place_of(library.course.base_url, urls.NOT_FOUND)
    values = {"home": place.href(urls.HOME)}
    title = library.words("notfound.title")
    head = PageHead(urls.NOT_FOUND, "notfound", title, "", indexed=False)
    return PageInputs(head, "notfound.html", values)
