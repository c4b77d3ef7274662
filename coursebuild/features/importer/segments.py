"""A file as segments: prose, cells of code, fences and directives of MyST, Quarto or MkDocs."""

from __future__ import annotations

import base64
import contextlib
import json
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.rules_block import StateBlock
from mdit_py_plugins.footnote import footnote_plugin
from msgspec.structs import replace

from coursebuild.api import UsageError, regex
from coursebuild.core.registry import missing_package
from coursebuild.features.importer.displays import read_macros
from coursebuild.features.importer.jsx import COMPONENT, dedent_components, is_mdx
from coursebuild.features.importer.rst import read_rst
from coursebuild.features.importer.source_files import ImportedText, Segment, read_toml, read_yaml

_MARK = regex(r"(:{3,}|/{3,})[ \t]*(.*?)[ \t]*")
_TITLED = regex(
    r"(?:===[!+]?[ \t]+([\"'])(?P<tab>.*)\1"
    r"|(?P<mark>!!!|\?{3}\+?|:::(?=[ \t]+[A-Za-z_]\w*(?:\.\w+)+[ \t]*\Z))"
    r"[ \t]*(?P<head>[\w\"].*?))[ \t]*"
)
"""A tab, an admonition, or what `mkdocstrings` makes of the code of an object."""
_CELL = regex(r"\{code-cell\}(?:[ \t]+i?python3?\b.*)?|\{(?:python|ipython3?)[^}]*\}")
_FRONT_MATTER = regex(
    r"(?:[ \t]*\n)*---[ \t]*\n(?P<yaml>.*?\n)?(?:---|\.\.\.)[ \t]*(?:\n|\Z)"
    r"|\+\+\+[ \t]*\n(?P<toml>.*?\n)?\+\+\+[ \t]*(?:\n|\Z)",
    re.DOTALL,
)
_PLAIN_FIELDS = regex(r"(?:[\w-]+:.*\n|[ \t]+.*\n|-[ ].*\n|\n)*")
"""Front matter that other tools read line by line: a value may hold a colon."""
_TITLE = regex(
    r"^[ ]?#[ \t]+(?P<text>.*?)(?:[ \t]+#+)?"
    r"(?:[ \t]*\{(?:[^{}]*#(?P<label>[\w-]+))?[^{}]*\})?[ \t]*$"
    r"|(?:\A(?:[ \t]*\n)*|(?<=\n\n)|(?<=\)=\n)|(?<===\n))(?:(?P<line>[^\s#>].*)\n=+|"
    r"(?P<lines>[^\s#>$][^$\n]*(?>(?:\n(?!=+[ \t]*$)[^\s#>$][^$\n]*)+))\n==+)[ \t]*$",
    re.MULTILINE,
)
"""A heading of level 1, of both forms. A formula over lines may hold one `=` on a line."""
_HEADING = regex(rf"{_TITLE.pattern}|^(?P<lower>\#{{2,5}})(?=[ \t])", re.MULTILINE)


_SUMMARIES = ("description", "abstract", "subtitle")
"""Keys of front matter whose text becomes a lesson's summary; the first that there is."""
_NEEDLESS = (
    "title",
    "jupyter",
    "jupytext",
    "kernelspec",
    "language_info",
    "sidebar_position",
    "myst",
    "substitutions",
    "label",
    "colab",
    "header-includes",
    "math",
)
"""Further keys of which nothing is lost."""


RST = frozenset(("text/restructuredtext", "text/x-rst"))


