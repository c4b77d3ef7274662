"""Convert lines of prose: links, pictures, mentions, formulas, roles.

Code is left alone, in lines and in blocks within quotations and lists, and so is whatever else is
not recognized here.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from urllib.parse import unquote, urlsplit

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.features.importer.source_files import (
    TEXTS,
    Leftover,
    SourceFiles,
    stem_of,
    title_of_file,
)


class LessonContext(Struct, frozen=True, kw_only=True):
    """Resolves what a lesson names while it is converted, and collects files and leftovers.

    Lessons of a course, and places in a lesson, have contexts that collect together.
    """

    targets: Mapping[str, str]
    """New addresses of lessons and pages, by the path of the old file without extension."""
    ids: Mapping[str, str]
    """New ids of lessons, by the old ones."""
    labels: Mapping[str, str]
    """The address of the lesson or page that sets an anchor, by the anchor."""
    files: SourceFiles
    camera_is_position: bool
    path: str = ""
    """The lesson's file, relative to the folder that is imported."""
    pictures: Mapping[str, bytes] = {}
    """Pictures that this file contains, by name."""
    folder: str = ""
    """The folder of the new file, such as `content/lessons`."""
    place: str = ""
    """The place in the lesson that is converted, as `line 12` or `cell 3`."""
    is_mdx: bool = False
    """Whether tags of the lesson may be components of JavaScript."""
    depth: int = 0
    """How many blocks are around the place."""
    leftovers: list[Leftover] = field(default_factory=list)
    copies: dict[str, bytes] = field(default_factory=dict)
    """The files and pictures that the lesson uses, by their new paths."""
    notebook_outputs: dict[str, str] = field(default_factory=dict)
    """The notebooks whose recorded outputs are kept, by the paths of their scripts."""
    callouts: dict[str, str] = field(default_factory=dict)
    """Labels of kinds of callouts that coursebuild does not have, by kind."""

    def at(self, place: str) -> LessonContext:
        """Return the context of a place in the lesson."""
        return replace(self, place=place)

    def line_below(self, lines: int) -> LessonContext:
        """Return the context of so many lines further down; a cell is a single place."""
        kind, _, number = self.place.partition(" ")
        return self.at(f"line {int(number) + lines}") if kind == "line" else self

    def add_leftover(self, message: str) -> None:
        """Note that something has no counterpart."""
        self.leftovers.append(Leftover(self.path, self.place, message))

    def resolve_link(self, address: str) -> str:
        """Return the new address of a link; empty where nothing in the course has it."""
        route = re.fullmatch(r"#?/lessons?/([^#?/]+)/?(#.*)?", address)
        if route is not None:
            id = self.ids.get(unquote(route[1]))
            if id is None:
                self.add_leftover(f"a link to `{address}`, a lesson that the map does not have")
            return "" if id is None else f"lesson:{id}{route[2] or ''}"
        parts = urlsplit(address)
        if parts.scheme or parts.netloc or not parts.path:
            return address
        path = self.resolve_path(parts.path)
        anchor = f"#{parts.fragment}" if parts.fragment else ""
        target = self.targets.get(stem_of(path)) or self.targets.get(path)
        if target is not None:
            return target + anchor
        if path in self.files:
            return self.add_file(path)
        if resolved := self.resolve_anchor(to_anchor(address)):
            return resolved
        self.add_leftover(f"a link to `{address}`, which is not in the folder")
        return ""

    def resolve_file(self, address: str) -> str:
        """Return the new address of a file that HTML names; empty where the folder lacks it."""
        path = self.resolve_path(urlsplit(address).path)
        if path.endswith(TEXTS) or stem_of(path) in self.targets or path not in self.files:
            return ""
        return self.add_file(path)

    def resolve_anchor(self, anchor: str) -> str:
        """Return the address of an anchor; empty where no text of the course sets it."""
        target = self.labels.get(anchor)
        if target is None:
            return ""
        is_here = target == self.targets.get(stem_of(self.path))
        return f"#{anchor}" if is_here else f"{target}#{anchor}"

    def resolve_path(self, path: str) -> str:
        """Return a path that the lesson names, relative to the folder that is imported."""
        path = unquote(path)
        resolved = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), path))
        if path.startswith("/"):
            resolved = posixpath.normpath(path.lstrip("/"))
        if file := self.files.find(resolved):
            return file
        if stem_of(resolved) in self.targets:
            return resolved
        return next((f for f in self.files if f.endswith("/" + path.lstrip("./"))), resolved)

    def add_picture(self, name: str) -> str:
        """Copy a picture that the lesson's file contains, and return its new address."""
        file = re.sub(r"[^\w.+-]", "-", name)  # it is a name, whatever path it looks like
        return self._add_copy(f"{stem_of(self.path)}/{file}", self.pictures[name])

    def add_file(self, path: str) -> str:
        """Copy a file of the folder, and return its new address."""
        return self._add_copy(path, self.files.read(path))

    def _add_copy(self, name: str, data: bytes) -> str:
        path = f"content/files/{name}"
        self.copies[path] = data
        return posixpath.relpath(path, self.folder).replace(" ", "%20")


