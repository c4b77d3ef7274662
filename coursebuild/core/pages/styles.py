"""Inline styles turned into classes of the style sheet.

Entry points: `hoist_styles(html)`, which replaces the `style` attributes of a page by classes, and
`style_rules`, the rules of these classes.

The Content-Security-Policy forbids inline styles. Formulas have some (the padding of a matrix's
columns), and so may an author's HTML; each distinct declaration gets a class named after a hash.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterable
from html import escape, unescape

from coursebuild.core.pages.formulas import FORMULA

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
    declarations: set[str] = set()

    def replace(piece: re.Match[str]) -> str:
        if not piece["tag"] or "style" not in piece["tag"].lower():  # as most
            return piece[0]
        tag, declaration = _without_style(piece["tag"])
        if declaration:
            declarations.add(declaration)
        return tag

    parts = FORMULA.split(html)
    if "style" in "".join(parts[::2]).lower():
        return _PIECE.sub(replace, html), frozenset(declarations)
    parts[1::2] = (_PIECE.sub(replace, f) if "style" in f.lower() else f for f in parts[1::2])
    return "".join(parts), frozenset(declarations)


@functools.lru_cache(maxsize=4096)
def _without_style(tag: str) -> tuple[str, str]:
    """A tag, given its inside, with a class instead of its style; and the style, if any."""
    names = {name.lower(): value for name, value in _ATTRIBUTE.findall(tag)}
    if "style" not in names:
        return f"<{tag}>", ""
    declaration = _normal(unescape(names["style"].strip("\"'")))
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


def _normal(declaration: str) -> str:
    """Normalize a declaration; empty for one that would break out of its rule."""
    text = " ".join(declaration.split()).strip("; ")
    quotes = text.count('"') % 2 or text.count("'") % 2
    return "" if quotes or re.search(r"[{}<\\]|/\*", text) else text


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
