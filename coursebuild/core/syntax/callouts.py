"""The first line of a callout: its kind, its title, and whether it starts folded."""

from __future__ import annotations

from collections.abc import Collection

from msgspec import Struct

from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import Fix, Parsed, diagnose, did_you_mean
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

_HEAD = regex(r"\[!([^\]\n]*)\](?![(\[])(-?)([^\n]*)(?:\n|$)")
FALLBACK = "note"
"""The kind that a callout of an unknown kind gets, so that its content is still checked."""


class Head(Struct, frozen=True):
    """The first line of a callout, and what follows it in its paragraph."""

    kind: str
    kind_span: Span
    title: Excerpt
    folded: bool
    rest: Excerpt


def read_head(paragraph: Excerpt, kinds: Collection[str]) -> Parsed[Head] | None:
    """The head of a callout, if a quotation's first paragraph begins with one of `kinds`."""
    match = _HEAD.match(paragraph.text)
    if match is None:
        return None
    name, kind, diagnostic = trim(paragraph.slice(*match.span(1))), FALLBACK, None
    if match[3][:1].strip():
        start = match.start(3)
        message = f"`{match[3][0]}` cannot follow the kind of a callout"
        help = "write `[!kind] Title`, or `[!kind]- Title` for a callout that starts folded"
        help = Fix(help, "" if match[3][0] == "+" else None, safe=True)  # it starts unfolded
        place = paragraph.span(start, start + 1)
        diagnostic = diagnose("callout-unknown", place, message, help=help)
    elif name.text.lower() in kinds:
        kind = name.text.lower()
    else:
        choice = ", ".join(f"`{kind}`" for kind in sorted(kinds))
        message = "the kind of this callout is missing"
        message = f"no callout kind `{name.text}`" if name.text else message
        help = did_you_mean(name.text.lower(), kinds) or f"known: {choice}"
        diagnostic = diagnose("callout-unknown", name.span(), message, help=help)
    title, rest = trim(paragraph.slice(*match.span(3))), trim(paragraph.slice(match.end()))
    head = Head(kind, name.span(), title, bool(match[2]), rest)
    return Parsed(head, () if diagnostic is None else (diagnostic,))
