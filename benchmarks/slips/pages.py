"""What pages say: whether two of them say the same, or differ only in words.

Entry point: `compare_pages`.
"""

from __future__ import annotations

import contextlib
import json
import re
from collections import Counter
from html.parser import HTMLParser
from typing import Any, Literal, TypeAlias

Token: TypeAlias = tuple[str, str]
"""A word of prose, or something else that readers see or a browser does; with what it is."""
_PIECES = re.compile(r"[^\W\d_][^\W_]*|\S")
_PUNCTUATION = set(".,;:!?'\"()-/‘’“”–—…")
_CODE = {"code", "pre", "math", "script", "style", "kbd", "samp"}
_SAID = ("alt", "title", "aria-label", "content", "placeholder")
"""Attributes that hold prose."""
_ZERO = re.compile(r"(?<![\d.])0+(?=\.\d)")
"""Before a decimal point, where `0.5` and `.5` are one number."""
_KEY = re.compile("[0-9a-f]{8}")
"""What the tool made of words: a hash, which may be a number."""
_HASH = re.compile(r"\.[0-9a-f]{8}(?=\.\w+$)")
"""That of a file to download, which holds what its page shows, and words that are said later."""
_SAID_FIELDS = frozenset(
    "title label text note q options explain hint hints reference ylabel xlabel unit name".split()
)
"""Fields of JSON that hold prose."""


_BLOCKS = frozenset(
    "h1 h2 h3 h4 h5 h6 ul ol li table tr td th pre figure aside section details blockquote img "
    "div button input".split()
)


class _Reader(HTMLParser):
    """Reads the tokens of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.tokens: list[Token] = []
        self._open: list[str] = []
        self._comments = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        structural = "id for name href".split()
        visible = {n: v for n, v in values.items() if n not in _SAID and n not in structural}
        visible = {n: v for n, v in visible.items() if not n.startswith(("aria-", "data-"))}
        if "href" in values:
            visible["href"] = _HASH.sub("", values["href"].partition("#")[0])
        self.tokens.append(("tag", tag + json.dumps(visible, sort_keys=True)))
        for name, value in values.items():
            if name in _SAID:
                self._say(value)
            elif name.startswith("data-") and not _KEY.fullmatch(value):
                self._read_data(value)
        if tag not in {"img", "input", "br", "meta", "link", "hr", "source", "wbr"}:
            is_comment = re.search(r"\b(?:c1?|d)\b", values.get("class", "")) and self._in_code()
            self._open.append("comment" if is_comment else tag)

    def handle_endtag(self, tag: str) -> None:
        if self._open:
            self._open.pop()

    def handle_data(self, data: str) -> None:
        data = _ZERO.sub("", data)
        if self._in_code() and "comment" not in self._open:
            self.tokens += (("code", word) for word in data.split())
        else:
            self._say(data)

    def _in_code(self) -> bool:
        return not _CODE.isdisjoint(self._open)

    def _say(self, text: str) -> None:
        for piece in _PIECES.findall(text):
            is_word = piece in _PUNCTUATION or piece[0].isalpha()
            self.tokens.append(("word" if is_word else "mark", piece))

    def _read_data(self, value: str) -> None:
        with contextlib.suppress(ValueError):  # a key of the tool's own, which nobody sees
            self._walk(json.loads(value), is_prose=False)

    def _walk(self, value: Any, *, is_prose: bool) -> None:
        if isinstance(value, dict):
            for key, inner in value.items():
                self.tokens.append(("key", key))
                self._walk(inner, is_prose=key in _SAID_FIELDS)
        elif isinstance(value, list):
            for inner in value:
                self._walk(inner, is_prose=is_prose)
        elif isinstance(value, str) and is_prose:
            self._say(value)
        else:
            self.tokens.append(("code", json.dumps(value)))


def _read(page: bytes) -> list[Token]:
    reader = _Reader()
    text = page.decode()
    main = re.search(r"<main.*</main>", text, re.S)
    reader.feed(text if main is None else main[0])
    return reader.tokens


def compare_pages(
    old: bytes, new: bytes, *, whole_lines: bool = False
) -> Literal["same", "prose", "other"]:
    """Whether two pages say the same, or differ only in words of prose.

    `whole_lines`: lines were lost, repeated or moved, and with them what stands in a line.
    """
    if old == new:
        return "same"
    before, after = _read(old), _read(new)
    if before == after:
        return "same"
    if Counter(before) == Counter(after):
        return "prose"  # in another order
    if whole_lines:
        lost, gained = Counter(before) - Counter(after), Counter(after) - Counter(before)
        if {kind for kind, _ in lost + gained} <= {"word", "tag"}:
            return "prose"
        old_blocks, new_blocks = (
            [
                name
                for kind, value in tokens
                if kind == "tag" and (name := value.partition("{")[0]) in _BLOCKS
            ]
            for tokens in (before, after)
        )
        return "prose" if old_blocks == new_blocks else "other"
    rest, new_rest = ([t for t in tokens if t[0] != "word"] for tokens in (before, after))
    return "prose" if rest == new_rest else "other"
