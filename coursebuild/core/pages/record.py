"""Records of drawn pages: what the rest of the site must know of a page.

Inline styles become classes of the style sheet, since the Content-Security-Policy forbids them.
Formulas have some (the padding of a matrix's columns), and so may an author's HTML; each distinct
declaration gets a class named after a hash.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterable
from html import escape, unescape

from msgspec import Struct

from coursebuild.core.pages import fonts, formulas
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.formulas import FORMULA
from coursebuild.core.pages.frame import FRAME_IDS, parts_of
from coursebuild.core.pages.page_inputs import PageHead
from coursebuild.core.pages.references import (
    Reference,
    ids_and_addresses,
    merge_line_ids,
    references,
)
from coursebuild.core.text.characters import visible


class PageRecord(Struct, frozen=True, array_like=True):
    """What the site must know of a page, without its body."""

    kind: str
    """See `PageHead`."""
    title: str
    indexed: bool
    """Whether search engines should list it."""
    text: str
    """Characters of its text, as in `PageFacts`, sorted, like those of formulas."""
    mathematics: str
    declarations: tuple[str, ...]
    """Styles taken out of its elements, sorted."""
    ids: tuple[str, ...]
    """Anchors, sorted; see `references.merge_line_ids`."""
    references: tuple[Reference, ...]
    """The targets of its links, sorted, each once."""
    repeated_ids: tuple[tuple[str, int, int], ...] = ()
    """Ids that several elements have, sorted; each with the start and end of its place in the
    page's document (`PageContext.find_repetition`), or zeros."""
    parts: tuple[str, ...] = ()
    """See `parts_of`."""
    notes: tuple[tuple[str, str], ...] = ()
    """The features' notes of the page: a feature's name and a digest; see `SiteContext`."""


def record(
    head: PageHead, body: str, base_url: str, page: PageContext | None = None
) -> tuple[PageRecord, str]:
    """The record of a page just drawn, and its body as it will be published.

    `page` is the document on it, if any.
    """
    # A plain string, since `Markup` would escape what is inserted.
    html, declarations = hoist_styles(formulas.glue_formulas(str(body)))
    text, mathematics = page_characters(html)
    html = visible(html)
    ids, addresses, repeated_ids = ids_and_addresses(html)
    repeated_ids |= ids & FRAME_IDS
    places: dict[str, tuple[int, int]] = {}
    if page is not None:
        spans = ((name, page.find_repetition(name)) for name in repeated_ids)
        places = {name: (span.start, span.end) for name, span in spans}
    page_record = PageRecord(
        kind=head.kind,
        title=head.title,
        indexed=head.indexed,
        text="".join(sorted(text.union(head.title) - fonts.BASE)),
        mathematics="".join(sorted(mathematics)),
        declarations=tuple(sorted(declarations)),
        ids=tuple(sorted(merge_line_ids(ids))),
        references=tuple(sorted(references(head.path, addresses, base_url))),
        repeated_ids=tuple((name, *places.get(name, (0, 0))) for name in sorted(repeated_ids)),
        parts=parts_of(html, head.kind),
    )
    return page_record, html


# --- inline styles

_INSIDE = r"""(?:[^"'>]++|"[^"]*+(?:"|\Z)|'[^']*+(?:'|\Z))*+"""
_PIECE = re.compile(
    r"<!--.*?(?:-->|\Z)"
    rf"|<(?P<raw>script|style|textarea|title)\b{_INSIDE}(?:\Z|(?<!/)>.*?(?:</(?P=raw)\s*>|\Z))"
    rf"|<(?P<tag>[a-zA-Z]{_INSIDE})(?:>|\Z)",
    re.DOTALL | re.IGNORECASE,
)
"""A comment, an element of raw text, or a tag, so that only real attributes are found. What never
ends takes the rest of the page, as in browsers."""

_ATTRIBUTE = re.compile(r"""\s+([^\s"'>/=]+)(?:\s*=\s*("[^"]*"|'[^']*'|[^\s"'=<>`]+))?""")


def hoist_styles(html: str) -> tuple[str, frozenset[str]]:
    """Replace `style` attributes by classes; return the page and the declarations.

    Most pages have some in their formulas only, and then nothing else is looked at.
    """
    parts = FORMULA.split(html)
    if "style" in "".join(parts[::2]).lower():
        return _hoist_all.__wrapped__(html)
    declarations: set[str] = set()
    for at in range(1, len(parts), 2):
        if "style" in parts[at].lower():
            parts[at], formula_declarations = _hoist_all(parts[at])
            declarations |= formula_declarations
    return "".join(parts), frozenset(declarations)


@functools.lru_cache(maxsize=512)
def _hoist_all(html: str) -> tuple[str, frozenset[str]]:
    """The same, wherever they stand; kept for formulas, which pages repeat."""
    declarations: set[str] = set()

    def replace(piece: re.Match[str]) -> str:
        if not piece["tag"] or "style" not in piece["tag"].lower():  # as most
            return piece[0]
        tag, declaration = _without_style(piece["tag"])
        if declaration:
            declarations.add(declaration)
        return tag

    return _PIECE.sub(replace, html), frozenset(declarations)


@functools.lru_cache(maxsize=4096)
def _without_style(tag: str) -> tuple[str, str]:
    """A tag, given its inside, with a class instead of its style; and the style, if any."""
    names = {name.lower(): value for name, value in _ATTRIBUTE.findall(tag)}
    if "style" not in names:
        return f"<{tag}>", ""
    text = " ".join(unescape(names["style"].strip("\"'")).split()).strip("; ")
    quotes = text.count('"') % 2 or text.count("'") % 2
    declaration = "" if quotes or re.search(r"[{}<\\]|/\*", text) else text
    classes = [unescape(names.get("class", "").strip("\"'"))]
    if declaration:
        classes.append(class_name(declaration))
    value = escape(" ".join(filter(None, classes)))
    return f"<{_with_class(tag, value)}>", declaration


def class_name(declaration: str) -> str:
    """The name of the class of a declaration."""
    return "s" + hashlib.sha256(declaration.encode()).hexdigest()[:7]


def style_rules(declarations: Iterable[str]) -> str:
    """The rules of the classes, sorted."""
    rules = sorted(
        f".{class_name(declaration)}{{{declaration}}}" for declaration in set(declarations)
    )
    return "".join(f"{rule}\n" for rule in rules)


def _with_class(tag: str, value: str) -> str:
    """The inside of a tag with `class="value"` in place of its `style` and `class`."""
    has_class = False

    def replace(match: re.Match[str]) -> str:
        nonlocal has_class
        if match[1].lower() not in ("style", "class"):
            return match[0]
        if has_class or not value:
            return ""
        has_class = True
        return f' class="{value}"'

    return _ATTRIBUTE.sub(replace, tag)


# --- characters

_TEXT = re.compile(">([^<]+)")
_FOREIGN = re.compile(r"[^\x00-\x7f]")


def page_characters(html: str) -> tuple[frozenset[str], frozenset[str]]:
    """The characters outside ASCII of a page's text and of its formulas; see `PageFacts`."""
    parts = FORMULA.split(html)
    text, mathematics = _characters(parts[::2]), _characters(parts[1::2])
    return text, mathematics | {" "} if len(parts) > 1 else mathematics


def _characters(parts: Iterable[str]) -> frozenset[str]:
    """The characters outside ASCII of the text of pieces of HTML."""
    html = ">" + "\n".join(parts)
    texts = _TEXT.findall(html)
    texts.append(html.rpartition(">")[2])  # with a tag that nothing ends
    return frozenset(_FOREIGN.findall(unescape("\n".join(texts))))
