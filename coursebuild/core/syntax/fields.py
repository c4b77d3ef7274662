"""Checks of several fields of a declaration together.

Entry points: `has_value`, `require_one_of`, `check_unique`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.core.syntax.nodes import NullNode, ObjectNode
from coursebuild.core.syntax.wording import shorten
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, nearest
from coursebuild.core.text.source import Span


def has_value(node: ObjectNode, name: str) -> bool:
    """Whether a field is there and is not null."""
    value = node.get(name)
    return value is not None and not isinstance(value, NullNode)


def require_one_of(
    node: ObjectNode, type: type[Struct], names: tuple[str, ...], *, only: bool = True
) -> Iterator[Diagnostic]:
    """Report if none of the fields is there or, with `only`, more than one of them."""
    members = [
        member for name in names if (member := node.members.get(name)) and has_value(node, name)
    ]
    if not members and not _has_misspelling(node, type, names):
        choice = ", ".join(f"`{name}`" for name in names[:-1]) + f" or `{names[-1]}`"
        yield diagnose("field-missing", node.mark, f"{choice} is missing")
    for second in members[1:] if only else ():
        first, help = members[0].key, "leave one of them out"
        notes = (Note("the other one is here", first.span),)
        message = f"`{first.value}` and `{second.key.value}` exclude each other"
        yield diagnose("field-value", second.key.span, message, help=help, notes=notes)


def _has_misspelling(node: ObjectNode, type: type[Struct], names: tuple[str, ...]) -> bool:
    """Whether an unknown field is surely a misspelling of one of the names, already reported."""
    return any(nearest(key, names) for key in node.members if key not in type.__struct_fields__)


def check_unique(
    names: Iterable[tuple[str | float, Span]], rule: str, message: str, *, help: str = ""
) -> Iterator[Diagnostic]:
    """Report each name that is repeated; `{}` in the message is the name."""
    first: dict[str | float, Span] = {}
    for name, span in names:
        if first.setdefault(name, span) is not span:
            notes = (Note("the first one is here", first[name]),)
            text = message.format(shorten(name) if isinstance(name, str) else f"{name:g}")
            yield diagnose(rule, span, text, help=help, notes=notes)
