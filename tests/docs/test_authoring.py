"""The pages in docs/ are tested: examples are built, tables are compared with the code.

An example is a fence with one of these words in its info string:

- `file=PATH`: a file of the small course to which all other examples belong.
- `map`: another map for that course, which must then be clean.
- `lesson`: a lesson 1.2 for that course. It must be clean, or with `error=RULE` have mistakes of
  this one rule.
- `prints`: what `check` says about the example above it.
"""

from __future__ import annotations

import json
import re
import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from coursebuild.cli import main
from coursebuild.core.model.course import CALLOUTS
from coursebuild.core.text.rules import RULES
from support.fixture_cases import fixture_text
from support.markdown_files import PAGES, ROOT, Fence, code_spans, fences, write_files
from support.scratch_course import Folder

pytestmark = pytest.mark.engine

GUIDE = [path for path in PAGES if path.stem != "tutorial"]  # this page has a course of its own
FENCES = [fence for path in GUIDE for fence in fences(path)]
SPANS = [span for path in PAGES for span in code_spans(path)]
CODE = [*SPANS, *(fence.text for fence in FENCES)]
LESSONS = [fence for fence in FENCES if fence.is_("lesson")]
MAPS = [fence for fence in FENCES if fence.is_("map")]
MESSAGES = [(a, b) for a, b in pairwise(FENCES) if b.is_("prints")]
"""Each message on a page, with the example above it."""
SECOND = "content/lessons/1.2-large-swings.md"

SWING = fixture_text("documents/swing.md")


