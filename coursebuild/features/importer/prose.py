"""Convert lines of prose: links, pictures, mentions, formulas, roles.

Code is left alone, in lines and in blocks within quotations and lists, and so is whatever else is
not recognized here.
"""

from __future__ import annotations

import re

from coursebuild.features.importer.context import (
    LessonContext,
    formula_anchor,
    label_anchor,
    to_anchor,
)
from coursebuild.features.importer.roles import convert_code, convert_role, write_link
from coursebuild.features.importer.source_files import title_of_file

_ATTRIBUTES = (
    r"\{(?:[ ]*(?:#[^\s{}\"'#]+|\.[A-Za-z][\w:-]*"
    r"|[\w:-]+=(?:\"[^\"\n]*\"|'[^'\n]*'|[^\s{}\"']+)|-))+[ ]*\}"
    r"|\{:[^{}\n]*\}"
)
_ATTRIBUTES = rf"(?:{_ATTRIBUTES})"
"""Attributes of Pandoc or of Python's Markdown, which follow what they belong to."""
_KEY = r"\w(?:[\w.:/+-]*\w)?"
"""The key of a source."""
_PLACE = r"(?:[^()\s]|\([^()\s]*\))+"
_LINK_TITLE = r"[ \t]+(?:\"[^\"\n]*\"|'[^'\n]*')"
# A formula holds no beginning of another: so each character is looked at a few times, not once for
# each beginning before it.
_LINE = re.compile(
    r"(?P<role>\{(?P<name>[a-z][\w:+.-]*)\}`(?P<body>[^`\n]+)`)"
    r"|(?P<code>(?P<ticks>`+)(?!`).+?(?<!`)(?P=ticks)(?!`))"
    rf"|(?P<image>!\[(?P<alt>[^\]\n]*)\]\((?P<source>{_PLACE})(?:{_LINK_TITLE})?[ \t]*\)"
    r"(?P<dressing>\{[^{}\n]*\})?)"
    r"|(?P<link>\[(?P<text>(?:[^\[\]\n`]|`[^`\n]+`)*)\]"
    rf"\((?P<address>{_PLACE})(?P<title>{_LINK_TITLE})?[ \t]*\))"
    r"|(?P<digits>\$(?P<tex>[^$\s](?:[^$\n]*[^$\s\\])?)\$(?P<number>\d[\d.,]*\d|\d))"
    r"|(?P<math>\$\$?[^$\n]+\$\$?)"
    r"|(?P<paren>\\{1,2}\((?P<inner>(?>(?:(?!\\{1,2}[()])[^\n])+))\\{1,2}\))"
    r"|(?P<anchor>\[\]\(\)(?:\{[^{}\n]*\})?)"
    r"|(?P<object>\[(?P<called>(?:[^\[\]\n`]|`[^`\n]+`)+)\]\[(?P<path>[A-Za-z_]\w*(?:\.\w+)+)?\])"
    r"|(?P<note>\^\[(?P<remark>(?:[^\[\]\n]|\[[^\[\]\n]*\])+)\])"
    r"|(?P<cross>(?<![\w@.])\[?-?@(?P<kind>eq|sec|fig|tbl|lst)-(?P<label>[\w-]+)\]?)"
    rf"|(?P<cite>\[(?:[^\[\]\n`@]*[\s(])?-?@{_KEY}(?:[;,\s][^\[\]\n]*)?\])"
    r"|(?P<pair>\{%[ ]*(?P<opened>[a-z]\w*)\b[^{}%\n]*%\}"
    r"(?P<held>(?:(?!\{%)[^\n])*)\{%[ ]*end(?P=opened)[ ]*%\})"
    r"|(?P<substitution>\{\{[^{}\n]*\}\}|\{%[^{}\n]*%\})"
    r"|(?P<mention>\bLevel[ \u00a0](?P<level>\d+\.\d+)\b)"
    r"|(?P<route>(?<=[\"'(<])#/lessons?/[\w.-]+(?:#[\w-]+)?)"
    rf"|(?P<tail>\]\((?P<rest>{_PLACE})(?=(?:{_LINK_TITLE})?[ \t]*\)))"  # its text is above
    r"|(?P<icon>:(?:material|octicons|fontawesome|simple)-[\w-]+:)"
    r"|(?P<keys>(?<![\w+])\+\+(?P<stroke>[a-z][a-z0-9-]*(?:\+[a-z0-9-]+)*)\+\+(?![\w+]))"
    r"|(?P<definition>^[ ]{0,3}\[(?!\^)[^\[\]\n]+\]:[ \t]*(?P<named>[^\s<]+)(?=[ \t]*(?:$|[\"'(])))"
    r"|(?P<tag><(?i:a|img|source|video)[ \t][^<>\n]*>(?:</(?i:img|source)>)?)"
    r"|(?P<markdown>(?P<before><[a-z]\w*(?:[ ][^<>\n]*?)?)[ ]markdown(?:=[\"'\w]+)?(?=[ >]))"
    rf"|(?P<attributes>(?:(?<=[^\s$])|^(?::[ ])?)(?:[ ]+#+)?[ ]?{_ATTRIBUTES})"
    rf"|(?P<span>\[(?P<words>[^\[\]\n`]*)\]{_ATTRIBUTES})"
)
_ATTRIBUTE = re.compile(r"(?<=[ \t])(href|src|srcset)(=[\"'])([^\"'\n]+)", re.IGNORECASE)
_DISPLAY = re.compile(
    r"\$\$(?P<tex>(?:[^$\\]|\\.)+?)\$\$"
    r"(?:[ \t]*(?:\((?P<myst>[\w:.-]+)\)|\{#(?P<quarto>[\w:.-]+)\}))?"
    r"(?:[ \t]*<br[ ]*/?>)*(?P<behind>[ \t]*(?=[^\s.,;:]|[.,;:][ \t]*\S))?",
    re.DOTALL,
)
_ENVIRONMENT = re.compile(
    r"\$\$(?>[^$]+)\$\$|^[ \t]*"
    r"(?P<tex>\\begin\{(?P<env>align|aligned|alignat|eqnarray|equation|flalign|gather|multline|split)(?P<star>\*?)\}"
    r"(?>(?:(?!\\(?:begin|end)\{(?P=env)(?P=star)\}).)*)"
    r"\\end\{(?P=env)(?P=star)\})[ \t]*$",
    re.DOTALL | re.MULTILINE,
)
"""A formula between dollar signs, or one that its environment alone makes one."""
_BRACKETS = re.compile(
    r"^(?P<lead>[ \t]*)(?:\\\[(?P<tex>(?>(?:(?!\\[\[\]]).)+))\\\]"
    r"|\$(?P<lines>[ \t]*\n(?:(?!\n[ \t]*\n)[^$])+)\$)[ \t]*$",
    re.DOTALL | re.MULTILINE,
)
"""A formula between brackets, or below a line that holds nothing but a dollar sign."""
_TARGET = re.compile(
    r"^\((?P<name>[\w:.-]+)\)=[ \t]*(?:\n+(?P<heading>#{1,6}[ \t].*))?$", re.MULTILINE
)
GONE = "gone:"
"""The address of a link by reference to what is not in the folder."""
_CAPTION = re.compile(
    r"^(?P<table>(?:\|.*\n)+)\n?:[ ]+(?P<caption>.*?)[ ]*(?:\{#tbl-(?P<label>[\w-]+)[^{}]*\})?$",
    re.MULTILINE,
)
"""A caption of Quarto, below its table."""
_MEANING = re.compile(
    r"^(?<![^\n]\n)(?![|:#>\s<]|[-*+][ ])([^\n]*[^\s\n:])[ \t]*\n:[ \t]+(?=\S)", re.MULTILINE
)
"""A term in a paragraph of its own, and the mark of what it means."""
_LABEL = re.compile(r"\\label\{([^{}]*)\}")
_LEAD = re.compile(r"\n[ \t>]*\Z")
"""What stands before the mark that ends a formula, on a line of its own."""
_WORDS_BEFORE = re.compile(r"[ \t>]*(?>(?:(?:[-+*]|\d+[.)])(?:[ \t]+|$))?)[^\s>]")
_WHOLE_ENVIRONMENT = re.compile(r"\\begin\{(\w+\*?)\}.*?\\end\{\1\}", re.DOTALL)
_EDGE = re.compile(r"[ \t>]*(?:(?:[-+*]|\d+[.)])[ \t]+)?(`{3,}|~{3,}|<!--(?!.*-->)|\$\$(?!.*\$\$))")
"""The first or last line of code in a quotation or a list, or the first of a comment or formula."""
_ENDS = {"<!--": "-->", "$$": "$$"}
_COMMENT = re.compile(r"^(?:%[^\n]*|\+\+\+(?:[ \t]+[{\[][^\n]*)?[ \t]*$)\n?", re.MULTILINE)
"""A comment of MyST, or its break between two cells."""
_COMMENT_AS_HEADING = re.compile(
    r"^(#{1,6})[ \t]+<!--[ \t]*([^\n`]+?)[ \t]*-->[ \t]*$", re.MULTILINE
)
_CONTENTS = re.compile(
    r'<div class="toc">.*?</div>|^(?:\[TOC\]|\[\[_?TOC_?\]\])[ \t]*$', re.DOTALL | re.M
)
"""What Jupyter's extension and Python's Markdown replace by a list; the page has its own."""