_ATTRIBUTES = (
    r"\{(?:[ ]*(?:#[\w:.-]+|\.[A-Za-z][\w:-]*"
    r"|[\w:-]+=(?:\"[^\"\n]*\"|'[^'\n]*'|[^\s{}\"']+)|-))+[ ]*\}"
    r"|\{:[^{}\n]*\}"
)
_ATTRIBUTES = rf"(?:{_ATTRIBUTES})"
"""Attributes of Pandoc or of Python's Markdown, which follow what they belong to."""
# A formula holds no beginning of another: so each character is looked at a few times, not once for
# each beginning before it.
_LINE = re.compile(
    r"(?P<role>\{(?P<name>[a-z][\w:+.-]*)\}`(?P<body>[^`\n]+)`)"
    r"|(?P<code>(?P<ticks>`+)(?!`).+?(?<!`)(?P=ticks)(?!`))"
    r"|(?P<image>!\[(?P<alt>[^\]\n]*)\]\((?P<source>[^()\s]+)(?:[ \t]+\"[^\"\n]*\")?\)"
    r"(?:\{[^{}\n]*\})?)"
    r"|(?P<link>\[(?P<text>(?:[^\[\]\n`]|`[^`\n]+`)*)\]"
    r"\((?P<address>(?:[^()\s]|\([^()\s]*\))+)(?P<title>[ \t]+\"[^\"\n]*\")?\))"
    r"|(?P<digits>\$(?P<tex>[^$\s](?:[^$\n]*[^$\s\\])?)\$(?P<number>\d[\d.,]*\d|\d))"
    r"|(?P<math>\$\$?[^$\n]+\$\$?)"
    r"|(?P<paren>\\\((?P<inner>(?>(?:(?!\\[()])[^\n])+))\\\))"
    r"|(?P<cross>(?<![\w@.])\[?-?@(?P<kind>eq|sec|fig|tbl|lst)-(?P<label>[\w-]+)\]?)"
    r"|(?P<cite>\[(?:[^\[\]\n`@]*[\s(])?-?@\w[\w:./-]*(?:[;,\s][^\[\]\n]*)?\])"
    r"|(?P<substitution>\{\{[^{}\n]*\}\})"
    r"|(?P<mention>\bLevel[ \u00a0](?P<level>\d+\.\d+)\b)"
    r"|(?P<route>(?<=[\"'(<])#/lessons?/[\w.-]+(?:#[\w-]+)?)"
    r"|(?P<tail>\]\((?P<rest>[^()\s]+)(?=\)))"  # of a link whose text began a line above
    r"|(?P<definition>^[ ]{0,3}\[(?!\^)[^\[\]\n]+\]:[ \t]*(?P<named>[^\s<]+)(?=[ \t]*(?:$|[\"'(])))"
    r"|(?P<tag><(?i:a|img|source|video)[ \t][^<>\n]*>(?:</(?i:img|source)>)?)"
    r"|(?P<markdown>(?P<before><[a-z]\w*(?:[ ][^<>\n]*?)?)[ ]markdown(?:=[\"'\w]+)?(?=[ >]))"
    rf"|(?P<attributes>(?:(?<=[^\s$])|^(?::[ ])?)(?:[ ]+#+)?[ ]?{_ATTRIBUTES})"
    rf"|(?P<span>\[(?P<words>[^\[\]\n`]*)\]{_ATTRIBUTES})"
)
_ATTRIBUTE = re.compile(r"(?<=[ \t])(href|src|srcset)(=[\"'])([^\"'\n]+)", re.IGNORECASE)
_DISPLAY = re.compile(
    r"\$\$(?P<tex>(?:[^$\\]|\\.)+?)\$\$[ \t]*(?:\((?P<myst>[\w:.-]+)\)|\{#(?P<quarto>[\w:.-]+)\})?",
    re.DOTALL,
)
_ENVIRONMENT = re.compile(
    r"(?P<before>(?:\A|\n[ \t]*\n))[ \t]*"
    r"(?P<tex>\\begin\{(?P<env>align|aligned|alignat|eqnarray|equation|flalign|gather|multline|split)(?P<star>\*?)\}"
    r"(?>(?:(?!\\(?:begin|end)\{(?P=env)(?P=star)\}).)*)"
    r"\\end\{(?P=env)(?P=star)\})(?P<after>[ \t]*(?=\n|\Z))",
    re.DOTALL,
)
_BRACKETS = re.compile(
    r"^[ \t]*\\\[(?P<tex>(?>(?:(?!\\[\[\]]).)+))\\\][ \t]*$", re.DOTALL | re.MULTILINE
)
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
_LABEL = re.compile(r"\\label\{([^{}]*)\}")
_WHOLE_ENVIRONMENT = re.compile(r"\\begin\{(\w+\*?)\}.*?\\end\{\1\}", re.DOTALL)
_FENCE = re.compile(r"[ \t>]*(?:(?:[-+*]|\d+[.)])[ \t]+)?(`{3,}|~{3,})")
"""The first or last line of a block of code in a quotation or a list."""
_COMMENT = re.compile(r"^(?:%[^\n]*|\+\+\+(?:[ \t]+[{\[][^\n]*)?[ \t]*$)\n?", re.MULTILINE)
"""A comment of MyST, or its break between two cells."""
_ACTIVE = re.compile(
    r"^[ ]{0,3}<(?P<name>style|script)\b.*?</(?P=name)>[ \t]*\n?", re.DOTALL | re.M | re.I
)
"""What changes how a page looks or what it does."""
_CONTENTS = re.compile(r'<div class="toc">.*?</div>', re.DOTALL)
"""What an extension of Jupyter writes into the first cell; the page has its own."""


