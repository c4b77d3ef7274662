"""What a lab looks like: the live picture is the recorded one, with mirrors, metals and ropes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from support.built_sites import Site
from support.fixture_cases import fixture_text
from support.lab_page import lab, reach, watch_page

pytestmark = [pytest.mark.browser, pytest.mark.long]

LABS = 7
"""Lit and unlit, from above and from below; the course is `tests/courses/drawing`."""
MIRROR, DULL, ENDLESS = 2, 3, 4
LESSON = "lessons/1.1-one.html"
WINDOW: Any = {"width": 600, "height": 500}
"""A small one, since pictures with shadows take long without a graphics processor."""

COMPARE = fixture_text("scripts/compare_pictures.js")

REDS = fixture_text("scripts/reds.js")


GREENS = fixture_text("scripts/greens.js")


def ready(page: Page, number: int) -> None:
    """A lab that shows its first picture."""
    lab_element = lab(page, number)
    lab_element.locator(".lab-poster").wait_for(state="detached")


@pytest.fixture(scope="module")
def drawn_page(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site]
) -> Iterator[tuple[Page, list[str]]]:
    with browsers["webgl"].new_context(viewport=WINDOW) as context:
        page, console = watch_page(context)
        page.goto(sites["drawing"].url(LESSON))
        yield page, console


def test_the_recorded_picture_is_the_live_one(drawn_page: tuple[Page, list[str]]) -> None:
    """Up to the edges, which fall between other pixels."""
    page, console = drawn_page
    failures = []
    for number in range(LABS):
        ready(page, number)
        comparison = page.evaluate(COMPARE, number)
        if comparison["middle"] > 2 or comparison["most"] > 16:
            failures.append((number, comparison))
    assert failures == []
    assert console == []


def test_a_mirror_shows_what_stands_on_it(drawn_page: tuple[Page, list[str]]) -> None:
    page, _ = drawn_page
    ready(page, MIRROR)
    ready(page, DULL)
    mirrored, plain = (page.evaluate(REDS, number) for number in (MIRROR, DULL))
    assert mirrored > 1.5 * plain > 0


@pytest.mark.parametrize("number", [0, MIRROR])
def test_a_moving_picture_is_drawn_like_one_at_rest(
    drawn_page: tuple[Page, list[str]], number: int
) -> None:
    page, console = drawn_page
    ready(page, number)
    element = lab(page, number)
    element.get_by_role("button", name="Play").click()
    element.locator(".lab-canvas").wait_for()
    comparison = page.evaluate(COMPARE, number)
    assert comparison["middle"] <= 2 and comparison["most"] <= 32, "coarser, but the same"
    element.get_by_role("button", name="Pause").click()
    reach(page, number, "paused")
    assert console == []


def test_with_a_graphics_processor_there_are_shadows_too(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site], drawn_page: tuple[Page, list[str]]
) -> None:
    """By way of a browser that says it had one: mirrors, and maps for all kinds of lights."""
    ready(drawn_page[0], ENDLESS)
    plain_greens = np.array(drawn_page[0].evaluate(GREENS, ENDLESS))
    with browsers["webgl"].new_context(viewport=WINDOW, device_scale_factor=2) as context:
        context.add_init_script(
            "const { prototype } = WebGL2RenderingContext, { getParameter } = prototype\n"
            "prototype.getParameter = function (name) {\n"
            "  return name === 0x9246 ? 'A graphics processor' : getParameter.call(this, name)\n"
            "}"
        )
        page, console = watch_page(context)
        page.goto(sites["drawing"].url(LESSON))
        ready(page, ENDLESS)
        assert page.evaluate(COMPARE, ENDLESS)["middle"] <= 2, "the rest is as without"
        darker = plain_greens - np.array(page.evaluate(GREENS, ENDLESS)) > 15
        assert 500 < darker.sum() < 0.2 * darker.size
        assert console == []
