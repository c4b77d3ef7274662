"""A course's own features: a Python file that the map names brings a kind of fence."""

from __future__ import annotations

import ast
import json
import pydoc
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core import features
from support.fixture_cases import fixture_tables, fixture_text
from support.live_course import Live
from support.live_course import live as live
from support.markdown_files import DOCS, fences
from support.scratch_course import Folder

CODE = [fence for fence in fences(DOCS / "how-to/features.md") if fence.kind == "python"]
WALK = 5
"""How many steps the walk through a first feature has."""
STEPS, EXAMPLES = ([fence.text for fence in CODE[:WALK]], [fence.text for fence in CODE[WALK:]])

SHOUT = fixture_text("scripts/shout_feature.txt")
LESSON = "## Hello\n\n```shout\nlisten <now>\n```\n"
PAGE = "public/lessons/1.1-one.html"
MAP = "content/course.toml"


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    folder = Folder(tmp_path / "a course")
    folder.fill([LESSON], stores)
    folder.write("features/shout.py", SHOUT)
    folder.replace(MAP, "[course]\n", '[course]\nfeatures = ["features/shout.py"]\n')
    return folder


@pytest.mark.site
def test_a_fence_of_a_feature_follows_its_code_and_the_map(course: Folder) -> None:
    course.main("build").require_success()
    assert "<p>LISTEN &lt;NOW&gt;</p>" in course.text(PAGE)
    assert "LISTEN <NOW>" in course.text("public/lessons/1.1-one.md")
    styles = [text for path, text in course.tree("public").items() if path.endswith(".css")]
    assert any(b".shout { color: red }" in text for text in styles)
    course.replace("features/shout.py", "<p>{escape", "<p class='loud'>{escape")
    assert course.main("build").status == 0
    assert "<p class='loud'>LISTEN &lt;NOW&gt;</p>" in course.text(PAGE)
    course.replace(MAP, 'features = ["features/shout.py"]\n', "")
    assert course.main("build").status == 0
    assert "LISTEN" not in course.text(PAGE), "a file that the map does not name is no feature"


@pytest.mark.site
def test_blocks_of_a_feature_go_from_process_to_process(tmp_path: Path, stores: Path) -> None:
    course = Folder(tmp_path)
    course.fill([LESSON.replace("now", str(number)) for number in range(9)], stores)
    course.replace(MAP, "[course]\n", '[course]\nfeatures = ["features/shout.py"]\n')
    summary = "    text: str\n\n    def summary(self):\n        return self\n"
    course.write("features/shout.py", SHOUT.replace("    text: str\n", summary))
    for out, options in (("one", ["--jobs", "1"]), ("two", ["--jobs", "2", "--no-cache"])):
        result = course.run("build", "--out", out, *options)
        assert result.status == 0, result
    assert course.tree("one") == course.tree("two")
    assert "<p>LISTEN &lt;8&gt;</p>" in course.text("two/lessons/1.9-nine.html")


BROKEN = {
    "1 / 0\n": " fails at line 1: ZeroDivisionError: division by zero",
    "def (\n": " fails: SyntaxError: ",
    "FEATURE = 'shout'\n": " has no FEATURE",
    "raise SystemExit\n": " fails at line 1: SystemExit: ",
    SHOUT.replace('"shout",\n    f', '"quiz",\n    f'): ": two features are called `quiz`",
    SHOUT.replace('Rule("shout"', 'Rule("output-drift"'): ": there is already a rule",
    SHOUT.replace('"error"', '"Error"'): (
        ": the severity of `shout` is not `error`, `warning` or `hint`"
    ),
    SHOUT.replace('name="shout",\n    f', 'name="shout",\n    check=print,\n    f'): (
        ": it would see no `shout` of the course: its block has no `summary`"
    ),
    SHOUT.replace('name="shout",\n            b', 'name="lab",\n            b'): (
        ": there is already a fence `lab`"
    ),
}


@pytest.mark.site
def test_broken_feature_is_reported_at_its_place_in_the_map(course: Folder) -> None:
    def check() -> str:
        result = course.main("check")
        assert result.status == 1
        return result.out

    for code, message_end in BROKEN.items():
        course.write("features/shout.py", code)
        message, place, *_ = check().splitlines()
        assert message.startswith(f"error[feature-broken]: features/shout.py{message_end}"), message
        assert place == f"  --> {MAP}:2:13"
    (course.root / "features/shout.py").unlink()
    assert check().startswith("error[feature-broken]: features/shout.py cannot be read: ")
    text = course.text(MAP)
    for path in ("shout.py", "../shout.py", "features/shout", "features/../a.py"):
        course.write(MAP, text.replace("features/shout.py", path))
        out = check()
        assert out.startswith(f"error[field-value]: `features[0]` cannot be `{path}`")
        assert "a Python file in `features/`, as in `features/tabs.py`" in out


