"""Lessons of a SCORM 1.2 package in a learning platform: opened in a frame beside a real run-time.

The platform's half is the npm package scorm-again, which refuses what the data model does not have.
What a session says is tested under Node.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, FrameLocator, Locator, Page, expect

from support.axe import violations
from support.fixture_cases import fixture_text
from support.lab_page import becomes, until, watch_page
from support.scratch_course import ROOT
from support.static_host import Host

pytestmark = pytest.mark.browser

RUNTIME = ROOT / "site/node_modules/scorm-again/dist/scorm12.min.js"
PLATFORM = fixture_text("documents/platform.html")


@pytest.fixture(scope="module")
def platform(scorm: Path) -> Iterator[str]:
    if not RUNTIME.is_file():
        pytest.fail("scorm-again is not installed: run python site/bundle.py packages")
    shutil.copy(RUNTIME, scorm / "runtime.js")
    (scorm / "platform.html").write_text(PLATFORM, encoding="utf-8")
    with Host(scorm) as host:
        yield host.url


@pytest.fixture
def visit(calm: BrowserContext, platform: str) -> Iterator[Callable[..., Page]]:
    """Opens the lesson in the platform; nothing may go wrong, and nothing be refused."""
    pages: list[Page] = []

    def visit() -> Page:
        page = calm.new_page()
        page.on("pageerror", lambda error: pytest.fail(str(error)))
        page.goto(f"{platform}platform.html?who=ada")
        lesson(page).locator("[data-question]").first.wait_for()
        pages.append(page)
        return page

    yield visit
    assert [page.evaluate("refused") for page in pages] == [[] for _ in pages]


Visit = Callable[..., Page]


def lesson(page: Page) -> FrameLocator:
    return page.frame_locator("iframe").frame_locator("iframe")


def live(page: Page, key: str) -> Locator:
    """A question that can be answered: in a frame it comes alive when it comes into sight."""
    question = lesson(page).locator(f'[data-question="{key}"]')
    question.scroll_into_view_if_needed()
    question.locator(".quiz-check").wait_for()
    return question


def choose(page: Page, key: str, text: str) -> None:
    live(page, key).get_by_label(text).check()
    live(page, key).locator(".quiz-check").click()


def scored(page: Page, points: str) -> None:
    becomes(page, lambda: page.evaluate("API.cmi.core.score.raw"), points)


def left(page: Page) -> None:
    """The learner leaves, and the platform keeps what it was told."""
    page.evaluate("leave()")
    until(page, "API.isTerminated()")


def test_answers_points_and_status_reach_the_platform(visit: Visit) -> None:
    page = visit()
    until(page, "API.cmi.core.lesson_status === 'incomplete'")
    choose(page, "which", "blue")
    choose(page, "which", "green")
    scored(page, "50")
    live(page, "much").get_by_role("textbox").fill("0.08")
    live(page, "much").locator(".quiz-check").click()
    until(page, "API.cmi.core.lesson_status === 'passed'")
    model: Any = page.evaluate("JSON.parse(JSON.stringify(API.cmi))")
    points = {key: model["core"]["score"][key] for key in ("raw", "min", "max")}
    assert points == {"raw": "100", "min": "0", "max": "100"}
    parts = ("id", "type", "student_response", "result")
    interactions = [
        [interaction[part] for part in parts] for interaction in model["interactions"].values()
    ]
    assert interactions[:2] == [
        ["check.which", "choice", "c", "wrong"],
        ["check.which", "choice", "b", "correct"],
    ]
    assert interactions[2][0] == "check.much" and interactions[2][3] == "correct"
    left(page)
    platform_data = page.evaluate("JSON.parse(localStorage.getItem('platform'))")
    assert platform_data["core"]["exit"] == "suspend"


def test_later_visit_shows_the_answers_on_a_machine_that_has_none(visit: Visit) -> None:
    page = visit()
    choose(page, "which", "green")
    scored(page, "50")
    left(page)
    page.evaluate(
        "for (const key of Object.keys(localStorage)) if (key !== 'platform')"
        " localStorage.removeItem(key)"
    )
    again = visit()
    expect(live(again, "which").get_by_label("green")).to_be_checked()
    scored(again, "50")


def test_visit_goes_on_over_other_pages_of_the_course(visit: Visit) -> None:
    page = visit()
    lesson(page).get_by_role("link", name="The other lesson").click()
    choose(page, "other", "this")
    expect(live(page, "other").locator(".verdict")).to_contain_text("Right")
    page.evaluate("history.back()")
    choose(page, "which", "green")
    scored(page, "50")
    answers = "API.cmi.interactions.childArray.length"
    becomes(page, lambda: page.evaluate(answers), 1)  # the other lesson's is not this one's


def test_lesson_is_there_without_a_platform_and_says_so(
    calm: BrowserContext, platform: str
) -> None:
    page = calm.new_page()
    page.goto(f"{platform}sco/1.1-one.html")
    expect(page.get_by_role("status")).to_have_text(re.compile("^No learning platform"))
    page.frame_locator("iframe").locator("[data-question]").first.wait_for()
    until(page, "document.documentElement.scrollWidth <= innerWidth")
    assert violations(page, "body > :not(iframe)") == []


def test_page_of_the_package_asks_for_no_service_worker(
    browsers: Mapping[str, Browser], platform: str
) -> None:
    with browsers["plain"].new_context() as context:
        page, console = watch_page(context)
        page.clock.install()
        page.goto(f"{platform}lessons/1.1-one.html")
        page.locator("[data-question]").first.wait_for()
        page.clock.run_for(60_000)  # a page of a site has long asked
        page.goto(f"{platform}offline/index.html")
        page.clock.run_for(60_000)
        expect(page.locator("[data-keep]")).to_be_visible()
        assert page.evaluate("navigator.serviceWorker.getRegistrations()") == []
        assert console == []


def test_platform_in_a_window_of_its_own(calm: BrowserContext, platform: str) -> None:
    opener = calm.new_page()
    opener.goto(f"{platform}platform.html")
    opener.evaluate("document.querySelector('iframe').remove(); API.reset()")
    with calm.expect_page() as popup:
        opener.evaluate("window.open('sco/1.1-one.html')")
    window = popup.value
    window.frame_locator("iframe").locator("[data-question]").first.wait_for()
    until(opener, "API.cmi.core.lesson_status === 'incomplete'")
    window.close(run_before_unload=True)
    until(opener, "API.isTerminated()")


def test_keyboard_reaches_into_the_lesson(visit: Visit) -> None:
    page = visit()
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    inside = "document.querySelector('iframe').contentDocument.querySelector('iframe')"
    until(page, f"{inside}.contentDocument.activeElement.tagName === 'A'")
