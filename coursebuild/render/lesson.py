"""The page of a lesson: where it stands, what it needs and gives, its text, and the way on.

Entry points: `lesson_draft`, and for a planned lesson `stub_draft`; `article` and `contents` serve
other pages with a document.
"""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from coursebuild.model import (
    Block,
    Document,
    Emphasis,
    FootnoteRef,
    HardBreak,
    Heading,
    HtmlBlock,
    Image,
    Inline,
    Lab,
    Lesson,
    Link,
    Mjcf,
    Quiz,
    RawInline,
    Recording,
    Script,
    SoftBreak,
    Status,
    Strikethrough,
    Strong,
    Table,
    Text,
)
from coursebuild.render import meta, urls
from coursebuild.render.context import PageContext
from coursebuild.render.frame import Draft
from coursebuild.render.library import Library, document_scripts


@dataclass(frozen=True, slots=True)
class LessonLink:
    """A lesson as other pages name it."""

    id: str
    title: str
    href: str
    status: str
    minutes: int | None
    summary: str
    needs: tuple[LessonLink, ...] = ()


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of the contents list."""

    anchor: str
    title: Markup
    children: tuple[Entry, ...] = ()


def lesson_link(
    library: Library, place: urls.Place, lesson: Lesson, *, needs: bool = False
) -> LessonLink:
    """A lesson as a link from a place; with `needs`, its prerequisites as well."""
    required = (library.lessons[need] for need in lesson.prerequisites) if needs else ()
    return LessonLink(
        lesson.id,
        lesson.title,
        place.href(urls.lesson_path(lesson)),
        lesson.status.value,
        lesson.minutes,
        lesson.summary,
        tuple(lesson_link(library, place, need) for need in required),
    )


def lesson_draft(library: Library, lesson: Lesson, document: Document) -> Draft:
    """The page of a written lesson."""
    place = urls.Place(urls.lesson_path(lesson))
    page = PageContext.of(library, place, document)
    scripts = tuple((script.path, place.href(script.path)) for script in document_scripts(document))
    body = page.template(
        "lesson.html",
        **_common(library, place, lesson),
        contents=contents(page, document),
        article=article(page, document),
        scripts=scripts,
        scripts_zip=place.href(urls.lesson_zip_path(lesson)) if scripts else None,
        edit=edit_address(library, lesson.path),
    )
    return Draft(
        place.path,
        "lesson",
        lesson.title,
        lesson.summary,
        body,
        json_ld=meta.lesson_data(library, lesson),
        og_type="article",
    )


def stub_draft(library: Library, lesson: Lesson) -> Draft:
    """The page of a planned lesson: it says that it is planned, and what can be read now."""
    place = urls.Place(urls.lesson_path(lesson))
    written = [need for need in _ancestors(library, lesson) if need.document is not None]
    readable = tuple(lesson_link(library, place, need) for need in written)
    body = library.render("stub.html", **_common(library, place, lesson), readable=readable)
    return Draft(place.path, "stub", lesson.title, lesson.summary, body, indexed=False)


def _common(library: Library, place: urls.Place, lesson: Lesson) -> dict[str, object]:
    """What a lesson's page says whether it is written or not."""
    level = library.levels[lesson.level]
    order = library.course.lessons
    at = library.positions[lesson.id]
    return {
        "lesson": lesson,
        "status": lesson.status.value,
        "draft": lesson.status is Status.DRAFT,
        "level": level,
        "home": place.href(urls.HOME),
        "level_href": place.href(urls.level_path(level)),
        "needs": lesson_link(library, place, lesson, needs=True).needs,
        "leads": tuple(lesson_link(library, place, other) for other in library.leads[lesson.id]),
        "previous": lesson_link(library, place, order[at - 1]) if at else None,
        "following": lesson_link(library, place, order[at + 1]) if at + 1 < len(order) else None,
    }


