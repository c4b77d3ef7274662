"""The answers of the language server: one server, asked over pipes by pygls' client."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from lsprotocol import types
from pygls.exceptions import JsonRpcException

from coursebuild import MANUAL
from support.editor import Editor
from support.editor_course import (
    BALL,
    FALL,
    FIRST_LESSON,
    LINKS,
    MAP,
    SECOND_LESSON,
    open_course,
    wait_for_results,
)
from support.fixture_cases import fixture_tables
from support.scratch_course import Folder, block, wait_until_alone

pytestmark = pytest.mark.site
CASES = fixture_tables("language_server")


@pytest.fixture(scope="module")
def editor(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[Editor]:
    folder = Folder((tmp_path_factory.mktemp("course") / "a cöurse").resolve())
    yield from open_course(folder, stores)


@pytest.fixture(autouse=True)
def unchanged(editor: Editor) -> Iterator[None]:
    """Each test finds the course as it was, and the server has written into none of its files."""
    texts = {path: editor.folder.text(path) for path in (FIRST_LESSON, SECOND_LESSON, MAP)}
    yield
    for path, text in texts.items():
        editor.write(path, text)
        editor.save(path)
    for path in texts:
        editor.until(path)


# --- diagnostics


def test_mistakes_are_reported_while_typing_and_nothing_is_saved(editor: Editor) -> None:
    text = f"{LINKS}\n🙂 𝄞 Lesson 9.9 is not there.\n"
    editor.write(SECOND_LESSON, text.replace("\n", "\r\n"))
    (mistake,) = editor.until(SECOND_LESSON, "link-lesson")
    line = LINKS.count("\n") + 1
    # In UTF-16, of which the two characters before take two each.
    assert mistake.range == types.Range(types.Position(line, 13), types.Position(line, 16))
    assert mistake.severity == types.DiagnosticSeverity.Error
    assert mistake.message.startswith("lesson 9.9 is not in the course map")
    address = mistake.code_description and mistake.code_description.href
    assert address == (f"{MANUAL}rules.html#link-lesson" if MANUAL else None)
    editor.write(SECOND_LESSON, LINKS)
    editor.until(SECOND_LESSON)
    assert editor.folder.text(SECOND_LESSON) == LINKS


def test_hints_are_published_with_the_severity_of_hints(editor: Editor) -> None:
    editor.write(SECOND_LESSON, f"{LINKS}\nIt **falls.\n")
    (hint,) = editor.until(SECOND_LESSON, "shown-as-written")
    assert hint.severity == types.DiagnosticSeverity.Hint


def test_a_mistake_has_related_places(editor: Editor) -> None:
    editor.write(SECOND_LESSON, LINKS + "\nA [moment of inertia]{term} again.\n")
    (diagnostic,) = editor.until(SECOND_LESSON, "term-repeated")
    (note,) = diagnostic.related_information or ()
    assert (editor.places.path(note.location.uri), note.location.range.start.line) == (
        FIRST_LESSON,
        2,
    )


def test_outputs_are_compared_while_typing(editor: Editor) -> None:
    editor.until(FIRST_LESSON)
    typed = FALL.replace("at 1.000 m\n```", "at 1.700 m\n```").replace("`1.000`", "`1.3`")
    typed = f"New lines above.\n\n{typed}"
    editor.write(FIRST_LESSON, typed)
    drift, binding = editor.until(FIRST_LESSON, "output-drift", "binding-mismatch")
    assert "this run printed 1.000" in drift.message
    assert (drift.range.start.line, binding.range.start.line) == (22, 25)


def test_scripts_run_when_they_are_saved(editor: Editor) -> None:
    typed = FALL.replace("{data.qpos[2]:.3f} m", "{2 * data.qpos[2]:.3f} m")
    editor.write(FIRST_LESSON, typed)
    editor.until(FIRST_LESSON)  # what it prints now is not known yet
    editor.save(FIRST_LESSON)
    editor.until(FIRST_LESSON, "output-drift")
    editor.write(FIRST_LESSON, "A line more.\n\n" + typed)
    (diagnostic,) = editor.until(FIRST_LESSON, "output-drift")
    assert diagnostic.range.start.line == 20
    accept = "Accept what `examples/fall.py` prints"
    # offered once the script has run a second time
    action = editor.wait_for(lambda: editor.actions(FIRST_LESSON, "at 1.|000 m").get(accept))
    assert action.kind == types.CodeActionKind.QuickFix and action.diagnostics
    new_file, *changes = action.edit.document_changes
    assert editor.places.path(new_file.uri) == "content/lessons/1.1-one.recorded.txt"
    new, record = editor.apply_edits({c.text_document.uri: c.edits for c in changes}).values()
    expected = typed.replace("at 1.000 m", "at 2.000 m").replace("`1.000`", "`2.000`")
    assert new == f"A line more.\n\n{expected}"  # with the number that is bound to it
    recording = next(json.loads(line) for line in record.splitlines() if '"is":"recording"' in line)
    assert (recording["of"], recording["comparison"]) == ("examples/fall.py output 1", "exact")
    assert [name for name, _ in recording["provenance"]["packages"]] == ["mujoco"]
    editor.write(FIRST_LESSON, new)
    editor.until(FIRST_LESSON)


def test_diagnostics_of_a_run_follow_their_lines(editor: Editor) -> None:
    typed = FALL.replace("print(", "print(1 / 0, ")
    editor.write(FIRST_LESSON, typed)
    editor.save(FIRST_LESSON)
    (diagnostic,) = editor.until(FIRST_LESSON, "script-failed")
    editor.write(FIRST_LESSON, "A line more.\n\n" + typed)
    editor.until(FIRST_LESSON, "script-failed", line=diagnostic.range.start.line + 2)


def test_a_broken_map_is_reported_and_the_last_course_stays(editor: Editor) -> None:
    text = editor.texts[MAP]
    editor.write(MAP, text + "\n[[silence]]\nrule = \n")
    (diagnostic,) = editor.until(MAP, "map-syntax")
    assert diagnostic.range.start.line == text.count("\n") + 2
    assert editor.hover_text(SECOND_LESSON, "lesson:1.|1#fall").startswith("**Lesson 1.1: ")


ODD = (
    "",
    "\0",
    "\ud83d",
    "```lab simlab\n{",
    "> [!",
    "$$",
    "[x](lesson:",
    "| a\n|-",
    "é" * 9999,
)


def test_any_text_is_read(editor: Editor) -> None:
    for text in ODD:
        for path in (FIRST_LESSON, MAP, "models/ball.xml"):
            editor.write(path, text)
            for ask in (editor.hover_text, editor.proposals, editor.actions):
                ask(path, "|" + text)
    editor.leave("models/ball.xml")
    nowhere = types.TextDocumentIdentifier("untitled:Untitled-1")
    assert editor.request("hover", types.HoverParams(nowhere, types.Position(5, 5))) is None


def test_a_text_that_is_too_long_is_not_read(editor: Editor) -> None:
    text = "$x$ *a* {out} " * 20_000
    editor.write(FIRST_LESSON, text)
    editor.until(FIRST_LESSON, "text-long")
    params = editor.identifier(FIRST_LESSON), types.FormattingOptions(4, True)
    assert not editor.request("formatting", types.DocumentFormattingParams(*params))
    assert not editor.request("folding_range", types.FoldingRangeParams(params[0]))
    assert not editor.actions(FIRST_LESSON, text[:3] + "|" + text[3:])
    editor.write(FIRST_LESSON, FALL)
    editor.until(FIRST_LESSON)
    assert "after 0.002 s" in editor.hover_text(FIRST_LESSON, "`1.0|00`{out}")


def test_a_model_that_goes_is_missed(editor: Editor) -> None:
    editor.until(SECOND_LESSON)
    (editor.folder.root / "models/ball.xml").unlink()
    editor.until(SECOND_LESSON, "link-model")
    editor.folder.write("models/ball.xml", BALL)
    editor.until(SECOND_LESSON)
    wait_for_results(editor)


# --- what things are


def test_hovers(editor: Editor) -> None:
    for path in (FIRST_LESSON, SECOND_LESSON, MAP):
        editor.until(path)
    # Models are compiled beside.
    editor.wait_for(lambda: "here `(7,)`" in editor.hover_text(FIRST_LESSON, "data.qp|os[2]:"))
    hovers = [(*hover, editor.hover_text(*hover[:2])) for hover in CASES["hovers"]]
    assert [hover for hover in hovers if hover[2] not in hover[3]] == []


def test_definitions(editor: Editor) -> None:
    definitions = CASES["definitions"]
    places = [[path, needle, editor.definition(path, needle)] for path, needle, _ in definitions]
    assert places == definitions


# --- what may be written


@pytest.mark.parametrize(("path", "typed", "label", "new"), CASES["completions"])
def test_completions(editor: Editor, path: str, typed: str, label: str, new: str) -> None:
    editor.write(path, editor.texts[path] + "\n" + typed.replace("|", "", 1))
    item = editor.proposals(path, typed)[label]
    assert isinstance(item.text_edit, types.TextEdit)
    (text,) = editor.apply_edits({editor.places.uri(path): [item.text_edit]}).values()
    before, after = typed.split("|", 1)
    stem = re.split(r'[\s:#=.!`(<"\[{@]', before)[-1]
    start = before.removesuffix('"' + stem) if new.startswith('"') else before.removesuffix(stem)
    assert text.endswith(start + new + after.removeprefix('"'))


def test_a_source_and_a_label_are_proposed_with_their_titles(editor: Editor) -> None:
    for typed, name, title in (
        ("As [@|", "galilei1638", "Two new sciences"),
        ("See [](#|", "tab:falls", "Table 1.2.1: Two falls"),
        ("See [](lesson:1.1#|", "eq:energy", "(1): E = m g h"),
    ):
        editor.write(SECOND_LESSON, f"{LINKS}\n{typed.replace('|', '')}")
        assert editor.proposals(SECOND_LESSON, typed)[name].detail == title


def test_existing_keys_and_those_of_other_questions_are_not_proposed(editor: Editor) -> None:
    editor.write(SECOND_LESSON, '```quiz\n{"questions": [{"kind": "numeric", "q": "?", }]}\n```\n')
    assert not {"options", "q", "kind"} & editor.proposals(SECOND_LESSON, '"q": "?", |').keys()


# --- what is offered


def test_a_number_that_was_printed_can_be_bound(editor: Editor) -> None:
    sentence = "It fell for 0.002 s, not 5 s, to `1.000` m."
    text = FALL.replace("> [!warning]", f"{sentence}\n\n> [!warning]")
    editor.write(FIRST_LESSON, text)
    (bind,) = editor.actions(FIRST_LESSON, "for 0.0|02 s, not").values()
    assert bind.title == "Bind `0.002` to what `examples/fall.py` prints"
    assert editor.apply_edits(bind.edit.changes)[FIRST_LESSON] == text.replace(
        "r 0.002 s, not", "r `0.002`{out} s, not"
    )
    (bind,) = editor.actions(FIRST_LESSON, "to `1.0|00` m.").values()
    assert editor.apply_edits(bind.edit.changes)[FIRST_LESSON] == text.replace(
        "`1.000` m.", "`1.000`{out} m."
    )
    assert not editor.actions(FIRST_LESSON, "not |5 s")
    assert not editor.actions(FIRST_LESSON, "at 1.|000 m\n```")


def test_a_proposal_of_a_diagnostic_is_a_quick_fix(editor: Editor) -> None:
    text = FALL.replace("at `1.000`{out} m", 'at `1.200 m`{out="at"}')
    editor.write(FIRST_LESSON, text)
    editor.until(FIRST_LESSON, "binding-mismatch")
    (fix,) = editor.actions(FIRST_LESSON, "`1.2|00 m`").values()
    assert (fix.title, fix.kind) == ("Write `1.000 m`", types.CodeActionKind.QuickFix)
    assert not fix.is_preferred  # a number is for a human to decide
    assert editor.apply_edits(fix.edit.changes)[FIRST_LESSON] == text.replace("1.200", "1.000")


def test_a_number_that_is_printed_twice_has_an_action_for_each_place(editor: Editor) -> None:
    text = FALL.replace("at `1.000`{out} m", "at `0.002`{out}")
    twice = text.replace("after 0.002 s at 1.000 m", "after 0.002 s at 0.002 m")
    editor.write(FIRST_LESSON, twice)
    editor.until(FIRST_LESSON, "output-drift", "output-ambiguous")
    titles = [*editor.actions(FIRST_LESSON, "`0.0|02`{out}")]
    assert [title.partition(" chooses ")[0] for title in titles] == [
        '`{out="after"}`',
        '`{out="at"}`',
    ]
    editor.write(FIRST_LESSON, FALL)
    editor.until(FIRST_LESSON)
    formula = twice.replace("`0.002`{out}", r"$\frac{\out{}{0.002}}{2}$")
    editor.write(FIRST_LESSON, formula)
    editor.until(FIRST_LESSON, "output-drift", "output-ambiguous")
    assert "after 0.002 s" in editor.hover_text(FIRST_LESSON, r"$\frac{\out{}{0.0|02}}")
    fixes = editor.actions(FIRST_LESSON, r"\out{}{0.0|02}").values()
    edited_texts = [editor.apply_edits(fix.edit.changes)[FIRST_LESSON] for fix in fixes]
    assert edited_texts == [formula.replace("{}", f"{{{words}}}") for words in ("after", "at")]


def test_all_mistakes_of_a_file_are_fixed_together(editor: Editor) -> None:
    """On request, from anywhere in the file, and only what can be meant."""
    text = FALL.replace("## ", "[a](lesson:fall) [b](term:zzzz)\n\n> [!note]+ A\n>\n> B.\n\n## ", 1)
    editor.write(FIRST_LESSON, text)
    editor.until(FIRST_LESSON, "link-lesson", "link-term", "callout-unknown")
    kind = types.CodeActionKind.SourceFixAll
    (fix_all,) = editor.actions(FIRST_LESSON, "> |B.", only=[kind]).values()
    assert (fix_all.title, fix_all.kind) == ("Fix all in this file (1)", kind)
    new = editor.apply_edits(fix_all.edit.changes)[FIRST_LESSON]
    assert new == text.replace("]+", "]")
    assert not editor.actions(FIRST_LESSON, "> |B.", only=[types.CodeActionKind.Refactor])


def test_renaming_a_lesson(editor: Editor) -> None:
    place = editor.identifier(SECOND_LESSON), editor.place(SECOND_LESSON, "lesson:1.|1#fall")
    name = editor.request("prepare_rename", types.PrepareRenameParams(*place))
    assert name.range.end.character - name.range.start.character == len("1.1")
    assert name.placeholder == "1.1"
    rename_edit = editor.request("rename", types.RenameParams(*place, new_name="1.5"))
    *edits, file_rename = rename_edit.document_changes
    assert editor.places.path(file_rename.new_uri) == "content/lessons/1.5-one.md"
    new = editor.apply_edits({edit.text_document.uri: edit.edits for edit in edits})
    assert new[SECOND_LESSON] == LINKS.replace("1.1", "1.5")
    assert 'id = "1.5"' in new[MAP]
    assert 'id = "1.1"' not in new[MAP]
    with pytest.raises(JsonRpcException, match=r"there is already a lesson 1\.2"):
        editor.request("rename", types.RenameParams(*place, new_name="1.2"))
    heading = editor.identifier(SECOND_LESSON), editor.place(SECOND_LESSON, "## L|inks")
    assert editor.request("prepare_rename", types.PrepareRenameParams(*heading)) is None


def rename(editor: Editor, path: str, needle: str, name: str) -> dict[str, str]:
    place = editor.identifier(path), editor.place(path, needle)
    edit = editor.request("rename", types.RenameParams(*place, new_name=name))
    return {} if edit is None else editor.apply_edits(edit.changes)


def test_renaming_a_term_and_a_label(editor: Editor) -> None:
    text = LINKS + "\n[again][r] and [the term](lesson:1.1#term:moment-of-inertia).\n\n"
    text += "[r]: lesson:1.1#eq:energy\n\n```bash {#lst:run}\nls\n```\n\nSee [](#lst:run).\n"
    editor.write(SECOND_LESSON, text)
    assert rename(editor, SECOND_LESSON, "(#lst:ru|n)", "lst:go") == {
        SECOND_LESSON: text.replace("lst:run", "lst:go")
    }
    for path, needle in (
        (FIRST_LESSON, "{#eq:en|ergy}"),
        (SECOND_LESSON, "lesson:1.1#eq:en|ergy)"),
    ):
        new = rename(editor, path, needle, "eq:E-1")
        texts = {FIRST_LESSON: FALL, SECOND_LESSON: text}
        assert new == {p: t.replace("eq:energy", "eq:E-1") for p, t in texts.items()}
    for path, needle in (
        (FIRST_LESSON, "[mom|ent of inertia]"),
        (SECOND_LESSON, "term:mom|ent-of-inertia),"),
    ):
        new = rename(editor, path, needle, "Rotational inertia")
        assert new == {
            FIRST_LESSON: FALL.replace("]{term}", ']{term="Rotational inertia"}'),
            SECOND_LESSON: text.replace("term:moment-of-inertia", "term:rotational-inertia"),
        }
    assert (
        rename(editor, SECOND_LESSON, "lesson:1.1#fa|ll)", "x") == {}
    )  # it follows from the heading
    labelled = text.replace("## Links", "## Links {#all .further}").replace("(#links)", "(#all)")
    editor.write(SECOND_LESSON, labelled)
    assert rename(editor, SECOND_LESSON, "{#a|ll", "both")[SECOND_LESSON] == labelled.replace(
        "#all", "#both"
    )
    for needle, name, reason in (
        ("term:mom|ent-of-inertia),", "{}", "a term has letters or digits"),
        ("lesson:1.1#eq:en|ergy)", "energy", "a label is `eq:`"),
        ("lesson:1.1#eq:en|ergy)", "eq:", "a label is `eq:`"),
        ("{#a|ll", "a b", "a label is letters"),
        ("{#lst:ru|n", "fig:run", "a label is `lst:`"),
    ):
        with pytest.raises(JsonRpcException, match=reason):
            rename(editor, SECOND_LESSON, needle, name)


def test_headings_and_folds(editor: Editor) -> None:
    editor.write(
        SECOND_LESSON, "## A\n\n### B `c`\n\n> [!tip]\n> Fold\n\n## D\n\n```text\nx\n```\n"
    )
    document = editor.identifier(SECOND_LESSON)
    symbols = editor.request("document_symbol", types.DocumentSymbolParams(document))
    assert [(s.name, [i.name for i in s.children]) for s in symbols] == [("A", ["B c"]), ("D", [])]
    folds = editor.request("folding_range", types.FoldingRangeParams(document))
    lines = sorted((fold.start_line, fold.end_line) for fold in folds)
    assert lines == [(0, 5), (2, 5), (4, 5), (7, 11), (9, 11)]


def test_a_text_is_formatted(editor: Editor) -> None:
    params = editor.identifier(SECOND_LESSON), types.FormattingOptions(4, True)
    editor.write(SECOND_LESSON, "## A\n\n| a | b |\n|-|-|\n| 100 | 2 |\n")
    (edit,) = editor.request("formatting", types.DocumentFormattingParams(*params))
    new = "## A\n\n| a   | b   |\n| --- | --- |\n| 100 | 2   |\n"
    assert editor.apply_edits({editor.places.uri(SECOND_LESSON): [edit]}) == {SECOND_LESSON: new}
    editor.write(SECOND_LESSON, new)
    assert not editor.request("formatting", types.DocumentFormattingParams(*params))


# --- the command


def test_the_server_ends_with_its_client(tmp_path: Path, stores: Path) -> None:
    folder = Folder((tmp_path / "course").resolve())
    script = "import time\ntime.sleep(600)\n"
    folder.fill(["## Wait\n\n" + block("long.py", script)], stores)
    assert Editor(folder).close() == 0
    wait_until_alone(folder)