def read_segments(
    source: str, text: ImportedText, raw_formats: Set[str]
) -> tuple[ImportedText, Mapping[str, Any]]:
    """Return a lesson with what its file holds, and what of its metadata has no counterpart.

    The map may have given it a title; it has its own now, if it states one. Cells of a notebook
    that are raw hold reStructuredText where they have one of these formats.

    Raises:
        UsageError: it is no notebook, but is called so.
    """
    metadata: Mapping[str, Any] = {}
    if text.file.endswith(".ipynb"):
        try:
            notebook = json.loads(source)
            metadata = notebook.get("metadata") or {}
            kernel, info = (metadata.get(key) or {} for key in ("kernelspec", "language_info"))
            language = str(kernel.get("language") or info.get("name") or "python").lower()
            cells = list(notebook["cells"])
            first = join_lines(cells[0].get("source", "")) if cells else ""
            front, size = read_front_matter(f"{first}\n")  # of MyST, Quarto, in a cell of its own
            if size:
                metadata = {**metadata, **front}
                cells[0] = {**cells[0], "source": first[size:]}
            segments = _read_cells(cells, language, raw_formats)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            raise UsageError(f"{text.file} is not a notebook of format 4") from None
    else:
        metadata, size = read_front_matter(source)
        content, line = source[size:], 1 + source.count("\n", 0, size)
        segments = list(read_markdown(content, line))
        if is_mdx(text.file, segments):
            segments = list(read_markdown(dedent_components(content), line))
    segments = _raise_title(segments, text.title)
    # The first heading of level 1, and the segments without it; from the next on, all go down by 1
    titles: list[str] = []
    own_title = " ".join(str(metadata.get("title") or "").split())

    def shift_heading(heading: re.Match[str]) -> str:
        if heading["lower"]:  # what stands below a second title stays below it
            return heading["lower"] + "#" * (len(titles) > 1)
        titles.append(_text_of(heading))
        words = re.sub(r"\[([^\[\]]*)\]\([^()]*\)|[*_`]", r"\1", titles[0])
        if len(titles) == 1 and own_title in ("", titles[0], words):
            return f"({heading['label']})=\n" if heading["label"] else ""
        return f"## {_text_of(heading)}" if heading["text"] is None else f"#{heading[0].strip()}"

    shifted = (*change_prose(segments, lambda prose: _HEADING.sub(shift_heading, prose)),)
    myst = metadata.get("myst")
    inner = (myst if isinstance(myst, dict) else metadata).get("substitutions")
    words = {**metadata, **(inner if isinstance(inner, dict) else {})}
    values = {str(key): str(v) for key, v in words.items() if isinstance(v, str | int | float)}
    summaries = [key for key in _SUMMARIES if isinstance(metadata.get(key), str)][:1]
    own_text = replace(
        text,
        title=str(metadata.get("title") or (titles or [""])[0]).strip(),
        summary=" ".join("".join(str(metadata[key]) for key in summaries).split()),
        segments=shifted,
        substitutions=values,
        macros=read_macros(metadata),
    )
    known_keys = (*_NEEDLESS, *summaries)
    return own_text, {str(k): v for k, v in metadata.items() if v and k not in known_keys}


def _raise_title(segments: list[Segment], title: str) -> list[Segment]:
    """Bring headings up where the title of the map begins the text as one of a lower level."""
    start = segments[0].text if segments and segments[0].kind == "prose" else ""
    first = re.match(rf"{_MARKS}#(#+)[ \t]+(.*?)[ \t#]*(?:\n|\Z)", start)
    if first is None or first[2].casefold() != title.casefold():
        return segments
    surplus = re.compile(rf"^{first[1]}(?=\#)", re.MULTILINE)
    return [*change_prose(segments, lambda prose: surplus.sub("", prose))]


_MARKS = r"\s*(?:(?:<!--(?:(?!-->)[\s\S])*-->|<a id=[^<>]*></a>)\s*)*"
"""Comments and anchors, which no reader sees."""


def change_prose(segments: Iterable[Segment], change: Callable[[str], str]) -> Iterator[Segment]:
    """Yield segments, of which those of prose are changed."""
    for segment in segments:
        is_prose = segment.kind == "prose"
        yield replace(segment, text=change(segment.text)) if is_prose else segment


_GATES = regex(
    r"^(?P<mark>`{3,}|~{3,}|:{3,})\{(?P<name>exercise|solution)-start\}"
    r"(?P<head>[^\n]*\n(?:[ \t]*:[^\n]*\n)*)"
    r"(?P=mark)[ \t]*\n(?P<body>.*?)^(?P=mark)\{(?P=name)-end\}[ \t]*\n(?P=mark)[ \t]*$",
    re.MULTILINE | re.DOTALL,
)
"""An exercise or a solution of MyST between a block that begins it and one that ends it."""


