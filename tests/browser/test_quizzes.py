"""Quizzes in a headless Chromium: every kind answered, by mouse, by keys and with the pointer.

What is right, and what is said of a wrong number, is tested under Node. Tests share a page where
each has a question of its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from support.built_sites import Site
from support.lab_page import becomes
from support.quiz_page import (
    MCQ,
    NUMBER,
    OPEN,
    ORDER,
    OUTPUT,
    PREDICT,
    SEVERAL,
    answer_field,
    clean_page,
    items,
    press,
    question,
    stored_answer,
    texts,
    verdict,
)

pytestmark = pytest.mark.browser


@pytest.fixture
def page(context: BrowserContext, quizzes: str) -> Iterator[Page]:
    yield from clean_page(context, quizzes)


@pytest.fixture(scope="module")
def lesson(browsers: Mapping[str, Browser], quizzes: str) -> Iterator[Page]:
    """The page of the tests that each have a question of their own."""
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 800}) as context:
        yield from clean_page(context, quizzes)


# ------------------------------------------------------------------------------- every kind


def test_one_right_option_of_several(lesson: Page) -> None:
    part = question(lesson, MCQ)
    radios = part.get_by_role("group", name="Four times as long:").get_by_role("radio")
    expect(radios).to_have_count(4)
    verdict_part = verdict(lesson, MCQ)
    press(lesson, MCQ)
    expect(verdict_part).to_have_text("Choose one first.")
    assert stored_answer(lesson, MCQ) is None
    radios.nth(0).check()
    expect(verdict_part).to_be_empty()
    press(lesson, MCQ)
    expect(verdict_part).to_contain_text("Not right.")
    expect(verdict_part).to_contain_text("Not the same.")
    expect(verdict_part).not_to_contain_text("Since")
    expect(part.get_by_role("radio", name="the same, T not this")).to_be_checked()
    radios.nth(1).check()
    press(lesson, MCQ)
    expect(verdict_part).to_contain_text("Right.")
    expect(verdict_part.get_by_text("The root of four.")).to_be_visible()
    expect(verdict_part.get_by_text("If you chose B")).to_be_hidden()
    expect(verdict_part).to_contain_text("Since")
    expect(verdict_part).to_have_attribute("role", "status")
    expect(part.get_by_role("button", name="Check")).to_be_focused()
    expect(part.get_by_role("button", name="Check")).to_have_attribute("aria-disabled", "true")
    answer = stored_answer(lesson, MCQ) or {}
    assert (answer["right"], answer["tries"], answer["number"]) == (True, 2, 1)
    assert (answer["kind"], answer["lesson"], len(answer["given"])) == ("mcq", "1.1", 1)


def test_several_right_options(lesson: Page) -> None:
    boxes = question(lesson, SEVERAL).get_by_role("checkbox")
    boxes.nth(0).check()
    boxes.nth(1).check()
    press(lesson, SEVERAL)
    expect(verdict(lesson, SEVERAL)).to_contain_text(
        "Not right. Chosen but not right: 1. Right but not chosen: 1."
    )
    expect(verdict(lesson, SEVERAL)).to_contain_text("If you chose B It cancels.")
    # Which ones they are is not told.
    marks = question(lesson, SEVERAL).locator("[data-mark=right], [data-mark=wrong]")
    expect(marks).to_have_count(0)
    boxes.nth(1).uncheck()
    boxes.nth(2).check()
    press(lesson, SEVERAL)
    expect(verdict(lesson, SEVERAL)).to_contain_text("Right. Not mass.")


def test_number_is_judged_and_told_what_is_wrong_with_it(lesson: Page) -> None:
    field, verdict_part = answer_field(lesson, NUMBER), verdict(lesson, NUMBER)
    field.fill("<img src=x onerror=alert(1)>")
    press(lesson, NUMBER)
    expect(verdict_part).to_contain_text("This cannot be read.")
    expect(verdict_part).to_contain_text("something unexpected at “<img src=x onerror=alert(1)>”")
    assert stored_answer(lesson, NUMBER) is None  # it is no try
    for tries, (entered, text, explanation) in enumerate(
        (
            ("80", "the power of ten is not", "true"),
            ("800 kg cm²", "Right.Read as 0.08 kg m2", "false"),
        ),
        1,
    ):
        field.fill(entered)
        field.press("Enter")
        expect(verdict_part).to_contain_text(text)
        expect(field).to_be_focused()
        becomes(lesson, lambda: field.get_attribute("aria-invalid") or "false", explanation)
        answer = stored_answer(lesson, NUMBER) or {}
        record = (answer["given"], answer["right"], answer["tries"])
        assert record == (entered, explanation == "false", tries)
    # It is mended beside what is wrong with it.
    field.fill("80")
    press(lesson, NUMBER)
    field.press("End")
    field.press_sequentially("0")
    expect(verdict_part).to_contain_text("the power of ten is not")
    field.fill("0.08")
    press(lesson, NUMBER)
    expect(verdict_part).to_contain_text("So much.")
    field.press_sequentially("1")
    expect(verdict_part).to_be_empty()


def test_help_for_a_number_speaks_of_a_unit_only_where_there_is_one(
    page: Page, sites: Mapping[str, Site]
) -> None:
    page.goto(sites["full"].url("lessons/A.1-models-and-questions.html"))
    question(page, 2).scroll_into_view_if_needed()
    expect(page.locator(".quiz-entry-help").first).to_have_text(re.compile(r"use another one\.$"))
    expect(page.locator(".quiz-entry-help").nth(1)).to_have_text(re.compile(r"2\*pi/3\.$"))


def test_prediction_is_committed_to_before_its_simulation_opens(lesson: Page) -> None:
    part = question(lesson, PREDICT)
    expect(part.locator(".lab")).to_be_hidden()
    press(lesson, PREDICT, "Commit to this answer")
    expect(verdict(lesson, PREDICT)).to_have_text("Choose what you predict first.")
    part.get_by_role("radio", name="it rests").check()
    press(lesson, PREDICT, "Commit to this answer")
    expect(verdict(lesson, PREDICT)).to_contain_text("Something else happens.")
    expect(part.locator(".outcome > div")).to_have_text(
        ["You predicted" + "it rests", "What happens" + "it swings"]
    )
    expect(verdict(lesson, PREDICT)).to_contain_text("It does not.")
    expect(verdict(lesson, PREDICT)).to_contain_text("Gravity pulls.")
    expect(part.get_by_role("radio").first).to_be_disabled()
    expect(part.get_by_role("button", name="Try again")).to_be_hidden()
    expect(part.get_by_role("button", name="Show the answer")).to_be_hidden()
    part.locator(".lab").scroll_into_view_if_needed()
    expect(part.locator(".lab")).to_have_attribute("data-state", "asleep")
    expect(part.get_by_role("button", name="Play")).to_be_visible()


def test_open_question_is_compared_and_marked_by_the_learner(lesson: Page) -> None:
    part = question(lesson, OPEN)
    press(lesson, OPEN, "Compare")
    expect(verdict(lesson, OPEN)).to_have_text("Write an answer first.")
    answer_field(lesson, OPEN).fill("It <b>is</b>\nso.")
    press(lesson, OPEN, "Compare")
    expect(verdict(lesson, OPEN)).to_contain_text("Since so.")
    assert (stored_answer(lesson, OPEN) or {})["right"] is None
    for name, message, right in (
        ("In part", "Marked as right in part.", False),
        ("It says the same", "Marked as right.", True),
        ("Not yet", "Marked as not right yet.", False),
    ):
        part.get_by_role("radio", name=name).check()
        expect(verdict(lesson, OPEN)).to_contain_text(message)
        answer = stored_answer(lesson, OPEN) or {}
        assert (answer["right"], answer["tries"]) == (right, 1)


def test_line_that_is_printed(lesson: Page) -> None:
    field = answer_field(lesson, OUTPUT)
    for entered, message in (("t = 2.0061 s", "Only capitals"), ("T  =  2.00610 s ", "Right.")):
        field.fill(entered)
        press(lesson, OUTPUT)
        expect(verdict(lesson, OUTPUT)).to_contain_text(message)
    expect(verdict(lesson, OUTPUT)).to_contain_text("Four places.")


def test_order_by_dragging_and_by_buttons(lesson: Page) -> None:
    sorted_items = ["1 m", "2 m", "3 m", "4 m"]
    before = items(lesson)
    assert sorted(before) == sorted_items != before
    grips = question(lesson, ORDER).locator(".item-grip")
    grips.first.scroll_into_view_if_needed()
    start, end = grips.nth(0).bounding_box(), grips.nth(3).bounding_box()
    assert start is not None and end is not None
    x = start["x"] + start["width"] / 2
    lesson.mouse.move(x, start["y"] + start["height"] / 2)
    lesson.mouse.down()
    lesson.mouse.move(x, end["y"] + 1.2 * end["height"], steps=6)
    lesson.mouse.up()
    becomes(lesson, lambda: items(lesson), [*before[1:], before[0]])
    verdict_part = question(lesson, ORDER).locator("p[role=status]")
    expect(verdict_part).to_have_text(f"{before[0]}: place 4 of 4")
    press(lesson, ORDER)
    expect(verdict(lesson, ORDER)).to_contain_text("of 4 are where they belong.")
    for place, name in enumerate(sorted_items):
        while (at := items(lesson).index(name)) > place:
            button = question(lesson, ORDER).get_by_role("button", name=f"Move up {name}")
            button.click()
            expect(button).to_be_focused()
            expect(verdict_part).to_have_text(f"{name}: place {at} of 4")
    expect(verdict(lesson, ORDER)).to_be_empty()
    press(lesson, ORDER)
    expect(verdict(lesson, ORDER)).to_contain_text("Right. By length.")


# ------------------------------------------------------------------------------- keys alone


def test_every_kind_by_keys_alone(page: Page) -> None:
    keys = page.keyboard
    question(page, MCQ).get_by_role("radio").first.focus()
    keys.press("ArrowDown")  # chooses the second
    keys.press("Enter")
    expect(verdict(page, MCQ)).to_contain_text("Right.")
    question(page, SEVERAL).get_by_role("checkbox").first.focus()
    for key in ("Space", "Tab", "Tab", "Space", "Tab", "Enter"):
        keys.press(key)
    expect(verdict(page, SEVERAL)).to_contain_text("Right.")
    keys.press("Tab")  # to “Try again”
    expect(question(page, SEVERAL).get_by_role("button", name="Try again")).to_be_focused()
    keys.press("Tab")
    expect(answer_field(page, NUMBER)).to_be_focused()
    keys.type("0.08")
    keys.press("Enter")
    expect(verdict(page, NUMBER)).to_contain_text("Right.")
    keys.press("Tab")  # to the hint
    keys.press("Enter")
    expect(question(page, NUMBER).get_by_text("Where is its centre?")).to_be_visible()
    question(page, PREDICT).get_by_role("radio").first.focus()
    for key in ("ArrowDown", "Tab", "Enter"):
        keys.press(key)
    expect(verdict(page, PREDICT)).to_contain_text("It happens as you predicted.")
    answer_field(page, OPEN).focus()
    keys.type("So.")
    for key in ("Tab", "Enter", "Tab", "Tab", "Space"):  # past “Try again”, to the marks
        keys.press(key)
    expect(verdict(page, OPEN)).to_contain_text("Marked as right.")
    for name in ("4 m", "3 m", "2 m", "1 m"):
        question(page, ORDER).get_by_role("button", name=f"Move up {name}").focus()
        keys.press("Home")
    expect(question(page, ORDER).get_by_role("button", name="Move up 1 m")).to_be_focused()
    keys.press("ArrowDown")
    becomes(page, lambda: items(page)[:2], ["2 m", "1 m"])
    keys.press("ArrowUp")
    press(page, ORDER)
    expect(verdict(page, ORDER)).to_contain_text("Right.")


# ------------------------------------------------------------------- hints, answers, retries


def test_hints_come_one_by_one_and_the_answer_after_a_try(page: Page) -> None:
    hints = question(page, MCQ).locator(".hint")
    expect(hints.nth(0)).to_be_visible()
    expect(hints.nth(1)).to_be_hidden()
    hints.nth(0).locator("summary").click()
    expect(hints.nth(0)).to_contain_text("First")
    expect(hints.nth(1)).to_be_visible()
    expect(hints.nth(2)).to_be_hidden()
    question(page, MCQ).get_by_role("radio").nth(2).check()
    press(page, MCQ)
    expect(verdict(page, MCQ)).to_contain_text("Not right.")
    assert (stored_answer(page, MCQ) or {})["hints"] == 1
    part, field = question(page, NUMBER), answer_field(page, NUMBER)
    reveal = part.get_by_role("button", name="Show the answer")
    again = part.get_by_role("button", name="Try again")
    expect(reveal).to_be_hidden()
    field.fill("5")
    press(page, NUMBER)
    reveal.click()
    expect(verdict(page, NUMBER)).to_contain_text("The answer:")
    expect(verdict(page, NUMBER)).to_contain_text("0.08 kg m2 within 0.0001 kg m2")
    expect(verdict(page, NUMBER)).to_contain_text("So much.")
    expect(again).to_be_focused()
    assert (stored_answer(page, NUMBER) or {})["right"] is False
    again.click()
    expect(verdict(page, NUMBER)).to_be_empty()
    expect(field).to_have_value("")
    expect(field).to_be_focused()
    press(page, ORDER)
    press(page, ORDER, "Show the answer")
    solution = verdict(page, ORDER).locator("ol > li")
    becomes(page, lambda: texts(solution), ["1 m", "2 m", "3 m", "4 m"])


def test_formulas_code_and_markup_in_options_choose_them(page: Page) -> None:
    mcq = question(page, MCQ)
    radios = mcq.get_by_role("radio")
    for number, part in ((1, mcq.locator("math", has_text="2").first), (2, mcq.locator("code")),
                         (3, mcq.locator(".options b"))):  # fmt: skip
        part.first.click()
        expect(radios.nth(number)).to_be_checked()
    mcq.get_by_role("link", name="factor").click()
    expect(page).to_have_url(re.compile("#hello$"))
