"""The review: missed questions come back when they are due."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Locator, expect

from support.built_sites import Site
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
from support.static_host import Host

pytestmark = pytest.mark.browser


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
    due = review.locator(".due")
    expect(due).to_have_text("3 questions are due.")
    expect(review).to_contain_text(
        "One more was missed, but its question is no longer in the course."
    )
    page.get_by_role("button", name="Begin").click()
    expect(question(page, "smoke")).to_be_visible()
    expect(page.locator(":focus")).to_have_text("Question 1 of 3")
    # Nothing is shown of what was answered before.
    expect(question(page, "smoke").get_by_label("Up")).not_to_be_checked()
    choose(page, question(page, "smoke"), "Up")
    page.get_by_role("button", name="Next question").click()

    expect(question(page, "way")).to_be_visible()
    picture = question(page, "way").locator("img")
    expect(picture).to_have_js_property("naturalWidth", 9)
    expect(picture).to_have_attribute("src", site + "files/lessons/stone.svg")
    choose(page, question(page, "way"), "Up")
    page.get_by_role("button", name="Next question").click()

    expect(question(page, "swing")).to_be_visible()
    expect(page.locator("[data-lab]")).to_have_count(0)
    choose(page, question(page, "swing"), "Left")
    link = page.get_by_role("link", name="See what happens, in the lesson")
    expect(link).to_have_attribute("href", f"{site}{FALL_PAGE}#fall.swing")
    page.get_by_role("button", name="Next question").click()
    expect(page.locator(":focus")).to_have_text("Done: 2 of 3 right.")
    expect(due).to_have_text("Nothing is due.")
    expect(review).to_contain_text("One comes back in a day. 2 come back in 3 days.")
    page.reload()
    expect(due).to_have_text("Nothing is due.")
    page.goto(site + FALL_PAGE)
    expect(live(question(page, "way")).get_by_label("Up")).to_be_checked()
    assert quiet(page), SAID[page]


def live(found: Locator) -> Locator:
    """A question comes alive when it comes near."""
    found.scroll_into_view_if_needed()
    return found


def test_question_that_cannot_be_fetched_is_linked(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.goto(site + "review/")
    page.route("**/lessons/*", lambda route: route.fulfill(status=500, body="no"))
    page.get_by_role("button", name="Begin").click()
    link = page.get_by_role("link", name="question 1 in its lesson")
    expect(link).to_have_attribute("href", f"{site}{FALL_PAGE}#fall.way")
    page.get_by_role("button", name="Skip").click()
    expect(page.locator(".due")).to_have_text("One question is due.")


def test_review_opened_from_disk_links_to_questions(calm: BrowserContext, reader: Site) -> None:
    page = opened(calm, (reader.public / "review/index.html").as_uri())
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.reload()
    link = page.get_by_role("link", name="question 1 in its lesson")
    expect(page.locator('[data-progress="review"]')).to_contain_text("Pages opened from disk")
    link.click()
    page.wait_for_url(f"**/public/{FALL_PAGE}#fall.way")


def test_reworded_question_keeps_its_answer_and_its_turn(
    calm: BrowserContext, reader: Site, tmp_path: Path
) -> None:
    folder = Folder(tmp_path / "course")
    shutil.copytree(reader.root, folder.root, symlinks=True)
    with Host(folder.root / "public") as host:
        site = host.url
        page = opened(calm, site + PUSH_PAGE)
        first = page.locator(".question").first
        choose(page, first, "Up")
        expect(first.locator(".verdict")).to_contain_text("Not right.")
        old = first.get_attribute("data-question")
        assert old is not None
        folder.replace("content/lessons/1.1-push.md", "Where does a", "Whither a")
        done = folder.main("build")
        assert done.status == 0, done.out + done.err
        page.reload()
        expect(first).not_to_have_attribute("data-question", old)
        expect(live(first).get_by_label("Up")).to_be_checked()
        page.goto(site + "progress/")
        expect(page.locator('[data-progress="overall"]')).to_contain_text("0 of 8 tasks done")
        expect(page.locator('[data-progress="orphans"]')).to_be_hidden()
        page.goto(site + "review/")
        review = page.locator('[data-progress="review"]')
        expect(review).to_contain_text("One comes back in a day.")
