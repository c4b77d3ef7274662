"""Inlines that may stand inside a link, or on another page than their own.

Entry point: `without_links`.
"""

from __future__ import annotations

from coursebuild.core.model import (
    Emphasis,
    FootnoteRef,
    HardBreak,
    Image,
    Inline,
    Link,
    RawInline,
    SoftBreak,
    Strikethrough,
    Strong,
    Term,
    Text,
)


def without_links(inlines: tuple[Inline, ...]) -> tuple[Inline, ...]:
    """The inlines without links, terms, footnotes, raw HTML and pictures, in one line."""
    kept: list[Inline] = []
    for inline in inlines:
        match inline:
            case Link() | Term():
                kept += without_links(inline.children)
            case Emphasis() | Strong() | Strikethrough():
                kept.append(type(inline)(inline.span, without_links(inline.children)))
            case Image():
                kept.append(Text(inline.span, inline.alt))
            case SoftBreak() | HardBreak():
                kept.append(Text(inline.span, " "))
            case RawInline() | FootnoteRef():
                pass
            case _:
                kept.append(inline)
    return tuple(kept)
