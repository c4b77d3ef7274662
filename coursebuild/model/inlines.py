"""Inlines: what stands in a paragraph, a heading, a cell.

Entry point: the union `Inline`; `plain_text(inlines)`.
"""

from __future__ import annotations

from typing import TypeAlias

from coursebuild.source import Excerpt, Span
from coursebuild.values import dataclass


@dataclass(frozen=True, slots=True)
class Text:
    """Plain text, entities decoded."""

    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Emphasis:
    """`*text*`."""

    span: Span
    children: tuple[Inline, ...]


@dataclass(frozen=True, slots=True)
class Strong:
    """`**text**`."""

    span: Span
    children: tuple[Inline, ...]


@dataclass(frozen=True, slots=True)
class Strikethrough:
    """`~~text~~`."""

    span: Span
    children: tuple[Inline, ...]


@dataclass(frozen=True, slots=True)
class CodeSpan:
    """Inline code."""

    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class NumberBinding:
    """`` `+6.6 %`{out} ``: a number that must be one the script printed."""

    span: Span
    text: str
    text_span: Span
    """What stands between the backticks."""
    script: str | None
    """The path given by `{out=…}`; `None`: the script of the nearest recorded output above."""


@dataclass(frozen=True, slots=True)
class Label:
    """`{#eq:euler}` after a formula on a line of its own: its id, colon included."""

    span: Span
    id: str


@dataclass(frozen=True, slots=True)
class Meaning:
    """`{symbol="angular velocity" unit="rad/s"}` after a formula: what the symbol stands for."""

    span: Span
    text: str
    unit: str
    """Empty where none is given."""


@dataclass(frozen=True, slots=True)
class Math:
    """A formula; `display` for `$$…$$`."""

    span: Span
    tex: Excerpt
    display: bool
    label: Label | None = None
    """Only where it is on a line of its own."""
    meaning: Meaning | None = None
    """Only where it is not."""


@dataclass(frozen=True, slots=True)
class Term:
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


@dataclass(frozen=True, slots=True)
class LessonTarget:
    """`lesson:4.3#anchor`."""

    id: str
    anchor: str | None


@dataclass(frozen=True, slots=True)
class LevelTarget:
    """A mention such as "Level 18"; there is no scheme for it in a link."""

    id: str


@dataclass(frozen=True, slots=True)
class ModelTarget:
    """`model:tumbling_box#measured`."""

    name: str
    anchor: str | None = None


@dataclass(frozen=True, slots=True)
class PageTarget:
    """`page:about#anchor`."""

    id: str
    anchor: str | None


@dataclass(frozen=True, slots=True)
class ExampleTarget:
    """`examples/x.py`: a script of the course."""

    path: str


@dataclass(frozen=True, slots=True)
class UrlTarget:
    """Anything else: an address elsewhere, `#anchor` on this page, or a relative file."""

    url: str


@dataclass(frozen=True, slots=True)
class TermTarget:
    """`term:inertia-tensor`."""

    id: str


Target: TypeAlias = (
    LessonTarget | LevelTarget | ModelTarget | PageTarget | ExampleTarget | TermTarget | UrlTarget
)


@dataclass(frozen=True, slots=True)
class Link:
    """A link; `mention` when it is a "Lesson 2.2" or "Level 18" that became a link by itself."""

    span: Span
    target: Target
    target_span: Span
    """Where the destination is written (the whole link where that is not known)."""
    title: str
    children: tuple[Inline, ...]
    mention: bool = False


@dataclass(frozen=True, slots=True)
class Image:
    """An image; `url` as written."""

    span: Span
    url: str
    alt: str
    title: str
    url_span: Span
    """Where the address is written: in the image, or in the definition that it names."""


@dataclass(frozen=True, slots=True)
class RawInline:
    """Inline HTML, kept."""

    span: Span
    html: str


@dataclass(frozen=True, slots=True)
class SoftBreak:
    """A line end inside a paragraph."""

    span: Span


@dataclass(frozen=True, slots=True)
class HardBreak:
    """A forced line break."""

    span: Span


@dataclass(frozen=True, slots=True)
class FootnoteRef:
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
