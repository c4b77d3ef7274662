"""Quizzes in a headless Chromium: every kind answered, by mouse, by keys and with the pointer."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from support.lab_page import until
from support.quiz_page import (
    ANGLE,
    MCQ,
    NUMBER,
    OPEN,
    ORDER,
    OUTPUT,
    PREDICT,
    SEVERAL,
    answer_all,
    clean_page,
    folded,
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


# ------------------------------------------------------------------------------- every kind


def test_one_of_several_options(page: Page) -> None:
    one = question(page, MCQ)
    group = one.get_by_role("group", name="Four times as long:")
    radios = group.get_by_role("radio")
    expect(radios).to_have_count(4)
    press(page, MCQ)
    expect(verdict(page, MCQ)).to_have_text("Choose one first.")
    assert kept(page, MCQ) is None
    radios.nth(0).check()
    expect(verdict(page, MCQ)).to_be_empty()
    press(page, MCQ)
    expect(verdict(page, MCQ)).to_contain_text("Not right.")
    expect(verdict(page, MCQ)).to_contain_text("Not the same.")
    expect(verdict(page, MCQ)).not_to_contain_text("Since")
    expect(one.get_by_role("radio", name="the same, T not this")).to_be_checked()
    expect(one.get_by_role("button", name="Check")).to_be_focused()
    radios.nth(1).check()
    press(page, MCQ)
    expect(verdict(page, MCQ)).to_contain_text("Right.")
    expect(verdict(page, MCQ).get_by_text("The root of four.")).to_be_visible()
    expect(verdict(page, MCQ).get_by_text("If you chose B")).to_be_hidden()
    expect(verdict(page, MCQ)).to_contain_text("Since")
    expect(verdict(page, MCQ)).to_have_attribute("role", "status")
    expect(one.get_by_role("button", name="Check")).to_be_focused()
    expect(one.get_by_role("button", name="Check")).to_have_attribute("aria-disabled", "true")
    answer = kept(page, MCQ)
    assert answer is not None
    assert (answer["right"], answer["tries"], answer["number"]) == (True, 2, 1)
    assert (answer["kind"], answer["lesson"], len(answer["given"])) == ("mcq", "1.1", 1)


def test_all_that_are_right(page: Page) -> None:
    boxes = question(page, SEVERAL).get_by_role("checkbox")
    boxes.nth(0).check()
    boxes.nth(1).check()
    press(page, SEVERAL)
    expect(verdict(page, SEVERAL)).to_contain_text(
        "Not right. Chosen but not right: 1. Right but not chosen: 1."
    )
    expect(verdict(page, SEVERAL)).to_contain_text("If you chose B It cancels.")
    # Which ones they are is not told.
    assert question(page, SEVERAL).locator("[data-mark=right], [data-mark=wrong]").count() == 0
    boxes.nth(1).uncheck()
    boxes.nth(2).check()
    press(page, SEVERAL)
    expect(verdict(page, SEVERAL)).to_contain_text("Right. Not mass.")


NUMBERS = [
    (NUMBER, "-0.08", "Not right. The size is right, the sign is not."),
    (NUMBER, "80", "the power of ten is not"),
    (NUMBER, "0.08 kg m", "The unit measures something else"),
    (NUMBER, "0.08 g cm^2", "not in the one that you wrote"),
    (NUMBER, "0.16", "A factor of two"),
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


def test_numbers(page: Page) -> None:
    tries = {NUMBER: 0, ANGLE: 0}
    for number, entered, said in NUMBERS:
        field = question(page, number).get_by_label("Your answer")
        field.fill(entered)
        field.press("Enter")
        expect(verdict(page, number)).to_contain_text(said)
        expect(field).to_be_focused()
        right = "Right." in said
        assert field.get_attribute("aria-invalid") == (None if right else "true")
        tries[number] += 1
        answer = kept(page, number)
        assert answer is not None
        found = (answer["given"], answer["right"], answer["tries"])
        assert found == (entered, right, tries[number])


UNREADABLE = [
    ("1,200", "“1,200” can be read as 1200 or as 1.200."),
    ("1/2π", "can be read in two ways"),
    ("0.08 furlong", "“furlong” is not a unit known here."),
    ("2 3", "two numbers side by side"),
    ("<img src=x onerror=alert(1)>", "something unexpected at “<img src=x onerror=alert(1)>”"),
]


def test_what_cannot_be_read_is_no_try(page: Page) -> None:
    field = question(page, NUMBER).get_by_label("Your answer")
    for entered, said in UNREADABLE:
        field.fill(entered)
        press(page, NUMBER)
        expect(verdict(page, NUMBER)).to_contain_text("This cannot be read.")
        expect(verdict(page, NUMBER)).to_contain_text(said)
        assert kept(page, NUMBER) is None
    field.fill("0.08")
    press(page, NUMBER)
    answer = kept(page, NUMBER)
    assert answer is not None and answer["tries"] == 1


def test_a_number_is_mended_beside_what_was_wrong_with_it(page: Page) -> None:
    field = question(page, NUMBER).get_by_label("Your answer")
    field.fill("80")
    press(page, NUMBER)
    field.press("End")
    field.press_sequentially("0")
    expect(verdict(page, NUMBER)).to_contain_text("the power of ten is not")
    field.fill("0.08")
    press(page, NUMBER)
    expect(verdict(page, NUMBER)).to_contain_text("So much.")
    field.press_sequentially("1")
    expect(verdict(page, NUMBER)).to_be_empty()


def test_a_prediction_is_committed_to_before_its_simulation_opens(page: Page) -> None:
    one = question(page, PREDICT)
    expect(one.locator(".lab")).to_be_hidden()
    press(page, PREDICT, "Commit to this")
    expect(verdict(page, PREDICT)).to_have_text("Choose what you predict first.")
    one.get_by_role("radio", name="it rests").check()
    press(page, PREDICT, "Commit to this")
    expect(verdict(page, PREDICT)).to_contain_text("It happens otherwise.")
    columns = one.locator(".outcome > div")
    expect(columns.nth(0)).to_have_text("You predicted" + "it rests")
    expect(columns.nth(1)).to_have_text("What happens" + "it swings")
    expect(verdict(page, PREDICT)).to_contain_text("It does not.")
    expect(verdict(page, PREDICT)).to_contain_text("Gravity pulls.")
    expect(one.get_by_role("radio").first).to_be_disabled()
    expect(one.get_by_role("button", name="Try again")).to_be_hidden()
    expect(one.get_by_role("button", name="Show the answer")).to_be_hidden()
    one.locator(".lab").scroll_into_view_if_needed()
    until(page, "() => document.querySelector('.question .lab').dataset.state === 'paused'")
    expect(one.get_by_role("button", name="Play")).to_be_visible()
    # There is no way back by loading the page again.
    visit(page, page.url)
    expect(one.get_by_role("radio", name="it rests")).to_be_checked()
    expect(one.get_by_role("radio", name="it rests")).to_be_disabled()
    expect(one.locator(".lab")).to_be_visible()


def test_an_open_question_is_compared_and_marked_by_the_learner(page: Page) -> None:
    one = question(page, OPEN)
    press(page, OPEN, "Compare")
    expect(verdict(page, OPEN)).to_have_text("Write an answer first.")
    one.get_by_label("Your answer").fill("It <b>is</b>\nso.")
    press(page, OPEN, "Compare")
    expect(verdict(page, OPEN)).to_contain_text("Since so.")
    answer = kept(page, OPEN)
    assert answer is not None and answer["right"] is None
    for name, said, right in (
        ("In part", "Marked as right in part.", False),
        ("It says the same", "Marked as right.", True),
        ("Not yet", "Marked as not right yet.", False),
    ):
        one.get_by_role("radio", name=name).check()
        expect(verdict(page, OPEN)).to_contain_text(said)
        answer = kept(page, OPEN)
        assert answer is not None and (answer["right"], answer["tries"]) == (right, 1)
    visit(page, page.url)
    expect(one.get_by_label("Your answer")).to_have_value("It <b>is</b>\nso.")
    expect(one.get_by_role("radio", name="Not yet")).to_be_checked()
    expect(verdict(page, OPEN)).to_contain_text("Marked as not right yet.")
    expect(verdict(page, OPEN)).to_contain_text("Since so.")


def test_a_line_that_is_printed(page: Page) -> None:
    field = question(page, OUTPUT).get_by_label("What it prints")
    for entered, said in (
        ("t = 2.0061 s", "Only capitals"),
        ("T = 2.006 s", "it prints more of them"),
        ("T = 2.1 s", "a number is not"),
        ("T  =  2.00610 s ", "Right."),
    ):
        field.fill(entered)
        press(page, OUTPUT)
        expect(verdict(page, OUTPUT)).to_contain_text(said)
    expect(verdict(page, OUTPUT)).to_contain_text("Four places.")


def test_an_order_by_buttons(page: Page) -> None:
    before = items(page)
    assert sorted(before) == ["1 m", "2 m", "3 m", "4 m"] != before
    press(page, ORDER)
    expect(verdict(page, ORDER)).to_contain_text("of 4 stand where they belong.")
    said = question(page, ORDER).locator("p[role=status]")
    for place, name in enumerate(("1 m", "2 m", "3 m", "4 m")):
        while items(page).index(name) > place:
            button = question(page, ORDER).get_by_role("button", name=f"Move up {name}")
            button.click()
            expect(button).to_be_focused()
            expect(said).to_have_text(f"{name}: place {items(page).index(name) + 1} of 4")
    expect(verdict(page, ORDER)).to_be_empty()
    press(page, ORDER)
    expect(verdict(page, ORDER)).to_contain_text("Right. By length.")
    visit(page, page.url)
    assert items(page) == ["1 m", "2 m", "3 m", "4 m"]


def test_an_order_by_dragging(page: Page) -> None:
    grips = question(page, ORDER).locator(".item-grip")
    before = items(page)
    grips.first.scroll_into_view_if_needed()
    start, end = grips.nth(0).bounding_box(), grips.nth(3).bounding_box()
    assert start is not None and end is not None
    x = start["x"] + start["width"] / 2
    page.mouse.move(x, start["y"] + start["height"] / 2)
    page.mouse.down()
    for share in (0.2, 0.4, 0.6, 0.8, 1.0, 1.2):
        page.mouse.move(x, start["y"] + share * (end["y"] + end["height"] - start["y"]))
    page.mouse.up()
    assert items(page) == [*before[1:], before[0]]
    expect(question(page, ORDER).locator("p[role=status]")).to_have_text(
        f"{before[0]}: place 4 of 4"
    )


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
    assert items(page)[:2] == ["2 m", "1 m"]
    keys.press("ArrowUp")
    press(page, ORDER)
    expect(verdict(page, ORDER)).to_contain_text("Right.")
    page.evaluate("document.activeElement.blur()")


# ------------------------------------------------------------------- hints, answers, retries


def test_hints_come_one_by_one(page: Page) -> None:
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
    visit(page, page.url)
    expect(hints.nth(1)).to_be_visible()


def test_the_answer_can_be_asked_for_after_a_try_and_tried_again(page: Page) -> None:
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
    assert folded(verdict(page, ORDER).locator("ol > li")) == ["1 m", "2 m", "3 m", "4 m"]


# ------------------------------------------------------------------------ labels and markup


def test_formulas_code_and_markup_in_options_choose_them(page: Page) -> None:
    one = question(page, MCQ)
    radios = one.get_by_role("radio")
    one.locator("math", has_text="2").first.click()
    expect(radios.nth(1)).to_be_checked()
    one.locator(".options code").click()
    expect(radios.nth(2)).to_be_checked()
    one.locator(".options b").click()
    expect(radios.nth(3)).to_be_checked()
    one.get_by_role("link", name="factor").click()
    assert page.evaluate("location.hash") == "#hello"


def test_no_id_is_there_twice_and_every_reference_leads_somewhere(page: Page) -> None:
    answer_all(page)
    assert page.evaluate(
        """() => {
          const ids = [...document.querySelectorAll('[id]')].map((element) => element.id)
          const twice = ids.filter((id, i) => ids.indexOf(id) !== i)
          const named = ['for', 'aria-describedby', 'aria-labelledby'].flatMap((name) =>
            [...document.querySelectorAll(`[${name}]`)].flatMap((element) =>
              element.getAttribute(name).split(' ')))
          return [twice, named.filter((id) => !ids.includes(id))]
        }"""
    ) == [[], []]  # fmt: skip
