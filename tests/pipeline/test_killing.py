"""Killed at any moment, a command leaves the last good site and the author's files whole."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from support.scratch_course import GOOD, Folder, block, ended, wait_until_alone

Make = Callable[..., Folder]

ROOT = Path(__file__).parents[2]
DIED = 137
STRUCTURAL = ("rename", "replace", "link", "exchange", "fsync")
"""Calls that are all tried; of the others, of which there are many alike, some."""

OLD = "## One\n\n" + block("kept.py", "print(1)", "1") + block("gone.py", "print(2)", "2")
NEW = OLD.replace("gone.py", "new.py").replace("print(1)", "print(1)  # edited") + "Edited.\n"


class Mortals:
    """Commands that die at a given call; see `support/killed_commands.py`."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process

    def run(self, folder: Folder, *arguments: str, fatal: int = 0) -> tuple[int, list[str]]:
        """The exit status, and the names of the calls where it got through."""
        assert self.process.stdin is not None and self.process.stdout is not None
        request = {"folder": str(folder.root), "arguments": arguments, "fatal": fatal}
        print(json.dumps(request), file=self.process.stdin, flush=True)
        reply = json.loads(self.process.stdout.readline())
        return reply["status"], reply["calls"]


@pytest.fixture(scope="module")
def mortals(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mortals]:
    folder = Folder(tmp_path_factory.mktemp("mortals"))
    folder.tmp.mkdir()
    process = subprocess.Popen(
        [sys.executable, str(ROOT / "tests/support/killed_commands.py")],
        env=folder.environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        yield Mortals(process)
        process.kill()


def points(calls: list[str], others: int) -> list[int]:
    """Which calls to die at, counted from 1: all that are structural, and some others."""
    structural = [n for n, name in enumerate(calls, 1) if name in STRUCTURAL]
    rest = [n for n, name in enumerate(calls, 1) if name not in STRUCTURAL]
    step = max(1, len(rest) // others)
    return sorted({*structural, *rest[::step], 1, len(calls)})


def again(template: Folder, folder: Folder) -> None:
    """Begin as the template is."""
    for root in (folder.root, folder.tmp):
        shutil.rmtree(root, ignore_errors=True)
    shutil.copytree(template.root, folder.root, symlinks=True)
    folder.tmp.mkdir()


def leftovers(folder: Folder) -> list[str]:
    """What no command leaves where it got through."""
    everything = [path.relative_to(folder.root).as_posix() for path in folder.root.rglob("*")]
    return [
        name
        for name in everything
        if "tmp" in name or ".new-" in name or ".old-" in name or "__pycache__" in name
    ]


def test_a_build_killed_at_its_calls(make: Make, mortals: Mortals, tmp_path: Path) -> None:
    template = make(OLD)
    assert mortals.run(template, "build", "-q")[0] == 0
    old = template.tree()
    template.write(template.lesson(), NEW)
    folder = Folder(tmp_path / "mortal")
    again(template, folder)
    status, calls = mortals.run(folder, "build", "-q")
    assert status == 0
    new = folder.tree()
    changed = {path for path in {*old} ^ {*new} if not path.startswith("public/assets/search/")}
    assert changed == {
        f"{place}examples/{name}.py" for place in ("", "public/") for name in ("gone", "new")
    }
    assert {"exchange", "replace", "link", "write", "unlink", "rmdir"} <= {*calls}
    for fatal in points(calls, others=6):
        again(template, folder)
        assert mortals.run(folder, "build", "-q", fatal=fatal)[0] == DIED
        wait_until_alone(folder)
        left = folder.tree()
        where = f"killed before call {fatal}, {calls[fatal - 1]}"
        assert part(left, "content/") == part(new, "content/"), where
        assert part(left, "public/") in (part(old, "public/"), part(new, "public/")), where
        for name, data in part(left, "examples/").items():
            if name.endswith(".py"):
                assert data in (b"", old.get(name), new.get(name)) or "tmp" in name, where
        assert mortals.run(folder, "build", "-q")[0] == 0, where
        assert folder.tree() == new, where
        assert leftovers(folder) == [], where


def part(tree: dict[str, bytes], top: str) -> dict[str, bytes]:
    return {name: data for name, data in tree.items() if name.startswith(top)}


def test_the_first_build_killed_at_its_calls(make: Make, mortals: Mortals, tmp_path: Path) -> None:
    template, folder = make(OLD), Folder(tmp_path / "mortal")
    again(template, folder)
    status, calls = mortals.run(folder, "build", "-q")
    assert status == 0
    new = folder.tree()
    for fatal in points(calls, others=4)[::2]:
        again(template, folder)
        assert mortals.run(folder, "build", "-q", fatal=fatal)[0] == DIED
        wait_until_alone(folder)
        assert part(folder.tree(), "public/") in ({}, part(new, "public/")), calls[fatal - 1]
        assert mortals.run(folder, "build", "-q")[0] == 0
        assert (folder.tree(), leftovers(folder)) == (new, [])


@pytest.mark.parametrize("then", ["update", "build"])
def test_an_update_killed_at_its_calls(
    make: Make, mortals: Mortals, tmp_path: Path, then: str
) -> None:
    stale = "## One\n\n" + block("a.py", "print(1)", "OLD") + block("b.py", "print(2)", "OLD")
    template = make(stale, GOOD.replace("hello 3.14159\n", "OLD\n"))
    folder = Folder(tmp_path / "mortal")
    again(template, folder)
    status, calls = mortals.run(folder, "update", "-q")
    assert status == 0
    old, new = part(template.tree(), "content/"), part(folder.tree(), "content/")
    assert {"replace", "write", "fsync"} <= {*calls}
    for fatal in points(calls, others=8)[:: 1 if then == "update" else 3]:
        again(template, folder)
        assert mortals.run(folder, "update", "-q", fatal=fatal)[0] == DIED
        wait_until_alone(folder)
        where = f"killed before call {fatal}, {calls[fatal - 1]}"
        left = part(folder.tree(), "content/")
        for name in old:
            assert left[name] in (old[name], new[name]), where
        status, _ = mortals.run(folder, then, "-q")
        assert leftovers(folder) == [], where
        if then == "update":
            assert status == 0, where
            assert part(folder.tree(), "content/") == new, where


def test_adopting_killed_at_its_calls(make: Make, mortals: Mortals, tmp_path: Path) -> None:
    template, folder = make(OLD), Folder(tmp_path / "mortal")
    assert mortals.run(template, "extract", "-q")[0] == 0
    edited = b"print(1)\r\n# by hand\r\n"
    template.write("examples/kept.py", edited)
    again(template, folder)
    status, calls = mortals.run(folder, "extract", "--adopt", "-q")
    assert status == 0
    new = folder.tree()
    lesson = folder.lesson()
    assert b"# by hand" in new[lesson]
    for fatal in points(calls, others=8):
        again(template, folder)
        assert mortals.run(folder, "extract", "--adopt", "-q", fatal=fatal)[0] == DIED
        where = f"killed before call {fatal}, {calls[fatal - 1]}"
        left = folder.tree()
        assert left[lesson] in (OLD.encode(), new[lesson]), where
        assert left[lesson] == new[lesson] or left["examples/kept.py"] == edited, where
        assert mortals.run(folder, "extract", "--adopt", "-q")[0] == 0, where
        assert (folder.tree(), leftovers(folder)) == (new, []), where


@pytest.mark.parametrize("command", ["build", "update"])
def test_the_real_command_killed_at_any_time(make: Make, command: str) -> None:
    stale = OLD.replace("\n1\n", "\nOLD\n") if command == "update" else OLD
    folder = make(stale)
    began = time.monotonic()
    assert folder.run(command, "-q").status == 0
    seconds = time.monotonic() - began
    old, good = stale.encode(), folder.read(folder.lesson())
    assert folder.main("build", "-q").status == 0
    site = part(folder.tree(), "public/")
    for eighth in range(1, 9):
        folder.write(folder.lesson(), old)
        with ended(folder.start(command, "-q", stdout=subprocess.DEVNULL)) as process:
            time.sleep(seconds * eighth / 8)
            os.killpg(process.pid, signal.SIGKILL)
        wait_until_alone(folder)
        assert folder.read(folder.lesson()) in (old, good)
        assert part(folder.tree(), "public/") == site
    assert folder.main("update", "-q").status == 0
    assert folder.main("build", "-q").status == 0
    assert folder.read(folder.lesson()) == good
    assert part(folder.tree(), "public/") == site
    assert leftovers(folder) == []
