"""A run with nothing to do: it loads next to nothing and says the same."""

from __future__ import annotations

import os

import pytest

from support.run_code import run_code
from support.scratch_course import FIRST, Folder, Make

pytestmark = pytest.mark.site


def aged(folder: Folder) -> None:
    """Let all that was written be long ago: of what was saved this very moment nothing is known."""
    for path in folder.root.rglob("*"):
        if not path.is_symlink() and ".coursebuild" not in path.parts:
            os.utime(path, (1_000_000_000.1234567, 1_000_000_000.1234567))


def test_a_run_with_nothing_to_do_loads_next_to_nothing_and_says_the_same(make: Make) -> None:
    folder = make(FIRST)
    aged(folder)
    code = (
        "import sys; from coursebuild.cli import main; status = main(sys.argv[1:]);"
        "heavy = {'argparse', 'msgspec', 'coursebuild.core.model', 'coursebuild.pipeline'};"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr); sys.exit(status)"
    )
    for _ in range(2):
        done = run_code(code, "-C", folder.root, "check")
        assert done.returncode == 0
    assert done.stdout == (
        "ok       examples/one.py  cached\n\n"
        "nothing has changed since the last check\n\n"
        "1 lesson, 0 scripts run, 1 cached: everything holds\n"
    )
    assert done.stderr == "[]\n"


def test_an_edit_loads_nothing_that_few_pages_need(make: Make) -> None:
    """A formula that the lesson had before is not typeset again."""
    folder = make(FIRST)
    code = (
        "import sys; from coursebuild.cli import main; status = main(sys.argv[1:]);"
        "rare = {'mujoco', 'numpy', 'fontTools', 'coursebuild.core.run.v8'};"
        "print(sorted(rare & set(sys.modules)), file=sys.stderr); sys.exit(status)"
    )

    def loaded_after(edit: bytes) -> str:
        folder.write(folder.lesson(), folder.read(folder.lesson()) + edit)
        done = run_code(code, "-C", folder.root, "build", "-q")
        assert done.returncode == 0
        return done.stderr

    loaded_after(b"\nIt is $a^2 + 1$.\n")
    assert loaded_after(b"\nIt is $a^2 + 1$.\n") == "[]\n"
    assert "coursebuild.core.run.v8" in loaded_after(b"\nIt is $a^2 + 2$.\n")


def test_nothing_changed_counts_for_the_same_command_only(make: Make) -> None:
    """And not by how it is said which course is meant."""
    folder = make(FIRST)
    (folder.root / "data").mkdir()
    aged(folder)
    told = "nothing has changed"
    assert told not in folder.main("check").out
    assert told in folder.main("check").out
    assert told in folder.main("-C", str(folder.root), "check", cwd=folder.root.parent).out
    assert told in folder.main("check", cwd=folder.root / "content").out
    assert told in folder.main("-C", "", "check").out
    assert "map-missing" in folder.main("-C", "", "check", cwd=folder.root / "content").out
    assert told not in folder.main("check", "--no-cache").out
    assert told in folder.main("check").out
    for other in (["check", "-j", "1"], ["check", folder.lesson()]):
        assert told not in folder.main(*other).out
    for elsewhere in (["-C", str(folder.root / "content"), "check"], [], ["-C"]):
        assert told not in folder.main(*elsewhere).out
    for wrong in (["--cache-size", "5q"], ["--cache", ""], ["--no-such"]):
        assert folder.main("check", *wrong).status == 2
    # A path from another folder is another path.
    command = ("check", f"../{folder.lesson().removeprefix('content/')}")
    inner = folder.root / "content" / "lessons"
    for known in (False, True):
        done = folder.main(*command, cwd=inner)
        assert (done.status, told in done.out) == (0, known)
    done = folder.main(*command, cwd=folder.root / "data")
    assert (done.status, done.out) == (2, "")
    assert "no lesson or page is called" in done.err
    folder.replace(folder.lesson(), "print(1)", "print(2)")
    assert folder.main("check").status == 1


def test_working_directory_that_is_gone_gives_2(make: Make) -> None:
    folder = make(FIRST)
    gone = folder.root / "gone"
    gone.mkdir()
    code = (
        "import os, sys; from coursebuild.cli import main; os.rmdir(os.getcwd()); sys.exit(main())"
    )
    done = run_code(code, "check", cwd=gone)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.endswith("the working directory is not there any more\n")
    assert "Traceback" not in done.stderr
