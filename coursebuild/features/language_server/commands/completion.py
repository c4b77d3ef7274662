"""Proposals for what to write at a place.

They come from where the checks look things up: the course, anchors, the declarations of fields, the
catalogue of rules, the engine.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from lsprotocol import types
from lsprotocol.types import CompletionItemKind as Kind

from coursebuild.core.checks.links import anchors
from coursebuild.core.pages.library import Library
from coursebuild.core.registry import CORE_FENCES, fence_names
from coursebuild.core.syntax.decode import field_description
from coursebuild.core.text.rules import RULES
from coursebuild.core.text.source import Source, Span
from coursebuild.features.language_server.commands.lookup import label_titles, members
from coursebuild.features.language_server.commands.texts import (
    FieldPlace,
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
    words = texts.library.course.words
    mentions = "|".join((*words.lessons, *words.lesson))
    for subject, kind, pattern in _SUBJECTS:
        prefix = re.search(pattern.replace("LESSON", mentions), line)
        names = {} if prefix is None else _find_names(texts, cursor, subject, prefix)
        if prefix is not None and names:
            span = source.span(offset - len(prefix["word"]), offset)
            return _make_items(texts, span, kind, names)
    place = field_place(source, offset)
    if place is None:
        return []
    kind = Kind.Value if place.key else Kind.Property
    return _make_items(texts, place.span, kind, _find_field_names(texts.library, place))


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
            _, code = fence_at(cursor.source, cursor.start) or ("", cursor)
            names = members(texts, tuple(prefix["path"].split(".")), code.text)
            return {name: member.doc for name, member in names.items()}


def _find_engine_names(
    texts: OpenTexts, source: Source, subject: str, prefix: re.Match[str]
) -> Mapping[str, str]:
    engine, document = resolver_of(texts.library.course).engine, texts.document(source)
    note = None if document is None else document_names(document)
    names = {} if note is None else dict.fromkeys(note.names.definitions, "")
    if engine is None:
        return names if subject == "name" else {}
    if subject == "element":
        return dict.fromkeys(engine.elements, "")
    if subject == "attribute":
        places = engine.elements.get(prefix["tag"], {}).values()
        return {attribute: "" for attributes in places for attribute in attributes}
    functions = {name: function.text for name, function in engine.functions.items()}
    words = sorted(name for name in engine.words if name.lower().startswith("mj"))
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


def _find_field_names(library: Library, place: FieldPlace) -> Mapping[str, str]:
    quote = "" if place.span.path.endswith(".toml") else '"'
    match place.key:
        case "":
            missing = {n: field for n, field in place.fields.items() if n not in place.keys}
            return {
                f"{quote}{name}{quote}": field_description(field.type)
                for name, field in missing.items()
            }
        case "rule":
            warnings = (rule for rule in RULES.values() if rule.severity == "warning")
            return {f'"{rule.name}"': rule.summary for rule in warnings}
        case "prerequisites":
            return {f'"{lesson.id}"': lesson.title for lesson in library.lessons.values()}
        case _:
            return dict.fromkeys(possible_values(place.field.type) if place.field else (), "")
