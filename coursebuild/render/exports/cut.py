"""HTML cut at what must be looked at when it is brought to another place.

Entry point: `cut(html)`.

Most of a page is the same everywhere: text whose references are those of XML, coloured words of
code, formulas as we write them. That goes in runs, which one regular expression finds; marks are
what stands between them. Whether the tags of formulas fit each other is told by expat, in a tenth
of the time that reading them here takes. Where they do not, an author has written one, and the tags
of all are marks.
"""

from __future__ import annotations

import pyexpat
import re

from coursebuild.patterns import pattern
from coursebuild.render.exports.tags import MARK, Piece, read

MATHML = "http://www.w3.org/1998/Math/MathML"
_TEXT = "[^<>&\\x00-\\x08\\x0b-\\x1f\ud800-\udfff\ufffe\uffff]"
"""A character of a run. What XML forbids is none, and a carriage return, which it makes another."""
_VALUE = _TEXT.replace("<", '<"')
_TEXTS = f"(?:{_TEXT}++|&(?:lt|gt|amp);)*+"
_WORD = (
    f'span class="(?:[a-z]|bound|held)">{_TEXTS}</span>'
    f"|code>{_TEXTS}</code>|em>{_TEXTS}</em>|strong>{_TEXTS}</strong>"
)
_LINE = (
    'span id="[a-zA-Z_][a-zA-Z0-9_.-]*+">'
    f'(?:{_TEXT}++|&(?:lt|gt|amp);|<span class="[a-z]">{_TEXTS}</span>)*+</span>'
)
_ELEMENTS = (
    "annotation|semantics|m(?:i|n|o|s|row|space|frac|sub|sup|subsup|text|style|td|tr|table|over"
    "|under|underover|sqrt|root|padded|phantom|enclose)"
)
_CLASS = "(?:(?:tml|chr|wbk)-[a-z-]++|math[a-z]++|s[0-9a-f]{7})"
"""Of a formula; the last is of a style."""
_CLASSES = f'class="{_CLASS}(?: {_CLASS})*+"'
_ATTRIBUTES = (
    f"{_CLASSES}|(?:accent|accentunder|columnalign|columnlines|columnspacing|depth|displaystyle"
    "|encoding|fence|form|height|linethickness|lspace|mathvariant|maxsize|minsize|movablelimits"
    "|notation|rowlines|rowspacing|rspace|scriptlevel|separator|stretchy|symmetric|voffset|width)"
    f'="{_VALUE}*+"'
)
_MATH = f'math(?: display="block" {_CLASSES})?+'
_FORMULA = (
    f"{_MATH}>(?:{_TEXT}++|&(?:lt|gt|amp);|</?(?:{_ELEMENTS})(?: (?:{_ATTRIBUTES}))*+/?>)*+</math>"
)
_CUT = rf"((?:{_TEXT}++|&(?:lt|gt|amp);|<(?:{_WORD}|{_LINE}|%s))*+)({MARK}|.[^<]*+|\Z)"
_WITH_FORMULAS = pattern(_CUT % _FORMULA, re.DOTALL)
_WITHOUT = pattern(_CUT % "(?!)", re.DOTALL)
_OPENED = pattern(f"<{_MATH}(?=>)")


class Cut:
    """A text that was cut."""

    def __init__(self, html: str) -> None:
        parts = _WITH_FORMULAS.findall(html)
        if not _fit("".join([run for run, _, _ in parts if "<math" in run])):
            parts = _WITHOUT.findall(html)
        self.parts: list[tuple[str, str, str]] = parts
        """Runs, each with what follows it: a mark, or text that is no run; the third is no use."""
        self._read: dict[str, tuple[Piece, ...]] = {}

    def read(self, mark: str) -> tuple[Piece, ...]:
        """What a mark is, see `tags.read`."""
        found = self._read.get(mark)
        if found is None:
            found = self._read[mark] = read(mark)
        return found


def _fit(runs: str) -> bool:
    """Whether the tags in them do."""
    try:
        pyexpat.ParserCreate().Parse(f"<r>{runs}</r>", True)
    except pyexpat.ExpatError:
        return False
    return True


def moved(run: str, prefix: str, *, xml: bool) -> str:
    """A run in its new place: `prefix` is put before its ids."""
    if prefix and "<span id" in run:
        run = run.replace('<span id="', f'<span id="{prefix}')
    if xml and "<math" in run:
        run = _OPENED.sub(rf'\g<0> xmlns="{MATHML}"', run)
    return run
