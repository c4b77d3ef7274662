"""Convert lines of prose: links, pictures, mentions, formulas, roles.

Code is left alone wherever it stands, and so is whatever else is not recognized here.
"""

from __future__ import annotations

import re

from coursebuild.api import regex
from coursebuild.features.importer.account import Rules, shorten_value
from coursebuild.features.importer.anchors import (
    FIGURE,
    MARKDOWN_FIGURE,
    TABLE_CAPTION,
    TARGET,
    move_caption,
    write_captioned,
    write_figure,
    write_target,
)
from coursebuild.features.importer.context import PROOF_LABELS, LessonContext, to_anchor
from coursebuild.features.importer.displays import FORMULAS, normalize_formulas, read_escapes
from coursebuild.features.importer.pandoc_tables import (
    MEANING,
    cut_rows,
    rewrite_tables,
    write_meanings,
)
from coursebuild.features.importer.roles import (
    LOOK,
    address_of_label,
    convert_attributes,
    convert_code,
    convert_cross_reference,
    convert_role,
    convert_substitution,
    convert_tag,
    convert_wiki_link,
    draw_emoji,
    join_broken_lines,
    name_of_picture,
    rewrite_html_links,
    words_of_link,
    write_icon,
    write_key,
    write_link,
)
from coursebuild.features.importer.source_files import title_of_file

