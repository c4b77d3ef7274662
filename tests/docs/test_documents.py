"""The README and the pages in docs/: commands exist, the README's course builds, links work."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

from coursebuild.pipeline.load import load
from support.built_sites import BuiltCourses
from support.markdown_files import (
    DOCS,
    PAGES,
    ROOT,
    anchors,
    code_spans,
    fences,
    links,
    write_files,
)
from support.scratch_course import Folder

README = ROOT / "README.md"
SECURITY = (ROOT / "SECURITY.md", DOCS / "explanation/security.md")
FENCES = fences(README)
LESSON = "content/lessons/1.1-free-fall.md"
PICTURE_LIMIT = 300_000  # bytes


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    folder = Folder(tmp_path / "course")
    write_files(folder.root, FENCES)
    folder.borrow(stores)
    return folder


# ------------------------------------------------------------------------------------- README


def test_the_course_of_the_readme_is_two_files(course: Folder) -> None:
    assert sorted(course.tree()) == ["content/course.toml", LESSON]


@pytest.mark.site
def test_the_course_of_the_readme_builds_by_its_commands(course: Folder) -> None:
    for command in ("update", "check", "build"):
        course.main(command).require_success()
    assert "every recorded output is up to date" in course.main("update").out
    page = course.text("public/lessons/1.1-free-fall.html")
    assert "after 1.000 s the ball has fallen 4.9148 m" in page


@pytest.mark.site
def test_the_mistake_of_the_readme(course: Folder) -> None:
    """`drift=` names the digits that replace the printed ones in the example."""
    (message,) = (fence for fence in FENCES if fence.value("drift"))
    lesson = course.text(LESSON)
    course.replace(LESSON, "4.9148", message.value("drift") or "")
    result = course.main("check")
    assert result.status == 1
    expected = message.text.rstrip().splitlines()
    assert result.out.splitlines()[: len(expected)] == expected
    assert "error[binding-mismatch]" not in result.out  # the number printed is the one in the text

    course.write(LESSON, lesson)
    course.replace(LESSON, "`4.915`", "`4.815`")  # the last sentence is checked, too
    result = course.main("check")
    assert result.status == 1
    assert "error[binding-mismatch]" in result.out
    assert "the nearest printed value is 4.9148" in result.out


def shell_lines(path: Path) -> list[str]:
    """The commands in a document: lines of its `sh` fences, and code in its prose."""
    blocks = [line for f in fences(path) if f.kind == "sh" for line in f.text.splitlines()]
    return [line.partition("#")[0].split(">")[0].strip() for line in blocks] + code_spans(path)


def test_every_make_target_exists() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = [line.split()[1] for line in shell_lines(README) if re.match(r"make \w", line)]
    assert {"site", "test", "serve", "help"} <= set(targets)
    assert [t for t in targets if not re.search(rf"^{re.escape(t)}:", makefile, re.MULTILINE)] == []


def test_every_command_exists() -> None:
    commands = set()
    for line in (line for path in [README, *PAGES] for line in shell_lines(path)):
        called = re.match(r"coursebuild (?:-C \S+ )?([a-z]+)", line)
        if called is not None:
            commands.add((called[1], *re.findall(r"--[a-z-]+", line)))
    assert {command for command, *_ in commands} >= {
        "build",
        "check",
        "update",
        "extract",
        "schema",
    }
    for command, *options in sorted(commands):
        result = Folder(ROOT).main(command, "--help")
        assert result.status == 0
        assert [option for option in options if option not in result.out] == []


# -------------------------------------------------------------------------------------- links


def test_links_lead_where_the_repository_is_read() -> None:
    other_files = [*ROOT.glob("plugins/*/README.md"), ROOT / "benchmarks/README.md"]
    lost = []
    for path in [
        README,
        ROOT / "CONTRIBUTING.md",
        *PAGES,
        DOCS / "reference/rules.md",
        *other_files,
    ]:
        for url in links(path):
            name, _, anchor = unquote(url).partition("#")
            target = path.parent / name if name else path
            if not re.match(r"https?://", url):
                exists = target.is_file() and (not anchor or anchor in anchors(target))
                lost += [] if exists else [(path.relative_to(ROOT).as_posix(), url)]
    assert lost == []


def test_every_document_is_a_page_of_the_manual_without_mistakes() -> None:
    """The manual is a course: the tool checks its links, anchors and everything else."""
    parsed_course = load(DOCS)
    assert parsed_course.value is not None
    pages = {page.path for page in parsed_course.value.pages}
    names = git("ls-files", "--cached", "--others", "--exclude-standard", "*.md").splitlines()
    assert set(names) - pages == set()
    assert parsed_course.diagnostics == ()


def git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=DOCS, capture_output=True, text=True).stdout


@pytest.mark.site
def test_the_first_change_records_its_words_wherever_they_stand() -> None:
    """The files that hold the text of the example, and the tests that its last command runs."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    places = git("grep", "-lF", "begin with a line `INPUT: …`", ":/tests/fixtures").split()
    assert [place for place in places if f"`{place.removeprefix('../')}`" not in text] == []
    (command,) = re.findall(r"`\.venv/bin/(pytest [^`]*) --rewrite-fixtures`", text)
    options = [*shlex.split(command), "--collect-only", "-p", "no:cacheprovider"]
    run = subprocess.run([sys.executable, "-m", *options], cwd=ROOT, capture_output=True, text=True)
    tests = [line.partition("::test_")[2] for line in run.stdout.splitlines() if "::" in line]
    assert sorted(tests) == [
        "documents_are_as_their_fixtures_say[io]",
        "the_page_of_rules_is_in_step",
        "what_the_author_sees[io-stray]",
    ]


