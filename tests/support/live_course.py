"""A course in memory, and clean builds to compare it with."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from coursebuild.preview.rebuild import BackgroundRebuild
from coursebuild.preview.session import Session
from coursebuild.report import Style
from support.scratch_course import Folder

COPIES = (".br", ".gz")
SITE_ONLY_FILES = (".coursebuild-site", "files.json", "service-worker.js")
"""Files that only a published site has: the marker of the tool, and those for use offline."""
TRIALS = ("labs", "mjb", "pictures")
"""Stores of slow results, which live courses and clean builds share in these tests."""


class Live:
    """A preview without its server and threads."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.session = Session(folder.options(jobs=2))
        self.rebuild = BackgroundRebuild(self.session, Style())
        self.session.start()

    def save(self, *paths: str) -> bool:
        """Apply saved files; returns whether the fast path handled them."""
        if self.session.edit(paths) is not None:
            return True
        self.session.take_other_saves()
        return False

    def find(self, path: str) -> bytes | None:
        return self.session.find(path)

    def site(self) -> dict[str, bytes]:
        """All compared files of the site, after the background rebuild has finished."""
        self.rebuild.run_once()
        files = {path: self.find(path) for path in self.session.files.paths}
        texts = [d for p, d in files.items() if d is not None and p.endswith((".html", ".js"))]
        # A preview has all scripts, since a page drawn later may load any; a site those in use.
        unused = {
            path
            for path in files
            if re.fullmatch(r"assets/[\w-]+\.\w+\.js", path)
            and not any(path.rpartition("/")[2].encode() in text for text in texts)
        }
        compared = files.keys() - {*unused, *(p + end for p in unused for end in (".br", ".gz"))}
        return {p: files[p] for p in compared if files[p] is not None and _is_compared(p)}

    def close(self) -> None:
        self.rebuild.close()
        self.session.close()

    def error_rules(self) -> list[str]:
        return sorted(d.rule for d in self.session.diagnostics() if d.severity == "error")


@pytest.fixture
def live() -> Iterator[Callable[[Folder], Live]]:
    previews: list[Live] = []

    def make(folder: Folder) -> Live:
        previews.append(Live(folder))
        return previews[-1]

    yield make
    for preview in previews:
        preview.close()


def share(folder: Folder, trials: Path) -> None:
    for name in TRIALS:
        (trials / name).mkdir(parents=True, exist_ok=True)
        (folder.root / ".coursebuild" / name).symlink_to(trials / name)


class Builds:
    """Makes clean builds of a course, each in a new folder."""

    def __init__(self, folder: Path, stores: Path) -> None:
        self.folder, self.stores, self.numbers = folder, stores, itertools.count()
        self.trials = folder / "trials"

    def __call__(self, folder: Folder) -> dict[str, bytes] | None:
        """The published files, or None if the course has errors."""
        fresh = Folder(self.folder / f"clean {next(self.numbers)}")
        fresh.copy(folder.root)
        fresh.borrow(self.stores)
        share(fresh, self.trials)
        result = fresh.main("build")
        if result.status != 0:
            return None
        site = fresh.tree("public")
        return {path: data for path, data in site.items() if _is_compared(path)}


@pytest.fixture
def builds(tmp_path: Path, stores: Path) -> Builds:
    return Builds(tmp_path, stores)


def _is_compared(path: str) -> bool:
    return not path.endswith(COPIES) and path not in SITE_ONLY_FILES


def differences(a: dict[str, bytes], b: dict[str, bytes]) -> list[str]:
    return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
