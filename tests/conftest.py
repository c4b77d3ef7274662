"""Options and folders for all tests."""

from __future__ import annotations

import gc
import os
import signal
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from playwright.sync_api import Browser

    from support.built_sites import BuiltCourses
    from support.scratch_course import Make

# No deadlines: a slow machine is no mistake. A change is judged by the same examples each time;
# `make test-slow` tries new ones.
settings.register_profile("free", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("fixed", settings.get_profile("free"), derandomize=True)
settings.load_profile("fixed")

# A shell starts what runs in the background with these ignored; so all that tests start would be.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGQUIT, signal.SIG_DFL)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# The key of a session's stores, which no test may find in the home of who runs it. Worker processes
# have it from the first one. Whoever runs it builds this repository's own course (`built_sites`).
if "PYTEST_XDIST_WORKER" not in os.environ:
    for _name in ("XDG_STATE_HOME", "COURSEBUILD_STORE_KEY"):
        if _name in os.environ:
            os.environ[f"OUTER_{_name}"] = os.environ.pop(_name)
    _state = tempfile.TemporaryDirectory(prefix="coursebuild-tests-")
    os.environ["XDG_STATE_HOME"] = _state.name

# Checkers in Java run for seconds only, in which compiling more costs more than it saves.
os.environ["JDK_JAVA_OPTIONS"] = "-XX:TieredStopAtLevel=1 -XX:+UseSerialGC -Xss4m"

# What is imported and collected stays until the end: looking for garbage in it takes a tenth of the
# time.
gc.set_threshold(50_000, 20, 50)


def pytest_collection_finish() -> None:
    gc.freeze()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--rewrite-fixtures",
        action="store_true",
        help="write what is expected anew instead of comparing with it; review the difference",
    )
    parser.addoption(
        "--rewrite-budgets",
        action="store_true",
        help="lower what the parts of the house may weigh (tests/budgets.toml) to what they weigh",
    )


@pytest.fixture
def rewriting(request: pytest.FixtureRequest) -> bool:
    """Whether what is expected is written anew."""
    return bool(request.config.getoption("--rewrite-fixtures"))


NOBODY = 65534
STORES = ("fonts", "compressed", "installed")


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that all worker processes of a run share."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@pytest.fixture(scope="session")
def stores(shared: Path) -> Path:
    """Stores for the `.coursebuild` of scratch courses, so that a font is cut once a session.

    Worker processes share it: an entry is named by what it is made from, and is whole or not there.
    """
    folder = shared / "stores"
    for name in STORES:
        (folder / name).mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def built_courses(shared: Path, stores: Path) -> BuiltCourses:
    """Courses that are built once for all worker processes of a run."""
    from support.built_sites import BuiltCourses

    return BuiltCourses(shared / "built", stores)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def make(tmp_path: Path, stores: Path) -> Make:
    """Makes a course of these lessons."""
    from support.scratch_course import maker

    return maker(tmp_path, stores)


@pytest.fixture(scope="session")
def browsers() -> Iterator[Mapping[str, Browser]]:
    """The browsers of this process, `webgl` and `plain`, each started when it is asked for.

    While Playwright runs, nothing else in the main thread can start an event loop, nor a second
    Playwright: so all tests have this one.
    """
    from playwright.sync_api import sync_playwright

    from support.chromium import Browsers

    with sync_playwright() as playwright:
        browsers_by_kind = Browsers(playwright)
        yield browsers_by_kind
        browsers_by_kind.close()


@pytest.fixture
def held_back(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of a user whom permissions hold back, as whom the test runs: root is not held."""
    monkeypatch.setenv("COURSEBUILD_STORE_KEY", "of another user")
    with tempfile.TemporaryDirectory() as name:
        root = os.geteuid() == 0
        if root:
            os.chown(name, NOBODY, NOBODY)
            os.seteuid(NOBODY)
        try:
            yield Path(name)
        finally:
            if root:
                os.seteuid(0)
