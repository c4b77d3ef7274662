"""Another name for a lesson, a term or a label, wherever the course names it.

Entry points: `name_at`, what is named at a place; `rename`, the edits that name it otherwise.

1. A lesson gets another id, and its file another path, as `coursebuild rename` gives them.
2. A term gets another name in the glossary, and links to it the id that follows from the name.
3. A label is that of a formula, or the id that is given to a heading.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from urllib.parse import unquote

from lsprotocol import types
from msgspec import Struct
from msgspec.structs import replace
from pygls.exceptions import JsonRpcInvalidParams

from coursebuild.core import model
from coursebuild.core.checks.links import anchors
from coursebuild.core.files.errors import UsageError
from coursebuild.core.pages.library import Library
from coursebuild.core.syntax.attributes import collapse_spaces
from coursebuild.core.syntax.headings import term_id
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Source, Span
from coursebuild.features.authoring.course_map import with_lesson_renamed
from coursebuild.features.authoring.references import references
from coursebuild.features.language_server.commands.lookup import look_up
from coursebuild.features.language_server.commands.texts import OpenTexts


class _Name(Struct, frozen=True):
    """Something that has a name, which can be another one."""

    span: Span
    """Where it is named."""
    text: str
    renamed: Callable[[str], types.WorkspaceEdit]
    """The edits that give it another name; an exception where it cannot have that."""


def name_at(
    texts: OpenTexts, source: Source, asked: types.PrepareRenameParams
) -> types.PrepareRenamePlaceholder | None:
    """The name at a place, and where it stands."""
    found = _name(texts, source, asked.position)
    if found is None:
        return None
    return types.PrepareRenamePlaceholder(texts.places.range(found.span), found.text)


def rename(
    texts: OpenTexts, source: Source, asked: types.RenameParams
) -> types.WorkspaceEdit | None:
    """The edits that give what is named at a place another name.

    Raises:
        JsonRpcInvalidParams: it cannot have this name.
    """
    found = _name(texts, source, asked.position)
    return None if found is None else found.renamed(asked.new_name)


def _name(texts: OpenTexts, source: Source, position: types.Position) -> _Name | None:
    offset, document = texts.places.offset(source, position), texts.document(source)
    for label, span in {} if document is None else _labels(document).items():
        if span.start <= offset <= span.end:
            return _label(texts, source.path, label, span)
    found = look_up(texts, source, position)
    if found is None or found.target is None:
        return None
    if isinstance(found.target, model.TermTarget):
        return _term(texts, found.target.id, found.span)
    path, anchor = _anchor(texts.library, found.target, source.path)
    start = found.span.start + found.span.text.rfind("#") + 1
    if anchor and offset >= start:
        return _label(texts, path, anchor, source.span(start, start + len(anchor)))
    if isinstance(found.target, model.LessonTarget):
        return _lesson(texts, texts.library.lessons[found.target.id], found.span)
    return None


def _written(texts: OpenTexts, edits: Iterable[Edit]) -> types.WorkspaceEdit:
    """Edits, each once: several links may have their address from one place."""
    once = {(edit.span.path, edit.span.start): edit for edit in edits}
    return types.WorkspaceEdit(texts.places.changes(once.values()))


# --- lessons


def _lesson(texts: OpenTexts, lesson: model.Lesson, span: Span) -> _Name:
    start = span.start + max(span.text.rfind(lesson.id), 0)

    def renamed(id: str) -> types.WorkspaceEdit:
        course, places = texts.library.course, texts.places
        edits = references(course, lesson, id)
        of_map = [edit for edit in edits if edit.span.source == course.map]
        try:
            whole_map = Edit(course.map.span(), with_lesson_renamed(course, lesson, id, of_map))
        except UsageError as error:
            raise JsonRpcInvalidParams(str(error)) from None
        changes = places.changes([whole_map, *(edit for edit in edits if edit not in of_map)])
        named = types.OptionalVersionedTextDocumentIdentifier
        files = [types.TextDocumentEdit(named(uri), its) for uri, its in changes.items()]
        old, new = places.uri(lesson.path), places.uri(replace(lesson, id=id).path)
        moved = [] if lesson.document is None else [types.RenameFile(old, new)]
        return types.WorkspaceEdit(document_changes=[*files, *moved])

    return _Name(span.source.span(start, start + len(lesson.id)), lesson.id, renamed)


# --- terms


def _term(texts: OpenTexts, id: str, span: Span) -> _Name | None:
    owner = texts.library.terms[id]
    document = texts.document(texts.source(owner.path))
    inlines = () if document is None else model.document_inlines(document)
    term = next((i for i in inlines if isinstance(i, model.Term) and i.id == id), None)
    if term is None:
        return None

    def renamed(name: str) -> types.WorkspaceEdit:
        new = term_id(name)
        if not new or set('{}"\n') & set(name):
            raise JsonRpcInvalidParams('a term has letters or digits, and none of `{`, `}`, `"`')
        if new != id and new in texts.library.terms:
            raise JsonRpcInvalidParams(f"there is a term `{new}` already")
        start = term.span.start + term.span.text.rindex("{")
        same = name == collapse_spaces(model.plain_text(term.children))
        edits = [Edit(term.span.source.span(start, term.span.end), _TERM[same].format(name))]
        for link, target in _links(texts):
            if isinstance(target, model.TermTarget) and target.id == id:
                edits.append(Edit(link.target_span, f"term:{new}"))
        edits += _anchored(texts, owner.path, term.anchor, f"term:{new}")
        return _written(texts, edits)

    return _Name(span, term.name, renamed)


_TERM = '{{term="{}"}}', "{{term}}"
"""A name of its own, and that of the words in the text."""


# --- labels


def _label(texts: OpenTexts, path: str, label: str, span: Span) -> _Name | None:
    document = texts.document(texts.source(path))
    place = None if document is None else _labels(document).get(label)
    if document is None or place is None:
        return None  # an anchor that follows from a text

    def renamed(name: str) -> types.WorkspaceEdit:
        formula = label.startswith("eq:")
        if not re.fullmatch(r"eq:[\w-]+" if formula else r"[\w:.-]*[\w:-]", name):
            form = "`eq:` and then " if formula else ""
            raise JsonRpcInvalidParams(f"a label is {form}letters, digits, `-` and `_`")
        if name != label and name in anchors(document):
            raise JsonRpcInvalidParams(f"there is an anchor `{name}` already")
        return _written(texts, [Edit(place, name), *_anchored(texts, path, label, name)])

    return _Name(span, label, renamed)


def _labels(document: model.Document) -> dict[str, Span]:
    """The labels that are written in a document, and where."""
    found = {}
    for node in (*model.document_blocks(document), *model.document_inlines(document)):
        if isinstance(node, model.Math | model.MathBlock) and node.label is not None:
            found[node.label.id] = node.label.span
        elif isinstance(node, model.Heading) and node.explicit:
            start = node.span.start + node.span.text.rindex(f"#{node.anchor}") + 1
            found[node.anchor] = node.span.source.span(start, start + len(node.anchor))
    return found


def _links(texts: OpenTexts) -> Iterator[tuple[model.Link, model.Target]]:
    """All links of the course, also of what was typed just now, and where they lead."""
    course = texts.library.course
    for known in course.documents:
        path = known.source.path
        typed = texts.document(texts.source(path)) if path in texts.session.open_texts else None
        for inline in model.document_inlines(typed or known):
            if isinstance(inline, model.Link):
                yield inline, model.resolve(inline.target, course, path)


def _anchor(library: Library, target: model.Target, path: str) -> tuple[str, str]:
    """The file of a lesson or page that a link in a file leads into, and the anchor there."""
    match target:
        case model.LessonTarget(id=id, anchor=anchor) if id in library.lessons:
            return library.lessons[id].path, unquote(anchor or "")
        case model.PageTarget(id=id, anchor=anchor) if id in library.pages:
            return library.pages[id].path, unquote(anchor or "")
        case model.UrlTarget(url=url) if url.startswith("#"):
            return path, unquote(url[1:])
        case _:
            return "", ""


def _anchored(texts: OpenTexts, path: str, anchor: str, new: str) -> Iterator[Edit]:
    """The edits of all links to an anchor of a file."""
    for link, target in _links(texts):
        if _anchor(texts.library, target, link.span.path) == (path, anchor):
            span = link.target_span
            start = span.start + span.text.rindex("#") + 1
            yield Edit(span.source.span(start, span.end), new)
