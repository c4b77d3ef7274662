"""Finding one's way in a browser: anchors of formulas, the contents list, drawings of lessons."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from support.axe import violations
from support.built_sites import Site
from support.lab_page import becomes, until, wait_for_condition

pytestmark = pytest.mark.browser

FORMULAS, LAST = "lessons/1.1-one.html", "lessons/1.3-three.html"


@pytest.fixture(scope="session")
def base(sites: Mapping[str, Site]) -> str:
    return sites["navigation"].url()


@pytest.fixture
def page(browsers: Mapping[str, Browser]) -> Iterator[Page]:
    size = {"width": 1300, "height": 700}
    with browsers["plain"].new_context(viewport=size, service_workers="block") as context:
        yield context.new_page()


NEWTON = '[id="eq:newton"]'


def test_the_anchor_of_a_formula_is_seen_when_it_is_pointed_at_or_focused(
    page: Page, base: str
) -> None:
    page.goto(base + FORMULAS)
    anchor = page.locator(f"{NEWTON} > .anchor")
    page.mouse.move(0, 0)
    expect(anchor).to_have_css("opacity", "0")
    page.hover(NEWTON)
    expect(anchor).to_have_css("opacity", "1")
    wait_for_condition(page, lambda: large_enough(anchor))
    page.mouse.move(0, 0)
    anchor.evaluate("node => node.focus({focusVisible: true})")
    expect(anchor).to_have_css("opacity", "1")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("#eq(:|%3A)newton$"))
    expect(page.locator(f"{NEWTON}:target")).to_have_count(1)


def large_enough(controls: Locator) -> bool:
    box = controls.bounding_box()
    return box is not None and min(box["width"], box["height"]) >= 24


def test_references_lead_to_their_formula(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    page.get_by_role("link", name="(1)", exact=True).click()
    expect(page.locator(f"{NEWTON}:target")).to_have_count(1)
    page.goto(base + "lessons/1.2-two.html")
    page.get_by_role("link", name="(2) of Lesson 1.1").click()
    page.wait_for_url("**/1.1-one.html#*")
    expect(page.locator('[id="eq:momentum"]')).to_be_visible()  # its callout was folded


def test_a_wide_formula_scrolls_inside_itself(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    formulas = page.locator(".equation > .formula")
    formula = formulas.nth(1)
    number = page.locator(f"{NEWTON} > .equation-number")
    for width in (320, 700, 1300):
        page.set_viewport_size({"width": width, "height": 700})
        until(page, "w => document.documentElement.scrollWidth === w", width)
        becomes(page, lambda: formula.evaluate("f => f.scrollWidth > f.clientWidth"), True)
        stops = "all => all.slice(0, 2).map(f => f.tabIndex)"
        becomes(page, lambda: formulas.evaluate_all(stops), [-1, 0])  # noqa: B023
        expect(number).to_be_visible()
        end = "n => n.getBoundingClientRect().right <= innerWidth"
        becomes(page, lambda: number.evaluate(end), True)  # noqa: B023


def current(page: Page) -> Locator:
    """Where the reader is, in the contents list."""
    return page.locator(".toc [aria-current='location']")


def in_sight(page: Page) -> bool:
    return bool(
        page.locator(".toc [aria-current]").evaluate(
            """link => {
              const edges = (node) => node.getBoundingClientRect()
              const [a, b] = [edges(link), edges(link.closest('.toc'))]
              return a.top >= b.top - 1 && a.bottom <= b.bottom + 1
            }"""
        )
    )


def test_a_long_contents_list_follows_the_reader(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    toc = page.locator(".toc")
    becomes(page, lambda: toc.evaluate("node => node.scrollHeight > node.clientHeight"), True)
    assert violations(page, ".beside") == []
    for part in ("Part 20", "Part 26.1", "Part 2"):
        page.get_by_role("heading", name=part).first.evaluate("node => node.scrollIntoView()")
        expect(current(page)).to_have_text(re.compile(f"^{re.escape(part)}"))
        wait_for_condition(page, lambda: in_sight(page))
    page.evaluate("scrollTo(0, 0)")
    becomes(page, lambda: toc.evaluate("node => node.scrollTop"), 0)


def test_the_lessons_of_the_level_are_whole_beside_a_long_list(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    lessons = page.locator(".level-nav")
    expect(lessons).to_be_visible()
    becomes(page, lambda: lessons.evaluate("node => node.scrollHeight - node.clientHeight"), 0)


def test_the_list_stays_under_the_hands_of_the_keyboard(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    link = page.locator(".toc").get_by_role("link", name="Part 25", exact=True)
    link.evaluate("node => node.focus({focusVisible: true})")
    until(page, "() => document.querySelector('.toc').scrollTop > 0")
    before = page.locator(".toc").evaluate("node => node.scrollTop")
    page.evaluate("scrollTo(0, 1500)")
    expect(current(page)).to_have_text(re.compile("Part"))
    becomes(page, lambda: page.locator(".toc").evaluate("node => node.scrollTop"), before)
    page.keyboard.press("Enter")
    expect(current(page)).to_have_text("Part 25")


def test_the_list_of_a_narrow_page_opens_and_leads_on(page: Page, base: str) -> None:
    page.set_viewport_size({"width": 360, "height": 700})
    page.goto(base + FORMULAS)
    link = page.locator(".toc").get_by_role("link", name="Part 3.1", exact=True)
    expect(page.locator(".toc").get_by_role("link").first).to_be_hidden()
    page.locator(".toc summary").press("Enter")
    page.locator(".toc").get_by_role("link", name="Part 4.1").click()
    expect(current(page)).to_have_text(re.compile("^Part 4.1"))
    expect(link).to_have_count(0)  # Part 3 has no such part


def test_the_nodes_of_a_drawing_are_links(page: Page, base: str) -> None:
    page.goto(base + LAST)
    wide, narrow = page.locator(".graph-wide"), page.locator(".graph-narrow")
    expect(wide).to_be_visible()
    expect(narrow).to_be_hidden()
    expect(wide.get_by_role("link")).to_have_count(2)
    wide.get_by_role("link", name="1.2 Lesson two").press("Enter")
    page.wait_for_url("**/1.2-two.html")
    page.set_viewport_size({"width": 320, "height": 700})
    expect(wide).to_be_hidden()
    expect(narrow).to_be_visible()
    until(page, "() => document.documentElement.scrollWidth === 320")
    wait_for_condition(page, lambda: large_enough(narrow.get_by_role("link").first))
    narrow.get_by_role("link", name="1.1 Lesson one (Published)").click()
    page.wait_for_url("**/1.1-one.html")


def test_a_path_that_the_reader_began_leads_on_and_back(page: Page, base: str) -> None:
    page.set_viewport_size({"width": 800, "height": 700})
    page.goto(base)
    page.locator(".path-start").get_by_role("link").click()
    page.get_by_role("link", name="Next: 1.3 Lesson three").click()
    page.wait_for_url("**/1.3-three.html")
    previous = page.get_by_role("link", name="Previous")  # in the bar of the level, and at the end
    expect(previous).to_have_text(["← 1.1", "Previous 1.1 Lesson one"])


def test_the_keyboard_gets_past_the_head_at_once(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    page.keyboard.press("Tab")
    expect(page.locator(".skip")).to_be_focused()
    expect(page.locator(".skip")).to_be_in_viewport()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("#_main$"))


def test_page_for_missing_addresses_leads_back_from_any_depth(
    page: Page, sites: Mapping[str, Site]
) -> None:
    page.goto(sites["full"].url("no/such/page.html"))
    expect(page.locator("h1")).to_have_text("Page not found")
    expect(page.locator("body")).to_have_css("display", "flex")  # it has its style
    page.get_by_role("link", name="Go to the course map").click()
    page.wait_for_url(sites["full"].url())


def test_from_a_term_to_the_glossary_and_back(page: Page, base: str) -> None:
    page.goto(base + "lessons/1.2-two.html")
    page.get_by_role("link", name="force", exact=True).click()
    page.locator('dfn[id="term:force"]:target').wait_for()
    page.get_by_role("contentinfo").get_by_role("link", name="Glossary").click()
    page.wait_for_url("**/glossary/index.html")
    entry = page.locator(".term")
    expect(entry.locator("dt")).to_have_text("force")
    entry.get_by_role("link", name="1.2").click()
    page.wait_for_url("**/1.2-two.html")
    page.go_back()
    page.get_by_role("link", name="Symbols").first.click()
    page.get_by_role("row", name="force").get_by_role("link").first.click()
    page.wait_for_url("**/1.1-one.html#formulas")