_ATTRIBUTES = (
    r"\{(?:[ ]*(?:#[^\s{}\"'#]+|\.[A-Za-z][\w:-]*"
    r"|[\w:-]+=(?:\"(?:\\.|[^\"\\\n])*\"|'[^'\n]*'|[^\s{}\"']+)|-))+[ ]*\}|\{[ ][a-z][\w-]*[ ]\}"
    r"|\{:[^{}\n]*\}"
)
_ATTRIBUTES = rf"(?:{_ATTRIBUTES})"
"""Attributes of Pandoc or of Python's Markdown, which follow what they belong to."""
_KEY = r"\w(?:[\w.:/+-]*\w)?"
"""The key of a source."""
_PLACE = r"(?:<[^<>\n]+>|(?:[^()\s<]|\([^()\s]*\))(?:[^()\s]|\([^()\s]*\))*)"
_ALT = regex(r"\balt=(['\"])(.*?)\1")
_LINK_TITLE = r"[ \t]+(?:\"[^\"\n]*\"|'[^'\n]*')"
_LINE = (
    r"(?P<role>\{(?P<name>[a-z][\w:+.-]*)\}`(?P<body>[^`\n]+)`)"
    r"|(?P<code>(?P<ticks>`+)(?!`).+?(?<!`)(?P=ticks)(?!`)(?:\{=\w+\})?)"
    rf"|(?P<image>!\[(?P<alt>[^\]\n]*)\]\((?P<source>{_PLACE})(?P<hover>{_LINK_TITLE})?[ \t]*\)"
    r"(?P<dressing>\{[^{}\n]*\})?)"
    r"|(?P<link>\[(?P<text>(?:[^\[\]\n`]|`[^`\n]+`|(?<!!)\[[^\[\]\n`]*\](?!\())*)\]"
    rf"\((?P<address>(?:@ref[ ]+)?{_PLACE})(?P<title>{_LINK_TITLE})?[ \t]*\))"
    r"|FORMULAS"
    r"|(?P<paren>\\{1,2}\((?P<inner>(?>(?:(?!\\{1,2}[()])[^\n])+))\\{1,2}\))"
    r"|(?P<square>\\{2}\[(?P<shown_tex>(?>(?:(?!\\{2}[\[\]])[^\n])+))\\{2}\])"
    r"|(?P<anchor>(?<!!)\[(?P<bare>(?:[^\[\]\n`]|!\[[^\[\]\n]*\]\([^()\n]*\))*)\]\(\)(?:\{[^{}\n]*\})?)"
    r"|(?P<object>\[(?P<called>(?:[^\[\]\n`]|`[^`\n]+`)+)\]"
    r"(?:\[(?P<path>[A-Za-z_]\w*(?:[.-]\w+)+)?\]|(?=\[\^)))"
    r"|(?P<note>\^\[(?P<remark>(?:[^\[\]\n]|\[[^\[\]\n]*\])+)\](?!\())"
    rf"|(?P<cross>(?<![\w@.])\[?-?@(?P<kind>eq|sec|fig|tbl|lst|{'|'.join(PROOF_LABELS)})"
    r"-(?P<label>\w+(?:-\w+)*)\]?)"
    r"|(?P<marked>==(?=\S)[^=\n]+==|\^\^(?=\S)[^\^\n]+\^\^|(?<![~\\])~(?:[^~\s\\]|\\.)+~(?!~)"
    r"|(?<![\\^])\^(?:[^\s\\\^\[\]]|\\.|\[[^\s\^\[\]]+\]\([^()\s]*\))+\^(?!\^))"
    r"|(?P<change>^(?:\{==|==\})[ \t]*$|\{(?:\+\+|--|~~|==|>>)[^{}\n]*?(?:\+\+|--|~~|==|<<)\})"
    r"|(?P<wiki>!?\[\[(?!@)(?P<page>[^\[\]|#\n\\]*)(?P<part>#[^\[\]|\n\\]*)?"
    r"(?:\\?\|(?P<shown>[^\[\]\n]+))?\]\])"  # in a table, Obsidian escapes the bar
    r"|(?P<auto><(?:project|path|inv|xref):[^<>\s]+>)"
    r"|(?P<latex>\\(?:newline|newpage|pagebreak|clearpage|noindent|(?:small|med|big)skip|[hv]fill|pause"
    r"|(?:footnote|script|normal)size)"
    r"(?![A-Za-z])[ ]?|\\[hv]space\*?\{[^{}\n]*\}|\\index\w*\{(?:[^{}\n]|\{[^{}\n]*\})*\})"
    r"|(?P<definition>^[ ]{0,3}\[(?!\^)[^\[\]\n]+\]:[ \t]*(?P<named>[^\s<]+)(?=[ \t]*(?:$|[\"'(])))"
    rf"|(?P<cite>\[(?:[^\[\]\n`@]*[\s(])?-?@{_KEY}(?:[;,\s][^\[\]\n]*)?\])"
    rf"|(?P<told>(?<![\w@.\\/])@(?P<work>{_KEY})(?:[ ]?\[[, ]*(?P<cited>[^\[\]\n@]+)\](?!\())?)"
    r"|(?P<pair>\{%[ ]*(?P<opened>[a-z]\w*)\b[^{}%\n]*%\}"
    r"(?P<held>(?:(?!\{%)[^\n])*)\{%[ ]*end(?P=opened)[ ]*%\})"
    r"|(?P<substitution>\{\{[^{}\n]*\}\}|\{%[^%\n]*%\})"
    r"|(?P<blank>(?<!\\)\\[ ])"
    r"|(?P<mention>\bLevel[ \u00a0](?P<level>\d+\.\d+)\b)"
    rf"|(?P<tail>\]\((?P<rest>{_PLACE})(?=(?:{_LINK_TITLE})?[ \t]*\)))"  # its text is above
    r"|(?P<icon>:(?:material|octicons|fontawesome|simple)-(?P<sign>[\w-]+?)(?:-\d+)?:"
    r"(?:\{[^{}\n]*\})?(?:[ ]|&nbsp;)*)"
    r"|(?P<emoji>(?<![\w:]):[a-z+-][a-z0-9_+-]*:(?![\w:]))|(?P<block>(?<!\S)\^(?P<id>[\w-]+)$)"
    r"|(?P<keys>(?<![\w+])\+\+(?P<stroke>(?:[a-z0-9-]+|\"[^\"\n]+\")(?:\+(?:[a-z0-9-]+|\"[^\"\n]+\"))*)\+\+(?![\w+]))"
    r"|(?P<tag><[A-Za-z][\w-]*[ \t][^<>\n]*>(?:</(?i:img|source|iframe)>)?)"
    rf"|(?P<attributes>(?:(?<=[^\s$])|(?<=[^$]\$)|^(?::[ ])?)(?:[ ]+#+)?[ ]?{_ATTRIBUTES})"
    r"|(?P<dashes>(?<=[\w,.;:!?)\"'*_`][ ])-{2,3}(?=[ ])"
    r"|(?<=[a-z\d])--(?=[A-Za-z\d])|(?<=[\w,.;:!?)\"'*_`])---(?=[\w(\"'*_`]))"
    rf"|(?P<span>(?<!\])\[(?P<words>[^\[\]\n`]*)\]{_ATTRIBUTES})"
)
_LINES = {begin: regex(_LINE.replace("FORMULAS", text)) for begin, text in FORMULAS.items()}
GONE = "gone:"
"""The address of a link by reference to what is not in the folder."""
_FIELDS = regex(
    r"(?<![^\n]\n)(?:^:[A-Za-z][\w. -]*:(?:[ \t]+\S[^\n]*)?(?:\n[ \t]+\S[^\n]*)*\n?)+^(?!.)",
    re.MULTILINE,
)
"""A paragraph of lines such as `:name: words`, a list of fields in Sphinx."""
_ABBREVIATION = regex(r"^\*\[(?P<short>[^\]\n]+)\]:[ \t]*(?P<long>.*)\n?", re.MULTILINE)
_EDGE = regex(
    r"[ \t>]*(?:(?:[-+*]|\d+[.)])[ \t]+)?"
    r"(`{3,}|~{3,}|<!--(?!.*-->)|<pre(?=[\s>])(?!.*</pre>)|\$\$(?!.*\$\$))"
)
"""The first or last line of code in a quotation or a list, or the first of what `_ENDS` has."""
_PICTURE_LINE = regex(r"^<(?i:img)\b[^<>]*>[ \t]*\n(?=[^\s<])", re.MULTILINE)
"""A picture of HTML above words, which would be HTML as well."""
_HOLDER = regex(r"[ \t]*<\w+\b[^<>]*\smarkdown(?:=.?(?:1|block).?)?(?:\s[^<>]*)?>[ \t]*")
"""A tag of HTML around Markdown, which would be HTML without a blank line."""
_ENDS = {"<!--": "-->", "<pre": "</pre>", "$$": "$$"}
_COMMENT = regex(
    r"%%(?P<inner>[^%\n]+)%%|^%%[ \t]*\n(?P<lines>(?:(?!%%)[^\n]*\n)+)%%[ \t]*$"
    r"|^(?:%(?!%)(?P<line>[^\n]*)|\+\+\+(?:[ \t]+(?P<data>[{\[][^\n]*))?[ \t]*)$",
    re.MULTILINE,
)
"""A comment of MyST or Obsidian, or the break of MyST between two cells."""
_QUOTED_TITLE = regex(r"^[ ]{0,3}>[ \t>]*#(?=[ \t])", re.MULTILINE)
_COMMENT_AS_HEADING = regex(
    r"^(#{1,6}[ \t]+)?<!--[ \t]*([^\n`]+?)[ \t]*-->[ \t]*$(?(1)|(?=\n+:[ \t]))", re.MULTILINE
)
"""Or as a term whose meaning is below it."""
_CONTENTS = regex(
    r'<div class="toc">.*?</div>|^(?:\[TOC\]|\[\[_?TOC_?\]\])[ \t]*$', re.DOTALL | re.M
)
"""What Jupyter's extension and Python's Markdown replace by a list; the page has its own."""
_SETTINGS = regex(
    r"(?:\A|(?<=\n\n))---[ \t]*\n(?:\w[\w-]*:(?: [^\n]*)?\n(?:[ \t]+[^\n]*\n)*)+---[ \t]*$",
    re.MULTILINE,
)
"""Settings of Pandoc, which takes them anywhere."""
_KEPT = {
    regex(r"^[ >]*#{1,6}[ \t]+\S", re.MULTILINE): "heading",
    regex(r"^[ >]*\|?[ \t]*:?-+:?[ \t]*(?:\|[ \t]*:?-+:?[ \t]*)+\|?[ \t]*$", re.MULTILINE): "table",
    regex(r"^\[\^[^\[\]\n]+\]:", re.MULTILINE): "footnote",
    regex(r"^[ >]*(?:[-+*]|\d+[.)])[ \t]+\S", re.MULTILINE): "item of a list",
    regex(r"<!--.*?-->", re.DOTALL): "comment",
    regex(r"\$\$[^$]+\n[^$]*\$\$"): "formula",
}
"""What is Markdown here as well."""
_TAG_OVER_LINES = regex(
    r"<(?i:a|img|source|video|iframe)[ \t\n](?=[^<>\n]*\n)[^<>]*>(?:\s*</iframe>)?"
)
_KINDS = {
    "role": ("", "Markdown"),
    "code": ("code in a line", "code without the tool's mark"),
    "image": ("picture", "its file is in content/files"),
    "digits": ("formula", "the digits behind it are in it"),
    "math": ("formula", "without blanks at its ends"),
    "dollar": ("dollar sign", "with a backslash, as no formula begins there"),
    "paren": ("formula", "between dollar signs"),
    "square": ("formula", "between dollar signs"),
    "anchor": ("link", "dropped: it has no text and no address"),
    "object": ("link", "its words: what it leads to is made from code by another tool"),
    "note": ("footnote", "stands at the end of the lesson"),
    "cross": ("cross-reference", "a link"),
    "cite": ("citation", "in the words of BibTeX's keys"),
    "told": ("citation", "its authors, and the source"),
    "pair": ("pair of tags", "what it holds, without a frame"),
    "substitution": ("substitution", "the words that it stands for"),
    "marked": ("marked words", "a tag of HTML"),
    "change": ("suggested change", "as if it had been accepted"),
    "latex": ("command of LaTeX", "dropped: it changes no word"),
    "blank": ("escaped blank", "one at which no line breaks"),
    "mention": ("mention of a lesson", "its new number"),
    "icon": ("icon", "its sign, or its name where it is alone; else dropped"),
    "emoji": ("emoji", "its sign"),
    "block": ("block of Obsidian", "an anchor"),
    "keys": ("keys", "tags of HTML"),
    "definition": ("link by reference", "its new address"),
    "tag": ("tag of HTML", "its new address; without classes, and without `markdown`"),
    "attributes": ("attributes", "an anchor, or dropped: a page has its own look"),
    "dashes": ("dashes", "the sign that its tool draws"),
    "span": ("attributes", "its words alone"),
}
"""The kind of what a group of `_LINE` is, and how it is changed."""


