"""Inlines: what stands in a paragraph, a heading, a cell.

Entry points: the union `Inline`; `plain_text`, `without_links`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.text.source import Excerpt, Span


class Text(Struct, frozen=True):
    """Plain text, entities decoded."""

    span: Span
    text: str


class Emphasis(Struct, frozen=True):
    """`*text*`."""

    span: Span
    children: tuple[Inline, ...]


class Strong(Struct, frozen=True):
    """`**text**`."""

    span: Span
    children: tuple[Inline, ...]


class Strikethrough(Struct, frozen=True):
    """`~~text~~`."""

    span: Span
    children: tuple[Inline, ...]


class CodeSpan(Struct, frozen=True):
    """Inline code."""

    span: Span
    text: str


class NumberBinding(Struct, frozen=True):
    """`` `+6.6 %`{out} ``: a number that must be one the script printed, or one that is given."""

    span: Span
    text: str
    text_span: Span
    """What stands between the backticks."""
    script: str | None
    """The path given by `{out=…}`; `None`: the script of the nearest recorded output above."""
    source: str | None = None
    """Where it is from, by `{given="…"}`, perhaps empty; `None` where a script has printed it."""


class Label(Struct, frozen=True):
    """`{#eq:euler}` after a formula on a line of its own: its id, colon included."""

    span: Span
    id: str
    source: str | None = None
    """Where its numbers are from, by `given="…"`, perhaps empty; `None` where nobody says it."""
    check: Span | None = None
    """Where `check` asks that it be proven."""


class Meaning(Struct, frozen=True):
    """`{symbol="angular velocity" unit="rad/s"}` after a formula: what the symbol stands for."""

    span: Span
    text: str
    unit: str
    """Empty where none is given."""


class Math(Struct, frozen=True):
    """A formula; `display` for `$$…$$`."""

    span: Span
    tex: Excerpt
    display: bool
    label: Label | None = None
    """Only where it is on a line of its own."""
    meaning: Meaning | None = None
    """Only where it is not."""
    source: str | None = None
    """The same: where its numbers are from, as in `NumberBinding`."""


class Term(Struct, frozen=True):
    """`[inertia tensor]{term}`: where the text says what a term means."""

    span: Span
    children: tuple[Inline, ...]
    name: str
    """As the glossary calls it."""
    id: str
    """Its name in links: `term:inertia-tensor`."""
    renamed: bool
    """Whether the name is given, by `{term="…"}`, and not the text itself."""

    @property
    def anchor(self) -> str:
        """The id of the place on its page; no heading's has a colon but an explicit one."""
        return f"term:{self.id}"


class LessonTarget(Struct, frozen=True):
    """`lesson:4.3#anchor`."""

    id: str
    anchor: str | None


class LevelTarget(Struct, frozen=True):
    """A mention such as "Level 18"; there is no scheme for it in a link."""

    id: str


class ModelTarget(Struct, frozen=True):
    """`model:tumbling_box#measured`."""

    name: str
    anchor: str | None = None


class PageTarget(Struct, frozen=True):
    """`page:about#anchor`."""

    id: str
    anchor: str | None


class ExampleTarget(Struct, frozen=True):
    """`examples/x.py`: a script of the course."""

    path: str


class UrlTarget(Struct, frozen=True):
    """Anything else: an address elsewhere, `#anchor` on this page, or a relative file."""

    url: str


class TermTarget(Struct, frozen=True):
    """`term:inertia-tensor`."""

    id: str


Target: TypeAlias = (
    LessonTarget | LevelTarget | ModelTarget | PageTarget | ExampleTarget | TermTarget | UrlTarget
)


class Link(Struct, frozen=True):
    """A link; `mention` when it is a "Lesson 2.2" or "Level 18" that became a link by itself."""

    span: Span
    target: Target
    target_span: Span
    """Where the destination is written (the whole link where that is not known)."""
    title: str
    children: tuple[Inline, ...]
    mention: bool = False


class Image(Struct, frozen=True):
    """An image; `url` as written."""

    span: Span
    url: str
    alt: str
    title: str
    url_span: Span
    """Where the address is written: in the image, or in the definition that it names."""


class MediaAddress(Struct, frozen=True):
    """Where raw HTML names a file that a page shows: a picture, a video, a frame."""

    start: int
    """In the HTML, as is `end`."""
    end: int
    url: str
    span: Span


class ForbiddenHtml(Struct, frozen=True):
    """What a page must not hold of raw HTML, unless the course trusts all who write it."""

    span: Span
    message: str


class RawInline(Struct, frozen=True):
    """Inline HTML, kept."""

    span: Span
    html: str
    media: tuple[MediaAddress, ...] = ()
    forbidden: tuple[ForbiddenHtml, ...] = ()


class SoftBreak(Struct, frozen=True):
    """A line end inside a paragraph."""

    span: Span


class HardBreak(Struct, frozen=True):
    """A forced line break."""

    span: Span


class FootnoteRef(Struct, frozen=True):
    """`[^label]`.

    `number` is its place in the order of first reference, `occurrence` counts references to it,
    both from 1.
    """

    span: Span
    label: str
    number: int
    occurrence: int


Inline: TypeAlias = (
    Text
    | Emphasis
    | Strong
    | Strikethrough
    | CodeSpan
    | NumberBinding
    | Math
    | Term
    | Link
    | Image
    | RawInline
    | SoftBreak
    | HardBreak
    | FootnoteRef
)


def plain_text(inlines: tuple[Inline, ...]) -> str:
    """The text of inlines without marks, formulas as their TeX; for titles and anchors."""
    parts: list[str] = []
    for inline in inlines:
        match inline:
            case Text() | CodeSpan() | NumberBinding():
                parts.append(inline.text)
            case Math():
                parts.append(inline.tex.text)
            case Emphasis() | Strong() | Strikethrough() | Link() | Term():
                parts.append(plain_text(inline.children))
            case Image():
                parts.append(inline.alt)
            case SoftBreak() | HardBreak():
                parts.append(" ")
            case _:
                pass
    return "".join(parts)


def without_links(
    inlines: tuple[Inline, ...], reference: Callable[[Target], str] = lambda target: ""
) -> tuple[Inline, ...]:
    """Inlines as they may stand inside a link, or on another page than their own.

    Without links, terms, footnotes, raw HTML and pictures, in one line. `reference` gives what
    stands for a link without a text.
    """
    kept: list[Inline] = []
    for inline in inlines:
        match inline:
            case Link(children=()):
                kept.append(Text(inline.span, reference(inline.target)))
            case Link() | Term():
                kept += without_links(inline.children, reference)
            case Emphasis() | Strong() | Strikethrough():
                kept.append(type(inline)(inline.span, without_links(inline.children, reference)))
            case Image():
                kept.append(Text(inline.span, inline.alt))
            case SoftBreak() | HardBreak():
                kept.append(Text(inline.span, " "))
            case RawInline() | FootnoteRef():
                pass
            case _:
                kept.append(inline)
    return tuple(kept)
