"""New lessons, models, templates and features: their files, and their entries in the map."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest

from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.source import Source
from coursebuild.features.authoring.course_map import with_lesson
from support.scratch_course import FIRST, ROOT, SECOND, CommandResult, Make

pytestmark = pytest.mark.site

MAP = "content/course.toml"
HEAD = '[course]\ntitle = "C"\n\n[[level]]\nid = "1"\ntitle = "One"  # a level\n'
ENTRY = '[[level.lesson]]\nid = "{}"\nslug = "{}"\ntitle = "{}"\nstatus = "{}"\n'
NEW = ENTRY.format("1.4", "new", "New", "draft")


def planned(id: str, slug: str = "x") -> str:
    return ENTRY.format(id, slug, "X", "planned")


PLACES = {
    "an empty level": (HEAD, HEAD + "\n" + NEW),
    "no line end at the end": (HEAD.rstrip("\n"), HEAD + "\n" + NEW.rstrip("\n")),
    "behind the one before, not by letters": (
        f"{HEAD}\n{planned('1.3')}# of 1.3\n\n# of 1.10\n{planned('1.10')}\n# the end\n",
        f"{HEAD}\n{planned('1.3')}\n{NEW}\n# of 1.3\n\n# of 1.10\n{planned('1.10')}\n# the end\n",
    ),
    "before the first, above its comment": (
        f"{HEAD}\n# of 1.5\n# too\n{planned('1.5')}",
        f"{HEAD}\n{NEW}\n# of 1.5\n# too\n{planned('1.5')}",
    ),
    "the last of a level that another follows": (
        f'{HEAD}\n{planned("1.3")}minutes = 3 # short\n\n# ---\n\n[[level]]\nid = 2\ntitle = "T"\n',
        f"{HEAD}\n{planned('1.3')}minutes = 3 # short\n\n{NEW}\n# ---\n\n"
        '[[level]]\nid = 2\ntitle = "T"\n',
    ),
    "entries that stand close, and a table between": (
        f"{HEAD}{planned('1.3')}{planned('1.5')}[verify]\ncompare = 'digits'\n",
        f"{HEAD}{planned('1.3')}\n{NEW}\n{planned('1.5')}[verify]\ncompare = 'digits'\n",
    ),
    "as far in as those around it": (
        f"{HEAD}\n{textwrap.indent(planned('1.3'), '  ')}",
        f"{HEAD}\n{textwrap.indent(planned('1.3'), '  ')}\n{textwrap.indent(NEW, '  ')}",
    ),
}


def test_entry_is_inserted_in_order_and_the_rest_is_unchanged() -> None:
    for case, (before, after) in PLACES.items():
        for end in ("\n", "\r\n"):
            course = parse_course_map(Source(MAP, before.replace("\n", end))).value
            assert course is not None
            assert with_lesson(course, "1.4", "new", "New") == after.replace("\n", end), case


def test_new_lesson_is_checked_and_built_as_it_is(make: Make) -> None:
    folder = make(FIRST, SECOND)
    for arguments, path in (
        (("1.10", 'Über "alles" \\ 50 %'), "content/lessons/1.10-uber-alles-50.md"),
        (("1.3", "力学", "--slug", "lixue"), "content/lessons/1.3-lixue.md"),
        (("1.2.1", "A\tB\x7f"), "content/lessons/1.2.1-a-b.md"),
    ):
        result = folder.main("new", "lesson", *arguments)
        assert result == CommandResult(0, f"changed {MAP}\nwrote {path}\n", "")
        assert (folder.root / path).is_file()
    result = folder.main("check")
    assert (result.status, result.out.count("warning")) == (0, 0), result.out
    ids = [line[6:-1] for line in folder.text(MAP).splitlines() if line.startswith("id = ")]
    assert ids[1:] == ["1.1", "1.2", "1.2.1", "1.3", "1.10"]


REFUSED_COMMANDS = [
    ("lesson 1.1 T", "there is a lesson 1.1 already: Lesson one"),
    (
        "lesson 7.1 T",
        "the map has no level for `7.1`; `coursebuild new level 7 TITLE` adds it; known: `1`",
    ),
    ("lesson ../x T", "the map has no level for `../x`; known: `1`"),
    ("lesson 1.9", "lesson 1.9 needs a title; it comes behind the id"),
    ("lesson Fall", "the id comes first: `coursebuild new lesson 1.2 Fall`"),
    ("level 2", "a level needs an id and a title; it comes behind the id"),
    ("level 1", "the id comes first: `coursebuild new level 2 1`"),
    ("level Two!", "the id comes first: `coursebuild new level 2 'Two!'`"),
    ("level 1 T", f"{MAP} cannot have a level 1: the level id `1` is used twice"),
    ("level a/b T", f"{MAP} cannot have a level a/b: "),
    ("page There --id A/b", f"{MAP} cannot have a page A/b: "),
    ("page There", "there is a file content/pages/there.md already"),
    ("page \udcff", "the title is not UTF-8"),
    ("lesson 1 T", f"{MAP} cannot have a lesson 1: "),
    ("lesson 1./../x T", f"{MAP} cannot have a lesson 1./../x: "),
    ("lesson 1.3 T --slug A/b", f"{MAP} cannot have a lesson 1.3: "),
    ("lesson 1.3 \udcff", "the title is not UTF-8"),
    ("lesson 1.7 there", "there is a file content/lessons/1.7-there.md already"),
    ("model ../x", "`../x` is not a name for a model: use letters, digits, `_` and `-`"),
    ("model there", "there is a file models/there.xml already"),
    ("feature quiz", "there is a feature or a fence `quiz` already"),
    ("feature Big-1", "`Big-1` is not a name for a feature: use lower-case letters"),
    ("template lessn.html", "there is no template `lessn.html`; did you mean `lesson.html`?"),
    ("template ../base.html", "there is no template `../base.html`; did you mean `base.html`?"),
]


def test_refused_addition_changes_nothing(make: Make) -> None:
    folder = make(FIRST)
    folder.write("content/lessons/1.7-there.md", "## There\n")
    folder.write("models/there.xml", "<mujoco/>")
    folder.write("content/pages/there.md", "Here.\n")
    before = folder.tree()
    for arguments, message in REFUSED_COMMANDS:
        result = folder.main("new", *arguments.split(" "))
        assert (result.status, result.out) == (2, ""), arguments
        assert message in result.err, arguments
    assert folder.main("new", "lesson", "1.3", " ").status == 2
    (folder.root / MAP).chmod(0o444)
    result = folder.main("new", "lesson", "1.3", "T")
    assert (result.status, f"{MAP} is read-only" in result.err) == (1, True)
    assert folder.tree() == before
    (folder.root / MAP).chmod(0o644)
    for text, message in (
        ("[", "the course map cannot be read; `coursebuild check` says why"),
        (
            'level = [{id = "1", title = "One"}]\ncourse = {title = "C"}\n',
            f"{MAP} cannot have a lesson 1.3: ",
        ),
    ):
        folder.write(MAP, text)
        result = folder.main("new", "lesson", "1.3", "T")
        assert (result.status, message in result.err, folder.text(MAP)) == (2, True, text)


def test_new_levels_and_pages_stand_in_order_and_are_built_as_they_are(make: Make) -> None:
    folder = make(FIRST, SECOND)
    map = folder.text(MAP).replace("[[level]]", "# The first.\n[[level]]")
    folder.write(MAP, map.replace("\n", "\r\n"))
    for arguments in (
        "level 10 Ten",
        "level 0 Before",
        "level 9 Nine",
        "page About --id us",
        "page More",
    ):
        result = folder.main("new", *arguments.split(" "))
        assert (result.status, result.err) == (0, "")
    assert result.out == f"changed {MAP}\nwrote content/pages/more.md\n"
    assert folder.main("new", "lesson", "9.1", "First of nine").status == 0
    text = folder.text(MAP)
    assert text.count("\r\n") == text.count("\n")
    ids = [line[6:-1] for line in text.splitlines() if line.startswith("id = ")]
    assert ids == ["us", "more", "0", "1", "1.1", "1.2", "9", "9.1", "10"]
    assert '\r\n\r\n# The first.\r\n[[level]]\r\nid = "1"' in text
    result = folder.main("build")
    assert (result.status, "warning" in result.out) == (0, False), result.out
    assert (folder.root / "public/more.html").is_file()


def test_new_model_compiles(make: Make) -> None:
    folder = make(FIRST + "\nThe [model](model:parts/falling-ball).\n")
    result = folder.main("new", "model", "parts/falling-ball")
    assert result == CommandResult(0, "wrote models/parts/falling-ball.xml\n", "")
    assert folder.main("check").status == 0


def test_new_template_is_the_one_of_the_tool_and_known_for_it(make: Make) -> None:
    folder = make(FIRST)
    result = folder.main("new", "template", "blocks/code.html")
    assert result == CommandResult(0, "wrote theme/templates/blocks/code.html\n", "")
    first, _, rest = folder.text("theme/templates/blocks/code.html").partition("\n")
    assert rest == (ROOT / "templates/blocks/code.html").read_text(encoding="utf-8")
    assert folder.main("new", "template", "blocks/code.html").status == 2
    assert folder.main("new", "template", "blocks/code.html", "--print").out == f"{first}\n{rest}"
    result = folder.main("check")
    assert (result.status, "warning" in result.out) == (0, False), result.out


def test_tests_of_new_features_pass_as_made(make: Make) -> None:
    folder = make(FIRST)
    for name, script in (("advice", ()), ("hint", ("--script",))):
        result = folder.main("new", "feature", name, *script)
        assert (
            result.out == f"changed {MAP}\nwrote features/{name}.py\nwrote tests/test_{name}.py\n"
        )
        assert ("PagePart" in folder.text(f"features/{name}.py")) == bool(script)
    assert 'features = ["features/advice.py", "features/hint.py"]\n' in folder.text(MAP)
    assert folder.main("check").status == 0
    tests = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.run(
        tests, cwd=folder.root, env=environment, capture_output=True, text=True
    )
    assert "6 passed" in process.stdout, process.stdout
