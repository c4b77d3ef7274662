"""The formulas of a document on lines of their own, and their ids.

Entry point: `display_formulas(document)`.

A formula has the id that its author gives it, or one made from its TeX, which stays the same when
the text around it changes. A formula in a heading, a quiz or a lab has none, since those are shown
on other pages too.
"""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from coursebuild.core.model.blocks import Document, FeatureBlock, Heading
from coursebuild.core.model.inlines import Label
from coursebuild.core.model.walk import (
    child_blocks,
    computed_once,
    find_blocks,
    find_formulas,
    walk_blocks,
)
from coursebuild.core.text.source import key_of


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
            if not has_no_id:
                tex = formula.tex.text
                id_ = label.id if label is not None else _make_id(tex, used_ids, counts)
                used_ids.add(id_)
            formulas.append(DisplayFormula(formula.span.start, formula.tex.text, label, id_))
        return tuple(formulas)

    return computed_once(document, "display_formulas", find)


def _make_id(tex: str, used_ids: set[str], counts: Counter[str]) -> str:
    """Make the id of a formula without a label; a repeated formula gets a number.

    `counts` has the last number given to each.
    """
    base = id = f"eq:{key_of(' '.join(tex.split()))[:8]}"
    while id in used_ids:
        counts[base] = max(2, counts[base] + 1)
        id = f"{base}-{counts[base]}"
    return id
