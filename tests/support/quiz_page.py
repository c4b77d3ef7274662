"""What the tests of quizzes share: a lesson with every kind of question, and how it is answered."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from playwright.sync_api import BrowserContext, Locator, Page, expect

from support.lab_page import watch_page

PATH = "lessons/1.1-one.html"
MCQ, SEVERAL, NUMBER, ANGLE, PREDICT, OPEN, OUTPUT, ORDER, BARE = range(9)
"""The questions, by number."""

QUESTIONS = 9
ANSWER_LABEL = re.compile("Your answer|What it prints")
KEY = "() => Object.keys(localStorage).find((key) => key.startsWith('coursebuild.progress.'))"


def clean_page(context: BrowserContext, site: str) -> Iterator[Page]:
    """The lesson, with its quiz alive; nothing may go wrong in it."""
    page, console = watch_page(context)
    visit(page, site + PATH)
    yield page
    # A page that is left while a lab loads loads no further; there may be no service worker.
    ours = ("/assets/labs/", "blocked by Playwright")
    assert [text for text in console if not any(part in text for part in ours)] == []


def visit(page: Page, address: str) -> None:
    """Load the page; its quiz comes alive."""
    page.goto("about:blank")
    page.goto(address)
    expect(page.locator(".question.is-live")).to_have_count(QUESTIONS)


def question(page: Page, number: int) -> Locator:
    return page.locator(".question").nth(number)


def answer_field(page: Page, number: int) -> Locator:
    return question(page, number).get_by_role("textbox", name=ANSWER_LABEL)


def verdict(page: Page, number: int) -> Locator:
    return question(page, number).locator(".verdict")


def press(page: Page, number: int, name: str = "Check") -> None:
    question(page, number).get_by_role("button", name=name, exact=True).click()


def stored_answer(page: Page, number: int) -> dict[str, Any] | None:
    key = question(page, number).get_attribute("data-question")
    text = page.evaluate(f"localStorage[({KEY})()] ?? null")
    entry = json.loads(text)["answers"].get("check", {}).get(key) if text else None
    answer: dict[str, Any] | None = entry and entry["answer"]
    return answer


def items(page: Page) -> list[str]:
    return texts(question(page, ORDER).locator(".item-text"))


def texts(locator: Locator) -> list[str]:
    return [" ".join(text.split()) for text in locator.all_inner_texts()]


def answer_all(page: Page) -> None:
    question(page, MCQ).get_by_role("radio").first.check()
    question(page, SEVERAL).get_by_role("checkbox").nth(0).check()
    question(page, SEVERAL).get_by_role("checkbox").nth(2).check()
    answer_field(page, NUMBER).fill("1,200")
    answer_field(page, ANGLE).fill("pi/2")
    answer_field(page, OUTPUT).fill("one")
    for number in (MCQ, SEVERAL, NUMBER, ANGLE, OUTPUT, ORDER):
        press(page, number)
    press(page, ORDER, "Show the answer")
    question(page, PREDICT).get_by_role("radio").first.check()
    press(page, PREDICT, "Commit to this answer")
    answer_field(page, OPEN).fill("So.")
    press(page, OPEN, "Compare")
    question(page, OPEN).get_by_role("radio", name="In part").check()
