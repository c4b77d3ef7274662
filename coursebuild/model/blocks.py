"""Blocks: what a document is made of.

Entry points: the union `Block`, and `Document`.
"""

from __future__ import annotations

import enum
from decimal import Decimal
from typing import Literal, TypeAlias

from coursebuild.model.inlines import Inline, Label
from coursebuild.model.interactive import Lab, Quiz
from coursebuild.model.lexicon import Lexicon
from coursebuild.source import Excerpt, Source, Span
from coursebuild.values import dataclass, field


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading; `anchor` is unique in its document."""

    span: Span
    level: int
    children: tuple[Inline, ...]
    anchor: str
    explicit: bool
    """Whether the anchor was given by `{#id}`."""
    classes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph; `tight` when it stands in a tight list, where it gets no element of its own."""

    span: Span
    children: tuple[Inline, ...]
    tight: bool = False


@dataclass(frozen=True, slots=True)
class ListItem:
    """An item of a list; `checked` is set for task lists."""

    span: Span
    blocks: tuple[Block, ...]
    checked: bool | None = None


@dataclass(frozen=True, slots=True)
class ListBlock:
    """A list; `start` is the first number of an ordered one, `None` for bullets."""

    span: Span
    items: tuple[ListItem, ...]
    start: int | None


@dataclass(frozen=True, slots=True)
class BlockQuote:
    """A blockquote that is no callout."""

    span: Span
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True)
class Callout:
    """`> [!kind] Title`."""

    span: Span
    kind: str
    kind_span: Span
    title: tuple[Inline, ...]
    folded: bool
    """`[!kind]-`: shown closed."""
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True)
class CodeBlock:
    """A fenced or indented code block that is none of ours.

    `info` is the raw info string, `language` its first word.
    """

    span: Span
    language: str
    info: str
    code: Excerpt


@dataclass(frozen=True, slots=True)
class HtmlBlock:
    """A block of raw HTML, kept."""

    span: Span
    html: str


@dataclass(frozen=True, slots=True)
class HtmlFlow:
    """HTML in a quiz text, where math between the tags is still math.

    Raw tags and inlines in order, in no paragraph.
    """

    span: Span
    children: tuple[Inline, ...]


@dataclass(frozen=True, slots=True)
class ThematicBreak:
    """`---`."""

    span: Span


@dataclass(frozen=True, slots=True)
class MathBlock:
    """`$$…$$` on lines of its own."""

    span: Span
    tex: Excerpt
    label: Label | None = None


@dataclass(frozen=True, slots=True)
class Cell:
    """A table cell; `text` is its Markdown, escaped pipes made plain."""

    span: Span
    text: Excerpt
    children: tuple[Inline, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """A table; `align` has one entry a column."""

    span: Span
    align: tuple[Literal["left", "right", "center"] | None, ...]
    header: tuple[Cell, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True, slots=True)
class Script:
    """A complete script: ```` ```python file=examples/x.py ````."""

    span: Span
    path: str
    path_span: Span
    code: Excerpt
    """The block's text, ending in exactly one newline."""
    prefix: str
    """What stands before each line of the code in the lesson (`> ` in a callout, indentation in a
    list)."""
    timeout: float
    """Seconds."""
    requires: tuple[str, ...]
    """Modules without which the script is skipped."""
    args: tuple[str, ...]
    norun: bool
    body_span: Span
    """The lines between the fences, to the start of the closing one."""
    diverges: bool = False
    """Whether a simulation in it is to be lost."""
    deep: bool = False
    """Whether bodies in it are to lie deep in each other."""


class Mode(enum.Enum):
    """How a recorded text is compared with a run."""

    EXACT = "exact"
    DIGITS = "digits"
    TOLERANCE = "rtol"
    VOLATILE = "volatile"


@dataclass(frozen=True, slots=True)
class Comparison:
    """How a recording is compared.

    `rtol` and `atol` count only in mode `TOLERANCE`; `ellipsis` goes with all but `VOLATILE`.
    """

    mode: Mode = Mode.EXACT
    rtol: Decimal = Decimal(0)
    atol: Decimal = Decimal(0)
    ellipsis: bool = False


@dataclass(frozen=True, slots=True)
class Filter:
    """`[[verify.filter]]`: a regular expression replaced on both sides before comparing."""

    pattern: str
    replacement: str


@dataclass(frozen=True, slots=True)
class Recording:
    """`Output:` and the text fence or table below it."""

    span: Span
    """From the caption to the end of the body."""
    caption: tuple[Inline, ...]
    caption_span: Span
    body: Excerpt | Table
    """The text between the fences, or the table."""
    body_span: Span
    """The lines between the fences (from the start of the first to the start of the closing fence);
    for a table all of it."""
    prefix: str
    """What stands before each line in the lesson."""
    comparison: Comparison | None
    """`None`: the course's default."""
    script: str | None
    """The path of the nearest script above; `None` only in a document with an error."""
    readable: bool = True
    """Whether the fence says in a right way how to compare; if not, nothing is compared."""


@dataclass(frozen=True, slots=True)
class Io:
    """The io card: what the script takes, does and gives."""

    span: Span
    input: tuple[Inline, ...]
    process: tuple[Inline, ...]
    output: tuple[Inline, ...]


@dataclass(frozen=True, slots=True)
class Mjcf:
    """A model or fragment.

    `fragment` names the element that it goes into, `error` the message it must fail with.
    """

    span: Span
    code: Excerpt
    fragment: str | None
    error: str | None
    error_span: Span | None


BenchPart: TypeAlias = Literal["plot", "stable", "orders", "table"]
"""What of a report is shown."""


@dataclass(frozen=True, slots=True)
class Bench:
    """What was recorded of a model in one of its scenarios."""

    span: Span
    model: str
    model_span: Span
    scenario: str | None
    """`None`: the first."""
    scenario_span: Span | None
    shows: tuple[BenchPart, ...]
    """In the order in which it is shown."""


@dataclass(frozen=True, slots=True)
class PlainCode:
    """A Python block without `file=`: shown, not run; `fragment` says that it need not parse."""

    span: Span
    code: Excerpt
    fragment: bool


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
    | Recording
    | Io
    | Mjcf
    | Bench
    | Lab
    | Quiz
)


@dataclass(frozen=True, slots=True)
class Footnote:
    """A footnote that is referred to.

    `number` in order of first reference, `references` how often.
    """

    span: Span
    label: str
    number: int
    references: int
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True)
class Document:
    """One Markdown text, parsed."""

    source: Source
    blocks: tuple[Block, ...]
    footnotes: tuple[Footnote, ...]
    lexicon: Lexicon | None = None
    """Only of a skeleton, which does not have what it was taken from."""
    _all: list[Block] = field(
        default_factory=list, init=False, repr=False, compare=False, hash=False
    )
    """What `document_blocks` gives, once it was asked for."""
    _kinds: frozenset[type] | None = field(
        default=None, init=False, repr=False, compare=False, hash=False
    )
    """What `document_has` knows, once it was asked."""
