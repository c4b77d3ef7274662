"""The formulas of a document that stand on lines of their own, and the ids by which they are found.

Entry point: `display_formulas(document)`.

A formula has the id that its author gives it, or one made of its TeX: that stays the same whatever
is written around it. One in a heading, a quiz or a lab has none, since these are shown elsewhere
too.
"""

from __future__ import annotations

import hashlib
from typing import NamedTuple

from coursebuild.core.model.blocks import Block, Document, FeatureBlock, Heading, MathBlock
from coursebuild.core.model.inlines import Label, Math
from coursebuild.core.model.walk import (
    block_inlines,
    child_blocks,
    document_blocks,
    walk_blocks,
    walk_inlines,
)


class DisplayFormula(NamedTuple):
    """A formula on a line of its own."""

    start: int
    """Its offset in the document."""
    tex: str
    label: Label | None
    id: str
    """Empty where it has none."""


def blocks_elsewhere(document: Document) -> frozenset[int]:
    """The Python ids of blocks of features and the blocks inside them."""
    return frozenset(
        id(block)
        for holder in document_blocks(document)
        if isinstance(holder, FeatureBlock)
        for block in (holder, *walk_blocks(child_blocks(holder)))
    )


def display_formulas(document: Document) -> tuple[DisplayFormula, ...]:
    """In the order of the text, footnotes last."""
    if "$$" not in document.source.text:
        return ()
    elsewhere = blocks_elsewhere(document)
    formulas = [
        (formula, isinstance(block, Heading) or id(block) in elsewhere)
        for block in document_blocks(document)
        for formula in _displayed(block)
    ]
    taken = {one.label.id for one, _ in formulas if one.label is not None}
    found: list[DisplayFormula] = []
    for formula, away in formulas:
        label, name = formula.label, ""
        if not away:
            name = label.id if label is not None else _name(formula.tex.text, taken)
            taken.add(name)
        found.append(DisplayFormula(formula.span.start, formula.tex.text, label, name))
    return tuple(found)


def _displayed(block: Block) -> list[MathBlock | Math]:
    if isinstance(block, MathBlock):
        return [block]
    inlines = walk_inlines(block_inlines(block))
    return [inline for inline in inlines if isinstance(inline, Math) and inline.display]


def _name(tex: str, taken: set[str]) -> str:
    """The id of a formula without a label; the same formula again gets a number."""
    digest = hashlib.sha256(" ".join(tex.split()).encode("utf-8", "surrogatepass")).hexdigest()
    base = name = f"eq:{digest[:8]}"
    count = 1
    while name in taken:
        count += 1
        name = f"{base}-{count}"
    return name