def _ancestors(library: Library, lesson: Lesson) -> tuple[Lesson, ...]:
    """Everything that a lesson builds on, in the order of the course."""
    found: set[str] = set()
    waiting = list(lesson.prerequisites)
    while waiting:
        need = waiting.pop()
        if need not in found:
            found.add(need)
            waiting += library.lessons[need].prerequisites
    return tuple(other for other in library.course.lessons if other.id in found)


def edit_address(library: Library, path: str) -> str | None:
    """Where a file of the course can be edited.

    `{path}` in the repository's address stands for the file; without it the address is that of a
    repository on a host that keeps to the usual paths.
    """
    repository = library.course.repository
    if not repository:
        return None
    if "{path}" in repository:
        return repository.replace("{path}", urls.encode(path))
    middle = "/-/edit/main/" if "gitlab" in repository else "/edit/main/"
    return repository.rstrip("/") + middle + urls.encode(path)


# --------------------------------------------------------------------------------- documents


def article(page: PageContext, document: Document) -> Markup:
    """The text of a document. A docked lab stands beside the paragraphs around it."""
    parts: list[Markup] = []
    for group in _groups(document.blocks):
        if group.lab is None:
            parts.append(page.blocks(group.before))
        else:
            before, after = page.blocks(group.before), page.blocks(group.after)
            instrument = page.block(group.lab)
            parts.append(
                page.template("partials/dock.html", before=before, lab=instrument, after=after)
            )
    return Markup("\n").join((*parts, page.footnotes()))


@dataclass(frozen=True, slots=True)
class _Group:
    """Blocks that follow each other; with a docked lab, those before and after it."""

    before: tuple[Block, ...]
    lab: Lab | None = None
    after: tuple[Block, ...] = ()


_WIDE = (Script, Recording, Mjcf, Quiz, Lab, Table, HtmlBlock)
"""Blocks that take the whole width, so that no lab can stand beside them."""


def _groups(blocks: tuple[Block, ...]) -> tuple[_Group, ...]:
    """Cut the text around its docked labs.

    Each takes what lies between it and the next heading or wide block, on both sides.
    """
    groups: list[_Group] = []
    rest = blocks
    while (
        at := next((i for i, b in enumerate(rest) if isinstance(b, Lab) and b.dock), None)
    ) is not None:
        lab = rest[at]
        assert isinstance(lab, Lab)
        start = next((i + 1 for i in range(at - 1, -1, -1) if isinstance(rest[i], _WIDE)), 0)
        start = next(
            (i for i in range(at - 1, start - 1, -1) if isinstance(rest[i], Heading)), start
        )
        end = next(
            (i for i in range(at + 1, len(rest)) if isinstance(rest[i], (*_WIDE, Heading))),
            len(rest),
        )
        if start:
            groups.append(_Group(rest[:start]))
        groups.append(_Group(rest[start:at], lab, rest[at + 1 : end]))
        rest = rest[end:]
    return (*groups, _Group(rest)) if rest else tuple(groups)


def contents(page: PageContext, document: Document) -> tuple[Entry, ...]:
    """The contents list: headings of levels 2 and 3, the latter under the former."""
    entries: list[Entry] = []
    for block in document.blocks:
        if not isinstance(block, Heading) or block.level > 3:
            continue
        entry = Entry(block.anchor, page.inlines(without_links(block.children)))
        if block.level == 3 and entries:
            last = entries[-1]
            entries[-1] = Entry(last.anchor, last.title, (*last.children, entry))
        else:
            entries.append(entry)
    return tuple(entries)


def without_links(inlines: tuple[Inline, ...]) -> tuple[Inline, ...]:
    """Inlines that may stand inside a link: no link, footnote, raw HTML or picture, in one line."""
    kept: list[Inline] = []
    for inline in inlines:
        match inline:
            case Link():
                kept += without_links(inline.children)
            case Emphasis() | Strong() | Strikethrough():
                kept.append(type(inline)(inline.span, without_links(inline.children)))
            case Image():
                kept.append(Text(inline.span, inline.alt))
            case SoftBreak() | HardBreak():
                kept.append(Text(inline.span, " "))
            case RawInline() | FootnoteRef():
                pass
            case _:
                kept.append(inline)
    return tuple(kept)
