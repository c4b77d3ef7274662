"""Small courses for the tests of rendering."""

from __future__ import annotations

import pytest

from coursebuild.core.pages.assets import Assets
from support.rendered_course import Make, read_assets


@pytest.fixture(scope="session")
def assets() -> Assets:
    return read_assets()


@pytest.fixture(scope="session")
def make(assets: Assets) -> Make:
    return Make(assets)
