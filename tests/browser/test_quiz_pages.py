"""Pages with quizzes: what is kept, every state accessible, on paper, from a disk, in a preview."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from support.axe import violations
from support.built_sites import Site, course_copy
from support.lab_page import comes, until, watched
from support.preview_process import serving
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
    clean_page,
    items,
    kept,
    press,
    question,
    verdict,
    visit,
)

pytestmark = pytest.mark.browser


@pytest.fixture
def page(context: BrowserContext, quizzes: str) -> Iterator[Page]:
    yield from clean_page(context, quizzes)


CAN_BE_PRESSED = ".quiz :is(button, input, summary):not(.lab *):visible"
TOO_SMALL = """elements => elements.filter((element) => {
  const box = (element.closest('label') ?? element).getBoundingClientRect()
  return box.height < 24 || box.width < 24
}).map((element) => element.outerHTML)"""


def test_axe_finds_nothing_in_any_state(page: Page) -> None:
    for answered in (False, True):
        if answered:
            answer_all(page)
        for width in (320, 1440):
            page.set_viewport_size({"width": width, "height": 800})
            assert violations(page, ".quiz") == [], (answered, width)
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            assert page.locator(CAN_BE_PRESSED).evaluate_all(TOO_SMALL) == []


# ----------------------------------------------------------------------- what is kept of it


def test_answers_are_there_again_when_the_page_is_loaded_again(page: Page) -> None:
    question(page, MCQ).locator(".hint").nth(0).locator("summary").click()
    order = shifted(page)
    answer_all(page)
    visit(page, page.url)
    expect(question(page, MCQ).get_by_role("radio").first).to_be_checked()
    expect(question(page, MCQ).locator(".hint").nth(1)).to_be_visible()
    expect(verdict(page, MCQ)).to_contain_text("Not the same.")
    expect(verdict(page, SEVERAL)).to_contain_text("Right.")
    expect(question(page, NUMBER).get_by_label("Your answer")).to_have_value("")
    expect(question(page, ANGLE).get_by_label("Your answer")).to_have_value("pi/2")
    expect(verdict(page, PREDICT)).to_contain_text("Something else happens.")
    chosen = question(page, PREDICT).get_by_role("radio", name="it rests")
    expect(chosen).to_be_checked()
    expect(chosen).to_be_disabled()  # there is no way back
    expect(question(page, PREDICT).locator(".lab")).to_be_visible()
    expect(question(page, OPEN).get_by_label("Your answer")).to_have_value("So.")
    expect(question(page, OPEN).get_by_role("radio", name="In part")).to_be_checked()
    expect(verdict(page, OPEN)).to_contain_text("Marked as right in part.")
    expect(verdict(page, OPEN)).to_contain_text("Since so.")
    expect(verdict(page, OUTPUT)).to_contain_text("Not right.")
    assert items(page) == order
    # Loading a page answers nothing again.
    answer = kept(page, MCQ)
    assert answer is not None and answer["tries"] == 1


def test_event_tells_of_each_answer(page: Page) -> None:
    page.evaluate(
        """() => {
          window.told = []
          document.addEventListener('coursebuild:answered', ({ detail }) => told.push(detail))
        }"""
    )
    question(page, NUMBER).get_by_label("Your answer").fill("0.08")
    press(page, NUMBER)
    until(page, "window.told.length > 0")
    told = page.evaluate("told")
    assert [(one["quiz"], one["key"], one["answer"]["right"]) for one in told] == [
        ("check", "inertia", True)
    ]


def test_another_tab_follows(page: Page, context: BrowserContext) -> None:
    other = context.new_page()
    visit(other, page.url)
    other.get_by_label("Your answer").nth(1).fill("half")
    question(page, NUMBER).get_by_label("Your answer").fill("0.08")
    press(page, NUMBER)
    expect(verdict(other, NUMBER)).to_contain_text("Right.")
    expect(question(other, ANGLE).get_by_label("Your answer")).to_have_value("half")


CLOSED = """Object.defineProperty(window, 'localStorage', {
  get() { throw new DOMException('closed', 'SecurityError') }
})"""
FULL = "Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError') }"


@pytest.mark.parametrize("broken", [CLOSED, FULL])
def test_quizzes_work_where_nothing_can_be_kept(
    context: BrowserContext, quizzes: str, broken: str
) -> None:
    page, said = watched(context)
    page.add_init_script(broken)
    visit(page, quizzes + PATH)
    answer_all(page)
    expect(verdict(page, SEVERAL)).to_contain_text("Right.")
    assert said == []


def test_quizzes_work_from_a_disk(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site]
) -> None:
    with browsers["plain"].new_context() as context:
        page = context.new_page()
        visit(page, f"file://{sites['quizzes'].public / PATH}")
        question(page, NUMBER).get_by_label("Your answer").fill("0.08")
        press(page, NUMBER)
        expect(verdict(page, NUMBER)).to_contain_text("Right.")
        question(page, PREDICT).get_by_role("radio").last.check()
        press(page, PREDICT, "Commit to this answer")
        expect(verdict(page, PREDICT)).to_contain_text("It happens as you predicted.")
        expect(question(page, PREDICT).locator(".lab-message")).to_be_visible()
        visit(page, page.url)
        expect(verdict(page, NUMBER)).to_contain_text("Right.")


MISFITS = (
    *('["gone"]', '"text"', "null", "{}", "5"),
    *('[["a"]]', '{"text":5,"mark":"x"}', '[null,{"a":1}]'),
)


def test_answers_that_do_not_fit_their_question_are_left_out(page: Page) -> None:
    answer_all(page)
    for given in MISFITS:
        page.evaluate(
            f"""() => {{
              const key = ({KEY})()
              const state = JSON.parse(localStorage[key])
              for (const entry of Object.values(state.answers.check)) entry.answer.given = {given}
              localStorage[key] = JSON.stringify(state)
            }}"""
        )
        visit(page, page.url)
        expect(question(page, MCQ).get_by_role("radio")).to_have_count(4)
        expect(verdict(page, MCQ)).to_be_empty()
        assert sorted(items(page)) == ["1 m", "2 m", "3 m", "4 m"]
    question(page, MCQ).get_by_role("radio").nth(1).check()
    press(page, MCQ)
    expect(verdict(page, MCQ)).to_contain_text("Right.")


# -------------------------------------------------------------- without a script, on paper


def test_without_javascript_everything_is_there(
    browsers: Mapping[str, Browser], quizzes: str
) -> None:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(quizzes + PATH)
        quiz = page.locator(".quiz")
        expect(quiz.locator("form, fieldset, input, button, textarea")).to_have_count(0)
        folds = quiz.locator("details.answer")
        expect(folds).to_have_count(QUESTIONS)
        for number in range(QUESTIONS):
            folds.nth(number).locator("> summary").click()
        for text in (
            "B. twice as long, 2T", "Since", "If you chose A", "A. length", "C. gravity",
            "0.08 kg m2", "it swings", "Since so.", "T = 2.0061 s", "The right order", "By length.",
        ):  # fmt: skip
            expect(quiz.get_by_text(text).first).to_be_visible()
        expect(quiz.locator(".lab")).to_be_visible()
        expect(quiz.locator(".hint")).to_have_count(3)


def test_on_paper_questions_and_answers_are_there_and_no_buttons(page: Page) -> None:
    answer_all(page)
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    quiz = page.locator(".quiz")
    expect(quiz.locator("button:visible")).to_have_count(0)
    for text in ("twice as long, 2T", "So much.", "0.08 kg m2", "Something else happens."):
        expect(quiz.get_by_text(text).locator("visible=true").first).to_be_visible()
    expect(verdict(page, NUMBER)).to_be_hidden()  # that it could not be read
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="screen")
    # Folds that were opened for the printer are no hints that were taken.
    expect(question(page, MCQ).locator(".hint").nth(1)).to_be_hidden()


def test_script_of_quizzes_comes_when_a_quiz_comes_near(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site], tmp_path: Path
) -> None:
    far = tmp_path / "far"
    shutil.copytree(sites["quizzes"].public, far)
    page_file = far / PATH
    text = page_file.read_text(encoding="utf-8")
    page_file.write_text(text.replace("<section class=", "<p>Much.</p>" * 400 + "<section class="))
    with browsers["plain"].new_context() as context:
        page = context.new_page()
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.goto(f"file://{page_file}", wait_until="networkidle")
        assert not any("/quiz." in url for url in asked)
        page.locator(".question").first.scroll_into_view_if_needed()
        expect(page.locator(".question.is-live")).to_have_count(QUESTIONS)
        assert sum("/quiz." in url for url in asked) == 1


# ------------------------------------------------------------------------------ the preview


def test_half_typed_answer_survives_the_author(
    tmp_path: Path, stores: Path, browsers: Mapping[str, Browser]
) -> None:
    folder = course_copy("quizzes", tmp_path / "course", stores)
    with serving(folder) as preview:
        preview.heard("checked: ")
        with browsers["plain"].new_context() as context:
            page = context.new_page()
            visit(page, f"http://127.0.0.1:{preview.port}/{PATH}")
            page.evaluate("window.same = true")
            field = question(page, NUMBER).get_by_label("Your answer")
            field.fill("half of")
            field.focus()
            question(page, MCQ).get_by_role("radio").nth(2).check()
            order = shifted(page)
            field.focus()
            folder.replace(folder.lesson(), "After it.", "After it, more.")
            expect(page.locator("main")).to_contain_text("After it, more.")
            expect(field).to_have_value("half of")
            expect(field).to_be_focused()
            comes(page, lambda: items(page) == order)
            # Another question changes, and this one's explanation: what was entered stays.
            folder.replace(folder.lesson(), "Not mass.", "No, not mass.")
            folder.replace(folder.lesson(), "So much.", "So much, then.")
            expect(page.locator(".explain").nth(2)).to_contain_text("then")
            expect(field).to_have_value("half of")
            expect(question(page, MCQ).get_by_role("radio").nth(2)).to_be_checked()
            field.fill("0.08")
            press(page, NUMBER)
            expect(verdict(page, NUMBER)).to_contain_text("So much, then.")
            # What is entered after that has no verdict yet, and gets none by itself.
            field.fill("0.081")
            folder.replace(folder.lesson(), "So much, then.", "So much, at last.")
            expect(page.locator(".explain").nth(2)).to_contain_text("last")
            expect(field).to_have_value("0.081")
            expect(verdict(page, NUMBER)).to_be_empty()
            assert page.evaluate("window.same")


def shifted(page: Page) -> list[str]:
    question(page, ORDER).get_by_role("button", name="Move down").first.click()
    return items(page)
