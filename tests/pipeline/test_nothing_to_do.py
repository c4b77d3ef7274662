"""A run with nothing to do: it loads next to nothing and says the same."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable

import pytest
from coursekit import FIRST, ROOT, Folder, block

Make = Callable[..., Folder]


def aged(folder: Folder) -> None:
    """Let all that was written be long ago: what was saved this very moment leaves no stamp."""
    for path in folder.root.rglob("*"):
        if not path.is_symlink() and ".coursebuild" not in path.parts:
            os.utime(path, (1_000_000_000.1234567, 1_000_000_000.1234567))


def test_a_run_with_nothing_to_do_loads_next_to_nothing_and_says_the_same(make: Make) -> None:
    folder = make(FIRST)
    aged(folder)
    code = (
        "import sys; from coursebuild.cli import main; status = main(sys.argv[1:]);"
        "print(sorted(m for m in sys.modules if m.startswith('coursebuild.')), file=sys.stderr);"
        "sys.exit(status)"
    )
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", code, "-C", str(folder.root), "check"],
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        assert done.returncode == 0
    assert done.stdout == (
        "ok       examples/one.py  cached\n\n"
        "nothing has changed since the last check\n\n"
        "1 lesson, 0 scripts run, 1 cached: everything holds\n"
    )
    assert done.stderr == (
        "['coursebuild.cli', 'coursebuild.cli.arguments', 'coursebuild.cli.commands', "
        "'coursebuild.cli.output', 'coursebuild.effects', 'coursebuild.effects.errors', "
        "'coursebuild.effects.place', 'coursebuild.effects.stamp']\n"
    )


@pytest.mark.parametrize("wrong", [["--cache-size", "5q"], ["--cache", ""], ["--executor", "x"]])
def test_wrong_usage_is_told_also_where_there_is_nothing_to_do(
    make: Make, wrong: list[str]
) -> None:
    folder = make(FIRST)
    aged(folder)
    assert folder.main("check").status == 0
    assert folder.main("check", *wrong).status == 2


def test_what_changed_is_looked_at_again(make: Make) -> None:
    folder = make(FIRST)
    aged(folder)
    assert folder.main("check").status == 0
    folder.write(folder.lesson(), "## One\n\n" + block("one.py", "print(2)", "1"))
    assert folder.main("check").status == 1
