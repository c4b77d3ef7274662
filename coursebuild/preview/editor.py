"""Places of the course in the author's editor.

Entry point: `open_in_editor(session, place)`.

1. Only a place where something is wrong is opened, which a page names as it was told.
2. The editor is that of `$VISUAL` or `$EDITOR`, if it opens a window: the terminal is the
   preview's. Otherwise it is the first of those below that is installed.
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
"""How editors are told a place."""
_EDITORS = {name: words for words, names in _ARGUMENTS.items() for name in names.split()}
_PATIENCE = 2.0
"""Seconds in which an editor that cannot open a window has said so."""


def open_in_editor(session: Session, place: str) -> str:
    """Open a place in the editor; gives why not, or nothing."""
    span = next((d.span for d in session.diagnostics() if location(d.span) == place), None)
    if span is None:
        return "nothing is wrong there any more"
    words = _editor()
    if not words:
        return "no editor that opens a window was found: set VISUAL to one, such as `code`"
    file = session.root / span.path
    told = [
        part.format(file=file, line=span.line, column=span.column)
        for part in _EDITORS[_name(words[0])].split()
    ]
    try:
        null = subprocess.DEVNULL
        process = subprocess.Popen(
            [*words, *told], stdin=null, stdout=null, stderr=null, start_new_session=True
        )
        status = process.wait(_PATIENCE)
    except OSError as error:
        return f"{words[0]} cannot be started: {reason(error)}"
    except subprocess.TimeoutExpired:  # it is open
        return ""
    return f"{words[0]} ended with status {status}" if status else ""


def _editor() -> list[str]:
    """The words that start the editor."""
    for said in (os.environ.get("VISUAL"), os.environ.get("EDITOR"), *_EDITORS):
        words = shlex.split(said or "")
        if words and _name(words[0]) in _EDITORS and shutil.which(words[0]):
            return words
    return []


def _name(program: str) -> str:
    return Path(program).stem.lower()
