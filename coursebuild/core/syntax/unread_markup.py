"""Markup that readers would see as it is written: broken markup of ours, and that of other tools.

Entry points: `check_unread_markup`, for a block's content; `check_inline_code`, for code in a line
that another tool would compute.

Only texts of the parsed content are searched, neither code nor formulas nor escaped characters, so
a backslash or backticks say that markup is meant to be seen. Everything else is NUL in the searched
text: a mark directly after a NUL stands directly after a link, code and so on. What ordinary prose
holds is no mistake: prices, `C#`, sets in braces, powers, footnote stars, stars of significance.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from coursebuild.core.syntax.fence import is_known_kind
from coursebuild.core.syntax.wording import shorten
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, nearest
from coursebuild.core.text.source import Excerpt, Span

_ESCAPED_BRACKETS = re.compile(r"(?:\\[()\[\]]|\s)+")
_SIGNS = re.compile(
    r"[{}\[\]\\$`*~|#@^&<%\ufffd\x01-\x08\x0b-\x1f\x7f-\x9f]|[!?=:._']{2}|:\w|[´‘’]{3}"
    r"|\((?:out|given)\)|\A_\Z"
)
"""What all unread markup has at least once, so that most texts are passed over quickly."""


class _Kind(NamedTuple):
    """A kind of unread markup."""

    pattern: str
    reason: str
    """Why it is not read, after "would be shown as written: "."""
    help: str
    rule: str = "markup-foreign"
    once: bool = False
    """Whether one mistake often leaves several marks in a text, of which the first is reported."""


_DOLLAR = re.compile(r"\$(?!\d[\d.,]*(?![\w\\^{]))")
"""A dollar sign that no amount of money follows."""
_TEX = re.compile(r"\\[A-Za-z]{2,}|[A-Za-z)}\]][_^](?:[0-9]|\{)")
"""A command, an index or an exponent."""
_LONE_DOLLAR = re.compile(
    r"(?<![\w$])\$(?!(?-i:[A-Z_]{3,})\b)(?:[A-Za-z\\(|{]|[-+][A-Za-z])"  # as before a formula
    r"|(?:(?<![A-Za-z])(?<!\d )[a-z]{1,2}|[)}])\$(?![\w$])"  # as after one
    r"|(?<!\$)\$ [A-Za-z](?: ?[=<>+*/^_-] ?[\w.]+)* \$(?!\$)"
)
"""Dollar signs that were surely meant for a formula, with a character of it."""

_NUMBER = r"(?<![\w.])[-+\u2212]?\d[\w.,]*"
_BEFORE = r"(?:^|(?<=[\s(\[\"'“„«‚‘—–/]))"
"""The start of a line, or what may stand before the mark that begins an emphasis."""
_AFTER = r"(?=[\s.,;:!?)\]\"'“”’»…—–]|$)"
_WIDE = r"[\u3040-\u30ff\u3400-\u9fff\uac00-\ud7af]"
"""Letters of scripts that are written without blanks."""
_SCHEME = r"(?:lesson|model|page|term):(?=\w)"
_ADDRESS = (
    rf"(?:{_SCHEME}|https?:|mailto:|#\w|[\w./-]{1, 80}\.(?:csv|html|jpe?g|md|pdf|png|py|svg|xml)\b)"
)
_MACROS = """
    alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta kappa lambda mu nu xi pi rho
    sigma tau phi varphi chi psi omega Gamma Delta Theta Lambda Sigma Phi Psi Omega frac tfrac dfrac
    sqrt sum int prod partial nabla infty cdot times approx leq geq neq pm dot ddot hat vec bar
    mathbf mathrm mathcal boldsymbol left right quad qquad label noindent newpage pagebreak
