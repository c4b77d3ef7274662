"""A reader's progress: marks on the map, going on, and storage that is closed or damaged."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, Route, expect

from support.chromium import OpenAddress
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


DRAWN_FIRST = """
const shifts = []
const inMain = (node) => node?.parentElement?.closest('main')
const add = ({ sources }) => shifts.push(...sources.map(({ node }) => node).filter(inMain))
const see = (entries) => entries.forEach(add)
const observer = new PerformanceObserver((list) => see(list.getEntries()))
observer.observe({ type: 'layout-shift', buffered: true })
window.moved = () => {
  see(observer.takeRecords())
  return shifts.map((node) => node.outerHTML ?? node.textContent)
}
"""
MOVED_AFTER_DRAWING = """() => new Promise((done) => {
  const drawn = (then) => requestAnimationFrame(() => requestAnimationFrame(then))
  drawn(() => drawn(() => done(window.moved())))
})"""


def test_marks_move_nothing(open_address: OpenAddress, site: str) -> None:
    """Neither on a wide screen nor on a narrow one, and not when they come after the text.

    The fonts are left out: what they move is another matter, measured in `test_lighthouse.py`.
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
