"""Blocks: what a document is made of."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from decimal import Decimal
from itertools import accumulate
from typing import Annotated, ClassVar, Literal, TypeAlias, TypeVar

from msgspec import Meta, Struct

from coursebuild.core.model.inlines import (
    Inline,
    Label,
    Located,
    NumberBinding,
    RawHtml,
    SourceMark,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Source, Span

_S = TypeVar("_S", bound=Struct)

_TITLE = regex(r"\ufeff?(?:[ \t\r]*\n)*# +(.*\S)")


class Labelled(Located, frozen=True, kw_only=True):
    """What a label can give a number to."""

    label: Label | None = None


class Heading(Located, frozen=True):
    """A heading; `anchor` is unique in its document."""

    level: int
    children: tuple[Inline, ...]
    anchor: str
    explicit: bool
    """Whether the anchor was given by `{#id}`."""
    classes: tuple[str, ...] = ()

    @property
    def goes_further(self) -> bool:
        """Whether its section is off the main path, for readers who want to know more."""
        return "further" in self.classes


class Paragraph(Labelled, frozen=True):
    """A paragraph; a `tight` one, in a tight list, gets no `<p>`."""

    children: tuple[Inline, ...]
    tight: bool = False
    figure: bool = False
    """Whether it begins with `Figure:` and shows an image; the rest of it is the caption."""
    source_mark: SourceMark | None = None


class ListItem(Located, frozen=True):
    """An item of a list; `checked` is set for task lists."""

    blocks: tuple[Block, ...]
    checked: bool | None = None


class ListBlock(Located, frozen=True):
    """A list; `start` is the first number of an ordered one, `None` for bullets."""

    items: tuple[ListItem, ...]
    start: int | None
    source_mark: SourceMark | None = None


class BlockQuote(Located, frozen=True):
    """A blockquote that is not a callout."""

    blocks: tuple[Block, ...]


class Callout(Labelled, frozen=True):
    """`> [!kind] Title`; a label gives it a number among those of its kind."""

    kind: str
    kind_span: Span
    title: tuple[Inline, ...]
    folded: bool
    """`[!kind]-`: shown closed."""
    blocks: tuple[Block, ...]


class CodeBlock(Labelled, frozen=True):
    """A code block that has no meaning of its own here; `language` is the first word of `info`."""

    language: str
    info: str
    code: Excerpt


class HtmlBlock(RawHtml, frozen=True):
    """A block of raw HTML."""


class HtmlFlow(Located, frozen=True):
    """HTML in a quiz text: raw tags and inlines, as math between the tags is still math."""

    children: tuple[Inline, ...]


class ThematicBreak(Located, frozen=True):
    """`---`."""


class MathBlock(Labelled, frozen=True):
    """`$$…$$` on lines of its own."""

    display: ClassVar[bool] = True
    meaning: ClassVar[None] = None

    tex: Excerpt
    numbers: tuple[NumberBinding, ...] = ()
    r"""Those that `\out{…}{…}` binds in it."""


class Cell(Located, frozen=True):
    """A table cell; `text` is its Markdown, with escaped pipes unescaped."""

    text: Excerpt
    children: tuple[Inline, ...]


class Table(Labelled, frozen=True):
    """A table; `align` has one entry per column."""

    align: tuple[Literal["left", "right", "center"] | None, ...]
    header: tuple[Cell, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: tuple[Inline, ...] = ()
    """The rest of a paragraph `Table: …` above it."""
    comma: bool = False
    """Whether a comma may stand before the decimals of its numbers."""
    source_mark: SourceMark | None = None


class FigureName(Struct, frozen=True):
    """A file that a script draws, as it saves it: `flip.svg`."""

    name: str
    span: Span


Show: TypeAlias = Literal["open", "folded", "hidden"]
"""How much of a script's code a page shows at first."""


class ScriptPart(Labelled, frozen=True):
    """A part of a script that another block begins: ```` ```python file=examples/x.py part ````."""

    path: str
    path_span: Span
    code: Excerpt
    prefix: str
    """The text before each line of the code in the lesson (`> ` in a callout, indentation in a
    list)."""
    body_span: Span
    """The lines between the fences, to the start of the closing one."""
    show: Show = "open"


PYTHON = "python"


