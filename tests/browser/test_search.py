"""The search and its commands in a headless Chromium: by keyboard, from disk, without a script."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect

from support.axe import violations
from support.built_sites import Site
from support.lab_page import becomes, settled, until, watched

pytestmark = pytest.mark.browser

HOSTILE = '<img src=x onerror="alert(1)"> & <b>bold'
SINGLE = "localStorage.getItem('coursebuild.shortcuts')"


@pytest.fixture(scope="session")
def site(sites: Mapping[str, Site]) -> str:
    """The address of a course of three lessons and many short ones."""
    return sites["search"].url()


Opened = Callable[..., Page]


@pytest.fixture
def opened(calm: BrowserContext, site: str) -> Iterator[Opened]:
    """Opens a page, by default that of lesson 1.1; what it says to the console must be nothing."""
    said: list[list[str]] = []

    def opened(path: str = "lessons/1.1-one.html", base: str = site) -> Page:
        page, lines = watched(calm)
        page.goto(base + path)
        said.append(lines)
        return page

    yield opened
    blocked = "Service Worker registration blocked by Playwright"
    assert [line for lines in said for line in lines if line != blocked] == []


def ask(page: Page, query: str) -> list[str]:
    """Type a query into the open dialog; what is found, as it is read."""
    field = page.locator("#_search-field")
    field.fill(query)
    until(page, "() => document.querySelector('#_search-list') !== null")
    shown = "(q) => document.querySelector('.search-dialog').dataset.shown === q"
    until(page, shown, query)
    return [text.replace("\n", " / ") for text in page.locator(".search-option").all_inner_texts()]


def status(page: Page) -> Locator:
    return page.locator(".search-dialog .search-status")


def open_by_key(page: Page, key: str = "/") -> None:
    # A dialog that was open has taken keys until it was closed, a moment after what closed it.
    until(page, "() => document.activeElement?.closest('dialog') == null")
    until(page, "() => document.querySelector('.search-dialog')?.open !== true")
    page.locator(".search-open").wait_for()
    page.keyboard.press(key)
    until(page, "() => document.querySelector('.search-dialog')?.open === true")
    until(page, "() => document.querySelectorAll('.search-option').length > 0")


LOADED = """() => performance.getEntriesByType('resource').map((entry) => entry.name)
  .filter((name) => name.includes('search')).map((name) => name.split('/').at(-1))"""


def test_nothing_is_loaded_before_it_is_asked_for(opened: Opened) -> None:
    page = opened()
    settled(page)
    assert page.evaluate(LOADED) == []
    open_by_key(page)
    names = page.evaluate(LOADED)
    assert len(names) == 2 and names[1] == "index.js", "its script, and the list of pages"


QUERIES = {
    "inertia tensor": "1.1 Lesson one",
    "inretia tensro": "1.1 Lesson one",
    "euler drfit": "1.1 Lesson one",
    "Iₓₓ": "1.1 Lesson one",
    "ω": "1.1 Lesson one",
    "omega": "1.1 Lesson one",
    "\\boldsymbol{\\tau}": "1.1 Lesson one",
    "mj_forward": "1.2 Lesson two",
    "forward": "1.2 Lesson two",
    "data.qpos": "1.2 Lesson two",
    "mjdata": "1.2 Lesson two",
    "1.2": "1.2 Lesson two",
    "onerror": "1.3 <img",
}


def test_what_a_learner_types(opened: Opened) -> None:
    page = opened("lessons/1.5-more5.html")
    open_by_key(page)
    wrong = []
    for query, first in QUERIES.items():
        found = ask(page, query)
        marked = page.locator(".search-option mark").count() > 0 or query == "1.2"
        if not found[0].startswith(first) or not marked:
            wrong.append((query, found))
    assert wrong == []


def test_a_misspelt_word_is_set_right_and_it_is_said(opened: Opened) -> None:
    page = opened()
    open_by_key(page)
    ask(page, "drfit")
    expect(status(page)).to_have_text("1 page. Showing results for “drift”.")
    assert ask(page, "qzxwv") == []
    expect(status(page)).to_have_text(re.compile("^Nothing found for “qzxwv”. "))


def test_by_keyboard_alone(opened: Opened) -> None:
    page = opened("lessons/1.5-more5.html")
    page.locator(".search-open").focus()
    page.keyboard.press("Enter")
    until(page, "() => document.querySelectorAll('.search-option').length > 0")
    field = page.locator("#_search-field")
    expect(field).to_have_attribute("role", "combobox")
    page.keyboard.type("inertia tensor")
    until(page, "() => document.querySelector('.search-dialog').dataset.shown === 'inertia tensor'")
    active = "() => document.getElementById(document.querySelector('#_search-field')"
    active += ".getAttribute('aria-activedescendant')).innerText.split('\\n')[0]"
    becomes(page, lambda: page.evaluate(active), "1.1 Lesson one")
    page.keyboard.press("ArrowDown")
    becomes(page, lambda: page.evaluate(active), "The inertia tensor")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowUp")
    last = page.locator(".search-option").last
    expect(last).to_have_attribute("aria-selected", "true")  # before the first comes the last
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.1-one.html#tensor")


def test_escape_closes_and_the_focus_goes_back(opened: Opened) -> None:
    page = opened()
    page.locator(".search-open").click()
    until(page, "() => document.querySelectorAll('.search-option').length > 0")
    expect(page.locator(".search-input")).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.locator(".search-close")).to_be_focused()
    page.keyboard.press("Escape")
    expect(page.locator(".search-dialog")).to_be_hidden()
    expect(page.locator(".search-open")).to_be_focused()
    page.keyboard.press("Control+k")
    until(page, "() => document.querySelector('.search-dialog').open")
    page.keyboard.press("Escape")
    expect(page.locator(".search-open")).to_be_focused()


def test_what_is_typed_at_once_after_opening_is_searched(opened: Opened) -> None:
    """The event that a dialog was closed can come after the next opening and the first keys."""
    page = opened()
    open_by_key(page)
    for n in range(20):
        page.evaluate(AGAIN, f"mj_forward {n}")
        shown = "(q) => document.querySelector('.search-dialog').dataset.shown === q"
        until(page, shown, f"mj_forward {n}")


AGAIN = """async (query) => {
  const dialog = document.querySelector('.search-dialog')
  dialog.close()
  document.querySelector('.search-open').click()
  while (!dialog.open) await null
  const field = document.querySelector('#_search-field')
  field.value = query
  field.dispatchEvent(new InputEvent('input'))
}"""
"""Close, open and type before the browser gets to tell that the dialog was closed."""


def test_enter_waits_for_what_was_typed_last(opened: Opened) -> None:
    page = opened()
    open_by_key(page)
    page.keyboard.type("mj_forward")
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.2-two.html")


def test_single_keys_can_be_switched_off(opened: Opened) -> None:
    page = opened()
    open_by_key(page)
    page.locator(".search-keys input").uncheck()
    page.keyboard.press("Escape")
    becomes(page, lambda: page.evaluate(SINGLE), "off")
    page.reload()
    page.locator(".search-open").wait_for()
    page.keyboard.press("/")
    not_opened(page)
    open_by_key(page, "Control+k")
    page.locator(".search-keys input").check()
    becomes(page, lambda: page.evaluate(SINGLE), None)


def not_opened(page: Page) -> None:
    """A key that opens the dialog asks for its script at once."""
    expect(page.locator("script[src*='/search']")).to_have_count(0)


def test_keys_that_belong_to_a_field_or_a_lab_stay_there(opened: Opened) -> None:
    page = opened()
    page.locator(".search-open").wait_for()
    page.evaluate(
        """() => {
          const field = document.createElement('input')
          const lab = document.createElement('div')
          lab.className = 'lab'
          lab.tabIndex = 0
          document.querySelector('main').prepend(field, lab)
          field.focus()
        }"""
    )
    page.keyboard.type("a/b")
    expect(page.locator("main > input")).to_have_value("a/b")
    page.evaluate("() => document.querySelector('main > .lab').focus()")
    page.keyboard.press("/")
    not_opened(page)


def test_commands(opened: Opened) -> None:
    page = opened("lessons/1.2-two.html")
    open_by_key(page)
    listed = ask(page, ">")
    for title in ("Next lesson: 1.3 <img", "Previous lesson: 1.1 Lesson one", "Print this page"):
        assert any(option.startswith(title) for option in listed), listed
    assert "Course map" in listed and "Search" in listed
    assert ask(page, "> dark") == ["Colours: Dark"]
    page.keyboard.press("Enter")
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
    open_by_key(page)
    assert ask(page, "> prev les") == ["Previous lesson: 1.1 Lesson one"]
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.1-one.html")


def test_a_lesson_is_marked_as_read(opened: Opened) -> None:
    page = opened()
    button = page.locator('[data-progress="lesson"] button')
    before = button.inner_text()
    open_by_key(page)
    assert ask(page, f"> {before}") == [before]
    page.keyboard.press("Enter")
    until(page, "(t) => document.querySelector('[data-progress] button').textContent !== t", before)


def test_a_link_to_the_section_is_copied_and_it_is_said(
    opened: Opened, calm: BrowserContext
) -> None:
    calm.grant_permissions(["clipboard-read", "clipboard-write"])
    page = opened("lessons/1.1-one.html#tensor")
    open_by_key(page)
    ask(page, "> copy link")
    page.evaluate(NOTE_WHAT_IS_SAID)
    page.keyboard.press("Enter")
    until(page, "window.said === 'The link is copied.'")
    copied = page.evaluate("() => navigator.clipboard.readText()")
    assert copied.endswith("/lessons/1.1-one.html#tensor")


NOTE_WHAT_IS_SAID = """() => {
  const note = () => { window.said ||= document.querySelector('.search-said')?.textContent }
  new MutationObserver(note).observe(document.body, { childList: true, subtree: true })
}"""
"""It is shown for three seconds, in which a busy machine may not get to look."""


def test_lessons_by_the_beginning_of_their_number(opened: Opened) -> None:
    page = opened()
    open_by_key(page)
    found = ask(page, "1.1")
    assert found[:2] == ["1.1 Lesson one", "1.10 Pendulum 10"]
    expect(page.locator(".search-group").first).to_have_attribute("aria-label", "Go to")


def test_what_was_searched_before_is_offered_and_can_be_forgotten(opened: Opened) -> None:
    page = opened()
    open_by_key(page)
    ask(page, "mj_forward")
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.2-two.html")
    open_by_key(page)
    options = page.locator(".search-option")
    becomes(page, lambda: options.all_inner_texts()[:2], ["mj_forward", "Clear these"])
    options.first.click()
    until(page, "() => document.querySelector('.search-dialog').dataset.shown === 'mj_forward'")
    expect(page.locator(".search-input")).to_be_focused()
    ask(page, "")
    options.nth(1).click()
    until(page, "() => !document.querySelector('.search-option').textContent.includes('mj_')")
    kept = "() => Object.keys(localStorage).filter((k) => /search/.test(k))"
    becomes(page, lambda: page.evaluate(kept), [])


def test_hostile_titles_and_texts_are_text(opened: Opened) -> None:
    page = opened()
    page.on("dialog", lambda dialog: pytest.fail(dialog.message))
    open_by_key(page)
    for query in ("bold", "hostile script", "onerror", "<script>alert(3)</script>"):
        ask(page, query)
        expect(page.locator(".search-dialog :is(img, script, b)")).to_have_count(0)
    assert HOSTILE in ask(page, "bold")[0]


def test_from_a_disk(sites: Mapping[str, Site], opened: Opened) -> None:
    public = sites["search"].public
    page = opened(base=f"{public.as_uri()}/")
    open_by_key(page)
    assert ask(page, "mj_forwrad")[0].startswith("1.2 Lesson two")
    page.keyboard.press("Enter")
    page.wait_for_url("file://**/lessons/1.2-two.html")
    page.goto(f"{public.as_uri()}/search/index.html?q=euler+drfit")
    expect(page.locator(".found-pages a").first).to_have_text("1.1 Lesson one")


def test_closed_storage_is_no_matter(opened: Opened, calm: BrowserContext) -> None:
    calm.add_init_script(
        "Object.defineProperty(window, 'localStorage', { get() { throw new Error('closed') } })"
    )
    page = opened()
    open_by_key(page)
    page.locator(".search-keys input").uncheck()
    assert ask(page, "mj_forward")[0].startswith("1.2 Lesson two")
    page.keyboard.press("Enter")
    page.wait_for_url("**/lessons/1.2-two.html")


def test_the_page_of_the_search(opened: Opened) -> None:
    page = opened("search/index.html?q=pendulum")
    expect(page.locator(".found-pages > li")).to_have_count(15)
    expect(page.locator(".search-results .search-status")).to_have_text("20 pages.")
    page.locator(".search-more").click()
    expect(page.locator(".found-pages > li")).to_have_count(20)
    until(page, "() => document.activeElement.closest('.found-pages > li')")
    expect(page.locator(".search-more")).to_be_hidden()
    field = page.locator("#_q")
    expect(field).to_have_value("pendulum")
    field.fill("inertia & tensor")
    page.keyboard.press("Enter")
    page.wait_for_url("**/search/index.html?q=inertia%20%26%20tensor")
    expect(page.locator(".found-pages a").first).to_have_text("1.1 Lesson one")
    page.locator(".found-pages ul a").first.click()
    page.wait_for_url("**/lessons/1.1-one.html#tensor")
    page.go_back()
    expect(page.locator("#_q")).to_have_value("inertia & tensor")


def test_all_results_lead_from_the_dialog_to_the_page(opened: Opened) -> None:
    page = opened()
    open_by_key(page)
    assert ask(page, "pendulum")[-1] == "All results"
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    page.wait_for_url("**/search/index.html?q=pendulum")


def test_without_a_script_the_page_says_so(browsers: Mapping[str, Browser], site: str) -> None:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(site + "search/index.html")
        main = page.locator("main")
        expect(main).to_contain_text("needs JavaScript", use_inner_text=True)
        expect(page.locator("form")).to_be_hidden()
        page.locator("main a").click()
        expect(page).to_have_url(site + "index.html")


def test_an_index_that_does_not_come_is_told(opened: Opened, calm: BrowserContext) -> None:
    calm.route("**/assets/search/*.js", lambda route: route.abort())
    page, _ = watched(calm)
    page.goto(opened().url)
    open_by_key(page)
    page.locator("#_search-field").fill("inertia")
    expect(status(page)).to_have_text(re.compile("^The search cannot be loaded."))


def test_a_list_of_pages_from_before_is_loaded_anew(
    opened: Opened, calm: BrowserContext, sites: Mapping[str, Site]
) -> None:
    """The site was built anew since the browser kept the list, and the files in it have gone."""
    text = (sites["search"].public / "search/index.js").read_text()
    names = json.loads(text.partition(',"",')[2].rstrip()[:-1])["files"]
    old = text.replace(names, "0" * len(names))
    calm.route(
        "**/search/index.js", lambda route: route.fulfill(body=old, content_type="text/javascript")
    )
    page, _ = watched(calm)
    page.goto(opened().url)
    open_by_key(page)
    assert ask(page, "inertia tensor")[0].startswith("1.1 Lesson one")


def test_accessible_and_within_the_window(browsers: Mapping[str, Browser], site: str) -> None:
    with browsers["plain"].new_context(viewport={"width": 1440, "height": 700}) as context:
        page = context.new_page()
        page.goto(site + "lessons/1.1-one.html")
        open_by_key(page)
        for query in ("", "inertia tensor", ">", "qzxwv", "pendulum"):
            ask(page, query)
            check(page)
        page.goto(site + "search/index.html?q=pendulum")
        expect(page.locator(".found-pages > li")).to_have_count(15)
        check(page)


def check(page: Page) -> None:
    """Axe finds nothing, and nothing is wider than a window, or too small for a finger."""
    assert violations(page) == []
    for width in (320, 1440):
        page.set_viewport_size({"width": width, "height": 700})
        until(page, "document.documentElement.scrollWidth <= innerWidth")
        becomes(page, lambda: page.evaluate(SMALL), [])


SMALL = """[...document.querySelectorAll('dialog[open] :is(button, label, [role=option])')]
  .map((e) => e.getBoundingClientRect())
  .filter((box) => box.height < 24 || box.width < 24).map((box) => [box.width, box.height])"""
