"""A course in memory, and clean builds to hold it against."""

from __future__ import annotations

import itertools
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from coursebuild.pipeline.options import Options
from coursebuild.pipeline.preview.behind import Behind
from coursebuild.pipeline.preview.live import LiveCourse
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.serve import live_course
from support.scratch_course import Folder

COPIES = (".br", ".gz")
OURS = (".coursebuild-site", "files.json", "service-worker.js")
"""By which a folder is known for a site of the tool; what keeps it without a network."""
TRIALS = ("labs", "mjb", "pictures")
"""Stores of what takes long, and which live courses and clean builds share in these tests."""


class Live:
    """A live course without the threads of a preview."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        options = Options(folder.root.resolve(), 2, True)
        self.course: LiveCourse = live_course(options)
        self.behind = Behind(self.course, options, Progress(quiet=True))
        self.course.reread()

    def save(self, *paths: str) -> bool:
        """What `follow` does with a save; whether the fast way was taken."""
        plan = self.course.plan(paths)
        if plan is not None and self.course.commit(plan):
            return True
        self.behind.notice()
        self.course.reread()
        return False

    def site(self) -> dict[str, bytes]:
        """Everything, once all is known."""
        self.behind.once()
        found = {path: self.course.find(path) for path in self.course.pages.paths()}
        return {path: data for path, data in found.items() if data is not None}

    def close(self) -> None:
        self.behind.close()
        self.course.close()

    def wrong(self) -> list[str]:
        return sorted(d.rule for d in self.course.diagnostics() if d.severity.value == "error")


@pytest.fixture
def live() -> Iterator[Callable[[Folder], Live]]:
    made: list[Live] = []

    def make(folder: Folder) -> Live:
        made.append(Live(folder))
        return made[-1]

    yield make
    for one in made:
        one.close()


def share(folder: Folder, trials: Path) -> None:
    """Keep trials of labs with other courses."""
    for name in TRIALS:
        (trials / name).mkdir(parents=True, exist_ok=True)
        (folder.root / ".coursebuild" / name).symlink_to(trials / name)


class Builds:
    """Clean builds of what a folder holds, each in a folder of its own."""

    def __init__(self, where: Path, stores: Path) -> None:
        self.where, self.stores, self.numbers = where, stores, itertools.count()

    def __call__(self, folder: Folder) -> dict[str, bytes] | None:
        """The published files, or nothing for a course with mistakes."""
        fresh = Folder(self.where / f"clean {next(self.numbers)}")
        for top in ("content", "models", "docs"):
            if (folder.root / top).is_dir():
                shutil.copytree(folder.root / top, fresh.root / top)
        fresh.borrow(self.stores)
        share(fresh, self.where / "trials")
        done = fresh.main("build")
        if done.status != 0:
            return None
        site = fresh.tree("public")
        return {p: d for p, d in site.items() if not p.endswith(COPIES) and p not in OURS}


@pytest.fixture
def builds(tmp_path: Path, stores: Path) -> Builds:
    return Builds(tmp_path, stores)


def differences(a: dict[str, bytes], b: dict[str, bytes]) -> list[str]:
    return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
