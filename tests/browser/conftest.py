"""Built courses, served, and windows of a browser."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from support.built_sites import BuiltCourses, Site, Sites, course_copy
from support.lab_page import watch_page


@pytest.fixture(scope="session")
def sites(built_courses: BuiltCourses) -> Iterator[Sites]:
    """Courses by name, each on a host; nothing is built before it is asked for."""
    sites = Sites(built_courses)
    yield sites
    for site in sites.values():
        site.host.stop()


@pytest.fixture(scope="session")
def course(sites: Sites) -> Site:
    return sites["labs"]


@pytest.fixture(scope="session")
def base(course: Site) -> str:
    return course.url()


@pytest.fixture(scope="session")
def quizzes(sites: Sites) -> str:
    return sites["quizzes"].url()


@pytest.fixture(scope="session")
def site(sites: Sites) -> str:
    return sites["reader"].url()


@pytest.fixture(scope="session")
def scorm(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Path:
    """A SCORM package, unpacked as a platform does."""
    folder = course_copy("scorm", tmp_path_factory.mktemp("scorm") / "course", stores)
    folder.main("export", "scorm").require_success()
    shutil.unpack_archive(folder.root / "course-scorm.zip", folder.root / "package")
    return folder.root / "package"


@pytest.fixture
def context(browsers: Mapping[str, Browser]) -> Iterator[BrowserContext]:
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 800}) as context:
        yield context


@pytest.fixture
def calm(browsers: Mapping[str, Browser]) -> Iterator[BrowserContext]:
    """A window without a service worker, which would keep pages that a test changes."""
    size = {"width": 1000, "height": 800}
    with browsers["plain"].new_context(viewport=size, service_workers="block") as context:  # type: ignore[arg-type]
        yield context


TEST_ARTEFACTS = ("blocked by Playwright", "/assets/icon.")
"""What tests bring about themselves: there is no service worker, and an icon may still be loading
when the next page is opened.
"""


@pytest.fixture
def open_address(calm: BrowserContext) -> Iterator[Callable[[str], Page]]:
    """Opens pages, in which nothing may go wrong."""
    consoles: list[list[str]] = []

    def open_address(address: str) -> Page:
        page, lines = watch_page(calm)
        consoles.append(lines)
        page.goto(address)
        return page

    yield open_address
    all_lines = [line for lines in consoles for line in lines]
    assert [line for line in all_lines if not any(part in line for part in TEST_ARTEFACTS)] == []
