"""Proposals for what to write at a place, and the edits by which a name gets another.

Proposals come from where the checks look things up: the course, anchors, the declarations of
fields, the catalogue of rules, the engine.

Renamed are a lesson, a term or a label, wherever the course names it. A lesson gets a new id, and
its file a new path. A term gets a new name in the glossary, and links to it the id that follows
from the name. A label is that of what has a number, or the explicit id of a heading.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from urllib.parse import unquote

from lsprotocol import types
from lsprotocol.types import CompletionItemKind as Kind
from msgspec import Struct
from msgspec.structs import replace
from pygls.exceptions import JsonRpcInvalidParams

from coursebuild.api import Edit, Library, Source, Span, UsageError, model
from coursebuild.core.checks.links import anchors
from coursebuild.core.model.lesson_record import record_path
from coursebuild.core.registry import CORE_FENCES, fence_names
from coursebuild.core.syntax.attributes import collapse_spaces, term_id
from coursebuild.core.syntax.decode import field_description
from coursebuild.core.text.rules import RULES
from coursebuild.features.authoring.course_map import rename_references, with_lesson_renamed
from coursebuild.features.language_server.commands.lookup import label_titles, look_up, members
from coursebuild.features.language_server.commands.texts import (
    OpenTexts,
    fence_at,
    field_place,
    possible_values,
)
from coursebuild.features.names.claims import document_names
from coursebuild.features.names.known_names import options_by_command
from coursebuild.features.names.resolve import resolver_of
from coursebuild.features.references import works_of

_NAME = r"[A-Za-z_]\w*"
_SUBJECTS = (
    ("lesson", Kind.Reference, r"\b(?:lesson:|(?:LESSON)\s)(?P<word>[\w.]*)$"),
    ("page", Kind.Reference, r"\bpage:(?P<word>[\w-]*)$"),
    ("model", Kind.File, r"\bmodel:(?P<word>[\w/-]*)$"),
    ("model", Kind.File, r"""(?:model_path\(|"model"\s*:\s*)["'](?P<word>[\w/-]*)$"""),
    ("term", Kind.Reference, r"\bterm:(?P<word>[\w-]*)$"),
    ("source", Kind.Reference, r"\[(?:[^\[\]{}]*[\s;])?@(?P<word>[\w.:/+-]*)$"),
    ("script", Kind.File, r"(?:\]\(|\{out=)(?P<word>e?[\w./-]*)$"),
    ("callout", Kind.EnumMember, r"^[ \t>]*>[ ]*\[!(?P<word>[\w-]*)$"),
    ("fence", Kind.Keyword, r"^[ \t>]*```[ ]*(?P<word>[\w-]*)$"),
    (
        "anchor",
        Kind.Reference,
        r"\]\((?:(?P<kind>lesson|page):(?P<id>[\w.-]+))?#(?P<word>[\w.:-]*)$",
    ),
    ("command", Kind.Keyword, r"`coursebuild (?P<word>\w*)$"),
    ("element", Kind.Class, r"`</?(?P<word>\w*)$"),
    ("attribute", Kind.Property, r"`<(?P<tag>\w+)(?: [^`<>]*)? (?P<word>\w*)$"),
    ("name", Kind.Function, r"(?<!`)`(?P<word>\w+)$"),
    ("member", Kind.Field, rf"(?<![\w.])(?P<path>{_NAME}(?:\.{_NAME})*)\.(?P<word>\w*)$"),
)
"""What can be proposed, its icon, and a pattern of the text before the cursor, whose group
`word` is the part of the name that is there already. `LESSON` stands for the words of mentions.
"""


