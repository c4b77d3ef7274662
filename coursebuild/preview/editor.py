"""Opens places of the course in the author's editor.

Entry point: `open_in_editor(session, place)`.

1. Only a place where something is wrong is opened; a page names it by its location.
2. The editor is that of `$VISUAL` or `$EDITOR`, if it opens a window: the terminal is the
   preview's. Otherwise it is the first installed one of those below.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from pathlib import Path

from coursebuild.core.files.errors import reason
from coursebuild.preview.session import Session
from coursebuild.report.text import location

_ARGUMENTS = {
    "--goto {file}:{line}:{column}": "code code-insiders codium cursor windsurf positron",
    "{file}:{line}:{column}": "subl zed zeditor",
    "--line {line} --column {column} {file}": "pycharm idea webstorm clion kate",
    "+{line}:{column} {file}": "emacs emacsclient gedit",
    "+{line} {file}": "gvim mvim",
}
"""The arguments by which editors open a place."""
_EDITORS = {name: words for words, names in _ARGUMENTS.items() for name in names.split()}
_PATIENCE = 2.0
"""Seconds in which an editor that cannot open a window ends."""


def open_in_editor(session: Session, place: str) -> str:
    """Open a place in the editor; return why that failed, or an empty text."""
    span = next((d.span for d in session.diagnostics() if location(d.span) == place), None)
    if span is None:
        return "nothing is wrong there any more"
    words = _find_editor()
    if not words:
        return "no editor that opens a window was found: set VISUAL to one, such as `code`"
    file = session.root / span.path
    arguments = [
        part.format(file=file, line=span.line, column=span.column)
        for part in _EDITORS[_name(words[0])].split()
    ]
    try:
        null = subprocess.DEVNULL
        process = subprocess.Popen(
            [*words, *arguments], stdin=null, stdout=null, stderr=null, start_new_session=True
        )
        status = process.wait(_PATIENCE)
    except OSError as error:
        return f"{words[0]} cannot be started: {reason(error)}"
    except subprocess.TimeoutExpired:  # it is open
        return ""
    return f"{words[0]} ended with status {status}" if status else ""


def _find_editor() -> list[str]:
    """Find the words that start the editor."""
    for command in (os.environ.get("VISUAL"), os.environ.get("EDITOR"), *_EDITORS):
        words = shlex.split(command or "")
        if words and _name(words[0]) in _EDITORS and shutil.which(words[0]):
            return words
    return []


def _name(program: str) -> str:
    return Path(program).stem.lower()
