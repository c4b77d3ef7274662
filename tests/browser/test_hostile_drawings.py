"""Drawings that somebody makes to run something or to ask somebody, at their own address."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pytest
from playwright.sync_api import Browser

from support.hostile_svg import HARMLESS, HOSTILE, mutants
from support.opened_drawings import Drawings, published_files

ACTIVE = (
    *("script", "XHTML script", "XHTML frame", "XHTML picture", "onclick", "set of a link"),
    *("animate of a picture", "a link elsewhere", "image from afar", "stylesheet from afar"),
    *("style: fill:u\\72l(FAR/x.svg#x)", "style: background-image:image-set('FAR/i.png' 1x)"),
)
"""Some that act where nobody judges them, so that it is known what the probe sees."""


@pytest.fixture(scope="module")
def drawings(
    browsers: Mapping[str, Browser], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Drawings]:
    with Drawings(browsers["plain"], tmp_path_factory.mktemp("drawings")) as drawings:
        yield drawings


def test_hostile_drawings_act_where_nobody_judges_them(drawings: Drawings) -> None:
    files = dict(HOSTILE)
    assert [name for name in ACTIVE if not drawings.open(files[name])] == []


def test_a_published_drawing_runs_nothing_and_asks_nobody(drawings: Drawings) -> None:
    files = {name: published_files(data) for name, data in (*HOSTILE, *mutants(1_000, seed=36))}
    assert sum(not files[name] for name, _ in HOSTILE) > 250, "these are refused"
    files |= {name: published_files(data)[:1] for name, data in HARMLESS}
    traces = {name: [drawings.open(data) for data in versions] for name, versions in files.items()}
    assert sum(map(len, traces.values())) > 40, "these are opened"
    assert {name: traces[name] for name in files if any(traces[name])} == {}
