"""Helpers of the tests of a reader's progress: answering, and reading what is stored and shown."""

from __future__ import annotations

import datetime
import json

from playwright.sync_api import Locator, Page

KEY = "coursebuild.progress.motion"
PUSH_PAGE = "lessons/1.1-push.html"
FALL_PAGE = "lessons/1.2-fall.html"
OVERALL = '[data-progress="overall"]'


def question(page: Page, key: str) -> Locator:
    return page.locator(f'[data-question="{key}"]')


def choose(part: Locator, option: str) -> None:
    part.get_by_label(option, exact=False).check()
    part.locator(".quiz-check").click()


def stored_progress(page: Page) -> dict[str, object]:
    text = page.evaluate("key => localStorage.getItem(key)", KEY)
    progress: dict[str, object] = json.loads(text)
    return progress


WAY = {"quiz": "fall", "key": "way", "lesson": "1.2"}
"""A wrong answer in lesson 1.2."""


def store_answers(page: Page, *answers: dict[str, object]) -> None:
    """Write answers into the storage as a visit two days ago would have."""
    time = datetime.datetime.now(datetime.UTC) - datetime.timedelta(days=2)
    tick = int(time.timestamp() * 1000)
    quizzes: dict[str, dict[str, object]] = {}
    for number, fields in enumerate(answers, 1):
        answer = {"kind": "mcq", "given": [], "right": False, "tries": 1, "hints": 0, "number": 1}
        answer |= {"lesson": "1.1", "at": time.strftime("%Y-%m-%dT%H:%M:%S.000Z")} | fields
        quiz, key = str(answer.pop("quiz")), str(answer.pop("key"))
        recalls = [] if answer["right"] else [[tick + number, 0, tick]]
        entry = {"answer": {"tick": tick + number, **answer}, "recalls": recalls}
        quizzes.setdefault(quiz, {})[key] = entry
    text = {"coursebuild": "progress", "version": 1, "course": "motion", "reset": 0}
    data = json.dumps({**text, "answers": quizzes, "lessons": {}})
    page.evaluate("([key, data]) => localStorage.setItem(key, data)", [KEY, data])
