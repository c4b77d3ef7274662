"""Pages on paper: what a handout must have, read from the PDF that Chromium prints."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page
from pypdf import PdfReader

from support.built_sites import Site
from support.reading_courses import LONG, NASTY, URL, build
from support.scratch_course import Folder
from support.static_host import Host

pytestmark = pytest.mark.browser

LESSON = "lessons/1.1-one.html"
REAL = "lessons/4.2-mass-and-inertia.html"


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[Host]:
    """A course of what is hard to fit."""
    folder = Folder(tmp_path_factory.mktemp("print") / "course")
    host = Host(build(folder, stores, NASTY, f"Nasty {LONG}", "en"), "/c/")
    yield host
    host.stop()


@pytest.fixture
def page(browsers: dict[str, Browser]) -> Iterator[Page]:
    with browsers["plain"].new_context() as context:
        yield context.new_page()


def printed(page: Page, url: str, paper: str = "A4") -> list[str]:
    """The text of each sheet."""
    page.goto(url)
    reader = PdfReader(io.BytesIO(page.pdf(format=paper)))
    return [sheet.extract_text() for sheet in reader.pages]


def words(text: str) -> str:
    return re.sub(r"\s+", " ", text)


@pytest.mark.parametrize("paper", ["A4", "Letter"])
def test_a_lesson_is_a_handout(sites: dict[str, Site], page: Page, paper: str) -> None:
    url = sites["real"].host.url + REAL
    sheets = printed(page, url, paper)
    assert 10 < len(sheets) < 30
    for number, sheet in enumerate(sheets, 1):
        assert f"{number} / {len(sheets)}" in sheet
        assert ("Mass and inertia · Simulation with MuJoCo" in sheet) == (number > 1)
    text = words(" ".join(sheets))
    address = "example.org/mujoco-course/lessons/4.2-mass-and-inertia.html"
    for lab in (1, 2, 3):
        assert f"{address}#4.2-lab-{lab}" in text.replace(" ", "")
    for gone in ("On this page", "Course map", "Copy", "Download", "Mark as read"):
        assert gone not in text, gone
    for there in ("The centre of mass is at", "if __name__", "IEEE Robotics and Automation"):
        assert there in text, "what is folded on a screen"


FURNITURE = re.compile(r"\d+ / \d+|.*· Simulation with MuJoCo|")


@pytest.mark.parametrize("paper", ["A4", "Letter"])
def test_no_heading_stands_last_on_a_sheet(sites: dict[str, Site], page: Page, paper: str) -> None:
    url = sites["real"].host.url + REAL
    sheets = printed(page, url, paper)
    headings = page.locator(".prose :is(h2, h3), .callout-head, .lab-title").evaluate_all(
        "all => all.map(h => h.innerText.replace('#', '').trim())"
    )
    assert len(headings) > 20
    known = {words(heading).casefold() for heading in headings}
    for number, sheet in enumerate(sheets, 1):
        lines = [line.strip() for line in sheet.splitlines()]
        lines = [line for line in lines if not FURNITURE.fullmatch(line)]
        assert words(lines[-1]).casefold() not in known, f"sheet {number}"


def test_what_is_folded_is_open_and_links_say_where_they_lead(host: Host, page: Page) -> None:
    text = words(" ".join(printed(page, host.url + LESSON)))
    for there in ("Hidden at first.", "return one(x) + 13", "So.", "A note whose mark is folded"):
        assert there in text, there
    solid = text.replace(" ", "")
    assert f"Anaddress:{URL},andone({URL})withatext" in solid, "told once"
    assert "https://example.org/c/lessons/1.1-one.html" in solid, "where the page itself is"


def test_nothing_is_cut_off_at_the_edge(host: Host, page: Page) -> None:
    page.set_viewport_size({"width": 612, "height": 900})  # 162 mm: what A4 leaves for text
    page.emulate_media(media="print")
    page.goto(host.url + LESSON)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    wide = page.locator(".prose pre, .prose :not(math *)").evaluate_all(
        "all => all.filter(e => e.getBoundingClientRect().right > innerWidth + 1"
        " && !e.closest('.formula, .formula-inline, svg, .table'))"
        ".map(e => e.outerHTML.slice(0, 80))"
    )
    assert wide == []


def test_a_code_only_on_paper_leads_to_the_lab(host: Host, page: Page) -> None:
    page.goto(host.url + LESSON)
    way = page.locator(".lab-paper")
    assert not way.is_visible()
    page.emulate_media(media="print")
    assert way.is_visible() and way.locator("svg").is_visible()
    assert page.locator(".lab-picture img").is_visible()
    assert not page.locator(".lab-live").is_visible()
    assert way.locator("a").get_attribute("href").endswith(f"{LESSON}#1.1-lab-1")


def test_each_note_is_printed_once_and_at_the_end(host: Host, page: Page) -> None:
    page.set_viewport_size({"width": 1440, "height": 900})
    sheets = printed(page, host.url + LESSON)
    text = words(" ".join(sheets))
    for note in ("A note of several blocks.", "A note from a table.", "The last note."):
        assert text.count(note) == 1
    assert text.index("The last note.") > text.index("A paragraph of some length")


def test_labs_without_an_address_keep_their_picture(
    tmp_path: Path, stores: Path, page: Page, serve: Callable[[Path], str]
) -> None:
    folder = Folder(tmp_path / "course")
    site = build(folder, stores, NASTY, "Nowhere", "en", base_url="")
    page.goto(serve(site) + LESSON)
    page.emulate_media(media="print")
    assert page.locator(".lab-paper").count() == 0
    assert page.locator(".lab-picture img").is_visible()


@pytest.fixture
def serve() -> Iterator[Callable[[Path], str]]:
    hosts: list[Host] = []

    def serve(folder: Path) -> str:
        hosts.append(Host(folder))
        return hosts[-1].url

    yield serve
    for host in hosts:
        host.stop()
