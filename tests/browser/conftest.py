"""Built courses, served, and windows of a browser."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext

from support.built_sites import BuiltCourses, Site
from support.folder_server import served
from support.scratch_course import Folder
from support.static_host import Host


@pytest.fixture(scope="session")
def course(built_courses: BuiltCourses) -> Folder:
    """A course of one lesson with labs, built."""
    return built_courses.of_case("labs")


@pytest.fixture(scope="session")
def base(course: Folder) -> Iterator[str]:
    """The address of the site."""
    with served(course.root / "public") as address:
        yield address


@pytest.fixture
def context(browsers: Mapping[str, Browser]) -> Iterator[BrowserContext]:
    """A window of a desk's size."""
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 800}) as context:
        yield context


@pytest.fixture(scope="session")
def sites(built_courses: BuiltCourses) -> Iterator[Mapping[str, Site]]:
    """The course of this repository, and one with every construct; each on a host."""
    roots = {"real": built_courses.real().root, "full": built_courses.of_case("full").root}
    bases = {"real": "/mujoco-course/", "full": "/constructs/"}  # the paths of their base addresses
    found = {
        name: Site(name, root, Host(root / "public", bases[name])) for name, root in roots.items()
    }
    yield found
    for site in found.values():
        site.host.stop()


@pytest.fixture(scope="session")
def quiz_files(built_courses: BuiltCourses) -> Path:
    """A site with every kind of question."""
    return built_courses.of_case("quizzes").root / "public"


@pytest.fixture(scope="session")
def quizzes(quiz_files: Path) -> Iterator[str]:
    """The address of that site."""
    with served(quiz_files) as address:
        yield address


@pytest.fixture(scope="session")
def reader(built_courses: BuiltCourses) -> Folder:
    """A course with questions, and a reader's way through it, built."""
    return built_courses.of_case("reader")


@pytest.fixture(scope="session")
def site(reader: Folder) -> Iterator[str]:
    """The address of its site."""
    with served(reader.root / "public") as address:
        yield address


@pytest.fixture(scope="session")
def hosts(built_courses: BuiltCourses) -> Iterator[Mapping[str, Host]]:
    """A course of what is hard to fit, and one in text from the right."""
    found = {
        name: Host(built_courses.of_case(name).root / "public", "/c/")
        for name in ("nasty", "arabic")
    }
    yield found
    for host in found.values():
        host.stop()


@pytest.fixture
def calm(browsers: Mapping[str, Browser]) -> Iterator[BrowserContext]:
    """A window without a service worker, which would keep pages that a test changes."""
    size = {"width": 1000, "height": 800}
    with browsers["plain"].new_context(viewport=size, service_workers="block") as context:
        yield context
