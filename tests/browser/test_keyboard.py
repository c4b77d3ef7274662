"""A lesson by the keyboard alone: every stop can be seen, none is a trap, all can be done."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route

from support.built_sites import Site
from support.fixture_cases import fixture_text
from support.lab_page import becomes, until

pytestmark = pytest.mark.browser

NAMES = ("full", pytest.param("real", marks=pytest.mark.slow))
"""Courses; what is tried is the largest lesson of one."""
MAX_STOPS = 1000

FOCUSED_ELEMENT = fixture_text("scripts/focused_element.js")
"""Where the focus is; `null` where it has left the page."""
FOCUS_IS_VISIBLE = fixture_text("scripts/focus_is_visible.js")
"""Whether the page has moved to the focus, since parts above it that are drawn late push it away,
and the lab that has the focus has started, since its static form is hidden then."""


@pytest.fixture
def page(browsers: Mapping[str, Browser]) -> Iterator[Page]:
    viewport: Any = {"width": 1200, "height": 900}
    with browsers["plain"].new_context(viewport=viewport, reduced_motion="reduce") as context:
        yield context.new_page()


def open_site(page: Page, site: Site) -> None:
    page.goto(site.url(site.kinds()["lesson"]))
    until(page, "document.fonts.status === 'loaded'")
    for quiz in page.locator(".quiz:visible").all():
        quiz.scroll_into_view_if_needed()
        quiz.locator("button:visible").first.wait_for()
    page.evaluate("scrollTo(0, 0)")


def clip_of(stop: dict[str, Any], margin: int = 8) -> Any:
    x, y, width, height = stop["box"]
    left, top = max(x - margin, 0), max(y - margin, 0)
    right, bottom = min(x + width + margin, 1200), min(y + height + margin, 900)
    return {"x": left, "y": top, "width": right - left, "height": bottom - top}


@pytest.mark.parametrize("name", NAMES)
def test_every_stop_is_seen_and_none_is_a_trap(
    sites: Mapping[str, Site], page: Page, name: str
) -> None:
    """In the order of the text, there and back, with a ring around each kind of stop."""
    open_site(page, sites[name])
    stops: list[dict[str, Any]] = []
    looked: set[str] = set()
    for _ in range(MAX_STOPS):
        page.keyboard.press("Tab")
        until(page, FOCUS_IS_VISIBLE)
        stop = page.evaluate(FOCUSED_ELEMENT)
        if stop is None:
            break
        assert stop["follows"], f"out of order: {stop}"
        assert stop["inWindow"] and min(stop["size"]) > 0, f"out of sight: {stop}"
        assert stop["visibility"] == "visible" and stop["opacity"] != "0", stop
        assert stop["tabindex"] == 0 and stop["name"], stop
        stops.append(stop)
        if stop["kind"] not in looked:
            looked.add(stop["kind"])
            has_a_ring(page, stop)
    else:
        raise AssertionError(f"the focus does not leave the page: {stops[-1]}")
    assert len(stops) > 30 and len(looked) > 8
    page.evaluate("window.stops = []")
    page.keyboard.press("Shift+Tab")
    becomes(page, lambda: (page.evaluate(FOCUSED_ELEMENT) or {}).get("name"), stops[-1]["name"])


def has_a_ring(page: Page, stop: dict[str, Any]) -> None:
    """The pixels around a stop are others while it has the focus, and enough of them."""
    clip = clip_of(stop)
    focused = page.screenshot(clip=clip)
    page.evaluate("() => { window.held = document.activeElement; held.blur() }")
    bare = page.screenshot(clip=clip)
    page.evaluate("() => held.focus({ preventScroll: true, focusVisible: true })")
    assert focused != bare, f"nothing shows where the focus is: {stop}"


@pytest.mark.parametrize("name", NAMES)
def test_everything_that_folds_opens_by_key(
    sites: Mapping[str, Site], page: Page, name: str
) -> None:
    open_site(page, sites[name])
    summaries = page.locator("main summary:visible")
    assert summaries.count() >= 2
    kinds = dict.fromkeys(summaries.evaluate_all("all => all.map(s => s.parentElement.className)"))
    for kind, key in zip(kinds, itertools.cycle(("Enter", "Space"))):
        of_kind = f'[class="{kind}"]' if kind else ":not([class])"
        summary = page.locator(f"main details{of_kind} > summary:visible").first
        was = summary.evaluate("s => s.parentElement.open")
        summary.focus()
        page.keyboard.press(key)
        becomes(page, partial(summary.evaluate, "s => s.parentElement.open"), not was)


def test_the_focus_goes_on_in_a_lab_that_starts(sites: Mapping[str, Site], page: Page) -> None:
    """The static form that had it is hidden, so the focus would be at no visible place."""
    held_routes: list[Route] = []
    configs = re.compile(r"/assets/labs/.*\.json$")
    page.route(configs, lambda route: held_routes.append(route))
    site = sites["full"]
    page.goto(site.url(site.kinds()["lesson"]))
    page.locator(".lab-static a:visible").first.focus()
    becomes(page, lambda: len(held_routes) > 0, True)

    def goes_on() -> object:
        while held_routes:
            held_routes.pop().continue_()
        return page.evaluate("document.activeElement.closest('.lab-live') !== null")

    becomes(page, goes_on, True)
