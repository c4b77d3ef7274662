"""Quizzes in a headless Chromium: every kind answered, by mouse, by keys and with the pointer.

Tests share a page where each has a question of its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from support.lab_page import comes
from support.quiz_page import (
    ANGLE,
    MCQ,
    NUMBER,
    OPEN,
    ORDER,
    OUTPUT,
    PREDICT,
    SEVERAL,
    clean_page,
    folded,
    items,
    kept,
    press,
    question,
    verdict,
)

pytestmark = pytest.mark.browser


@pytest.fixture
def page(context: BrowserContext, quizzes: str) -> Iterator[Page]:
    yield from clean_page(context, quizzes)


@pytest.fixture(scope="module")
def lesson(browsers: Mapping[str, Browser], quizzes: str) -> Iterator[Page]:
    """The page of the tests that each have a question of their own."""
    size = {"width": 1000, "height": 800}
    with browsers["webgl"].new_context(viewport=size) as context:  # type: ignore[arg-type]
        yield from clean_page(context, quizzes)


# ------------------------------------------------------------------------------- every kind


def test_one_right_option_of_several(lesson: Page) -> None:
    one = question(lesson, MCQ)
    group = one.get_by_role("group", name="Four times as long:")
    radios = group.get_by_role("radio")
    expect(radios).to_have_count(4)
    press(lesson, MCQ)
    expect(verdict(lesson, MCQ)).to_have_text("Choose one first.")
    assert kept(lesson, MCQ) is None
    radios.nth(0).check()
    expect(verdict(lesson, MCQ)).to_be_empty()
    press(lesson, MCQ)
    expect(verdict(lesson, MCQ)).to_contain_text("Not right.")
    expect(verdict(lesson, MCQ)).to_contain_text("Not the same.")
    expect(verdict(lesson, MCQ)).not_to_contain_text("Since")
    expect(one.get_by_role("radio", name="the same, T not this")).to_be_checked()
    expect(one.get_by_role("button", name="Check")).to_be_focused()
    radios.nth(1).check()
    press(lesson, MCQ)
    expect(verdict(lesson, MCQ)).to_contain_text("Right.")
    expect(verdict(lesson, MCQ).get_by_text("The root of four.")).to_be_visible()
    expect(verdict(lesson, MCQ).get_by_text("If you chose B")).to_be_hidden()
    expect(verdict(lesson, MCQ)).to_contain_text("Since")
    expect(verdict(lesson, MCQ)).to_have_attribute("role", "status")
    expect(one.get_by_role("button", name="Check")).to_be_focused()
    expect(one.get_by_role("button", name="Check")).to_have_attribute("aria-disabled", "true")
    answer = kept(lesson, MCQ)
    assert answer is not None
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


NUMBERS = [
    (NUMBER, "-0.08", "Not right. The size is right, the sign is not."),
    (NUMBER, "80", "the power of ten is not"),
    (NUMBER, "0.08 kg m", "The unit measures something other"),
    (NUMBER, "0.08 g cm^2", "not in the one that you wrote"),
    (NUMBER, "0.16", "off by a factor of two"),
    (NUMBER, "12.5", "reciprocal"),
    (NUMBER, "0,08", "Right."),
    (NUMBER, "2*1*0.2^2", "Right.Read as 0.08 kg m2"),
    (NUMBER, "800 kg cm²", "Right.Read as 0.08 kg m2"),
    (ANGLE, "90", "It looks like degrees"),
    (ANGLE, "1.5", "rounded too far"),
    (ANGLE, "1.200", "Not right.Read as 1.2 rad"),
    (ANGLE, "90°", "Right."),
    (ANGLE, "pi/2", "Right."),
    (ANGLE, "1.57 rad", "Right."),
]


UNREADABLE = [
    ("1,200", "“1,200” can be read as 1200 or as 1.200."),
    ("1/2π", "can be read in two ways"),
    ("0.08 furlong", "“furlong” is not a unit known here."),
    ("2 3", "two numbers side by side"),
    ("<img src=x onerror=alert(1)>", "something unexpected at “<img src=x onerror=alert(1)>”"),
]


def test_number_is_judged_and_told_what_is_wrong_with_it(lesson: Page) -> None:
    field = question(lesson, NUMBER).get_by_label("Your answer")
    for entered, said in UNREADABLE:
        field.fill(entered)
        press(lesson, NUMBER)
        expect(verdict(lesson, NUMBER)).to_contain_text("This cannot be read.")
        expect(verdict(lesson, NUMBER)).to_contain_text(said)
        assert kept(lesson, NUMBER) is None  # it is no try
    tries = {NUMBER: 0, ANGLE: 0}
    for number, entered, said in NUMBERS:
        field = question(lesson, number).get_by_label("Your answer")
        field.fill(entered)
        field.press("Enter")
        expect(verdict(lesson, number)).to_contain_text(said)
        expect(field).to_be_focused()
        right = "Right." in said
        if right:
            expect(field).not_to_have_attribute("aria-invalid", "true")
        else:
            expect(field).to_have_attribute("aria-invalid", "true")
        tries[number] += 1
        answer = kept(lesson, number)
        assert answer is not None
        found = (answer["given"], answer["right"], answer["tries"])
        assert found == (entered, right, tries[number])
    # It is mended beside what is wrong with it.
    field = question(lesson, NUMBER).get_by_label("Your answer")
    field.fill("80")
    press(lesson, NUMBER)
    field.press("End")
    field.press_sequentially("0")
    expect(verdict(lesson, NUMBER)).to_contain_text("the power of ten is not")
    field.fill("0.08")
    press(lesson, NUMBER)
    expect(verdict(lesson, NUMBER)).to_contain_text("So much.")
    field.press_sequentially("1")
    expect(verdict(lesson, NUMBER)).to_be_empty()


def test_prediction_is_committed_to_before_its_simulation_opens(lesson: Page) -> None:
    one = question(lesson, PREDICT)
    expect(one.locator(".lab")).to_be_hidden()
    press(lesson, PREDICT, "Commit to this answer")
    expect(verdict(lesson, PREDICT)).to_have_text("Choose what you predict first.")
    one.get_by_role("radio", name="it rests").check()
    press(lesson, PREDICT, "Commit to this answer")
    expect(verdict(lesson, PREDICT)).to_contain_text("Something else happens.")
    columns = one.locator(".outcome > div")
    expect(columns.nth(0)).to_have_text("You predicted" + "it rests")
    expect(columns.nth(1)).to_have_text("What happens" + "it swings")
    expect(verdict(lesson, PREDICT)).to_contain_text("It does not.")
    expect(verdict(lesson, PREDICT)).to_contain_text("Gravity pulls.")
    expect(one.get_by_role("radio").first).to_be_disabled()
    expect(one.get_by_role("button", name="Try again")).to_be_hidden()
    expect(one.get_by_role("button", name="Show the answer")).to_be_hidden()
    one.locator(".lab").scroll_into_view_if_needed()
    expect(one.locator(".lab")).to_have_attribute("data-state", "paused")
    expect(one.get_by_role("button", name="Play")).to_be_visible()


def test_open_question_is_compared_and_marked_by_the_learner(lesson: Page) -> None:
    one = question(lesson, OPEN)
    press(lesson, OPEN, "Compare")
    expect(verdict(lesson, OPEN)).to_have_text("Write an answer first.")
    one.get_by_label("Your answer").fill("It <b>is</b>\nso.")
    press(lesson, OPEN, "Compare")
    expect(verdict(lesson, OPEN)).to_contain_text("Since so.")
    answer = kept(lesson, OPEN)
    assert answer is not None and answer["right"] is None
    for name, said, right in (
        ("In part", "Marked as right in part.", False),
        ("It says the same", "Marked as right.", True),
        ("Not yet", "Marked as not right yet.", False),
    ):
        one.get_by_role("radio", name=name).check()
        expect(verdict(lesson, OPEN)).to_contain_text(said)
        answer = kept(lesson, OPEN)
        assert answer is not None and (answer["right"], answer["tries"]) == (right, 1)


def test_line_that_is_printed(lesson: Page) -> None:
    field = question(lesson, OUTPUT).get_by_label("What it prints")
    for entered, said in (
        ("t = 2.0061 s", "Only capitals"),
        ("T = 2.006 s", "it prints more of them"),
        ("T = 2.1 s", "a number is not"),
        ("T  =  2.00610 s ", "Right."),
    ):
        field.fill(entered)
        press(lesson, OUTPUT)
        expect(verdict(lesson, OUTPUT)).to_contain_text(said)
    expect(verdict(lesson, OUTPUT)).to_contain_text("Four places.")


def test_order_by_dragging_and_by_buttons(lesson: Page) -> None:
    assert sorted(items(lesson)) == ["1 m", "2 m", "3 m", "4 m"] != items(lesson)
    grips = question(lesson, ORDER).locator(".item-grip")
    before = items(lesson)
    grips.first.scroll_into_view_if_needed()
    start, end = grips.nth(0).bounding_box(), grips.nth(3).bounding_box()
    assert start is not None and end is not None
    x = start["x"] + start["width"] / 2
    lesson.mouse.move(x, start["y"] + start["height"] / 2)
    lesson.mouse.down()
    for share in (0.2, 0.4, 0.6, 0.8, 1.0, 1.2):
        lesson.mouse.move(x, start["y"] + share * (end["y"] + end["height"] - start["y"]))
    lesson.mouse.up()
    comes(lesson, lambda: items(lesson) == [*before[1:], before[0]])
    expect(question(lesson, ORDER).locator("p[role=status]")).to_have_text(
        f"{before[0]}: place 4 of 4"
    )
    press(lesson, ORDER)
    expect(verdict(lesson, ORDER)).to_contain_text("of 4 are where they belong.")
    said = question(lesson, ORDER).locator("p[role=status]")
    for place, name in enumerate(("1 m", "2 m", "3 m", "4 m")):
        while items(lesson).index(name) > place:
            button = question(lesson, ORDER).get_by_role("button", name=f"Move up {name}")
            button.click()
            expect(button).to_be_focused()
            expect(said).to_have_text(f"{name}: place {items(lesson).index(name) + 1} of 4")
    expect(verdict(lesson, ORDER)).to_be_empty()
    press(lesson, ORDER)
    expect(verdict(lesson, ORDER)).to_contain_text("Right. By length.")
    assert items(lesson) == ["1 m", "2 m", "3 m", "4 m"]


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
    expect(question(page, NUMBER).get_by_label("Your answer")).to_be_focused()
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
    question(page, OPEN).get_by_label("Your answer").focus()
    keys.type("So.")
    keys.press("Tab")
    keys.press("Enter")
    for _ in range(2):  # past “Try again”, to the marks
        keys.press("Tab")
    keys.press("Space")
    expect(verdict(page, OPEN)).to_contain_text("Marked as right.")
    question(page, OUTPUT).get_by_label("What it prints").focus()
    keys.type("T = 2.0061 s")
    keys.press("Enter")
    expect(verdict(page, OUTPUT)).to_contain_text("Right.")
    for name in ("4 m", "3 m", "2 m", "1 m"):
        question(page, ORDER).get_by_role("button", name=f"Move up {name}").focus()
        keys.press("Home")
    expect(question(page, ORDER).get_by_role("button", name="Move up 1 m")).to_be_focused()
    keys.press("ArrowDown")
    comes(page, lambda: items(page)[:2] == ["2 m", "1 m"])
    keys.press("ArrowUp")
    press(page, ORDER)
    expect(verdict(page, ORDER)).to_contain_text("Right.")
    page.evaluate("document.activeElement.blur()")


# ------------------------------------------------------------------- hints, answers, retries


def test_hints_come_one_by_one_and_the_answer_after_a_try(page: Page) -> None:
    hints = question(page, MCQ).locator(".hint")
    expect(hints.nth(0)).to_be_visible()
    expect(hints.nth(1)).to_be_hidden()
    hints.nth(0).locator("summary").click()
    expect(hints.nth(0)).to_contain_text("First")
    expect(hints.nth(1)).to_be_visible()
    question(page, MCQ).get_by_role("radio").nth(2).check()
    press(page, MCQ)
    answer = kept(page, MCQ)
    assert answer is not None and answer["hints"] == 1
    one = question(page, NUMBER)
    reveal = one.get_by_role("button", name="Show the answer")
    again = one.get_by_role("button", name="Try again")
    expect(reveal).to_be_hidden()
    one.get_by_label("Your answer").fill("5")
    press(page, NUMBER)
    reveal.click()
    expect(verdict(page, NUMBER)).to_contain_text("The answer:")
    expect(verdict(page, NUMBER)).to_contain_text("0.08 kg m2 within 0.0001 kg m2")
    expect(verdict(page, NUMBER)).to_contain_text("So much.")
    expect(again).to_be_focused()
    answer = kept(page, NUMBER)
    assert answer is not None and answer["right"] is False
    again.click()
    expect(verdict(page, NUMBER)).to_be_empty()
    expect(one.get_by_label("Your answer")).to_have_value("")
    expect(one.get_by_label("Your answer")).to_be_focused()
    press(page, ORDER)
    press(page, ORDER, "Show the answer")
    comes(
        page,
        lambda: folded(verdict(page, ORDER).locator("ol > li")) == ["1 m", "2 m", "3 m", "4 m"],
    )
    # Formulas, code and markup in options choose them.
    one = question(page, MCQ)
    radios = one.get_by_role("radio")
    one.locator("math", has_text="2").first.click()
    expect(radios.nth(1)).to_be_checked()
    one.locator(".options code").click()
    expect(radios.nth(2)).to_be_checked()
    one.locator(".options b").click()
    expect(radios.nth(3)).to_be_checked()
    one.get_by_role("link", name="factor").click()
    expect(page).to_have_url(re.compile("#hello$"))
