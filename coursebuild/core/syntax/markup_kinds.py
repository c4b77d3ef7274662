"""The kinds of markup that readers would see as it is written.

Patterns are searched for in a text in which NUL stands for all that was read, so that a mark
directly after a NUL stands directly after a link, code and so on.
"""

from __future__ import annotations

from typing import NamedTuple


class MarkupKind(NamedTuple):
    """A kind of unread markup."""

    pattern: str
    reason: str
    """Why it is not read, after "would be shown as written: "."""
    help: str
    rule: str = "markup-unread"
    """Of markup of ours."""


_NUMBER = r"(?<![\w.])[-+\u2212]?\d[\w.,]*"
_BEFORE = r"(?:^|(?<=[\s(\[\"'“„«‚‘—–/]))"
"""The start of a line, or what may stand before the mark that begins an emphasis."""
_AFTER = r"(?=[\s.,;:!?)\]\"'“”’»…—–]|$)"
_WIDE = r"[\u3040-\u30ff\u3400-\u9fff\uac00-\ud7af]"
"""Letters of scripts that are written without blanks."""
_SCHEME = r"(?:lesson|model|page|term):(?=\w)"
_ADDRESS = (
    rf"(?:{_SCHEME}|https?:|mailto:|#\w"
    r"|[\w./-]{1,80}\.(?:csv|html|jpe?g|md|pdf|png|py|svg|xml)\b)"
)
_MACROS = """
    alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta kappa lambda mu nu xi pi rho
    sigma tau phi varphi chi psi omega Gamma Delta Theta Lambda Sigma Phi Psi Omega frac tfrac dfrac
    sqrt sum int prod partial nabla infty cdot times approx leq geq neq pm dot ddot hat vec bar
    mathbf mathrm mathcal boldsymbol left right quad qquad label noindent newpage pagebreak
"""
_ENTITIES = "amp deg gt hellip lt mdash middot nbsp ndash quot shy times"

