"""Formulas that were meant and not read: a dollar sign in a text that goes on like TeX.

Entry point: `unread_formula`. `$5` is money and stays so. But a blank inside `$x = $`, or a list
that begins in the middle of a formula because a line of it starts with `+ `, leaves dollar signs
and commands of TeX in the text, where a reader would see them.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.core.text.patterns import pattern

_TEX = pattern(r"\\[A-Za-z]{2,}|[A-Za-z)}\]][_^](?:[0-9]|\{)")
"""A command, an index or an exponent."""
_MEANT = pattern(r"\$(?!\d[\d.,]*(?![\w\\^{]))")
"""A dollar sign that no sum of money follows."""


def unread_formula(texts: Sequence[tuple[int, str]]) -> int | None:
    """Where the first dollar sign of such a formula is.

    `texts` are the texts of a block that are neither code nor formulas nor escaped, each with its
    place in the block's content, in order.
    """
    dollars = [text for _, text in texts if "$" in text]
    if not any(_MEANT.search(text) for text in dollars):
        return None
    parts, end = list[str](), 0
    for at, text in texts:
        parts += ["\0"] * (at > end) + [text]  # what stands between two texts parts them
        end = at + len(text)
    if _TEX.search("".join(parts)) is None:
        return None
    return next(at + text.index("$") for at, text in texts if "$" in text)