@pytest.mark.site
def test_a_feature_sees_its_document_and_the_course(course: Folder) -> None:
    course.write("features/shout.py", fixture_text("scripts/task_feature.txt"))
    task = '\n```task name="A & B"\nDo **this**.\n```\n'
    course.write("content/lessons/1.1-one.md", f"## Hello\n{task}")
    course.main("build").require_success()
    html = (
        '<div class="task"><p><b>Task 1.</b> A &amp; B</p>\n<p>Do <strong>this</strong>.</p></div>'
    )
    assert html in course.text(PAGE)
    course.write("content/lessons/1.1-one.md", f"## Hello\n{task}{task}")
    for _ in range(2):  # the second time from what is kept
        assert "error[task-name]: two tasks are called A & B\n" in course.main("check").out
    course.write("content/lessons/1.1-one.md", "## Hello\n\n```task\n```\n")
    expected = "error[task-name]: this task has no name\n  --> content/lessons/1.1-one.md:3:1\n"
    assert course.main("check").out.startswith(expected)


@pytest.mark.site
def test_the_walk_of_the_docs_ends_with_diagrams(course: Folder) -> None:
    """Each step replaces the definitions of the same names in the generated feature."""
    assert course.main("new", "feature", "mermaid").status == 0
    step_nodes = [node for step in STEPS for node in ast.parse(step).body]
    names = {defined_name(node) for node in step_nodes if defined_name(node)} | {"check"}
    first, *template_nodes = ast.parse(course.text("features/mermaid.py")).body[1:]
    nodes = [*(node for node in template_nodes if defined_name(node) not in names), *step_nodes]
    nodes.sort(key=lambda node: defined_name(node) != "")  # imports stand at the top
    course.write("features/mermaid.py", ast.unparse(ast.Module([first, *nodes], [])))
    diagram = '```mermaid alt="One & two"\nflowchart LR\n  one --> two\n```\n'
    course.write("content/lessons/1.1-one.md", f"## Hello\n\n{diagram}")
    course.main("build").require_success()
    assert re.search(r'<img src="data:image/svg[^"]+" alt="One &amp; two">', course.text(PAGE))
    assert "```mermaid\nflowchart LR\n" in course.text(PAGE.replace(".html", ".md"))
    for old, new, rule in ((' alt="One & two"', "", "alt"), ("flowchart", "flow", "syntax")):
        course.write("content/lessons/1.1-one.md", diagram.replace(old, new))
        assert f"error[mermaid-{rule}]: " in course.main("check").out


@pytest.mark.site
def test_the_rule_of_the_docs_sees_the_whole_text_of_each_document(course: Folder) -> None:
    course.write("features/todo.py", EXAMPLES[0])
    course.replace(MAP, '"features/shout.py"', '"features/todo.py"')
    course.write(course.lesson(), "## Hello\n\nOne *and TODO two*.\n\n- TODO three\n\n`TODO`\n")
    result = course.main("check")
    places = re.findall(r"warning\[todo\]: a note to oneself\n  --> .*:(\d+:\d+)\n", result.out)
    assert (result.status, places) == (0, ["3:6", "5:3"]), result.out
    assert course.main("explain", "todo").out == "todo\n\nA text holds a note of its author.\n"


def defined_name(node: ast.stmt) -> str:
    """The name that a statement defines; empty for imports."""
    target = node.targets[0] if isinstance(node, ast.Assign) else node
    return str(getattr(target, "name", getattr(target, "id", "")))


# --- pages


@pytest.fixture
def inventory(course: Folder) -> Folder:
    course.write("features/inventory.py", EXAMPLES[1])
    course.replace(MAP, '"features/shout.py"', '"features/shout.py", "features/inventory.py"')
    course.write("models/box.xml", "<mujoco><worldbody/></mujoco>\n")
    return course


@pytest.mark.site
def test_the_page_of_the_docs_is_a_page_of_the_site(inventory: Folder) -> None:
    inventory.main("build").require_success()
    html = inventory.text("public/inventory/index.html")
    assert '<li><a href="../models/box.html">box</a>, used 0 times</li>' in html
    assert "<title>Inventory · " in html
    assert '<a href="inventory/index.html">Inventory</a>' in inventory.text("public/index.html")
    assert '"inventory/index.html"' in inventory.text("public/search/index.js")
    assert "[box](../models/box.md)" in inventory.text("public/inventory/index.md")


