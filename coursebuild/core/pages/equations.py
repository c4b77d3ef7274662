r"""Numbers of formulas: those that an author labels are numbered, in the order of the text.

Entry points: `numbered(document, mathml)`; `equations_of`, for others than their own page.

LaTeX's numbered environments count too: their numbers are written by the style sheet, which counts
on where ours left off. A formula with such numbers of its own, or with a `\tag`, gets none besides.
"""

from __future__ import annotations

import re
from html import unescape

from coursebuild.core.features import Mathml
from coursebuild.core.model import Document, Equation
from coursebuild.core.model.equations import display_formulas

_COUNTED = 'class="tml-eqn"'
_TAGGED = 'class="tml-tag"'
_TAG = re.compile(r'<mtext class="tml-tag">\(?([^<]*?)\)?</mtext>')


def numbered(document: Document, mathml: Mathml) -> dict[int, Equation]:
    """The formulas of a document that have an id, by their offset."""
    found: dict[int, Equation] = {}
    count = 0
    for formula in display_formulas(document):
        html = mathml(formula.tex, True)
        counted = html.count(_COUNTED)
        tag = _TAG.search(html) if _TAGGED in html else None
        number, shown = "", False
        if formula.label is not None and formula.id:
            shown = not counted and tag is None
            number = unescape(tag[1]) if tag is not None and not counted else str(count + 1)
        count += counted + shown
        if formula.id:
            found[formula.start] = Equation(formula.id, number, shown)
    return found


def equations_of(document: Document, mathml: Mathml) -> tuple[Equation, ...]:
    """The formulas that have an id, of a document or of a summary."""
    if document.summaries is not None:
        return document.equations
    return tuple(numbered(document, mathml).values())
