"""A lesson as slides, opened from disk: keys, labs with and without an engine, quizzes, paper."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from pypdf import PdfReader

from support.axe import violations
from support.built_sites import BuiltCourses
from support.lab_page import watch_page

pytestmark = pytest.mark.browser


@pytest.fixture
def export(built_courses: BuiltCourses, tmp_path: Path) -> Callable[[str], Path]:
    def export(name: str) -> Path:
        out = tmp_path / f"{name}.html"
        built_courses[name].main(
            "export", "slides", "1.1", "--quiet", "--out", str(out)
        ).require_success()
        return out

    return export


@pytest.fixture
def page(browsers: Mapping[str, Browser]) -> Iterator[Page]:
    """A page in which nothing may go wrong, and which loads no file but the first."""
    with browsers["webgl"].new_context(viewport={"width": 1280, "height": 800}) as context:
        page, console = watch_page(context)
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        yield page
        assert console == []
        addresses = {
            url.partition("#")[0] for url in requests if not url.startswith(("data:", "blob:"))
        }
        assert len(addresses) == 1


@pytest.mark.long
def test_play_moves_the_body_of_a_lab_in_a_page_from_disk(
    export: Callable[[str], Path], page: Page
) -> None:
    page.goto(export("labs").as_uri())
    page.keyboard.press("ArrowRight")
    lab = page.locator(".lab").first
    lab.scroll_into_view_if_needed()
    lab.locator(".lab-view canvas").first.wait_for()
    clock, play = lab.locator(".lab-time"), lab.get_by_role("button", name="Play")
    expect(clock).to_have_text(re.compile(r"^0\.000* s$"))
    first = lab.locator(".lab-live dd").first.inner_text()
    play.click()
    expect(clock).not_to_have_text(re.compile(r"^0\.000* s$"))
    expect(lab.locator(".lab-live dd").first).not_to_have_text(first)
    lab.get_by_role("button", name="Pause").click()
    # A course's own kind of lab, and one with an editor.
    for following in page.locator(".lab").all()[1:]:
        following.scroll_into_view_if_needed()
        expect(following).to_have_class(re.compile("lab-on"))
    expect(page.locator(".lab-message:visible")).to_have_count(0)


def test_keys_and_addresses_lead_from_slide_to_slide(
    export: Callable[[str], Path], page: Page
) -> None:
    address = export("curves").as_uri()
    page.goto(address)
    visible_slides = page.locator(".slide:visible")
    counter = page.locator(".slides-bar span")
    for key, number in (
        ("ArrowRight", 2), (" ", 3), ("Shift+Space", 2), ("Home", 1), ("End", 3), ("ArrowLeft", 2)
    ):  # fmt: skip
        if key == " ":
            # A lab that has come grows no more.
            expect(page.locator(".lab").first).to_have_class(re.compile("lab-on"))
            page.evaluate("scrollTo(0, 1e6)")
        page.keyboard.press(key)
        expect(counter).to_have_text(f"{number} / 3")
        assert page.url == f"{address}#_slide-{number}"
        expect(visible_slides).to_have_count(1)
        expect(visible_slides).to_be_focused()
    ball = page.locator(".lab").nth(1)
    page.keyboard.press("End")
    ball.get_by_role("button", name="Play").click()
    expect(ball.locator(".lab-time")).not_to_have_text("t = 0.00\u00a0s")
    page.keyboard.press("Home")
    expect(counter).to_have_text("3 / 3")  # the lab has this key
    assert violations(page) == []
    page.goto(f"{address}#_slide-2")
    page.reload()
    expect(counter).to_have_text("2 / 3")


def test_quizzes_can_be_answered(export: Callable[[str], Path], page: Page) -> None:
    page.goto(export("quizzes").as_uri())
    question = page.locator(".question").first
    slide = question.locator("xpath=ancestor::section[contains(@class, 'slide')]")
    page.evaluate("id => { location.hash = id }", slide.get_attribute("id"))
    expect(question.locator("form, button").first).to_be_visible()


def test_on_paper_and_without_scripts_all_slides_are_there(
    export: Callable[[str], Path], browsers: Mapping[str, Browser]
) -> None:
    address = export("curves").as_uri()
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(address)
        expect(page.locator(".slide:visible")).to_have_count(3)
        expect(page.locator(".lab-static").first).to_be_visible()
        pdf = PdfReader(io.BytesIO(page.pdf(prefer_css_page_size=True)))
        sheets = [sheet.extract_text() for sheet in pdf.pages]
    titles = ("1.1", "Resonance", "A ball")
    firsts = [next(n for n, sheet in enumerate(sheets) if title in sheet) for title in titles]
    assert firsts == sorted(set(firsts)), sheets
    assert {round(pdf.pages[0].mediabox.width), round(pdf.pages[0].mediabox.height)} == {842, 595}
