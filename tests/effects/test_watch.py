"""Watching a course: both ways of it tell the same."""

from __future__ import annotations

import gc
import os
import shutil
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import watchfiles

from coursebuild.effects import watch_inotify
from coursebuild.effects.errors import EffectError
from coursebuild.effects.watch import Watcher, watcher
from coursebuild.effects.watch_files import FilesWatcher
from coursebuild.effects.watch_inotify import InotifyWatcher
from support.runners import wait_until

pytestmark = pytest.mark.site
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="inotify is Linux's")
WAYS = [pytest.param(InotifyWatcher, marks=LINUX), FilesWatcher]
LESSON = "content/lessons/1.1-one.md"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    for path in (LESSON, "content/lessons/1.2-two.md", "docs/guide.md", "docs/other.md", "own.md"):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(path)
    return root


@pytest.fixture(params=WAYS)
def saves(request: pytest.FixtureRequest, root: Path) -> Iterator[Watcher]:
    found: Watcher = request.param(root)
    found.watch_also(frozenset({"docs/guide.md", "own.md", LESSON}))
    found.start()
    found.wait()
    yield found
    found.stop()
    assert found.stopped


def told(saves: Watcher, wanted: set[str], seconds: float = 120.0) -> set[str]:
    """What is told of until all that is wanted was."""
    found: set[str] = set()
    until = time.monotonic() + seconds
    while not found >= wanted:
        assert time.monotonic() < until, f"{wanted - found} is missing in {found}"
        found |= saves.get(0.2)
    while more := saves.get(0.1):
        found |= more
    return found


def told_of_a_save(root: Path, saves: Watcher, path: str) -> None:
    """The portable one begins with what is in a new folder when it gets to it."""
    until = time.monotonic() + 120
    found: frozenset[str] = frozenset()
    while path not in found:
        assert time.monotonic() < until
        if not found or isinstance(saves, FilesWatcher):
            (root / path).write_text("more")
        found |= saves.get(1.0)


def append(path: Path) -> None:
    with path.open("a") as file:
        file.write("x")


