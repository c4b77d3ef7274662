"""A built course with labs, served, and a browser that draws without a graphics processor."""

from __future__ import annotations

import functools
import http.server
import shutil
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, expect, sync_playwright

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "pipeline"))  # for the kit

import quizpage
from coursekit import Folder
from hostkit import Host
from labcourse import LESSON, PENDULUM, TWIN, ZOO
from standardkit import Site, build_both, shared_folder

SLOW = 120_000
"""Milliseconds that a slow machine may take until what is waited for is there."""
expect.set_options(timeout=SLOW)
ARGUMENTS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


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


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="session")
def base(course: Folder) -> Iterator[str]:
    """The address of the site."""
    handler = functools.partial(Quiet, directory=str(course.root / "public"))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://localhost:{server.server_address[1]}/"
        server.shutdown()
        thread.join()


def launch(playwright: object, *arguments: str) -> Browser:
    chromium = shutil.which("chromium")
    assert chromium is not None, "no chromium: install Debian's package `chromium`"
    start = playwright.chromium.launch  # type: ignore[attr-defined]
    browser: Browser = start(executable_path=chromium, args=[*ARGUMENTS, *arguments])
    return browser


@pytest.fixture(scope="module")
def browsers() -> Iterator[dict[str, Browser]]:
    """Browsers: one with WebGL, one without."""
    with sync_playwright() as playwright:
        found = {"webgl": launch(playwright), "plain": launch(playwright, "--disable-3d-apis")}
        yield found
        for browser in found.values():
            browser.close()


@pytest.fixture
def context(browsers: dict[str, Browser]) -> Iterator[BrowserContext]:
    """A window of a desk's size."""
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 800}) as context:
        context.set_default_timeout(SLOW)
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
    folder.fill([quizpage.LESSON], stores)
    folder.write("models/pendulum.xml", PENDULUM)
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    return folder.root / "public"


@pytest.fixture(scope="session")
def quizzes(quiz_files: Path) -> Iterator[str]:
    """The address of that site."""
    handler = functools.partial(Quiet, directory=str(quiz_files))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://localhost:{server.server_address[1]}/"
        server.shutdown()
        thread.join()
