"""Styles that are written in single elements, as classes of the style sheet.

Entry points: `hoist(html)`, which takes `style` attributes out of a page's text, and `style_rules`,
the rules that take their place.

The page's Content-Security-Policy allows no style in the page. Formulas come with some (the padding
of a matrix's columns), and so may an author's HTML; each different declaration gets one class,
named by its content.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterable
from html import escape, unescape

_PIECE = re.compile(
    r"""<!--.*?-->"""
    r"""|<(?P<raw>script|style|textarea|title)\b(?:[^"'>]|"[^"]*"|'[^']*')*>.*?</(?P=raw)\s*>"""
    r"""|<(?P<tag>[a-zA-Z](?:[^"'>]|"[^"]*"|'[^']*')*)>""",
    re.DOTALL | re.IGNORECASE,
)
"""A comment, an element of raw text, or a tag: nothing that only looks like an attribute is taken
for one."""

_OTHERS = re.compile(
    r"""(?:[^<]++|<(?![a-z]|!--)"""
    r"""|<(?!(?:script|style|textarea|title)\b|[^<>]*style)"""
    r"""[a-z](?:[^"'<>]++|"[^"<>]*+"|'[^'<>]*+')*+>)*+""",
    re.IGNORECASE,
)
"""What has no style in it: texts, end tags, most tags. Where it ends, `_PIECE` may begin."""

_ATTRIBUTE = re.compile(r"""\s+([^\s"'>/=]+)(?:\s*=\s*("[^"]*"|'[^']*'|[^\s"'=<>`]+))?""")


def hoist(html: str) -> tuple[str, frozenset[str]]:
    """The page with classes in place of `style` attributes, and what they stand for."""
    found: set[str] = set()
    parts: list[str] = []
    at = 0
    while at < len(html):
        others = _OTHERS.match(html, at)
        end = at if others is None else others.end()
        piece = _PIECE.match(html, end)
        if piece is None:
            parts.append(html[at : end + 1])
            at = end + 1
        else:
            tag, declaration = _without_style(piece["tag"]) if piece["tag"] else (piece[0], "")
            if declaration:
                found.add(declaration)
            parts += (html[at:end], tag)
            at = piece.end()
    return "".join(parts), frozenset(found)


@functools.lru_cache(maxsize=4096)
def _without_style(tag: str) -> tuple[str, str]:
    """The tag with this inside with a class in place of its style, and the style, if it has one."""
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
    """The class of a declaration."""
    return "s" + hashlib.sha256(declaration.encode()).hexdigest()[:7]


def style_rules(declarations: Iterable[str]) -> str:
    """The rules of the classes, in the order of their names."""
    rules = sorted(
        f".{class_name(declaration)}{{{declaration}}}" for declaration in set(declarations)
    )
    return "".join(f"{rule}\n" for rule in rules)


def _normal(declaration: str) -> str:
    """One spelling of a declaration; empty for one that would reach out of its rule."""
    text = " ".join(declaration.split()).strip("; ")
    quotes = text.count('"') % 2 or text.count("'") % 2
    return "" if quotes or re.search(r"[{}<\\]|/\*", text) else text


def _with_class(tag: str, value: str) -> str:
    """The inside of a tag with `class="value"` in place of its `style` and `class`."""
    placed = False

    def replace(match: re.Match[str]) -> str:
        nonlocal placed
        if match[1].lower() not in ("style", "class"):
            return match[0]
        if placed or not value:
            return ""
        placed = True
        return f' class="{value}"'

    return _ATTRIBUTE.sub(replace, tag)