_HINT = regex(
    r"^\{% hint style=\"(\w+)\" %\}[ \t]*\n(.*?)\n?^\{% endhint %\}[ \t]*$",
    re.MULTILINE | re.DOTALL,
)
"""A callout of GitBook."""
_ALERT = regex(
    r"^(?P<fence>`{3,}|~{3,})[^\n]*\n.*?^(?P=fence)|^<(?:div\b[^<>]*\bclass=[\"'][^\"'<>]*\balert-"
    r"(?!block\b)(?P<kind>\w+)[^<>]*|(?P<name>note|tip|info|important|warning|caution|danger)\b"
    r"(?:[ \t]+type=[\"'](?P<type>\w+)[\"'])?[ \t]*)>"
    r"(?P<text>(?:^(?P<inner>`{3,}|~{3,}).*?^(?P=inner)|(?!<div\b|<(?P=name)\b|^[`~]{3}).)*?)"
    r"</(?(name)(?P=name)|div)>[ \t]*$",
    re.MULTILINE | re.DOTALL | re.IGNORECASE,
)
"""A callout of Jupyter, as its style sheet has it, or a component; or code, in which is none."""
_HIGHLIGHT = regex(
    r"^\{[%{][<%-]?[ ]*(?:(highlight)[ ]+|(\w+)[ ]+lang=\"?)(\w+)[^\n]*\n(.*?)\n"
    r"\{[%{][<%-]?[ ]*(?:end|/)(?:\1|\2)\b[^\n]*$",
    re.MULTILINE | re.DOTALL,
)
"""A block of code of Jekyll or Hugo, whose own shortcodes say so by `lang`."""


def _write_alert(alert: re.Match[str]) -> str:
    if alert["fence"]:
        return alert[0]
    kind = (alert["kind"] or alert["type"] or alert["name"]).lower()
    kinds = ("tip", "success", "important", "warning", "caution", "danger")
    kind = kind if kind in kinds else "note"
    return f"::::::{kind}\n{textwrap.dedent(alert['text']).strip()}\n::::::"


def _join_gates(gates: re.Match[str]) -> str:
    mark = "`" * 12
    return f"{mark}{{{gates['name']}}}{gates['head']}\n{gates['body']}\n{mark}"


def lower_titles(text: str) -> str:
    """Return prose within another block with its headings of level 1 on level 2."""
    return _TITLE.sub(lambda heading: f"## {_text_of(heading)}", text)


def _text_of(title: re.Match[str]) -> str:
    return " ".join((title["line"] or title["lines"] or title["text"] or "").split())


def read_front_matter(text: str) -> tuple[Mapping[str, Any], int]:
    """Return the front matter that begins a text, and its length; 0 where it has none."""
    match = _FRONT_MATTER.match(text)
    if match is None:
        return {}, 0
    is_yaml = match["toml"] is None
    value = read_yaml(match["yaml"] or "{}") if is_yaml else read_toml(match["toml"])
    if value is None and is_yaml and _PLAIN_FIELDS.fullmatch(match["yaml"]):
        value = dict(re.findall(r"^([\w-]+):[ \t]*(\S.*)$", match["yaml"], re.MULTILINE))
    return (value, match.end()) if isinstance(value, dict) else ({}, 0)