@pytest.mark.site
def test_a_page_of_a_feature_follows_the_course(
    inventory: Folder, live: Callable[[Folder], Live]
) -> None:
    preview = live(inventory)
    page = "inventory/index.html"
    assert b"used 0 times" in (preview.find(page) or b"")
    inventory.write("content/lessons/1.1-one.md", "See [it](model:box).\n")
    preview.save("content/lessons/1.1-one.md")
    assert b"used 1 times" in (preview.find(page) or b"")
    site = preview.site()
    assert inventory.main("build").status == 0
    files = inventory.tree("public")
    assert site == {path: files[path] for path in site}
    (inventory.root / "models/box.xml").unlink()
    inventory.write("content/lessons/1.1-one.md", "Text.\n")
    assert inventory.main("build").status == 0
    assert not [path for path in inventory.tree("public") if "inventory" in path]


@pytest.mark.site
def test_broken_link_of_a_feature_page_is_reported(inventory: Folder) -> None:
    inventory.replace("features/inventory.py", 'href="{}"', 'href="{}l"')
    result = inventory.main("build")
    assert result.status == 1
    assert "error[link-broken]: `../models/box.htmll` leads nowhere" in result.out


@pytest.mark.site
def test_page_that_cannot_be_added_is_reported(inventory: Folder) -> None:
    code = inventory.text("features/inventory.py")
    for name, message in (
        ("search", "there is already a page `search`"),
        ("lessons", "there is already a page `lessons`"),
        ("home", "there is already a page `home`"),
        ("../x", "a page cannot be called `../x`: use small letters, digits and `-`"),
    ):
        renamed_code = code.replace('name="inventory",\n    v', f'name="{name}",\n    v')
        inventory.write("features/inventory.py", renamed_code)
        result = inventory.main("check")
        assert result.status == 1
        assert f"error[feature-broken]: features/inventory.py: {message}" in result.out


TIMELINE = SHOUT.replace(
    "    text: str\n", "    text: str\n\n    def anchors(self):\n        return IDS\n"
)
DRAWN = 'lambda page, block: Markup(f"<p id=year-{block.text}>{block.text}</p>")'


@pytest.mark.site
def test_equal_ids_of_blocks_of_a_feature_are_reported(course: Folder) -> None:
    """Those that a block declares by `check`; all others, by `build`, on the finished page."""
    draw = 'lambda page, block: Markup(f"<p>{escape(block.text.upper())}</p>")'
    two = "## One\n\n```shout\n1905\n```\n\n> ```shout\n> 1905\n> ```\n"
    course.write(course.lesson(), two)
    for ids, drawing, command, message in (
        ('(f"year-{self.text}",)', draw, "check", "the id `year-1905` is already used\n"),
        ("()", DRAWN, "build", "the id `year-1905` is already used on the finished page\n"),
    ):
        code = TIMELINE.replace("IDS", ids).replace(draw, drawing)
        course.write("features/shout.py", code)
        for _ in range(2):  # the second one finds the page drawn
            result = course.main(command)
            assert result.status == 1
            start = f"error[anchor-repeated]: {message}  --> {course.lesson()}:7:3\n"
            assert result.out.startswith(start), result.out
    assert not (course.root / "public").exists()
    course.write(course.lesson(), two.replace("> 1905", "> 1906"))
    assert course.main("build").status == 0


FAILURES = fixture_tables("broken_features")["replaced"]


@pytest.mark.site
def test_what_a_feature_prints_is_not_in_a_report(course: Folder) -> None:
    course.write("features/shout.py", SHOUT + '\nprint("here")\n')
    result = course.run("check", "--format", "json")
    assert json.loads(result.out)["summary"]["ok"]
    assert "here\n" in result.err


@pytest.mark.site
def test_a_feature_that_fails_is_named_with_the_lesson(course: Folder) -> None:
    summary = "    text: str\n\n    def summary(self):\n        return self\n"
    code = SHOUT.replace("    text: str\n", summary)
    for old, (new, subject, line) in FAILURES.items():
        assert old in code
        course.write("features/shout.py", code.replace(old, new, 1))
        result = course.run("build")
        assert result.status == 1
        error = result.err
        last_lines = error[error.rindex("\nTraceback") :]
        assert f"this is {subject}" in last_lines
        assert f"for {course.lesson()}{line}\n" in last_lines, error
        if "Shout(fence" in new:
            assert "TypeError: `parse` returned a value of the type Shout; return `Parsed(" in error


def test_help_shows_each_part_of_the_interface() -> None:
    for name, part in vars(features).items():
        if isinstance(part, type) and part.__module__ == features.__name__:
            assert name in pydoc.render_doc(part)
    assert "core.pages.context.PageContext" in pydoc.plain(pydoc.render_doc(features.FenceKind))
