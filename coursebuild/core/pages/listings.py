"""The lines of a listing, each of which can be linked to.

Entry point: `numbered(lines, path, first)`. No highlighted token reaches over the end of a line, so
that every line can be an element of its own; its number is in its anchor and nowhere in the text,
so that it is neither copied nor read out.
"""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup, escape

from coursebuild.core.model import line_anchor


def numbered(lines: Sequence[Markup], path: str, first: int = 1) -> Markup:
    """Lines of the file at a path, from its line `first` on, as HTML without the last line end."""
    start, _, _ = line_anchor(path, first).rpartition(str(first))
    before = f'<span id="{escape(start)}'
    return Markup("\n".join(f'{before}{n}">{line}</span>' for n, line in enumerate(lines, first)))
