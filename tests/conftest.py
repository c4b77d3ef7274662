"""Options and folders for all tests."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# No deadlines: a slow machine is no mistake. A change is judged by the same examples each time;
# `make test-slow` tries new ones.
settings.register_profile("free", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("fixed", settings.get_profile("free"), derandomize=True)
settings.load_profile("fixed")

# A shell starts what runs in the background with these ignored; so all that tests start would be.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGQUIT, signal.SIG_DFL)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--rewrite-fixtures",
        action="store_true",
        help="write what is expected anew instead of comparing with it; review the difference",
    )


STORES = ("fonts", "compressed")


@pytest.fixture(scope="session")
def stores(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Stores for the `.coursebuild` of scratch courses, so that a font is cut once a session.

    Worker processes share it: an entry is named by what it is made from, and is whole or not there.
    """
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "stores"
    for name in STORES:
        (folder / name).mkdir(parents=True, exist_ok=True)
    return folder
