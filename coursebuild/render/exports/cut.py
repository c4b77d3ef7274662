"""HTML cut at what must be looked at when it is brought to another place.

Entry point: `Cut(html)`.

Most of a page is the same everywhere: text whose references are those of XML, coloured words of
code, formulas as we write them. That goes in runs, which one regular expression finds; marks are
what stands between them. Formulas are not looked at again: that each is one was found when the
page was settled, and a single character stands for it here. The tags of others are marks.
"""

from __future__ import annotations

import re

from coursebuild.patterns import pattern
from coursebuild.render import formulas
from coursebuild.render.exports.tags import MARK, Piece, read
from coursebuild.render.mathml import TEXT

MATHML = "http://www.w3.org/1998/Math/MathML"
_SLOT = "\x01"
"""Stands for a formula."""
_TEXTS = f"(?:{TEXT}++|&(?:lt|gt|amp);)*+"
_WORD = (
    f'span class="(?:[a-z]|bound|held)">{_TEXTS}</span>'
    f"|code>{_TEXTS}</code>|em>{_TEXTS}</em>|strong>{_TEXTS}</strong>"
)
_LINE = (
    'span id="[a-zA-Z_][a-zA-Z0-9_.-]*+">'
    f'(?:{TEXT}++|&(?:lt|gt|amp);|<span class="[a-z]">{_TEXTS}</span>)*+</span>'
)
_CUT = rf"((?:{TEXT}++%s|&(?:lt|gt|amp);|<(?:{_WORD}|{_LINE}))*+)({MARK}|.[^<%s]*+|\Z)"
_WITHOUT = pattern(_CUT % ("", ""), re.DOTALL)
_WITH_FORMULAS = pattern(_CUT % (f"|{_SLOT}", _SLOT), re.DOTALL)


class Cut:
    """A text that was cut."""

    def __init__(self, html: formulas.Woven) -> None:
        text = _SLOT.join(html.texts)
        self._formulas = html.formulas
        if text.count(_SLOT) > len(html.formulas):  # the text itself has such a character
            text, self._formulas = html.html, ()
        parts = (_WITH_FORMULAS if self._formulas else _WITHOUT).findall(text)
        self.marks = [mark for _, mark, _ in parts]
        """What follows each run: a mark, or text that is no run."""
        self._runs = "\0".join([run for run, _, _ in parts])  # there is none in a run
        self._read: dict[str, tuple[Piece, ...]] = {}

    def moved(self, prefix: str, *, xml: bool) -> list[str]:
        """The runs in their new place: `prefix` is put before their ids."""
        runs = self._runs
        if prefix:
            runs = runs.replace('<span id="', f'<span id="{prefix}')
        if self._formulas:
            end = f' xmlns="{MATHML}">' if xml else ">"  # of the start tag
            written = [formula.replace(">", end, 1) for formula in self._formulas]
            runs = formulas.Woven(tuple(runs.split(_SLOT)), tuple(written)).html
        return runs.split("\0")

    def read(self, mark: str) -> tuple[Piece, ...]:
        """What a mark is, see `tags.read`."""
        found = self._read.get(mark)
        if found is None:
            found = self._read[mark] = read(mark)
        return found