"""
_ENTITIES = "amp deg gt hellip lt mdash middot nbsp ndash quot shy times"

_FOREIGN = {
    "wiki": _Kind(
        r"(?<![\\\w])\[\[(?![\d\s.,;+*/-]+\])[^\[\]\n\0]+\]\]",
        "a link is not written in this way",
        "a link to a lesson is `[its title](lesson:1.2)`",
    ),
    "template": _Kind(
        r"\{\{[-~<%#/!&]?\s*[A-Za-z_][^{}\n\0]*\}\}|\{%[^%\n\0]*%\}|<%[=-]?[^%\n\0]*%>"
        r"|\{(?:\+\+|--|~~|==|>>)[^{}\n\0]*\}",
        "lessons are not templates",
        "write the text itself, or put it into backticks if readers are to see it",
    ),
    "callout": _Kind(
        r"^ {0,3}(?:(?:!!!|\?\?\?\+?)(?:[ \t]+|(?-i:(?=[a-z])))[\w-]+|:{3,}[ \t]*\{?[.#]?[\w-]+\}?)"
        r"|\A\[![\w-]*\]?|(?<!\\)\[![\w-]+\]",
        "no callout begins here",
        "a callout is a quotation: `> [!note]`, and `> ` before each line of it",
    ),
    "latex": _Kind(
        r"\\\((?:[^\n]{0,80}?[\\^_=+][^\n]{0,80}?|[ ]?[A-Za-z][ ]?)\\\)"
        r"|^\\\[\s[\s\S]{0,2000}?\\\]|\$\0+\$"
        r"|\\(?:begin|ref|eqref|cite\w*)\{[^{}\n\0]*\}|(?<![\w:\\])\\(?!end\{)[A-Za-z]{2,}\{[^{}\n\0]*\}"
        rf"|(?<![\w:\\/])\\(?-i:{'|'.join(_MACROS.split())})(?![\w\\/])",
        "there is no formula here",
        "a formula is `$x$` or stands between two `$$`, and a link to one is `[](#eq:name)`",
    ),
    "attributes": _Kind(
        r"\{:?[ \t]*[.#][A-Za-z][\w:.-]*[^{}\n\0]*\}?|\{:[^{}\n\0]+\}|\{#?eq:[^{}\n\0]*\}?"
        r"|(?<![{\w&\0])[#.][A-Za-z][\w:.-]*\}",
        "only headings have attributes, and formulas labels: `{#eq:name}`",
        "in a heading, `## Title {#id .class}` ends the line; write HTML where a text needs a "
        "class or a size",
    ),
    "reference": _Kind(
        r"(?<![\w\]\0\\])\[[^\[\]\n\0]+\]\[[^\[\]\n\0]*\](?!\()",
        "this link has no address",
        "write a line `[name]: address`, or the address itself: `[text](address)`",
    ),
    "footnote": _Kind(
        r"\^\[[^\[\]\n\0]+\]",
        "no footnote begins here",
        "a footnote is `[^name]`, with a paragraph `[^name]: …`",
    ),
    "citation": _Kind(
        r"(?<!\\)\[(?:[^\[\]\n\0@]*[\s-])?@[\w:./-]+[^\[\]\n\0]*\]",
        "there is no list of sources",
        "link to the source, or put it into a footnote: `[^name]`",
    ),
    "crossref": _Kind(
        r"(?<![\w.@])@(?:fig|tbl|eq|sec|lst|thm)[-:][\w-]+",
        "a cross-reference is not written in this way",
        "link to a heading or a formula by its id: `[text](#id)`, `[](#eq:name)`",
    ),
    "highlight": _Kind(
        r"(?<![=\w])==[^\s=](?:[^=\n\0]*[^\s=])?==(?![=\w])",
        "emphasis is not written in this way",
        "emphasis is `*text*` or `**text**`",
    ),
    "script": _Kind(
        r"(?<=[^\W_])(?:~[^\W_]{1,8}~(?!~)|\^[^\W_]{1,8}\^(?![\w^]))",
        "an index or an exponent is not written in this way",
        "write a formula, `$\\mathrm{H_2O}$`, or HTML: `<sub>2</sub>`, `<sup>2</sup>`",
    ),
    "contents": _Kind(
        r"^\[TOC\]$",
        "there is no such mark",
        "take it away: each page lists its headings by itself",
    ),
    "tab": _Kind(
        r"^ {0,3}===[!+]? \"[^\"\n\0]*\"",
        "no tab begins here",
        "tabs are a feature: `plugins/tabs` of coursebuild",
    ),
    "role": _Kind(
        r"(?<![\w:]):[a-z][\w.+-]*(?::[\w.+-]+)*:(?=\0)|(?<![\w{])\{[a-z][\w:.+-]*\}(?=\0)",
        "roles of reStructuredText are not read",
        "write a link, a formula or code as Markdown has it",
    ),
    "directive": _Kind(
        r"^\.\. [\w:+-]+::",
        "directives of reStructuredText are not read",
        "a callout is a quotation, `> [!note]`; an image is `![what it shows](x.svg)`",
    ),
    "magic": _Kind(
        r"^(?:%%[a-z]\w*|%(?:config|conda|load_ext|matplotlib|pip|run|timeit|time)\b)",
        "commands of Jupyter are not read",
        "leave it out, or put it into backticks if readers are to see it",
    ),
    "emoji": _Kind(
        r"(?<![\w:])(?-i::[a-z][a-z0-9]+(?:_[a-z0-9]+)*:)(?![\w:\0])",
        "names of emoji are not read",
        "type the emoji itself",
    ),
}
"""Markup of other tools."""
_BROKEN = {
    "binding": _Kind(
        rf"(?:`{_NUMBER}[^`{{}}\n\0]{{0,20}}|(?:{_NUMBER})?`?)"
        r"\{[ \t]*(?:out|given)\b[^{}\n\0]*\}?"
        r"|(?<=\0)[A-Za-z]{1,3}\{[A-Za-z]{1,6}\}|(?<=\0)[^\s\0]{0,2}(?:out|given)[)}\]]"
        r"|(?<=\0)\{\{(?:out|given)[^{}\n\0]*\}+|(?<=\0)\}",
        "only a number in backticks is bound, by braces directly after it",
        "put the number into backticks: `` `4.47`{out} ``",
        "binding-attribute",
    ),
    "mark": _Kind(
        r"\{[ \t]*(?:term|symbol|further)\b[^{}\n\0]*\}",
        "braces stand directly after what they mark",
        'write `[word]{term}`, `$x${symbol="meaning"}`, `## Heading {.further}`',
        "markup-unread",
    ),
    "braces": _Kind(r"(?<=[\0\]])\{(?![ \t]*[.#:%{])(?:[^{}\n\0]*\}|\w*)", "", ""),
    "link": _Kind(
        r"(?<!\\)!?\[[^\[\]\n]{0,200}(?<!\\)\][ \t]+\(" + _ADDRESS + r"[^)\n]*\)"
        r"|(?:(?<!\\)!?\[[^\[\]\n]{0,200})?(?<!\\)\]\([^\s)]*\)?"
        r"|\([^()\n]{1,200}\)\[" + _ADDRESS + r"[^\]\n]*\]"
        r"|(?<!\\)!\[[^\[\]\n\0]*\]"
        rf"|(?<![\w:/.])(?-i:{_SCHEME})[\w.#/-]*\w"
        r"|(?<!\\)\[[^\[\]\n]{0,200}\(" + _ADDRESS + r"[^()\s]*\)(?![^\[\n]*\])"
        r"|(?<!\\)\[[^\[\]\n]{0,200}\]?\(?\]?\S?" + _ADDRESS + r"[^()\s\]]*\)(?![^\[\n]*\])"
        r"|(?<!\\)\[[^\[\]\n]{0,200}\]#\([^()\s]*\)|(?<=\0)\]|\[(?=\0)",
        "this is not a complete link",
        "a link is `[text](address)`, with no blank before the `(` and none in the address",
        "markup-unread",
        once=True,
    ),
    "heading": _Kind(
        r"^[ \t]*#{2,6}(?=[^\s#])|^[ \t]*#{7,}(?=\s)"
        r"|^(?-i:[^\sA-Z#\0]#{1,5} (?=[A-Z])|#{1,5}[^\w\s#\0] (?=[A-Z]))",
        "no heading begins here",
        "a heading is `## Title`, with two to six `#` and a blank after them",
        "markup-unread",
    ),
    "table": _Kind(
        r"^[ \t]*\|?[ \t]*:?-{2,}:?(?:[ \t]*\|[ \t]*:?-{2,}:?)+[ \t]*\|?[ \t]*$"
        r"|^[ \t]*\|[ \t]*:?-{3,}:?[ \t]*\|[ \t]*$"
        r"|^[ \t]*\|[ \t][^|\n]*(?:[ \t]\|[ \t][^|\n]*)+\|[ \t]*$"
        r"|^[ \t]*\|(?:[^|\n]*\|){2,}[ \t]*\n[ \t]*\|(?:[^|\n]*\|){2,}[ \t]*$",
        "no table was read here",
        "a table has an empty line before it, a line `| --- | --- |` below its header, and as many "
        "cells in the one as in the other",
        "markup-unread",
        once=True,
    ),
    "note": _Kind(
        r"(?<!\\)\[\^[^\[\]\n\0]*\]?",
        "no footnote begins here",
        "a footnote is `[^name]`, its name without blanks, with a paragraph `[^name]: …`",
        "markup-unread",
    ),
    "conflict": _Kind(
        r"^={7}$",
        "a merge conflict may have left it behind",
        "delete it; a line between two parts is `---`",
        "markup-unread",
    ),
    "task": _Kind(
        r"^[-*+]\[[ xX]?\](?=[ \t])|\A\[(?: [xX] ?|[xX] |)\](?=[ \t]*\w)",
        "no task begins here",
        "a task is `- [ ] text` or `- [x] text`",
        "markup-unread",
    ),
    "fence": _Kind(
        r"^(?:'{3}|´{3}|‘{3}|’{3})[ \t]*\w*(?=[\w \t=./\"-]*$)",
        "no block begins here",
        "a block of code begins and ends with three backticks on a line of their own",
        "markup-unread",
        once=True,
    ),
    "html": _Kind(
        r"<!--|</[A-Za-z][\w-]*>?|<[A-Za-z][\w-]*\s+[\w-]+\s*=[^<>\n]*>?",
        "no tag or comment was read here",
        'close it: `<tag attribute="value">`, `</tag>`, `<!-- comment -->`',
        "markup-unread",
    ),
    "entity": _Kind(
        rf"&(?:{'|'.join(_ENTITIES.split())})(?![\w;])",
        "an entity ends with a semicolon",
        "write the character itself, or add the `;`",
        "markup-unread",
    ),
    "code": _Kind(
        r"(?<!\w)`+|`+(?!\w)",
        "no code begins or ends here",
        "put a backtick at both ends, in the same paragraph; write `` \\` `` for the character",
        "markup-unread",
        once=True,
    ),
    "emphasis": _Kind(
        rf"{_BEFORE}(?:\*\*\*?|__|~~)(?=[^\W_]|[\"'“„(\[$\\\0])"
        rf"|(?:(?<=[^\W\d_])|(?<=[\"'”\].!?…\0]))(?:\*\*|__|~~)(?!\*){_AFTER}"
        rf"|(?<={_WIDE})\*\*|\*\*(?={_WIDE})"
        r"|(?<=[ \t(])\*(?=[^\W\d_]{3})|(?<=\0)\*|\*(?=\0)",
        "no emphasis begins or ends here",
        "put the same mark at both ends, in the same paragraph and with no blank inside it; write "
        "a backslash before each character that is meant to be seen",
        "markup-unread",
        once=True,
    ),
    "character": _Kind(
        "[\ufffd\x01-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]",
        "",
        "delete it, or write the character that was meant",
        "control-character",
        once=True,
    ),
}
"""Markup of ours that is not whole."""
_IN_HTML = {
    **{name: _BROKEN[name] for name in ("html", "entity", "character")},
    "markdown": _Kind(
        r"(?<![\w*])\*\*[^\s*][^\n*]*\*\*(?!\w)|`[^`\n]+`|!?\[[^\[\]\n]*\]\([^\s()]+\)"
        r"|^[ \t]*#{2,6}[ \t]+\S|^[ \t]*(?:`{3}|~{3})\w*|\{(?:out|given|term)\b[^{}\n]*\}",
        "inside HTML, Markdown is read only after an empty line",
        "leave a line empty after the opening tag and another before the closing one, or write "
        "HTML: `<b>`, `<code>`, `<a href=…>`",
        "markup-unread",
        once=True,
    ),
    **_FOREIGN,
}
"""What is unread between the tags of HTML, where nothing but formulas is read."""


def _one_pattern(kinds: dict[str, _Kind]) -> re.Pattern[str]:
    """A pattern for all kinds, with a group for each."""
    parts = (f"(?P<{name}>{kind.pattern})" for name, kind in kinds.items())
    return re.compile("|".join(parts), re.MULTILINE | re.IGNORECASE)


_KINDS = {**_BROKEN, **_FOREIGN}
_ANY_KIND, _ANY_IN_HTML = _one_pattern(_KINDS), _one_pattern(_IN_HTML)
_CELL = re.compile(r"\{[=.]?(?:bash|julia|js|ojs|python|py|r|sql)\}\s|r [A-Za-z_.][\w.]*[($\[]")
"""How an expression begins that Quarto or R Markdown would compute."""


def check_unread_markup(
    content: Excerpt, texts: Sequence[tuple[int, str]], *, html: bool = False
) -> Iterator[Diagnostic]:
    """Report markup in a block's content that was not read.

    `texts` are its texts that are neither code nor formulas nor escaped, in order, each with its
    offset in the content; in `html` the texts between tags.
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
    dollars = [*_check_dollars(content, texts, masked)]
    yield from dollars
    reported = set[str]()
    kinds, pattern = (_IN_HTML, _ANY_IN_HTML) if html else (_KINDS, _ANY_KIND)
    for match in pattern.finditer(masked):
        name = match.lastgroup or ""
        if name in reported or (dollars and re.match(r"\\[A-Za-z]", match[0])):
            continue
        diagnostic = _diagnose(content, name, kinds[name], match)
        if diagnostic is not None:
            reported |= {name} if kinds[name].once else set()
            yield diagnostic