class Script(Labelled, frozen=True):
    """A complete script, or its beginning: ```` ```python file=examples/x.py ````.

    The block has the code that stands in it; `document_scripts` gives the script as a whole.
    """

    path: str
    path_span: Span
    code: Excerpt
    prefix: str
    """As that of a `ScriptPart`."""
    timeout: float
    """Seconds."""
    requires: tuple[str, ...]
    """Modules without which the script is skipped."""
    args: tuple[str, ...]
    norun: bool
    body_span: Span
    diverges: bool = False
    deep: bool = False
    """Whether the author expects deep penetrations of bodies in it."""
    writes: tuple[str, ...] = ()
    once: bool = False
    """Whether the course keeps its output, and it runs only on request."""
    figures: tuple[FigureName, ...] = ()
    show: Show = "open"
    archive: bool = False
    """Whether readers are handed over an archive, not one file."""
    parts: tuple[Script | ScriptPart, ...] = ()
    """The blocks of a whole script that stands in several."""
    language: str = PYTHON
    """The kind of its fence; one in another language than Python needs a runner of the map."""

    @property
    def is_python(self) -> bool:
        return self.language == PYTHON

    @property
    def part_lines(self) -> tuple[int, ...]:
        """The lines of the file, from 1, at which its parts but the first begin."""
        sizes = (part.code.text.count("\n") for part in self.parts[:-1])
        return tuple(1 + size for size in accumulate(sizes))


class Mode(enum.Enum):
    """How a recorded text is compared with a run."""

    EXACT = "exact"
    DIGITS = "digits"
    TOLERANCE = "rtol"
    VOLATILE = "volatile"


class Comparison(Struct, frozen=True):
    """How a recording is compared.

    `rtol` and `atol` count in mode `TOLERANCE` only; `ellipsis` and `volatile` in all modes but
    `VOLATILE`.
    """

    mode: Mode = Mode.EXACT
    rtol: Decimal = Decimal(0)
    atol: Decimal = Decimal(0)
    ellipsis: bool = False
    volatile: str = ""
    """A regular expression; text that matches it is not compared."""
    course_filters: tuple[Filter, ...] = ()
    """Those of the whole course; see `Course.comparison_of`."""

    @property
    def own_filters(self) -> tuple[Filter, ...]:
        """The filter that removes volatile text from both sides, with the space around it."""
        return (Filter(volatile_pattern(self.volatile), "…"),) if self.volatile else ()

    @property
    def filters(self) -> tuple[Filter, ...]:
        """Everything that is replaced in both texts before they are compared."""
        return (*self.course_filters, *self.own_filters)


def volatile_pattern(pattern: str) -> str:
    """A regular expression for what another one matches, with the space around it."""
    return rf"[^\S\n]*(?:{pattern})[^\S\n]*"


class Filter(Struct, frozen=True, forbid_unknown_fields=True):
    """A replacement in both texts before they are compared."""

    pattern: Annotated[str, Meta(min_length=1, description="a regular expression, as RE2 reads it")]
    replacement: Annotated[str, Meta(description="with groups as in `\\1`")]


class Recording(Struct, frozen=True):
    """An `output` fence, or `Output:` and the text fence or table below it."""

    span: Span
    """From the caption to the end of the body."""
    caption: tuple[Inline, ...]
    """Empty for a fence without one, and if it is the word alone: a page shows that of its
    language."""
    caption_span: Span
    """That of the fence's first line if there is no caption."""
    body: Excerpt | Table
    body_span: Span
    """The lines between the fences (from the start of the first to the start of the closing fence);
    for a table all of it."""
    prefix: str
    """The text before each line in the lesson, as before those of `SourcePart`."""
    comparison: Comparison | None
    """`None`: the course's default."""
    script: str | None
    """The path of the nearest script above; `None` only in a document with an error."""
    part: int = 0
    """The number of the script's part that is nearest above, from 0."""
    readable: bool = True
    """Whether the fence's way of comparing is valid; if not, nothing is compared."""


class Mjcf(Labelled, frozen=True):
    """A model, or what belongs into the element `fragment`; it may have to fail with `error`."""

    code: Excerpt
    fragment: str | None
    error: str | None
    error_span: Span | None


class SourcePart(Struct, frozen=True):
    """A part of a file of the project that a block shows: `show=src/x.py#function`."""

    path: str
    part: str
    """The name of a function, class or method, or lines (`L3-L9`); empty for the whole file."""
    place: Span
    body_span: Span
    prefix: str