def read_markdown(text: str, first_line: int = 1, place: str = "") -> Iterator[Segment]:
    """Yield the segments of a text; `place` replaces their lines, in a cell or a nested block.

    Plain blocks in quotations and lists remain part of the prose. Around others, a quotation is a
    block.
    """
    text = _HINT.sub(r"::::::\1\n\2\n::::::", _GATES.sub(_join_gates, text))
    text = _HIGHLIGHT.sub(r"```\3\n\4\n```", _ALERT.sub(_write_alert, text))
    lines = text.split("\n")
    at = 0
    for (start, end), mark, head, content in (*_find_blocks(text), ([len(lines)] * 2, "", "", "")):
        if start < at:  # within the block before
            continue
        if any(line.strip() for line in lines[at:start]):
            prose = "\n".join(lines[at:start])
            yield Segment(kind="prose", place=place or f"line {first_line + at}", text=prose)
        at = end
        if mark:
            if mark[0] in "!?=":
                content = textwrap.dedent("\n".join(lines[start + 1 : end])).strip("\n")
            lead = _LEAD.match(lines[start])
            indent = lead[0] if lead is not None else ""
            is_cell = _CELL.fullmatch(head) and mark[0] != ":" and not indent
            yield Segment(
                kind="cell" if is_cell else "block",
                place=place or f"line {first_line + start}",
                text=content.removesuffix("\n"),
                head=head,
                mark=mark,
                indent=indent,
            )


def _find_blocks(text: str) -> Iterator[tuple[list[int], str, str, str]]:
    """Yield lines, mark, head and content of blocks; inside others, if they are not plain code."""
    lines, quotation = text.split("\n"), None
    for token in _PARSER.parse(text):
        if token.type == "blockquote_open" and token.level == 0:
            quotation = token.map
        elif token.type == "blockquote_close" and token.level == 0:
            quotation = None
        if token.map is None or token.type not in _BLOCKS:
            continue
        head = token.info.strip()
        is_plain = token.type == "fence" and head[:1] != "{" and " " not in head
        is_plain &= not missing_package(head)
        if quotation is not None:
            if not is_plain:
                texts = (_QUOTE.sub("", line) for line in lines[slice(*quotation)])
                yield quotation, ">", "", "\n".join(texts)
        elif token.level == 0 or (
            not is_plain and _LEAD.sub("", lines[token.map[0]]).startswith(token.markup)
        ):
            yield token.map, token.markup, head, token.content


