r"""Numbers of formulas: those with a label are numbered, in the order of the text.

Entry points: `number_equations(document, mathml)`; `equations_of`, for other pages.

LaTeX's numbered environments count too: the style sheet writes their numbers, continuing ours. A
formula with such numbers of its own, or with a `\tag`, gets no other.
"""

from __future__ import annotations

import re
from html import unescape

from coursebuild.core.features import Mathml
from coursebuild.core.model import Document, Equation
from coursebuild.core.model.equations import display_formulas

_COUNTER_CLASS = 'class="tml-eqn"'
_TAG_CLASS = 'class="tml-tag"'
_TAG = re.compile(r'<mtext class="tml-tag">\(?([^<]*?)\)?</mtext>')


def number_equations(document: Document, mathml: Mathml) -> dict[int, Equation]:
    """The formulas of a document that have an id, by offset."""
    equations: dict[int, Equation] = {}
    count = 0
    for formula in display_formulas(document):
        html = mathml(formula.tex, True)
        styled_count = html.count(_COUNTER_CLASS)
        tag = _TAG.search(html) if _TAG_CLASS in html else None
        number, has_margin_number = "", False
        if formula.label is not None and formula.id:
            has_margin_number = not styled_count and tag is None
            number = unescape(tag[1]) if tag is not None and not styled_count else str(count + 1)
        count += styled_count + has_margin_number
        if formula.id:
            equations[formula.start] = Equation(formula.id, number, has_margin_number)
    return equations


def equations_of(document: Document, mathml: Mathml) -> tuple[Equation, ...]:
    """The formulas of a document, or of its summary, that have an id."""
    if document.summaries is not None:
        return document.equations
    return tuple(number_equations(document, mathml).values())
