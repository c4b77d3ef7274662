"""A stranger's branch brings along what it likes; it does nothing to who looks at it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.files.trust import seal
from coursebuild.core.files.write import FileChange
from support.editor import Editor
from support.fixture_cases import fixture_tables
from support.scratch_course import GOOD, Folder, Make, block
from support.workflows import git

LOOKING = fixture_tables("looking")["commands"]
"""Commands, the last of which writes what the user asks for."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that holds the course, its user's state folder and what is dear to the user."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    for path in ("victim/HEAD", "victim/site/index.html", "victim/folder/file"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("dear")
    (tmp_path / "victim/site" / MARKER).write_text(
        "site built by coursebuild; every file listed here may be replaced\nindex.html\n"
    )
    return tmp_path


def bring_orders(root: Path, home: Path) -> None:
    """Journals, in the true format, under each name that a journal ever had."""
    config = (root / ".git/config").read_bytes()
    changes = (
        FileChange("../victim/HEAD", None, b"dear"),
        FileChange(str(home / "victim/folder/file"), None, b"dear"),
        FileChange(".git/config", b"[core]\n\tfsmonitor = touch ../owned\n", config),
        FileChange(".venv/lib/python3.11/site-packages/zz.pth", b"import os", None),
        FileChange(".git/hooks/post-checkout", b"#!/bin/sh\ntouch ../owned\n", None),
        FileChange("content/lessons/1.1-one.md", b"## Owned\n", GOOD.encode()),
    )
    data = msgspec.msgpack.encode(changes)
    for name in ("changes", "journal", "journals/changes"):
        for number, text in enumerate(
            (data, seal("changes", data, b""), seal("changes", data, b"k"))
        ):
            path = root / ".coursebuild" / f"{name}{number or ''}"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)


def bring_links(root: Path, home: Path) -> None:
    """Links in the place of whatever a command writes."""
    store = root / ".coursebuild"
    store.mkdir()
    for name in ("lock", "clock", "pruned", "owner", "changes", ".gitignore"):
        (store / name).symlink_to(home / "victim/HEAD")
    for name in ("published", "unchanged", "scripts", "fonts", "environments"):
        (store / name).symlink_to(home / "victim/folder")
    (root / "public").symlink_to(home / "victim/site")
    (root / "examples").symlink_to(home / "victim/folder")


def bring_store_link(root: Path, home: Path) -> None:
    (root / ".coursebuild").symlink_to(home / "victim/folder")
    (root / ".public.coursebuild-new").symlink_to(home / "victim/folder")
    (root / ".public.coursebuild-old").symlink_to(home / "victim/site")


def bring_pipes(root: Path, home: Path) -> None:
    """Pipes, for which a reader waits for ever, in the place of what a command reads."""
    environment = root / ".venv/bin/python"
    environment.parent.mkdir(parents=True)
    environment.symlink_to(sys.executable)
    course_map = root / "content/course.toml"
    course_map.write_text(f'{course_map.read_text()}\n[verify]\npython = ".venv/bin/python"\n')
    for path in (
        f"public/{MARKER}",
        "examples/.extracted.json",
        "matplotlibrc",
        "requirements.txt",
        "runs/a.run.json",
        ".venv/pyvenv.cfg",
    ):
        (root / path).parent.mkdir(exist_ok=True)
        os.mkfifo(root / path)


def bring_environment(root: Path, home: Path) -> None:
    """Programs where the tool might look for some."""
    program = f"#!/bin/sh\ntouch '{home}/owned'\nexec '{sys.executable}' \"$@\"\n"
    for folder in (".venv/bin", ".coursebuild/environments/mujoco-3.13.0-x/bin", "bin"):
        for name in ("python", "python3", "bwrap", "git", "node", "coursebuild"):
            path = root / folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(program)
            path.chmod(0o755)
    for name in ("sitecustomize.py", "usercustomize.py", "msgspec.py", "conftest.py", "jinja2.py"):
        (root / name).write_text(f"open({str(home / 'owned')!r}, 'w')\n")