def completions(
    texts: OpenTexts, source: Source, params: types.CompletionParams
) -> list[types.CompletionItem]:
    """Return all proposals for a place; the client leaves out those that do not fit."""
    offset = texts.places.offset(source, params.position)
    cursor = source.span(offset, offset)
    line = source.text[source.line_starts[cursor.line - 1] : offset]
    words = texts.library.course.words_of(texts.owner(source))
    mentions = "|".join((*words.lessons, *words.lesson))
    for subject, kind, pattern in _SUBJECTS:
        prefix = re.search(pattern.replace("LESSON", mentions), line)
        known_names = {} if prefix is None else _find_names(texts, cursor, subject, prefix)
        if prefix is not None and known_names:
            span = source.span(offset - len(prefix["word"]), offset)
            return _make_items(texts, span, kind, known_names)
    place = field_place(source, offset)
    if place is None:
        return []
    match place.key:
        case "":
            quote = "" if place.span.path.endswith(".toml") else '"'
            missing = {n: field for n, field in place.fields.items() if n not in place.keys}
            names = {
                f"{quote}{name}{quote}": field_description(field.type)
                for name, field in missing.items()
            }
        case "rule":
            rules = (rule for rule in RULES.values() if rule.severity != "error")
            names = {f'"{rule.name}"': rule.summary for rule in rules}
        case "prerequisites":
            lessons = texts.library.lessons.values()
            names = {f'"{lesson.id}"': lesson.title for lesson in lessons}
        case _:
            names = dict.fromkeys(possible_values(place.field.type) if place.field else (), "")
    kind = Kind.Value if place.key else Kind.Property
    return _make_items(texts, place.span, kind, names)


def _make_items(
    texts: OpenTexts, span: Span, kind: Kind, names: Mapping[str, str]
) -> list[types.CompletionItem]:
    replaced_range = texts.places.range(span)
    return [
        types.CompletionItem(
            name.strip('"'),
            kind=kind,
            detail=" ".join(detail.split()),  # some clients put it between fences
            filter_text=name,
            text_edit=types.TextEdit(replaced_range, name),
        )
        for name, detail in names.items()
    ]


def _find_names(
    texts: OpenTexts, cursor: Span, subject: str, prefix: re.Match[str]
) -> Mapping[str, str]:
    library = texts.library
    match subject:
        case "lesson":
            return {lesson.id: lesson.title for lesson in library.lessons.values()}
        case "page":
            return {page.id: page.title for page in library.pages.values()}
        case "model":
            return {model.name: model.description for model in library.course.models}
        case "term":
            return {id: f"of {owner.id}: {owner.title}" for id, owner in library.terms.items()}
        case "source":
            works = works_of(library.course).values()
            return {work.key: work.field("title") for work in works}
        case "script":
            scripts = library.scripts.items()
            return {path: f"of {owner.id}: {owner.title}" for path, (_, owner) in scripts}
        case "callout":
            return {
                kind.name: library.callout(kind.name).promise for kind in library.course.callouts
            }
        case "fence":
            is_outside = fence_at(cursor.source, cursor.start) is None
            return dict.fromkeys((*CORE_FENCES, *fence_names()), "") if is_outside else {}
        case "anchor":
            return _find_anchors(texts, cursor.source, prefix)
        case "command" | "element" | "attribute" | "name" if fence_at(cursor.source, cursor.start):
            return {}
        case "command":
            return dict.fromkeys(options_by_command(), "")
        case "element" | "attribute" | "name":
            return _find_engine_names(texts, cursor.source, subject, prefix)
        case _:
            names = members(texts, tuple(prefix["path"].split(".")), _code_at(texts, cursor))
            return {name: member.doc for name, member in names.items()}


def _code_at(texts: OpenTexts, cursor: Span) -> str:
    """The code at a place, that of a script with all its parts."""
    document = texts.document(cursor.source)
    for script in () if document is None else model.document_scripts(document):
        if any(part.span.start <= cursor.start <= part.span.end for part in script.parts):
            return script.code.text
    _, code = fence_at(cursor.source, cursor.start) or ("", cursor)
    return code.text


def _find_engine_names(
    texts: OpenTexts, source: Source, subject: str, prefix: re.Match[str]
) -> Mapping[str, str]:
    engine, document = resolver_of(texts.library.course).engine, texts.document(source)
    note = None if document is None else document_names(document)
    names = {} if note is None else dict.fromkeys(note.definitions, "")
    if engine is None:
        return names if subject == "name" else {}
    if subject == "element":
        return dict.fromkeys(engine.elements, "")
    if subject == "attribute":
        places = engine.elements.get(prefix["tag"], {}).values()
        return {attribute: "" for attributes in places for attribute in attributes}
    functions = {name: function.text for name, function in engine.functions.items()}
    all_words = (*engine.constants, *engine.enums, *engine.enum_of, *engine.classes)
    words = sorted(word for word in all_words if word.lower().startswith("mj"))
    fields = {
        name: member.text
        for kind in ("MjModel", "MjData")
        for name, member in engine.classes[kind].items()
    }
    return {**dict.fromkeys(words, ""), **fields, **functions, **names}


