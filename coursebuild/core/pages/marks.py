"""The marks of Markdown: links, fences, tables, escapes.

Entry points: `escaped`, `escaped_line`, `guarded`; `link`, `picture`, `code_span`, `fence`,
`table`, `quoted`, `hang`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable


def hang(mark: str, text: str, indent: int | None = None) -> str:
    """Text behind a mark, its further lines indented by `indent` or by the width of the mark."""
    space = " " * (len(mark) if indent is None else indent)
    first, *rest = text.split("\n")
    lines = [f"{mark}{first}" if first else mark.rstrip()]
    return "\n".join([*lines, *(f"{space}{line}" if line.strip() else "" for line in rest)])


def quoted(text: str) -> str:
    """Lines in a blockquote."""
    return "\n".join(f"> {line}" if line.strip() else ">" for line in text.split("\n"))


def fence(language: str, text: str) -> str:
    """Code between fences that are longer than any in it."""
    runs = _FENCES.findall(text)
    ticks = "`" * max([3, *(len(run) + 1 for run in runs)])
    body = text if text.endswith("\n") or not text else f"{text}\n"
    return f"{ticks}{language}\n{body}{ticks}"


_FENCES = re.compile(r"^[ ]*(`{3,})", re.MULTILINE)


def code_span(text: str, ticks: str = "") -> str:
    """Text as inline code, between these ticks or as few as do."""
    text = text.replace("\n", " ")
    runs = set(map(len, _TICKS.findall(text)))
    ticks = ticks or "`" * next(n for n in range(1, len(text) + 2) if n not in runs)
    blank = text.strip(" ") == ""
    edges = text[:1] == "`" or text[-1:] == "`" or (text[:1] == text[-1:] == " ")
    pad = " " if edges and not blank else ""
    return f"{ticks}{pad}{text}{pad}{ticks}"


_TICKS = re.compile("`+")
_MARKS = re.compile(r"[\\`*\[\]<$|]|!$|~(?=~)|(?<=~)~|&(?=#?\w+;)|(?<![^\W_])_|_(?![^\W_])")


def escaped(text: str) -> str:
    """Text with all its marks escaped, in one line or several."""
    return _MARKS.sub(lambda match: f"\\{match[0]}", text)


def escaped_line(text: str) -> str:
    """Text in one line with all its marks escaped."""
    return escaped(" ".join(text.split()))


def link(text: str, href: str, title: str = "") -> str:
    """A link; `text` is Markdown."""
    return f"[{text}]({_destination(href)}{_title(title)})"


def picture(alt: str, url: str, title: str = "") -> str:
    """A picture; `alt` is plain text."""
    return f"![{escaped_line(alt)}]({_destination(url)}{_title(title)})"


def table(head: Iterable[str], rows: Iterable[Iterable[str]], align: Iterable[str] = ()) -> str:
    """A table of cells that are Markdown in one line, their pipes escaped."""
    head = tuple(head)
    marks = {"left": ":---", "right": "---:", "center": ":---:"}
    aligned = [marks.get(one, "---") for one in align] or ["---"] * len(head)
    lines = [head, aligned, *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


_APART = re.compile(r"[\s<>()\\]")
"""What an address may have in angle brackets only."""


def _destination(url: str) -> str:
    if url and not _APART.search(url):
        return url
    safe = url.replace("\\", "%5C").replace("<", "%3C").replace(">", "%3E")
    return f"<{''.join('%20' if c.isspace() else c for c in safe)}>"


def _title(title: str) -> str:
    if not title:
        return ""
    text = re.sub(r'[\\"]|&(?=#?\w+;)', lambda match: f"\\{match[0]}", title)
    text = re.sub(r"\n[ \t\n]*", "\n", text)
    return f' "{text}"'


_BEGINS = re.compile(
    r"(?P<mark>\#{1,6}(?=\s|$)|>|[-+*](?=\s|$)|~~~|`{3,}[^`]*$|=+\s*$|-+\s*$|(?:-\s*){3,}$|(?:\*\s*){3,}$|(?:_\s*){3,}$"
    r"|[|:\s-]*-[|:\s-]*$)"
    r"|(?P<number>\d{1,9})(?P<after>[.)])(?=\s|$)"
    r"|(?P<note>\[\^[^\]]+\]):"
)
"""What begins, or makes of the line before it, another block than a paragraph."""


def guarded(text: str) -> str:
    """The lines of a paragraph, so that none of them begins another block."""
    return "\n".join(map(_guarded_line, text.split("\n")))


def _guarded_line(line: str) -> str:
    found = _BEGINS.match(line)
    if found is None:
        return line
    if found["number"]:
        return f"{found['number']}\\{line[found.end('number') :]}"
    if found["note"]:
        return f"{found['note']}\\{line[found.end('note') :]}"
    return f"\\{line}"
