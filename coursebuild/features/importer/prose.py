r"""Lines of prose as coursebuild reads them: links, pictures, mentions, formulas, roles.

Entry points: `rewrite`, `displayed`, `labels`.

Code in a line is left alone, and so are blocks of it in quotations and lists, and what nothing here
knows.
"""

from __future__ import annotations

import re

from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.values import name_of

_LINE = re.compile(
    r"(?P<role>\{(?P<name>[a-z][\w:+.-]*)\}`(?P<body>[^`\n]+)`)"
    r"|(?P<code>(?P<ticks>`+)(?!`).+?(?<!`)(?P=ticks)(?!`))"
    r"|(?P<image>!\[(?P<alt>[^\]\n]*)\]\((?P<source>[^()\s]+)(?:[ \t]+\"[^\"\n]*\")?\)"
    r"(?:\{[^{}\n]*\})?)"
    r"|(?P<link>\[(?P<text>(?:[^\[\]\n`]|`[^`\n]+`)*)\]"
    r"\((?P<address>[^()\s]+)(?P<title>[ \t]+\"[^\"\n]*\")?\))"
    r"|(?P<digits>\$(?P<tex>[^$\s](?:[^$\n]*[^$\s\\])?)\$(?P<number>\d[\d.,]*\d|\d))"
    r"|(?P<math>\$\$?[^$\n]+\$\$?)"
    r"|(?P<paren>\\\((?P<inner>[^\n]+?)\\\))"
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
    r"(?P<tex>\\begin\{(?P<env>align|equation|gather|multline|alignat)(?P<star>\*?)\}.*?"
    r"\\end\{(?P=env)(?P=star)\})(?P<after>[ \t]*(?=\n|\Z))",
    re.DOTALL,
)
_BRACKETS = re.compile(r"^[ \t]*\\\[(?P<tex>.+?)\\\][ \t]*$", re.DOTALL | re.MULTILINE)
_TARGET = re.compile(
    r"^\((?P<name>[\w:.-]+)\)=[ \t]*(?:\n+(?P<heading>#{1,6}[ \t].*))?$", re.MULTILINE
)
_LABEL = re.compile(r"\\label\{([^{}]*)\}")
_FENCE = re.compile(r"[ \t>]*(?:(?:[-+*]|\d+[.)])[ \t]+)?(`{3,}|~{3,})")
"""That begins or ends a block of code in a quotation or a list."""
_PERCENT = re.compile(r"^%[^\n]*\n?", re.MULTILINE)


def rewrite(text: str, context: LessonContext, place: str) -> str:
    """Prose of any dialect."""
    text = formulas(_PERCENT.sub("", text))
    text = _TARGET.sub(_target, text)
    first = int(place.removeprefix("line ")) if place.startswith("line ") else 0
    out, mark = [], ""
    for number, line in enumerate(text.split("\n")):
        fence = _FENCE.match(line)
        if fence is None and not mark:
            line = _line(line, context, f"line {first + number}" if first else place)
        elif fence is not None and fence[1].startswith(mark):
            mark = "" if mark else fence[1]
        out.append(line)
    return "\n".join(out)


def _line(line: str, context: LessonContext, place: str) -> str:
    return _LINE.sub(lambda match: _rewritten(match, context, place), line)


def formulas(text: str) -> str:
    """Displayed formulas with labels as `{#eq:name}`; those of LaTeX in dollar signs."""
    text = _BRACKETS.sub(lambda m: f"$${m['tex']}$$", text)
    text = _ENVIRONMENT.sub(lambda m: f"{m['before']}$${m['tex']}$${m['after']}", text)
    return _DISPLAY.sub(_display, text)


def displayed(tex: str, label: str) -> str:
    """A displayed formula."""
    return f"$$\n{tex.strip()}\n$$" + (f" {{#eq:{label_of(label)}}}" if label else "")


def _target(match: re.Match[str]) -> str:
    anchor = anchor_of(match["name"])
    if match["heading"] is None:
        return f'<a id="{anchor}"></a>'
    return f"{match['heading'].rstrip()} {{#{anchor}}}"


