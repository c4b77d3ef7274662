"""The words of prose that an import loses: those of the texts that no page of the new course has.

Entry point: `find_losses`. A plain reader of CommonMark makes words of the texts: it knows no
dialect, so that what it reads does not rest on what the importer knows. A word is there where a
page has it with its neighbours, so that a lost sentence is seen although its words are common.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TypeAlias

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.footnote import footnote_plugin
from msgspec import Struct

from benchmarks.foreign.courses import FRONT, WORDS
from coursebuild.core.pages import urls
from coursebuild.pipeline.options import Options, open_store
from coursebuild.preview.session import Session

Run: TypeAlias = list[str]
"""Words that follow each other without a formula or the end of a block between them."""
_NEIGHBOURS = 3
"""Words in a row by which one of them is found; fewer where a run has fewer."""
_READER = MarkdownIt("commonmark").enable(["table", "strikethrough"]).use(footnote_plugin)
_CODE = re.compile(
    r"\{(?:code|python|ipython|r\b|julia|bash|math|mermaid|eval-rst|toctree|include|literal|raw|"
    r"auto|bibliography|currentmodule|button|octave|contents|index|image|tableofcontents)"
)
"""How a block begins that holds no prose; any other with a name between braces does."""
_MARKS = re.compile(
    r"^:::[ \t]+[\w.]+\n(?:[ ]{4}[^\n]*(?:\n|\Z))+"
    r"|^[ \t>]*(?::[\w-]+:[^\n]*|:{3,}[^\n]*|\([\w:.-]+\)=|%(?!\})[^\n]*|\+\+\+[^\n]*|/{3,}[^\n]*"
    r"|-+8<-+[^\n]*|import[ ][\w{}*, ]+[ ]from[ ][\"'][^\"'\n]+[\"'];?)[ \t]*$",
    re.MULTILINE,
)
"""Lines of options, labels, comments, frames, inclusions and imports of other tools."""
_TITLED = re.compile(
    r"^([ \t>]*)(?:===[!+]?|(?:!!!|\?{3}\+?)(?:[ \t]+[\w-]+)*)[ \t]*(?:([\"'])(.*)\2)?[ \t]*$",
    re.MULTILINE,
)
"""The title of a tab or an admonition of MkDocs, whose text stands further right."""
_FORMULA = re.compile(
    r"\$\$(?:(?!\n[ \t>]*\n).)+?\$\$|(?<![\\$])\$[^$\n]+\$(?!\d)"
    r"|(?<![\\$])\$(?=\S)(?:(?!\n[ \t>]*\n)[^$])+?(?<=\S)\$(?!\d)"
    r"|\\begin\{(\w+\*?)\}.*?\\end\{\1\}",
    re.DOTALL,
)
_NAMES = re.compile(
    r"\{cite[\w:]*\}`[^`]+`|\{[a-z][\w:+.-]*\}`[^`\s]+`|\{[a-z][\w:+.-]*\}(?=`)"
    r"|(?<=\S)\s<[^<>`\n]+>(?=`)|\[[^\[\]\n]*-?@[\w:.-]+[^\[\]\n]*\](?!\()"
    r"|(?<![\w.\[])@\w+-[\w-]+|(?<![\w:]):[a-z][\w+-]*:(?![\w:])|\{\{[^{}\n]*\}\}|\{%[^%]*%\}"
    r"|\[\]\([^()\n]*\)|(?<=\])\[[A-Za-z_]\w*(?:[.-]\w+)+\]"
    r"|<!--.*?-->|\{/\*.*?\*/\}",
    re.DOTALL,
)
"""Names by which other tools find what a page shows in their place, or how it looks; comments."""
_ATTRIBUTES = re.compile(r"\{:?[ ]*[#.:][^{}\n]*\}|\{[ ]*[\w:-]+=[^{}\n]*\}")
_EDGE = "\ue000"
"""What no run goes across."""
_SKIPPED = re.compile(r"<(script|style|math|svg|nav|template)\b.*?</\1>|<!--.*?-->", re.DOTALL)
_INLINE = re.compile(
    r"</?(?:a|abbr|b|cite|code|del|dfn|em|i|ins|kbd|mark|q|s|small|span|strong|sub|sup|u|wbr)"
    r"(?=[\s>/])[^<>]*>",
    re.IGNORECASE,
)
_TAG = re.compile(r"<[^<>]*>")
_PICTURE = re.compile(r"<img\b[^<>]*?\salt=([\"'])(.*?)\1[^<>]*>", re.DOTALL)
_LANGUAGE = re.compile(r"\A(?:#!|:::)\w+[ ]+")
"""That of code in a line, as MkDocs marks it."""


class Losses(Struct, frozen=True):
    """What of a body's prose is on no page."""

    words: int
    """Of its prose."""
    runs: Sequence[tuple[str, str]]
    """Lost words in a row, each with the path of its text; the longest first."""
    silent: int
    """Lost words that the account does not have either."""

    @property
    def lost(self) -> int:
        return sum(len(words.split()) for _, words in self.runs)


