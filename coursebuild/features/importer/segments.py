"""Text → segments: what is prose, what a fence, what a directive of MyST, Quarto or MkDocs.

Entry points: `read_markdown`, `front_matter`, `split_title`.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

from coursebuild.features.importer.values import Segment, read_yaml

_OPENING = re.compile(r"( {0,3})(`{3,}|~{3,}|:{3,})[ \t]*(.*?)[ \t]*")
_ADMONITION = re.compile(r"(?:!!!|\?\?\?\+?)[ \t]+(.*\S)[ \t]*")
_QUOTED_FENCE = re.compile(r"(?: {0,3}>)+ ?(`{3,}|~{3,})")
_CELL = re.compile(r"\{code-cell\}.*|\{(?:python|ipython3?)[^}]*\}|\{code-cell\s.*\}")
_FRONT = re.compile(r"---[ \t]*\n(.*?\n)?(?:---|\.\.\.)[ \t]*(?:\n|\Z)", re.DOTALL)
_TITLE = re.compile(r"#[ \t]+(.*?)(?:[ \t]+#+)?(?:[ \t]*\{[^{}]*\})?[ \t]*")
"""A heading of level 1."""


def front_matter(text: str) -> tuple[Mapping[str, Any], int]:
    """The YAML before a text, and how many characters it takes."""
    match = _FRONT.match(text)
    if match is None:
        return {}, 0
    value = read_yaml(match[1] or "{}")
    return (value, match.end()) if isinstance(value, dict) else ({}, 0)


def read_markdown(text: str, first_line: int = 1, place: str = "") -> Iterator[Segment]:
    """The segments of a text. `place` is where it stands, where that is no line of a file."""
    lines = text.split("\n")
    prose: list[str] = []
    at = 0

    def where(index: int) -> str:
        return place or f"line {first_line + index}"

    def ended(index: int) -> Iterator[Segment]:
        if any(line.strip() for line in prose):
            yield Segment(kind="prose", place=where(index - len(prose)), text="\n".join(prose))
        prose.clear()

    while at < len(lines):
        line = lines[at]
        if quoted := _QUOTED_FENCE.match(line):  # a fence inside a quotation stays as it is
            end = _quoted_end(lines, at, quoted[1])
            yield from ended(at)
            raw = "\n".join(lines[at:end])
            yield Segment(kind="fence", place=where(at), text=raw, fence="")
            at = end
            continue
        opening = _OPENING.fullmatch(line)
        note = _ADMONITION.fullmatch(line)
        if opening is not None and (opening[2][0] != ":" or opening[3]):
            yield from ended(at)
            end = _fence_end(lines, at, opening[2])
            body = textwrap.dedent("\n".join(lines[at + 1 : end])) if opening[1] else None
            inside = "\n".join(lines[at + 1 : end]) if body is None else body
            yield _fenced(opening[2], opening[3], inside, where(at))
            at = end + 1
        elif note is not None:
            yield from ended(at)
            end = at + 1
            while end < len(lines) and (not lines[end].strip() or lines[end].startswith("    ")):
                end += 1
            inside = textwrap.dedent("\n".join(lines[at + 1 : end])).strip("\n")
            yield Segment(kind="admonition", place=where(at), text=inside, head=note[1])
            at = end
        else:
            prose.append(line)
            at += 1
    yield from ended(at)


def _fenced(mark: str, head: str, inside: str, place: str) -> Segment:
    if mark[0] == ":":
        return Segment(kind="div", place=place, text=inside, head=head, fence=mark)
    if _CELL.fullmatch(head):
        return Segment(kind="cell", place=place, text=inside, head=head)
    return Segment(kind="fence", place=place, text=inside, head=head, fence=mark)


def _fence_end(lines: list[str], at: int, mark: str) -> int:
    """The line that closes a fence; that after the last one where none does."""
    depth = 0
    for index in range(at + 1, len(lines)):
        found = _OPENING.fullmatch(lines[index])
        if found is None or found[2][0] != mark[0]:
            continue
        if mark[0] == ":" and found[3]:
            depth += 1
        elif not found[3] and (mark[0] == ":" or len(found[2]) >= len(mark)):
            if depth == 0:
                return index
            depth -= 1
    return len(lines)


def _quoted_end(lines: list[str], at: int, mark: str) -> int:
    for index in range(at + 1, len(lines)):
        if not lines[index].lstrip().startswith(">"):
            return index
        if lines[index].lstrip(" >").startswith(mark):
            return index + 1
    return len(lines)


def split_title(segments: list[Segment]) -> tuple[str, list[Segment]]:
    """The first heading of level 1, and the segments without it; others of level 1 get level 2."""
    title, out = "", []
    for segment in segments:
        if segment.kind != "prose":
            out.append(segment)
            continue
        kept = []
        for line in segment.text.split("\n"):
            heading = _TITLE.fullmatch(line)
            if heading is None:
                kept.append(line)
            elif title:
                kept.append(f"#{line}")
            else:
                title = heading[1]
                kept.append("")
        out.append(Segment(kind="prose", place=segment.place, text="\n".join(kept)))
    return title, out
