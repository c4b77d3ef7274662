"""Terms across the course: each is defined once.

Entry point: `term_findings`, for some blocks.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from coursebuild.core.model import Block, Term, block_inlines, walk_inlines
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Span


def term_findings(blocks: Iterable[Block], known: Mapping[str, Span]) -> tuple[Diagnostic, ...]:
    """Terms that are defined elsewhere as well; `known` says where each is defined first."""
    found: list[Diagnostic] = []
    for block in blocks:
        for inline in walk_inlines(block_inlines(block)):
            first = known.get(inline.id) if isinstance(inline, Term) else None
            if isinstance(inline, Term) and first is not None and not _same(first, inline.span):
                found.append(
                    diagnose(
                        "term-repeated",
                        inline.span,
                        f"the term `{inline.id}` is defined twice",
                        help="leave one definition, and link to it from here: "
                        f'`[…](term:{inline.id})`; or name this one by `{{term="…"}}`',
                        notes=[Note("the first one is here", first)],
                    )
                )
    return tuple(found)


def _same(one: Span, two: Span) -> bool:
    return (one.path, one.start) == (two.path, two.start)
