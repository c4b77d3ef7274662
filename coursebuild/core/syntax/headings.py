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
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, misspelt
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
    """The attributes in braces after a heading, and the heading's text before them."""

    title: Excerpt
    id: Excerpt | None = None
    """With its `#`."""
    classes: tuple[str, ...] = ()


def read_attributes(content: Excerpt) -> Parsed[Attributes]:
    """Split a heading's content into its text and its attributes."""
    match = _CANDIDATE.search(content.text) if "{" in content.text else None
    if match is None:
        return Parsed(Attributes(content))
    title, braces = trim(content.slice(0, match.start())), trim(content.slice(match.start()))
    if not match[1]:
        return _reject(title, braces, "the attributes of this heading are never closed")
    name, classes, inner = None, list[str](), braces.slice(1, len(braces.text) - 1)
    for word in (inner.slice(*match.span()) for match in _WORD.finditer(inner.text)):
        if _ID.fullmatch(word.text) and name is None:
            name = word
        elif misspelt(word.text, [".further"]):
            return _reject(title, word, f"no class `{word.text}`", "did you mean `.further`?")
        elif _CLASS.fullmatch(word.text):
            classes.append(word.text[1:])
        elif word.text.startswith("#") and name is not None:
            return _reject(title, word, "a heading has one id")
        else:
            return _reject(title, word, f"`{word.text}` is neither an id nor a class")
    return Parsed(Attributes(title, name, tuple(classes)))


def _reject(title: Excerpt, place: Excerpt, message: str, help: str = _HELP) -> Parsed[Attributes]:
    """A heading without attributes, as those that it has are wrong at `place`."""
    diagnostic = diagnose("heading-attributes", place.span(), message, help=help)
    return Parsed(Attributes(title), (diagnostic,))


def slug(text: str) -> str:
    """The anchor of a text: letters and digits of any script in lower case, hyphens for spaces."""
    return _join_words(text) or "section"


def _join_words(text: str) -> str:
    return _SPACES.sub("-", _NO_SLUG.sub("", text.strip().lower())).strip("-")


def term_id(name: str) -> str:
    """The id of a term in links; empty for a name without letters and digits."""
    return _join_words(normalize("NFC", name))


class Anchors(Struct):
    """The anchors of a document. Explicit ids are known before the first heading is named."""

    report: Callable[[Diagnostic], None]
    explicit: dict[str, Span | None] = field(default_factory=dict)
    """Each explicit id, with the span of the heading or formula that uses it, once it was read."""
    generated: set[str] = field(default_factory=set)
    """Ids made of the texts of headings."""
    counts: dict[str, int] = field(default_factory=dict)
    """The last number given to ids made of the same text."""

    def reserve(self, name: str) -> None:
        """Keep an id for the heading that asks for it."""
        self.explicit.setdefault(name, None)

    def take(self, name: str, span: Span) -> None:
        """Use an explicit id."""
        first = self.explicit.get(name)
        if first is not None or name in self.generated:
            notes = [Note("first used here", first)] if first is not None else []
            self.report(
                diagnose("anchor-repeated", span, f"the id `{name}` is already used", notes=notes)
            )
        else:
            self.explicit[name] = span

    def has(self, name: str) -> bool:
        """Whether a heading or a formula has an id, or asks for it."""
        return name in self.explicit or name in self.generated

    def make(self, text: str) -> str:
        """The anchor of a heading without an id."""
        base = name = slug(text)
        count = self.counts.get(base, 1)
        while self.has(name):
            count += 1
            name = f"{base}-{count}"
        self.counts[base] = count
        self.generated.add(name)
        return name


def check_heading(
    span: Span, level: int, previous: int | None, children: tuple[Inline, ...], *, lesson: bool
) -> list[Diagnostic]:
    """Check a heading; `previous` is the level of the heading before it, if it must fit to that."""
    diagnostics: list[Diagnostic] = []
    if not plain_text(children).strip() and not any(
        isinstance(inline, Image) for inline in walk_inlines(children)
    ):
        diagnostics.append(diagnose("heading-empty", span, "the heading has no text"))
    if re.match(r"#+[^\W\d_]", plain_text(children)):
        message, help = "a `#` would be shown before the title", "write all `#` before the blank"
        diagnostics.append(diagnose("markup-unread", span.first_line(), message, help=help))
    before = span.source.text[: span.start].rstrip().rpartition("\n")[2]
    if before == "---" and re.fullmatch(r"[a-z][\w-]*: .*\n-+", span.text.strip(), re.DOTALL):
        message, help = "front matter stands in the text, which would show it", "delete it"
        diagnostics.append(diagnose("front-matter", span.first_line(), message, help=help))
    if lesson and level == 1:
        help = "the title comes from the course map; begin with `## `"
        if span.text.rstrip().endswith("\n======="):
            help = "a merge conflict may have left the line of `=` behind: delete it"
        message = "a lesson has no heading of level 1"
        diagnostics.append(diagnose("heading-top", span, message, help=help))
    elif level == 1 and previous is not None and previous > 1:
        message, help = "a heading of level 1 stands below others", "begin it with `## `"
        diagnostics.append(diagnose("heading-top", span, message, help=help))
    if previous is not None and level > previous + 1:
        message = f"a heading of level {level} follows one of level {previous}"
        if lesson and previous == 1:
            message = f"a heading of level {level} comes before any of level 2"
        diagnostics.append(diagnose("heading-skip", span, message))
    return diagnostics
