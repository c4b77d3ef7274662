"""What an author meant and nothing read: formulas, bound numbers, and markup of other tools.

Entry points: `unread_markup`; `unread_formula`, a part of it. A page would show all of these as
they are written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

_TEX = re.compile(r"\\[A-Za-z]{2,}|[A-Za-z)}\]][_^](?:[0-9]|\{)")
"""A command, an index or an exponent."""
_MEANT = re.compile(r"\$(?!\d[\d.,]*(?![\w\\^{]))")
"""A dollar sign that no sum of money follows."""
_MATH_HELP = (
    "in `$x$` no blank stands inside the dollar signs, no digit follows the last one, and no line "
    "of a formula begins as a list item does (`+ `, `- `); write `\\$` for a dollar sign"
)

_FOREIGN = re.compile(
    r"(?P<binding>(?P<number>(?<![\w.])[-+\u2212]?\d[\w.,]*)?\{(?:out|given)\b[^{}\n\0]*\})"
    r"|(?P<wiki>\[\[[^\[\]\n\0]+\]\])"
    r"|(?P<template>\{\{[^{}\n\0]*\}\}|\{%[^%\n\0]*%\})"
    r"|^ {0,3}(?P<admonition>(?:!!!|\?\?\?\+?)[ \t]+[\w-]+|:{3,}[ \t]*\{?[\w-]+\}?)",
    re.MULTILINE,
)


def unread_markup(content: Excerpt, texts: Sequence[tuple[int, str]]) -> Iterator[Diagnostic]:
    """What stands unread in a block's content.

    `texts` are its texts that are neither code nor formulas nor escaped, each with its place in the
    content, in order.
    """
    dollar = unread_formula(texts)
    if dollar is not None:
        what = "a dollar sign and TeX stand in the text: no formula was read here"
        yield diagnose("math-unread", content.span(dollar, dollar + 1), what, help=_MATH_HELP)
    yield from _foreign(content, texts)


def unread_formula(texts: Sequence[tuple[int, str]]) -> int | None:
    """Where the first dollar sign of a formula is that was not read.

    `$5` is money and stays so. But a blank inside `$x = $`, or a list that begins in the middle of
    a formula because a line of it starts with `+ `, leaves dollar signs and commands of TeX in the
    text.
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


def _foreign(content: Excerpt, texts: Sequence[tuple[int, str]]) -> Iterator[Diagnostic]:
    """Markup that another tool would read."""
    whole = content.text
    if not any(sign in whole for sign in ("{", "[[", "!!!", "???", ":::")):
        return
    parts, end = list[str](), 0
    for at, text in texts:
        parts += [_blank(whole[end:at]), text]
        end = at + len(text)
    for found in _FOREIGN.finditer("".join(parts)):
        if found["binding"] and whole[: found.start()].endswith("`"):
            continue  # it stands behind code: why it binds nothing is told already
        kind = found.lastgroup
        written = found[kind or 0].rstrip()
        span = content.span(found.start(kind or 0), found.start(kind or 0) + len(written))
        match kind:
            case "binding":
                number = found["number"] or ""
                what = f"`{written}` marks no number, and is shown as it is written"
                bound = f"`` `{number or '4.47'}`{written.removeprefix(number)} ``"
                help = f"put the number into backticks: {bound}"
                yield diagnose("binding-attribute", span, what, help=help)
            case "wiki":
                what = f"`{written}` is no link, and is shown as it is written"
                help = "a link to a lesson is `[its title](lesson:1.2)`"
                yield diagnose("markup-foreign", span, what, help=help)
            case "template":
                what = f"`{written}` is shown as it is written: lessons are not templates"
                help = "put it into backticks if readers are to see it"
                yield diagnose("markup-foreign", span, what, help=help)
            case _:
                what = f"`{written}` begins no callout, and is shown as it is written"
                name = written.strip("!?+: \t{}").lower()
                help = f"a callout is a quotation: `> [!{name}]`, and `> ` before each line of it"
                yield diagnose("markup-foreign", span, what, help=help)


def _blank(text: str) -> str:
    """What stands for other than text: as long, with the line ends."""
    return "\n".join("\0" * len(line) for line in text.split("\n"))
