"""The review: missed questions come back when they are due."""

from __future__ import annotations

from playwright.sync_api import BrowserContext

from support.lab_page import comes, until
from support.reader_course import PUSH
from support.reader_page import (
    FALL_PAGE,
    PUSH_PAGE,
    SAID,
    choose,
    opened,
    put,
    question,
    quiet,
)
from support.scratch_course import Folder


def test_missed_questions_come_back(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(
        page,
        {"quiz": "push.check_1", "key": "smoke", "number": 3},
        {"quiz": "fall", "key": "way", "lesson": "1.2"},
        {"quiz": "fall", "key": "swing", "lesson": "1.2", "kind": "predict", "number": 2},
        {"quiz": "fall", "key": "steps", "lesson": "1.2", "right": True, "kind": "order"},
        {"quiz": "gone", "key": "x", "lesson": "7.7"},
    )
    page.goto(site + "review/")
    review = page.locator('[data-progress="review"]')
    assert review.locator(".due").inner_text() == "3 questions are due."
    assert "One more was missed, of which the course no longer" in review.inner_text()
    page.get_by_role("button", name="Begin").click()
    comes(page, lambda: question(page, "smoke").is_visible())
    assert page.locator(":focus").inner_text() == "Question 1 of 3"
    assert not question(page, "smoke").get_by_label("Up").is_checked(), "nothing is shown of before"
    choose(page, question(page, "smoke"), "Up")
    page.get_by_role("button", name="Next question").click()

    comes(page, lambda: question(page, "way").is_visible())
    picture = question(page, "way").locator("img")
    until(page, "() => document.querySelector('.question img').naturalWidth === 9")
    assert picture.get_attribute("src") == site + "files/lessons/stone.svg"
    choose(page, question(page, "way"), "Up")
    page.get_by_role("button", name="Next question").click()

    comes(page, lambda: question(page, "swing").is_visible())
    assert page.locator("[data-lab]").count() == 0
    choose(page, question(page, "swing"), "Left")
    link = page.get_by_role("link", name="See what happens, in the lesson")
    assert link.get_attribute("href") == f"{site}{FALL_PAGE}#fall.swing"
    page.get_by_role("button", name="Next question").click()
    assert page.locator(":focus").inner_text() == "Done: 2 of 3 right."
    assert review.locator(".due").inner_text() == "Nothing is due."
    assert "One comes back in a day. 2 come back in 3 days." in review.inner_text()
    page.reload()
    assert review.locator(".due").inner_text() == "Nothing is due."
    page.goto(site + FALL_PAGE)
    assert question(page, "way").get_by_label("Up").is_checked(), "the lesson shows it too"
    assert quiet(page), SAID[page]


def test_a_question_that_cannot_be_fetched_is_linked(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.goto(site + "review/")
    page.route("**/lessons/*", lambda route: route.fulfill(status=500, body="no"))
    page.get_by_role("button", name="Begin").click()
    link = page.get_by_role("link", name="question 1 in its lesson")
    assert link.get_attribute("href") == f"{site}{FALL_PAGE}#fall.way"
    page.get_by_role("button", name="Skip").click()
    assert page.locator(".due").inner_text() == "One question is due."


def test_from_disk_there_are_links(calm: BrowserContext, reader: Folder) -> None:
    page = opened(calm, (reader.root / "public/review/index.html").as_uri())
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.reload()
    link = page.get_by_role("link", name="question 1 in its lesson")
    assert "Pages opened from disk" in page.locator('[data-progress="review"]').inner_text()
    link.click()
    assert page.url.endswith(f"public/{FALL_PAGE}#fall.way")


def test_a_reworded_question_keeps_its_answer_and_its_turn(
    calm: BrowserContext, site: str, reader: Folder
) -> None:
    page = opened(calm, site + PUSH_PAGE)
    choose(page, page.locator(".question").first, "Up")
    old = page.locator(".question").first.get_attribute("data-question")
    reader.write("content/lessons/1.1-push.md", PUSH.replace("Where does a", "Whither a"))
    try:
        assert reader.main("build").status == 0
        page.reload()
        first = page.locator(".question").first
        new = first.get_attribute("data-question")
        assert new != old
        assert first.get_by_label("Up").is_checked()
        page.goto(site + "progress/")
        assert not page.locator('[data-progress="orphans"]').is_visible()
        page.goto(site + "review/")
        assert "One comes back in a day." in page.locator('[data-progress="review"]').inner_text()
    finally:
        reader.write("content/lessons/1.1-push.md", PUSH)
        assert reader.main("build").status == 0
