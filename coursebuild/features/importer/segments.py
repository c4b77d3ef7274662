"""Text → segments: what is prose, what a fence, what a directive of MyST, Quarto or MkDocs.

Entry points: `read_markdown`, `front_matter`, `split_title`.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.rules_block import StateBlock
from mdit_py_plugins.admon import admon_plugin
from msgspec.structs import replace

from coursebuild.features.importer.values import Segment, read_yaml

_COLONS = re.compile(r" {0,3}(:{3,})[ \t]*(.*?)[ \t]*\n?")
_CELL = re.compile(r"\{code-cell\b.*|\{(?:python|ipython3?)[^}]*\}")
_FRONT = re.compile(r"---[ \t]*\n(.*?\n)?(?:---|\.\.\.)[ \t]*(?:\n|\Z)", re.DOTALL)
_TITLE = re.compile(r"^#[ \t]+(.*?)(?:[ \t]+#+)?(?:[ \t]*\{[^{}]*\})?[ \t]*$", re.MULTILINE)
"""A heading of level 1."""


def front_matter(text: str) -> tuple[Mapping[str, Any], int]:
    """The YAML before a text, and how many characters it takes."""
    match = _FRONT.match(text)
    if match is None:
        return {}, 0
    value = read_yaml(match[1] or "{}")
    return (value, match.end()) if isinstance(value, dict) else ({}, 0)


def read_markdown(text: str, first_line: int = 1, place: str = "") -> Iterator[Segment]:
    """The segments of a text. `place` is where it stands, where that is no line of a file.

    Blocks inside quotations and lists are left in the prose.
    """
    lines = text.split("\n")
    blocks = [
        (token.map, token.markup, token.info.strip(), token.content)
        for token in _PARSER.parse(text)
        if token.level == 0 and token.map and token.type in ("fence", "div", "admonition_open")
    ]
    at = 0
    for (start, end), mark, head, content in (*blocks, ([len(lines)] * 2, "", "", "")):
        if any(line.strip() for line in lines[at:start]):
            prose = "\n".join(lines[at:start])
            yield Segment(kind="prose", place=place or f"line {first_line + at}", text=prose)
        at = end
        if mark:
            if mark[0] in "!?":  # whose content is its title
                content = textwrap.dedent("\n".join(lines[start + 1 : end])).strip("\n")
            yield Segment(
                kind="cell" if _CELL.fullmatch(head) and mark[0] != ":" else "block",
                place=place or f"line {first_line + start}",
                text=content.removesuffix("\n"),
                head=head,
                mark=mark,
            )


def _div(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """Lines between colons, which may hold others: a directive of MyST, a division of Quarto."""

    def line(number: int) -> re.Match[str] | None:
        return _COLONS.fullmatch(state.getLines(number, number + 1, state.blkIndent, False))

    opening = line(start)
    if opening is None or not opening[2]:
        return False
    if not silent:
        depth, last = 1, start
        while depth and last + 1 < end:
            last += 1
            if colons := line(last):
                depth += 1 if colons[2] else -1
        token = state.push("div", "", 0)
        token.markup, token.info = opening[1], opening[2]
        token.content = state.getLines(start + 1, last + (depth > 0), state.sCount[start], True)
        state.line = last + 1
        token.map = [start, state.line]
    return True


_PARSER = MarkdownIt("commonmark").use(admon_plugin)
_PARSER.block.ruler.before("fence", "div", _div, {"alt": ["paragraph", "list", "blockquote"]})


def split_title(segments: Sequence[Segment]) -> tuple[str, list[Segment]]:
    """The first heading of level 1, and the segments without it; others of level 1 get level 2."""
    titles: list[str] = []

    def moved(heading: re.Match[str]) -> str:
        titles.append(heading[1])
        return f"#{heading[0]}" if len(titles) > 1 else ""

    without = [
        replace(one, text=_TITLE.sub(moved, one.text)) if one.kind == "prose" else one
        for one in segments
    ]
    return (titles or [""])[0], without
