"""What the tests of labs in a browser share: to find a lab, to wait, to read what it shows."""

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

SWING, AUTO, ALL, TWINS, EDITED = 0, 1, 2, 3, 4
"""The labs of the page, by number."""

MOUNT = """async (number) => {
  const place = document.querySelectorAll('.lab')[number]
  const copy = place.cloneNode(true)
  place.replaceWith(copy)
  copy.id = 'tried'
  const script = new URL(copy.dataset.script, document.baseURI).href
  const { mountLab } = await import(script)
  window.made = await mountLab(copy, (key) => key)
  copy.querySelector('.lab-view').scrollIntoView({ block: 'center' })
}"""
"""Mounts a lab by hand, in a copy of its place that the page's own script does not know: so that a
test sees more of it, as `made`, than its picture."""


def watch_page(context: BrowserContext) -> tuple[Page, list[str]]:
    """A page, and what it says to the console.

    What was still on its way when the next page was opened is no failure.
    """
    page, console = context.new_page(), list[str]()

    def on_failure(request: Request) -> None:
        if request.failure != "net::ERR_ABORTED":
            console.append(f"failed: {request.url}")

    page.on("console", lambda message: console.append(message.text))
    page.on("pageerror", lambda error: console.append(str(error)))
    page.on("requestfailed", on_failure)
    return page, console


def fetch_text(route: Route) -> str:
    """What the server has where a request goes to; also when its page is closed meanwhile."""
    with urllib.request.urlopen(route.request.url, timeout=SLOW / 1000) as answer:
        return bytes(answer.read()).decode()


def until(page: Page, true: str, argument: object = None) -> None:
    """Wait for something on a page; Playwright's own way needs `eval`, which the pages forbid."""
    for _ in range(SLOW // 25):
        if page.evaluate(true, argument):
            return
        page.wait_for_timeout(25)
    raise AssertionError(f"never true: {true}")


def becomes(page: Page, value: Callable[[], object], expected: object) -> None:
    """Wait until a value is what is wanted; the last one is told if it never is."""
    for _ in range(SLOW // 25):
        last = value()
        if last == expected:
            return
        page.wait_for_timeout(25)
    assert last == expected


def wait_until_settled(page: Page) -> None:
    """Wait until the page's script has run, its fonts are there, and it has nothing left to do."""
    expect(page.locator("[data-tools] select").first).to_be_attached()
    until(page, "document.fonts.status === 'loaded'")
    page.evaluate("() => new Promise((done) => requestIdleCallback(done))")


def lab(page: Page, number: int = SWING, state: str | None = "paused") -> Locator:
    """A lab of the page, in the window and started."""
    locator = page.locator(".lab").nth(number)
    locator.scroll_into_view_if_needed()
    if state is not None:
        reach(page, number, state)
    return locator


def reach(page: Page, number: int, state: str) -> None:
    until(
        page,
        "([n, state]) => document.querySelectorAll('.lab')[n].dataset.state === state",
        [number, state],
    )


def press(lab: Locator, name: str) -> None:
    lab.get_by_role("button", name=name, exact=True).click()


def readout(lab: Locator, label: str) -> str:
    row = lab.locator(".lab-live .lab-readouts > div").filter(has_text=label)
    return row.locator("dd").inner_text().strip().replace("−", "-")


def shows(lab: Locator, label: str, text: str) -> None:
    """A readout comes to show a text; a page draws when it gets to it."""
    wait_for_condition(lab.page, lambda: readout(lab, label) == text)


def wait_for_condition(page: Page, true: Callable[[], bool]) -> None:
    """Wait for something; how long it takes on a machine is no matter."""
    for _ in range(SLOW // 50):
        if true():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it never comes")


def wait_for_change(page: Page, view: Locator, before: bytes) -> bytes:
    """The picture once it is another one."""
    for _ in range(SLOW // 100):
        now = view.screenshot()
        if now != before:
            return now
        page.wait_for_timeout(100)
    raise AssertionError("the picture stays as it is")


def wait_until_still(page: Page, view: Locator) -> bytes:
    """The picture once it changes no more."""
    before = view.screenshot()
    for _ in range(SLOW // 300):
        page.wait_for_timeout(300)
        now = view.screenshot()
        if now == before:
            return now
        before = now
    raise AssertionError("the picture never stays as it is")


def time_of(lab: Locator) -> float:
    return float(lab.locator(".lab-time").inner_text().removesuffix("s").strip())


def state_of(page: Page, lab: Locator) -> dict[str, object]:
    """What the link of a lab's state holds."""
    page.evaluate("() => history.replaceState(null, '', location.pathname)")  # so that it is news
    before = page.evaluate("() => location.href")
    lab.get_by_role("button", name="Copy link").click()
    until(page, "before => location.href !== before", before)
    return parse_link(page.evaluate("() => location.href"))


def parse_link(address: str) -> dict[str, object]:
    """The content of a link: its JSON, and the physics as `physics`."""
    packed = parse_qs(urlsplit(address).fragment)["z"][0]
    content = zlib.decompress(base64.urlsafe_b64decode(packed + "==="), wbits=-15)
    head, _, physics = content.partition(b"\n")
    state: dict[str, object] = json.loads(head)
    return {**state, "physics": physics}


def floats(state: dict[str, object]) -> np.ndarray:
    physics = state["physics"]
    assert isinstance(physics, bytes)
    return np.frombuffer(physics, dtype="<f8")