def _parse_marked(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """Parse lines between colons: a directive of MyST, a division of Quarto; or between slashes.

    Colons nest by themselves; slashes, which extensions of MkDocs have, by their number.
    """

    def match_mark(number: int) -> re.Match[str] | None:
        return _MARK.fullmatch(_line_at(state, number))

    opening = match_mark(start)
    if opening is None or not re.match(r"." if opening[1][0] == ":" else r"[A-Za-z]", opening[2]):
        return False
    depth, last, fence = 1, start, ""
    while depth and last + 1 < end:
        last += 1
        line = _line_at(state, last)
        if edge := re.match("`{3,}(?=[^`]*$)|~{3,}", line):  # marks within code are its text
            fence = edge[0] if not fence else fence * (not line.startswith(fence))
        if fence:
            continue
        mark = match_mark(last)
        if mark is not None and mark[1][0] == opening[1][0] == ":":
            depth += 1 if mark[2] else -1
        elif mark is not None and mark[1] == opening[1] and not mark[2]:
            depth = 0
    if depth and opening[1][0] == "/":
        return False
    if not silent:
        token = state.push("marked", "", 0)
        token.markup, token.info = opening[1], opening[2]
        token.content = state.getLines(start + 1, last + (depth > 0), state.sCount[start], True)
        state.line = last + 1
        token.map = [start, state.line]
    return True


def _parse_titled(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """Parse a tab or an admonition of MkDocs: a title, and indented lines."""
    title = _TITLED.fullmatch(_line_at(state, start))
    if title is None:
        return False
    if not silent:
        indent, last = state.sCount[start] + 4, start
        for number in range(start + 1, end):
            if state.isEmpty(number):
                continue
            if state.sCount[number] < indent:
                break
            last = number
        token = state.push("titled", "", 0)
        token.markup, token.info = title["mark"] or "===", title["head"] or title["tab"]
        state.line = last + 1
        token.map = [start, state.line]
    return True


def _parse_component(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """Parse the line of a component's tag, below which Markdown goes on."""
    is_tag = COMPONENT.fullmatch(_line_at(state, start)) is not None
    if is_tag and not silent:
        state.line = start + 1
    return is_tag


def _line_at(state: StateBlock, number: int) -> str:
    """Return a line without what stands before it for the blocks around; empty for code."""
    is_code = state.sCount[number] - state.blkIndent > 3
    start = state.bMarks[number] + state.tShift[number]
    return "" if is_code else state.src[start : state.eMarks[number]]


_QUOTE = regex(r"^ {0,3}> ?")
_LEAD = regex(r"[ \t]*(?:(?:[-+*]|\d+[.)])[ \t]+)*")
"""What stands before a block in a list; the mark of its item, where this begins with it."""
_BLOCKS = ("fence", "marked", "titled")
_PARSER = MarkdownIt("commonmark").use(footnote_plugin).disable("footnote_tail")  # in its order
for _parse in (_parse_titled, _parse_marked, _parse_component):
    _PARSER.block.ruler.before(
        "fence", _parse.__name__, _parse, {"alt": ["paragraph", "list", "blockquote"]}
    )


# --- notebooks


def _read_cells(cells: list[dict[str, Any]], language: str, raw_formats: Set[str]) -> list[Segment]:
    """Return cells as segments; the pictures that are attached to one are in its text."""
    segments: list[Segment] = []
    is_run = any(cell.get("outputs") for cell in cells)
    for number, cell in enumerate(cells, 1):
        place, source = f"cell {number}", join_lines(cell.get("source", ""))
        metadata = cell.get("metadata") or {}
        raw_format = str(metadata.get("raw_mimetype") or metadata.get("format") or "")
        if cell.get("cell_type") == "markdown":
            for name, kinds in (cell.get("attachments") or {}).items():
                for kind, data in kinds.items():
                    url = f"data:{kind};base64,{''.join(join_lines(data).split())}"
                    source = source.replace(f"attachment:{name}", url)
            segments += read_markdown(source, place=place)
        elif cell.get("cell_type") == "code" and source.strip():
            outputs = cell.get("outputs") or ()
            tags = " ".join(metadata.get("tags") or ())
            values = [o for o in outputs if o.get("output_type") == "execute_result"]
            value_texts = [(o.get("data") or {}).get("text/plain") or "" for o in values]
            value_texts += ["\n".join(o["traceback"]) for o in outputs if o.get("traceback")]
            streams = (o for o in outputs if o.get("name") == "stdout")
            is_python = "python" in language
            cell_segment = Segment(
                kind="cell" if is_python else "block",
                place=place,
                text=source,
                head=tags if is_python else f"{{{language}}}",
                shows_value=bool(values) if is_run else None,
                printed="".join(join_lines(stream.get("text") or "") for stream in streams),
                value="\n".join(map(join_lines, value_texts)),
                picture=_recorded_picture(outputs),
                lost=tuple(
                    kind
                    for output in outputs
                    for kind in (
                        output.get("name"),
                        output.get("output_type"),
                        *(output.get("data") or ()),
                    )
                    if kind in _LOST_KINDS and (kind != "error" or "raises-exception" not in tags)
                ),
            )
            segments.append(cell_segment)
        elif raw_format in raw_formats:
            segments += read_markdown(read_rst(source), place=place)
        elif source.strip():
            head = f"={raw_format.rpartition('/')[2] or 'text'}"
            segments.append(Segment(kind="block", place=place, text=source, head=head))
    return segments


_LOST_KINDS = frozenset(
    "error stderr text/markdown text/latex image/jpeg image/gif application/javascript "
    "application/vnd.jupyter.widget-view+json".split()
)


def _recorded_picture(outputs: Iterable[Mapping[str, Any]]) -> tuple[str, bytes] | None:
    """Return the picture among the outputs of a cell, with its extension; empty for none.

    `None`: there are none, or a program was to draw it in the browser.
    """
    data = {kind: text for output in outputs for kind, text in (output.get("data") or {}).items()}
    if not outputs or "application/javascript" in data:
        return None
    with contextlib.suppress(ValueError, KeyError):
        return ".png", base64.b64decode(join_lines(data["image/png"]))
    return ".svg", join_lines(data.get("image/svg+xml") or "").encode()


def join_lines(source: str | list[str]) -> str:
    """Return a text of a notebook, which may be a list of its lines."""
    return source if isinstance(source, str) else "".join(source)
