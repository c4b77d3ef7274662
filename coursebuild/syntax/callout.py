"""Callouts: blockquotes whose first line is `[!kind] Optional title`, or `[!kind]- Title` for one that starts folded.

Entry points: `read_head` (what the first line says), `resolve` (the kind that it names).
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from coursebuild.diagnostics import Parsed, diagnose, did_you_mean
from coursebuild.source import Excerpt
from coursebuild.syntax.spans import trimmed

_HEAD = re.compile(r"\[!([^\]\n]*)\](-?)(?=[ \t]|\n|$)([^\n]*)(?:\n|$)")
FALLBACK = "note"
"""What a callout of an unknown kind is read as, so that all in it is still checked."""


@dataclass(frozen=True, slots=True)
class Head:
    """The first line of a callout, and what follows it in its paragraph."""

    kind: Excerpt
    folded: bool
    title: Excerpt
    rest: Excerpt


def read_head(paragraph: Excerpt) -> Head | None:
    """The head of a callout, if a blockquote's first paragraph begins with one."""
    found = _HEAD.match(paragraph.text)
    if found is None:
        return None
    return Head(
        trimmed(paragraph.slice(found.start(1), found.end(1))),
        bool(found[2]),
        trimmed(paragraph.slice(found.start(3), found.end(3))),
        trimmed(paragraph.slice(found.end())),
    )


def resolve(kind: Excerpt, known: Collection[str]) -> Parsed[str]:
    """The known kind that is meant, without regard to case."""
    name = kind.text
    if name in known:
        return Parsed(name)
    for candidate in sorted(known):
        if candidate.casefold() == name.casefold():
            return Parsed(candidate)
    message = f"no callout kind `{name}`" if name else "the kind of this callout is missing"
    help = did_you_mean(name.lower(), known) or "known: " + ", ".join(
        f"`{k}`" for k in sorted(known)
    )
    return Parsed(FALLBACK, (diagnose("callout-unknown", kind.span(), message, help=help),))