def rewrite_prose(text: str, context: LessonContext) -> str:
    """Return prose of any dialect as Markdown of coursebuild."""
    account = context.files.account

    def leave_grid(line: int) -> None:
        message = "a table whose bars do not stand in columns, shown as it was written"
        context.line_below(line).leave("table or verse of Pandoc", message)

    text, count = rewrite_tables(text, leave_grid)
    change = "its rows between bars, a cell in one line; or a verse in lines that end"
    context.change("table or verse of Pandoc", change, count)
    if context.is_pandoc:
        text = _SETTINGS.sub("", text)
    for pattern, kind in _KEPT.items():
        account.taken[kind] += len(pattern.findall(text))
    for rule in _BLOCKS:
        text = account.replace(text, *rule)
    if context.path.endswith(".ipynb"):  # MathJax takes the second of two backslashes
        text = re.sub(r"\\\\\$(?=\d)", r"\\$", text)
    text = read_escapes(text) if context.path.endswith(".md") else text
    if context.files.dollars:
        text = normalize_formulas(text)
    text = _TAG_OVER_LINES.sub(lambda tag: convert_tag(tag[0], context), join_broken_lines(text))
    text = rewrite_html_links(text, context)
    for abbreviation in _ABBREVIATION.finditer(text):
        message = f"`{abbreviation['short']}` for “{abbreviation['long']}”: say so where it is used"
        context.leave("abbreviation", message)
    text = _ABBREVIATION.sub("", text)
    if "conf.py" in context.files:
        change = "a list; dropped where no field says a word"
        text = account.replace(text, _FIELDS, _write_fields, "list of fields", change)
    for rule in _PARAGRAPHS:
        text = account.replace(text, *rule)
    out, mark, lines = [], "", text.split("\n")
    for number, line in enumerate(lines):
        below = "".join(lines[number + 1 : number + 2])
        is_open = _HOLDER.fullmatch(line) and re.match(r"[ ]{,3}\S", below)
        edge = _EDGE.match(line)
        if edge is None and not mark:
            line = _rewrite_line(line, context.line_below(number))
        elif mark in _ENDS:
            mark = "" if _ENDS[mark] in line or (not line.strip() and mark == "$$") else mark
        elif edge is not None and edge[1].startswith(mark):
            mark = "" if mark else edge[1]
            line = LOOK.sub("", line) if mark == "<pre" else line
        out.append(f"{line}\n" if is_open else line)

    def leave_cells(line: int, cells: str) -> None:
        message = f"`{cells}`, cells of a row that no column of the table has"
        context.line_below(line).leave("table", message)

    text = "\n".join(cut_rows(out, leave_cells))
    text = _PICTURE_LINE.sub(r"\g<0>\n", text)
    return FIGURE.sub(write_figure, text) if context.is_pandoc else text


