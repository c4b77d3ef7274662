"""Small courses for the tests of features."""

from __future__ import annotations

import pytest

from support.rendered_course import Make, read_assets


@pytest.fixture(scope="session")
def make() -> Make:
    return Make(read_assets())