def _check_dollars(
    content: Excerpt, texts: Sequence[tuple[int, str]], masked: str
) -> Iterator[Diagnostic]:
    """Report dollar signs that were meant for a formula.

    `$5` is money and stays so. But a blank inside `$x = $`, or a list that begins in the middle of
    a formula because a line of it starts with `+ `, leaves dollars in the text.
    """
    if not any("$" in text for _, text in texts):
        return
    lone = _LONE_DOLLAR.search(masked)
    beside = next((m.start() for m in re.finditer(r"(?<=\0)\$|\$(?=\0)", masked)), None)
    if beside is not None and "$$" in content.text[max(beside - 1, 0) : beside + 2]:
        at = beside
    elif lone is not None:
        at = masked.index("$", lone.start())
    elif any(_DOLLAR.search(text) for _, text in texts) and _TEX.search(masked):
        at = masked.index("$")
    else:
        return
    help = (
        "in `$x$` no blank stands inside the dollar signs, no digit follows the last one, and no "
        "line of a formula begins as a list item does (`+ `, `- `); write `\\$` for a dollar sign"
    )
    message = "this dollar sign would be shown as written: no formula begins or ends here"
    yield diagnose("math-unread", content.span(at, at + 1), message, help=help)


def _diagnose(content: Excerpt, name: str, kind: _Kind, match: re.Match[str]) -> Diagnostic | None:
    """The diagnostic of a match of a kind in the masked content; `None` if it is no mistake."""
    whole = content.text
    if name in ("braces", "mark") and _is_escaped(whole[: match.start()]):
        return None
    markup = whole[match.start() : match.end()].strip(" \t\n")
    at = whole.index(markup, match.start())
    before, after = whole[:at], whole[at + len(markup) :]
    span, help = content.span(at, at + len(markup)), kind.help
    match name:
        case "braces":
            return _diagnose_braces(markup, span, before[-1:])
        case "binding" if before.endswith("`") and markup.startswith("{"):
            return _diagnose_braces(markup, span, "`")
        case "binding" if markup == "}":
            help = "delete it, or write `\\}` for a brace that readers are to see"
        case "binding":
            number, _, braces = markup.replace("`", "").rpartition("{")
            if re.match("[-+\u2212\\d]", number) and braces.endswith("}"):
                help = help.replace("4.47", number).replace("{out}", "{" + braces)
        case "link" if markup in ("[", "]"):
            is_beside_mark = before[-1:] in ("]", ")") if markup == "]" else after[:1] == "["
            if not is_beside_mark or whole.count("[") == whole.count("]"):
                return None
        case "emphasis" if markup == "*" and "**" not in before[-1:] + markup + after[:1]:
            if match[0] == "*" and not re.match(r"[^\W\d_]{3}", after):
                return None
        case "latex" if markup.startswith("$") and markup[1] != "`":
            return None  # no code stands between the dollars
        case "role" if not after.startswith("`"):
            return None
        case "callout":
            word = re.sub(r"[^\w-]", "", markup).lower()
            help = help.replace("note", word or "note")
        case "character" if span.text == "\0":
            return None  # it is reported wherever it stands
        case "character":
            message = f"the control character U+{ord(markup):04X} stands in the text"
            if markup == "\ufffd":
                message = "a character was lost here: U+FFFD stands in its place"
            return diagnose(kind.rule, span, message, help=help)
        case "code":
            subject = "this backtick" if len(markup) == 1 else "these backticks"
            message = f"{subject} would be shown as written: {kind.reason}"
            return diagnose(kind.rule, span, message, help=help)
        case _:
            pass
    message = f"`{shorten(markup)}` would be shown as written: {kind.reason}"
    return diagnose(kind.rule, span, message, help=help)


