"""A run with nothing to do loads next to nothing, says the same, and never misses a change."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from coursebuild.cli.unchanged import Watcher, unchanged
from support.run_code import program, run_code
from support.scratch_course import FIRST, Folder, Make

COMMAND = ("build", "public")
ALL_IS_WELL = "all is well\n"
LESSON, MODEL = "content/lessons/1.1-a.md", "models/m.xml"


def age(*paths: Path, seconds: float = 3600, coarse: bool = False) -> None:
    """Set the times of files back, to whole milliseconds if the clock is to look coarse."""
    for path in paths:
        if not path.is_symlink():
            then = time.time_ns() - int(seconds * 1e9)
            os.utime(path, ns=(then, then - then % 1_000_000 + (0 if coarse else 123_457)))


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    root = tmp_path / "course"
    outputs = ("public/index.html", "examples/a.py")
    for path in (LESSON, "content/course.toml", MODEL, "data/d.csv", *outputs):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(path)
    (tmp_path / "site-packages/numpy-2.0.dist-info").mkdir(parents=True)
    monkeypatch.setattr(sys, "path", [str(tmp_path / "site-packages")])
    age(root, *root.rglob("*"))
    return root


def keep(root: Path, message: str = ALL_IS_WELL, during: str = "") -> bool:
    """Whether a command could record the state when its work was done, and something changed."""
    watcher = Watcher(str(root), COMMAND)
    change(root, during)
    return watcher.keep(message, ["data/d.csv", "data/not-there.csv"], ["public", "examples"])


def last_message(root: Path) -> str | None:
    return unchanged(str(root), COMMAND)


def test_the_last_message_is_repeated(root: Path) -> None:
    assert last_message(root) is None
    for text in (ALL_IS_WELL, "", "é\n\nwarning: x\n", "\n\n\n", "\udc80\n"):
        assert keep(root, text)
        assert [last_message(root), last_message(root)] == [text, text]


REWRITTEN_PATHS = (LESSON, MODEL, "data/d.csv", "public/index.html", "examples/a.py")
CHANGES = (
    *REWRITTEN_PATHS,
    *("touched", "a file more", "a folder more", "removed", "renamed", "replaced"),
    *("what a script looked for", "what a script read", "the time put back"),
    *("a link in its place", "a folder in its place", "a package", "the site", "in the site"),
)


def change(root: Path, kind: str) -> None:
    model = root / MODEL
    times = model.stat().st_atime_ns, model.stat().st_mtime_ns
    match kind:
        case path if path in REWRITTEN_PATHS:
            (root / path).write_bytes((root / path).read_bytes()[:-1] + b"!")  # as long as it was
        case "touched":
            os.utime(root / "content/course.toml")
        case "a file more":
            (root / "content/lessons/1.2-b.md").touch()
        case "a folder more":
            (root / "content/new").mkdir()
        case "removed":
            model.unlink()
        case "renamed":
            (root / LESSON).rename(root / "content/lessons/1.1-b.md")
        case "replaced":  # by another file of the same name, size and time
            model.with_name("new").write_bytes(model.read_bytes())
            os.utime(model.with_name("new"), ns=times)
            model.with_name("new").replace(model)
        case "what a script looked for":
            (root / "data/not-there.csv").touch()
        case "what a script read":
            (root / "data/d.csv").unlink()
        case "the time put back":  # the text changed, but not its length
            change(root, MODEL)
            os.utime(model, ns=times)
        case "a link in its place":
            model.rename(root.with_name("away.xml"))
            model.symlink_to(root.with_name("away.xml"))
        case "a folder in its place":
            (root / "examples/a.py").unlink()
            (root / "examples/a.py").mkdir()
        case "a package":
            package = root.parent / "site-packages/numpy-2.0.dist-info"
            package.rename(package.with_name("numpy-2.1.dist-info"))
        case "the site":
            (root / "public").rename(root / "elsewhere")
        case "in the site":
            (root / "public/note.txt").touch()
        case _:
            assert kind == ""


@pytest.mark.parametrize("kind", CHANGES)
def test_any_change_is_seen(root: Path, kind: str) -> None:
    assert keep(root)
    change(root, kind)
    assert last_message(root) is None


def test_what_decides_which_code_runs_is_seen(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("MUJOCO_GL", "PYTHONPATH"):
        assert keep(root)
        monkeypatch.setenv(name, "/elsewhere")
        assert last_message(root) is None, name


def test_what_is_no_part_of_the_course_is_not_looked_at(root: Path) -> None:
    assert keep(root)
    for name in (".1.1-a.md.swp", "1.1-a.md~"):
        (root / "content/lessons" / name).touch()
    (root / "content/__pycache__").mkdir()
    (root / "README.md").touch()
    (root / ".git").mkdir()
    assert last_message(root) == ALL_IS_WELL


@pytest.mark.parametrize("kind", ["a file more", "removed", MODEL, "data/d.csv"])
def test_what_changes_during_the_work_is_not_kept(root: Path, kind: str) -> None:
    assert not keep(root, during=kind)
    assert last_message(root) is None


def test_what_depends_on_a_name_of_two_lines_is_not_kept(root: Path) -> None:
    assert not Watcher(str(root), COMMAND).keep(ALL_IS_WELL, ["data/a\nb"], [])
    assert Watcher(str(root), COMMAND).keep(ALL_IS_WELL, ["data/a b"], [])


def test_a_store_that_is_warned_of_is_warned_of_again(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COURSEBUILD_STORE_KEY", "of this test")
    assert keep(root)
    user = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: user)
    assert not keep(root)


def test_what_the_work_writes_may_be_new(root: Path) -> None:
    assert keep(root, during="public/index.html")
    assert last_message(root) == ALL_IS_WELL


def test_a_file_whose_time_says_nothing_is_not_kept(root: Path) -> None:
    """Changed just before the work began, or where the clock is coarse, or in the future."""
    cases = (1, False, True), (-10, False, False), (1, True, False), (3, True, True)
    for seconds, coarse, is_kept in cases:
        age(root / MODEL, seconds=seconds, coarse=coarse)
        assert keep(root) is is_kept, (seconds, coarse)


def test_a_link_to_a_file_is_followed_and_one_to_a_folder_is_not_kept(root: Path) -> None:
    (root / "content/linked.csv").symlink_to(root / "data/other.csv")
    for _ in range(2):
        assert keep(root)  # also where it leads nowhere
        (root / "data/other.csv").write_text("1")
        assert last_message(root) is None
        age(root / "data/other.csv")
    (root / "content/linked").symlink_to(root / "data")
    assert not keep(root)


def test_a_damaged_note_is_not_believed(root: Path) -> None:
    assert keep(root)
    [file] = (root / ".coursebuild/unchanged").iterdir()
    whole = file.read_bytes()
    for position in range(0, len(whole), 7):
        for damaged in (
            whole[:position] + bytes((whole[position] ^ 4,)) + whole[position + 1 :],
            whole[:position],
        ):
            file.write_bytes(damaged)
            assert last_message(root) is None, position


def test_a_note_that_cannot_be_written_costs_only_time(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", "/dev/null")
    assert not keep(root)
    assert last_message(root) is None


def test_looking_imports_next_to_nothing() -> None:
    process = run_code(program("imports_of_looking"))
    assert process.stdout.splitlines() == [
        "['coursebuild.cli', 'coursebuild.cli.unchanged', 'coursebuild.core', "
        "'coursebuild.core.files', 'coursebuild.core.files.course_root', "
        "'coursebuild.core.files.trust', 'coursebuild.output']",
        "[]",
    ]


def aged(folder: Folder) -> None:
    """Make all files look old: files that were saved just now are never taken as unchanged."""
    for path in folder.root.rglob("*"):
        if not path.is_symlink() and ".coursebuild" not in path.parts:
            os.utime(path, (1_000_000_000.1234567, 1_000_000_000.1234567))


@pytest.mark.site
def test_a_run_with_nothing_to_do_loads_next_to_nothing_and_says_the_same(make: Make) -> None:
    folder = make(FIRST)
    aged(folder)
    heavy = "argparse msgspec coursebuild.core.model coursebuild.pipeline"
    for _ in range(2):
        result = run_code(program("imports_of_a_command"), heavy, "-C", folder.root, "check")
        assert result.returncode == 0
    assert result.stdout == (
        "ok       examples/one.py  cached\n\n"
        "nothing has changed since the last check\n\n"
        "1 lesson, 0 scripts run, 1 cached: everything holds\n"
    )
    assert result.stderr == "[]\n"


@pytest.mark.site
def test_an_edit_loads_nothing_that_few_pages_need(make: Make) -> None:
    """A formula that the lesson had before is not typeset again."""
    folder = make(FIRST)
    rare = "mujoco numpy fontTools coursebuild.core.run.typesetting"

    def loaded_after(edit: bytes) -> str:
        folder.write(folder.lesson(), folder.read(folder.lesson()) + edit)
        code = program("imports_of_a_command")
        result = run_code(code, rare, "-C", folder.root, "build", "-q")
        assert result.returncode == 0
        return result.stderr

    loaded_after(b"\nIt is $a^2 + 1$.\n")
    assert loaded_after(b"\nIt is $a^2 + 1$.\n") == "[]\n"
    assert "coursebuild.core.run.typesetting" in loaded_after(b"\nIt is $a^2 + 2$.\n")


@pytest.mark.site
def test_nothing_changed_counts_for_the_same_command_only(make: Make) -> None:
    """However the course is named."""
    folder = make(FIRST)
    (folder.root / "data").mkdir()
    aged(folder)
    remark = "nothing has changed"
    assert remark not in folder.main("check").out
    assert remark in folder.main("check").out
    assert remark in folder.main("-C", str(folder.root), "check", cwd=folder.root.parent).out
    assert remark in folder.main("check", cwd=folder.root / "content").out
    assert remark in folder.main("-C", "", "check").out
    assert "map-missing" in folder.main("-C", "", "check", cwd=folder.root / "content").out
    assert remark not in folder.main("check", "--no-cache").out
    assert remark in folder.main("check").out
    for arguments in (["check", "-j", "1"], ["check", folder.lesson()]):
        assert remark not in folder.main(*arguments).out
    for elsewhere in (["-C", str(folder.root / "content"), "check"], [], ["-C"]):
        assert remark not in folder.main(*elsewhere).out
    for bad_arguments in (["--cache-size", "5q"], ["--cache", ""], ["--no-such"]):
        assert folder.main("check", *bad_arguments).status == 2
    # A path from another folder is another path.
    command = ("check", f"../{folder.lesson().removeprefix('content/')}")
    inner = folder.root / "content" / "lessons"
    for is_known in (False, True):
        result = folder.main(*command, cwd=inner)
        assert (result.status, remark in result.out) == (0, is_known)
    result = folder.main(*command, cwd=folder.root / "data")
    assert (result.status, result.out) == (2, "")
    assert "no lesson or page is called" in result.err
    folder.replace(folder.lesson(), "print(1)", "print(2)")
    assert folder.main("check").status == 1


@pytest.mark.site
def test_working_directory_that_is_gone_gives_2(make: Make) -> None:
    folder = make(FIRST)
    folder_gone = folder.root / "gone"
    folder_gone.mkdir()
    code = (
        "import os, sys; from coursebuild.cli import main; os.rmdir(os.getcwd()); sys.exit(main())"
    )
    result = run_code(code, "check", cwd=folder_gone)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.endswith("the working directory no longer exists\n")
    assert "Traceback" not in result.stderr