_KEPT = {
    re.compile(r"^[ >]*#{1,6}[ \t]+\S", re.MULTILINE): "heading",
    re.compile(
        r"^[ >]*\|?[ \t]*:?-+:?[ \t]*(?:\|[ \t]*:?-+:?[ \t]*)+\|?[ \t]*$", re.MULTILINE
    ): "table",
    re.compile(r"^\[\^[^\[\]\n]+\]:", re.MULTILINE): "footnote",
    re.compile(r"^[ >]*(?:[-+*]|\d+[.)])[ \t]+\S", re.MULTILINE): "item of a list",
    re.compile(r"<!--.*?-->", re.DOTALL): "comment",
    re.compile(r"\$\$[^$]+\n[^$]*\$\$"): "formula",
}
"""What is Markdown here as well."""
_OVER_LINES = re.compile(
    r"(?<![\w$\\])\{[a-z][\w:+.-]*\}`(?=[^`\n]*\n)(?:[^`\n]|\n(?![ \t]*\n))+`"
    r"|\^\[(?=[^\[\]\n]*\n)(?:[^\[\]\n]|\n(?![ \t]*\n))+\]"
    r"|\[-?@(?=[^\[\]\n]*\n)(?:[^\[\]\n]|\n(?![ \t]*\n))+\]"
    r"|(?<=\]\()[^()\s]+[ \t]*\n[ \t]*\)"
)
"""A role, a note, a citation or the address of a link that goes on in the next line."""
_FIGURE = re.compile(
    r"(?:(?<=\n\n)|(?<=\A\n)|\A)!\[(?P<alt>[^\]\n]+)\]\((?P<source>[^()\s]+)\)"
    r"\{#fig-(?P<label>[\w-]+)(?:[^{}\n]*?fig-alt=\"(?P<alternative>[^\"\n]*)\")?[^{}\n]*\}(?=\n|\Z)"
)
_KINDS = {
    "role": ("", "Markdown"),
    "code": ("code in a line", "code without the tool's mark"),
    "image": ("picture", "its file is in content/files"),
    "link": ("link", "its new address"),
    "digits": ("formula", "the digits behind it are in it"),
    "math": ("formula", "without blanks at its ends"),
    "paren": ("formula", "between dollar signs"),
    "anchor": ("link", "dropped: it has no text and no address"),
    "object": ("link", "its words: what it leads to is made from code by another tool"),
    "note": ("footnote", "stands at the end of the lesson"),
    "cross": ("cross-reference", "a link"),
    "cite": ("citation", "in the words of BibTeX's keys"),
    "pair": ("pair of tags", "what it holds, without a frame"),
    "substitution": ("substitution", "dropped: it changes no word"),
    "mention": ("mention of a lesson", "its new number"),
    "route": ("link", "its new address"),
    "tail": ("link", "its new address"),
    "icon": ("icon", "dropped: it is a picture of its tool"),
    "keys": ("keys", "their names"),
    "definition": ("link by reference", "its new address"),
    "tag": ("tag of HTML", "its new address"),
    "markdown": ("tag of HTML", "without `markdown`: its text always is"),
    "attributes": ("attributes", "an anchor, or dropped: a page has its own look"),
    "span": ("attributes", "its words alone"),
}
"""The kind of what a group of `_LINE` is, and how it is changed."""


