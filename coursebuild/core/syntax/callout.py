"""Callouts: blockquotes whose first line is `[!kind] Optional title`.

`[!kind]- Title` makes one that starts folded.

Entry points: `read_head` (what the first line says), `resolve` (the kind that it names).
"""

from __future__ import annotations

import re
from collections.abc import Collection

from msgspec import Struct

from coursebuild.core.syntax.spans import trimmed
from coursebuild.core.text.diagnostics import Parsed, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt, Span

_HEAD = re.compile(r"\[!([^\]\n]*)\](?![(\[])(-?)([^\n]*)(?:\n|$)")
FALLBACK = "note"
"""What a callout of an unknown kind is read as, so that all in it is still checked."""


class Head(Struct, frozen=True):
    """The first line of a callout, and what follows it in its paragraph."""

    kind: Excerpt
    folded: bool
    stray: Span | None
    """What stands between the kind and the title and is neither a space nor the mark that folds."""
    title: Excerpt
    rest: Excerpt


def read_head(paragraph: Excerpt) -> Head | None:
    """The head of a callout, if a blockquote's first paragraph begins with one."""
    found = _HEAD.match(paragraph.text)
    if found is None:
        return None
    start = found.start(3)
    stray = found[3][:1].strip() != ""
    return Head(
        trimmed(paragraph.slice(found.start(1), found.end(1))),
        bool(found[2]),
        paragraph.span(start, start + 1) if stray else None,
        trimmed(paragraph.slice(found.start(3), found.end(3))),
        trimmed(paragraph.slice(found.end())),
    )


def resolve(head: Head, known: Collection[str]) -> Parsed[str]:
    """The known kind that is meant, without regard to case."""
    name = head.kind.text
    if head.stray is not None:
        message = f"`{head.stray.text}` cannot follow the kind of a callout"
        help = "write `[!kind] Title`, or `[!kind]- Title` for a callout that starts folded"
        return Parsed(FALLBACK, (diagnose("callout-unknown", head.stray, message, help=help),))
    if name.lower() in known:
        return Parsed(name.lower())
    message = f"no callout kind `{name}`" if name else "the kind of this callout is missing"
    help = did_you_mean(name.lower(), known) or "known: " + ", ".join(
        f"`{k}`" for k in sorted(known)
    )
    return Parsed(FALLBACK, (diagnose("callout-unknown", head.kind.span(), message, help=help),))
