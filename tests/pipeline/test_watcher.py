"""Watching a course: every change of its files is reported, and nothing else."""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import watchfiles

from coursebuild.preview.live_course import FolderWatcher
from support.waiting import wait_until

pytestmark = pytest.mark.site

LESSON = "content/lessons/1.1-one.md"


def keep_size_and_time(path: Path) -> None:
    """Save another text, as a tool does that sets times back to those of its archive."""
    before = path.stat()
    path.write_text(path.read_text().upper())
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


CHANGES: dict[str, Callable[[Path], object]] = {
    "written": lambda path: path.write_text("new"),
    "gone": Path.unlink,
    "moved": lambda path: path.rename(path.with_name("other.md")),
    "replaced": lambda path: Path(shutil.copy(path, f"{path}~")).replace(path),
    "closed": lambda path: path.chmod(0o400),
    "emptied": lambda path: os.truncate(path, 0),
    "of old": keep_size_and_time,
    "of tomorrow": lambda path: os.utime(path, (2**32, 2**32)),
}
CHANGED_PAGES = [
    f"{folder}{name}.md" for folder in ("content/lessons/", "docs/", "") for name in CHANGES
]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    for path in (LESSON, "docs/guide.md", "docs/silent.md", *CHANGED_PAGES):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(path)
    return root


@pytest.fixture
def saves(root: Path) -> Iterator[FolderWatcher]:
    watcher = FolderWatcher(root)
    watcher.watch_also(frozenset({"docs/guide.md", LESSON, *CHANGED_PAGES}), {"lib", "."})
    watcher.start()
    yield watcher
    watcher.stop()


def wait_for_changes(saves: FolderWatcher, paths: set[str]) -> set[str]:
    """Wait until changes of all these paths were reported; return all that were."""
    changes: set[str] = set()
    until = time.monotonic() + 120
    while not changes >= paths:
        assert time.monotonic() < until, f"{paths - changes} is missing in {changes}"
        changes |= saves.get(0.2)
    while further := saves.get(0.1):
        changes |= further
    return changes


def wait_for_save(root: Path, saves: FolderWatcher, path: str) -> None:
    """Save a file in a new folder until it is reported: watching begins a moment late."""
    until = time.monotonic() + 120
    changes: frozenset[str] = frozenset()
    while path not in changes:
        assert time.monotonic() < until
        (root / path).write_text("more")
        changes |= saves.get(1.0)


def test_every_change_is_told_of_and_nothing_else(root: Path, saves: FolderWatcher) -> None:
    for path in (
        "content/lessons/.1.1-one.md.swp",
        "content/lessons/1.1-one.md~",
        "content/lessons/#1.1-one.md#",
        "content/lessons/4913",
        "content/.git/x.md",
        "mjcourse.md",
        "docs/silent.md",
        "docs/.guide.md.swp",
        "examples/x.py",
    ):
        (root / path).parent.mkdir(exist_ok=True)
        (root / path).write_text("x")
    assert not saves.get(0.5)
    for path in CHANGED_PAGES:
        CHANGES[Path(path).stem](root / path)
    odd = [f"content/{name}" for name in ("a\nb.md", "é ß.md", "x" * 255)]
    for path in odd:
        (root / path).write_text("x")
    assert wait_for_changes(saves, {*CHANGED_PAGES, *odd}) == {
        *CHANGED_PAGES,
        *odd,
        "content/lessons/other.md",
    }


def test_folders_that_are_made_later(root: Path, saves: FolderWatcher) -> None:
    (root / "models/deep/deeper").mkdir(parents=True)
    (root / "models/deep/deeper/a.xml").write_text("<mujoco/>")
    (root / "content/pages/one").mkdir(parents=True)
    (root / "content/pages/one/a.md").write_text("x")
    assert wait_for_changes(saves, {"models"}) & {"content", "content/pages"}
    (root / "lib/new").mkdir(parents=True)
    for path in ("models/deep/deeper/a.xml", "content/pages/one/a.md", "lib/new/a.py"):
        wait_for_save(root, saves, path)
    (root / "far").mkdir()
    saves.watch_also(frozenset({"docs/guide.md", "far/later.md"}))
    for path in ("far/later.md", "docs/guide.md"):
        wait_for_save(root, saves, path)


def test_folders_that_go_and_come_back_or_are_others(root: Path, saves: FolderWatcher) -> None:
    shutil.rmtree(root / "content")
    wait_for_changes(saves, {"content"})
    (root / "content/lessons").mkdir(parents=True)
    (root / LESSON).write_text("again")
    wait_for_changes(saves, {"content"})
    wait_for_save(root, saves, LESSON)
    for folder, news, file in (
        ("content", "content", LESSON),
        ("docs", "docs/guide.md", "docs/guide.md"),
    ):
        shutil.copytree(root / folder, root / f"new {folder}")
        (root / folder).rename(root / f"old {folder}")
        (root / f"new {folder}").rename(root / folder)
        wait_for_changes(saves, {news})
        wait_for_save(root, saves, file)


def test_while_no_folder_changes_watching_is_not_begun_again(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Saves between an end and a beginning would be missed."""
    counts: Counter[str] = Counter()
    really = watchfiles.watch

    def watch(*paths: Path, **options: Any) -> Iterator[set[Any]]:
        counts["begun"] += 1
        for batch in really(*paths, **options):
            counts["looks"] += 1
            yield batch

    monkeypatch.setattr(watchfiles, "watch", watch)
    saves = FolderWatcher(root)
    saves.watch_also(frozenset({"docs/guide.md"}))
    saves.start()
    wait_until(lambda: counts["looks"] > 3, "four looks")
    saves.stop()
    assert counts["begun"] == 1


def test_files_in_a_linked_folder(root: Path) -> None:
    (root / "far").mkdir()
    (root / "content/near").symlink_to(root / "far")
    saves = FolderWatcher(root)
    saves.start()
    wait_for_save(root, saves, "content/near/a.svg")
    saves.stop()


def test_who_waits_is_woken_when_watching_ends(saves: FolderWatcher) -> None:
    thread = threading.Thread(target=saves.stop)
    thread.start()
    assert not saves.get(600.0)
    thread.join()
    assert saves.is_stopped
