"""A course that an editor has open: what its lessons refer to, and how it is served."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from support.editor import Editor
from support.fixture_cases import fixture_text
from support.scratch_course import Folder, wait_until_alone

FIRST_LESSON, SECOND_LESSON, MAP = (
    "content/lessons/1.1-one.md",
    "content/lessons/1.2-two.md",
    "content/course.toml",
)
FALL = fixture_text("documents/edited_fall.md")
LINKS = fixture_text("documents/edited_links.md")
SOURCES = fixture_text("documents/editor_references.bib")
BALL = fixture_text("documents/ball.xml")


def wait_for_results(editor: Editor) -> None:
    """Until everything has run."""
    editor.wait_for(lambda: "nq = 7" in editor.hover_text(SECOND_LESSON, "model:ba|ll"))


def open_course(folder: Folder, stores: Path) -> Iterator[Editor]:
    """An editor with all texts open, whose scripts have run; it ends with its server."""
    folder.write("models/ball.xml", BALL)
    folder.write("content/references.bib", SOURCES)
    folder.fill([FALL, LINKS], stores)
    editor = Editor(folder)
    for path in (FIRST_LESSON, SECOND_LESSON, MAP):
        editor.write(path, folder.text(path))
    editor.save(FIRST_LESSON)  # from now on scripts run
    wait_for_results(editor)
    yield editor
    status = editor.close()
    assert status == 0, status
    wait_until_alone(folder)
