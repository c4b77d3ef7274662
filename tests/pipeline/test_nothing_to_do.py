"""A run with nothing to do: it loads next to nothing and says the same."""

from __future__ import annotations

import os

import pytest

from support.run_code import run_code
from support.scratch_course import FIRST, Folder, Make

pytestmark = pytest.mark.site


def aged(folder: Folder) -> None:
    """Make all files look old: files that were saved just now are never taken as unchanged."""
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
        result = run_code(code, "-C", folder.root, "check")
        assert result.returncode == 0
    assert result.stdout == (
        "ok       examples/one.py  cached\n\n"
        "nothing has changed since the last check\n\n"
        "1 lesson, 0 scripts run, 1 cached: everything holds\n"
    )
    assert result.stderr == "[]\n"


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
        result = run_code(code, "-C", folder.root, "build", "-q")
        assert result.returncode == 0
        return result.stderr

    loaded_after(b"\nIt is $a^2 + 1$.\n")
    assert loaded_after(b"\nIt is $a^2 + 1$.\n") == "[]\n"
    assert "coursebuild.core.run.v8" in loaded_after(b"\nIt is $a^2 + 2$.\n")


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


def test_working_directory_that_is_gone_gives_2(make: Make) -> None:
    folder = make(FIRST)
    folder_gone = folder.root / "gone"
    folder_gone.mkdir()
    code = (
        "import os, sys; from coursebuild.cli import main; os.rmdir(os.getcwd()); sys.exit(main())"
    )
    result = run_code(code, "check", cwd=folder_gone)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.endswith("the working directory is not there any more\n")
    assert "Traceback" not in result.stderr
