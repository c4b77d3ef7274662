"""Inlines: the content of a paragraph, a heading or a cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.text.source import Excerpt, Span


class Located(Struct, frozen=True):
    """What stands somewhere in a source."""

    span: Span


class Parent(Located, frozen=True):
    """An inline around others."""

    children: tuple[Inline, ...]


class RawHtml(Located, frozen=True):
    """HTML as its author wrote it."""

    html: str
    media: tuple[MediaAddress, ...] = ()
    forbidden: tuple[ForbiddenHtml, ...] = ()


class Text(Located, frozen=True):
    """Plain text, entities decoded."""

    text: str


class Emphasis(Parent, frozen=True):
    """`*text*`."""


class Strong(Parent, frozen=True):
    """`**text**`."""


class Strikethrough(Parent, frozen=True):
    """`~~text~~`."""


class CodeSpan(Located, frozen=True):
    """Inline code."""

    text: str
    literal: bool = False
    """Whether `{code}` after it says that it names nothing."""


class NumberBinding(Located, frozen=True):
    """`` `+6.6 %`{out} ``: a number that a script must have printed, or one with a source."""

    text: str
    text_span: Span
    script: str | None
    """The path given by `{out=…}`; `None`: the script of the nearest recorded output above."""
    source: str | None = None
    """Its source from `{given="…"}`, empty for a symbol's value without one; `None` where a script
    has printed it."""
    unit: str = ""
    """That of a symbol whose value it is, or of a field that says it for a number in JSON."""
    comma: bool = False
    """Whether a comma may stand before its decimals, as in the language of the text."""
    words: str = ""
    """Those of `{out="words"}`, printed right before it; empty where it has only one place."""
    in_string: bool = False
    """Whether it is in a string of a data text, where a quotation mark is behind a backslash."""

    @property
    def is_in_formula(self) -> bool:
        r"""Whether `\out{words}{…}` binds it, which is its span."""
        return "out{" in self.span.source.text[self.span.start : self.text_span.start]

    def mark(self, script: str = "", words: str = "") -> str:
        """What an author writes to bind it to a script, or to words that are printed."""
        if self.is_in_formula:
            return f"\\out{{{' '.join(filter(None, (script, words)))}}}"
        quoted_words = f'"{words}"' if words else ""
        return f"{{out={' '.join(filter(None, (script, quoted_words)))}}}"


class SourceMark(Located, frozen=True):
    """`{given="models/x.xml"}` behind a paragraph, or below one, a list or a table.

    It is the source of all numbers in it that have no mark of their own.
    """

    source: str


LABEL_KINDS = {
    "eq": "a formula",
    "fig": "a figure",
    "tab": "a table",
    "lst": "a listing",
    "lab": "a lab",
}
"""What can have a label, by the prefix of the label's id."""


class Label(Located, frozen=True):
    """`{#eq:euler}` after a formula on a line of its own, `{#fig:flip}` at the end of a caption."""

    id: str
    """With its prefix and colon."""
    source: str | None = None
    """The source of its numbers from `given="…"`."""
    domain: Excerpt | None = None
    """The conditions of `check="x > 0"`, perhaps empty, under which an identity is tried; `None`
    where `check` does not stand."""

    @property
    def conditions(self) -> str | None:
        """The domain in TeX."""
        if self.domain is None:
            return None
        return self.domain.text.replace(">=", r"\ge ").replace("<=", r"\le ").strip()


IDENTITY_POINTS = 32
"""At so many points is an identity tried, as its page says."""


class Meaning(Located, frozen=True):
    """`{symbol="angular velocity" unit="rad/s"}` after a formula: what the symbol stands for."""

    text: str
    unit: str


class Math(Located, frozen=True):
    """A formula; `display` for `$$…$$`."""

    tex: Excerpt
    display: bool
    label: Label | None = None
    """Only where it is on a line of its own."""
    meaning: Meaning | None = None
    """Only where it is not."""
    source: str | None = None
    """Likewise: the source of its numbers, as in `NumberBinding`."""
    value: NumberBinding | None = None
    """What `value=…` says that the symbol is worth, or the number that ends it and is bound."""
    numbers: tuple[NumberBinding, ...] = ()
    r"""Those that `\out{…}{…}` binds in it."""


