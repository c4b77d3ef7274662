"""Markup that is shown as it is written: broken formulas and bindings, and that of other tools.

Entry point: `check_unread_markup`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from coursebuild.core.syntax.wording import shorten
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

_TEX = re.compile(r"\\[A-Za-z]{2,}|[A-Za-z)}\]][_^](?:[0-9]|\{)")
"""A command, an index or an exponent."""
_DOLLAR = re.compile(r"\$(?!\d[\d.,]*(?![\w\\^{]))")
"""A dollar sign that no amount of money follows."""
_MATH_HELP = (
    "in `$x$` no blank stands inside the dollar signs, no digit follows the last one, and no line "
    "of a formula begins as a list item does (`+ `, `- `); write `\\$` for a dollar sign"
)

_ESCAPED_BRACKETS = re.compile(r"(?:\\[()\[\]]|\s)+")
_SIGNS = re.compile(r"[{\[\\$]|==|!!!|\?\?\?|:::")
"""Characters of which unread markup has at least one."""
_NUMBER = r"(?<![\w.])[-+\u2212]?\d[\w.,]*"
_FOREIGN: dict[str, tuple[str, str, str]] = {
    "binding": (
        rf"(?:{_NUMBER})?\{{(?:out|given)\b[^{{}}\n\0]*\}}",
        "marks no number, and is shown as it is written",
        "put the number into backticks: `` `4.47`{out} ``",
    ),
    "wiki": (
        r"(?<!\\)\[\[[^\[\]\n\0]+\]\]",
        "is no link, and is shown as it is written",
        "a link to a lesson is `[its title](lesson:1.2)`",
    ),
    "template": (
        r"\{\{[^{}\n\0]*\}\}|\{%[^%\n\0]*%\}",
        "is shown as it is written: lessons are not templates",
        "put it into backticks if readers are to see it",
    ),
    "callout": (
        r"^ {0,3}(?:(?:!!!|\?\?\?\+?)[ \t]+[\w-]+|:{3,}[ \t]*\{?[\w-]+\}?)|\A\[![\w-]+\]",
        "begins no callout, and is shown as it is written",
        "a callout is a quotation: `> [!note]`, and `> ` before each line of it",
    ),
    "latex": (
        # What stands between brackets holds none, so that each is looked at once.
        r"\\\((?:(?:(?!\\[()])[^\n\\^_=+])*+[\\^_=+](?:(?!\\[()])[^\n])*+|[ ]?[A-Za-z][ ]?)\\\)"
        r"|^\\\[\s(?:(?!\\[\[\]])[\s\S])*+\\\]|\$\0+\$"
        r"|\\(?:begin|ref|eqref|cite)\{[^{}\n\0]*\}",
        "is no formula here, and is shown as text",
        "a formula is `$x$` or stands between two `$$`, and a link to one is `[](#eq:name)`",
    ),
    "attributes": (
        r"\{:?[ \t]*[.#][\w-]+[^{}\n\0]*\}|\{:[^{}\n\0]+\}|(?<=\0)\{[\w-]+=[^{}\n\0]+\}",
        "is shown as it is written: only headings have attributes",
        "write HTML where a text needs a class or a size",
    ),
    "reference": (
        r"(?<![\w\]\0\\])\[[^\[\]\n\0]+\]\[[^\[\]\n\0]*\](?!\()",
        "is no link: its address is written nowhere",
        "write a line `[name]: address`, or the address itself: `[text](address)`",
    ),
    "footnote": (
        r"\^\[[^\[\]\n\0]+\]",
        "is no footnote, and is shown as it is written",
        "a footnote is `[^name]`, with a paragraph `[^name]: …`",
    ),
    "citation": (
        r"\[-?@[\w:./-]+[^\[\]\n\0]*\]",
        "is shown as it is written: there is no list of sources",
        "link to the source, or put it into a footnote: `[^name]`",
    ),
    "highlight": (
        r"(?<![=\w])==[^\s=](?:[^=\n\0]*[^\s=])?==(?![=\w])",
        "is shown as it is written",
        "emphasis is `*text*` or `**text**`",
    ),
    "contents": (
        r"^\[TOC\]$",
        "is shown as it is written",
        "take it away: each page lists its headings by itself",
    ),
    "tab": (
        r"^ {0,3}===[!+]? \"[^\"\n\0]*\"",
        "begins no tab, and is shown as it is written",
        "tabs are a feature: `plugins/tabs` of coursebuild",
    ),
}
"""Markup of other tools by kind: its pattern, what becomes of it, and what to write instead."""
_ANY_FOREIGN = re.compile(
    "|".join(f"(?P<{kind}>{pattern})" for kind, (pattern, _, _) in _FOREIGN.items()),
    re.MULTILINE | re.IGNORECASE,
)


def check_unread_markup(content: Excerpt, texts: Sequence[tuple[int, str]]) -> Iterator[Diagnostic]:
    """Report markup in a block's content that was not read.

    `texts` are its texts that are neither code nor formulas nor escaped, in order, each with its
    offset in the content.
    """
    whole = content.text
    has_escaped_bracket = "\\(" in whole or "\\[" in whole
    if not has_escaped_bracket and not any(_SIGNS.search(text) for _, text in texts):
        return
    parts, end = list[str](), 0
    for at, text in texts:
        parts += [_mask(whole[end:at]), text]
        end = at + len(text)
    masked = "".join([*parts, _mask(whole[end:])])
    # `$5` is money and stays so. But a blank inside `$x = $`, or a list that begins in the middle
    # of a formula because a line of it starts with `+ `, leaves dollars and TeX in the text.
    if any(_DOLLAR.search(text) for _, text in texts) and _TEX.search(masked):
        dollar = masked.index("$")
        message = "a dollar sign and TeX stand in the text: no formula was read here"
        yield diagnose("math-unread", content.span(dollar, dollar + 1), message, help=_MATH_HELP)
    yield from _find_foreign(content, masked)


def _find_foreign(content: Excerpt, masked: str) -> Iterator[Diagnostic]:
    """Report markup that another tool would read."""
    whole = content.text
    for match in _ANY_FOREIGN.finditer(masked):
        start, kind = match.start(), match.lastgroup or ""
        markup = whole[start : match.end()].strip()
        start = whole.index(markup, start)
        before = whole[max(start - 1, 0) : start]
        if kind == "binding" and before.endswith("`"):
            continue  # the parser of code spans has reported why it binds nothing
        if markup.startswith("$") and markup[1] != "`":
            continue  # no code stands between the dollars
        if re.match(r"\{\w", markup) and kind == "attributes" and not before.endswith(")"):
            continue  # no link or image stands before it
        _, problem, help = _FOREIGN[kind]
        if kind == "binding":
            number = markup.partition("{")[0]
            help = help.replace("`4.47`{out}", f"`{number or '4.47'}`{markup[len(number) :]}")
        if kind == "callout":
            help = help.replace("note", markup.strip("![]?+: \t{}").lower())
        rule = "binding-attribute" if kind == "binding" else "markup-foreign"
        span = content.span(start, start + len(markup))
        yield diagnose(rule, span, f"`{shorten(markup)}` {problem}", help=help)


def _mask(text: str) -> str:
    """Replace content that is no text by NUL, but for line ends and escaped brackets."""
    if _ESCAPED_BRACKETS.fullmatch(text):
        return text
    return "\n".join("\0" * len(line) for line in text.split("\n"))
