"""Writing Markdown: links, fences, tables, escapes."""

from __future__ import annotations

import re
from collections.abc import Iterable

from coursebuild.core.text.regex import regex


def hang(mark: str, text: str, indent: int | None = None) -> str:
    """Text after a mark, its further lines indented by `indent` or the width of the mark."""
    space = " " * (len(mark) if indent is None else indent)
    first, *rest = text.split("\n")
    lines = [f"{mark}{first}" if first else mark.rstrip()]
    return "\n".join([*lines, *(f"{space}{line}" if line.strip() else "" for line in rest)])


def block_quote(text: str) -> str:
    """Put text into a block quote."""
    return "\n".join(f"> {line}" if line.strip() else ">" for line in text.split("\n"))


def fence(language: str, text: str, *, wary: bool = False) -> str:
    """Code between fences longer than any in it; `wary`: than any backticks in it."""
    runs = (_TICKS if wary else _FENCES).findall(text)
    ticks = "`" * max([3, *(len(run) + 1 for run in runs)])
    body = text if text.endswith("\n") or not text else f"{text}\n"
    return f"{ticks}{language}\n{body}{ticks}"


_FENCES = regex(r"(?:^|\r)[ ]*(`{3,})", re.MULTILINE)


def code_span(text: str, ticks: str = "") -> str:
    """Text as inline code, between these ticks or as few as possible."""
    text = re.sub("[\r\n]", " ", text)
    runs = set(map(len, _TICKS.findall(text)))
    ticks = ticks or "`" * next(n for n in range(1, len(text) + 2) if n not in runs)
    blank = text.strip(" ") == ""
    edges = text[:1] == "`" or text[-1:] == "`" or (text[:1] == text[-1:] == " ")
    pad = " " if edges and not blank else ""
    return f"{ticks}{pad}{text}{pad}{ticks}"


_TICKS = regex("`+")
_MARKS = regex(r"[\\`*\[\]<$|]|!$|~(?=~)|(?<=~)~|&(?=#?\w+;)|(?<![^\W_])_|_(?![^\W_])")


def escape_marks(text: str) -> str:
    """Escape all marks in a text of one or more lines."""
    return _MARKS.sub(lambda match: f"\\{match[0]}", text)


def escape_line(text: str) -> str:
    """Escape all marks in a text and put it on one line."""
    return escape_marks(" ".join(text.split()))


_READ_BY_SOME = regex(r"(?<!\\)~|@|:(?=/)|(?<=/)/|\.(?=[^\W\d_])")
"""What strikes text out, or is part of an address that becomes a link by itself."""


def escape_text(text: str) -> str:
    """Put a text on one line on which no reader of Markdown finds markup, a block or an address."""
    return guard_lines(_READ_BY_SOME.sub(r"\\\g<0>", escape_line(text)))


def link(text: str, href: str, title: str = "") -> str:
    """A link; `text` is Markdown."""
    return f"[{text}]({_destination(href)}{_title(title)})"


def picture(alt: str, url: str, title: str = "") -> str:
    """A picture; `alt` is plain text."""
    return f"![{escape_line(alt)}]({_destination(url)}{_title(title)})"


def table(head: Iterable[str], rows: Iterable[Iterable[str]], align: Iterable[str] = ()) -> str:
    """A table; its cells are Markdown on one line, with escaped pipes."""
    head = tuple(head)
    marks = {"left": ":---", "right": "---:", "center": ":---:"}
    rule = [marks.get(side, "---") for side in align] or ["---"] * len(head)
    lines = [head, rule, *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


_NEEDS_BRACKETS = regex(r"[\s<>()\\]")
"""Characters that an address may contain only in angle brackets."""


def _destination(url: str) -> str:
    if url and not _NEEDS_BRACKETS.search(url):
        return url
    safe = url.replace("\\", "%5C").replace("<", "%3C").replace(">", "%3E")
    return f"<{''.join('%20' if c.isspace() else c for c in safe)}>"


def _title(title: str) -> str:
    if not title:
        return ""
    text = re.sub(r'[\\"]|&(?=#?\w+;)', lambda match: f"\\{match[0]}", title)
    text = re.sub(r"\n[ \t\n]*", "\n", text)
    return f' "{text}"'


_BLOCK_START = regex(
    r"(?P<mark>\#{1,6}(?=\s|$)|>|[-+*](?=\s|$)|~~~|`{3,}[^`]*$|=+\s*$|-+\s*$|(?:-\s*){3,}$|(?:\*\s*){3,}$|(?:_\s*){3,}$"
    r"|[|:\s-]*-[|:\s-]*$)"
    r"|(?P<number>\d{1,9})(?P<after>[.)])(?=\s|$)"
    r"|(?P<note>\[\^[^\]]+\]):"
)
"""What begins another block than a paragraph, or turns the line above into one."""


def guard_lines(text: str) -> str:
    """Escape lines of a paragraph that would begin another block."""
    lines = text.split("\n")
    for number, line in enumerate(lines):
        if match := _BLOCK_START.match(line):
            at = max(match.end("number"), match.end("note"), 0)
            lines[number] = f"{line[:at]}\\{line[at:]}"
    return "\n".join(lines)
