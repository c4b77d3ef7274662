r"""Convert lines of prose: links, pictures, mentions, formulas, roles.

Entry points: `rewrite_prose`, `display_formula`, `find_anchors`.

Code is left alone, in lines and in blocks within quotations and lists, and so is whatever else is
not recognized here.
"""

from __future__ import annotations

import re

from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.values import title_of_file

# A formula holds no beginning of another: so each character is looked at a few times, not once for
# each beginning before it.
_LINE = re.compile(
    r"(?P<role>\{(?P<name>[a-z][\w:+.-]*)\}`(?P<body>[^`\n]+)`)"
    r"|(?P<code>(?P<ticks>`+)(?!`).+?(?<!`)(?P=ticks)(?!`))"
    r"|(?P<image>!\[(?P<alt>[^\]\n]*)\]\((?P<source>[^()\s]+)(?:[ \t]+\"[^\"\n]*\")?\)"
    r"(?:\{[^{}\n]*\})?)"
    r"|(?P<link>\[(?P<text>(?:[^\[\]\n`]|`[^`\n]+`)*)\]"
    r"\((?P<address>[^()\s]+)(?P<title>[ \t]+\"[^\"\n]*\")?\))"
    r"|(?P<digits>\$(?P<tex>[^$\s](?:[^$\n]*[^$\s\\])?)\$(?P<number>\d[\d.,]*\d|\d))"
    r"|(?P<math>\$\$?[^$\n]+\$\$?)"
    r"|(?P<paren>\\\((?P<inner>(?:(?!\\[()])[^\n])++)\\\))"
    r"|(?P<cross>(?<![\w@.])\[?-?@(?P<kind>eq|sec|fig|tbl|lst)-(?P<label>[\w-]+)\]?)"
    r"|(?P<cite>\[-?@[\w:.-]+(?:[;,][^\[\]\n]*)?\])"
    r"|(?P<substitution>\{\{[^{}\n]*\}\})"
    r"|(?P<mention>\bLevel[ \u00a0](?P<level>\d+\.\d+)\b)"
    r"|(?P<route>(?<=[\"'(<])#/lessons?/[\w.-]+(?:#[\w-]+)?)"
)
_DISPLAY = re.compile(
    r"\$\$(?P<tex>(?:[^$\\]|\\.)+?)\$\$[ \t]*(?:\((?P<myst>[\w:.-]+)\)|\{#(?P<quarto>[\w:.-]+)\})?",
    re.DOTALL,
)
_ENVIRONMENT = re.compile(
    r"(?P<before>(?:\A|\n[ \t]*\n))[ \t]*"
    r"(?P<tex>\\begin\{(?P<env>align|equation|gather|multline|alignat)(?P<star>\*?)\}"
    r"(?:(?!\\(?:begin|end)\{(?P=env)(?P=star)\}).)*+"
    r"\\end\{(?P=env)(?P=star)\})(?P<after>[ \t]*(?=\n|\Z))",
    re.DOTALL,
)
_BRACKETS = re.compile(
    r"^[ \t]*\\\[(?P<tex>(?:(?!\\[\[\]]).)++)\\\][ \t]*$", re.DOTALL | re.MULTILINE
)
_TARGET = re.compile(
    r"^\((?P<name>[\w:.-]+)\)=[ \t]*(?:\n+(?P<heading>#{1,6}[ \t].*))?$", re.MULTILINE
)
_LABEL = re.compile(r"\\label\{([^{}]*)\}")
_FENCE = re.compile(r"[ \t>]*(?:(?:[-+*]|\d+[.)])[ \t]+)?(`{3,}|~{3,})")
"""The first or last line of a block of code in a quotation or a list."""
_COMMENT = re.compile(r"^%[^\n]*\n?", re.MULTILINE)


def rewrite_prose(text: str, context: LessonContext) -> str:
    """Return prose of any dialect as Markdown of coursebuild."""
    text = normalize_formulas(_COMMENT.sub("", text))
    text = _TARGET.sub(_write_target, text)
    out, mark = [], ""
    for number, line in enumerate(text.split("\n")):
        fence_line = _FENCE.match(line)
        if fence_line is None and not mark:
            line = _rewrite_line(line, context.line_below(number))
        elif fence_line is not None and fence_line[1].startswith(mark):
            mark = "" if mark else fence_line[1]
        out.append(line)
    return "\n".join(out)


def _rewrite_line(line: str, context: LessonContext) -> str:
    return _LINE.sub(lambda match: _rewrite_match(match, context), line)


def normalize_formulas(text: str) -> str:
    """Put LaTeX formulas between dollar signs, and write labels as `{#eq:name}`."""
    text = _BRACKETS.sub(lambda m: f"$${m['tex']}$$", text)
    text = _ENVIRONMENT.sub(lambda m: f"{m['before']}$${m['tex']}$${m['after']}", text)
    return _DISPLAY.sub(_label_formula, text)