def find_losses(texts: Path, paths: Iterable[str], root: Path) -> Losses:
    """Compare texts with the pages of the course into which they were imported."""
    account = (root / "IMPORT.md").read_text("utf-8")
    on_pages, nowhere = _Index(), {*_words(account.partition("## Words that are nowhere")[2])}
    for page in _pages(root):
        on_pages.add(_runs(page))
    with_account = _Index(on_pages.rows)
    with_account.add(_runs(account.replace("`", " ").replace("*", " ")))
    words, silent, runs = 0, 0, []
    for path in paths:
        for run in _runs(_prose(texts / path)):
            words += len(run)
            for is_there, group in groupby(zip(on_pages.find(run), run, strict=True), _first):
                if not is_there:
                    runs.append((path, " ".join(word for _, word in group)))
            pairs = zip(with_account.find(run), run, strict=True)
            silent += sum(not is_told and word not in nowhere for is_told, word in pairs)
    return Losses(words, sorted(runs, key=lambda run: -len(run[1].split())), silent)


def _first(pair: tuple[bool, str]) -> bool:
    return pair[0]


class _Index:
    """Words in a row, up to `_NEIGHBOURS`."""

    def __init__(self, rows: Iterable[tuple[str, ...]] = ()) -> None:
        self.rows = {*rows}

    def add(self, runs: Iterable[Run]) -> None:
        for run in runs:
            for size in range(1, _NEIGHBOURS + 1):
                self.rows.update(tuple(run[at : at + size]) for at in range(len(run) - size + 1))

    def find(self, run: Run) -> list[bool]:
        """Say of each word whether it is here, with neighbours."""
        size, marks = min(_NEIGHBOURS, len(run)), [False] * len(run)
        for at in range(len(run) - size + 1):
            if tuple(run[at : at + size]) in self.rows:
                marks[at : at + size] = [True] * size
        return marks


def _words(text: str) -> Run:
    return [word.casefold() for word in WORDS.findall(text.replace("\u00ad", ""))]


def _runs(text: str) -> Iterator[Run]:
    return filter(None, map(_words, text.split(_EDGE)))


# --- the two sides


def _pages(root: Path) -> Iterator[str]:
    """Yield the words of the pages, as a preview draws them without running anything."""
    session = Session(Options(root, 1, open_store(root, None, None)))
    session.code = "refuse"
    session.start()
    assert session.course is not None
    for owner in session.course.owners:
        page = (session.find(urls.owner_path(owner)) or b"").decode()
        yield _plain(page.partition("<main")[2].partition("</main>")[0])
    session.close()


def _plain(page: str) -> str:
    """Return what HTML says."""
    page = _INLINE.sub("", _SKIPPED.sub(_EDGE, _PICTURE.sub(r" \2 ", page)))
    return html.unescape(_TAG.sub(" ", page))


def _prose(path: Path) -> str:
    """Return the prose of a text, or of the cells of a notebook that are no code."""
    text = path.read_text("utf-8", errors="replace").replace("\r\n", "\n")
    if path.suffix != ".ipynb":
        return _EDGE.join(_read(text))
    try:
        cells = json.loads(text)["cells"]
    except (ValueError, KeyError, TypeError):
        return ""
    sources = (cell["source"] for cell in cells if cell.get("cell_type") == "markdown")
    return _EDGE.join(part for source in sources for part in _read("".join(source)))


def _read(text: str) -> Iterator[str]:
    """Yield the blocks of Markdown as plain text."""
    text = _TITLED.sub(r"\1\3\n", _MARKS.sub("", FRONT.sub("", text)))
    text = _ATTRIBUTES.sub("", text)
    text = _FORMULA.sub(_EDGE, _NAMES.sub(_EDGE, text))
    for token in _READER.parse(text):
        if token.type == "inline":
            yield "".join(map(_text_of, token.children or ()))
        elif token.type == "html_block":
            yield _plain(token.content)
        elif token.type == "code_block" or (
            token.type == "fence" and token.info[:1] == "{" and not _CODE.match(token.info)
        ):
            yield from _read(token.content)


def _text_of(token: Token) -> str:
    if token.type in ("softbreak", "hardbreak"):
        return "\n"
    if token.type == "image":
        return "".join(map(_text_of, token.children or ()))
    if token.type == "html_inline":
        return _plain(token.content)
    return _LANGUAGE.sub("", token.content)
