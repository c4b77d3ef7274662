"""What may be written at a place.

Entry point: `completions`. What there is comes from where checks look it up: the course, anchors,
the declarations of fields, the catalogue of rules, the engine.
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
from coursebuild.features.language_server.commands.engine import members
from coursebuild.features.language_server.commands.fields import (
    FieldPlace,
    fence_at,
    field_place,
    known_values,
)
from coursebuild.features.language_server.commands.texts import OpenTexts

_NAME = r"[A-Za-z_]\w*"
_PLACES = (
    ("lesson", Kind.Reference, r"(?:\blesson:|\bLessons? )(?P<word>[\w.]*)$"),
    ("page", Kind.Reference, r"\bpage:(?P<word>[\w-]*)$"),
    ("model", Kind.File, r"\bmodel:(?P<word>[\w/-]*)$"),
    ("model", Kind.File, r"""(?:model_path\(|"model"\s*:\s*)["'](?P<word>[\w/-]*)$"""),
    ("term", Kind.Reference, r"\bterm:(?P<word>[\w-]*)$"),
    ("script", Kind.File, r"(?:\]\(|\{out=)(?P<word>e?[\w./-]*)$"),
    ("callout", Kind.EnumMember, r"^[ \t>]*>[ ]*\[!(?P<word>[\w-]*)$"),
    ("fence", Kind.Keyword, r"^[ \t>]*```[ ]*(?P<word>[\w-]*)$"),
    (
        "anchor",
        Kind.Reference,
        r"\]\((?:(?P<kind>lesson|page):(?P<id>[\w.-]+))?#(?P<word>[\w.:-]*)$",
    ),
    ("member", Kind.Field, rf"(?<![\w.])(?P<path>{_NAME}(?:\.{_NAME})*)\.(?P<word>\w*)$"),
)
"""What may be written behind what; `word` is written of it already."""


def completions(
    texts: OpenTexts, source: Source, asked: types.CompletionParams
) -> list[types.CompletionItem]:
    """What may be written; the client leaves out what does not fit."""
    offset = texts.places.offset(source, asked.position)
    here = source.span(offset, offset)
    line = source.text[source.line_starts[here.line - 1] : offset]
    for what, kind, pattern in _PLACES:
        found = re.search(pattern, line)
        names = {} if found is None else _names(texts, here, what, found)
        if found is not None and names:
            return _items(texts, source.span(offset - len(found["word"]), offset), kind, names)
    place = field_place(source, offset)
    if place is None:
        return []
    kind = Kind.Value if place.key else Kind.Property
    return _items(texts, place.span, kind, _fields(texts.library, place))


def _items(
    texts: OpenTexts, span: Span, kind: Kind, names: Mapping[str, str]
) -> list[types.CompletionItem]:
    """What may be written in the place of a span, and what it is, in a line."""
    there = texts.places.range(span)
    return [
        types.CompletionItem(
            name.strip('"'),
            kind=kind,
            detail=detail,
            filter_text=name,
            text_edit=types.TextEdit(there, name),
        )
        for name, detail in names.items()
    ]


def _names(texts: OpenTexts, here: Span, what: str, found: re.Match[str]) -> Mapping[str, str]:
    library = texts.library
    match what:
        case "lesson":
            return {one.id: one.title for one in library.lessons.values()}
        case "page":
            return {one.id: one.title for one in library.pages.values()}
        case "model":
            return {one.name: one.description for one in library.course.models}
        case "term":
            return {id: f"of {one.id}: {one.title}" for id, one in library.terms.items()}
        case "script":
            scripts = library.scripts.items()
            return {path: f"of {one.id}: {one.title}" for path, (_, one) in scripts}
        case "callout":
            return {name: library.callout(name).promise for name in library.callouts}
        case "fence":
            outside = fence_at(here.source, here.start) is None
            return dict.fromkeys((*CORE_FENCES, *fence_names()), "") if outside else {}
        case "anchor":
            return _anchors(texts, here.source, found)
        case _:
            _, code = fence_at(here.source, here.start) or ("", here)
            known = members(tuple(found["path"].split(".")), code.text)
            return {name: one.doc for name, one in known.items()}


def _anchors(texts: OpenTexts, source: Source, found: re.Match[str]) -> Mapping[str, str]:
    """Those of the lesson or page that is named before, or of this one."""
    library, id = texts.library, found["id"]
    if id is not None:
        owner = library.lessons.get(id) if found["kind"] == "lesson" else library.pages.get(id)
        source = texts.source("" if owner is None else owner.path)
    document = texts.document(source)
    known = {} if document is None else anchors(document)
    return {name: place.first_line().text.lstrip("# ") for name, place in known.items()}


def _fields(library: Library, place: FieldPlace) -> Mapping[str, str]:
    """Keys of JSON or TOML that are not given yet, or the values that are known of one."""
    quote = "" if place.span.path.endswith(".toml") else '"'
    match place.key:
        case "":
            missing = {n: one for n, one in place.fields.items() if n not in place.given}
            return {f"{quote}{n}{quote}": field_description(f.type) for n, f in missing.items()}
        case "rule":
            warnings = (rule for rule in RULES.values() if rule.severity == "warning")
            return {f'"{one.name}"': one.summary for one in warnings}
        case "prerequisites":
            return {f'"{one.id}"': one.title for one in library.lessons.values()}
        case _:
            return dict.fromkeys(known_values(place.field.type) if place.field else (), "")
