"""Reading the documents of the repository: fences with their info strings, and links.

markdown-it reads them, with none of coursebuild's rules, so that the tests do not rely on what they
test.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    path
    for folder in ("", "how-to", "reference", "explanation")
    for path in (DOCS / folder).glob("*.md")
    if path.name != "rules.md"
)
"""The pages written by hand; the page of the rules is generated."""


@dataclass(frozen=True, slots=True)
class Fence:
    page: str
    """The name of the document's file, without its suffix."""
    line: int
    """The number of its first line, from 1."""
    kind: str
    words: tuple[str, ...]
    """The words of the info string after the kind."""
    text: str

    def __str__(self) -> str:
        return f"{self.page}-{self.line}"

    def is_(self, flag: str) -> bool:
        return flag in self.words

    def value(self, key: str) -> str | None:
        values = (word.partition("=")[2] for word in self.words if word.startswith(f"{key}="))
        return next(values, None)


@functools.cache
def _tokens(path: Path) -> list[Token]:
    return MarkdownIt("commonmark").enable("table").parse(path.read_text(encoding="utf-8"))


def fences(path: Path) -> list[Fence]:
    matches = []
    for token in _tokens(path):
        if token.type == "fence" and token.map is not None:
            kind, *words = token.info.split() or [""]
            matches.append(Fence(path.stem, token.map[0] + 1, kind, tuple(words), token.content))
    return matches


def code_spans(path: Path) -> list[str]:
    inlines = (child for token in _tokens(path) for child in token.children or ())
    return [child.content for child in inlines if child.type == "code_inline"]


def links(path: Path) -> Iterator[str]:
    for token in _tokens(path):
        for child in token.children or ():
            if child.type == "link_open":
                yield str(child.attrs["href"])
            elif child.type == "image":
                yield str(child.attrs["src"])


def anchors(path: Path) -> set[str]:
    """The anchors of a document's headings on GitHub."""
    tokens = _tokens(path)
    titles = (b.content for a, b in pairwise(tokens) if a.type == "heading_open")
    plain = (re.sub(r"`|\]\([^)]*\)", "", title).strip().lower() for title in titles)
    return {re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", title)) for title in plain}


def write_files(root: Path, fences: Iterable[Fence]) -> None:
    """Write each fence that has `file=` to that path below a folder."""
    for fence in fences:
        path = fence.value("file")
        if path is not None:
            target = root / path
            assert target.resolve().is_relative_to(root.resolve()), path
            assert not target.exists(), f"{path} is given twice"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(fence.text, encoding="utf-8")


def commonmark_examples() -> list[tuple[str, str]]:
    """The examples of the CommonMark specification: Markdown and HTML."""
    path = ROOT / "site" / "node_modules" / "commonmark-spec" / "spec.txt"
    if not path.is_file():
        pytest.fail(f"no {path.relative_to(ROOT)}: run `npm ci` in {ROOT / 'site'}")
    text = path.read_text(encoding="utf-8").replace("→", "\t")
    return re.findall(r"^`{32} example\n(.*?)^\.\n(.*?)^`{32}$", text, re.MULTILINE | re.DOTALL)