def _write_comment(match: re.Match[str]) -> str:
    """Return a comment as one of HTML; nothing for a mark that says nothing."""
    words = (match["inner"] or match["lines"] or match["line"] or match["data"] or "").strip()
    return f"<!-- {words.replace('-->', '--›')} -->" if words else ""


_BLOCKS: Rules = (
    (MARKDOWN_FIGURE, write_captioned, "figure", "a picture with its caption"),
    (_CONTENTS, "", "table of contents", "dropped: the site has its own"),
    (_QUOTED_TITLE, r"\g<0>#", "heading in a quotation", "a level lower"),
    (_COMMENT_AS_HEADING, r"\1`\2`", "comment", "words of a heading or term that has no others"),
    (_COMMENT, _write_comment, "comment of MyST", "a comment of HTML"),
)
"""What is changed before the lines of a text are read, and how the account calls it."""


def _write_fields(match: re.Match[str]) -> str:
    """Return fields as items of a list; those without words are for the tool."""
    fields = re.findall(r"^:([^:\n]+):[ \t]+(\S[^\n]*(?:\n[ \t][^\n]*)*)", match[0], re.MULTILINE)
    return "".join(f"- **{name}**: {' '.join(words.split())}\n" for name, words in fields)


_PARAGRAPHS: Rules = (
    (TARGET, write_target, "label", "an anchor"),
    (MEANING, write_meanings, "definition", "behind its term, which is bold"),
    (TABLE_CAPTION, move_caption, "caption of a table", "stands above it"),
)
"""What is changed once formulas and tags are on lines of their own."""


