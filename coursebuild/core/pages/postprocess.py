"""The text of a page as it will be published, and what the rest of the site must know of it.

Entry point: `postprocess_html(html)`.

1. Formulas are set to what stands beside them (`formulas.glue`), styles in single elements become
   classes (`styles.hoist`), and forbidden characters are made visible (`characters.visible`).
2. Of what is left, the characters, the anchors and the addresses are noted.

Nearly all pages are written as we and Temml write them. Such a page is cut at its formulas: each of
these is looked at once, however often it stands there, and the rest in a single pass. The others
are looked at more closely, once for each of these questions.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from html import unescape

from msgspec import Struct

from coursebuild.core.pages import formulas, links, styles
from coursebuild.core.pages.characters import RARE, visible
from coursebuild.core.pages.shared import page_characters
from coursebuild.core.text.patterns import pattern

_REMEMBERED = 256
"""Formulas: a page says the same ones again and again, the next one others."""


class ProcessedHtml(Struct, frozen=True):
    """See the module."""

    html: str
    text: frozenset[str]
    """Characters of its text, but most of those of ASCII."""
    mathematics: frozenset[str]
    """Characters of its formulas, but those of ASCII; a blank where there is a formula."""
    declarations: frozenset[str]
    """Styles that were written in its elements."""
    ids: frozenset[str]
    addresses: frozenset[str]
    """As they are written, but for character references."""


def postprocess_html(html: str) -> ProcessedHtml:
    """A page that was just drawn, or a part of one that is whole elements."""
    html = str(html)  # `Markup` would escape what is put into it
    made = _quickly(html)
    return _closely(html) if made is None else made


def _closely(html: str) -> ProcessedHtml:
    """Any text, each thing by itself."""
    html, declarations = styles.hoist(formulas.glue(html))
    text, mathematics = page_characters(html)
    html = visible(html)
    ids, addresses = links.ids_and_addresses(html)
    return ProcessedHtml(html, text, mathematics, declarations, ids, addresses)


# --- a page as nearly all are

_TEXT = rf'[\t\n -!#-;=?-~]*+[^\x00-\x08\x0b-\x1f"<>{RARE}]*+'
"""ASCII, as nearly all is, is tried by itself: of the whole class that takes longer."""
_NOTED = "(?:id|name|href|src|srcset|data|poster|style)"
_NAME = "[a-z0-9_:-]++(?:Box)?+"
"""Also of the one attribute of drawings in which case counts: `viewBox`."""
_ANY = rf'(?: {_NAME}(?:="{_TEXT}")?)'
_OTHER = rf"(?:(?! {_NOTED}[= />]){_ANY})"
_WITH = rf"(?:(?! {_NOTED}[ />]){_ANY})"
_PLAIN = r"[\t\n -%'-;=-~]*+"
_REMARK = r"!-- [\t\n !#-,.-;=?-~]++(?:-[\t\n !#-,.-;=?-~]++)*+-->"
_TAG = (
    r"(?!s(?:cript|tyle)\b|t(?:extarea\b|itle\b(?!(?![^<>]* style)[^<>]*+>[^<]*+</title>))"
    r"|plaintext\b|xmp\b|iframe\b|no(?:embed|frames)\b)[a-z][a-z0-9]*+"
)
"""Of an element that cannot hold what only looks like tags: a title does not, if it ends at once.
"""
_LOOK = pattern(
    rf"(?:{_PLAIN}<(?:/[a-z][a-z0-9]*+>|{_REMARK}|{_TAG}"
    rf'(?:>| class="{_TEXT}">|{_OTHER}*+ ?/?>)))*+{_PLAIN}'
    rf'(?:<({_TAG}){_OTHER}*+ ({_NOTED})="({_TEXT})"({_WITH}*+) ?/?>'
    r"|([^\x00-\x7f]++|&(?:[a-zA-Z0-9]{1,30}|#[0-9]{1,30}|#[xX][0-9a-fA-F]{1,29});|[\x00-\x7f]))?"
)
"""Passes over what needs no note, up to a tag with a noted attribute (its name, that of the
attribute, the value, and other attributes), or to what is not ASCII, a character reference, or
else a character with which begins what pages have rarely. No place is passed over but by these.
"""
_ATTRIBUTE = pattern(rf' ({_NOTED})="({_TEXT})"|{_ANY}')
_ALLOWED = pattern(rf"[^\x00-\x7e{RARE}]*+")
_BETWEEN = "<b>"
"""Stands for a formula: a tag that was not closed before it does not become one with what follows.
"""


class _Notes:
    """What was found in texts that are written as nearly all are."""

    def __init__(self) -> None:
        self.characters: set[str] = set()
        self.ids: set[str] = set()
        self.addresses: set[str] = set()
        self.styled = False
        """Whether there are styles in elements."""

    def take(self, html: str) -> bool:
        """Note what is in a text; whether it is written so."""
        for tag, name, value, more, sign in _LOOK.findall(html):
            if name == "id":
                self.ids.add(unescape(value) if "&" in value else value)
            elif name:
                self._attribute(tag, name, value)
            elif sign[-1:] == ";":
                self.characters.update(unescape(sign))
            elif sign.isascii():
                if sign:
                    return False
            elif _ALLOWED.fullmatch(sign):
                self.characters.update(sign)
            else:
                return False
            for one in _noted(more) if more else ():
                self._attribute(tag, *one)
        return True

    def _attribute(self, tag: str, name: str, value: str) -> None:
        if name == "style":
            self.styled = True
        else:
            ids, addresses = links.attribute_targets(
                tag, name, unescape(value) if "&" in value else value
            )
            self.ids.update(ids)
            self.addresses.update(addresses)


@functools.lru_cache(maxsize=256)
def _noted(attributes: str) -> tuple[tuple[str, str], ...]:
    """The noted ones among attributes."""
    found = _ATTRIBUTE.findall(attributes)
    return tuple((name, value) for name, value in found if name)


class _Formula(Struct, frozen=True):
    """What is between the ends of a `math` element, processed."""

    inside: str
    characters: frozenset[str]
    declarations: frozenset[str]
    ids: frozenset[str]
    addresses: frozenset[str]


def _quickly(html: str) -> ProcessedHtml | None:
    """The same for a page that is written as nearly all are; `None` for others."""
    cut = formulas.cut(html)
    if cut is None:
        return None
    texts, inside = cut
    found = _formulas(texts, inside)
    texts = formulas.kept_together(texts, inside)
    notes = _Notes()
    if found is None or not notes.take(_BETWEEN.join(texts)):
        return None
    mathematics, declarations = {" "} if found else set[str](), set[str]()
    for one in found:
        mathematics |= one.characters
        declarations |= one.declarations
        notes.ids |= one.ids
        notes.addresses |= one.addresses
    if notes.styled:
        hoisted = [styles.hoist(text, plain=True) for text in texts]
        texts = [text for text, _ in hoisted]
        declarations.update(*(more for _, more in hoisted))
    parts = [texts[0]]
    for one, text in zip(found, texts[1:], strict=True):
        parts += ("<math", one.inside, "</math>", text)
    return ProcessedHtml(
        "".join(parts),
        frozenset(notes.characters),
        frozenset(mathematics),
        frozenset(declarations),
        frozenset(notes.ids),
        frozenset(notes.addresses),
    )


def _formulas(texts: Sequence[str], inside: Sequence[str]) -> list[_Formula] | None:
    """The formulas between texts, of which each is set to the spaces beside it."""
    found: list[_Formula] = []
    for number, one in enumerate(inside):
        made = _formula(one, texts[number][-1:].isspace(), texts[number + 1][:1].isspace())
        if made is None:
            return None
        found.append(made)
    return found


@functools.lru_cache(maxsize=_REMEMBERED)
def _formula(inside: str, before: bool, after: bool) -> _Formula | None:
    """A formula beside spaces of the text, or not; `None` if it is not written as most are."""
    notes = _Notes()
    inside = formulas.tight(inside, before=before, after=after)
    if not notes.take(f"<math{inside}</math>"):
        return None
    declarations = frozenset[str]()
    if notes.styled:
        whole, declarations = styles.hoist(f"<math{inside}</math>", plain=True)
        inside = whole.removeprefix("<math").removesuffix("</math>")
    characters = frozenset(c for c in notes.characters if not c.isascii())
    ids, addresses = frozenset(notes.ids), frozenset(notes.addresses)
    return _Formula(inside, characters, declarations, ids, addresses)
