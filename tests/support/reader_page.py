"""What the tests of a reader's progress share: to answer, and to read what is kept and shown."""

from __future__ import annotations

import datetime
import json

from playwright.sync_api import BrowserContext, Locator, Page

from support.lab_page import watched

KEY = "coursebuild.progress.motion"
PUSH_PAGE = "lessons/1.1-push.html"
FALL_PAGE = "lessons/1.2-fall.html"


def opened(context: BrowserContext, address: str) -> Page:
    """A page; `quiet` says whether its console is empty."""
    page, said = watched(context)
    page.goto(address)
    SAID[page] = said
    return page


SAID: dict[Page, list[str]] = {}


def quiet(*pages: Page) -> bool:
    """Nothing was said on the consoles of pages, but what a test brings about itself.

    There is no service worker, and an icon may still be loading when the next page is opened.
    """
    said = [text for page in pages for text in SAID[page]]
    ours = ("blocked by Playwright", "/assets/icon.")
    return all(any(part in text for part in ours) for text in said)


def mark(page: Page, id: str) -> str:
    """The mark of a lesson, as it is read out."""
    place = page.locator(f'[data-lesson="{id}"] [data-mark]')
    return " ".join((place.text_content() or "").split())


def question(page: Page, key: str) -> Locator:
    return page.locator(f'[data-question="{key}"]')


def choose(page: Page, found: Locator, option: str) -> None:
    found.scroll_into_view_if_needed()  # questions come alive when they come near
    found.get_by_label(option, exact=False).check()
    found.locator(".quiz-check").click()


def kept(page: Page) -> dict[str, object]:
    found: dict[str, object] = json.loads(page.evaluate("key => localStorage.getItem(key)", KEY))
    return found


def put(page: Page, *answers: dict[str, object], at: datetime.datetime | None = None) -> None:
    """Write answers into the storage as an earlier visit would have."""
    when = at or datetime.datetime.now(datetime.UTC) - datetime.timedelta(days=2)
    tick = int(when.timestamp() * 1000)
    quizzes: dict[str, dict[str, object]] = {}
    for number, given in enumerate(answers, 1):
        answer = {"kind": "mcq", "given": [], "right": False, "tries": 1, "hints": 0, "number": 1}
        answer |= {"lesson": "1.1", "at": when.strftime("%Y-%m-%dT%H:%M:%S.000Z")} | given
        quiz, key = answer.pop("quiz"), answer.pop("key")
        assert isinstance(quiz, str)
        assert isinstance(key, str)
        entry = {"answer": {"tick": tick + number, **answer}}
        recalls = [] if answer["right"] else [[tick + number, 0, tick]]
        quizzes.setdefault(quiz, {})[key] = {**entry, "recalls": recalls}
    text = {"coursebuild": "progress", "version": 1, "course": "motion", "reset": 0}
    data = json.dumps({**text, "answers": quizzes, "lessons": {}})
    page.evaluate("([key, data]) => localStorage.setItem(key, data)", [KEY, data])
