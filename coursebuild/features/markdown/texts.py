"""Texts and formulas of a document as they stand in Markdown.

Entry points: `text_source`, `number_text`, `formula`; `piped` and `delimiter`, marks around texts.
"""

from __future__ import annotations

import re

from coursebuild.core.model import Math, NumberBinding, Text
from coursebuild.core.pages.marks import escaped

_ALWAYS = re.compile(r"[$`]")
"""What is escaped wherever it is text: another reader may see more in it than ours did."""
_PIPE = re.compile(r"(?<!\\)\|")
_COMMENT = re.compile(r"(?<!\\)%")
_MINUS = re.compile(r"(?<!\w)-(?=\d)")


def number_text(node: NumberBinding) -> str:
    """A number that a script printed, with a real minus sign."""
    return _MINUS.sub("\u2212", node.text)


def text_source(node: Text, *, cell: bool) -> str:
    """A text as it stands in its source, where it reads there as it does here."""
    source = node.span.text
    if source != node.text:
        text = escaped(node.text)
        if text[:1].isspace() and not source[:1].isspace():
            text = f"&#{ord(text[0])};{text[1:]}"
        if text[-1:].isspace() and not source[-1:].isspace():
            text = f"{text[:-1]}&#{ord(text[-1])};"
        return text.replace("\n", "&#10;")
    source = _ALWAYS.sub(lambda match: f"\\{match[0]}", source)
    return piped(source, cell=cell)


def piped(text: str, *, cell: bool) -> str:
    """Marks, whose pipes are escaped in a cell of a table."""
    return _PIPE.sub(r"\\|", text) if cell else text


def delimiter(source: str, usual: str) -> str:
    """The mark that emphasis has in its source."""
    return source[0] if source[:1] in ("*", "_") else usual


def formula(node: Math, tag: str, *, cell: bool) -> str:
    """A formula between its dollars, with its number, if it has one."""
    tex = f"{node.tex.text}\n{tag}" if tag else node.tex.text  # it may end with a comment
    if cell:  # a pipe would end the cell, and an escaped one is another sign
        tex = tex.replace(r"\|", r"\Vert{}").replace("|", r"\vert{}")
    if _COMMENT.search(tex):  # a line's end ends a comment
        tex = no_empty_lines(tex)
    elif "\n" in tex:
        tex = " ".join(part.strip() for part in tex.split("\n"))
    return f"$${tex}$$" if node.display else f"${tex}$"


def no_empty_lines(tex: str) -> str:
    """TeX without empty lines, at which a formula would end."""
    return "\n".join(line for line in tex.split("\n") if line.strip())