def rewrite_prose(text: str, context: LessonContext) -> str:
    """Return prose of any dialect as Markdown of coursebuild."""

    def write_target(match: re.Match[str]) -> str:
        anchor = to_anchor(match["name"])
        if match["heading"] is None:
            return f'<a id="{anchor}"></a>'
        return f"{match['heading'].rstrip()} {{#{anchor}}}"

    account = context.files.account
    for pattern, kind in ((_CONTENTS, "table of contents"), (_COMMENT, "comment of MyST")):
        text, count = pattern.subn("", text)
        if count:
            account.changed[kind, "dropped: readers did not see it, or the site has its own"] += (
                count
            )
    text, count = _COMMENT_AS_HEADING.subn(r"\1 `\2`", text)
    if count:
        change = "the words of a heading that has no others: its tool replaces it"
        account.changed["comment", change] += count
    for pattern, kind in _KEPT.items():
        if count := len(pattern.findall(text)):
            account.taken[kind] += count
    text = _OVER_LINES.sub(_join_lines, normalize_formulas(text))
    text, count = _TARGET.subn(write_target, text)
    if count:
        account.changed["label", "an anchor"] += count
    text, count = _MEANING.subn(r"**\1**: ", text)
    if count:
        account.changed["definition", "behind its term, which is bold"] += count
    text, count = _CAPTION.subn(_move_caption, text)
    if count:
        account.changed["caption of a table", "stands above it"] += count
    out, mark = [], ""
    for number, line in enumerate(text.split("\n")):
        edge = _EDGE.match(line)
        if edge is None and not mark:
            line = _rewrite_line(line, context.line_below(number))
        elif mark in _ENDS:
            mark = "" if _ENDS[mark] in line or (not line.strip() and mark == "$$") else mark
        elif edge is not None and edge[1].startswith(mark):
            mark = "" if mark else edge[1]
        out.append(line)
    return _FIGURE.sub(_write_figure, "\n".join(out))


