"""A built course with labs, served, and a browser that draws without a graphics processor."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, sync_playwright

from support import quiz_page
from support.built_sites import Site, build_both, shared_folder
from support.chromium import launch
from support.folder_server import served
from support.lab_course import LESSON, PENDULUM, TWIN, ZOO
from support.reader_course import FILES
from support.scratch_course import Folder
from support.static_host import Host

DRAWING = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@pytest.fixture(scope="session")
def course(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course of one lesson with labs, built."""
    folder = Folder(tmp_path_factory.mktemp("labs") / "course")
    folder.fill([LESSON], stores)
    folder.write("models/pendulum.xml", PENDULUM)
    folder.write("models/zoo.xml", ZOO)
    folder.write("content/labs/twin.js", TWIN.read_bytes())
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    return folder


@pytest.fixture(scope="session")
def base(course: Folder) -> Iterator[str]:
    """The address of the site."""
    with served(course.root / "public") as address:
        yield address


@pytest.fixture(scope="module")
def browsers() -> Iterator[dict[str, Browser]]:
    """Browsers: one with WebGL, one without."""
    with sync_playwright() as playwright:
        found = {
            "webgl": launch(playwright, *DRAWING),
            "plain": launch(playwright, *DRAWING, "--disable-3d-apis"),
        }
        yield found
        for browser in found.values():
            browser.close()


@pytest.fixture
def context(browsers: dict[str, Browser]) -> Iterator[BrowserContext]:
    """A window of a desk's size."""
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 800}) as context:
        yield context


@pytest.fixture(scope="session")
def sites(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[dict[str, Site]]:
    """The course of this repository, and one with every construct; each on a host."""
    roots = build_both(shared_folder(tmp_path_factory), stores)
    bases = {"real": "/mujoco-course/", "full": "/constructs/"}  # the paths of their base addresses
    found = {
        name: Site(name, root, Host(root / "public", bases[name])) for name, root in roots.items()
    }
    yield found
    for site in found.values():
        site.host.stop()


@pytest.fixture(scope="session")
def quiz_files(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Path:
    """A site with every kind of question."""
    folder = Folder(tmp_path_factory.mktemp("quizzes") / "course")
    folder.fill([quiz_page.LESSON], stores)
    folder.write("models/pendulum.xml", PENDULUM)
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    return folder.root / "public"


@pytest.fixture(scope="session")
def quizzes(quiz_files: Path) -> Iterator[str]:
    """The address of that site."""
    with served(quiz_files) as address:
        yield address


@pytest.fixture(scope="session")
def reader(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course with questions, and a reader's way through it, built."""
    folder = Folder(tmp_path_factory.mktemp("reader") / "course")
    folder.root.mkdir()
    folder.borrow(stores)
    for path, text in FILES.items():
        folder.write(path, text)
    folder.write("models/pendulum.xml", PENDULUM)
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    return folder


@pytest.fixture(scope="session")
def site(reader: Folder) -> Iterator[str]:
    """The address of its site."""
    with served(reader.root / "public") as address:
        yield address


@pytest.fixture
def calm(browsers: dict[str, Browser]) -> Iterator[BrowserContext]:
    """A window without a service worker, which would keep pages that a test changes."""
    size = {"width": 1000, "height": 800}
    with browsers["plain"].new_context(viewport=size, service_workers="block") as context:
        yield context