FOREIGN = {
    "wiki": MarkupKind(
        r"(?<![\\\w])\[\[(?![\d\s.,;+*/-]+\])[^\[\]\n\0]+\]\]",
        "a link is not written in this way",
        "a link to a lesson is `[its title](lesson:1.2)`",
    ),
    "template": MarkupKind(
        r"\{\{[-~<%#/!&]?\s*[A-Za-z_][^{}\n\0]*\}\}|\{%[^%\n\0]*%\}|<%[=-]?[^%\n\0]*%>"
        r"|\{(?:\+\+|--|~~|==|>>)[^{}\n\0]*\}",
        "lessons are not templates",
        "write the text itself, or put it into backticks if readers should see it",
    ),
    "callout": MarkupKind(
        r"^ {0,3}(?:(?:!!!|\?\?\?\+?)(?:[ \t]+|(?-i:(?=[a-z])))[\w-]+|:{3,}[ \t]*\{?[.#]?[\w-]+\}?)"
        r"|\A\[![\w-]*\]?|(?<!\\)\[![\w-]+\]",
        "no callout begins here",
        "a callout is a quotation: `> [!note]`, and `> ` before each line of it",
    ),
    "latex": MarkupKind(
        # What stands between brackets holds none, so that each is looked at once.
        r"\\\((?:(?>(?:(?!\\[()])[^\n\\^_=+])*)[\\^_=+](?>(?:(?!\\[()])[^\n])*)"
        r"|[ ]?[A-Za-z][ ]?)\\\)"
        r"|^\\\[\s(?>(?:(?!\\[\[\]])[\s\S])*)\\\]|\$\0+\$"
        r"|\\(?:begin|ref|eqref|cite\w*)\{[^{}\n\0]*\}|(?<![\w:\\])\\(?!end\{)[A-Za-z]{2,}\{[^{}\n\0]*\}"
        rf"|(?<![\w:\\/])\\(?-i:{'|'.join(_MACROS.split())})(?![\w\\/])",
        "there is no formula here",
        "a formula is `$x$` or stands between two `$$`, and a link to one is `[](#eq:name)`",
    ),
    "attributes": MarkupKind(
        r"\{:?[ \t]*[.#][A-Za-z][\w:.-]*[^{}\n\0]*\}?|\{:[^{}\n\0]+\}"
        r"|\{#?(?:eq|fig|lab|lst|tab):[^{}\n\0]*\}?"
        r"|(?<![{\w&\0])[#.][A-Za-z][\w:.-]*\}|#(?:eq|fig|lab|lst|tab):[\w.-]+\}"
        r"|(?<!\])\(#(?:eq|fig|lab|lst|tab):[\w.-]+\)|\(\.further\)$",
        "only headings have attributes, and only formulas, captions and fences have labels",
        "in a heading, `## Title {#id .class}` ends the line; a label ends a caption, "
        "`Figure: … {#fig:name}`, or a fence's first line; write HTML for a class or a size",
    ),
    "reference": MarkupKind(
        r"(?<![\w\]\0\\])\[[^\[\]\n\0]+\]\[[^\[\]\n\0]*\](?!\()",
        "this link has no address",
        "write a line `[name]: address`, or the address itself: `[text](address)`",
    ),
    "footnote": MarkupKind(
        r"\^\[[^\[\]\n\0]+\]",
        "no footnote begins here",
        "a footnote is `[^name]`, with a paragraph `[^name]: …`",
    ),
    "citation": MarkupKind(
        r"(?<!\\)\[(?:[^\[\]\n\0@]*[\s-])?@[\w:./-]+[^\[\]\n\0]*\]",
        "no source is cited in this way",
        "a citation is `[@key]` or `[see @key, p. 12; @other]`; the sources are listed in "
        "content/references.bib",
    ),
    "crossref": MarkupKind(
        r"(?<![\w.@])@(?:fig|tbl|eq|sec|lst|thm)[-:][\w-]+",
        "a cross-reference is not written in this way",
        "link to a heading by its id, `[text](#id)`, and to what has a number without a text: "
        "`[](#fig:name)`, `[](#eq:name)`",
    ),
    "highlight": MarkupKind(
        r"(?<![=\w])==[^\s=](?:[^=\n\0]*[^\s=])?==(?![=\w])",
        "emphasis is not written in this way",
        "emphasis is `*text*` or `**text**`",
    ),
    "script": MarkupKind(
        r"(?<=[^\W_])(?:~[^\W_]{1,8}~(?!~)|\^[^\W_]{1,8}\^(?![\w^]))",
        "an index or an exponent is not written in this way",
        "write a formula, `$\\mathrm{H_2O}$`, or HTML: `<sub>2</sub>`, `<sup>2</sup>`",
    ),
    "comment": MarkupKind(
        r"(?<![\w%])%%(?=[^\s%])[^%\n\0]+%%(?!\w)|(?<=[ \t])\^(?=[\w-]*[a-z])[\w-]{3,}\Z",
        "comments and names of blocks are not written in this way",
        "delete it; a comment is `<!-- text -->`, and a link leads to a heading: `[text](#id)`",
    ),
    "definition": MarkupKind(
        r"(?<=[^\n]\n): {1,3}(?=\w)",
        "no definition begins here",
        "mark a word where it is explained: `[word]{term}`",
    ),
    "contents": MarkupKind(
        r"^\[TOC\]$",
        "there is no such mark",
        "remove it: each page lists its headings by itself",
    ),
    "tab": MarkupKind(
        r"^ {0,3}===[!+]? \"[^\"\n\0]*\"",
        "no tab begins here",
        "tabs are a feature: `plugins/tabs` of coursebuild",
    ),
    "role": MarkupKind(
        r"(?<![\w:]):[a-z][\w.+-]*(?::[\w.+-]+)*:(?=\0)|(?<![\w{])\{[a-z][\w:.+-]*\}(?=\0)",
        "roles of reStructuredText are not read",
        "write a link, a formula or code as Markdown has it",
    ),
    "directive": MarkupKind(
        r"^\.\. [\w:+-]+::|(?:(?<=\0)|(?<=\]))__?(?=[\s.,;:)]|\Z)|(?<=\w)::\Z",
        "directives, links and blocks of reStructuredText are not read",
        "a callout is a quotation, `> [!note]`; an image is `![what it shows](x.svg)`, a link "
        "`[text](address)`, and code stands between two lines of three backticks",
    ),
    "magic": MarkupKind(
        r"^(?:%%[a-z]\w*|%(?:config|conda|load_ext|matplotlib|pip|run|timeit|time)\b)",
        "commands of Jupyter are not read",
        "leave it out, or put it into backticks if readers should see it",
    ),
    "adoc": MarkupKind(
        r"^\[(?:source|listing|NOTE|TIP|WARNING|IMPORTANT|CAUTION|stem|latexmath|verse|quote)"
        r"(?:,[^\]\n\0]*)?\]$|^(?:image|include|video|audio|toc|stem)::[^\s\[\0]*\[[^\]\n\0]*\]"
        r"|^#\+[A-Z_]+(?::|\b)|^h[1-6]\. (?=\w)|\{(?:code|panel|info|noformat)(?::[^{}\n\0]*)?\}"
        r"|(?-i:^[AWTEDQ]> )|^[?!]> (?=\w)|^={2,6} (?=\w)[^=\n\0]+(?: ={2,6})?$|'{3}[^'\n\0]+'{3}"
        r"|^\*{2,6} (?=(?-i:[A-Z]))|^\*\[[^\[\]\n\0]+\]:|\[/(?:b|i|u|s|code|img|list|quote|url)\]"
        r"|^#(?:let|set|show) [\w.]+ ?[=:(]|(?<![\w&])#(?:figure|image|link|table|text)\(",
        "markup of AsciiDoc, a forum, Docsify, Org, Textile, Typst or a wiki is not read",
        "write it as Markdown: `## Title`, `![what it shows](x.svg)`, a fence of three backticks",
    ),
    "prompt": MarkupKind(
        r"^(?-i:In|Out) ?\[\d*\]:|^@@ -\d+(?:,\d+)? \+\d+(?:,\d+)? @@"
        r"|^(?:import|export)\b[^\n\0]* from ['\"][^'\"\n\0]+['\"];?$",
        "it belongs to a program or to what shows one",
        "leave it out, or put it into backticks if readers should see it",
    ),
    "emoji": MarkupKind(
        r"(?<![\w:])(?-i::[a-z][a-z0-9]+(?:_[a-z0-9]+)*:)(?![\w:\0])",
        "names of emoji are not read",
        "type the emoji itself",
    ),
}
BROKEN = {
    "binding": MarkupKind(
        rf"(?:`{_NUMBER}[^`{{}}\n\0]{{0,20}}|(?:{_NUMBER})?`?)"
        r"[{\uff5b][ \t]*(?:out|given)\b[^{}\uff5d\n\0]*[}\uff5d]?"
        r"|(?<=\0)[A-Za-z]{1,3}\{[A-Za-z]{1,6}\}|(?<=\0)[^\s\0]{0,2}(?:out|given)[)}\]]"
        r"|(?<=\0)\{\{(?:out|given)[^{}\n\0]*\}+|(?<=\0)(?:[^\s\0{}\"]|\"[^\"\n\0]*\")*\}",
        "only a number in backticks is bound, by braces directly after it",
        "put the number into backticks: `` `4.47`{out} ``",
        "binding-attribute",
    ),
    "mark": MarkupKind(
        r"[{\uff5b][ \t]*(?:term|symbol|further)\b[^{}\uff5d\n\0]*[}\uff5d]"
        r"|(?<=\])term\b[^\s{}\0]*\}|(?<=\0)(?:symbol|unit|value)=\"[^{}\0]*\}",
        "braces stand directly after what they mark",
        'write `[word]{term}`, `$x${symbol="meaning"}`, `## Heading {.further}`',
    ),
    "braces": MarkupKind(r"(?<=[\0\]])\{(?![%{]|[ \t]*[.#:])(?:[^{}\n\0]*\}|\w*)", "", ""),
    "link": MarkupKind(
        r"(?<!\\)!?\[[^\[\]]{0,200}(?<!\\)\][ \t]+\(" + _ADDRESS + r"[^)\n]*\)"
        r"|(?:(?<!\\)!?\[[^\[\]]{0,200})?(?<!\\)\]\([^\s)]*\)?"
        r"|\([^()\n]{1,200}\)\[" + _ADDRESS + r"[^\]\n]*\]"
        r"|(?<!\\)!\[[^\[\]\n\0]*\]|(?<!\\)!\([^()\s]+\)\[[^\[\]\n]*\]"
        r"|(?<!\\)\[[^\[\]]{1,200}(?<!\\)\]\w\([^()\s]*[:/#.][^()\s]*\)"
        rf"|(?<![\w:/.])(?-i:{_SCHEME})[\w.#/-]*\w"
        r"|(?<!\\)\[[^\[\]]{0,200}\(" + _ADDRESS + r"[^()\s]*\)(?![^\[\n]*\])"
        r"|(?<!\\)\[[^\[\]]{0,200}\]?\(?\]?\S?" + _ADDRESS + r"[^()\s\]]*\)(?![^\[\n]*\])"
        r"|(?<!\\)\[[^\[\]]{0,200}\]#\([^()\s]*\)|(?<=\0)[\])]|\[(?=\0)",
        "this is not a complete link",
        "a link is `[text](address)`, with no blank before the `(` and none in the address",
    ),
    "bracket": MarkupKind(
        r"(?<![\\\w])\[(?=(?:[^\W\d_]?\s+)?[^\W\d_]{2})(?![^\[\]]*\])|(?<=[^\W\d_])\[(?=(?-i:[a-z]))(?![^\[\]]*\])"
        r"|(?<![\\\w])\[(?=[^\W\d_]?[.,;:!?]?\Z)",
        "no link begins here",
        "a link is `[text](address)`; write a backslash before a bracket that is meant to be seen",
    ),
    "letter": MarkupKind(
        r"(?<=\0)(?-i:[a-rt-z])(?![\w'’-])",
        "it stands directly beside a formula",
        "move the dollar sign, or write a blank between them",
        "math-unread",
    ),
    "heading": MarkupKind(
        r"^[ \t]*#{2,6}(?=[^\s#])|^[ \t]*#{7,}(?=\s)"
        r"|^(?-i:[^\sA-Z#\0]#{1,5} (?=[A-Z])|#{1,5}[^\s#\0\d]#{0,4} (?=[A-Z]))",
        "no heading begins here",
        "a heading is `## Title`, with two to six `#` and a blank after them",
    ),
    "table": MarkupKind(
        r"^[ \t]*\|?[ \t]*:?-{2,}:?(?:[ \t]*\|[ \t]*:?-{2,}:?)+[ \t]*\|?[ \t]*$"
        r"|^[ \t]*\|[ \t]*:?-{3,}:?[ \t]*\|[ \t]*$"
        r"|^[ \t]*\|[ \t][^|\n]*(?:[ \t]\|[ \t][^|\n]*)+\|[ \t]*$"
        r"|^[ \t]*\|(?:[^|\n]*\|){2,}[ \t]*\n[ \t]*\|(?:[^|\n]*\|){2,}[ \t]*$",
        "no table was read here",
        "a table has an empty line before it, a line `| --- | --- |` below its header, and as many "
        "cells in the one as in the other",
    ),
    "note": MarkupKind(
        r"(?<!\\)\[\^[^\[\]\n\0]*\]?",
        "no footnote begins here",
        "a footnote is `[^name]`, its name without blanks, with a paragraph `[^name]: …`",
    ),
    "conflict": MarkupKind(
        r"^(?:={7}|\|{7}(?: [\w./-]+)?)$",
        "a merge conflict may have left it behind",
        "delete it; a line between two parts is `---`",
    ),
    "task": MarkupKind(
        r"^[-*+]\[[ xX]?\](?=[ \t])|\A\[(?: [xX] ?|[xX] |)\](?=[ \t]*\w)|\A\[[ xX]\](?=\w)",
        "no task begins here",
        "a task is `- [ ] text` or `- [x] text`",
    ),
    "mention": MarkupKind(
        r"(?<![\w\\])(?-i:Lesson) (?:0\d[\d.]*|\d+(?:(?:[,;/:]|\.\.)\d+(?!\w|,\d)"
        r"|(?<=\d\d)(?![\w.,]|\.\d)|(?<=\d\d)\.(?= (?-i:[a-z]))))",
        "no lesson has such a number",
        "a lesson is mentioned as `Lesson 1.2`, with a point",
    ),
    "item": MarkupKind(
        r"^\d{1,2}(?:[.)][.,)]|[,;]) (?=(?-i:[A-Z\0]))|^\d{1,2}[.)](?=(?-i:[A-Z][a-z]))"
        r"|\A1 (?=(?:[^\n]*\n)+?2\. )|^-(?=(?-i:[A-Z][a-z]))"
        r"|^[•‣◦▪●] ?(?=\w)|^-- (?=\0)|\A-- (?=(?-i:[A-Z]\w* [a-z]))"
        r"|(?:^[=_]|(?<=\n)0) (?=(?-i:[A-Z][a-z]))|^[.)] (?=(?-i:\0*[A-Z][a-z]))"
        r"|^[0=_] (?=(?-i:\0\0?[A-Z]))|^[=_] (?=\0)",
        "no item of a list begins here",
        "an item is `- text` or `1. text`, with one blank after the mark",
    ),
    "fence": MarkupKind(
        r"^(?:'{3}|´{3}|‘{3}|’{3})[ \t]*\w*(?=[\w \t=./\"-]*$)",
        "no block begins here",
        "a block of code begins and ends with three backticks on a line of their own",
    ),
    "html": MarkupKind(
        r"<!--|</[A-Za-z][\w-]*>?|<[A-Za-z][\w-]*\s+[\w-]+\s*=[^<>\n]*>?",
        "no tag or comment was read here",
        'close it: `<tag attribute="value">`, `</tag>`, `<!-- comment -->`',
    ),
    "quotation": MarkupKind(
        r"(?<=[^\W\d_])>[ \t](?=(?-i:[a-z]{2}))|(?<=[^\W\d_][ \t])<(?=(?-i:[a-z]{2,}) (?-i:[a-z]))",
        "no quotation or tag begins here",
        "write a comparison with blanks on both sides of its sign; a quotation begins a line",
    ),
    "entity": MarkupKind(
        rf"&(?:{'|'.join(_ENTITIES.split())})(?![\w;])",
        "an entity ends with a semicolon",
        "write the character itself, or add the `;`",
    ),
    "code": MarkupKind(
        r"(?<!\w)`+|`+(?!\w)",
        "no code begins or ends here",
        "put a backtick at both ends, in the same paragraph; write `` \\` `` for the character",
    ),
    "emphasis": MarkupKind(
        rf"{_BEFORE}(?:\*\*\*?|__|~~)(?=[^\W_]|[\"'“„(\[$\\\0])"
        rf"|(?:(?<=[^\W\d_])|(?<=[\"'”\].!?…\0]))(?:\*\*|__|~~)(?!\*){_AFTER}"
        rf"|(?<={_WIDE})\*\*|\*\*(?={_WIDE})"
        r"|(?<=[ \t(])\*(?=[^\W\d_]{2}|(?-i:[aA]) [a-z])|(?<=\0)\*|\*(?=\0)|\A\*(?=[,.;:] )",
        "no emphasis begins or ends here",
        "put the same mark at both ends, in the same paragraph and with no blank inside it; write "
        "a backslash before each character that is meant to be seen",
    ),
    "character": MarkupKind(
        "[\ufffd\x01-\x08\x0b\x0e-\x1f\x7f-\x9f\u202a-\u202e]",
        "",
        "delete it, or write the character that was meant",
        "control-character",
    ),
}
"""Markup of ours that is not whole."""
IN_HTML = {
    **{name: BROKEN[name] for name in ("html", "entity", "character")},
    "markdown": MarkupKind(
        r"(?<![\w*])\*\*[^\s*][^\n*]*\*\*(?!\w)|`[^`\n]+`|!?\[[^\[\]\n]*\]\([^\s()]+\)"
        r"|^[ \t]*#{2,6}[ \t]+\S|^[ \t]*(?:`{3}|~{3})\w*|\{(?:out|given|term)\b[^{}\n]*\}",
        "inside HTML, Markdown is read only after an empty line",
        "leave a line empty after the opening tag and another before the closing one, or write "
        "HTML: `<b>`, `<code>`, `<a href=…>`",
    ),
    **FOREIGN,
}
"""What is unread between the tags of HTML, where nothing but formulas is read."""
REWRITES: dict[str, tuple[tuple[str, str, bool], ...]] = {
    "contents": ((r"\[TOC\]", "", True),),
    "entity": ((r"(&\w+)", r"\1;", True),),
    "heading": ((r"(#{2,6})(?=[^\s#])", r"\1 ", True),),
    "highlight": ((r"==(.+)==", r"**\1**", False),),
    "item": ((r"(-|\d{1,2}[.)])(?=\S)", r"\1 ", True),),
    "latex": (
        (r"\\\(\s*(.+?)\s*\\\)", r"$\1$", True),
        (r"\\\[\s*(.+?)\s*\\\]", r"$$\1$$", True),
        (r"\$`(.+)`\$", r"$\1$", True),
    ),
    "link": ((r"(!?\[[^\[\]]*\])[ \t]+(\([^()\s]+\))", r"\1\2", True),),
    "mention": ((r"Lesson (\d+)[,;:/](\d+)", r"Lesson \1.\2", False),),
    "script": (
        (r"~(.+)~", r"<sub>\1</sub>", False),
        (r"\^(.+)\^", r"<sup>\1</sup>", False),
    ),
    "task": ((r"([-*+])\[ ?\]", r"\1 [ ]", True), (r"([-*+])\[([xX])\]", r"\1 [\2]", True)),
    "binding": (
        (r"((?:out|given)\b[^{}]*\})", r"{\1", True),
        (r"([-+\u2212]?\d[\w.,]*)(\{(?:out|given)\b[^{}]*\})", r"`\1`\2", True),
    ),
    "wiki": ((r"\[\[(\d+(?:\.\d+)+)(?:-[\w-]*)?\]\]", r"Lesson \1", False),),
}
"""What to write instead of markup, in words of `re.sub`, and whether that is surely meant."""
ONCE = frozenset("link bracket table fence code emphasis character markdown".split())
"""One mistake often leaves several of these marks in a text; the first is reported."""
LANGUAGES = tuple(
    "bash console cpp css diff html ini javascript json julia markdown matlab python rust sh text "
    "toml xml yaml".split()
)
PLAIN_TEXTS = ("ascii", "ino", "jsonc", "hjson", "none", "plain", "plaintext", "raw", "txt")
"""Names of ordinary code and text that no highlighter knows."""
