"""Lessons of a SCORM 1.2 package in a learning platform: opened in a frame beside a real run-time.

The platform's half is the npm package scorm-again, which refuses what the data model does not have.
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
from support.scratch_course import ROOT
from support.static_host import Host

pytestmark = pytest.mark.browser

RUNTIME = ROOT / "site/node_modules/scorm-again/dist/scorm12.min.js"
PLATFORM = """<!DOCTYPE html><html lang="en"><title>Platform</title>
<script src="/runtime.js"></script><script>
var refused = [];
var API = new Scorm12API({autocommit: false, logLevel: 5, onLogMessage() {}});
API.on('LMSInitialize LMSFinish', () => {});
const set = API.LMSSetValue;
API.LMSSetValue = (name, value) => {
  const answer = set.call(API, name, value);
  if (String(answer) !== 'true') refused.push([name, value, API.LMSGetLastError()]);
  return answer;
};
var kept = JSON.parse(localStorage.getItem('platform') ?? 'null');
if (kept) { kept.core.entry = 'resume'; API.loadFromJSON(kept, ''); }
API.cmi.core.student_id = new URLSearchParams(location.search).get('who') ?? 'ada';
API.on('LMSFinish', () => localStorage.setItem('platform', JSON.stringify(API.cmi)));
function leave() { document.querySelector('iframe').remove(); }
</script>
<body style="margin:0"><iframe title="SCO" src="PLACE" style="border:0;width:100vw;height:90vh">
</iframe></body></html>"""


@pytest.fixture(scope="session")
def base(scorm: Path) -> Iterator[str]:
    """A platform that has the package."""
    if not RUNTIME.is_file():
        pytest.fail("scorm-again is not installed: run python site/bundle.py packages")
    shutil.copy(RUNTIME, scorm / "runtime.js")
    for name in ("1.1-one", "1.2-two"):
        page = PLATFORM.replace("PLACE", f"sco/{name}.html")
        (scorm / f"{name}.html").write_text(page, encoding="utf-8")
    with Host(scorm) as host:
        yield host.url


Open = Callable[..., Page]


@pytest.fixture
def visit(context: BrowserContext, base: str) -> Open:
    """Opens a lesson in the platform; nothing may go wrong in any of the pages."""

    def visit(name: str = "1.1-one", who: str = "ada") -> Page:
        page = context.new_page()
        page.on("pageerror", lambda error: pytest.fail(str(error)))
        page.goto(f"{base}{name}.html?who={who}")
        lesson(page).locator("[data-question]").first.wait_for()
        return page

    return visit


def lesson(page: Page) -> FrameLocator:
    return page.frame_locator("iframe").frame_locator("iframe")


def values(page: Page) -> Any:
    return page.evaluate("JSON.parse(JSON.stringify(API.cmi))")


def refused(page: Page) -> Any:
    return page.evaluate("refused")


def live(page: Page, key: str) -> Locator:
    """A question that can be answered: in a frame it comes alive when it comes into sight."""
    question = lesson(page).locator(f'[data-question="{key}"]')
    question.scroll_into_view_if_needed()
    question.locator(".quiz-check").wait_for()
    return question


def choose(page: Page, text: str) -> None:
    question = live(page, "which")
    question.get_by_label(text).check()
    question.locator(".quiz-check").click()


def enter(page: Page, text: str) -> None:
    question = live(page, "much")
    question.locator("input").first.fill(text)
    question.locator(".quiz-check").click()


def until(page: Page, expression: str) -> None:
    page.wait_for_function(expression)


def test_answers_points_and_status_reach_the_platform(visit: Open) -> None:
    page = visit()
    until(page, "API.cmi.core.lesson_status === 'incomplete'")
    choose(page, "blue")
    until(page, "API.cmi.interactions.childArray.length === 1")
    choose(page, "green")
    until(page, "API.cmi.core.score.raw === '50'")
    until(page, "API.cmi.core.lesson_status === 'incomplete'")
    enter(page, "0.08")
    until(page, "API.cmi.core.lesson_status === 'passed'")
    found = values(page)
    assert {key: found["core"]["score"][key] for key in ("raw", "min", "max")} == {
        "raw": "100", "min": "0", "max": "100"
    }  # fmt: skip
    told = [
        [one[key] for key in ("id", "type", "student_response", "result")]
        for one in found["interactions"].values()
    ]
    assert told[:2] == [["check.which", "choice", "c", "wrong"],
                        ["check.which", "choice", "b", "correct"]]  # fmt: skip
    assert told[2][0] == "check.much" and told[2][3] == "correct"
    assert refused(page) == []
    page.evaluate("leave()")
    until(page, "API.isTerminated()")
    kept = page.evaluate("JSON.parse(localStorage.getItem('platform'))")
    assert kept["core"]["exit"] == "suspend"
    assert refused(page) == []


def test_later_visit_shows_the_answers_on_a_machine_that_has_none(
    visit: Open, context: BrowserContext
) -> None:
    page = visit()
    choose(page, "green")
    until(page, "API.cmi.core.score.raw === '50'")
    page.evaluate("leave()")
    until(page, "API.isTerminated()")
    page.evaluate(
        "for (const key of Object.keys(localStorage)) key === 'platform' ||"
        " localStorage.removeItem(key)"
    )
    page.close()
    again = visit()
    expect(live(again, "which").get_by_label("green")).to_be_checked()
    until(again, "API.cmi.core.score.raw === '50'")
    assert refused(again) == []


def test_another_learner_at_this_machine_starts_anew(visit: Open) -> None:
    page = visit()
    choose(page, "green")
    until(page, "API.cmi.core.score.raw === '50'")
    page.evaluate("leave()")
    until(page, "API.isTerminated()")
    page.evaluate("localStorage.removeItem('platform')")
    page.close()
    other = visit(who="emmy")
    expect(live(other, "which").get_by_label("green")).not_to_be_checked()
    assert values(other)["core"]["score"]["raw"] in ("", "0")


def test_visit_goes_on_over_other_pages_of_the_course(visit: Open) -> None:
    page = visit()
    lesson(page).get_by_role("link", name="The other lesson").click()
    other = live(page, "other")
    other.get_by_label("this").check()
    other.locator(".quiz-check").click()
    expect(other.locator(".verdict")).to_contain_text("Right")
    assert page.evaluate("API.cmi.interactions.childArray.length") == 0, "it is not this lesson's"
    page.evaluate("history.back()")
    live(page, "which")
    choose(page, "green")
    until(page, "API.cmi.core.score.raw === '50'")
    assert page.evaluate("API.cmi.interactions.childArray.length") == 1
    assert refused(page) == []


def test_lesson_is_there_without_a_platform_and_says_so(context: BrowserContext, base: str) -> None:
    page = context.new_page()
    page.goto(f"{base}sco/1.1-one.html")
    expect(page.get_by_role("status")).to_have_text(re.compile("^No learning platform"))
    page.frame_locator("iframe").locator("[data-question]").first.wait_for()
    until(page, "document.documentElement.scrollWidth <= innerWidth")


def test_lesson_without_javascript_is_a_link_away(
    browsers: Mapping[str, Browser], base: str
) -> None:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(f"{base}sco/1.1-one.html")
        page.get_by_role("link", name="1.1 Lesson one").click()
        heading = page.get_by_role("heading", level=1)
        expect(heading).to_have_text(re.compile("Lesson one$"))


def test_platform_in_a_window_of_its_own(context: BrowserContext, base: str) -> None:
    opener = context.new_page()
    opener.goto(f"{base}1.1-one.html")
    opener.evaluate("document.querySelector('iframe').remove(); API.reset()")
    with context.expect_page() as opened:
        opener.evaluate("window.open('sco/1.1-one.html')")
    window = opened.value
    window.frame_locator("iframe").locator("[data-question]").first.wait_for()
    until(opener, "API.cmi.core.lesson_status === 'incomplete'")
    window.close(run_before_unload=True)
    until(opener, "API.isTerminated()")


def test_axe_finds_nothing_in_the_launch_page(context: BrowserContext, base: str) -> None:
    page = context.new_page()
    page.goto(f"{base}sco/1.1-one.html")
    page.get_by_role("status").wait_for()
    assert violations(page, "body > :not(iframe)") == []


def test_keyboard_reaches_into_the_lesson(visit: Open) -> None:
    page = visit()
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    inside = "document.querySelector('iframe').contentDocument.querySelector('iframe')"
    until(page, f"{inside}.contentDocument.activeElement.tagName === 'A'")
