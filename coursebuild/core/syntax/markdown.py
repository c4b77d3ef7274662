"""The one configured markdown-it parser.

Entry points: `block_tokens` (a text into block tokens) and `inline_tokens` (a block's content into
inline tokens).

CommonMark with tables, strikethrough, task lists, footnotes and formulas. Links with dangerous
schemes stay links here, so that they can be reported instead of turning into text.
"""

from __future__ import annotations

from typing import cast

from markdown_it import MarkdownIt
from markdown_it.common.utils import normalizeReference
from markdown_it.utils import EnvType

from coursebuild.core.syntax.block_parser import MAX_NESTING, Definitions, block_parser
from coursebuild.core.syntax.inline_parser import Inlines
from coursebuild.core.syntax.spans import BlockState, PositionedToken
from coursebuild.core.text.source import Excerpt


def _configured() -> MarkdownIt:
    md = MarkdownIt("zero", {"html": True, "tasklists": True, "maxNesting": 2 * MAX_NESTING})
    md.block, md.inline = block_parser(), Inlines()
    md.inline.ruler2.disable("fragments_join")
    md.validateLink = lambda url: True  # type: ignore[method-assign]
    return md


_MARKDOWN = _configured()


def block_tokens(base: Excerpt, definitions: Definitions) -> list[PositionedToken]:
    """The block tokens of a text with LF line ends and no NUL.

    Its link definitions are added to `definitions`.
    """
    env: EnvType = {**definitions.environment(), "definitions": definitions, "base": base}
    state = BlockState(base.text, _MARKDOWN, env)
    _MARKDOWN.block.tokenize(state, 0, state.lineMax)
    return cast(list[PositionedToken], state.tokens)


def inline_tokens(text: str, env: EnvType) -> list[PositionedToken]:
    """The inline tokens of a block's content; `env` comes from `Definitions.environment`."""
    tokens = _MARKDOWN.inline.parse(text, _MARKDOWN, env, [])
    return cast(list[PositionedToken], tokens)


def definition_label(text: str) -> str:
    """The form of a link label under which its definition is kept."""
    return normalizeReference(text)
