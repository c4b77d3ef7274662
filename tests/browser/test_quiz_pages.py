"""Pages with quizzes: what is kept, every state accessible, on paper, from a disk, in a preview."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from support.axe import violations
from support.built_sites import Site, course_copy
from support.fixture_cases import fixture_text
from support.lab_page import becomes, until
from support.preview_process import serve_preview
from support.quiz_page import (
    ANGLE,
    KEY,
    MCQ,
    NUMBER,
    OPEN,
    ORDER,
    OUTPUT,
    PATH,
    PREDICT,
    QUESTIONS,
    SEVERAL,
    answer_all,
    answer_field,
    clean_page,
    items,
    press,
    question,
    stored_answer,
    verdict,
    visit,
)

pytestmark = pytest.mark.browser


@pytest.fixture
def page(calm: BrowserContext, quizzes: str) -> Iterator[Page]:
    """The lesson, whose lab has no picture here."""
    yield from clean_page(calm, quizzes)


REFERENCES = fixture_text("documents/quiz_references.bib")
"""Ids that are there twice, and references to none."""
CAN_BE_PRESSED = ".quiz :is(button, input, summary):not(.lab *):visible"
TOO_SMALL = """elements => elements.filter((element) => {
  const box = (element.closest('label') ?? element).getBoundingClientRect()
  return box.height < 24 || box.width < 24
}).map((element) => element.outerHTML)"""


def test_axe_finds_nothing_in_any_state(page: Page) -> None:
    for answered in (False, True):
        if answered:
            answer_all(page)
        assert violations(page, ".quiz") == []
        becomes(page, lambda: page.evaluate(REFERENCES), [[], []])
        for width in (320, 1440):
            page.set_viewport_size({"width": width, "height": 800})
            until(page, "document.documentElement.scrollWidth <= innerWidth")
            pressed = page.locator(CAN_BE_PRESSED)
            becomes(page, lambda: pressed.evaluate_all(TOO_SMALL), [])  # noqa: B023


# ----------------------------------------------------------------------- what is kept of it

MISFITS = ('["gone"]', '"text"', "null", "{}", '[["a"]]', '[null,{"a":1}]')
MISFIT = f"""(given) => {{
  const key = ({KEY})()
  const state = JSON.parse(localStorage[key])
  for (const entry of Object.values(state.answers.check)) entry.answer.given = JSON.parse(given)
  localStorage[key] = JSON.stringify(state)
}}"""


def test_answers_are_there_again_and_those_that_do_not_fit_are_left_out(page: Page) -> None:
    question(page, MCQ).locator(".hint").nth(0).locator("summary").click()
    order = shifted(page)
    answer_all(page)
    visit(page, page.url)
    expect(question(page, MCQ).get_by_role("radio").first).to_be_checked()
    expect(question(page, MCQ).locator(".hint").nth(1)).to_be_visible()
    for number, text in (
        (MCQ, "Not the same."),
        (SEVERAL, "Right."),
        (PREDICT, "Something else happens."),
        (OPEN, "Marked as right in part."),
        (OPEN, "Since so."),
        (OUTPUT, "Not right."),
    ):
        expect(verdict(page, number)).to_contain_text(text)
    for number, entered in ((NUMBER, ""), (ANGLE, "pi/2"), (OPEN, "So.")):
        expect(answer_field(page, number)).to_have_value(entered)
    option = question(page, PREDICT).get_by_role("radio", name="it rests")
    expect(option).to_be_checked()
    expect(option).to_be_disabled()  # there is no way back
    expect(question(page, PREDICT).locator(".lab")).to_be_visible()
    expect(question(page, OPEN).get_by_role("radio", name="In part")).to_be_checked()
    becomes(page, lambda: items(page), order)
    becomes(
        page, lambda: (stored_answer(page, MCQ) or {})["tries"], 1
    )  # loading answers nothing again
    for misfit in MISFITS:
        page.evaluate(MISFIT, misfit)
        visit(page, page.url)
        expect(question(page, MCQ).get_by_role("radio")).to_have_count(4)
        expect(verdict(page, MCQ)).to_be_empty()
        becomes(page, lambda: sorted(items(page)), ["1 m", "2 m", "3 m", "4 m"])


def test_each_answer_is_told_to_scripts_and_to_another_tab(
    page: Page, calm: BrowserContext
) -> None:
    second_page = calm.new_page()
    visit(second_page, page.url)
    answer_field(second_page, ANGLE).fill("half")
    page.evaluate(
        """() => {
          window.told = []
          document.addEventListener('coursebuild:answered', ({ detail }) => told.push(
            [detail.quiz, detail.key, detail.answer.right]))
        }"""
    )
    answer_field(page, NUMBER).fill("0.08")
    press(page, NUMBER)
    becomes(page, lambda: page.evaluate("told"), [["check", "inertia", True]])
    expect(verdict(second_page, NUMBER)).to_contain_text("Right.")
    expect(answer_field(second_page, ANGLE)).to_have_value("half")


def test_quizzes_work_from_a_disk(sites: Mapping[str, Site], calm: BrowserContext) -> None:
    page = calm.new_page()
    count = "document.documentElement.dataset.live = document.querySelectorAll('.is-live').length"
    page.add_init_script(f"addEventListener('load', () => {{ {count} }})")
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    visit(page, (sites["quizzes"].public / PATH).as_uri())
    # All are alive with the page: else they would push what is below them away from the pointer.
    expect(page.locator("html")).to_have_attribute("data-live", str(QUESTIONS))
    assert sum("/quiz." in url for url in requests) == 1
    answer_field(page, NUMBER).fill("0.08")
    press(page, NUMBER)
    expect(verdict(page, NUMBER)).to_contain_text("Right.")
    question(page, PREDICT).get_by_role("radio").last.check()
    press(page, PREDICT, "Commit to this answer")
    expect(verdict(page, PREDICT)).to_contain_text("It happens as you predicted.")
    expect(question(page, PREDICT).locator(".lab-message")).to_be_visible()
    visit(page, page.url)
    expect(verdict(page, NUMBER)).to_contain_text("Right.")


# ------------------------------------------------------------------------------- on paper


def test_on_paper_questions_and_answers_are_there_and_no_buttons(page: Page) -> None:
    answer_all(page)
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    quiz, hints = page.locator(".quiz"), question(page, MCQ).locator(".hint")
    expect(hints.first.locator("p")).to_be_visible()
    expect(quiz.locator("button:visible")).to_have_count(0)
    for text in ("twice as long, 2T", "So much.", "0.08 kg m2", "Something else happens."):
        expect(page.get_by_text(text).locator("visible=true").first).to_be_visible()
    expect(verdict(page, NUMBER)).to_be_hidden()  # that it could not be read
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="screen")
    # What paper shows is no hint that was taken.
    expect(hints.first).not_to_have_attribute("open", "")
    expect(hints.nth(1)).to_be_hidden()


# ------------------------------------------------------------------------------ the preview


def test_half_typed_answer_survives_the_author(
    tmp_path: Path, stores: Path, calm: BrowserContext
) -> None:
    folder = course_copy("quizzes", tmp_path / "course", stores)
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: ")
        # The link is asked for without a page: its page is loaded again once the check is done.
        calm.request.get(preview.link)
        page = calm.new_page()
        visit(page, f"http://127.0.0.1:{preview.port}/{PATH}")
        page.evaluate("window.same = true")
        field, explained = answer_field(page, NUMBER), page.locator(".explain").nth(2)
        question(page, MCQ).get_by_role("radio").nth(2).check()
        order = shifted(page)
        field.fill("half of")
        folder.replace(folder.lesson(), "After it.", "After it, more.")
        expect(page.locator("main")).to_contain_text("After it, more.")
        expect(field).to_have_value("half of")
        expect(field).to_be_focused()
        becomes(page, lambda: items(page), order)
        # Another question changes, and this one's explanation: what was entered stays.
        folder.replace(folder.lesson(), "Not mass.", "No, not mass.")
        folder.replace(folder.lesson(), "So much.", "So much, then.")
        expect(explained).to_contain_text("then")
        expect(field).to_have_value("half of")
        expect(question(page, MCQ).get_by_role("radio").nth(2)).to_be_checked()
        field.fill("0.08")
        press(page, NUMBER)
        expect(verdict(page, NUMBER)).to_contain_text("So much, then.")
        # What is entered after that has no verdict yet, and gets none by itself.
        field.fill("0.081")
        folder.replace(folder.lesson(), "So much, then.", "So much, at last.")
        expect(explained).to_contain_text("last")
        expect(field).to_have_value("0.081")
        expect(verdict(page, NUMBER)).to_be_empty()
        assert page.evaluate("window.same")


def shifted(page: Page) -> list[str]:
    before = items(page)
    question(page, ORDER).get_by_role("button", name="Move down").first.click()
    after = [before[1], before[0], *before[2:]]
    becomes(page, lambda: items(page), after)
    return after