def _display(match: re.Match[str]) -> str:
    inside = _LABEL.search(match["tex"])
    label = match["myst"] or match["quarto"] or (inside[1] if inside else "")
    tex = _LABEL.sub("", match["tex"])
    if not label:
        return f"$${tex}$$"
    return f"$${tex}$$ {{#eq:{label_of(label)}}}"


def label_of(label: str) -> str:
    """The name of a formula, without the `eq` that other tools put before it."""
    return anchor_of(re.sub(r"^eq[-:._]", "", label))


def anchor_of(name: str) -> str:
    """A name as an anchor."""
    return re.sub("[^A-Za-z0-9]+", "-", name).strip("-").lower() or "x"


def labels(text: str) -> set[str]:
    """The anchors that a text of any dialect sets itself, `eq:name` of formulas among them."""
    found = {anchor_of(match["name"]) for match in _TARGET.finditer(text)}
    found |= {f"sec-{anchor_of(name)}" for name in re.findall(r"\{#sec-([\w-]+)\}", text)}
    for match in _DISPLAY.finditer(formulas(text)):
        found |= set(re.findall(r"\{#(eq:[\w-]+)\}", _display(match)))
    directive = re.findall(r"^\s*:label:[ \t]*(\S+)", text, re.MULTILINE)
    return found | {f"eq:{label_of(label)}" for label in directive}


def _rewritten(match: re.Match[str], context: LessonContext, place: str) -> str:
    whole = match[0]
    match match.lastgroup:
        case "role":
            return _role(match["name"], match["body"], context, place)
        case "image":
            return _image(match["alt"], match["source"], context, place)
        case "link":
            text = _line(match["text"], context, place)
            return _linked(text, context.link(match["address"], place), match["title"] or "")
        case "paren":
            return f"${match['inner'].strip()}$"
        case "digits":  # no digit may follow the closing dollar sign
            return f"${match['tex']}{match['number']}$"
        case "cross":
            return _cross(match["kind"], match["label"], whole, context, place)
        case "cite" | "substitution":
            context.leave(place, f"`{whole}`, which is shown as code")
            return f"`{whole}`"
        case "mention":
            known = context.ids.get(match["level"])
            return whole if known is None else f"Lesson {known}"
        case "route":
            return context.link(whole, place) or whole
        case _:
            return whole


def _linked(text: str, address: str, title: str = "") -> str:
    return f"[{text}]({address}{title})" if address else text


def _role(name: str, body: str, context: LessonContext, place: str) -> str:
    named = re.fullmatch(r"(?P<words>.*\S)\s*<(?P<target>[^<>]+)>", body)
    words, target = (named["words"], named["target"]) if named else ("", body)
    match name:
        case "math":
            return f"${body}$"
        case "eq":
            return _linked(words, context.labelled(f"eq:{label_of(target)}"))
        case "doc":
            return _linked(words or name_of(target), context.link(f"{target}.md", place))
        case "ref" | "numref":
            return _linked(words or name_of(target), context.labelled(anchor_of(target)))
        case "download":
            return _linked(words or target, context.link(target, place))
        case "term" | "abbr" | "kbd" | "sub" | "sup":
            return body
        case "code" | "file" | "command" | "func" | "class" | "mod" | "py:func" | "py:class":
            return f"`{body}`"
        case _:
            context.leave(place, f"the role `{{{name}}}`; its text is shown as code")
            return f"`{body}`"


def _image(alt: str, source: str, context: LessonContext, place: str) -> str:
    if re.match("[a-z]+://|//", source):
        context.leave(place, f"a picture from another host, `{source}`; it is a link now")
        return f"[{alt or source}]({source})"
    if source.startswith("attachment:"):
        return f"![{alt}]({context.picture(source.removeprefix('attachment:'))})"
    path = context.resolve(source)
    if path not in context.files:
        context.leave(place, f"the picture `{source}`, which is not in the folder")
        return alt
    return f"![{alt}]({context.file(path)})"


def _cross(kind: str, label: str, whole: str, context: LessonContext, place: str) -> str:
    if kind == "eq":
        return _linked("", context.labelled(f"eq:{label_of(label)}"))
    if kind == "sec":
        return _linked("this section", context.labelled(f"sec-{anchor_of(label)}"))
    context.leave(place, f"the reference `{whole}`: figures and tables have no numbers")
    return {"fig": "the figure", "tbl": "the table", "lst": "the listing"}[kind]
