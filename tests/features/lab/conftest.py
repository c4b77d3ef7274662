"""The engines of labs, which are started once for all that ask them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from support.lab_values import Bench


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with Bench(tmp_path_factory.mktemp("course")) as bench:
        yield bench
