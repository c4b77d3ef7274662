"""Small things that are asked of the tree of a text.

Entry points: `joined`, `flat`, `language_of`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from coursebuild.render.packages.tree import Content, Node

_LANGUAGE = re.compile(r"[A-Za-z]{1,8}(?:-[A-Za-z0-9]{1,8})*")


def language_of(node: Node) -> dict[str, str]:
    """An attribute for the language that an element says it is in, if it says one."""
    said = node.attributes.get("lang", "")
    return {"xml:lang": said} if _LANGUAGE.fullmatch(said) else {}


def flat(node: Node, name: str) -> Iterator[Node]:
    """The elements in one, those in groups of a name as well."""
    for child in node.elements:
        if child.name == name:
            yield from flat(child, name)
        else:
            yield child


def joined(content: Iterable[Content]) -> list[Content]:
    """Content in which formulas that were cut so that a line may break in them are whole again."""
    made: list[Content] = []
    for child in _without_spans(content):
        last = made[-1] if made else None
        if isinstance(child, Node):
            child = Node(child.name, child.attributes, joined(child.children))
        if _is_formula(child) and _is_formula(last):
            assert isinstance(last, Node) and isinstance(child, Node)
            made[-1] = Node("math", last.attributes, [*last.children, *child.children])
        else:
            made.append(child)
    return made


def _without_spans(content: Iterable[Content]) -> Iterator[Content]:
    """Content without boxes that say nothing by themselves."""
    for child in content:
        if isinstance(child, Node) and child.name == "span" and not language_of(child):
            yield from _without_spans(child.children)
        else:
            yield child


def _is_formula(content: Content | None) -> bool:
    return (
        isinstance(content, Node)
        and content.name == "math"
        and content.attributes.get("display") != "block"
    )
