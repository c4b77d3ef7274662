"""Built courses, served, and windows of a browser."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext

from support.built_sites import BuiltCourses, Site, Sites, course_copy


@pytest.fixture(scope="session")
def sites(built_courses: BuiltCourses) -> Iterator[Sites]:
    """Courses by name, each on a host; nothing is built before it is asked for."""
    sites = Sites(built_courses)
    yield sites
    for site in sites.values():
        site.host.stop()


@pytest.fixture(scope="session")
def course(sites: Sites) -> Site:
    """A course of one lesson with labs."""
    return sites["labs"]


@pytest.fixture(scope="session")
def base(course: Site) -> str:
    """The address of its site."""
    return course.url()


@pytest.fixture(scope="session")
def quizzes(sites: Sites) -> str:
    """The address of a site with every kind of question."""
    return sites["quizzes"].url()


@pytest.fixture(scope="session")
def reader(sites: Sites) -> Site:
    """A course with questions, and a reader's way through it."""
    return sites["reader"]


@pytest.fixture(scope="session")
def site(reader: Site) -> str:
    """The address of its site."""
    return reader.url()


@pytest.fixture(scope="session")
def scorm(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Path:
    """A SCORM package, unpacked as a platform does."""
    folder = course_copy("scorm", tmp_path_factory.mktemp("scorm") / "course", stores)
    done = folder.main("export", "scorm")
    assert done.status == 0, done.out + done.err
    shutil.unpack_archive(folder.root / "course-scorm.zip", folder.root / "package")
    return folder.root / "package"


@pytest.fixture
def context(browsers: Mapping[str, Browser]) -> Iterator[BrowserContext]:
    """A window of a desk's size."""
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 800}) as context:
        yield context


@pytest.fixture
def calm(browsers: Mapping[str, Browser]) -> Iterator[BrowserContext]:
    """A window without a service worker, which would keep pages that a test changes."""
    size = {"width": 1000, "height": 800}
    with browsers["plain"].new_context(viewport=size, service_workers="block") as context:
        yield context
