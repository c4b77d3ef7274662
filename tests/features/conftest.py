"""Small courses for the tests of features; one is exported once for all of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from support.archives import Package, entries
from support.question_zoo import ANY, SCRIPT, furnish, quiz
from support.rendered_course import Make, read_assets
from support.scratch_course import GOOD, Folder, maker


@pytest.fixture(scope="session")
def make() -> Make:
    return Make(read_assets())


@pytest.fixture
def make_course(tmp_path: Path, stores: Path) -> Callable[..., Folder]:
    def make(*lessons: str) -> Folder:
        folder = maker(tmp_path, stores)(*lessons)
        furnish(folder)
        return folder

    return make


@pytest.fixture(scope="session")
def zoo(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    folder = Folder(tmp_path_factory.mktemp("zoo") / "a cöurse")
    folder.fill([GOOD + SCRIPT + quiz("1.1-check", *ANY.values()), "## Two\n\nText.\n"], stores)
    furnish(folder)
    folder.replace(
        "content/course.toml",
        '[[level]]\nid = "1"\ntitle = "Level"\n',
        '[[level]]\nid = "0"\ntitle = "Empty"\n[[level.lesson]]\nid = "0.1"\nslug = "later"\n'
        'title = "Later"\nstatus = "planned"\n\n[[level]]\nid = "1"\ntitle = "Level"\n',
    )
    return folder


def export(folder: Folder, kind: str, name: str) -> Package:
    result = folder.main("export", kind).require_success()
    return Package(folder, result, entries(folder.root / name))


@pytest.fixture(scope="session")
def qti(zoo: Folder) -> Package:
    return export(zoo, "qti", "quizzes-qti.zip")


@pytest.fixture(scope="session")
def scorm(zoo: Folder) -> Package:
    return export(zoo, "scorm", "course-scorm.zip")