class PlainCode(Labelled, frozen=True):
    """A Python block without `file=`, or a part of a file in any language: shown but not run."""

    code: Excerpt
    source: SourcePart | None = None
    language: str = PYTHON


class FeatureBlock(Labelled, frozen=True, kw_only=True):
    """A block that a feature adds; its methods answer what the rest of the tool must know."""

    source_mark: SourceMark | None = None
    numbers: tuple[Inline, ...] = ()
    """The bound numbers that stand in place of plain ones in its JSON."""

    def child_blocks(self) -> tuple[Block, ...]:
        """The Markdown blocks in it, in the order of the page."""
        return ()

    def child_inlines(self) -> tuple[Inline, ...]:
        """The lines of Markdown in it, outside its child blocks."""
        return ()

    def summary(self) -> FeatureBlock | None:
        """The block without what only its own page shows; `None` if nothing is left."""
        return None

    def anchors(self) -> tuple[str, ...]:
        """The ids that it has on its page, where nothing else has them; links may name them.

        The one under which progress is kept it leaves to a heading or title which has the same.
        """
        return ()

    def quoted_lines(self) -> tuple[tuple[str, int], ...]:
        """Lines of verified output that it quotes: the script's path, and the line from 1."""
        return ()

    def models(self) -> tuple[str, ...]:
        """The names of the models in `models/` that it shows."""
        return ()

    def mentioned_models(self) -> tuple[str, ...]:
        """The names of models that it is about, but does not show."""
        return ()

    def mjcf(self) -> Excerpt | None:
        """The text of a whole model in it, which is compiled with those of the course."""
        return None

    def progress_keys(self) -> tuple[str, tuple[str, ...]] | None:
        """What a reader's progress is recorded for: an id, unique in the course, and its keys."""
        return None

    def given_id(self) -> tuple[str, Span] | None:
        """That id, where its author chose it, and its place."""
        return None


Block: TypeAlias = (
    Heading
    | Paragraph
    | ListBlock
    | BlockQuote
    | Callout
    | CodeBlock
    | PlainCode
    | HtmlBlock
    | HtmlFlow
    | ThematicBreak
    | MathBlock
    | Table
    | Script
    | ScriptPart
    | Recording
    | Mjcf
    | FeatureBlock
)
"""A part of a text with lines of its own: a paragraph, a table, what a feature reads."""


class Footnote(Located, frozen=True):
    """A footnote that the text refers to; numbers follow the order of first reference."""

    label: str
    number: int
    references: int
    blocks: tuple[Block, ...]


class NumberedItem(Struct, frozen=True):
    """What a label has given a number, and any formula on a line of its own."""

    id: str
    number: str = ""
    """The number among those of its kind, such as `3`; empty for a formula without a label."""
    has_margin_number: bool = False
    """Whether its page writes the number beside it, as a formula may show one itself."""
    domain: str | None = None
    """The conditions under which it was tried as an identity, perhaps empty."""
    callout: str = ""
    """The kind of callout that it is, if it is one."""
    first_row: int = 0
    """The number of the first numbered row of a formula such as `align`; 0 where it has none."""

    @property
    def kind(self) -> str:
        return self.id.partition(":")[0]


def title_line(source: Source, start: int = 0) -> Span | None:
    """The title that a page's text opens with at an offset, as a heading of level 1."""
    match = _TITLE.match(source.text, start)
    return source.span(*match.span(1)) if match is not None else None


class Document(Struct, frozen=True, dict=True):
    """One parsed Markdown text, or its summary for other pages."""

    source: Source
    blocks: tuple[Block, ...]
    footnotes: tuple[Footnote, ...]
    title_anchor: str = ""
    """The anchor of the title that a page opens with; empty where a heading has the same."""
    unclaimed: tuple[CodeBlock, ...] = ()
    """Texts below a script that may show its output, and that are not marked as such."""
    numbered_items: tuple[NumberedItem, ...] = ()
    """Set in a summary only, which lacks formulas and tables themselves."""
    comma: bool = False
    """Whether a comma may stand before the decimals of its numbers, as in its language."""
    summaries: Mapping[str, Struct] | None = None
    """Set in a summary only: those that features made of the text, by their names."""

    def summary_of(self, kind: type[_S]) -> _S | None:
        """The summary of this kind that a feature made of the text, if it made one."""
        values = (self.summaries or {}).values()
        return next((summary for summary in values if isinstance(summary, kind)), None)
