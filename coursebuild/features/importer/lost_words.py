"""The words of a source that neither the new course nor its account has.

Nothing can be lost in silence, whatever an importer knows of a format: what it does not know is
found by its words. Most of what is found are names by which another tool is told how a page looks.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping

from coursebuild.api import UsageError, regex
from coursebuild.features.importer.segments import join_lines
from coursebuild.features.importer.source_files import TEXTS, SourceFiles

_WORD = regex(r"[^\W\d_](?:[^\W_]|\d)+")
_MARKUP = regex(
    r"<(script|style)\b.*?</\1\s*>|<[^<>]*>|\x1b\[[0-9;]*m|attachment:[^()\s]+"
    r"|data:[\w/+-]+;base64,[\w/+=]+",
    re.DOTALL,
)
"""What of recorded HTML, of what a terminal shows, or of a picture's address is no word."""
_MAPS = (".yml", ".yaml", ".toml", "_category_.json", "book.json", "course.json")
_NEW_TEXTS = (".md", ".toml", ".bib", ".js")
_MOST_WORDS = 40
"""Words of a place that are named: more are a program, or data."""


def find_lost_words(
    files: SourceFiles, new_files: Mapping[str, bytes], account: str
) -> Iterator[str]:
    """Yield a line for each file that was read and of which words are lost, with their places."""
    vocabulary = {*_words(account), *_words(" ".join((*files, *new_files)))}
    for path, data in new_files.items():
        if path.endswith(_NEW_TEXTS):
            vocabulary |= {*_words(data.decode("utf-8", "replace"))}
    for path in sorted(files.read_paths):
        is_map = path.endswith(_MAPS) and f"content/files/{path}" not in new_files
        if not (path.endswith(TEXTS) or is_map):
            continue
        try:
            whole = files.read_text(path)
        except UsageError:
            continue  # which is told already
        places = []
        for place, text in _places(path, whole):
            lost = [word for word in dict.fromkeys(_words(text)) if word not in vocabulary]
            vocabulary.update(lost)  # each is named once
            if lost:
                rest = f" and {len(lost) - _MOST_WORDS} more" * (len(lost) > _MOST_WORDS)
                places.append(f"{place}: {' '.join(lost[:_MOST_WORDS])}{rest}")
        if places:
            yield f"- {path}, {'; '.join(places)}"


def _words(text: str) -> Iterator[str]:
    return (word[0].casefold() for word in _WORD.finditer(text))


def _places(path: str, text: str) -> Iterable[tuple[str, str]]:
    """Yield the lines of a text, or what the cells of a notebook hold, each with its place."""
    if not path.endswith(".ipynb"):
        yield from ((f"line {number}", line) for number, line in enumerate(text.split("\n"), 1))
        return
    try:
        cells = json.loads(text)["cells"]
    except (ValueError, KeyError, TypeError, RecursionError):
        return  # it is told that this is no notebook
    for number, cell in enumerate(cells, 1):
        parts = [join_lines(cell.get("source") or "")]
        for output in cell.get("outputs") or ():
            values = (output.get("text"), output.get("evalue"), output.get("traceback"))
            data = output.get("data") or {}
            texts = (value for kind, value in data.items() if kind.startswith("text/"))
            parts += (join_lines(value) for value in (*values, *texts) if value)
        yield f"cell {number}", _MARKUP.sub(" ", "\n".join(parts))
