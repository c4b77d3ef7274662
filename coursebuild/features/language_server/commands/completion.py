"""What may be written at a place.

Entry point: `completions`. What there is comes from where checks look it up: the course, anchors,
the declarations of fields, the catalogue of rules, the engine.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from lsprotocol.types import CompletionItemKind as Kind
from msgspec import Struct

from coursebuild.core.checks.links import anchors
from coursebuild.core.pages.library import Library
from coursebuild.core.registry import CORE_FENCES, fence_names
from coursebuild.core.syntax.decode import description
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


class Proposal(NamedTuple):
    """Something that may be written."""

    text: str
    detail: str
    """What it is, in a line."""
    kind: Kind = Kind.Reference


class _Asked(Struct, frozen=True):
    """Where something is to be written, and what stands before it."""

    texts: OpenTexts
    library: Library
    source: Source
    offset: int
    found: re.Match[str]


def completions(texts: OpenTexts, source: Source, offset: int) -> tuple[Span, list[Proposal]]:
    """What may be written in the place of a span; the client leaves out what does not fit."""
    library, here = texts.library, source.span(offset, offset)
    if library is None:
        return here, []
    line = source.text[source.line_starts[source.position(offset)[0] - 1] : offset]
    for pattern, propose in _PLACES:
        found = re.search(pattern, line)
        if found is not None:
            proposals = list(propose(_Asked(texts, library, source, offset, found)))
            if proposals:
                return source.span(offset - len(found["word"]), offset), proposals
    place = field_place(source, offset)
    return (here, []) if place is None else (place.span, list(_fields(library, place)))


# --- in Markdown and code


def _lessons(asked: _Asked) -> Iterator[Proposal]:
    return (Proposal(one.id, one.title) for one in asked.library.lessons.values())


def _pages(asked: _Asked) -> Iterator[Proposal]:
    return (Proposal(one.id, one.title) for one in asked.library.pages.values())


def _models(asked: _Asked) -> Iterator[Proposal]:
    return (Proposal(one.name, one.about, Kind.File) for one in asked.library.course.models)


def _terms(asked: _Asked) -> Iterator[Proposal]:
    return (Proposal(id, f"of {one.id}: {one.title}") for id, one in asked.library.terms.items())


def _scripts(asked: _Asked) -> Iterator[Proposal]:
    for path, (_, one) in asked.library.scripts.items():
        yield Proposal(path, f"of {one.id}: {one.title}", Kind.File)


def _callouts(asked: _Asked) -> Iterator[Proposal]:
    promise = asked.library.callout_promise
    return (Proposal(name, promise(name), Kind.EnumMember) for name in asked.library.callouts)


def _fences(asked: _Asked) -> Iterator[Proposal]:
    if fence_at(asked.source, asked.offset) is None:
        yield from (Proposal(name, "", Kind.Keyword) for name in (*CORE_FENCES, *fence_names()))


def _anchors(asked: _Asked) -> Iterator[Proposal]:
    """Those of the lesson or page that is named before, or of this one."""
    library, id = asked.library, asked.found["id"]
    owner = library.lessons.get(id) if asked.found["kind"] == "lesson" else library.pages.get(id)
    source = asked.source if id is None else owner and asked.texts.source(owner.path)
    document = source and asked.texts.document(source)
    for name, place in anchors(document).items() if document else ():
        yield Proposal(name, place.first_line().text.lstrip("# "))


def _members(asked: _Asked) -> Iterator[Proposal]:
    _, code = fence_at(asked.source, asked.offset) or ("", asked.source.span(0, 0))
    known = members(tuple(asked.found["path"].split(".")), code.text)
    return (Proposal(name, one.doc, Kind.Field) for name, one in known.items())


_NAME = r"[A-Za-z_]\w*"
_PLACES: tuple[tuple[str, Callable[[_Asked], Iterator[Proposal]]], ...] = (
    (r"(?:\blesson:|\bLessons? )(?P<word>[\w.]*)$", _lessons),
    (r"\bpage:(?P<word>[\w-]*)$", _pages),
    (r"\bmodel:(?P<word>[\w/-]*)$", _models),
    (r"""(?:model_path\(|"model"\s*:\s*)["'](?P<word>[\w/-]*)$""", _models),
    (r"\bterm:(?P<word>[\w-]*)$", _terms),
    (r"(?:\]\(|\{out=)(?P<word>e?[\w./-]*)$", _scripts),
    (r"\]\((?:(?P<kind>lesson|page):(?P<id>[\w.-]+))?#(?P<word>[\w.:-]*)$", _anchors),
    (r"^[ \t>]*>[ ]*\[!(?P<word>[\w-]*)$", _callouts),
    (r"^[ \t>]*```[ ]*(?P<word>[\w-]*)$", _fences),
    (rf"(?<![\w.])(?P<path>{_NAME}(?:\.{_NAME})*)\.(?P<word>\w*)$", _members),
)
"""What is proposed behind what; `word` is written of it already."""


# --- in JSON and TOML


def _fields(library: Library, place: FieldPlace) -> Iterator[Proposal]:
    """Keys that are not given yet, or the values that are known of one."""
    if not place.key:
        quote = "" if place.span.path.endswith(".toml") else '"'
        for name, field in place.fields.items():
            if name not in place.given:
                yield Proposal(f"{quote}{name}{quote}", description(field), Kind.Property)
    elif place.key == "rule":
        warnings = (rule for rule in RULES.values() if rule.severity == "warning")
        yield from (Proposal(f'"{one.name}"', one.summary, Kind.EnumMember) for one in warnings)
    elif place.key == "prerequisites":
        yield from (Proposal(f'"{one.id}"', one.title) for one in library.lessons.values())
    elif place.field is not None:
        yield from (Proposal(one, "", Kind.Value) for one in known_values(place.field.type))
