r"""Numbers of formulas: those that an author labels are numbered, in the order of the text.

Entry points: `numbered(document, mathml)`; `equations_of`, for others than their own page.

LaTeX's numbered environments count too: their numbers are written by the style sheet, which counts
on where ours left off. A formula with such numbers of its own, or with a `\tag`, gets none besides.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from html import unescape

from msgspec import Struct

from coursebuild.core.features import Mathml
from coursebuild.core.model import Document, Equation
from coursebuild.core.model.equations import display_formulas

_COUNTED = 'class="tml-eqn"'
_TAGGED = 'class="tml-tag"'
_TAG = re.compile(r'<mtext class="tml-tag">\(?([^<]*?)\)?</mtext>')


class NumberedFormula(Struct, frozen=True):
    """A formula on a line of its own, as its page shows it."""

    id: str
    number: str
    """By which it is referred to; empty where it has no label."""
    shown: bool
    """Whether the number is to be written beside it: the formula itself does not show one."""


def numbered(document: Document, mathml: Callable[[str], str]) -> dict[int, NumberedFormula]:
    """The formulas of a document by their offset; `mathml` gives that of a formula's TeX."""
    found: dict[int, NumberedFormula] = {}
    count = 0
    for formula in display_formulas(document):
        html = mathml(formula.tex)
        counted = html.count(_COUNTED)
        tag = _TAG.search(html) if _TAGGED in html else None
        number, shown = "", False
        if formula.label is not None and formula.id:
            shown = not counted and tag is None
            number = unescape(tag[1]) if tag is not None and not counted else str(count + 1)
        count += counted + shown
        if formula.id:
            found[formula.start] = NumberedFormula(formula.id, number, shown)
    return found


def equations_of(document: Document, mathml: Mathml) -> tuple[Equation, ...]:
    """The formulas on lines of their own of a document, or of a summary."""
    if document.summaries is not None:
        return document.equations
    found = numbered(document, lambda tex: mathml(tex, True)).values()
    return tuple(Equation(one.id, one.number) for one in found)
