"""Inlines that may stand inside a link, or on another page than their own.

Entry point: `without_links`.
"""

from __future__ import annotations

from coursebuild.core import model


def without_links(inlines: tuple[model.Inline, ...]) -> tuple[model.Inline, ...]:
    """The inlines without links, terms, footnotes, raw HTML and pictures, in one line."""
    kept: list[model.Inline] = []
    for inline in inlines:
        match inline:
            case model.Link() | model.Term():
                kept += without_links(inline.children)
            case model.Emphasis() | model.Strong() | model.Strikethrough():
                kept.append(type(inline)(inline.span, without_links(inline.children)))
            case model.Image():
                kept.append(model.Text(inline.span, inline.alt))
            case model.SoftBreak() | model.HardBreak():
                kept.append(model.Text(inline.span, " "))
            case model.RawInline() | model.FootnoteRef():
                pass
            case _:
                kept.append(inline)
    return tuple(kept)
