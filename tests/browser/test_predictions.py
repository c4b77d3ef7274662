"""Predictions in a headless Chromium: what answers them is hidden, and the lab shows it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from support.axe import violations
from support.lab_page import becomes, watch_page
from support.quiz_page import press, question

pytestmark = pytest.mark.browser
COMMIT = "Commit to this answer"
HIDDEN_ELEMENTS = "[hidden=until-found]"


@pytest.fixture
def lesson(quizzes: str) -> str:
    return f"{quizzes}lessons/1.2-two.html"


@pytest.fixture
def page(context: BrowserContext) -> Iterator[Page]:
    page, console = watch_page(context)
    yield page
    assert [text for text in console if "/assets/labs/" not in text] == []


def answer(page: Page, number: int) -> None:
    question(page, number).scroll_into_view_if_needed()
    question(page, number).get_by_role("radio").nth(number).check()
    press(page, number, COMMIT)


def test_text_below_opens_when_all_is_predicted_and_stays_open(page: Page, lesson: str) -> None:
    page.goto(lesson)
    for hidden in ("It swings down", "Far it is"):
        expect(page.get_by_text(hidden)).to_be_hidden()
    for selector in (".lab", "#after-it", ".gate"):
        expect(page.locator(selector).first).to_be_visible()
    assert violations(page, ".prose") == []
    answer(page, 0)
    expect(page.get_by_text("It swings down")).to_be_hidden()
    answer(page, 1)
    expect(page.get_by_text("It swings down")).to_be_visible()
    expect(page.locator(f"{HIDDEN_ELEMENTS}, .gate")).to_have_count(0)
    expect(question(page, 1).get_by_role("button", name=COMMIT)).to_be_focused()
    page.goto("about:blank")
    page.goto(lesson)
    expect(page.get_by_text("It swings down")).to_be_visible()
    expect(page.locator(f"{HIDDEN_ELEMENTS}, .gate")).to_have_count(0)


def test_lab_runs_as_it_was_asked_about(page: Page, lesson: str) -> None:
    page.goto(lesson)
    lab = page.locator(".lab")
    answer(page, 0)
    expect(lab).to_have_attribute("data-state", "playing")
    expect(lab.get_by_role("slider", name="angle")).to_have_value("2")
    answer(page, 1)
    expect(lab.get_by_role("slider", name="angle")).to_have_value("0.1")  # it starts anew
    expect(lab).to_have_attribute("data-state", "playing")


def test_reader_can_open_the_text_without_an_answer(page: Page, lesson: str) -> None:
    page.goto(lesson)
    page.get_by_role("button", name="Show it now").press("Enter")
    expect(page.get_by_text("It swings down")).to_be_focused()
    expect(page.locator(f"{HIDDEN_ELEMENTS}, .gate")).to_have_count(0)
    expect(page.locator(".question.is-live [aria-disabled=true]")).to_have_count(0)


def test_link_into_the_text_opens_it(page: Page, lesson: str) -> None:
    for anchor in ("#eq:far", "#far.L1", "#far.L1-L1"):
        page.goto("about:blank")
        page.goto(lesson + anchor)
        expect(page.get_by_text("It swings down")).to_be_visible()
    page.goto("about:blank")
    page.goto(lesson)
    expect(page.get_by_text("It swings down")).to_be_hidden()
    page.get_by_role("link", name="above").click()
    expect(page.get_by_text("It swings down")).to_be_visible()


def test_all_is_on_paper_and_in_narrow_windows_only_what_is_open(page: Page, lesson: str) -> None:
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto(lesson)
    heights = "es => es.map((e) => e.getBoundingClientRect().height > 0)"
    becomes(page, lambda: set(page.locator(HIDDEN_ELEMENTS).evaluate_all(heights)), {False})
    page.emulate_media(media="print")
    expect(page.locator(".gate")).to_be_hidden()
    becomes(page, lambda: set(page.locator(HIDDEN_ELEMENTS).evaluate_all(heights)), {True})
