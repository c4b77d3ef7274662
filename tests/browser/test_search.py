"""The search and its commands in a headless Chromium: by keyboard, from disk, on its own page."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, expect

from support.axe import violations
from support.built_sites import Site
from support.chromium import OpenAddress
from support.fixture_cases import fixture_tables, fixture_text
from support.lab_page import becomes, until, wait_until_settled

pytestmark = pytest.mark.browser

HOSTILE = '<img src=x onerror="alert(1)"> & <b>bold'
FIRST_LESSON, SECOND_LESSON = "lessons/1.1-one.html", "lessons/1.2-two.html"
SHOWS_QUERY = "(q) => document.querySelector('.search-dialog').dataset.shown === q"


@pytest.fixture
def site(sites: Mapping[str, Site]) -> str:
    return sites["search"].url()


def open_by_key(page: Page, key: str = "/") -> None:
    # A dialog that was open has taken keys until it was closed, a moment after what closed it.
    until(page, "() => document.activeElement?.closest('dialog') == null")
    until(page, "() => document.querySelector('.search-dialog')?.open !== true")
    page.locator(".search-open").wait_for()
    page.keyboard.press(key)
    until(page, "() => document.querySelector('.search-dialog')?.open === true")
    until(page, "() => document.querySelectorAll('.search-option').length > 0")


def ask(page: Page, query: str) -> list[str]:
    """Type a query into the open dialog; what is found, as it is read."""
    page.locator("#_search-field").fill(query)
    until(page, SHOWS_QUERY, query)
    return [text.replace("\n", " / ") for text in page.locator(".search-option").all_inner_texts()]


def status(page: Page) -> Locator:
    return page.locator(".search-dialog .search-status")


LOADED_FILES = """() => performance.getEntriesByType('resource').map((entry) => entry.name)
  .filter((name) => name.includes('search')).map((name) => name.split('/').at(-1))"""


def test_nothing_is_loaded_before_it_is_asked_for(open_address: OpenAddress, site: str) -> None:
    page = open_address(site + FIRST_LESSON)
    wait_until_settled(page)
    assert page.evaluate(LOADED_FILES) == []
    open_by_key(page)
    becomes(page, lambda: len(page.evaluate(LOADED_FILES)), 2)
    assert page.evaluate(LOADED_FILES)[1] == "index.js", "its script, and the list of pages"


QUERIES = fixture_tables("queries")["queries"]


def test_what_a_learner_types_is_found_and_what_authors_wrote_is_text(
    open_address: OpenAddress, site: str
) -> None:
    page = open_address(site + "lessons/1.5-more5.html")
    page.on("dialog", lambda dialog: pytest.fail(dialog.message))
    open_by_key(page)
    results = {query: ask(page, query)[0] for query in QUERIES}
    assert [
        (q, results[q]) for q, title in QUERIES.items() if not results[q].startswith(title)
    ] == []
    expect(page.locator(".search-option mark").first).to_be_visible()
    expect(page.locator(".search-dialog :is(img, script, b)")).to_have_count(0)
    ask(page, "drfit")
    expect(status(page)).to_have_text("1 page. Showing results for “drift”.")
    assert ask(page, "qzxwv") == []
    expect(status(page)).to_have_text(re.compile("^Nothing found for “qzxwv”. "))


def test_arrows_choose_and_enter_goes_there(open_address: OpenAddress, site: str) -> None:
    page = open_address(site + "lessons/1.5-more5.html")
    page.locator(".search-open").focus()
    page.keyboard.press("Enter")
    until(page, "() => document.querySelectorAll('.search-option').length > 0")
    expect(page.locator("#_search-field")).to_have_attribute("role", "combobox")
    page.keyboard.type("inertia tensor")
    until(page, SHOWS_QUERY, "inertia tensor")
    active = page.locator(".search-option[aria-selected=true]")
    for key, title in (("ArrowDown", "The inertia tensor"), ("ArrowUp", "1.1 Lesson one")):
        page.keyboard.press(key)
        expect(active).to_contain_text(title)
        expect(page.locator("#_search-field")).to_have_attribute(
            "aria-activedescendant", active.get_attribute("id") or ""
        )
    page.keyboard.press("ArrowUp")
    expect(page.locator(".search-option").last).to_have_attribute("aria-selected", "true")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.1-one.html#tensor")


def test_escape_closes_and_the_focus_goes_back(open_address: OpenAddress, site: str) -> None:
    page = open_address(site + FIRST_LESSON)
    page.locator(".search-open").click()
    until(page, "() => document.querySelectorAll('.search-option').length > 0")
    expect(page.locator(".search-input")).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.locator(".search-close")).to_be_focused()
    page.keyboard.press("Escape")
    expect(page.locator(".search-dialog")).to_be_hidden()
    expect(page.locator(".search-open")).to_be_focused()


SEARCH_AGAIN = fixture_text("scripts/search_again.js")
"""Close, open and type before the browser gets to tell that the dialog was closed."""


def test_what_is_typed_at_once_after_opening_is_searched_and_enter_waits(
    open_address: OpenAddress, site: str
) -> None:
    """The event that a dialog was closed can come after the next opening and the first keys."""
    page = open_address(site + FIRST_LESSON)
    open_by_key(page)
    for query in ("mj_forward 1", "mj_forward 2", "mj_forward 3"):
        page.evaluate(SEARCH_AGAIN, query)
        until(page, SHOWS_QUERY, query)
    page.locator("#_search-field").fill("")
    page.keyboard.type("mj_forward")
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.2-two.html")


def test_single_keys_can_be_switched_off(open_address: OpenAddress, site: str) -> None:
    page = open_address(site + FIRST_LESSON)
    open_by_key(page)
    page.locator(".search-keys input").uncheck()
    page.keyboard.press("Escape")
    until(page, "localStorage.getItem('coursebuild.shortcuts') === 'off'")
    page.reload()
    page.locator(".search-open").wait_for()
    page.keyboard.press("/")
    expect(page.locator("script[src*='/search']")).to_have_count(0)  # it would be asked for at once
    open_by_key(page, "Control+k")
    page.locator(".search-keys input").check()
    until(page, "localStorage.getItem('coursebuild.shortcuts') === null")


NOTE_WHAT_IS_SAID = """() => {
  const note = () => { window.said ||= document.querySelector('.search-said')?.textContent }
  new MutationObserver(note).observe(document.body, { childList: true, subtree: true })
}"""
"""It is shown for three seconds, in which a busy machine may not get to look."""


def test_commands(open_address: OpenAddress, calm: BrowserContext, site: str) -> None:
    calm.grant_permissions(["clipboard-read", "clipboard-write"])
    page = open_address(site + "lessons/1.1-one.html#tensor")
    open_by_key(page)
    commands = ask(page, ">")
    for title in ("Next lesson: 1.2 Lesson two", "Print this page", "Course map", "Search"):
        assert any(option.startswith(title) for option in commands), commands
    assert ask(page, "> dark") == ["Colours: Dark"]
    page.keyboard.press("Enter")
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
    open_by_key(page)
    assert ask(page, "> mark") == ["Mark as read"]
    page.keyboard.press("Enter")
    expect(page.locator('[data-progress="lesson"] button')).to_have_text("Mark as not read")
    open_by_key(page)
    ask(page, "> copy link")
    page.evaluate(NOTE_WHAT_IS_SAID)
    page.keyboard.press("Enter")
    until(page, "window.said === 'The link is copied.'")
    clipboard = page.evaluate("() => navigator.clipboard.readText()")
    assert clipboard.endswith("/lessons/1.1-one.html#tensor")


def test_what_was_searched_before_is_offered_and_can_be_forgotten(
    open_address: OpenAddress, site: str
) -> None:
    page = open_address(site + FIRST_LESSON)
    open_by_key(page)
    ask(page, "mj_forward")
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.2-two.html")
    open_by_key(page)
    options = page.locator(".search-option")
    becomes(page, lambda: options.all_inner_texts()[:2], ["mj_forward", "Clear recent searches"])
    options.first.click()
    until(page, SHOWS_QUERY, "mj_forward")
    expect(page.locator(".search-input")).to_be_focused()
    ask(page, "")
    options.nth(1).click()
    expect(options.first).not_to_contain_text("mj_")
    until(page, "!Object.keys(localStorage).some((key) => /search/.test(key))")


def test_from_a_disk(sites: Mapping[str, Site], open_address: OpenAddress) -> None:
    folder = f"{sites['search'].public.as_uri()}/"
    page = open_address(folder + FIRST_LESSON)
    open_by_key(page)
    assert ask(page, "mj_forwrad")[0].startswith("1.2 Lesson two")
    page.keyboard.press("Enter")
    page.wait_for_url("file://**/lessons/1.2-two.html")
    page.goto(f"{folder}search/index.html?q=euler+drfit")
    expect(page.locator(".found-pages a").first).to_have_text("1.1 Lesson one")


def test_all_results_are_on_a_page_of_their_own(open_address: OpenAddress, site: str) -> None:
    page = open_address(site + FIRST_LESSON)
    open_by_key(page)
    assert ask(page, "pendulum")[-1] == "All results"
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    page.wait_for_url("**/search/index.html?q=pendulum")
    expect(page.locator(".search-results .search-status")).to_have_text("20 pages.")
    expect(page.locator(".found-pages > li")).to_have_count(15)
    page.locator(".search-more").click()
    expect(page.locator(".found-pages > li")).to_have_count(20)
    until(page, "() => document.activeElement.closest('.found-pages > li')")
    expect(page.locator(".search-more")).to_be_hidden()
    assert violations(page, "main") == []
    field = page.locator("#_q")
    expect(field).to_have_value("pendulum")
    field.fill("inertia & tensor")
    page.keyboard.press("Enter")
    page.wait_for_url("**/search/index.html?q=inertia%20%26%20tensor")
    page.locator(".found-pages ul a").first.click()
    page.wait_for_url("**/lessons/1.1-one.html#tensor")
    page.go_back()
    expect(field).to_have_value("inertia & tensor")


def test_an_index_that_does_not_come_is_told(calm: BrowserContext, site: str) -> None:
    calm.route("**/assets/search/*.js", lambda route: route.abort())
    page = calm.new_page()
    page.goto(site + FIRST_LESSON)
    open_by_key(page)
    page.locator("#_search-field").fill("inertia")
    expect(status(page)).to_have_text(re.compile("^The search cannot be loaded. Load"))


def test_a_list_of_pages_from_before_is_loaded_anew(
    sites: Mapping[str, Site], calm: BrowserContext
) -> None:
    """The site was built anew since the browser kept the list, and the files in it have gone."""
    text = (sites["search"].public / "search/index.js").read_text()
    names = json.loads(text.partition(',"",')[2].rstrip()[:-1])["files"]
    old = text.replace(names, "0" * len(names))
    calm.route(
        "**/search/index.js", lambda route: route.fulfill(body=old, content_type="text/javascript")
    )
    page = calm.new_page()
    page.goto(sites["search"].url(FIRST_LESSON))
    open_by_key(page)
    assert ask(page, "inertia tensor")[0].startswith("1.1 Lesson one")


SMALL = """[...document.querySelectorAll('dialog[open] :is(button, label, [role=option])')]
  .map((e) => e.getBoundingClientRect())
  .filter((box) => box.height < 24 || box.width < 24).map((box) => [box.width, box.height])"""


def test_dialog_is_accessible_and_within_the_window(open_address: OpenAddress, site: str) -> None:
    """Axe finds nothing, nothing is wider than a window, or too small for a finger."""
    page = open_address(site + FIRST_LESSON)
    open_by_key(page)
    for query in ("inertia tensor", ">", "qzxwv"):
        ask(page, query)
        assert violations(page, "dialog") == []
        for width in (320, 1440):
            page.set_viewport_size({"width": width, "height": 700})
            until(page, "document.documentElement.scrollWidth <= innerWidth")
            becomes(page, lambda: page.evaluate(SMALL), [])