@pytest.fixture(scope="session")
def checked_course(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Path:
    """The course at the beginning of the reference, with the files that examples show.

    It was checked, so that in its copies only what a test has changed runs.
    """
    root = tmp_path_factory.mktemp("guide")
    write_files(root, FENCES)
    Folder(root).borrow(stores)
    (root / "content/lessons/sketch.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="40" height="40"><path d="M0 0V40"/></svg>'
    )
    (root / "content/measurements.csv").write_text("length,period\n0.5,1.419\n")
    (root / "src").mkdir()
    (root / "src/swing.py").write_text(SWING)
    assert main(["-C", str(root), "check", "--quiet"]) == 0
    return root


@pytest.fixture
def course(checked_course: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(checked_course, tmp_path / "course", symlinks=True))


def with_second_lesson(course: Path, text: str) -> None:
    map_file = course / "content/course.toml"
    planned, complete = 'status = "planned"', 'status = "complete"'
    assert map_file.read_text().count(planned) == 1
    map_file.write_text(map_file.read_text().replace(planned, complete))
    (course / SECOND).write_text(text, encoding="utf-8")


def check(course: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    capsys.readouterr()
    status = main(["-C", str(course), "check", "--quiet", "--format", "json"])
    report: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert status == (0 if report["summary"]["ok"] else 1)
    return report


def test_the_small_course_is_clean(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = check(course, capsys)
    assert report["diagnostics"] == []
    assert [script["path"] for script in report["scripts"]] == ["examples/pendulum.py"]


@pytest.mark.parametrize("fence", MAPS, ids=str)
def test_map(fence: Fence, course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (course / "content/course.toml").write_text(fence.text, encoding="utf-8")
    assert check(course, capsys)["diagnostics"] == []


@pytest.mark.parametrize(("lesson", "message"), MESSAGES, ids=str)
def test_mistake(
    lesson: Fence, message: Fence, course: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with_second_lesson(course, lesson.text)
    assert main(["-C", str(course), "check", "--quiet"]) == 1
    output = capsys.readouterr().out
    expected = message.text.rstrip().splitlines()
    assert output.splitlines()[: len(expected)] == expected
    assert re.findall(r"^(?:error|warning)\[(.*)\]: ", output, re.MULTILINE) == [
        lesson.value("error")
    ]


def test_every_mistake_on_the_page_has_its_message() -> None:
    assert [lesson for lesson, _ in MESSAGES] == [x for x in LESSONS if x.value("error")]


@pytest.mark.long
def test_every_right_example_builds(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Together, as lessons 1.2, 1.3 and so on of one course, without even a warning."""
    right = [fence for fence in LESSONS if not fence.value("error")]
    entries = []
    for number, fence in enumerate(right, start=2):
        slug = "large-swings" if number == 2 else f"example-{fence}"
        entries.append(
            f'[[level.lesson]]\nid = "1.{number}"\nslug = "{slug}"\n'
            'title = "An example"\nstatus = "draft"\n'
        )
        (course / f"content/lessons/1.{number}-{slug}.md").write_text(fence.text, encoding="utf-8")
    map_file = course / "content/course.toml"
    before, planned, after = map_file.read_text().partition('[[level.lesson]]\nid = "1.2"')
    assert planned
    map_file.write_text(before + "\n".join(entries) + after[after.index("[[page]]") :])
    assert main(["-C", str(course), "build"]) == 0, capsys.readouterr().out
    assert "warning" not in capsys.readouterr().out
    assert len(list((course / "public/lessons").glob("1.*.html"))) == len(right) + 1
    page = (course / "public/lessons/1.1-pendulum.html").read_text(encoding="utf-8")
    assert "measured      1.422 s" in page


def test_what_is_said_about_drifts(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`update` mends the drift on the page, and writes the bound number from its address."""
    (lesson,) = (fence for fence in LESSONS if fence.value("error") == "output-drift")
    with_second_lesson(course, lesson.text)
    main(["-C", str(course), "update", "--dry-run", "1.2"])
    assert (course / SECOND).read_text(encoding="utf-8") == lesson.text
    assert main(["-C", str(course), "update", "1.2"]) == 0, capsys.readouterr().out
    mended = lesson.text.replace("period 1.4291", "period 1.4219").replace("`1.43`", "`1.42`")
    assert (course / SECOND).read_text(encoding="utf-8") == mended


# ------------------------------------------------------------------------------- completeness


def is_quoted(name: str) -> bool:
    """Whether a page has a name in code: in a fence, or in a span."""
    word = re.compile(rf"(?<![\w-]){re.escape(name)}(?![\w-])")
    return any(word.search(code) for code in CODE)


def test_every_callout_kind_is_named() -> None:
    assert [name for name in CALLOUTS if not is_quoted(name)] == []


PAGE_OF_KIND = {
    "python": "scripts", "io": "scripts", "text": "outputs", "mjcf": "models", "bench": "models",
    "lab": "labs", "lab mjcf": "labs", "quiz": "quizzes", "exercise": "exercises",
}  # fmt: skip


def test_every_key_of_a_fence_is_on_its_page(
    course: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The tool itself lists the keys of a kind if it gets an unknown key that is like none."""
    bodies = {"io": "INPUT: a\nPROCESS: b\nOUTPUT: c", "quiz": "{}", "lab": "{}"}
    parts = (f"```{kind} zzzzzzzz=1\n{bodies.get(kind, '')}\n```\n" for kind in PAGE_OF_KIND)
    with_second_lesson(course, "## A\n\n" + "\n".join(parts))
    diagnostics = check(course, capsys)["diagnostics"]
    mistakes = [d for d in diagnostics if d["rule"] == "fence-key-unknown"]
    keys: dict[str, set[str]] = {page: set() for page in PAGE_OF_KIND.values()}
    for page, mistake in zip(PAGE_OF_KIND.values(), mistakes, strict=True):
        named_keys = set(re.findall(r"`([^`]+)`", mistake["help"] or ""))
        assert named_keys or "takes no keys" in mistake["message"]
        keys[page] |= named_keys
    for page, named_keys in keys.items():
        (path,) = (path for path in GUIDE if path.stem == page and "reference" in path.parts)
        spans = " ".join([*code_spans(path), *(fence.text for fence in fences(path))])
        assert {
            key for key in named_keys if not re.search(rf"(?<![\w-]){key}(?![\w-])", spans)
        } == set()
        assert keys_in_tables(path) <= named_keys


def keys_in_tables(path: Path) -> set[str]:
    """The keys in the first column of the tables of keys on a page."""
    text = path.read_text(encoding="utf-8")
    tables = re.findall(r"^\| (?:key|on the fence) \|.*\n\|.*\n((?:\|.*\n)+)", text, re.MULTILINE)
    cells = (row.split("|")[1] for table in tables for row in table.splitlines())
    return {key for cell in cells for key in re.findall(r"`(\w+)", cell)}


def test_every_rule_on_the_page_exists() -> None:
    first_words = {name.split("-")[0] for name in RULES}
    names = {code for code in SPANS if re.fullmatch(r"[a-z]+(-[a-z]+)+", code)}
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    packages = re.findall(r'^ +"([\w-]+)', project, re.MULTILINE)
    rules = {name for name in names if name.split("-")[0] in first_words} - {*packages}
    assert len(rules) > 10
    assert sorted(rules - RULES.keys()) == []
