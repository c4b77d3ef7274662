"""Merge conflicts that git left in a file.

Entry point: `find_conflict`. Git writes its marks at the start of a line, so a conflict can be
shown on purpose: in a block of kind `diff` or `markdown`, or indented in a list or a quotation.
"""

from __future__ import annotations

import re

from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Source, Span

_MARK = re.compile(r"^(?:<{7}|\|{7}|={7}|>{7})(?:[ \t][^\r\n]*)?(?=\r?$)", re.MULTILINE)
_SHOWN = re.compile(
    r"^ {0,3}(`{3,}|~{3,})[ \t]*(?:diff|markdown)\b.*\n(?:.*\n)*? {0,3}\1[`~]*[ \t]*\r?$",
    re.MULTILINE,
)
"""A block that shows a change, or how a lesson is written."""
_NOTES = {
    "|": "the text that both versions changed begins here",
    "=": "the other version begins here",
    ">": "the conflict ends here",
}


def find_conflict(source: Source) -> Diagnostic | None:
    """The diagnostic of the first merge conflict in a file, or of a mark that is left of one."""
    text, is_markdown = source.text, source.path.endswith(".md")
    if "<<<<<<<" not in text and ">>>>>>>" not in text:
        return None  # a line of `=` alone may be anything
    examples = [match.span() for match in _SHOWN.finditer(text)] if is_markdown else []
    marks = [
        Span(source, *match.span())
        for match in _MARK.finditer(text)
        if not any(start <= match.start() < end for start, end in examples)
    ]
    first = next((i for i, mark in enumerate(marks) if mark.text[0] in "<>"), None)
    if first is None:
        return None
    conflict = [marks[first]]
    for mark in marks[first + 1 :] if marks[first].text[0] == "<" else ():
        if mark.text[0] == "<":
            break
        conflict.append(mark)
        if mark.text[0] == ">":
            break
    message = "this line was left behind by a merge conflict"
    if len(conflict) > 1:
        lines = [str(mark.line) for mark in conflict]
        message = "a merge conflict was left here: its marks are lines "
        message += f"{', '.join(lines[:-1])} and {lines[-1]}"
    more_count = sum(mark.text[0] == "<" for mark in marks[first + 1 :])
    notes = [Note(_NOTES[mark.text[0]], mark) for mark in conflict[1:]]
    if more_count:
        notes.append(Note(f"conflicts further down in this file: {more_count}"))
    help = "keep one of the versions, or join them, and delete the marks"
    if is_markdown:
        help += "; to show a conflict to readers, put it into a block of kind `diff`"
    return diagnose("merge-conflict", conflict[0], message, help=help, notes=notes)
