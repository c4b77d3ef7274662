"""A reader's progress: marks on the map, going on, and storage that is closed or damaged."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Route

from support.lab_page import comes, until
from support.reader_page import (
    KEY,
    PUSH_PAGE,
    SAID,
    choose,
    mark,
    opened,
    put,
    question,
    quiet,
)


def test_at_first_a_page_is_as_it_was_built(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    assert page.locator(".start a").inner_text() == "Start with 1.1 Push & <em>pull</em>"
    assert page.locator("[data-mark]").all_text_contents() == [""] * 4
    assert page.evaluate("() => localStorage.length") == 0
    assert quiet(page), SAID[page]


def test_answers_and_lessons_show_on_the_map_at_once_in_another_tab(
    calm: BrowserContext, site: str
) -> None:
    home, lesson = opened(calm, site), opened(calm, site + PUSH_PAGE)
    choose(lesson, question(lesson, "smoke"), "Up")
    comes(home, lambda: mark(home, "1.1") == "begun1/3, 1 of 3 questions right")
    end = lesson.locator('[data-progress="lesson"]')
    assert end.get_by_role("status").inner_text() == "Not marked as read."
    end.get_by_role("button", name="Mark as read").click()
    assert end.get_by_role("status").inner_text() == "You have read this lesson."
    assert end.get_by_role("button").inner_text() == "Mark as not read"
    comes(home, lambda: mark(home, "1.1").startswith("read1/3"))
    assert home.locator('[data-progress="summary"]').inner_text().split("\n") == [
        "1 of 3 read",
        "1 of 7 questions right",
    ]
    assert home.locator(".start a").inner_text().startswith("Continue with 1.2 Free fall")
    choose(lesson, question(lesson, "smoke"), "Down")
    for index, answer in ((0, "Down"), (2, "Up")):
        again = lesson.locator(".question").nth(index)
        if again.get_by_role("button", name="Try again").is_visible():
            again.get_by_role("button", name="Try again").click()
        choose(lesson, again, answer)
    lesson.locator(".question").nth(1).get_by_role("textbox").fill("4")
    lesson.locator(".question").nth(1).locator(".quiz-check").click()
    comes(home, lambda: mark(home, "1.1") == "right3/3, 3 of 3 questions right")
    home.reload()
    assert mark(home, "1.1").startswith("right3/3")
    level = opened(calm, site + "levels/1.html")
    assert mark(level, "1.1").startswith("right3/3")
    assert quiet(home, lesson, level)


def test_the_home_page_leads_back_to_the_section(calm: BrowserContext, site: str) -> None:
    lesson = opened(calm, site + PUSH_PAGE)
    lesson.evaluate("() => document.getElementById('law').scrollIntoView()")
    until(lesson, f"() => localStorage.getItem('{KEY}') !== null")
    lesson.close()
    page = opened(calm, site)
    start = page.locator('[data-progress="start"]')
    assert start.locator("a").inner_text() == "Continue with 1.1 Push & <em>pull</em>"
    note = start.locator("[data-note]").inner_text()
    assert note.startswith("at “The x")
    assert note.endswith("law & its reach”")
    start.locator("a").click()
    page.wait_for_load_state()  # Chromium may not close a window that is on its way
    assert page.url == site + PUSH_PAGE + "#law"


def test_a_lesson_read_to_its_end_counts_as_read_and_what_the_reader_says_holds(
    calm: BrowserContext, site: str
) -> None:
    page = calm.new_page()
    page.clock.install()
    page.goto(site + PUSH_PAGE)
    status = page.locator('[data-progress="lesson"]').get_by_role("status")
    height = page.evaluate("() => document.documentElement.scrollHeight")
    for top in range(0, height, 400):
        page.evaluate("top => scrollTo(0, top)", top)
        page.clock.run_for(2100)
    comes(page, lambda: status.inner_text() == "You have read this lesson.")
    page.get_by_role("button", name="Mark as not read").click()
    page.clock.run_for(60_000)
    assert status.inner_text() == "Not marked as read."
    assert page.locator(":focus").inner_text() == "Mark as read"


def late(route: Route) -> None:
    time.sleep(0.2)
    route.continue_()


def test_marks_move_nothing(calm: BrowserContext, site: str) -> None:
    """Neither on a wide screen nor on a narrow one, and not when they come after the text.

    The fonts are left out: what they move is another matter, measured in `test_lighthouse.py`.
    """
    page = opened(calm, site)
    page.route("**/*.woff2", lambda route: route.abort())
    page.route("**/assets/site.*.js", late)
    put(
        page,
        {"quiz": "fall", "key": "way", "lesson": "1.2"},
        {"quiz": "push.check_1", "key": "smoke", "right": True, "number": 3},
    )
    moved = """() => new Promise((done) => {
      const moved = []
      const inMain = (node) => node?.parentElement?.closest('main')
      const add = ({ sources }) => moved.push(...sources.map(({ node }) => node).filter(inMain))
      const observer = new PerformanceObserver((list) => list.getEntries().forEach(add))
      observer.observe({ type: 'layout-shift', buffered: true })
      setTimeout(() => done(moved.map((node) => node.outerHTML ?? node.textContent)), 300)
    })"""
    for width in (320, 360, 800, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        for path in ("", "levels/1.html", "progress/", "review/"):
            page.goto(site + path)
            assert page.evaluate(moved) == [], (width, path)
            room = "() => document.documentElement.scrollWidth - innerWidth"
            assert page.evaluate(room) <= 0


CLOSED = """
const closed = () => { throw new DOMException('no', 'SecurityError') }
Object.defineProperty(window, 'localStorage', { get: closed })
"""
FULL = """
Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError') }
"""


@pytest.mark.parametrize(
    ("script", "message"),
    [(CLOSED, "This browser keeps nothing"), (FULL, "This browser has no room left")],
    ids=["closed", "full"],
)
def test_without_storage_the_page_works_and_says_so(
    calm: BrowserContext, site: str, script: str, message: str
) -> None:
    calm.add_init_script(script)
    page = opened(calm, site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    end = page.locator('[data-progress="lesson"]')
    assert end.get_by_role("status").inner_text() == "You have read this lesson."
    assert end.locator(".lesson-trouble").inner_text().startswith(message)
    choose(page, question(page, "smoke"), "Up")
    assert "Right" in question(page, "smoke").locator(".verdict").inner_text()
    page.goto(site + "progress/")
    page.goto(site)
    assert page.locator(".start a").inner_text().startswith("Start with")
    assert quiet(page), SAID[page]


def test_damaged_storage_is_put_aside_and_can_be_saved(
    calm: BrowserContext, site: str, tmp_path: Path
) -> None:
    page = opened(calm, site)
    page.evaluate("key => localStorage.setItem(key, '{\"coursebuild\"')", KEY)
    page.goto(site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    page.goto(site + "progress/")
    assert page.locator('[data-progress="overall"]').inner_text().startswith("1 of 3 lessons")
    part = page.locator(".aside-part")
    with page.expect_download() as saving:
        part.get_by_role("button", name="Save it as a file").click()
    saving.value.save_as(tmp_path / "damaged")
    assert (tmp_path / "damaged").read_text("utf-8") == '{"coursebuild"'
    part.get_by_role("button", name="Remove it").click()
    page.reload()
    assert page.locator(".aside-part").count() == 0


def test_a_newer_version_is_left_alone(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    newer = '{"coursebuild":"progress","version":2,"course":"motion"}'
    page.evaluate("([key, text]) => localStorage.setItem(key, text)", [KEY, newer])
    page.goto(site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    trouble = page.locator(".lesson-trouble").inner_text()
    assert trouble.startswith("A newer version of this site has written your progress.")
    assert page.evaluate("key => localStorage.getItem(key)", KEY) == newer
