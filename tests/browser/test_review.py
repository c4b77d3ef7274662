"""The review: missed questions come back when they are due."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from support.built_sites import Site
from support.chromium import OpenAddress
from support.reader_page import FALL_PAGE, OVERALL, PUSH_PAGE, WAY, choose, question, store_answers
from support.scratch_course import Folder
from support.static_host import Host

pytestmark = pytest.mark.browser


def review_of(page: Page) -> Locator:
    return page.locator('[data-progress="review"]')


def is_chosen(part: Locator, option: str) -> None:
    expect(part.get_by_label(option)).to_be_checked()


def test_missed_questions_come_back(open_address: OpenAddress, site: str) -> None:
    page = open_address(site)
    store_answers(
        page,
        {"quiz": "push.check_1", "key": "smoke", "number": 3},
        WAY,
        {**WAY, "key": "swing", "kind": "predict", "number": 2},
        {**WAY, "key": "steps", "right": True, "kind": "order"},
        {"quiz": "gone", "key": "x", "lesson": "7.7"},
    )
    page.goto(site + "review/")
    due, following = page.locator(".due"), page.get_by_role("button", name="Next question")
    expect(due).to_have_text("3 questions are due.")
    orphan_text = "One more was missed, but its question is no longer in the course."
    expect(review_of(page)).to_contain_text(orphan_text)
    page.get_by_role("button", name="Begin").click()
    expect(page.locator(":focus")).to_have_text("Question 1 of 3")
    # Nothing is shown of what was answered before.
    expect(question(page, "smoke").get_by_label("Up")).not_to_be_checked()
    choose(question(page, "smoke"), "Up")
    following.click()

    picture = question(page, "way").locator("img")
    expect(picture).to_have_js_property("naturalWidth", 9)
    expect(picture).to_have_attribute("src", site + "files/lessons/stone.svg")
    choose(question(page, "way"), "Up")
    following.click()

    expect(question(page, "swing")).to_be_visible()
    expect(page.locator("[data-lab]")).to_have_count(0)
    choose(question(page, "swing"), "Left")
    link = page.get_by_role("link", name="See what happens, in the lesson")
    expect(link).to_have_attribute("href", f"{site}{FALL_PAGE}#fall.swing")
    following.click()
    expect(page.locator(":focus")).to_have_text("Done: 2 of 3 right.")
    expect(due).to_have_text("Nothing is due.")
    expect(review_of(page)).to_contain_text("One comes back in a day. 2 come back in 3 days.")
    page.reload()
    expect(due).to_have_text("Nothing is due.")
    page.goto(site + FALL_PAGE)
    is_chosen(question(page, "way"), "Up")


def test_question_that_cannot_be_fetched_is_linked(open_address: OpenAddress, site: str) -> None:
    page = open_address(site + "about.html")
    store_answers(page, WAY)
    page = page.context.new_page()
    page.route("**/lessons/*", lambda route: route.fulfill(status=500, body="no"))
    page.goto(site + "review/")
    page.get_by_role("button", name="Begin").click()
    link = page.get_by_role("link", name="question 1 in its lesson")
    expect(link).to_have_attribute("href", f"{site}{FALL_PAGE}#fall.way")
    page.get_by_role("button", name="Skip").click()
    expect(page.locator(".due")).to_have_text("One question is due.")


def test_review_opened_from_disk_links_to_questions(
    open_address: OpenAddress, sites: Mapping[str, Site]
) -> None:
    page = open_address((sites["reader"].public / "review/index.html").as_uri())
    store_answers(page, WAY)
    page.reload()
    expect(review_of(page)).to_contain_text("Pages opened from disk")
    page.get_by_role("link", name="question 1 in its lesson").click()
    page.wait_for_url(f"**/public/{FALL_PAGE}#fall.way")


def test_reworded_question_keeps_its_answer_and_its_turn(
    open_address: OpenAddress, sites: Mapping[str, Site], tmp_path: Path
) -> None:
    folder = Folder(tmp_path / "course")
    shutil.copytree(sites["reader"].root, folder.root, symlinks=True)
    with Host(folder.root / "public") as host:
        page = open_address(host.url + PUSH_PAGE)
        first = page.locator(".question").first
        choose(first, "Up")
        expect(first.locator(".verdict")).to_contain_text("Not right.")
        old = first.get_attribute("data-question") or ""
        folder.replace("content/lessons/1.1-push.md", "Where does a", "Whither a")
        assert folder.main("build").status == 0
        page.reload()
        expect(first).not_to_have_attribute("data-question", old)
        is_chosen(first, "Up")
        page.goto(host.url + "progress/")
        expect(page.locator(OVERALL)).to_contain_text("0 of 8 tasks done")
        expect(page.locator('[data-progress="orphans"]')).to_be_hidden()
        page.goto(host.url + "review/")
        expect(review_of(page)).to_contain_text("One comes back in a day.")
