"""Killed at any moment, a command leaves the last good site and the author's files whole."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from support.mortal_commands import Mortals, mortal_commands
from support.scratch_course import GOOD, Folder, block, ended, wait_until_alone

pytestmark = pytest.mark.site

Make = Callable[..., Folder]

STRUCTURAL = ("open", "mkdir", "link", "rename", "replace", "unlink", "rmdir", "exchange")
"""Calls that change what a folder holds."""

OLD = "## One\n\n" + block("kept.py", "print(1)", "1") + block("gone.py", "print(2)", "2")
NEW = OLD.replace("gone.py", "new.py").replace("print(1)", "print(1)  # edited") + "Edited.\n"


@pytest.fixture(scope="module")
def module_mortals(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mortals]:
    folder = Folder(tmp_path_factory.mktemp("mortals"))
    with mortal_commands(folder) as mortals:
        yield mortals


@pytest.fixture(params=[True])
def mortals(module_mortals: Mortals, request: pytest.FixtureRequest) -> Mortals:
    module_mortals.exchanges = request.param
    return module_mortals


def points(calls: list[str]) -> list[int]:
    """Which calls to die at, counted from 1: the structural ones, and the first write by half.

    Of those that follow the same kind of call the last: there are rows of them.
    """
    structural = [number for number, name in enumerate(calls, 1) if name in STRUCTURAL]
    last: dict[tuple[str, str], int] = {}
    before = ""
    for number in structural:
        name = calls[number - 1]
        last[before, name] = number
        before = name
    return sorted({*last.values(), calls.index("write") + 1})


def again(template: Folder, folder: Folder) -> None:
    """Begin as the template is."""
    for root in (folder.root, folder.tmp):
        shutil.rmtree(root, ignore_errors=True)
    shutil.copytree(template.root, folder.root, symlinks=True)
    folder.tmp.mkdir()


def leftovers(folder: Folder) -> list[str]:
    """What no command leaves where it got through; half an entry of the memo goes later."""
    everything = [path.relative_to(folder.root).as_posix() for path in folder.root.rglob("*")]
    kept = ".coursebuild/published/"
    parts = ("tmp", ".new-", ".coursebuild-new", ".coursebuild-old", "__pycache__")
    return [
        name
        for name in everything
        if any(part in name for part in parts)
        and (name.startswith(kept) or not name.startswith(".coursebuild/"))
    ]


@pytest.mark.parametrize("mortals", [True, False], ids=["exchange", "two renames"], indirect=True)
def test_build_killed_at_any_call_leaves_old_or_new_site(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
    """Without an exchange there is none for an instant, and the next build puts the old one back.

    Where a lesson changes again before that, the build knows which scripts it had written.
    """
    template = make(NEW)
    assert mortals.run(template, "check", "-q")[0] == 0  # so that no script runs later on
    template.write(template.lesson(), OLD)
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
    swap = "exchange" if mortals.exchanges else "rename"
    assert {swap, "replace", "link", "write", "unlink"} <= {*calls}
    for number, fatal in enumerate(points(calls)):
        again(template, folder)
        mortals.die(folder, "build", "-q", fatal=fatal)
        left = folder.tree()
        where = f"killed before call {fatal}, {calls[fatal - 1]}"
        assert part(left, "content/") == part(new, "content/"), where
        site = part(left, "public/")
        if not site and not mortals.exchanges:
            aside = part(left, ".public.coursebuild-old/").items()
            site = {name.replace(".public.coursebuild-old", "public"): data for name, data in aside}
        assert site in (part(old, "public/"), part(new, "public/")), where
        for name, data in part(left, "examples/").items():
            if name.endswith(".py"):
                assert data in (b"", old.get(name), new.get(name)) or "tmp" in name, where
        if number % 4 == 3:
            folder.replace(folder.lesson(), "# edited", "# edited again")
            assert mortals.run(folder, "build", "-q")[0] == 0, where
            folder.replace(folder.lesson(), "# edited again", "# edited")
        assert mortals.run(folder, "build", "-q")[0] == 0, where
        assert folder.tree() == new, where
        assert leftovers(folder) == [], where


@pytest.mark.parametrize("fault", ["files", pytest.param("memory", marks=pytest.mark.slow)])
def test_build_without_files_or_memory_says_so_and_leaves_old_or_new_site(
    make: Make, mortals: Mortals, tmp_path: Path, fault: str
) -> None:
    """From any call on no more can be opened or started; the next build is a whole one.

    asyncio prints an exception itself where it gets no sockets.
    """
    template = make(OLD + "$a_{23}$\n")
    assert mortals.run(template, "build", "-q")[0] == 0
    old = template.tree()
    template.write(template.lesson(), NEW + "$a_{24}$\n")
    folder = Folder(tmp_path / "mortal")
    again(template, folder)
    status, calls = mortals.run(folder, "build", "-q", fault=fault)
    assert status == 0
    new = folder.tree()
    places = dict(zip(reversed(calls), range(len(calls), 0, -1), strict=True))
    assert len(places) > 30
    told = ("too many open files", "cannot allocate memory", "not enough memory", "new thread")
    for where, fatal in places.items():
        again(template, folder)
        status, _ = mortals.run(folder, "build", "-q", fault=fault, fatal=fatal)
        assert status in (0, 1), where
        assert status == 0 or any(words in mortals.said.lower() for words in told), where
        assert "Traceback" not in mortals.said or where.startswith("socket.__new__@core/run/v8"), (
            where,
            mortals.said,
        )
        left = folder.tree()
        assert part(left, "content/") == part(new, "content/"), where
        assert part(left, "public/") in (part(old, "public/"), part(new, "public/")), where
        assert mortals.run(folder, "build", "-q")[0] == 0, where
        assert (folder.tree(), leftovers(folder)) == (new, []), where


def part(tree: dict[str, bytes], top: str) -> dict[str, bytes]:
    return {name: data for name, data in tree.items() if name.startswith(top)}


def test_update_killed_at_any_call_leaves_old_or_new_lessons(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
    stale = "## One\n\n" + block("a.py", "print(1)", "OLD") + block("b.py", "print(2)", "OLD")
    template = make(stale, GOOD.replace("hello 3.14159\n", "OLD\n"))
    folder = Folder(tmp_path / "mortal")
    again(template, folder)
    status, calls = mortals.run(folder, "update", "-q")
    assert status == 0
    old, new = part(template.tree(), "content/"), part(folder.tree(), "content/")
    assert {"replace", "write", "fsync"} <= {*calls}
    for number, fatal in enumerate(points(calls)):
        again(template, folder)
        mortals.die(folder, "update", "-q", fatal=fatal)
        where = f"killed before call {fatal}, {calls[fatal - 1]}"
        left = part(folder.tree(), "content/")
        for name in old:
            assert left[name] in (old[name], new[name]), where
        if number % 3 == 0:  # a build clears up as well
            mortals.run(folder, "build", "-q")
            assert leftovers(folder) == [], where
        assert mortals.run(folder, "update", "-q")[0] == 0, where
        assert (part(folder.tree(), "content/"), leftovers(folder)) == (new, []), where


def test_rename_killed_at_any_call_changes_all_files_or_none(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
    """The next command puts back what had been changed."""
    template = make(OLD, "## Two\n\nSee [one](lesson:1.1).\n")
    rename, folder = ("rename", "1.1", "1.7"), Folder(tmp_path / "mortal")
    again(template, folder)
    status, calls = mortals.run(folder, *rename)
    assert status == 0
    old, new = part(template.tree(), "content/"), part(folder.tree(), "content/")
    assert len({*old.items()} ^ {*new.items()}) == 6  # the map, a lesson and its name, a link
    for fatal in points(calls):
        again(template, folder)
        mortals.die(folder, *rename, fatal=fatal)
        where = f"killed before call {fatal}, {calls[fatal - 1]}"
        assert mortals.run(folder, "check", "-q")[0] == 0, where
        left = part(folder.tree(), "content/")
        assert left in (old, new), where
        assert left == new or mortals.run(folder, *rename)[0] == 0, where
        assert (part(folder.tree(), "content/"), leftovers(folder)) == (new, []), where


def test_adopting_killed_at_any_call_leaves_old_or_new_lesson(
    make: Make, mortals: Mortals, tmp_path: Path
) -> None:
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
    for fatal in points(calls):
        again(template, folder)
        mortals.die(folder, "extract", "--adopt", "-q", fatal=fatal)
        where = f"killed before call {fatal}, {calls[fatal - 1]}"
        left = folder.tree()
        assert left[lesson] in (OLD.encode(), new[lesson]), where
        assert left[lesson] == new[lesson] or left["examples/kept.py"] == edited, where
        assert mortals.run(folder, "extract", "--adopt", "-q")[0] == 0, where
        assert (folder.tree(), leftovers(folder)) == (new, []), where


@pytest.mark.parametrize("command", ["build", "update"])
def test_command_killed_at_any_stage_leaves_lesson_and_site_whole(
    make: Make, tmp_path: Path, command: str
) -> None:
    """The command as a process, with all that it started."""
    template = make(OLD.replace("\n1\n", "\nOLD\n") if command == "update" else OLD)
    folder = Folder(tmp_path / "mortal")
    again(template, folder)
    done = folder.run(command)
    assert done.status == 0
    stages = [line.partition(" after ")[0] for line in done.err.splitlines()]
    assert "running scripts (2)" in stages
    good = folder.tree()
    for stage in stages:
        again(template, folder)
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        with ended(folder.start(command, **pipes)) as process:
            assert process.stderr is not None
            assert any(line.decode().startswith(stage) for line in process.stderr), stage
            os.killpg(process.pid, signal.SIGKILL)
        wait_until_alone(folder)
        left, lesson = folder.tree(), folder.lesson()
        assert left[lesson] in (template.read(lesson), good[lesson]), stage
        assert part(left, "public/") in ({}, part(good, "public/")), stage
        assert folder.main(command, "-q").status == 0, stage
        assert (folder.tree(), leftovers(folder)) == (good, []), stage
