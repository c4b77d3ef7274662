"""Callouts: blockquotes whose first line is `[!kind] Optional title`.

`[!kind]- Title` makes one that starts folded.

Entry point: `read_head`, what the first line says.
"""

from __future__ import annotations

import re
from collections.abc import Collection

from msgspec import Struct

from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import Parsed, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt, Span

_HEAD = re.compile(r"\[!([^\]\n]*)\](?![(\[])(-?)([^\n]*)(?:\n|$)")
FALLBACK = "note"
"""What a callout of an unknown kind is read as, so that all in it is still checked."""


class Head(Struct, frozen=True):
    """The first line of a callout, and what follows it in its paragraph."""

    kind: str
    kind_span: Span
    title: Excerpt
    folded: bool
    rest: Excerpt


def read_head(paragraph: Excerpt, known: Collection[str]) -> Parsed[Head] | None:
    """The head of a callout, if a blockquote's first paragraph begins with one.

    Its kind is one that is known, without regard to case.
    """
    found = _HEAD.match(paragraph.text)
    if found is None:
        return None
    written, name, wrong = trim(paragraph.slice(*found.span(1))), FALLBACK, None
    if found[3][:1].strip():
        start = found.start(3)
        message = f"`{found[3][0]}` cannot follow the kind of a callout"
        help = "write `[!kind] Title`, or `[!kind]- Title` for a callout that starts folded"
        wrong = diagnose("callout-unknown", paragraph.span(start, start + 1), message, help=help)
    elif written.text.lower() in known:
        name = written.text.lower()
    else:
        kinds = ", ".join(f"`{kind}`" for kind in sorted(known))
        message = "the kind of this callout is missing"
        message = f"no callout kind `{written.text}`" if written.text else message
        help = did_you_mean(written.text.lower(), known) or f"known: {kinds}"
        wrong = diagnose("callout-unknown", written.span(), message, help=help)
    title, rest = trim(paragraph.slice(*found.span(3))), trim(paragraph.slice(found.end()))
    head = Head(name, written.span(), title, bool(found[2]), rest)
    return Parsed(head, () if wrong is None else (wrong,))
