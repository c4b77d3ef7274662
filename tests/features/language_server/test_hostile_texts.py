"""What an author wrote reaches an editor as text: in no field is it markup, a picture or a link."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token

from coursebuild.core.pages.marks import code_span, escape_text, fence
from support.editor import Editor
from support.fixture_cases import fixture_text
from support.markdown_files import ROOT
from support.scratch_course import Folder

HOSTILE = fixture_text("documents/hostile_words.txt")
BREAKS = "\n\n- <b>\n\n    <i>\n\n```\n<u>\n\n[r]: command:x\n\n| a |\n| - |\r\r<s>\u2028<b>\n===\n"
OUR_TOKENS = {"paragraph", "bullet_list", "list_item", "strong"}
OUR_INLINES = {"inline", "text", "code_inline", "fence", "softbreak"}
ADDRESS = re.compile(r"//|www\.\w|\w@\w")
"""What some readers make a link of wherever it stands."""


def tokens(markdown: str) -> Iterator[Token]:
    """What a client reads that takes HTML and knows what GitHub adds."""
    reader = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
    for token in reader.parse(markdown):
        yield token
        yield from token.children or ()


def visible_text(markdown: str) -> str:
    """What a reader sees of a description, which has no markup but ours."""
    texts = []
    for token in tokens(markdown):
        kind = token.type.removesuffix("_open").removesuffix("_close")
        assert kind in OUR_TOKENS | OUR_INLINES, (token, markdown)
        texts.append(token.content if token.type in OUR_INLINES - {"inline"} else " ")
    return " ".join("".join(texts).split())


# --- the functions by which texts and code become Markdown

PIECES = re.findall(r"\w+|\s|[^\w\s]", HOSTILE + BREAKS)
TEXTS = st.lists(st.sampled_from(PIECES), max_size=12).map("".join) | st.text(max_size=30)


def unread(text: str) -> str:
    """A text as CommonMark reads it where it means nothing."""
    return " ".join(text.replace("\0", "\ufffd").split())


@given(TEXTS)
def test_escaped_texts_are_text(text: str) -> None:
    for before, after in (("", ""), ("- ", ""), ("**Lesson 1.1: ", "** (draft)"), ("`x`: ", "")):
        markdown = f"{before}{escape_text(text)}{after}"
        if text.strip() or "*" not in before:
            expected = re.sub(r"^- |\*\*|`", "", before) + unread(text) + after.replace("**", "")
            assert visible_text(markdown) == unread(expected)
    assert ADDRESS.search(escape_text(text)) is None


@given(TEXTS)
def test_quoted_code_stays_in_its_marks(text: str) -> None:
    for wary in (False, True):
        block = fence("text", text, wary=wary)
        assert visible_text(f"{block}\n\nafter") == unread(f"{text} after")
    if text.strip():
        assert visible_text(f"- {code_span(text)} after") == unread(f"{text} after")


# --- the server

LESSON, FORMULAS = "content/lessons/1.1-one.md", "content/lessons/1.2-two.md"
MAP = "content/course.toml"
MODEL = "models/ball.xml"
QUOTED = "<img src=x> [c](command:x) <!-- `b` -->"
FILE = "content/a `b` <img src=x> ![p](c).txt"
TEXT = fixture_text("documents/hostile_lesson.md")


@pytest.fixture(scope="module")
def editor(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[Editor]:
    folder = Folder((tmp_path_factory.mktemp("hostile") / "course").resolve())
    text = json.dumps(HOSTILE)
    folder.write(
        MAP,
        f"[course]\ntitle = {text}\n[callouts]\nbad = {{label = {text}, promise = {text}}}\n"
        f'[[level]]\nid = "1"\ntitle = {text}\nsummary = {text}\n'
        f'[[level.lesson]]\nid = "1.1"\nslug = "one"\ntitle = {text}\nstatus = "complete"\n'
        f'summary = {text}\nobjectives = [{text}, {text}]\nprerequisites = ["1.2"]\n'
        f'[[level.lesson]]\nid = "1.2"\nslug = "two"\ntitle = {text}\nstatus = "complete"\n'
        f'[[page]]\nid = "evil"\ntitle = {text}\nfile = "content/pages/evil.md"\n',
    )
    folder.write("content/pages/evil.md", "Text\n")
    folder.write(LESSON, TEXT)
    folder.write(FORMULAS, f'$\\omega${{symbol="{QUOTED}"}} turns, and $2 \\omega$ too.\n')
    folder.write(FILE, "text")
    folder.write(MODEL, f"<!-- {HOSTILE.replace('--', '')} -->\n<mujoco/>\n")
    folder.borrow(stores)
    editor = Editor(folder)
    for path in (LESSON, FORMULAS, MAP):
        editor.write(path, folder.text(path))
    yield editor
    editor.close()


HOVERS = (
    (LESSON, "Level| 1", f"Level 1: {HOSTILE} {HOSTILE}"),
    (LESSON, "lesson:1|.1", f"Lesson 1.1: {HOSTILE} (complete) {HOSTILE} {HOSTILE} {HOSTILE}"),
    (LESSON, "(#he|ad)", f"{HOSTILE[2:]} {{#head}}"),
    (LESSON, "page:ev|il", HOSTILE),
    (LESSON, "model:ba|ll", f"{MODEL} {HOSTILE.replace('--', '')}"),
    (
        LESSON,
        "term:img|-src",
        "<img src=x> [c](command:x) A rotor is <img src=x> or ` and <img src=y> !p.",
    ),
    (LESSON, "examples/ho|stile.py)", f"examples/hostile.py, a script of 1.1: {HOSTILE}"),
    (LESSON, "a file](<|", FILE),
    (LESSON, "[!ba|d]", f"{HOSTILE} {HOSTILE}"),
    (LESSON, "`5.2|5`{out}", "examples/hostile.py printed 5.25 ``` <img src=x> ![p](c)"),
    (FORMULAS, "$2 \\ome|ga", f"\\omega: {QUOTED}"),
    (MAP, 'prerequisites = ["1|.2', f"Lesson 1.2: {HOSTILE}"),
)


@pytest.mark.site
def test_no_field_of_a_course_is_markup_in_an_editor(editor: Editor) -> None:
    editor.wait_for(lambda: editor.hover_text(LESSON, "`5.2|5`{out}"))  # the script has run
    editor.wait_for(lambda: editor.hover_text(FORMULAS, "$2 \\ome|ga"))  # formulas are typeset
    hovers = [(path, needle, editor.hover_text(path, needle)) for path, needle, _ in HOVERS]
    assert [(*place, visible_text(text)) for *place, text in hovers] == [
        (path, needle, unread(text)) for path, needle, text in HOVERS
    ]
    assert [text for *_, text in hovers if ADDRESS.search(text)] == []


@pytest.mark.site
def test_what_is_proposed_is_one_line_of_text(editor: Editor) -> None:
    editor.write(LESSON, f"{TEXT}\n[x](lesson:")
    item = editor.proposals(LESSON, "[x](lesson:|")["1.1"]
    assert (item.detail, item.documentation) == (HOSTILE, None)
    editor.write(LESSON, TEXT)


def test_extension_does_not_start_in_a_folder_that_is_not_trusted() -> None:
    extension = json.loads((ROOT / "editors/vscode/package.json").read_text())
    assert extension["capabilities"]["untrustedWorkspaces"] == {"supported": False}


def test_extension_trusts_no_description() -> None:
    """Without these, VS Code shows no HTML in Markdown and runs no command from it."""
    for file in (ROOT / "editors/vscode/src").iterdir():
        assert not re.search("isTrusted|supportHtml|enableCommandUris", file.read_text()), file