def rewrite_prose(text: str, context: LessonContext) -> str:
    """Return prose of any dialect as Markdown of coursebuild."""

    def write_target(match: re.Match[str]) -> str:
        anchor = to_anchor(match["name"])
        if match["heading"] is None:
            return f'<a id="{anchor}"></a>'
        return f"{match['heading'].rstrip()} {{#{anchor}}}"

    for active in _ACTIVE.finditer(text):
        context.add_leftover(f"`<{active['name'].lower()}>`, which a page cannot have")
    text = normalize_formulas(_COMMENT.sub("", _CONTENTS.sub("", _ACTIVE.sub("", text))))
    text = _CAPTION.sub(_move_caption, _TARGET.sub(write_target, text))
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
    labels = re.findall(r"^\s*:(?:label|name):[ \t]*(\S+)", text, re.MULTILINE)
    anchors |= {to_anchor(label) for label in labels}
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
                text, end = match.string, match.end()
                is_in_link = text[: match.start()].endswith("[") and text.startswith("](", end)
                return (alt or source) if is_in_link else f"[{alt or source}]({source})"
            name, path = source.removeprefix("attachment:"), context.resolve_path(source)
            if name in context.pictures:
                return f"![{alt}]({context.add_picture(name)})"
            if path in context.files:
                return f"![{alt}]({context.add_file(path)})"
            context.add_leftover(f"the picture `{source}`, which is not in the folder")
            return alt
        case "link":
            text, address = match["text"], context.resolve_link(match["address"])
            if not text and not re.match("#|lesson:|page:", address):  # its tool knows a title
                text = title_of_file(re.split("[:#]", match["address"])[-1])
            return _write_link(_rewrite_line(text, context), address, match["title"] or "")
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
        case "tail":
            return f"]({context.resolve_link(match['rest']) or GONE}"
        case "definition":
            address = match["named"]
            return whole.removesuffix(address) + (context.resolve_link(address) or GONE)
        case "tag":
            is_in_link = match.string.rfind("<a ", 0, match.start()) > match.string.rfind(
                "</a", 0, match.start()
            )
            return _convert_tag(whole, is_in_link, context)
        case "markdown":  # a tag whose text is Markdown, as it always is here
            return match["before"]
        case "attributes":
            line, before = match.string, match.string[: match.start()]
            is_heading, is_whole = line.startswith("#"), whole == line.rstrip()
            is_marked = whole.lstrip().startswith("{:")
            is_behind = whole[0] == "{" and re.search(r"[`\]*>:\"]$|\]\([^()]*\)$", before)
            if not (is_heading or is_whole or is_marked or is_behind):
                return whole  # an index in a formula, a set, an argument
            id = re.search(r"#([\w:.-]+)", whole)
            if id is None or not (":" in id[1] or is_heading):
                return ""
            return whole if ":" in id[1] else f" {{#{to_anchor(id[1])}}}"
        case "span":
            return _rewrite_line(match["words"], context)
        case _:
            return whole


def _convert_tag(tag: str, is_in_link: bool, context: LessonContext) -> str:
    """Return a tag of HTML with the new address of the file that it names."""
    attribute, name = _ATTRIBUTE.search(tag), tag[1:].split()[0].lower()
    if attribute is None:
        return tag
    address, alt = attribute[3], re.search(r"\s(?i:alt)=[\"']([^\"']*)", tag)
    words = alt[1] if alt else ""
    if re.match(r"[a-z][a-z+.-]*:|//|#", address):
        if name not in ("img", "source") or not re.match("https?://|//", address):
            return tag
        context.add_leftover(f"a picture from another host, `{address}`; it is a link now")
        words = words or posixpath.basename(urlsplit(address).path)
        link = words if is_in_link else f'<a href="{address}">{words}</a>'
        return link if name == "img" else ""
    before, after = tag[: attribute.start(3)], tag[attribute.end(3) :]
    if new_address := context.resolve_file(address):
        return before + new_address + after
    context.add_leftover(f"the file `{address}`, which is not in the folder")
    if name == "img":
        return words
    return tag[: attribute.start()].rstrip() + after[1:]


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
        case "term":
            return words or target
        case "abbr" | "kbd" | "sub" | "sup":
            return body
        case "code" | "file" | "command" | "func" | "class" | "mod" | "py:func" | "py:class":
            return f"`{words or target}`"
        case _:
            context.add_leftover(f"the role `{{{name}}}`; its text is shown as code")
            return f"`{body}`"
