"""A reader's progress: marks on the map and the page of it; storage that is closed or damaged."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, Route, expect

from support.chromium import OpenAddress
from support.fixture_cases import fixture_text
from support.lab_page import becomes, until, wait_for_condition
from support.reader_page import (
    FALL_PAGE,
    KEY,
    OVERALL,
    PUSH_PAGE,
    WAY,
    choose,
    question,
    store_answers,
    stored_progress,
)

pytestmark = pytest.mark.browser


def expect_mark(page: Page, id: str, text: str) -> None:
    """The mark of a lesson, as it is read out, comes to begin with a text."""
    place = page.locator(f'[data-lesson="{id}"] [data-mark]')
    wait_for_condition(
        page, lambda: " ".join((place.text_content() or "").split()).startswith(text)
    )


def lesson_end(page: Page) -> Locator:
    return page.locator('[data-progress="lesson"]')


def test_answers_and_lessons_show_on_the_map_at_once_in_another_tab(
    open_address: OpenAddress, site: str
) -> None:
    home, lesson = open_address(site), open_address(site + PUSH_PAGE)
    expect(home.locator(".start a")).to_have_text("Start with 1.1 Push & <em>pull</em>")
    expect(home.locator("[data-mark]")).to_have_text([""] * 3)
    choose(question(lesson, "smoke"), "Up")
    expect_mark(home, "1.1", "begun1/3, 1 of 3 tasks done")
    end = lesson_end(lesson)
    expect(end.get_by_role("status")).to_have_text("Not marked as read.")
    end.get_by_role("button", name="Mark as read").click()
    expect(end.get_by_role("status")).to_have_text("You have read this lesson.")
    expect(end.get_by_role("button")).to_have_text("Mark as not read")
    lesson_list = lesson.locator(".level-nav")
    expect(lesson_list.locator("a", has=lesson.locator(".tick"))).to_have_text(
        "1.1 Push & <em>pull</em> read"
    )
    expect_mark(home, "1.1", "read1/3")
    summary = home.locator('[data-progress="summary"]')
    expect(summary).to_have_text(re.compile(r"1 of 3 read\s*1 of 7 tasks done"))
    expect(home.locator(".start a")).to_contain_text("Continue with 1.2 Free fall")
    choose(question(lesson, "smoke"), "Down")
    expect_mark(home, "1.1", "read0/3")
    choose(question(lesson, "smoke"), "Up")
    choose(lesson.locator(".question").nth(0), "Down")
    lesson.locator(".question").nth(1).get_by_role("textbox").fill("4")
    lesson.locator(".question").nth(1).locator(".quiz-check").click()
    expect_mark(home, "1.1", "right3/3, 3 of 3 tasks done")
    home.goto(site + "levels/1.html")
    expect_mark(home, "1.1", "right3/3")


def test_home_page_leads_back_to_the_section(calm: BrowserContext, site: str) -> None:
    page = calm.new_page()
    page.clock.install()
    page.goto(site + PUSH_PAGE)
    page.evaluate("() => document.getElementById('law').scrollIntoView()")
    is_written = f"() => localStorage.getItem('{KEY}') !== null"
    wait_for_condition(page, lambda: page.clock.run_for(1000) or page.evaluate(is_written))
    page.goto(site)
    start = page.locator('[data-progress="start"]')
    expect(start.locator("a")).to_have_text("Continue with 1.1 Push & <em>pull</em>")
    expect(start.locator("[data-note]")).to_have_text(re.compile("^at “The x.*law & its reach”$"))
    start.locator("a").click()
    expect(page).to_have_url(site + PUSH_PAGE + "#law")


def test_lesson_read_to_its_end_counts_as_read_and_what_the_reader_says_holds(
    calm: BrowserContext, site: str
) -> None:
    page = calm.new_page()
    page.clock.install()
    page.goto(site + PUSH_PAGE)
    status = lesson_end(page).get_by_role("status")
    height = page.evaluate("() => document.documentElement.scrollHeight")
    for top in range(0, height, 400):
        page.evaluate("top => scrollTo(0, top)", top)
        page.clock.run_for(2100)
    expect(status).to_have_text("You have read this lesson.")
    page.get_by_role("button", name="Mark as not read").click()
    page.clock.run_for(60_000)
    expect(status).to_have_text("Not marked as read.")
    expect(page.locator(":focus")).to_have_text("Mark as read")


DRAWN_FIRST = fixture_text("scripts/drawn_first.js")
MOVED_AFTER_DRAWING = """() => new Promise((done) => {
  const drawn = (then) => requestAnimationFrame(() => requestAnimationFrame(then))
  drawn(() => drawn(() => done(window.moved())))
})"""


def test_marks_move_nothing(open_address: OpenAddress, site: str) -> None:
    """Neither on a wide screen nor on a narrow one, and not when they come after the text.

    The fonts are left out: what they move is another matter, measured in `test_performance.py`.
    """
    page = open_address(site + FALL_PAGE)
    store_answers(page, WAY, {"quiz": "push.check_1", "key": "smoke", "right": True, "number": 3})
    quiet = page.context.new_page()
    quiet.route("**/*.woff2", lambda route: route.abort())
    quiet.add_init_script(DRAWN_FIRST)
    held_routes: list[Route] = []
    quiet.route("**/assets/site.*.js", lambda route: held_routes.append(route))
    for width in (320, 1440):
        quiet.set_viewport_size({"width": width, "height": 900})
        for path in ("", "levels/1.html", "progress/", "review/"):
            quiet.goto(site + path, wait_until="commit")
            wait_for_condition(quiet, lambda: len(held_routes) > 0)
            quiet.evaluate(MOVED_AFTER_DRAWING)  # the page is drawn before its script comes
            held_routes.pop().continue_()
            quiet.wait_for_load_state()
            expect(quiet.locator("[data-tools] select")).to_have_count(1)
            becomes(quiet, lambda: (path, quiet.evaluate(MOVED_AFTER_DRAWING)), (path, []))  # noqa: B023
            until(quiet, "document.documentElement.scrollWidth <= innerWidth")


CLOSED_STORAGE = """
const closed = () => { throw new DOMException('no', 'SecurityError') }
Object.defineProperty(window, 'localStorage', { get: closed })
"""
FULL = """
Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError') }
"""


@pytest.mark.parametrize(
    ("script", "message"),
    [(CLOSED_STORAGE, "This browser keeps nothing"), (FULL, "This browser has no room left")],
    ids=["closed", "full"],
)
def test_without_storage_every_page_works_and_says_so(
    calm: BrowserContext, open_address: OpenAddress, site: str, script: str, message: str
) -> None:
    calm.add_init_script(script)
    page = open_address(site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    expect(lesson_end(page).get_by_role("status")).to_have_text("You have read this lesson.")
    expect(lesson_end(page).locator(".lesson-trouble")).to_contain_text(message)
    choose(question(page, "smoke"), "Up")
    expect(question(page, "smoke").locator(".verdict")).to_contain_text("Right")
    page.get_by_label("Colours").select_option("dark")
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
    page.locator(".search-open").click()
    page.locator(".search-keys input").uncheck()
    page.locator("#_search-field").fill("free fall")
    expect(page.locator(".search-option").first).to_contain_text("1.2 Free fall")
    page.goto(site + "progress/")
    expect(page.locator(OVERALL)).to_contain_text("Nothing yet.")
    page.goto(site)
    expect(page.locator(".start a")).to_contain_text("Start with")


def test_damaged_storage_is_put_aside_and_can_be_saved(
    open_address: OpenAddress, site: str, tmp_path: Path
) -> None:
    page = open_address(site)
    page.evaluate("key => localStorage.setItem(key, '{\"coursebuild\"')", KEY)
    page.goto(site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    expect(lesson_end(page).get_by_role("status")).to_have_text("You have read this lesson.")
    page.goto(site + "progress/")
    expect(page.locator(OVERALL)).to_contain_text("1 of 3 lessons")
    part = page.locator(".aside-part")
    with page.expect_download() as saving:
        part.get_by_role("button", name="Save it as a file").click()
    saving.value.save_as(tmp_path / "damaged")
    assert (tmp_path / "damaged").read_text("utf-8") == '{"coursebuild"'
    part.get_by_role("button", name="Remove it").click()
    expect(part).to_have_count(0)
    page.reload()
    expect(page.locator(OVERALL)).to_contain_text("1 of 3 lessons")
    expect(part).to_have_count(0)


def test_newer_version_is_left_alone(open_address: OpenAddress, site: str) -> None:
    page = open_address(site)
    newer = '{"coursebuild":"progress","version":2,"course":"motion"}'
    page.evaluate("([key, text]) => localStorage.setItem(key, text)", [KEY, newer])
    page.goto(site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    trouble = "A newer version of this site has written your progress."
    expect(page.locator(".lesson-trouble")).to_contain_text(trouble)
    becomes(page, lambda: page.evaluate("key => localStorage.getItem(key)", KEY), newer)


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
        expect(phone.get_by_role("button", name="Mark as not read")).to_be_visible()
        phone.goto(site + "progress/")
        expect(phone.locator(OVERALL)).to_contain_text("1 of 3 lessons read")
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
