"""Callouts: blockquotes whose first line is `[!kind] Optional title`.

`[!kind]- Title` makes one that starts folded.

Entry point: `read_head`, which reads the first line.
"""

from __future__ import annotations

import re
from collections.abc import Collection

from msgspec import Struct

from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import Parsed, diagnose, did_you_mean, misspelt
from coursebuild.core.text.source import Excerpt, Span

_HEAD = re.compile(r"\[!([^\]\n]*)\](?![(\[])(-?)([^\n]*)(?:\n|$)")
_BROKEN_HEAD = re.compile(
    r"(?:\w?[^\w\s\\]{0,2}![^\w\s\\]?[ ]?([A-Za-z][\w-]*)[^\w\s(]?+"  # `!note`, `[!note`, `![note]`
    r"|\[([A-Za-z]!\w[\w-]*)\]"  # `[n!ote]`
    r"|\[[^\w\s\\]?([A-Za-z][\w-]*)[!\])}]{1,2}+)-?+(?![(\[:])([^\n]*)(?:\n|$)"  # `[note]`
)
"""A line that was surely meant to be the first of a callout if the word is a kind."""
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
    """The head of a callout, if a blockquote's first paragraph begins with one.

    Its kind is one of `kinds`, without regard to case.
    """
    match = _HEAD.match(paragraph.text)
    if match is None:
        return _read_broken_head(paragraph, kinds)
    name, kind, diagnostic = trim(paragraph.slice(*match.span(1))), FALLBACK, None
    if match[3][:1].strip():
        start = match.start(3)
        message = f"`{match[3][0]}` cannot follow the kind of a callout"
        help = "write `[!kind] Title`, or `[!kind]- Title` for a callout that starts folded"
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


def _read_broken_head(paragraph: Excerpt, kinds: Collection[str]) -> Parsed[Head] | None:
    match = _BROKEN_HEAD.match(paragraph.text)
    if match is None:
        return None
    kind = (match[1] or match[2] or match[3]).replace("!", "").lower()
    if kind not in kinds:
        kind = misspelt(kind, [name for name in kinds if len(name) > 5]) or ""
    if not kind:
        return None
    title = trim(paragraph.slice(*match.span(4)))
    place = trim(paragraph.slice(0, match.start(4)))
    head = Head(kind, place.span(), title, False, trim(paragraph.slice(match.end())))
    help = f"write `> [!{kind}] Title`, or a backslash before the bracket that is meant to be seen"
    message = f"`{place.text}` does not begin a callout"
    return Parsed(head, (diagnose("callout-unknown", place.span(), message, help=help),))