def _join_lines(match: re.Match[str]) -> str:
    """Return a role or note on one line, and behind it the line ends that stood in it."""
    lines = match[0].split("\n")
    return " ".join(line.strip() for line in lines) + "\n" * (len(lines) - 1)


def _write_figure(match: re.Match[str]) -> str:
    """Return a labelled picture in a paragraph of its own, as Quarto has it, with its caption."""
    alt = match["alternative"] or match["alt"]
    return (
        f"Figure: ![{alt}]({match['source']}) {match['alt']} {{#fig:{to_anchor(match['label'])}}}"
    )


def _rewrite_line(line: str, context: LessonContext) -> str:
    def rewrite(match: re.Match[str]) -> str:
        group = match.lastgroup or ""
        kind, change = _KINDS[group]
        if group == "role":
            kind = f"role `{{{match['name']}}}`"
        return context.convert(kind, change, match[0], lambda: _rewrite_match(match, context))

    return _LINE.sub(rewrite, line)


def normalize_formulas(text: str) -> str:
    """Put LaTeX formulas between dollar signs, and write labels as `{#eq:name}`."""
    text = _BRACKETS.sub(lambda m: f"{m['lead']}$${m['tex'] or m['lines']}$$", text)
    text = _ENVIRONMENT.sub(lambda m: f"$${m['tex']}$$" if m["tex"] else m[0], text)
    return _DISPLAY.sub(_label_formula, text)


def display_formula(tex: str, label: str) -> str:
    """Return a displayed formula in Markdown."""
    return f"$$\n{tex.strip()}\n$$" + (f" {{#eq:{formula_anchor(label)}}}" if label else "")


def _move_caption(match: re.Match[str]) -> str:
    label = f" {{#tab:{to_anchor(match['label'])}}}" if match["label"] else ""
    return f"Table: {match['caption']}{label}\n\n{match['table']}"


def _label_formula(match: re.Match[str]) -> str:
    inside = _LABEL.search(match["tex"])
    label = match["myst"] or match["quarto"] or (inside[1] if inside else "")
    tex = _LABEL.sub("", match["tex"])
    tex = re.sub(r"\n(?:[ \t]*\n)+", "\n", tex)
    bare = _WHOLE_ENVIRONMENT.sub("", tex)
    if re.search(r"(?<!\\)&", bare):  # MyST aligns at `&`, and needs no environment
        tex = f"\n\\begin{{aligned}}\n{tex.strip()}\n\\end{{aligned}}\n"
    opening, closing = "", match["behind"] or ""
    if lead := _LEAD.search(match["tex"]):  # a mark beside a text could be that of another formula
        line = match.string[match.string.rfind("\n", 0, match.start()) + 1 : match.start()]
        opening = lead[0] if _WORDS_BEFORE.match(line) else ""
        closing = lead[0] if match["behind"] is not None else ""
    braces = f" {{#eq:{formula_anchor(label)}}}" if label else ""
    return f"{opening}$${tex}$${braces}{closing}"


