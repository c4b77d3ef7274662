"""reStructuredText within a text of MyST, as MyST."""

from __future__ import annotations

import re
import textwrap

from coursebuild.api import marks, regex
from coursebuild.features.importer.source_files import find_group

_DIRECTIVE = regex(
    r"^\.\.[ ]+(?P<name>[\w:-]+)::[ ]*(?P<argument>.*)\n?(?P<body>(?:[ \t]*\n|[ ]+\S.*\n?)*)"
    r"|^\.\.[ ]+_(?P<label>[\w .-]+):[ \t]*$"
    r"|^\.\.(?:[ ](?![\[|_]).*)?\n(?:[ \t]*\n|[ ]+\S.*\n?)*",
    re.MULTILINE,
)
"""A directive, a label, or a comment."""
_INLINE = regex(
    r"(?P<code>``.+?``)|(?<![\w:]):(?P<role>[A-Za-z][\w:+.-]*):`(?P<body>[^`]+)`"
    r"|`(?P<words>[^`<>]*\S)\s*<(?P<address>[^`<>]+)>`__?"
)
_LITERAL = regex(
    r"^(?P<line>[ ]*+(?:(?:[-*+]|\w+[.)])[ ]+)?)(?!\.\.[ ])"
    r"(?P<words>[^\n]*?)(?P<end>(?:(?<![ ])[ ]*+)?)::[ ]*\n(?:[ ]*\n)+"
    r"(?P<body>(?P<margin>[ ]+)\S.*(?:\n(?P=margin).*|\n[ ]*(?=\n))*)",
    re.MULTILINE,
)
"""Two colons, which may be alone, and what stands further right below them."""
_TERM = regex(r"^(?![-*+|#]|\d+[.)])(\S.*\n)[ ]+(?=\S)(.*(?:\n[ ]+\S.*)*)", re.MULTILINE)
"""A term, and what it means, further right on the next lines."""


def read_rst(text: str) -> str:
    """Return reStructuredText in Markdown of MyST: its directives, roles, links and labels."""
    parts, at = [], 0
    for block in _DIRECTIVE.finditer(text := textwrap.dedent(f"{text.expandtabs()}\n")):
        parts += [_read_prose(text[at : block.start()]), _write_block(block)]
        at = block.end()
    return "".join((*parts, _read_prose(text[at:])))


def _read_prose(text: str) -> str:
    parts, at = [], 0
    for literal in _LITERAL.finditer(text):
        words = f"{literal['line']}{literal['words']}{'' if literal['end'] else ':'}"
        words = words if literal["words"] else ""
        code = marks.fence("text", textwrap.dedent(literal["body"]).strip("\n"))
        margin = " " * min(len(literal["line"]), 3)  # further right it would be code in Markdown
        parts += [_read_words(f"{text[at : literal.start()]}{words}"), "\n\n"]
        parts += [textwrap.indent(code, margin), "\n"]
        at = literal.end()
    return "".join((*parts, _read_words(text[at:])))


def _read_words(text: str) -> str:
    return _TERM.sub(r"\1: \2\n", _INLINE.sub(_write_inline, text))


def _write_block(block: re.Match[str]) -> str:
    if block["name"] is None:
        return f"({block['label']})=" if block["label"] else ""
    body = textwrap.dedent(block["body"]).strip("\n")
    if not re.search("code|math|raw", block["name"]):
        options = find_group(r"\A((?::[\w-]+:(?!`).*\n?)*)", body)
        body = options + read_rst(body[len(options) :])
    return marks.fence(f"{{{block['name']}}} {block['argument']}".rstrip(), body) + "\n\n"


def _write_inline(match: re.Match[str]) -> str:
    if match["role"]:
        return f"{{{match['role']}}}`{match['body']}`"
    return match["code"] or f"[{match['words']}]({match['address']})"