CHANGES: dict[str, Callable[[Path], object]] = {
    "written": lambda path: path.write_text("new"),
    "appended": append,
    "gone": lambda path: path.unlink(),
    "moved": lambda path: path.rename(path.with_name("other.md")),
    "replaced": lambda path: Path(shutil.copy(path, f"{path}~")).replace(path),
    "closed to others": lambda path: path.chmod(0o400),
    "emptied": lambda path: os.truncate(path, 0),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("path", [LESSON, "docs/guide.md", "own.md"])
def test_every_change_is_told_of(root: Path, saves: Watcher, path: str, change: str) -> None:
    CHANGES[change](root / path)
    found = told(saves, {path})
    moved = (
        {str(Path(path).with_name("other.md"))} if path == LESSON and change == "moved" else {path}
    )
    assert found <= {path, *moved}


def test_what_is_not_of_the_course_is_not_told_of(root: Path, saves: Watcher) -> None:
    assert not saves.get(0.5)
    for path in (
        "content/lessons/.1.1-one.md.swp",
        "content/lessons/1.1-one.md~",
        "content/lessons/#1.1-one.md#",
        "content/lessons/4913",
        "content/.git/x.md",
        "mjcourse.md",
        "docs/other.md",
        "docs/.guide.md.swp",
        "examples/x.py",
    ):
        (root / path).parent.mkdir(exist_ok=True)
        (root / path).write_text("x")
    assert not saves.get(0.5)


def test_folders_that_are_made_later(root: Path, saves: Watcher) -> None:
    (root / "models/deep/deeper").mkdir(parents=True)
    (root / "models/deep/deeper/a.xml").write_text("<mujoco/>")
    (root / "content/pages/one").mkdir(parents=True)
    (root / "content/pages/one/a.md").write_text("x")
    assert told(saves, {"models"}) & {"content", "content/pages"}
    for path in ("models/deep/deeper/a.xml", "content/pages/one/a.md"):
        told_of_a_save(root, saves, path)


def test_folders_that_go_and_come_back(root: Path, saves: Watcher) -> None:
    shutil.rmtree(root / "content")
    told(saves, {"content"})
    (root / "content/lessons").mkdir(parents=True)
    (root / LESSON).write_text("again")
    told(saves, {"content"})
    told_of_a_save(root, saves, LESSON)


def test_another_folder_in_the_place_of_one(root: Path, saves: Watcher) -> None:
    shutil.copytree(root / "content", root / "new")
    (root / "content").rename(root / "old")
    (root / "new").rename(root / "content")
    told(saves, {"content"})
    told_of_a_save(root, saves, LESSON)


def test_another_folder_elsewhere_in_the_place_of_one(root: Path, saves: Watcher) -> None:
    shutil.copytree(root / "docs", root / "new")
    (root / "docs").rename(root / "old")
    (root / "new").rename(root / "docs")
    told(saves, {"docs/guide.md"})
    told_of_a_save(root, saves, "docs/guide.md")


def test_a_file_elsewhere_that_is_asked_for_later(root: Path, saves: Watcher) -> None:
    (root / "far").mkdir()
    saves.watch_also(frozenset({"docs/guide.md", "far/later.md"}))
    told_of_a_save(root, saves, "far/later.md")
    told_of_a_save(root, saves, "docs/guide.md")


def test_while_no_folder_changes_watching_is_not_begun_again(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever were saved between two beginnings would be missed."""
    began: Counter[bool] = Counter()
    looks: Counter[bool] = Counter()
    really = watchfiles.watch

    def watch(*paths: Path, recursive: bool, **options: Any) -> Iterator[set[Any]]:
        began[recursive] += 1
        for batch in really(*paths, recursive=recursive, **options):
            looks[recursive] += 1
            yield batch

    monkeypatch.setattr(watchfiles, "watch", watch)
    saves = FilesWatcher(root)
    saves.watch_also(frozenset({"docs/guide.md"}))
    saves.start()
    wait_until(lambda: min(looks[True], looks[False]) > 3, "four looks")
    saves.stop()
    assert began == {True: 1, False: 1}


@LINUX
class TestInotify:
    @pytest.fixture
    def linux(self, root: Path) -> InotifyWatcher:
        found = InotifyWatcher(root)
        found.start()
        return found

    def test_it_is_what_linux_has(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delenv("WATCHFILES_FORCE_POLLING", raising=False)
        assert isinstance(watcher(root), InotifyWatcher) != ("microsoft" in os.uname().release)
        monkeypatch.setenv("WATCHFILES_FORCE_POLLING", "1")
        assert isinstance(watcher(root), FilesWatcher)

    def test_a_file_is_told_of_when_it_is_closed(self, root: Path, linux: InotifyWatcher) -> None:
        def write() -> None:
            with (root / LESSON).open("w") as file:
                for _ in range(20):
                    file.write("x")
                    file.flush()
                    time.sleep(0.0002)

        thread = threading.Thread(target=write)
        thread.start()
        while not linux.get(1.0) or linux.writing:
            pass
        assert (root / LESSON).read_text() == 20 * "x"
        thread.join()

    def test_who_keeps_a_file_open_is_not_waited_for(
        self, root: Path, linux: InotifyWatcher
    ) -> None:
        with (root / LESSON).open("w") as file:
            file.write("x")
            file.flush()
            assert linux.get(600.0) == {LESSON}
            assert linux.writing
            assert not linux.get(0.05)
            assert not linux.writing  # nothing more was written
        assert linux.get(1.0) == {LESSON}  # it is closed

    def test_a_moved_folder(self, root: Path, linux: InotifyWatcher) -> None:
        (root / "content/lessons").rename(root / "content/others")
        assert told(linux, {"content/lessons"}) >= {"content/others", "content/others/1.1-one.md"}
        (root / "content/others/1.1-one.md").write_text("x")
        assert linux.get(1.0) == {"content/others/1.1-one.md"}
        (root / "content/others").rename(root / "away")
        assert linux.get(1.0) == {"content/others"}
        (root / "away/1.1-one.md").write_text("y")
        assert not linux.get(0.1)

    def test_a_folder_that_another_took_the_place_of(
        self, root: Path, linux: InotifyWatcher
    ) -> None:
        shutil.copytree(root / "content", root / "new")
        (root / "content").rename(root / "old")
        (root / "new").rename(root / "content")
        assert "content" in told(linux, {"content"})
        (root / LESSON).write_text("x")
        assert linux.get(1.0) == {LESSON}
        (root / "old/lessons/1.1-one.md").write_text("x")
        assert not linux.get(0.1)

    def test_links_to_folders(self, root: Path, linux: InotifyWatcher) -> None:
        (root / "far").mkdir()
        (root / "content/near").symlink_to(root / "far")
        (root / "content/loop").symlink_to(root / "content")
        told(linux, {"content/near", "content/loop"})
        (root / "far/a.svg").write_text("x")
        assert linux.get(1.0) == {"content/near/a.svg"}
        (root / LESSON).write_text("x")
        assert linux.get(1.0) == {LESSON}
        (root / "content/near").unlink()
        assert linux.get(1.0) == {"content/near"}
        (root / "far/a.svg").write_text("y")
        assert not linux.get(0.1)

    def test_more_than_the_kernel_keeps(
        self, root: Path, linux: InotifyWatcher, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(linux._kernel, "messages", lambda: [(-1, watch_inotify._OVERFLOW, "")])
        assert "content" in linux.get(1.0)
        (root / LESSON).write_text("x")
        assert linux.get(1.0) == {LESSON}

    def test_odd_names(self, root: Path, linux: InotifyWatcher) -> None:
        for name in ("a\nb.md", "é ß.md", os.fsdecode(b"\xff.md"), "x" * 255):
            (root / "content" / name).write_text("x")
            assert linux.get(1.0) == {f"content/{name}"}

    def test_it_ends_at_once(self, linux: InotifyWatcher) -> None:
        found: list[frozenset[str]] = []
        waits = threading.Thread(target=lambda: found.append(linux.get(600.0)), daemon=True)
        waits.start()
        linux.stop()
        waits.join(120)
        assert found == [frozenset()]

    def test_descriptors_are_given_back(self, root: Path) -> None:
        gc.collect()  # what others left goes now, and not meanwhile
        before = len([*Path("/proc/self/fd").iterdir()])
        for _ in range(5):
            found = InotifyWatcher(root)
            found.start()
            found.stop()
            del found
        assert len([*Path("/proc/self/fd").iterdir()]) <= before

    def test_too_many_folders(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        def full(*_: object) -> None:
            raise OSError(28, "no space")

        found = InotifyWatcher(root)
        monkeypatch.setattr(found._kernel, "watch", full)
        with pytest.raises(EffectError, match="changes of files cannot be watched: no space left"):
            found.start()
