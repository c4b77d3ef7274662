"""Quizzes in a headless Chromium: every kind answered, by mouse, by keys and with the pointer."""

from __future__ import annotations

import functools
import http.server
import json
import shutil
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from coursekit import Folder, block
from labcourse import PENDULUM
from labpage import until, watched
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect
from test_serving import serving

pytestmark = pytest.mark.browser

ROOT = Path(__file__).resolve().parents[2]
MODULES = ROOT / "site" / "node_modules"
PATH = "lessons/1.1-one.html"
MCQ, SEVERAL, NUMBER, ANGLE, PREDICT, OPEN, OUTPUT, ORDER, BARE = range(9)
"""The questions, by number."""

QUESTIONS: list[dict[str, Any]] = [
    {"kind": "mcq", "label": "Length", "q": "Four times as long:",
     "options": ["the same, $T$", "twice as long, $2T$", "`4*T` or $\\frac{4T}{1}$",
                 '<b>longer</b> by a <a href="#hello">factor</a>'],
     "answer": 1, "feedback": ["Not the same.", "The root of four.", "", ""],
     "hints": ["First $x$.", "Second."], "explain": "Since $T = 2\\pi\\sqrt{\\ell/g}$."},
    {"kind": "mcq", "q": "What counts?", "options": ["length", "mass", "gravity"],
     "answer": [0, 2], "feedback": ["", "It cancels.", ""], "explain": "Not mass."},
    {"kind": "numeric", "id": "inertia", "q": "How much?\n\nAbout $z$.", "answer": 0.08,
     "tol": 0.0001, "unit": "kg m^2", "hints": ["Where is its centre?"], "explain": "So much."},
    {"kind": "numeric", "q": "Half of $\\pi$?", "answer": 1.5708, "tol": 0.001, "unit": "rad"},
    {"kind": "predict", "q": "Released at 2 rad:", "options": ["it rests", "it swings"],
     "answer": 1, "feedback": ["It does not.", "It does."], "explain": "Gravity pulls.",
     "sim": {"model": "pendulum", "key": "up", "title": "The swing", "height": 200,
             "readouts": [{"label": "angle", "expr": "data.qpos[0]"}]}},
    {"kind": "open", "q": "Why?", "reference": "Since **so**.", "explain": "That is why."},
    {"kind": "output", "q": "Before you run it:", "of": "examples/a.py", "line": 2,
     "explain": "Four places."},
    {"kind": "order", "q": "From short to long:", "items": ["1 m", "$2$ m", "`3` m", "4 m"],
     "explain": "By length."},
    {"kind": "predict", "q": "<div><p>Without one?</p></div>", "options": ["yes", "no"],
     "answer": 0},
]  # fmt: skip
LESSON = (
    "## Hello\n\n"
    + block("a.py", 'print("one")\nprint("T =", 2.0061, "s")', "one\nT = 2.0061 s", "digits")
    + "## Check\n\n```quiz\n"
    + json.dumps({"id": "check", "title": "Check", "questions": QUESTIONS})
    + "\n```\n\nAfter it.\n"
)
KEY = "() => Object.keys(localStorage).find((key) => key.startsWith('coursebuild.progress.'))"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="module")
def public(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Path:
    """A site with every kind of question."""
    folder = Folder(tmp_path_factory.mktemp("quizzes") / "course")
    folder.fill([LESSON], stores)
    folder.write("models/pendulum.xml", PENDULUM)
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    return folder.root / "public"


@pytest.fixture(scope="module")
def quizzes(public: Path) -> Iterator[str]:
    """The address of that site."""
    handler = functools.partial(Quiet, directory=str(public))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://localhost:{server.server_address[1]}/"
        server.shutdown()
        thread.join()


@pytest.fixture
def page(context: BrowserContext, quizzes: str) -> Iterator[Page]:
    """The lesson; nothing may go wrong in it."""
    page, said = watched(context)
    page.goto(quizzes + PATH)
    yield page
    assert said == []


def question(page: Page, number: int) -> Locator:
    return page.locator(".question").nth(number)


def verdict(page: Page, number: int) -> Locator:
    return question(page, number).locator(".verdict")


def press(page: Page, number: int, name: str = "Check") -> None:
    question(page, number).get_by_role("button", name=name, exact=True).click()


def kept(page: Page, number: int) -> dict[str, Any] | None:
    """What is kept of a question."""
    key = question(page, number).get_attribute("data-question")
    text = page.evaluate(f"localStorage[({KEY})()] ?? null")
    entry = json.loads(text)["answers"].get("check", {}).get(key) if text else None
    found: dict[str, Any] | None = entry and entry["answer"]
    return found


def items(page: Page) -> list[str]:
    return folded(question(page, ORDER).locator(".item-text"))


def folded(found: Locator) -> list[str]:
    return [" ".join(text.split()) for text in found.all_inner_texts()]


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


@pytest.mark.parametrize(
    ("number", "entered", "said"),
    [
        (NUMBER, "0,08", "Right."),
        (NUMBER, "2*1*0.2^2", "Right.Read as 0.08 kg m2"),
        (NUMBER, "800 kg cm²", "Right.Read as 0.08 kg m2"),
        (NUMBER, "-0.08", "Not right. The size is right, the sign is not."),
        (NUMBER, "80", "the power of ten is not"),
        (NUMBER, "0.08 kg m", "The unit measures something else"),
        (NUMBER, "0.08 g cm^2", "not in the one that you wrote"),
        (NUMBER, "0.16", "A factor of two"),
        (NUMBER, "12.5", "reciprocal"),
        (ANGLE, "90", "It looks like degrees"),
        (ANGLE, "90°", "Right."),
        (ANGLE, "pi/2", "Right."),
        (ANGLE, "1.57 rad", "Right."),
        (ANGLE, "1.5", "rounded too far"),
        (ANGLE, "1.200", "Not right.Read as 1.2 rad"),
    ],
)
def test_a_number(page: Page, number: int, entered: str, said: str) -> None:
    field = question(page, number).get_by_label("Your answer")
    field.fill(entered)
    field.press("Enter")
    expect(verdict(page, number)).to_contain_text(said)
    expect(field).to_be_focused()
    right = "Right." in said
    expect(field).to_have_attribute("aria-invalid", "true") if not right else None
    answer = kept(page, number)
    assert answer is not None
    assert (answer["given"], answer["right"], answer["tries"]) == (entered, right, 1)


@pytest.mark.parametrize(
    ("entered", "said"),
    [
        ("1,200", "“1,200” can be read as 1200 or as 1.200."),
        ("1/2π", "can be read in two ways"),
        ("0.08 furlong", "“furlong” is not a unit known here."),
        ("2 3", "two numbers side by side"),
        ("<img src=x onerror=alert(1)>", "something unexpected at “<img src=x onerror=alert(1)>”"),
    ],
)
def test_what_cannot_be_read_is_no_try(page: Page, entered: str, said: str) -> None:
    field = question(page, NUMBER).get_by_label("Your answer")
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
    page.reload()
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
    page.reload()
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
    page.reload()
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
    page.reload()
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


def answer_all(page: Page) -> None:
    """Some right, some wrong, some unreadable."""
    question(page, MCQ).get_by_role("radio").first.check()
    press(page, MCQ)
    question(page, SEVERAL).get_by_role("checkbox").nth(0).check()
    question(page, SEVERAL).get_by_role("checkbox").nth(2).check()
    press(page, SEVERAL)
    question(page, NUMBER).get_by_label("Your answer").fill("1,200")
    press(page, NUMBER)
    question(page, ANGLE).get_by_label("Your answer").fill("pi/2")
    press(page, ANGLE)
    question(page, PREDICT).get_by_role("radio").first.check()
    press(page, PREDICT, "Commit to this")
    question(page, OPEN).get_by_label("Your answer").fill("So.")
    press(page, OPEN, "Compare")
    question(page, OPEN).get_by_role("radio", name="In part").check()
    question(page, OUTPUT).get_by_label("What it prints").fill("one")
    press(page, OUTPUT)
    press(page, ORDER)
    press(page, ORDER, "Show the answer")


AXE = """axe.run('.quiz', {rules: {"color-contrast-enhanced": {enabled: true}}}).then(found =>
    found.violations.map(v => [v.id, v.nodes[0].html, v.nodes[0].failureSummary]))"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [320, 1440])
def test_axe_finds_nothing_in_any_state(
    browsers: dict[str, Browser], quizzes: str, scheme: Any, width: int
) -> None:
    viewport: Any = {"width": width, "height": 800}
    with browsers["webgl"].new_context(
        viewport=viewport, color_scheme=scheme, bypass_csp=True
    ) as context:
        page, said = watched(context)
        page.goto(quizzes + PATH)
        page.evaluate((MODULES / "axe-core" / "axe.min.js").read_text(encoding="utf-8"))
        assert page.evaluate(AXE) == []
        answer_all(page)
        assert page.evaluate(AXE) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        small = page.locator(".quiz :is(button, input, summary):not(.lab *):visible").evaluate_all(
            """elements => elements.filter((element) => {
              const box = (element.closest('label') ?? element).getBoundingClientRect()
              return box.height < 24 || box.width < 24
            }).map((element) => element.outerHTML)"""
        )
        assert small == []
        assert said == []


def test_the_nu_checker_finds_nothing_in_the_live_page(page: Page, tmp_path: Path) -> None:
    answer_all(page)
    html = page.locator("main").evaluate("element => element.outerHTML")
    file = tmp_path / "live.html"
    head = '<!DOCTYPE html><html lang="en"><head><title>Live</title></head><body>'
    file.write_text(f"{head}{html}</body></html>", encoding="utf-8")
    java = shutil.which("java")
    assert java is not None, "no java: install Debian's package `default-jre-headless`"
    jar = MODULES / "vnu-jar" / "build" / "dist" / "vnu.jar"
    command = [java, "-jar", str(jar), "--format", "json", "--stdout", "--exit-zero-always"]
    done = subprocess.run([*command, str(file)], capture_output=True, text=True, check=True)
    messages = [
        (message["message"], message["extract"])
        for message in json.loads(done.stdout)["messages"]
        if "question" in message.get("extract", "") or "quiz" in message.get("extract", "")
    ]
    assert messages == []


# ----------------------------------------------------------------------- what is kept of it


def test_answers_are_there_again(page: Page) -> None:
    answer_all(page)
    page.reload()
    expect(question(page, MCQ).get_by_role("radio").first).to_be_checked()
    expect(verdict(page, MCQ)).to_contain_text("Not the same.")
    expect(verdict(page, SEVERAL)).to_contain_text("Right.")
    expect(question(page, NUMBER).get_by_label("Your answer")).to_have_value("")
    expect(question(page, ANGLE).get_by_label("Your answer")).to_have_value("pi/2")
    expect(verdict(page, PREDICT)).to_contain_text("It happens otherwise.")
    expect(verdict(page, OUTPUT)).to_contain_text("Not right.")
    # Loading a page answers nothing again.
    answer = kept(page, MCQ)
    assert answer is not None and answer["tries"] == 1


def test_an_event_tells_of_each_answer(page: Page) -> None:
    page.evaluate(
        """() => {
          window.told = []
          document.addEventListener('coursebuild:answered', ({ detail }) => told.push(detail))
        }"""
    )
    question(page, NUMBER).get_by_label("Your answer").fill("0.08")
    press(page, NUMBER)
    told = page.evaluate("told")
    assert [(one["quiz"], one["key"], one["answer"]["right"]) for one in told] == [
        ("check", "inertia", True)
    ]


def test_another_tab_follows(page: Page, context: BrowserContext) -> None:
    other = context.new_page()
    other.goto(page.url)
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
    page.goto(quizzes + PATH)
    answer_all(page)
    expect(verdict(page, SEVERAL)).to_contain_text("Right.")
    assert said == []


def test_quizzes_work_from_a_disk(browsers: dict[str, Browser], public: Path) -> None:
    with browsers["plain"].new_context() as context:
        page = context.new_page()
        page.goto(f"file://{public / PATH}")
        question(page, NUMBER).get_by_label("Your answer").fill("0.08")
        press(page, NUMBER)
        expect(verdict(page, NUMBER)).to_contain_text("Right.")
        question(page, PREDICT).get_by_role("radio").last.check()
        press(page, PREDICT, "Commit to this")
        expect(verdict(page, PREDICT)).to_contain_text("It happens as you predicted.")
        expect(question(page, PREDICT).locator(".lab-message")).to_be_visible()
        page.reload()
        expect(verdict(page, NUMBER)).to_contain_text("Right.")


@pytest.mark.parametrize(
    "given",
    ['["gone"]', '"text"', "null", "{}", "5", '[["a"]]', '{"text":5,"mark":"x"}', '[null,{"a":1}]'],
)
def test_answers_that_do_not_fit_their_question_are_left_out(page: Page, given: str) -> None:
    answer_all(page)
    expect(verdict(page, ORDER)).to_contain_text("The answer:")
    page.evaluate(
        f"""() => {{
          const key = ({KEY})()
          const state = JSON.parse(localStorage[key])
          for (const entry of Object.values(state.answers.check)) entry.answer.given = {given}
          localStorage[key] = JSON.stringify(state)
        }}"""
    )
    page.reload()
    expect(question(page, MCQ).get_by_role("radio")).to_have_count(4)
    expect(verdict(page, MCQ)).to_be_empty()
    assert sorted(items(page)) == ["1 m", "2 m", "3 m", "4 m"]
    question(page, MCQ).get_by_role("radio").nth(1).check()
    press(page, MCQ)
    expect(verdict(page, MCQ)).to_contain_text("Right.")


# -------------------------------------------------------------- without a script, on paper


def test_without_javascript_everything_is_there(browsers: dict[str, Browser], quizzes: str) -> None:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(quizzes + PATH)
        quiz = page.locator(".quiz")
        assert quiz.locator("form, fieldset, input, button, textarea").count() == 0
        folds = quiz.locator("details.answer")
        expect(folds).to_have_count(len(QUESTIONS))
        for number in range(len(QUESTIONS)):
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
    for text in ("twice as long, 2T", "So much.", "0.08 kg m2", "It happens otherwise."):
        expect(quiz.get_by_text(text).locator("visible=true").first).to_be_visible()
    expect(verdict(page, NUMBER)).to_be_hidden()  # that it could not be read
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="screen")
    # Folds that were opened for the printer are no hints that were taken.
    expect(question(page, MCQ).locator(".hint").nth(1)).to_be_hidden()


# ------------------------------------------------------------------------------ the preview


def test_a_half_typed_answer_survives_the_author(
    tmp_path: Path, stores: Path, browsers: dict[str, Browser]
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([LESSON], stores)
    folder.write("models/pendulum.xml", PENDULUM)
    with serving(folder) as preview:
        preview.heard("checked: ")
        with browsers["plain"].new_context() as context:
            page = context.new_page()
            page.goto(f"http://127.0.0.1:{preview.port}/{PATH}")
            page.evaluate("window.same = true")
            field = question(page, NUMBER).get_by_label("Your answer")
            field.fill("half of")
            field.focus()
            question(page, MCQ).get_by_role("radio").nth(2).check()
            order = shifted(page)
            field.focus()
            folder.replace(folder.lesson(), "After it.", "After it, more.")
            expect(page.locator("main")).to_contain_text("After it, more.", timeout=30_000)
            expect(field).to_have_value("half of")
            expect(field).to_be_focused()
            assert items(page) == order
            # Another question changes, and this one's explanation: what was entered stays.
            folder.replace(folder.lesson(), "Not mass.", "No, not mass.")
            folder.replace(folder.lesson(), "So much.", "So much, then.")
            until(
                page,
                "() => document.querySelectorAll('.explain')[2].textContent.includes('then')",
            )
            expect(field).to_have_value("half of")
            expect(question(page, MCQ).get_by_role("radio").nth(2)).to_be_checked()
            field.fill("0.08")
            press(page, NUMBER)
            expect(verdict(page, NUMBER)).to_contain_text("So much, then.")
            assert page.evaluate("window.same")


def shifted(page: Page) -> list[str]:
    question(page, ORDER).get_by_role("button", name="Move down").first.click()
    return items(page)