_FIGURE_NAME = re.compile(
    r"\{(?P<kind>figure|table|list-table)\}[^\n]*\n"
    r"(?:[ \t]*(?::(?!name|label)[\w-]+:|---|(?!name)\w+:)[^\n]*\n)*"
    r"[ \t]*:?(?:name|label):[ \t]*(?P<name>\S+)"
)


def find_anchors(text: str) -> set[str]:
    """Return the anchors that a text of any dialect sets, `eq:name` of formulas among them."""
    labelled = [*_FIGURE_NAME.finditer(text)]
    figures = {label_anchor(m["name"]) for m in labelled if m["kind"] == "figure"}
    figures |= {to_anchor(match["label"]) for match in _FIGURE.finditer(text)}
    cells = re.findall(r"^#\|[ \t]*label:[ \t]*fig-([\w-]+)", text, re.MULTILINE)
    figures |= {to_anchor(label) for label in cells}
    anchors = {to_anchor(match["name"]) for match in _TARGET.finditer(text)}
    anchors |= {f"sec-{to_anchor(name)}" for name in re.findall(r"\{#sec-([\w-]+)\}", text)}
    for match in _DISPLAY.finditer(normalize_formulas(text)):
        anchors |= set(re.findall(r"\{#(eq:[\w-]+)\}", _label_formula(match)))
    labels = re.findall(r"^\s*:(?:label|name):[ \t]*(\S+)", text, re.MULTILINE)
    anchors |= {to_anchor(label) for label in labels}
    anchors |= {f"eq:{formula_anchor(label)}" for label in labels}
    anchors |= {f"tab:{to_anchor(label)}" for label in re.findall(r"\{#tbl-([\w-]+)", text)}
    anchors |= {f"fig:{name}" for name in figures}
    anchors |= {f"tab:{label_anchor(m['name'])}" for m in labelled if m["kind"] != "figure"}
    return anchors - {to_anchor(match["name"]) for match in labelled}