def _rewrite_line(line: str, context: LessonContext) -> str:
    def rewrite(match: re.Match[str]) -> str:
        group = match.lastgroup or ""
        kind, change = _KINDS.get(group, ("link", "its new address"))
        if group == "role":
            kind = f"role `{{{match['name']}}}`"
        return context.files.account.convert(
            kind, change, match[0], lambda: _rewrite_match(match, context)
        )

    return _LINES[context.files.dollars].sub(rewrite, line)


def _rewrite_match(match: re.Match[str], context: LessonContext) -> str:
    whole = match[0]
    match match.lastgroup:
        case "role":
            return convert_role(match["name"], match["body"], context)
        case "image":
            dressing, hover = match["dressing"] or "", match["hover"] or ""
            alt = match["alt"] or "".join(words for _, words in _ALT.findall(dressing))
            source = match["source"].strip("<>")
            if source.startswith("#"):
                return convert_role("embed", source[1:], context)
            if source.endswith(("#only-dark", "#gh-dark-mode-only")):
                return ""  # a page makes its pictures dark itself
            if re.match("[a-z]+://|//", source):
                message = f"a picture from another host, `{source}`; it is a link now"
                context.leave("picture", message)
                alt = alt or name_of_picture(source)
                is_in_link = f"[{whole}](" in match.string
                return alt if is_in_link else f"[{alt}]({source})"
            hover = "" if hover.lstrip()[1:2] == ":" else hover  # a size of Docsify
            if address := context.resolve_picture(source):
                return f"![{alt}]({address}{hover}){dressing * dressing.startswith('{#fig-')}"
            context.leave("picture", f"the picture `{shorten_value(source)}`, not in the folder")
            return alt
        case "link":
            address = context.resolve_link(match["address"].strip("<>"))
            text = _rewrite_line(match["text"], context) or words_of_link(address, match["address"])
            return write_link(text, address, match["title"] or "")
        case "anchor":
            words = match["bare"]
            if words and "](" not in words:
                context.leave("link", f"the link “{words}”, which has no address")
            return _rewrite_line(words, context)
        case "icon":
            return write_icon(match)
        case "object":
            called = match["called"]
            if (match["path"] or called).casefold() in context.references:
                # What stands before a note would be called by it
                return whole if len(whole) > len(called) + 2 else f"{whole}[]"
            words = _rewrite_line(called, context)
            if match["path"] is not None:
                return write_link(words, context.resolve_anchor(to_anchor(match["path"])))
            return words if re.fullmatch(r"`?[A-Za-z_]\w*(?:\.\w+)+`?", called) else whole
        case "dollar":
            # An indented line may be code, in which one alone is a prompt.
            return whole if re.match(r"(?: {4}|\t)[^$]*\$[^$]*\Z", match.string) else r"\$"
        case "digits" if _WORD.search(match["tex"]):  # two prices
            return "$".join(_rewrite_line(part, context) for part in whole.split("$"))
        case "paren" if context.files.dollars == "$":
            return f"${match['inner'].strip()}$"
        case "paren":
            return rf"\({_rewrite_line(match['inner'], context)}\)"
        case "square":
            return f"$${match['shown_tex'].strip()}$$"
        case "note" if not context.files.mkdocs:
            return context.add_note(_rewrite_line(match["remark"], context))
        case "math":
            formula = whole.replace("&lt;", "<").replace("&gt;", ">")  # as some notebooks hold it
            if _WORD.search(formula):
                return whole
            if context.path.endswith(".ipynb") and match.string.lstrip().startswith("|"):
                formula = re.sub(r"(?<!\\)\|", r"\\vert ", formula)  # no bar there ends a cell
            mark = "$$" if formula.startswith("$$") else "$"
            is_in_line = context.files.docusaurus and match.string.strip() != whole
            if mark == "$$" and not is_in_line:  # which is on a line of its own there
                return formula
            return convert_role("math", formula.removeprefix(mark).removesuffix(mark), context)
        case "code":
            is_cell = context.has_marks and re.match(r"[ \t]*\|", match.string)
            code = convert_code(whole, context)
            return re.sub(r"(?<!\\)\|", r"\\|", code) if is_cell else code
        case "digits":  # no digit may follow the closing dollar sign
            return f"${match['tex']}{match['number']}$"
        case "cross":
            return convert_cross_reference(whole, match["kind"], match["label"], context)
        case "cite":
            if whole[1:-1].casefold() in context.references or not context.has_citations:
                return whole.replace("@", r"\@")
            keys = _CITED_KEY.findall(whole)
            if any(key.partition("-")[0] in _CROSS_KINDS for key in keys):
                return _rewrite_line(whole[1:-1], context)
            if keys and context.are_sources(keys):
                return re.sub(rf"(@{_KEY}),(?=[ ]*@)", r"\1;", whole.replace("-@", "@"))
            message = f"`{whole}`, a source that no BibTeX file of the folder has; it is code now"
            context.leave("citation", message)
            return f"(<{keys[0]}>)" if whole.startswith("[@http") else f"`{whole}`"
        case "told":
            if match["work"] in context.sources:
                return context.cite_in_words(match["work"], match["cited"] or "")
            label = match["work"] if "myst.yml" in context.files and not match["cited"] else ""
            return write_link("", label and address_of_label(label, context)) or whole
        case "pair":
            return _rewrite_line(match["held"], context)
        case "substitution":
            return convert_substitution(whole, context, bool(_STATEMENTS.fullmatch(match.string)))
        case "marked":
            mark = whole[:2] if whole[:2] in _MARKS else whole[0]
            if mark != "==" and not context.has_marks:
                return whole
            words = whole.removeprefix(mark).removesuffix(mark).replace(r"\ ", "&nbsp;")
            return f"<{_MARKS[mark]}>{_rewrite_line(words, context)}</{_MARKS[mark]}>"
        case "change":
            words, mark = whole[3:-3], whole[1:3]
            if not context.has_marks:
                return whole
            return "" if mark in ("--", ">>") else _rewrite_line(words.rpartition("~>")[2], context)
        case "wiki":
            page, part = match["page"].strip(), match["part"] or ""
            return convert_wiki_link(whole, page, part, match["shown"] or "", context)
        case "auto":
            words = title_of_file(whole[1:-1].partition(":")[2])
            return write_link(words, context.resolve_link(whole[1:-1]))
        case "latex":
            if not context.has_marks and match.string.strip() != whole.strip():
                return whole
            if "{" in whole:
                context.leave("command of LaTeX", f"`{whole}`, which no page here shows")
            return ""
        case "blank" if context.is_pandoc or "escapeall" in context.files.mkdocs:
            return "&nbsp;"
        case "mention":
            lesson_id = context.ids.get(match["level"])
            return whole if lesson_id is None else f"Lesson {lesson_id}"
        case "emoji":
            return draw_emoji(whole, context)
        case "block" if (context.files.folder / ".obsidian").is_dir():
            return f'<a id="{to_anchor(match["id"])}"></a>'
        case "keys":
            strokes = _STROKE.findall(match["stroke"])
            return "+".join(write_key(sign or name.capitalize()) for sign, name in strokes)
        case "tail":
            return f"]({context.resolve_link(match['rest'].strip('<>')) or GONE}"
        case "definition":
            label = _CITED_KEY.sub(r"\@\1", whole.removesuffix(match["named"]))
            return label + (context.resolve_link(match["named"]) or GONE)
        case "tag":
            return convert_tag(whole, context)
        case "dashes":
            return "–—"[len(whole) - 2] if context.files.has_signs(context.path) else whole
        case "attributes":
            return convert_attributes(match)
        case "span":
            label = re.search(r"\]\{[ ]*#([\w-]+)", whole)
            anchor = f'<a id="{to_anchor(label[1])}"></a>' if label else ""
            words = _rewrite_line(match["words"], context)
            return anchor + (context.add_note(words) if ".aside" in whole else words)
        case _:
            return whole


_STATEMENTS = regex(r"\s*(?:\{%[^%\n]*%\}\s*)+")
"""A line of nothing but statements of Jinja or Liquid."""
_MARKS = {"==": "mark", "^^": "ins", "~": "sub", "^": "sup"}
_STROKE = regex(r"\"([^\"]+)\"|([^+]+)")
_CROSS_KINDS = ("eq", "sec", "fig", "tbl", "lst", *PROOF_LABELS)
_CITED_KEY = regex(rf"(?<![\w@`])@({_KEY})")
_WORD = regex(r"(?s)\A(?!.*\\[A-Za-z]).*(?<![A-Za-z{])[A-Za-z]{2,}(?![A-Za-z]*\})")
"""A word outside of braces and no command, as of a sentence between two prices."""
