"""Headings: the attributes after them, and the anchors of a document.

Entry points: `read_attributes` (`## Title {#id .class}`), `Anchors` (unique ids), `slug`,
`check_heading`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from unicodedata import normalize

from msgspec import Struct, field

from coursebuild.core.model import Image, Inline, plain_text, walk_inlines
from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.core.text.source import Excerpt, Span

_CANDIDATE = re.compile(r"(?:^|(?<=[ \t]))\{[ \t]*[#.][^{}]*(\}?)[ \t]*$")
_ID = re.compile(r"#[\w:.-]*[\w:-]|#\w")
_WORD = re.compile(r"\S+")
_CLASS = re.compile(r"\.[A-Za-z_][\w-]*")
_NO_SLUG = re.compile(r"[^\w\s-]")
_SPACES = re.compile(r"\s")
_HELP = (
    "write `{#id}`, `{.class}` or `{#id .class}`, "
    "of letters, digits, `-` and `_`, and in an id also `:` and `.`"
)


class Attributes(Struct, frozen=True):
    """What stands in braces after a heading, and the heading's text before it."""

    title: Excerpt
    id: Excerpt | None = None
    """With its `#`."""
    classes: tuple[str, ...] = ()


def read_attributes(content: Excerpt) -> Parsed[Attributes]:
    """Split a heading's content into its text and its attributes."""
    found = _CANDIDATE.search(content.text) if "{" in content.text else None
    if found is None:
        return Parsed(Attributes(content))
    title, braces = trim(content.slice(0, found.start())), trim(content.slice(found.start()))
    if not found[1]:
        return _mistake(title, braces, "the attributes of this heading are never closed")
    name, classes, inner = None, list[str](), braces.slice(1, len(braces.text) - 1)
    for word in (inner.slice(*found.span()) for found in _WORD.finditer(inner.text)):
        if _ID.fullmatch(word.text) and name is None:
            name = word
        elif _CLASS.fullmatch(word.text):
            classes.append(word.text[1:])
        elif word.text.startswith("#") and name is not None:
            return _mistake(title, word, "a heading has one id")
        else:
            return _mistake(title, word, f"`{word.text}` is neither an id nor a class")
    return Parsed(Attributes(title, name, tuple(classes)))


def _mistake(title: Excerpt, place: Excerpt, message: str) -> Parsed[Attributes]:
    wrong = diagnose("heading-attributes", place.span(), message, help=_HELP)
    return Parsed(Attributes(title), (wrong,))


def slug(text: str) -> str:
    """The anchor of a text: letters and digits of any script in lower case, hyphens for spaces."""
    return _words(text) or "section"


def _words(text: str) -> str:
    return _SPACES.sub("-", _NO_SLUG.sub("", text.strip().lower())).strip("-")


def term_id(name: str) -> str:
    """The id of a term, by which links call it; empty for a name without letters and digits."""
    return _words(normalize("NFC", name))


class Anchors(Struct):
    """The anchors of a document. Explicit ids are known before the first heading is named."""

    report: Callable[[Diagnostic], None]
    explicit: dict[str, Span | None] = field(default_factory=dict)
    """Each explicit id; the span of the heading that took it, once one has."""
    taken: set[str] = field(default_factory=set)
    """Ids that headings got from their text."""
    counts: dict[str, int] = field(default_factory=dict)
    """How far each text's ids are numbered."""

    def reserve(self, name: str) -> None:
        """Keep an id for the heading that asks for it."""
        self.explicit.setdefault(name, None)

    def take(self, name: str, span: Span) -> None:
        """Use an explicit id."""
        first = self.explicit.get(name)
        if first is not None or name in self.taken:
            notes = [Note("first used here", first)] if first is not None else []
            self.report(
                diagnose("anchor-repeated", span, f"the id `{name}` is already used", notes=notes)
            )
        else:
            self.explicit[name] = span

    def has(self, name: str) -> bool:
        """Whether a heading or a formula has an id, or asks for it."""
        return name in self.explicit or name in self.taken

    def make(self, text: str) -> str:
        """The anchor of a heading without an id."""
        base = name = slug(text)
        count = self.counts.get(base, 1)
        while self.has(name):
            count += 1
            name = f"{base}-{count}"
        self.counts[base] = count
        self.taken.add(name)
        return name


def check_heading(
    span: Span, level: int, above: int | None, children: tuple[Inline, ...], *, lesson: bool
) -> list[Diagnostic]:
    """What is wrong with a heading; `above` is the level before it, where that counts."""
    found: list[Diagnostic] = []
    if not plain_text(children).strip() and not any(
        isinstance(inline, Image) for inline in walk_inlines(children)
    ):
        found.append(diagnose("heading-empty", span, "the heading has no text"))
    if lesson and level == 1:
        help = "the title comes from the course map; begin with `## `"
        message = "a lesson has no heading of level 1"
        found.append(diagnose("heading-top", span, message, help=help))
    if above is not None and level > above + 1:
        message = f"a heading of level {level} follows one of level {above}"
        if lesson and above == 1:
            message = f"a heading of level {level} stands before any of level 2"
        found.append(diagnose("heading-skip", span, message))
    return found
