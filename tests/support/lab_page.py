"""Helpers of the browser tests of labs: finding a lab, waiting, reading what it shows."""

from __future__ import annotations

import base64
import json
import urllib.request
import zlib
from collections.abc import Callable
from urllib.parse import parse_qs, urlsplit

import numpy as np
from playwright.sync_api import BrowserContext, Locator, Page, Request, Route, expect

from support.chromium import SLOW
from support.fixture_cases import fixture_text

PAGE = "lessons/1.1-one.html"
"""The page of the course in `tests/courses/labs`."""
SWING, AUTO, ALL, TWINS, EDITED_LAB = 0, 1, 2, 3, 4
"""The index of each lab on the page."""

MOUNT = fixture_text("scripts/mount_lab.js")
"""Mounts a lab in a copy of its element that the page's own script does not know, and stores it as
`window.made`, so that a test can inspect more than its picture."""


def watch_page(context: BrowserContext) -> tuple[Page, list[str]]:
    """Open a page, with a list of its console messages and its errors but for aborted requests."""
    page, console = context.new_page(), list[str]()

    def on_failure(request: Request) -> None:
        if request.failure != "net::ERR_ABORTED":
            console.append(f"failed: {request.url}")

    page.on("console", lambda message: console.append(message.text))
    page.on("pageerror", lambda error: console.append(str(error)))
    page.on("requestfailed", on_failure)
    return page, console


def fetch_text(route: Route) -> str:
    """Fetch the text at a request's URL; works also if its page has been closed meanwhile."""
    with urllib.request.urlopen(route.request.url, timeout=SLOW / 1000) as answer:
        return bytes(answer.read()).decode()


def until(page: Page, true: str, argument: object = None) -> None:
    """Wait until a script returns a true value; Playwright's own needs the forbidden `eval`."""
    wait_for_condition(page, lambda: bool(page.evaluate(true, argument)), true)


def becomes(page: Page, value: Callable[[], object], expected: object) -> None:
    """Wait until a value equals the expected one; on failure, report the last value."""
    for _ in range(SLOW // 25):
        last = value()
        if last == expected:
            return
        page.wait_for_timeout(25)
    assert last == expected


def wait_until_settled(page: Page) -> None:
    """Wait until the page's script has run, its fonts are loaded, and the browser is idle."""
    expect(page.locator("[data-tools] select").first).to_be_attached()
    until(page, "document.fonts.status === 'loaded'")
    page.evaluate("() => new Promise((done) => requestIdleCallback(done, { timeout: 10000 }))")


def lab(page: Page, number: int = SWING, state: str | None = "paused") -> Locator:
    """A lab of the page, scrolled into view and, unless `state` is None, in that state."""
    locator = page.locator(".lab").nth(number)
    locator.scroll_into_view_if_needed()
    if state is not None:
        wake(page, number)
        reach(page, number, state)
    return locator


WAKE = """(lab) => {
  if (lab.dataset.state === 'asleep') lab.querySelector('.lab-transport .lab-icon').click()
}"""


def wake(page: Page, number: int) -> None:
    """Let a lab load its engine, as anything that is asked of it does; here, to be reset."""
    until(page, "(n) => document.querySelectorAll('.lab')[n].dataset.state !== undefined", number)
    page.locator(".lab").nth(number).evaluate(WAKE)


def reach(page: Page, number: int, state: str) -> None:
    until(
        page,
        "([n, state]) => document.querySelectorAll('.lab')[n].dataset.state === state",
        [number, state],
    )


NOTE_CHANGES = fixture_text("scripts/note_changes.js")


def note_changes(element: Locator) -> None:
    """Note each state or text of an element from now on: one may pass before a test looks."""
    element.evaluate(NOTE_CHANGES)


def has_been(element: Locator, value: str) -> None:
    """Wait until an element has or has had a state or text since `note_changes`."""
    was_noted = "(element, value) => element.noted.has(value)"
    wait_for_condition(element.page, lambda: bool(element.evaluate(was_noted, value)))


def press(lab: Locator, name: str) -> None:
    lab.get_by_role("button", name=name, exact=True).click()


def readout(lab: Locator, label: str) -> str:
    row = lab.locator(".lab-live .lab-readouts > div").filter(has_text=label)
    return row.locator("dd").inner_text().strip().replace("−", "-")


def shows(lab: Locator, label: str, text: str) -> None:
    wait_for_condition(lab.page, lambda: readout(lab, label) == text)


def wait_for_condition(page: Page, true: Callable[[], bool], name: str = "it") -> None:
    """Wait until a condition holds, with a limit that is generous enough for a slow machine."""
    for _ in range(SLOW // 25):
        if true():
            return
        page.wait_for_timeout(25)
    raise AssertionError(f"never true: {name}")


def wait_for_change(page: Page, view: Locator, before: bytes) -> bytes:
    for _ in range(SLOW // 100):
        now = view.screenshot()
        if now != before:
            return now
        page.wait_for_timeout(100)
    raise AssertionError("the picture stays as it is")


def wait_until_still(page: Page, view: Locator) -> bytes:
    before = view.screenshot()
    for _ in range(SLOW // 300):
        page.wait_for_timeout(300)
        now = view.screenshot()
        if now == before:
            return now
        before = now
    raise AssertionError("the picture never stays as it is")


def time_of(lab: Locator) -> float:
    text = lab.locator(".lab-time").inner_text().removesuffix("s").strip()
    return float(text or "nan")  # a lab whose engine is not loaded yet shows none


def state_of(page: Page, lab: Locator) -> dict[str, object]:
    """The content of the link that a lab makes of its state."""
    page.evaluate("() => history.replaceState(null, '', location.pathname)")  # so that it is news
    before = page.evaluate("() => location.href")
    lab.get_by_role("button", name="Copy link").click()
    until(page, "before => location.href !== before", before)
    return parse_link(page.evaluate("() => location.href"))


def parse_link(address: str) -> dict[str, object]:
    """The content of a link: the fields of its JSON, and the physics state as `physics`."""
    packed = parse_qs(urlsplit(address).fragment)["z"][0]
    content = zlib.decompress(base64.urlsafe_b64decode(packed + "==="), wbits=-15)
    head, _, physics = content.partition(b"\n")
    state: dict[str, object] = json.loads(head)
    return {**state, "physics": physics}


def floats(state: dict[str, object]) -> np.ndarray:
    physics = state["physics"]
    assert isinstance(physics, bytes)
    return np.frombuffer(physics, dtype="<f8")