def test_course_and_manual_link_to_no_placeholder() -> None:
    """Who owns the repository is said in coursebuild/__init__.py alone."""
    lines = git(
        "grep", "-nE", "//[^ ]*(OWNER|/example.org)", ":/*.toml", ":/*.py", ":/*.yml", ":/README.md"
    )
    examples = ("tests/", "benchmarks/", "docs/")
    assert [
        line for line in lines.splitlines() if not line.removeprefix("../").startswith(examples)
    ] == []


def test_the_pictures_are_there_and_small() -> None:
    pictures = {ROOT / url for url in links(README) if url.endswith(".png")}
    assert pictures == {*(DOCS / "images").glob("*.png")}
    for data in (picture.read_bytes() for picture in pictures):
        assert data.startswith(b"\x89PNG\r\n\x1a\n")
        assert 20_000 < len(data) < PICTURE_LIMIT


@pytest.mark.site
def test_the_moving_picture_is_what_the_commands_print(tmp_path: Path) -> None:
    picture = DOCS / "images/refused.svg"
    script = [sys.executable, DOCS / "moving_picture.py", tmp_path / picture.name]
    subprocess.run(script, capture_output=True, check=True)
    assert (tmp_path / picture.name).read_text("utf-8") == picture.read_text("utf-8")


@pytest.mark.slow
@pytest.mark.browser
def test_the_picture_can_be_taken_again(built_courses: BuiltCourses, tmp_path: Path) -> None:
    site = built_courses["real"].root / "public"
    script = [sys.executable, DOCS / "screenshots.py", "--site", site, "--images", tmp_path]
    result = subprocess.run(script, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    pictures = {path.name for path in tmp_path.glob("*.png")}
    assert pictures == {path.name for path in (DOCS / "images").glob("*.png")}


# ------------------------------------------------------------------------------- architecture


def rows(path: Path) -> list[list[str]]:
    lines = path.read_text(encoding="utf-8").split("\n\n")
    table = next(block for block in lines if block.startswith("| "))
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]


def test_the_folders_are_those_of_the_architecture() -> None:
    package = ROOT / "coursebuild"
    parts = {
        path.name + "/" * path.is_dir()
        for path in package.iterdir()
        if (path.suffix == ".py" and not path.name.startswith("__"))
        or (path / "__init__.py").is_file()
    }
    listed_modules: set[str] = set()
    for folder, _, entry_points in rows(DOCS / "explanation/architecture.md"):
        names = [name.removeprefix("coursebuild/") for name in re.findall(r"`([^`]+)`", folder)]
        for name in names:
            place = package / name if (package / name).exists() else ROOT / name
            assert place.exists(), name
        listed_modules.update(names)
        definitions = {
            name for part in names if part in parts for name in defined_names(package / part)
        }
        if definitions:
            assert set(re.findall(r"`([^`]+)`", entry_points)) <= definitions, folder
    assert parts <= listed_modules


def defined_names(place: Path) -> set[str]:
    """The names of top-level functions, classes and constants in a module or a package."""
    top = re.compile(r"^(?:def |class |(?=\w+: ))(\w+)", re.MULTILINE)
    paths = [place] if place.is_file() else place.rglob("*.py")
    return {name for path in paths for name in top.findall(path.read_text(encoding="utf-8"))}


def test_modules_that_a_text_names_are_there() -> None:
    """As `core/text/source.py` or `core.text.source`, in documents and in the code's own texts."""
    package = ROOT / "coursebuild"
    folders = "|".join(path.name for path in package.iterdir() if path.is_dir())
    name = re.compile(
        rf"`(?:coursebuild[/.])?((?:{folders})(?:/\w+)+\.py|(?:{folders})(?:\.[a-z_]+)+)`"
    )
    texts = [
        *(DOCS / "explanation").glob("*.md"),
        DOCS / "design.md",
        *package.rglob("*.py"),
        ROOT / "SECURITY.md",
    ]
    places = [
        (path, match[1]) for path in texts for match in name.finditer(path.read_text("utf-8"))
    ]
    places = [
        (path, module_name)
        for path, module_name in places
        if "/test_" not in module_name and module_name != "features/tabs.py"
    ]
    assert len(places) > 60
    missing = []
    for path, module_name in places:
        place = package / (
            module_name if module_name.endswith(".py") else module_name.replace(".", "/")
        )
        module = place if place.suffix else place.with_suffix(".py")
        member = module.parent.with_suffix(".py")  # or a package, or a name in a module
        if not (module.exists() or place.is_dir() or _has_name(member, module.stem)):
            missing.append(f"{path.relative_to(ROOT)}: {module_name}")
    assert missing == []


def _has_name(module: Path, name: str) -> bool:
    return module.exists() and re.search(rf"\b{name}\b", module.read_text("utf-8")) is not None


def test_what_is_promised_of_security_is_tested_where_it_says() -> None:
    paths = {path for page in SECURITY for path in re.findall(r"`([\w/]+\.py)`", page.read_text())}
    assert len(paths) > 20
    places = (ROOT, ROOT / "tests")
    assert [p for p in sorted(paths) if not any((place / p).is_file() for place in places)] == []
