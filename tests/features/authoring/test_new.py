"""Commands that change a course: `new` and `rename`."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.source import Source
from coursebuild.features.authoring.course_map import with_lesson
from support.fixture_cases import fixture_tables, fixture_text
from support.scratch_course import FIRST, ROOT, SECOND, CommandResult, Folder, Make

pytestmark = pytest.mark.site

MAP = "content/course.toml"
CASES = fixture_tables("authoring")


def test_entry_is_inserted_in_order_and_the_rest_is_unchanged() -> None:
    for case, before, after in CASES["places"]:
        for end in ("\n", "\r\n"):
            course = parse_course_map(Source(MAP, before.replace("\n", end))).value
            assert course is not None
            assert with_lesson(course, "1.4", "new", "New") == after.replace("\n", end), case


def test_new_lesson_is_checked_and_built_as_it_is(make: Make) -> None:
    folder = make(FIRST, SECOND)
    for arguments, path in (
        (("1.10", 'Über "alles" \\ 50 %'), "content/lessons/1.10-uber-alles-50.md"),
        (("1.4", "Maße in Łódź"), "content/lessons/1.4-masse-in-lodz.md"),
        (("1.3", "力学", "--slug", "lixue"), "content/lessons/1.3-lixue.md"),
        (("1.2.1", "A\tB\x7f"), "content/lessons/1.2.1-a-b.md"),
    ):
        result = folder.main("new", "lesson", *arguments)
        assert result == CommandResult(0, f"changed {MAP}\nwrote {path}\n", "")
        assert (folder.root / path).is_file()
    result = folder.main("check")
    assert (result.status, result.out.count("warning")) == (0, 0), result.out
    ids = [line[6:-1] for line in folder.text(MAP).splitlines() if line.startswith("id = ")]
    assert ids[1:] == ["1.1", "1.2", "1.2.1", "1.3", "1.4", "1.10"]


def test_refused_addition_changes_nothing(make: Make) -> None:
    folder = make(FIRST)
    folder.write("content/lessons/1.7-there.md", "## There\n")
    folder.write("models/there.xml", "<mujoco/>")
    folder.write("content/pages/there.md", "Here.\n")
    before = folder.tree()
    not_utf8 = [(f"{kind} \udcff", "the title is not UTF-8") for kind in ("page", "lesson 1.3")]
    for arguments, message in (*CASES["additions"], *not_utf8):
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
    process = subprocess.run(
        tests, cwd=folder.root, env=folder.environment(), capture_output=True, text=True
    )
    assert "6 passed" in process.stdout, process.stdout


MAP = "content/course.toml"
LINKS = fixture_text("documents/links.md")


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(FIRST, SECOND, LINKS)
    twenty = '[[level.lesson]]\nid = "1.20"\nslug = "far"\ntitle = "Far"\nstatus = "planned"\n'
    twenty += 'prerequisites = ["1.1", "1.2"]  # both\n\n[[silence]]\nrule = "image-alt"\n'
    twenty += 'reason = "drawn"\npath = "content/lessons/1.2-two.md"\n'
    folder.write(MAP, f"{folder.text(MAP)}\n{twenty}")
    return folder


def test_every_link_mention_and_prerequisite_follows(course: Folder) -> None:
    course.main("check").require_success()
    toml, lesson = course.text(MAP), course.text(course.lesson(3))
    result = course.main("rename", "1.2", "1.7")
    assert result == CommandResult(
        0,
        f"changed {MAP}\nchanged {course.lesson(3)}\n"
        "wrote content/lessons/1.7-two.md\nremoved content/lessons/1.2-two.md\n",
        "",
    )
    new_lesson = course.text(course.lesson(3))
    assert new_lesson.count("1.7") == 15
    for text in ("Lesson 1.20 is another, 1.2 a number", '"1.2")', '"1.2-check"', '"answer": 1.2'):
        assert text in new_lesson
    assert new_lesson.count("1.2") == 5
    assert new_lesson.replace("1.7", "1.2") == lesson
    assert course.text("content/lessons/1.7-two.md") == SECOND
    new_map = course.text(MAP)
    assert 'prerequisites = ["1.1", "1.7"]  # both' in new_map
    assert 'path = "content/lessons/1.7-two.md"' in new_map
    ids = [line[6:-1] for line in new_map.splitlines() if line.startswith("id = ")]
    assert ids == ["1", "1.1", "1.3", "1.7", "1.20"], "moved by its id"
    after = course.main("check")
    assert (after.status, "0 scripts run, 2 cached" in after.out) == (0, True)
    course.main("rename", "1.7", "1.2")
    assert (course.text(MAP), course.text(course.lesson(3))) == (toml, lesson)


def test_lesson_moves_to_another_level_with_its_comments_and_line_ends(course: Folder) -> None:
    toml = course.text(MAP).replace('id = "1.2"', 'id = "1.2" # the id')
    toml = toml.replace('[[level.lesson]]\nid = "1.2"', '# About 1.2\n[[level.lesson]]\nid = "1.2"')
    toml += '\n[[level]]\nid = "A"\ntitle = "More"\n'
    course.write(MAP, toml.replace("\n", "\r\n"))
    course.write(course.lesson(2), SECOND.replace("\n", "\r\n"))
    assert course.main("rename", "two", "A.1").status == 0
    entry = (
        '\n# About 1.2\n[[level.lesson]]\nid = "A.1" # the id\nslug = "two"\ntitle = "Lesson two"\n'
        'status = "complete"\n'
    )
    text = course.read(MAP).decode()
    assert text.count("\n") == text.count("\r\n")
    assert text.replace("\r\n", "\n").endswith(f'[[level]]\nid = "A"\ntitle = "More"\n{entry}')
    assert course.read("content/lessons/A.1-two.md") == SECOND.replace("\n", "\r\n").encode()
    result = course.main("check")
    assert "link-" not in result.out, "`Lesson A.1` is no mention, and no link is lost"


def test_planned_lesson_and_one_out_of_order_stay_where_they_are(course: Folder) -> None:
    result = course.main("rename", "1.20", "1.30")
    assert (result.status, result.out) == (0, f"changed {MAP}\nchanged {course.lesson(3)}\n")
    toml = course.text(MAP)
    assert toml.index('"1.3"') < toml.index('"1.30"')
    course.write(MAP, toml.replace('"1.1"\nslug', '"1.9"\nslug').replace('["1.1", ', "["))
    (course.root / course.lesson(1)).rename(course.root / "content/lessons/1.9-one.md")
    course.replace(course.lesson(3), "1.1, ", "1.9, ")
    assert course.main("rename", "1.2", "1.8").status == 0
    ids = [line[6:-1] for line in course.text(MAP).splitlines() if line.startswith("id = ")]
    assert ids == ["1", "1.9", "1.8", "1.3", "1.30"]


def test_doubtful_places_are_listed_and_nothing_is_changed(make: Make) -> None:
    folder = make(FIRST, SECOND, "## Three\n\nLesson 1.2.\n")
    folder.write("models/ball.xml", "<mujoco/>\n")
    for path, text in CASES["doubts"]:
        before = folder.tree()
        old = before.get(path, b"")
        folder.write(path, old + b"\n" + text.encode())
        now = folder.tree()
        result = folder.main("rename", "1.2", "1.7")
        assert (result.status, result.out) == (1, ""), text
        first, place, *_, help = result.err.splitlines()
        assert first in (
            "coursebuild: 1 place may mean lesson 1.2:",
            "coursebuild: 2 places may mean lesson 1.2:",
        ), result.err
        assert place.startswith(f"  {path}:"), text
        assert help == (
            "  help: edit them first, or leave them as they are with --leave; nothing was changed"
        )
        assert folder.tree() == now
        if old or path in before:
            folder.write(path, old)
        else:
            (folder.root / path).unlink()
    folder.write("features/own.py", '"""For Lesson 1.2."""\n')
    assert folder.main("rename", "1.2", "1.7", "--leave").status == 0
    assert folder.text(folder.lesson(3)) == "## Three\n\nLesson 1.7.\n"
    assert folder.text("features/own.py") == '"""For Lesson 1.2."""\n'


def test_refused_renaming_changes_nothing(course: Folder) -> None:
    course.write("content/lessons/1.8-two.md", "## There\n")
    before = course.tree()
    for arguments, message in CASES["renames"]:
        result = course.main("rename", *arguments.split())
        assert (result.status, result.out) == (2, ""), arguments
        assert message in result.err, arguments
    (course.root / course.lesson(3)).chmod(0o444)
    result = course.main("rename", "1.2", "1.7")
    assert (result.status, f"{course.lesson(3)} is read-only" in result.err) == (1, True)
    assert course.tree() == before


def test_bytes_that_are_no_text_are_moved_as_they_are(make: Make) -> None:
    folder = make(FIRST, b"\xef\xbb\xbf## Two\r\n\nTr\xe4gheit\r")
    assert folder.main("rename", "1.2", "1.3").status == 0
    assert folder.read("content/lessons/1.3-two.md") == b"\xef\xbb\xbf## Two\r\n\nTr\xe4gheit\r"


def test_of_two_at_once_one_is_done(course: Folder) -> None:
    def rename(new: str) -> CommandResult:
        return course.run("rename", "1.2", new)

    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(rename, ("1.7", "1.8")))
    names = sorted(path.name for path in (course.root / "content/lessons").glob("*-two.md"))
    assert names in (["1.7-two.md"], ["1.8-two.md"])
    assert course.main("check").status == 0
    assert sorted(result.status for result in results)[0] == 0
