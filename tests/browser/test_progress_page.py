"""The page of a reader's progress: saving, forgetting, bringing in, and keys alone."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from support.chromium import OpenAddress
from support.lab_page import becomes, until
from support.reader_page import (
    FALL_PAGE,
    OVERALL,
    PUSH_PAGE,
    WAY,
    choose,
    question,
    store_answers,
    stored_progress,
)

pytestmark = pytest.mark.browser

IMPORT_STATUS = '[data-control="import"] [role=status]'
"""What the page says of a file that was brought in."""


def focus_on(page: Page, text: str) -> None:
    expect(page.locator(":focus")).to_have_text(text)


def test_saving_forgetting_and_bringing_in(
    open_address: OpenAddress, browsers: Mapping[str, Browser], site: str, tmp_path: Path
) -> None:
    lesson = open_address(site + FALL_PAGE)
    choose(question(lesson, "way"), "Up")
    lesson.get_by_role("button", name="Mark as read").click()
    page = open_address(site + "progress/")
    overall = page.locator(OVERALL)
    expect(overall).to_contain_text("1 of 3 lessons read")
    expect(overall).to_contain_text("0 of 8 tasks done")
    today = "() => `progress-motion-${new Date().toISOString().slice(0, 10)}.json`"
    dates = [page.evaluate(today)]
    with page.expect_download() as saving:
        page.get_by_role("button", name="Save as a file").first.click()
    dates.append(page.evaluate(today))
    assert saving.value.suggested_filename in dates
    file = tmp_path / "saved.json"
    saving.value.save_as(file)
    assert json.loads(file.read_text("utf-8")) == stored_progress(page)

    page.get_by_role("button", name="Forget everything").click()
    ask = page.get_by_role("dialog", name="Forget everything?")
    expect(ask).to_contain_text("1 answer and 1 lesson are forgotten")
    ask.get_by_role("button", name="Forget", exact=True).click()
    expect(overall).to_contain_text("Nothing yet.")
    expect(lesson.get_by_role("button", name="Mark as read")).to_be_visible()
    expect(question(lesson, "way").get_by_label("Up", exact=False)).not_to_be_checked()

    page.locator("input[type=file]").set_input_files(file)
    status = page.locator(IMPORT_STATUS)
    expect(status).to_contain_text("2 things in the file are not here")
    expect(overall).to_contain_text("Nothing yet.")  # what was forgotten stays so
    status.get_by_role("button", name="Bring back what was forgotten").click()
    expect(status).to_contain_text("Imported: 1 answer and 1 lesson")
    expect(overall).to_contain_text("1 of 3 lessons read")
    page.locator("input[type=file]").set_input_files(file)
    expect(status).to_have_text("Everything in the file was here already.")

    with browsers["plain"].new_context() as second_context:
        phone = second_context.new_page()
        phone.goto(site + PUSH_PAGE)
        phone.get_by_role("button", name="Mark as read").click()
        phone.goto(site + "progress/")
        phone.locator("input[type=file]").set_input_files(file)
        expect(phone.locator(IMPORT_STATUS)).to_contain_text("Imported: 1 answer and 1 lesson ")
        expect(phone.locator(OVERALL)).to_contain_text("2 of 3 lessons read")


START = '{"coursebuild":"progress","version":'
WRONG_FILES = (
    (b"\xff\xfe\x00", "The file is not saved progress: it can’t be read as JSON"),
    (b'{"a": 1}', "The file does not hold the progress of a course. Nothing was changed."),
    (f"{START}9}}".encode(), "The file was saved by a newer version of this site."),
    (
        f'{START}1,"course":"<img src=x onerror=alert(1)>"}}'.encode(),
        "The file is of another course, “<img src=x onerror=alert(1)>”. Nothing was changed.",
    ),
    (
        f'{START}1,"course":"motion","reset":0,"lessons":{{}},'
        '"answers":{"q":{"<b>k":{"answer":{"tick":1}}}}}'.encode(),
        "The file is damaged: what it says at “answers, q, <b>k, answer” makes no sense.",
    ),
)


def test_wrong_files_change_nothing(open_address: OpenAddress, site: str, tmp_path: Path) -> None:
    page = open_address(site)
    store_answers(page, WAY)
    page.goto(site + "progress/")
    before = stored_progress(page)
    for data, message in WRONG_FILES:
        (tmp_path / "wrong.json").write_bytes(data)
        page.locator("input[type=file]").set_input_files(tmp_path / "wrong.json")
        expect(page.locator(IMPORT_STATUS)).to_contain_text(message)
        becomes(page, lambda: stored_progress(page), before)


def test_what_is_no_longer_in_the_course_is_shown_and_can_be_forgotten(
    open_address: OpenAddress, site: str
) -> None:
    page = open_address(site)
    store_answers(
        page,
        {"quiz": "<i>gone", "key": "x", "lesson": "7.7", "number": 3},
        {**WAY, "key": "was", "number": 9},
        WAY,
    )
    page.goto(site + "progress/")
    orphans = page.locator('[data-progress="orphans"]')
    first = "Question 3 of quiz “<i>gone”, lesson 7.7 (wrong)"
    second = "Question 9 of quiz “fall”, lesson 1.2 (wrong)"
    expect(orphans.locator("li")).to_contain_text([second, first])
    orphans.get_by_role("button", name=f"Forget: {first}").click()
    expect(orphans.locator("li")).to_have_count(1)
    focus_on(page, "No longer in the course")
    orphans.get_by_role("button", name="Forget all of these").click()
    expect(orphans).to_be_hidden()
    page.reload()
    expect(page.locator(OVERALL)).to_contain_text("0 of 8 tasks done")
    expect(orphans).to_be_hidden()


def test_everything_works_from_the_keyboard(open_address: OpenAddress, site: str) -> None:
    page = open_address(site)
    store_answers(page, WAY)
    page.goto(site + "review/")
    press(page, "Begin")
    expect(question(page, "way").locator(".quiz-check")).to_be_visible()
    tab_to(page, "Up", property="labels?.[0]?.innerText")
    page.keyboard.press("ArrowDown")
    press(page, "Check")
    expect(page.locator(".verdict")).to_contain_text("Right")
    press(page, "Next question")
    focus_on(page, "Done: 1 of 1 right.")
    page.goto(site + "progress/")
    expect(page.locator(OVERALL)).to_contain_text("1 of 8 tasks done")
    press(page, "Forget everything")
    focus_on(page, "Cancel")
    page.keyboard.press("Escape")
    focus_on(page, "Forget everything")
    page.keyboard.press("Enter")
    press(page, "Forget")
    expect(page.locator(OVERALL)).to_contain_text("Nothing yet.")
    press(page, "Undo")
    expect(page.locator(OVERALL)).to_contain_text("1 of 8 tasks done")
    focus_on(page, "Forget everything")


def tab_to(page: Page, text: str, property: str = "innerText") -> None:
    """Press Tab until the element of this text has the focus."""
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate(f"() => document.activeElement?.{property}?.trim()") == text:
            return
    raise AssertionError(f"Tab does not come to {text!r}")


def press(page: Page, text: str) -> None:
    tab_to(page, text)
    page.keyboard.press("Enter")


SMALLEST = """(part) => Math.min(...[...part.querySelectorAll('button, input[type=file], summary')]
  .filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect())
  .map(({ width, height }) => Math.min(width, height)))"""


def test_what_can_be_pressed_is_large_enough(open_address: OpenAddress, site: str) -> None:
    page = open_address(site)
    store_answers(page, {**WAY, "quiz": "gone"})
    page.set_viewport_size({"width": 320, "height": 640})
    for path, part, button in (
        ("progress/", "main", "Forget all of these"),
        (PUSH_PAGE, ".lesson-end", "Mark as read"),
    ):
        page.goto(site + path)
        expect(page.get_by_role("button", name=button)).to_be_visible()
        becomes(page, lambda: page.locator(part).evaluate(SMALLEST) >= 24, True)  # noqa: B023
        until(page, "document.documentElement.scrollWidth <= innerWidth")
