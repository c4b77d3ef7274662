"""Split a text into segments: prose, fences, directives of MyST, Quarto or MkDocs.

Entry points: `read_markdown`, `read_front_matter`, `split_title`.
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
_FRONT_MATTER = re.compile(r"---[ \t]*\n(.*?\n)?(?:---|\.\.\.)[ \t]*(?:\n|\Z)", re.DOTALL)
_TITLE = re.compile(r"^#[ \t]+(.*?)(?:[ \t]+#+)?(?:[ \t]*\{[^{}]*\})?[ \t]*$", re.MULTILINE)
"""A heading of level 1."""


def read_front_matter(text: str) -> tuple[Mapping[str, Any], int]:
    """Return the YAML values at the beginning of a text, and the length of that part."""
    match = _FRONT_MATTER.match(text)
    if match is None:
        return {}, 0
    value = read_yaml(match[1] or "{}")
    return (value, match.end()) if isinstance(value, dict) else ({}, 0)


def read_markdown(text: str, first_line: int = 1, place: str = "") -> Iterator[Segment]:
    """Yield the segments of a text; `place` replaces their lines, in a cell or a nested block.

    Blocks in quotations and lists remain part of the prose.
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
            if mark[0] in "!?":  # the parser gives an admonition's title as its content
                content = textwrap.dedent("\n".join(lines[start + 1 : end])).strip("\n")
            yield Segment(
                kind="cell" if _CELL.fullmatch(head) and mark[0] != ":" else "block",
                place=place or f"line {first_line + start}",
                text=content.removesuffix("\n"),
                head=head,
                mark=mark,
            )


def _parse_div(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """Parse lines between colons, which can nest: a directive of MyST, a division of Quarto."""

    def match_colons(number: int) -> re.Match[str] | None:
        return _COLONS.fullmatch(state.getLines(number, number + 1, state.blkIndent, False))

    opening = match_colons(start)
    if opening is None or not opening[2]:
        return False
    if not silent:
        depth, last = 1, start
        while depth and last + 1 < end:
            last += 1
            if colons := match_colons(last):
                depth += 1 if colons[2] else -1
        token = state.push("div", "", 0)
        token.markup, token.info = opening[1], opening[2]
        token.content = state.getLines(start + 1, last + (depth > 0), state.sCount[start], True)
        state.line = last + 1
        token.map = [start, state.line]
    return True


_PARSER = MarkdownIt("commonmark").use(admon_plugin)
_PARSER.block.ruler.before("fence", "div", _parse_div, {"alt": ["paragraph", "list", "blockquote"]})


def split_title(segments: Sequence[Segment]) -> tuple[str, list[Segment]]:
    """Return the first heading of level 1, and the segments without it; later ones get level 2."""
    titles: list[str] = []

    def shift_heading(heading: re.Match[str]) -> str:
        titles.append(heading[1])
        return f"#{heading[0]}" if len(titles) > 1 else ""

    shifted = [
        replace(segment, text=_TITLE.sub(shift_heading, segment.text))
        if segment.kind == "prose"
        else segment
        for segment in segments
    ]
    return (titles or [""])[0], shifted
