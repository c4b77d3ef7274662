"""Walking a document: every block and every inline in order; its summary for other pages.

A formula has the id that its author gives it, or one made from its TeX, which stays the same when
the text around it changes. A formula in a heading, a quiz or a lab has none, since those are shown
on other pages too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeVar

from msgspec.structs import replace

from coursebuild.core.model.blocks import (
    Block,
    BlockQuote,
    Callout,
    CodeBlock,
    Document,
    FeatureBlock,
    Heading,
    HtmlBlock,
    HtmlFlow,
    Labelled,
    ListBlock,
    MathBlock,
    Mjcf,
    Paragraph,
    PlainCode,
    Recording,
    Script,
    ScriptPart,
    Table,
    ThematicBreak,
)
from coursebuild.core.model.inlines import (
    Citation,
    Image,
    Inline,
    Label,
    Link,
    Math,
    NumberBinding,
    Parent,
    RawInline,
    Term,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span, key_of

Value = TypeVar("Value")
AnyBlock = TypeVar("AnyBlock", bound=Block)
AnyInline = TypeVar("AnyInline", bound=Inline)

_BLOCK_CONTAINERS = (BlockQuote, Callout, ListBlock, FeatureBlock, Recording)
"""Blocks that may contain blocks."""
_INLINE_CONTAINERS = (Parent, Link)
"""A tuple, since `Parent | Link` would be made anew at every step."""
_COMMENTS = regex(r"(?:\s*<!--(?:(?!-->)[\s\S])*-->)*\s*")


def child_blocks(block: Block) -> tuple[Block, ...]:
    """The blocks directly inside a block, texts of quizzes and labs included."""
    if isinstance(block, BlockQuote | Callout):
        return block.blocks
    if isinstance(block, ListBlock):
        return tuple(b for item in block.items for b in item.blocks)
    if isinstance(block, FeatureBlock):
        return block.child_blocks()
    if isinstance(block, Recording) and isinstance(block.body, Table):
        return (block.body,)
    return ()


def block_inlines(block: Block) -> tuple[Inline, ...]:
    """The inlines directly inside a block (not inside its child blocks)."""
    match block:
        case Paragraph() | Heading() | HtmlFlow():
            return block.children
        case MathBlock():
            return block.numbers
        case FeatureBlock():
            return (*block.child_inlines(), *block.numbers)
        case Callout():
            return block.title
        case Table():
            rows = (block.header, *block.rows)
            cells = (inline for row in rows for cell in row for inline in cell.children)
            return (*block.caption, *cells)
        case Recording():
            return block.caption
        case _:
            return ()


def walk_blocks(blocks: tuple[Block, ...]) -> Iterator[Block]:
    """Every block in document order, a container before its content."""
    for block in blocks:
        yield block
        if isinstance(block, _BLOCK_CONTAINERS):
            yield from walk_blocks(child_blocks(block))


def main_and_further(blocks: tuple[Block, ...]) -> Iterator[tuple[bool, tuple[Block, ...]]]:
    """Cut a text into parts, each with whether it is a section that goes further."""
    start, level = 0, 0
    for i, block in enumerate(blocks):
        if not isinstance(block, Heading):
            continue
        ends = level and block.level <= level
        if ends or (block.goes_further and not level):
            if i > start:
                yield bool(level), blocks[start:i]
            start, level = i, block.level if block.goes_further else 0
    if blocks[start:]:
        yield bool(level), blocks[start:]


def computed_once(document: Document, name: str, compute: Callable[[], Value]) -> Value:
    """Return a value computed from a document, which is kept with it, since every check asks."""
    values = document.__dict__
    if name not in values:
        values[name] = compute()
    return values[name]  # type: ignore[no-any-return]


def document_blocks(document: Document) -> Iterator[Block]:
    """Every block of a document, its footnotes last."""

    def walk() -> tuple[Block, ...]:
        groups = (document.blocks, *(footnote.blocks for footnote in document.footnotes))
        return tuple(block for group in groups for block in walk_blocks(group))

    return iter(computed_once(document, "all_blocks", walk))


def find_blocks(document: Document, kind: type[AnyBlock]) -> Iterator[AnyBlock]:
    """The blocks of a type in a document."""
    return (block for block in document_blocks(document) if isinstance(block, kind))


def enclosure(block: Mjcf) -> tuple[str, ...]:
    """The elements around a part of a model, from the outside; none around a whole one.

    `fragment="worldbody/body"` names nested ones.
    """
    if block.fragment is None:
        return ()
    return ("mujoco", *(name for name in block.fragment.split("/") if name not in ("", "mujoco")))


def output_numbers(document: Document) -> Mapping[int, int]:
    """The number of each recording among the outputs of its script, from 1, by offset."""

    def count() -> dict[int, int]:
        counts: dict[str, int] = {}
        numbers: dict[int, int] = {}
        for block in find_blocks(document, Recording):
            if block.script is not None:
                counts[block.script] = numbers[block.span.start] = counts.get(block.script, 0) + 1
        return numbers

    return computed_once(document, "output_numbers", count)


def sibling_groups(document: Document) -> Iterator[tuple[Block, ...]]:
    """The blocks of a document in groups of siblings."""
    groups = [document.blocks, *(footnote.blocks for footnote in document.footnotes)]
    for group in groups:  # grows in the loop
        yield group
        for block in group:
            if isinstance(block, ListBlock):
                groups += [item.blocks for item in block.items]
            else:
                groups.append(child_blocks(block))


def is_blank(blocks: Iterable[Block]) -> bool:
    """Whether there is nothing to read: only headings, comments, and paragraphs of odd blanks."""
    return all(
        isinstance(block, Heading)
        or (isinstance(block, Paragraph) and not block.children)
        or (isinstance(block, HtmlBlock) and is_comment(block))
        for block in blocks
    )


def is_comment(html: HtmlBlock | RawInline) -> bool:
    """Whether HTML consists of comments only."""
    return _COMMENTS.fullmatch(html.html) is not None


def document_scripts(document: Document) -> tuple[Script, ...]:
    """The complete scripts of a document, each with the code of all its parts."""

    def join() -> tuple[Script, ...]:
        parts: dict[str, list[ScriptPart]] = {}
        for part in find_blocks(document, ScriptPart):
            parts.setdefault(part.path, []).append(part)
        return tuple(
            _whole_script(script, parts.pop(script.path, []))
            for script in find_blocks(document, Script)
        )

    return computed_once(document, "scripts", join)


def _whole_script(script: Script, further_parts: Sequence[ScriptPart]) -> Script:
    parts: list[Script | ScriptPart] = [script, *further_parts]
    parts[:-1] = [replace(part, code=_with_empty_line(part.code)) for part in parts[:-1]]
    code = Excerpt.join([part.code for part in parts])
    code = code.slice(0, len(code.text.rstrip("\n")) + 1)
    return replace(script, code=code, parts=tuple(parts) if further_parts else ())


def _with_empty_line(code: Excerpt) -> Excerpt:
    """The code of a part, which an empty line parts from the next one in the file."""
    if code.text.endswith("\n\n") or code.text == "\n":
        return code
    return Excerpt(code.source, code.text + "\n", code.pieces)


def walk_inlines(inlines: Iterable[Inline], *, numbers: bool = True) -> Iterator[Inline]:
    """Every inline in order, a container before its content, a formula before its `numbers`."""
    nodes: list[Inline] = []
    _collect(inlines, numbers, nodes)
    return iter(nodes)


def _collect(inlines: Iterable[Inline], numbers: bool, nodes: list[Inline]) -> None:
    for inline in inlines:
        nodes.append(inline)
        if isinstance(inline, _INLINE_CONTAINERS):
            _collect(inline.children, numbers, nodes)
        elif numbers and isinstance(inline, Math):
            nodes += (*inline.numbers, *([inline.value] if inline.value else ()))


def inlines_by_block(document: Document) -> tuple[tuple[Block, tuple[Inline, ...]], ...]:
    """Every block of a document, its footnotes last, with every inline outside its child blocks."""

    def walk() -> tuple[tuple[Block, tuple[Inline, ...]], ...]:
        blocks = document_blocks(document)
        return tuple((block, tuple(walk_inlines(block_inlines(block)))) for block in blocks)

    return computed_once(document, "inlines_by_block", walk)


def find_formulas(document: Document) -> tuple[tuple[Block, Math | MathBlock], ...]:
    """The formulas of a document, each after the block that it is in."""

    def walk() -> Iterator[tuple[Block, Math | MathBlock]]:
        for block, inlines in inlines_by_block(document):
            if isinstance(block, MathBlock):
                yield block, block
            for inline in inlines:
                if isinstance(inline, Math):
                    yield block, inline

    return computed_once(document, "formulas", lambda: tuple(walk()))


def document_inlines(document: Document) -> Iterator[Inline]:
    """Every inline of a document, and the numbers of alternative texts."""

    def walk() -> tuple[Inline, ...]:
        inlines = [inline for _, group in inlines_by_block(document) for inline in group]
        images = (inline for inline in inlines if isinstance(inline, Image))
        return (*inlines, *(number for image in images for number in image.numbers))

    return iter(computed_once(document, "all_inlines", walk))


def find_inlines(document: Document, kind: type[AnyInline]) -> Iterator[AnyInline]:
    """The inlines of a type in a document."""
    return (inline for inline in document_inlines(document) if isinstance(inline, kind))


_SUMMARY_INLINES = frozenset((Citation, Link, Image, NumberBinding, RawInline, Term))


def without_prose(document: Document) -> Document:
    """The summary of a document, of the same type: all but what only its own page shows.

    Blocks come out of their containers, since no other page asks what contains what. Formulas
    are left out, except those in tables that are recorded or bind numbers, whose header says the
    units: they are checked in the whole document. If only prose was left out, a thematic break
    stands for it, so that the summary is not blank.
    """
    recorded_ids: set[int] = set()
    blocks: list[Block] = []
    for block, all_inlines in inlines_by_block(document):
        if id(block) in recorded_ids:  # a recorded table comes with its recording
            continue
        inlines = tuple(
            replace(inline, children=()) if isinstance(inline, Link | Term) else inline
            for inline in all_inlines
            if type(inline) in _SUMMARY_INLINES
        )
        match block:
            case Paragraph() if block.figure:
                blocks.append(replace(block, children=inlines))
            case Table() if any(isinstance(inline, NumberBinding) for inline in inlines):
                blocks.append(replace(block, label=None))
            case Paragraph() | HtmlFlow() | Table() | MathBlock():
                blocks += _paragraph_of(block.span, inlines)
            case Heading():
                blocks.append(replace(block, children=inlines))
            case Script() | ScriptPart() | Mjcf() | HtmlBlock():
                blocks.append(block)
            case Recording():
                recorded_ids.add(id(block.body))
                blocks.append(replace(block, caption=inlines))
            case FeatureBlock():
                bare = block.summary()
                blocks += [] if bare is None else [replace(bare, numbers=())]
                blocks += _paragraph_of(block.span, inlines)
            case Callout():
                blocks.append(replace(block, title=inlines, blocks=()))
            case PlainCode():
                blocks += [] if block.source is None else [block]
            case BlockQuote() | ListBlock() | CodeBlock() | ThematicBreak():
                pass
    if is_blank(blocks) and not is_blank(document_blocks(document)):
        blocks.append(ThematicBreak(document.blocks[0].span))
    return Document(document.source, tuple(blocks), (), document.title_anchor, document.unclaimed)


def _paragraph_of(span: Span, inlines: tuple[Inline, ...]) -> Iterator[Paragraph]:
    if inlines:
        yield Paragraph(span, inlines)


def labelled_blocks(document: Document) -> Iterator[tuple[Block, Label]]:
    """The blocks with a label, but for formulas: these are among `display_formulas`."""
    for block in document_blocks(document):
        if isinstance(block, Labelled) and block.label and not isinstance(block, MathBlock):
            yield block, block.label


class DisplayFormula(NamedTuple):
    """A formula on a line of its own."""

    start: int
    """Its offset in the document."""
    tex: str
    label: Label | None
    id: str
    """Empty where it has none."""


def feature_block_ids(document: Document) -> frozenset[int]:
    """The Python ids of the blocks of features and of all blocks inside them."""
    return frozenset(
        id(block)
        for holder in find_blocks(document, FeatureBlock)
        for block in (holder, *walk_blocks(child_blocks(holder)))
    )


def display_formulas(document: Document) -> tuple[DisplayFormula, ...]:
    """The formulas of a document in the order of the text, footnotes last."""

    def find() -> tuple[DisplayFormula, ...]:
        if "$$" not in document.source.text:
            return ()
        in_features = feature_block_ids(document)
        candidates = [
            (formula, isinstance(block, Heading) or id(block) in in_features)
            for block, formula in find_formulas(document)
            if formula.display
        ]
        used_ids = {formula.label.id for formula, _ in candidates if formula.label is not None}
        counts = Counter[str]()
        formulas: list[DisplayFormula] = []
        for formula, has_no_id in candidates:
            label, id_ = formula.label, ""
            if label is not None and not has_no_id:
                id_ = label.id
            elif not has_no_id:
                base = id_ = f"eq:{key_of(' '.join(formula.tex.text.split()))[:8]}"
                while id_ in used_ids:  # a repeated formula gets a number
                    counts[base] = max(2, counts[base] + 1)
                    id_ = f"{base}-{counts[base]}"
                used_ids.add(id_)
            formulas.append(DisplayFormula(formula.span.start, formula.tex.text, label, id_))
        return tuple(formulas)

    return computed_once(document, "display_formulas", find)