class Term(Parent, frozen=True):
    """`[inertia tensor]{term}`: where the text explains a term."""

    name: str
    id: str
    """Its name in links, such as `inertia-tensor`."""
    renamed: bool
    """Whether the name is given, by `{term="…"}`, and not the text itself."""

    @property
    def anchor(self) -> str:
        """The id of the place on its page; of headings only explicit ids have a colon."""
        return f"term:{self.id}"


class LessonTarget(Struct, frozen=True):
    """`lesson:4.3#anchor`."""

    id: str
    anchor: str | None


class LevelTarget(Struct, frozen=True):
    """A mention such as "Level 18"; links have no scheme for it."""

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
    """Any other address: of another site, `#anchor` on this page, or a relative file."""

    url: str


class TermTarget(Struct, frozen=True):
    """`term:inertia-tensor`."""

    id: str


Target: TypeAlias = (
    LessonTarget | LevelTarget | ModelTarget | PageTarget | ExampleTarget | TermTarget | UrlTarget
)


class Link(Located, frozen=True):
    """A link; a `mention` is a "Lesson 2.2" or "Level 18" in prose that became one."""

    target: Target
    target_span: Span
    """Where the destination is written, or the whole link where that is not known."""
    title: str
    children: tuple[Inline, ...]
    mention: bool = False
    bare: bool = False
    """Whether its author gave it no text, so that it shows the number of what it leads to."""
    lesson_in_text: str = ""
    """The id of the lesson that its text names, as `Lesson 1.2`."""


class Image(Located, frozen=True):
    """An image; `url` as written."""

    url: str
    alt: str
    title: str
    url_span: Span
    """Where the address is written: in the image, or in the definition that it names."""
    numbers: tuple[NumberBinding, ...] = ()
    """Those of its alternative text."""


class MediaAddress(Struct, frozen=True):
    """The address of a file in raw HTML that a page shows: a picture, a video, a frame."""

    start: int
    """The offset in the HTML, as is `end`."""
    end: int
    url: str
    span: Span


class ForbiddenHtml(Located, frozen=True):
    """Raw HTML that a page must not hold, unless the course trusts all of its authors."""

    message: str


class RawInline(RawHtml, frozen=True):
    """Raw inline HTML."""


class SoftBreak(Located, frozen=True):
    """A line end inside a paragraph."""


class HardBreak(Located, frozen=True):
    """A forced line break."""


class FootnoteRef(Located, frozen=True):
    """`[^label]`, with its place in the order of first reference and its own among them, from 1."""

    label: str
    number: int
    occurrence: int


class CitedWork(Struct, frozen=True):
    """`see @euler1758, p. 12` in a citation."""

    span: Span
    key: str
    before: str
    """What stands before it: `see`."""
    locator: str
    """The place in the work, or other words after it."""


class Citation(Located, frozen=True):
    """`[@euler1758, p. 12; @lagrange1788]`: sources in `content/references.bib`."""

    works: tuple[CitedWork, ...]


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
    | Citation
)
"""A part of a line: words, code, a formula, a link."""


def plain_text(inlines: tuple[Inline, ...]) -> str:
    """The text of inlines without markup, formulas as TeX; for titles and anchors."""
    parts: list[str] = []
    for inline in inlines:
        match inline:
            case Text() | CodeSpan() | NumberBinding():
                parts.append(inline.text)
            case Math():
                parts.append(inline.tex.text)
            case Parent() | Link():
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
    """Inlines as they may stand inside a link or on another page.

    They lose links, terms, footnotes, citations, raw HTML, pictures and line ends. `reference`
    makes the text of a link that has none.
    """
    plain: list[Inline] = []
    for inline in inlines:
        match inline:
            case Link(children=()):
                plain.append(Text(inline.span, reference(inline.target)))
            case Link() | Term():
                plain += without_links(inline.children, reference)
            case Emphasis() | Strong() | Strikethrough():
                plain.append(type(inline)(inline.span, without_links(inline.children, reference)))
            case Image():
                plain.append(Text(inline.span, inline.alt))
            case SoftBreak() | HardBreak():
                plain.append(Text(inline.span, " "))
            case RawInline() | FootnoteRef() | Citation():
                pass
            case _:
                plain.append(inline)
    return tuple(plain)