def _rewrite_match(match: re.Match[str], context: LessonContext) -> str:
    whole = match[0]
    match match.lastgroup:
        case "role":
            return convert_role(match["name"], match["body"], context)
        case "image":
            alt = match["alt"]
            source = match["source"]
            if re.match("[a-z]+://|//", source):
                message = f"a picture from another host, `{source}`; it is a link now"
                context.leave("picture", message)
                text, end = match.string, match.end()
                is_in_link = text[: match.start()].endswith("[") and text.startswith("](", end)
                return (alt or source) if is_in_link else f"[{alt or source}]({source})"
            name, path = source.removeprefix("attachment:"), context.resolve_path(source)
            dressing = match["dressing"] or ""
            label = dressing if dressing.startswith("{#fig-") else ""
            if name in context.pictures:
                return f"![{alt}]({context.add_picture(name)}){label}"
            if path in context.files:
                return f"![{alt}]({context.add_file(path)}){label}"
            context.leave("picture", f"the picture `{source}`, which is not in the folder")
            return alt
        case "link":
            text, address = match["text"], context.resolve_link(match["address"])
            if not text and not re.match("#|lesson:|page:", address):  # its tool knows a title
                text = title_of_file(re.split("[:#]", match["address"])[-1])
            return write_link(_rewrite_line(text, context), address, match["title"] or "")
        case "anchor" | "icon":
            return ""
        case "object":
            called = match["called"]
            if (match["path"] or called).casefold() in context.references:
                return whole
            is_path = match["path"] is not None or re.fullmatch(
                r"`?[A-Za-z_]\w*(?:\.\w+)+`?", called
            )
            return _rewrite_line(called, context) if is_path else whole
        case "paren":
            return f"${match['inner'].strip()}$"
        case "note":
            context.notes.append(_rewrite_line(match["remark"], context))
            return f"[^note-{len(context.notes)}]"
        case "math":
            return (
                whole if _WORD.search(whole) else _TIGHT.sub(lambda m: f"${m[1].strip()}$", whole)
            )
        case "code":
            if match.string.lstrip().startswith("|") and context.path.endswith(".qmd"):
                whole = re.sub(r"(?<!\\)\|", r"\\|", whole)  # it ends a cell, but for Pandoc
            return convert_code(whole, context)
        case "digits":  # no digit may follow the closing dollar sign
            return f"${match['tex']}{match['number']}$"
        case "cross":
            kind = match["kind"]
            label = match["label"]
            if kind == "eq":
                return write_link("", context.resolve_anchor(f"eq:{formula_anchor(label)}"))
            if kind == "sec":
                return write_link("this section", context.resolve_anchor(f"sec-{to_anchor(label)}"))
            kind = kind.replace("tbl", "tab")
            if address := context.resolve_anchor(f"{kind}:{to_anchor(label)}"):
                return write_link("", address)
            message = f"the reference `{whole}` to what no text labels: write what is meant"
            context.leave("cross-reference", message)
            return {"fig": "the figure", "tab": "the table", "lst": "the listing"}[kind]
        case "cite":
            keys = _CITED_KEY.findall(whole)
            if keys and context.are_sources(keys):
                return re.sub(",(?=[ ]*@)", ";", whole.replace("-@", "@"))
            message = f"`{whole}`, a source that no BibTeX file of the folder has; it is code now"
            context.leave("citation", message)
            return f"`{whole}`"
        case "pair":
            return _rewrite_line(match["held"], context)
        case "substitution":
            if re.fullmatch(r"\{\{<\s*pagebreak\s*>\}\}", whole):
                return ""
            message = (
                f"`{whole}`, which its tool replaces; it is code now: write what it stands for"
            )
            context.leave("substitution", message)
            return f"`{whole}`"
        case "mention":
            lesson_id = context.ids.get(match["level"])
            return whole if lesson_id is None else f"Lesson {lesson_id}"
        case "keys":
            return "+".join(key.capitalize() for key in match["stroke"].split("+"))
        case "route":
            return context.resolve_link(whole) or whole
        case "tail":
            return f"]({context.resolve_link(match['rest']) or GONE}"
        case "definition":
            address = match["named"]
            return whole.removesuffix(address) + (context.resolve_link(address) or GONE)
        case "tag":
            return _convert_tag(whole, context)
        case "markdown":  # a tag whose text is Markdown, as it always is here
            return match["before"]
        case "attributes":
            line, before = match.string, match.string[: match.start()]
            is_heading, is_whole = line.startswith("#"), whole == line.rstrip()
            is_marked = whole.lstrip().startswith("{:")
            is_behind = whole[0] == "{" and re.search(r"[`\]*>:\"]$|\]\([^()]*\)$", before)
            if not (is_heading or is_whole or is_marked or is_behind):
                return whole  # an index in a formula, a set, an argument
            id = re.search(r"#([^\s{}\"'#]+)", whole)
            if id is None or not (":" in id[1] or is_heading):
                return ""
            return whole if ":" in id[1] else f" {{#{to_anchor(id[1])}}}"
        case "span":
            return _rewrite_line(match["words"], context)
        case _:
            return whole


def _convert_tag(tag: str, context: LessonContext) -> str:
    """Return a tag of HTML with the new address of the file of the folder that it names."""
    attribute = _ATTRIBUTE.search(tag)
    if attribute is None or re.match(r"[a-z][a-z+.-]*:|//|#", attribute[3]):
        return tag
    address, alt = attribute[3], re.search(r"\s(?i:alt)=[\"']([^\"']*)", tag)
    before, after = tag[: attribute.start(3)], tag[attribute.end(3) :]
    if new_address := context.resolve_file(address):
        return before + new_address + after
    context.leave("tag of HTML", f"the file `{address}`, which is not in the folder")
    if re.match("<img", tag, re.IGNORECASE):
        return alt[1] if alt else ""
    return tag[: attribute.start()].rstrip() + after[1:]


_CITED_KEY = re.compile(rf"(?<![\w@])@({_KEY})")
_TIGHT = re.compile(r"(?<!\$)\$(?=[ ]|[^$]*[ ]\$)([^$]*?)(?:\\[ ,;])*[ ]*\$(?!\$)")
"""A formula with blanks at its ends, which some tools allow."""
_WORD = re.compile(r"(?<![\\A-Za-z{])[A-Za-z]{2,}(?![A-Za-z]*\})")
"""What no formula holds outside of its commands, but a sentence between two prices does."""