def _find_anchors(texts: OpenTexts, source: Source, prefix: re.Match[str]) -> Mapping[str, str]:
    """Return the anchors of the lesson or page that the link names, or else of this one."""
    library, id = texts.library, prefix["id"]
    if id is not None:
        owner = library.lessons.get(id) if prefix["kind"] == "lesson" else library.pages.get(id)
        source = texts.source("" if owner is None else owner.path)
    document = texts.document(source)
    if document is None:
        return {}
    lines = {
        name: place.first_line().text.lstrip("# ") for name, place in anchors(document).items()
    }
    return lines | label_titles(library, texts.owner(source), document)


# --- renaming


class _Name(Struct, frozen=True):
    """A name that can be changed."""

    span: Span
    text: str
    rename: Callable[[str], types.WorkspaceEdit]
    """Return the edits for a new name; raise `JsonRpcInvalidParams` where it cannot be used."""


def name_at(
    texts: OpenTexts, source: Source, params: types.PrepareRenameParams
) -> types.PrepareRenamePlaceholder | None:
    """Return the name at a place, and its range."""
    name = _find_name(texts, source, params.position)
    if name is None:
        return None
    return types.PrepareRenamePlaceholder(texts.places.range(name.span), name.text)


def rename(
    texts: OpenTexts, source: Source, params: types.RenameParams
) -> types.WorkspaceEdit | None:
    """Return the edits that give the thing at a place a new name.

    Raises:
        JsonRpcInvalidParams: it cannot have this name.
    """
    name = _find_name(texts, source, params.position)
    return None if name is None else name.rename(params.new_name)


def _find_name(texts: OpenTexts, source: Source, position: types.Position) -> _Name | None:
    offset, document = texts.places.offset(source, position), texts.document(source)
    for label, span in {} if document is None else _labels(document).items():
        if span.start <= offset <= span.end:
            return _label_name(texts, source.path, label, span)
    referent = look_up(texts, source, position)
    if referent is None or referent.target is None:
        return None
    target, span = referent.target, referent.span
    if isinstance(target, model.TermTarget):
        return _term_name(texts, target.id, span)
    path, anchor = _resolve_anchor(texts.library, target, source.path)
    start = span.start + span.text.rfind("#") + 1
    if anchor and offset >= start:
        return _label_name(texts, path, anchor, source.span(start, start + len(anchor)))
    if isinstance(target, model.LessonTarget):
        return _lesson_name(texts, texts.library.lessons[target.id], span)
    return None


def _workspace_edit(texts: OpenTexts, edits: Iterable[Edit]) -> types.WorkspaceEdit:
    """Return edits for the client, each once, since several links can share one address."""
    unique_edits = {(edit.span.path, edit.span.start): edit for edit in edits}
    return types.WorkspaceEdit(texts.places.changes(unique_edits.values()))


# --- lessons


def _lesson_name(texts: OpenTexts, lesson: model.Lesson, span: Span) -> _Name:
    start = span.start + max(span.text.rfind(lesson.id), 0)

    def rename_lesson(id: str) -> types.WorkspaceEdit:
        course, places = texts.library.course, texts.places
        edits = rename_references(course, lesson, id)
        map_edits = [edit for edit in edits if edit.span.source == course.map]
        try:
            new_map = with_lesson_renamed(course, lesson, id, map_edits)
        except UsageError as error:
            raise JsonRpcInvalidParams(str(error)) from None
        text_edits = (edit for edit in edits if edit not in map_edits)
        text_changes = places.document_edits([Edit(course.map.span(), new_map), *text_edits])
        old, new = lesson.path, replace(lesson, id=id).path
        paths = [] if lesson.document is None else [(old, new)]
        if (texts.session.root / record_path(old)).exists():
            paths.append((record_path(old), record_path(new)))
        file_renames = [types.RenameFile(places.uri(a), places.uri(b)) for a, b in paths]
        return types.WorkspaceEdit(document_changes=[*text_changes, *file_renames])

    return _Name(span.source.span(start, start + len(lesson.id)), lesson.id, rename_lesson)