def _is_escaped(before: str) -> bool:
    """Whether a text ends with brackets of which a backslash says that they are mere brackets."""
    opening = before.rfind("[") if before.endswith("]") else 0
    return opening > 0 and before[opening - 1] == "\\"


def _diagnose_braces(markup: str, span: Span, before: str) -> Diagnostic | None:
    """The diagnostic of braces directly after something that ends with the character `before`."""
    key = re.sub(r"[^\w].*", "", markup[1:].strip(), flags=re.DOTALL)
    escaping = "; write `\\{` for braces that readers are to see"
    if before == "`":
        message = f"`{shorten(markup)}` does not say where the number is from"
        likely = nearest(key.lower(), ("out", "given"))
        help = 'write `{out}`, `{out=examples/x.py}`, `{given}` or `{given="its source"}`'
        help = help + escaping if likely in (None, key) else f"did you mean `{likely}`?"
        return diagnose("binding-attribute", span, message, help=help)
    if before == "$":
        help = 'write `{symbol="what it stands for" unit="m/s"}`' + escaping
        message = f"`{shorten(markup)}` says nothing about the formula before it"
        return diagnose("symbol-attribute", span, message, help=help)
    if before not in ("]", ")"):
        return None
    message = f"`{shorten(markup)}` would be shown as written: "
    if before == "]":
        message += "the only attribute of words in brackets is `{term}`"
        return diagnose("term-attribute", span, message, help="write `[word]{term}`" + escaping)
    message += "links and images have no attributes"
    help = "write HTML, `<a …>` or `<img …>`, where one needs a class or a size" + escaping
    return diagnose("markup-foreign", span, message, help=help)


def check_inline_code(code: str, span: Span) -> Iterator[Diagnostic]:
    """Report code in a line that another tool would compute, or that was to be a block."""
    fence = re.match(r"``(\w+)[^`\n]*\n", span.text)
    if fence is not None and is_known_kind(fence[1]):
        message = f"a block of kind `{fence[1]}` does not begin here: there are two backticks"
        opening = Span(span.source, span.start, span.start + len(fence[0].rstrip()))
        yield diagnose("markup-unread", opening, message, help=_BROKEN["fence"].help)
    if _CELL.match(code):
        message = f"`{shorten(code)}` is shown, and not computed"
        help = "show the value, bound to what a script printed: `` `4.47`{out} ``"
        yield diagnose("markup-foreign", span, message, help=help)


def _mask(text: str) -> str:
    """Replace content that is no text by NUL, but for line ends and escaped brackets."""
    if _ESCAPED_BRACKETS.fullmatch(text):
        return text
    return "\n".join("\0" * len(line) for line in text.split("\n"))
