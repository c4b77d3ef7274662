"""Pages on paper: what a handout must have, read from the PDF that Chromium prints."""

from __future__ import annotations

import functools
import io
import re
from collections.abc import Iterator, Mapping

import pytest
from playwright.sync_api import Browser, Page, expect
from pypdf import PdfReader

from support.built_sites import Site
from support.lab_page import becomes, wait_until_settled

pytestmark = pytest.mark.browser

LESSON = "lessons/1.1-one.html"
REAL = "lessons/4.2-mass-and-inertia.html"
WALL = "lessons/8.4-impedance.html"
URL = "https://example.org/a/very/long/address/that/cannot/be/broken/" + "x" * 120
"""An address in that lesson."""


@pytest.fixture
def page(browsers: Mapping[str, Browser]) -> Iterator[Page]:
    with browsers["plain"].new_context() as context:
        yield context.new_page()


@pytest.fixture
def nasty(sites: Mapping[str, Site]) -> str:
    """The address of a lesson of what is hard to fit."""
    return sites["nasty"].url(LESSON)


def printed(page: Page) -> list[str]:
    return [sheet.extract_text() for sheet in PdfReader(io.BytesIO(page.pdf(format="A4"))).pages]


def words(text: str) -> str:
    return re.sub(r"\s+", " ", text)


def text_on_paper(page: Page) -> str:
    return words(" ".join(printed(page)))


FURNITURE = re.compile(r"\d+ / \d+|.*· Simulation with MuJoCo|")


def test_a_lesson_is_a_handout(sites: Mapping[str, Site], page: Page) -> None:
    page.goto(sites["real"].url(REAL))
    wait_until_settled(page)
    headings = page.locator(".prose :is(h2, h3), .callout-head, .lab-title").evaluate_all(
        "all => all.map(h => h.innerText.replace('#', '').trim())"
    )
    assert len(headings) > 20
    known_headings = {words(heading).casefold() for heading in headings}
    sheets = printed(page)
    assert 5 < len(sheets) <= 16, "without its further sections"
    for number, sheet in enumerate(sheets, 1):
        assert f"{number} / {len(sheets)}" in sheet
        assert ("Mass and inertia · Simulation with MuJoCo" in sheet) == (number > 1)
        lines = [line for line in sheet.splitlines() if not FURNITURE.fullmatch(line.strip())]
        assert words(lines[-1].strip()).casefold() not in known_headings, (
            f"a heading ends sheet {number}"
        )
    text = words(" ".join(sheets))
    for removed_text in ("On this page", "Course map", "Copy", "Download", "Mark as read"):
        assert removed_text not in text, removed_text
    rest = text[text.index("joins this to translation") :]
    assert "The centre of mass is at" in rest and "Two tanks on one axis, each" in rest


def test_what_is_long_is_printed_if_it_is_open(sites: Mapping[str, Site], page: Page) -> None:
    for lesson, fold, phrase in (
        (REAL, ".further-text > summary >> nth=-1", "kept as logarithms"),
        (WALL, ".fold:has-text('spring presses against') > summary", "spring presses against"),
    ):
        page.goto(sites["real"].url(lesson))
        wait_until_settled(page)
        text = text_on_paper(page)
        assert phrase not in text and page.locator(fold).inner_text() in text
        page.locator(fold).click()
        assert phrase in text_on_paper(page)


def test_a_lab_on_paper_says_where_it_runs(sites: Mapping[str, Site], page: Page) -> None:
    page.goto(sites["full"].url("lessons/A.1-models-and-questions.html"))
    wait_until_settled(page)
    text = text_on_paper(page).replace(" ", "")
    assert "example.org/constructs/lessons/A.1-models-and-questions.html#" in text


def test_what_is_folded_is_open_and_links_say_where_they_lead(nasty: str, page: Page) -> None:
    page.set_viewport_size({"width": 1440, "height": 900})
    page.goto(nasty)
    wait_until_settled(page)
    text = text_on_paper(page)
    for visible_text in (
        "Hidden at first.",
        "So.",
        "A note whose mark is folded",
    ):
        assert visible_text in text, visible_text
    solid = text.replace(" ", "")
    assert f"Anaddress:{URL},andone({URL})withatext" in solid, "told once"
    assert "https://example.org/c/lessons/1.1-one.html" in solid, "where the page itself is"
    for note in ("A note of several blocks.", "A note from a table.", "The last note."):
        assert text.count(note) == 1
    assert text.index("The last note.") > text.index("A paragraph of some length"), "at the end"


def test_nothing_is_cut_off_at_the_edge(nasty: str, page: Page) -> None:
    page.set_viewport_size({"width": 612, "height": 900})  # 162 mm: what A4 leaves for text
    page.emulate_media(media="print")
    page.goto(nasty)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    boxes = page.locator(".prose pre, .prose :not(math *)")
    wide = (
        "all => all.filter(e => e.getBoundingClientRect().right > innerWidth + 1"
        " && !e.closest('.formula, .formula-inline, svg, .table'))"
        ".map(e => e.outerHTML.slice(0, 80))"
    )
    becomes(page, functools.partial(boxes.evaluate_all, wide), [])


def test_a_code_only_on_paper_leads_to_the_lab(nasty: str, page: Page) -> None:
    page.goto(nasty)
    way = page.locator(".lab-paper")
    expect(way).to_be_hidden()
    page.emulate_media(media="print")
    expect(way).to_be_visible()
    expect(way.locator("svg")).to_be_visible()
    expect(page.locator(".lab-picture img")).to_be_visible()
    expect(page.locator(".lab-live")).to_be_hidden()
    expect(way.locator("a")).to_have_attribute("href", re.compile(f"{LESSON}#1.1-lab-1$"))


def test_labs_without_an_address_keep_their_picture(base: str, page: Page) -> None:
    """A course that does not say where it will be published."""
    page.goto(base + LESSON)
    page.emulate_media(media="print")
    expect(page.locator(".lab-picture img").first).to_be_visible()
    expect(page.locator(".lab-paper")).to_have_count(0)