def display_formula(tex: str, label: str) -> str:
    """Return a displayed formula in Markdown."""
    return f"$$\n{tex.strip()}\n$$" + (f" {{#eq:{formula_anchor(label)}}}" if label else "")


def _write_target(match: re.Match[str]) -> str:
    anchor = to_anchor(match["name"])
    if match["heading"] is None:
        return f'<a id="{anchor}"></a>'
    return f"{match['heading'].rstrip()} {{#{anchor}}}"


def _label_formula(match: re.Match[str]) -> str:
    inside = _LABEL.search(match["tex"])
    label = match["myst"] or match["quarto"] or (inside[1] if inside else "")
    tex = _LABEL.sub("", match["tex"])
    if not label:
        return f"$${tex}$$"
    return f"$${tex}$$ {{#eq:{formula_anchor(label)}}}"


def formula_anchor(label: str) -> str:
    """Return the anchor of a formula, without the `eq` that other tools put before its name."""
    return to_anchor(re.sub(r"^eq[-:._]", "", label))


def to_anchor(name: str) -> str:
    """Turn a name into an anchor."""
    return re.sub("[^A-Za-z0-9]+", "-", name).strip("-").lower() or "x"


def find_anchors(text: str) -> set[str]:
    """Return the anchors that a text of any dialect sets, `eq:name` of formulas among them."""
    anchors = {to_anchor(match["name"]) for match in _TARGET.finditer(text)}
    anchors |= {f"sec-{to_anchor(name)}" for name in re.findall(r"\{#sec-([\w-]+)\}", text)}
    for match in _DISPLAY.finditer(normalize_formulas(text)):
        anchors |= set(re.findall(r"\{#(eq:[\w-]+)\}", _label_formula(match)))
    labels = re.findall(r"^\s*:label:[ \t]*(\S+)", text, re.MULTILINE)
    return anchors | {f"eq:{formula_anchor(label)}" for label in labels}


def _rewrite_match(match: re.Match[str], context: LessonContext) -> str:
    whole = match[0]
    match match.lastgroup:
        case "role":
            return _convert_role(match["name"], match["body"], context)
        case "image":
            alt = match["alt"]
            source = match["source"]
            if re.match("[a-z]+://|//", source):
                context.add_leftover(f"a picture from another host, `{source}`; it is a link now")
                return f"[{alt or source}]({source})"
            name, path = source.removeprefix("attachment:"), context.resolve_path(source)
            if name in context.pictures:
                return f"![{alt}]({context.add_picture(name)})"
            if path in context.files:
                return f"![{alt}]({context.add_file(path)})"
            context.add_leftover(f"the picture `{source}`, which is not in the folder")
            return alt
        case "link":
            text = _rewrite_line(match["text"], context)
            return _write_link(text, context.resolve_link(match["address"]), match["title"] or "")
        case "paren":
            return f"${match['inner'].strip()}$"
        case "digits":  # no digit may follow the closing dollar sign
            return f"${match['tex']}{match['number']}$"
        case "cross":
            kind = match["kind"]
            label = match["label"]
            if kind == "eq":
                return _write_link("", context.resolve_anchor(f"eq:{formula_anchor(label)}"))
            if kind == "sec":
                return _write_link(
                    "this section", context.resolve_anchor(f"sec-{to_anchor(label)}")
                )
            context.add_leftover(f"the reference `{whole}`: figures and tables have no numbers")
            return {"fig": "the figure", "tbl": "the table", "lst": "the listing"}[kind]
        case "cite" | "substitution":
            context.add_leftover(f"`{whole}`, which is shown as code")
            return f"`{whole}`"
        case "mention":
            lesson_id = context.ids.get(match["level"])
            return whole if lesson_id is None else f"Lesson {lesson_id}"
        case "route":
            return context.resolve_link(whole) or whole
        case _:
            return whole


def _write_link(text: str, address: str, title: str = "") -> str:
    return f"[{text}]({address}{title})" if address else text


def _convert_role(name: str, body: str, context: LessonContext) -> str:
    parts = re.fullmatch(r"(?P<words>.*\S)\s*<(?P<target>[^<>]+)>", body)
    words, target = (parts["words"], parts["target"]) if parts else ("", body)
    match name:
        case "math":
            return f"${body}$"
        case "eq":
            return _write_link(words, context.resolve_anchor(f"eq:{formula_anchor(target)}"))
        case "doc":
            return _write_link(words or title_of_file(target), context.resolve_link(f"{target}.md"))
        case "ref" | "numref":
            return _write_link(
                words or title_of_file(target), context.resolve_anchor(to_anchor(target))
            )
        case "download":
            return _write_link(words or target, context.resolve_link(target))
        case "term" | "abbr" | "kbd" | "sub" | "sup":
            return body
        case "code" | "file" | "command" | "func" | "class" | "mod" | "py:func" | "py:class":
            return f"`{body}`"
        case _:
            context.add_leftover(f"the role `{{{name}}}`; its text is shown as code")
            return f"`{body}`"