def read_files(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.site
@pytest.mark.parametrize(
    "bring",
    [bring_orders, bring_links, bring_store_link, bring_pipes, bring_environment],
    ids=lambda f: f.__name__,
)
def test_looking_at_what_a_branch_brings_does_nothing_else(
    make: Make, home: Path, bring: Callable[[Path, Path], None]
) -> None:
    course = make(GOOD)
    shutil.rmtree(course.root / ".coursebuild")
    root = course.root.rename(home / "course")
    course = Folder(root)
    course.tmp.mkdir()
    git(root, "init", "--quiet")
    bring(root, home)
    victim, repository = read_files(home / "victim"), read_files(root / ".git")
    for arguments in LOOKING:
        run = course.run if arguments == ("check",) else course.main
        result = run(*arguments)
        assert "Traceback" not in result.err + result.out, arguments
        assert read_files(home / "victim") == victim, arguments
        assert read_files(root / ".git") == repository, arguments
        assert not (home / "owned").exists(), arguments
        if bring not in (bring_pipes, bring_environment):
            assert not (root / ".venv").exists(), arguments
        if arguments != LOOKING[-1]:
            assert course.text(course.lesson()) == GOOD, arguments
    subprocess.run(["git", "status"], cwd=root, check=True, capture_output=True)
    assert not (home / "owned").exists()


@pytest.mark.site
def test_nothing_that_a_script_prints_commands_the_service_that_reads_the_log(make: Make) -> None:
    code = 'import sys\nsys.exit("::add-mask::a\\n  ::error::b ##[error]c\\n##vso[task.d]e")'
    course = make("## A\n\n" + block("a.py", code, "x"))
    for form in ("text", "json", "junit", "sarif", "github"):
        result = course.main("check", "--format", form)
        assert result.status == 1 and "exited with status 1" in result.out, form
        commands = [
            line
            for line in (result.out + result.err).splitlines()
            if line.lstrip().startswith("::") or "##[" in line or "##vso[" in line
        ]
        if form == "github":
            assert [line.partition(" ")[0] for line in commands] == ["::error"]
        else:
            assert commands == [], form
        if form == "json":
            assert "##[error]c\n##vso[task.d]e" in str(json.loads(result.out)).replace("\\n", "\n")


def test_no_name_of_a_file_commands_the_terminal(make: Make) -> None:
    course = make(GOOD)
    order = "\x1b]0;x\x07"
    course.write(f"content/lessons/1.2-{order}.md", "text")
    course.write(f"models/{order}.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>")
    for arguments in (("check",), ("bench",), ("diet", order), ("rename", "1.1", order)):
        result = course.main(*arguments)
        assert result.status != 0
        assert "\x1b" not in result.out + result.err and "␛]0;x␇" in result.out + result.err


TOUCH = "from pathlib import Path\nPath({!r}).touch()\n"


def test_commands_that_only_look_run_no_code_that_has_not_run_before(
    make: Make, home: Path
) -> None:
    course = make(GOOD)
    title = 'title = "Scratch"'
    course.replace("content/course.toml", title, title + '\nfeatures = ["features/mine.py"]')
    feature = "from coursebuild.core.features import Feature\nFEATURE = Feature(name='mine')\n"
    course.write("features/mine.py", TOUCH.format(str(home / "owned")) + feature)
    for arguments in (
        ("fmt", "--check"),
        ("explain", "1.1"),
        ("rename", "1.1", "1.2"),
        ("extract",),
    ):
        result = course.main(*arguments)
        assert result.status == 2 and result.err == (
            "coursebuild: `features/mine.py` is code that you have not run in this form; "
            "look at what it does, and run `coursebuild check`\n"
        )
        assert not (home / "owned").exists(), arguments
    assert course.main("check").status == 0
    (home / "owned").unlink()
    assert course.main("explain", "1.1").status == 0
    course.write("features/mine.py", course.text("features/mine.py") + "#")
    assert course.main("explain", "1.1").status == 2


@pytest.mark.site
def test_folder_that_is_opened_in_an_editor_runs_nothing_until_it_is_saved(
    make: Make, home: Path
) -> None:
    mark = home / "owned"
    course = make("## A\n\n" + block("a.py", TOUCH.format(str(mark)) + "print(1)", "2"))
    editor = Editor(course)
    editor.write(course.lesson(), course.text(course.lesson()) + "\nLesson 9.9 is not there.\n")
    editor.until(course.lesson(), "link-lesson")
    editor.write(course.lesson(), course.text(course.lesson()))
    editor.until(course.lesson())
    assert not mark.exists()
    editor.save(course.lesson())
    editor.until(course.lesson(), "script-writes", "output-drift")
    assert mark.exists()
    assert editor.close() == 0


@pytest.mark.site
def test_pipes_and_holes_in_ones_own_store_are_not_read(make: Make) -> None:
    """As an archive may hold them, with the mark of a store that its user once gave away."""
    course = make(GOOD)
    assert course.main("check").status == 0
    for spoil in (os.mkfifo, make_holes):
        for folder, _, names in os.walk(course.root / ".coursebuild"):
            for path in (Path(folder, name) for name in names if name != "owner"):
                path.unlink()
                spoil(path)
        assert course.main("check").status == 0


def make_holes(path: Path) -> None:
    """Make a file that is larger than all memory, and takes no room."""
    with path.open("wb") as file:
        file.truncate(1 << 40)


@pytest.mark.site
def test_published_site_is_the_one_of_a_course_without_a_store(make: Make, home: Path) -> None:
    """Not one byte of what another machine has made is published."""
    foreign, root = make(GOOD), home / "course"
    assert foreign.main("build", "-q").status == 0
    shutil.copytree(foreign.root, root, ignore=shutil.ignore_patterns(".coursebuild", "public"))
    course = Folder(root)
    course.tmp.mkdir()
    assert course.main("build", "-q").status == 0
    site = course.tree("public")
    shutil.rmtree(root / "public")
    store = root / ".coursebuild"
    for entry in [path for path in store.glob("*/**/*") if path.is_file()]:
        key = b"of a stranger"
        name = entry.relative_to(store).as_posix()
        entry.write_bytes(seal(name, b"foreign" + entry.read_bytes()[40:], key))
    for mark in (True, False):
        if not mark:
            (store / "owner").write_bytes(os.urandom(32))
        result = course.main("build", "-q")
        assert (result.status, result.err) == (0, "")
        assert course.tree("public") == site
        shutil.rmtree(root / "public")
