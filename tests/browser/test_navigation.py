"""Finding one's way in a browser: anchors of formulas, the contents list, drawings of lessons."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from support.folder_server import served
from support.lab_page import comes
from support.scratch_course import Folder

WIDE = "a + " * 60 + "a"
SECTIONS = "".join(
    f"## Part {n}\n\n{'Words. ' * 150}\n\n" + (f"### Part {n}.1\n\n{'Words. ' * 90}\n\n" * (n % 3))
    for n in range(1, 31)
)
FIRST = f"""## Formulas

The [force]{{term}} is $F${{symbol="force" unit="N"}}.

$$F = m a$$ {{#eq:newton}}

$$E = {WIDE}$$

By [](#eq:newton) it is so.

> [!derivation]- Folded
> $$p = m v$$ {{#eq:momentum}}

{SECTIONS}"""
SECOND = "By [](lesson:1.1#eq:momentum) a [force](term:force) acts, see Lesson 1.3.\n"
FORMULAS, LAST = "lessons/1.1-one.html", "lessons/1.3-three.html"


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[str]:
    """The address of a course of three lessons."""
    folder = Folder(tmp_path_factory.mktemp("navigation") / "course")
    folder.fill([FIRST, SECOND, "Text, and [two](lesson:1.2).\n"], stores)
    text = folder.text("content/course.toml")
    parts = text.split("[[level.lesson]]")
    assert len(parts) == 4
    parts[2] += 'prerequisites = ["1.1"]\n\n'
    parts[3] += 'prerequisites = ["1.1", "1.2"]\n'
    folder.write("content/course.toml", "[[level.lesson]]".join(parts))
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    with served(folder.root / "public") as address:
        yield address


@pytest.fixture
def page(browsers: dict[str, Browser]) -> Iterator[Page]:
    """A wide window."""
    size = {"width": 1300, "height": 700}
    with browsers["plain"].new_context(viewport=size, service_workers="block") as context:
        yield context.new_page()


def opacity(page: Page, selector: str) -> float:
    return float(page.locator(selector).evaluate("node => getComputedStyle(node).opacity"))


NEWTON = '[id="eq:newton"]'


def test_the_anchor_of_a_formula_is_seen_when_it_is_pointed_at(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    page.mouse.move(0, 0)
    assert opacity(page, f"{NEWTON} > .anchor") == 0
    page.hover(NEWTON)
    comes(page, lambda: opacity(page, f"{NEWTON} > .anchor") == 1)
    box = page.locator(f"{NEWTON} > .anchor").bounding_box()
    assert box is not None and min(box["width"], box["height"]) >= 24


def test_the_anchor_of_a_formula_is_reached_by_the_keyboard(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    page.locator(f"{NEWTON} > .anchor").evaluate("node => node.focus({focusVisible: true})")
    comes(page, lambda: opacity(page, f"{NEWTON} > .anchor") == 1)
    page.keyboard.press("Enter")
    assert page.url.endswith("#eq%3Anewton") or page.url.endswith("#eq:newton")
    assert page.locator(f"{NEWTON}:target").count() == 1


def test_references_lead_to_their_formula(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    page.get_by_role("link", name="(1)", exact=True).click()
    assert page.locator(f"{NEWTON}:target").count() == 1
    page.goto(base + "lessons/1.2-two.html")
    page.get_by_role("link", name="(2) of Lesson 1.1").click()
    page.wait_for_url("**/1.1-one.html#*")
    comes(page, lambda: page.locator('[id="eq:momentum"]').is_visible())  # its callout was folded


@pytest.mark.parametrize("width", [320, 700, 1300])
def test_a_wide_formula_scrolls_inside_itself(page: Page, base: str, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 700})
    page.goto(base + FORMULAS)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    formula = page.locator(".equation > .formula").nth(1)
    assert formula.evaluate("node => node.scrollWidth > node.clientWidth")
    number = page.locator(f"{NEWTON} > .equation-number").bounding_box()
    assert number is not None and number["x"] + number["width"] <= width


def current(page: Page) -> str:
    marked = page.locator(".toc [aria-current='location']")
    return marked.inner_text() if marked.count() == 1 else ""


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
    assert toc.evaluate("node => node.scrollHeight > node.clientHeight"), "the list is too short"
    for part in ("Part 20", "Part 26.1", "Part 2"):
        page.get_by_role("heading", name=part).first.evaluate("node => node.scrollIntoView()")
        comes(page, lambda: current(page).startswith(part))  # noqa: B023
        comes(page, lambda: in_sight(page))
    page.evaluate("scrollTo(0, 0)")
    comes(page, lambda: toc.evaluate("node => node.scrollTop") == 0)


def test_the_list_stays_under_the_hands_of_the_keyboard(page: Page, base: str) -> None:
    page.goto(base + FORMULAS)
    link = page.locator(".toc").get_by_role("link", name="Part 25", exact=True)
    link.evaluate("node => node.focus({focusVisible: true})")
    before = page.locator(".toc").evaluate("node => node.scrollTop")
    assert before > 0
    page.evaluate("scrollTo(0, 1500)")
    comes(page, lambda: current(page) != "")
    assert page.locator(".toc").evaluate("node => node.scrollTop") == before
    page.keyboard.press("Enter")
    comes(page, lambda: current(page) == "Part 25")


def test_the_list_of_a_narrow_page_opens_and_leads_on(page: Page, base: str) -> None:
    page.set_viewport_size({"width": 360, "height": 700})
    page.goto(base + FORMULAS)
    link = page.locator(".toc").get_by_role("link", name="Part 3.1", exact=True)
    assert page.locator(".toc").get_by_role("link").first.is_hidden()
    page.locator(".toc summary").press("Enter")
    page.locator(".toc").get_by_role("link", name="Part 4.1").click()
    comes(page, lambda: current(page).startswith("Part 4.1"))
    assert link.count() == 0, "Part 3 has no such part"


def test_the_nodes_of_a_drawing_are_links(page: Page, base: str) -> None:
    page.goto(base + LAST)
    wide, narrow = page.locator(".graph-wide"), page.locator(".graph-narrow")
    assert wide.is_visible() and narrow.is_hidden()
    assert wide.get_by_role("link").count() == 2
    wide.get_by_role("link", name="1.2 Lesson two").press("Enter")
    page.wait_for_url("**/1.2-two.html")
    page.set_viewport_size({"width": 320, "height": 700})
    assert wide.is_hidden() and narrow.is_visible()
    assert page.evaluate("document.documentElement.scrollWidth") == 320
    box = narrow.get_by_role("link").first.bounding_box()
    assert box is not None and min(box["width"], box["height"]) >= 24
    narrow.get_by_role("link", name="1.1 Lesson one (Complete)").click()
    page.wait_for_url("**/1.1-one.html")


def test_from_a_term_to_the_glossary_and_back(page: Page, base: str) -> None:
    page.goto(base + "lessons/1.2-two.html")
    page.get_by_role("link", name="force", exact=True).click()
    page.locator('dfn[id="term:force"]:target').wait_for()
    page.get_by_role("contentinfo").get_by_role("link", name="Glossary").click()
    page.wait_for_url("**/glossary/index.html")
    entry = page.locator(".term")
    assert entry.locator("dt").inner_text() == "force"
    entry.get_by_role("link", name="1.2").click()
    page.wait_for_url("**/1.2-two.html")
    page.go_back()
    page.get_by_role("link", name="Symbols").first.click()
    page.get_by_role("row", name="force").get_by_role("link").first.click()
    page.wait_for_url("**/1.1-one.html#formulas")