# --- terms


def _term_name(texts: OpenTexts, id: str, span: Span) -> _Name | None:
    owner = texts.library.terms[id]
    document = texts.document(texts.source(owner.path))
    inlines = () if document is None else model.document_inlines(document)
    term = next((i for i in inlines if isinstance(i, model.Term) and i.id == id), None)
    if term is None:
        return None

    def rename_term(name: str) -> types.WorkspaceEdit:
        new = term_id(name)
        if not new or set('{}"\n') & set(name):
            raise JsonRpcInvalidParams('a term has letters or digits, and none of `{`, `}`, `"`')
        if new != id and new in texts.library.terms:
            raise JsonRpcInvalidParams(f"there is already a term `{new}`")
        start = term.span.start + term.span.text.rindex("{")
        is_text = name == collapse_spaces(model.plain_text(term.children))
        attribute = "{term}" if is_text else f'{{term="{name}"}}'
        edits = [Edit(term.span.source.span(start, term.span.end), attribute)]
        for link, target in _links(texts):
            if isinstance(target, model.TermTarget) and target.id == id:
                edits.append(Edit(link.target_span, f"term:{new}"))
        edits += _edit_anchor_links(texts, owner.path, term.anchor, f"term:{new}")
        return _workspace_edit(texts, edits)

    return _Name(span, term.name, rename_term)


# --- labels


def _label_name(texts: OpenTexts, path: str, label: str, span: Span) -> _Name | None:
    document = texts.document(texts.source(path))
    place = None if document is None else _labels(document).get(label)
    if document is None or place is None:
        return None  # an anchor that follows from the text of a heading

    def rename_label(name: str) -> types.WorkspaceEdit:
        prefix, colon, _ = label.partition(":")
        is_numbered = bool(colon)
        if not re.fullmatch(rf"{prefix}:[\w-]+" if is_numbered else r"[\w:.-]*[\w:-]", name):
            form = f"`{prefix}:` and then " if is_numbered else ""
            raise JsonRpcInvalidParams(f"a label is {form}letters, digits, `-` and `_`")
        if name != label and name in anchors(document):
            raise JsonRpcInvalidParams(f"there is already an anchor `{name}`")
        link_edits = _edit_anchor_links(texts, path, label, name)
        return _workspace_edit(texts, [Edit(place, name), *link_edits])

    return _Name(span, label, rename_label)


def _labels(document: model.Document) -> dict[str, Span]:
    labels = {}
    for node in (*model.document_blocks(document), *model.document_inlines(document)):
        if isinstance(node, model.Math | model.Labelled) and node.label is not None:
            labels[node.label.id] = node.label.span
        elif isinstance(node, model.Heading) and node.explicit:
            start = node.span.start + node.span.text.rindex(f"#{node.anchor}") + 1
            labels[node.anchor] = node.span.source.span(start, start + len(node.anchor))
    return labels


def _links(texts: OpenTexts) -> Iterator[tuple[model.Link, model.Target]]:
    """Yield all links of the course with their targets, those just typed included."""
    course = texts.library.course
    for document in course.documents:
        path = document.source.path
        is_open = path in texts.session.open_texts
        open_document = texts.document(texts.source(path)) if is_open else None
        for link in model.find_inlines(open_document or document, model.Link):
            yield link, model.resolve(link.target, course, path)


def _resolve_anchor(library: Library, target: model.Target, path: str) -> tuple[str, str]:
    """Return the file and the anchor that a link in a file leads to, in a lesson or page."""
    match target:
        case model.LessonTarget(id=id, anchor=anchor) if id in library.lessons:
            return library.lessons[id].path, unquote(anchor or "")
        case model.PageTarget(id=id, anchor=anchor) if id in library.pages:
            return library.pages[id].path, unquote(anchor or "")
        case model.UrlTarget(url=url) if url.startswith("#"):
            return path, unquote(url[1:])
        case _:
            return "", ""


def _edit_anchor_links(texts: OpenTexts, path: str, anchor: str, new: str) -> Iterator[Edit]:
    for link, target in _links(texts):
        if _resolve_anchor(texts.library, target, link.span.path) == (path, anchor):
            span = link.target_span
            start = span.start + span.text.rindex("#") + 1
            yield Edit(span.source.span(start, span.end), new)
