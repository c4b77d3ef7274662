"""While a lab runs the page answers: its thread is free, and no task holds it for long.

A machine under load stretches tasks and shares by what is not the page's doing: a thread that waits
for a processor counts as busy, and even an empty task may last long. Load comes and goes, while
what the page itself does comes back in every window of time. So several windows are looked at, and
the best one counts: a page that is too busy is so in all of them.
"""

from __future__ import annotations

import pytest
from playwright.sync_api import BrowserContext, CDPSession, Page

from support.lab_course import PAGE
from support.lab_page import SWING, lab, reach, watched

pytestmark = pytest.mark.browser

WINDOWS, SECONDS = 10, 3.0
LONG = 50
"""ms: from here on a browser calls a task long."""
BUSY = 0.25
"""Largest share of the time that the page's thread may work."""

WATCH = """() => {
  window.longTasks = []
  const told = (list) => window.longTasks.push(...list.getEntries().map((task) => task.duration))
  new PerformanceObserver(told).observe({ type: 'longtask' })
}"""
# Work on each picture, to see that this file's tests see it.
BURDEN = """(ms) => {
  const work = () => {
    const end = performance.now() + ms
    while (performance.now() < end);
    requestAnimationFrame(work)
  }
  requestAnimationFrame(work)
}"""


def run(context: BrowserContext, base: str) -> tuple[Page, CDPSession, list[str]]:
    """The swing with its plot, running for a while."""
    page, said = watched(context)
    page.goto(base + PAGE)
    swing = lab(page)
    swing.get_by_role("button", name="Play").click()
    reach(page, SWING, "playing")
    page.wait_for_timeout(1000)
    page.evaluate(WATCH)
    session = context.new_cdp_session(page)
    session.send("Performance.enable")
    return page, session, said


def window(page: Page, session: CDPSession) -> tuple[list[float], float]:
    """The long tasks of some seconds, and the busy share of the page's thread."""

    def clocks() -> tuple[float, float]:
        metrics = session.send("Performance.getMetrics")["metrics"]
        values = {metric["name"]: float(metric["value"]) for metric in metrics}
        return values["Timestamp"], values["TaskDuration"]

    page.evaluate("() => { window.longTasks.length = 0 }")
    begun, before = clocks()
    page.wait_for_timeout(1000 * SECONDS)
    ended, after = clocks()
    long: list[float] = page.evaluate("() => window.longTasks.splice(0)")
    return long, (after - before) / (ended - begun)


def test_no_task_is_long_and_the_thread_is_free(context: BrowserContext, base: str) -> None:
    page, session, said = run(context, base)
    found = []
    for _ in range(WINDOWS):
        found.append(window(page, session))
        if any(not long for long, _ in found) and min(busy for _, busy in found) < BUSY:
            break
    assert any(not long for long, _ in found), f"tasks of more than {LONG} ms: {found}"
    assert min(busy for _, busy in found) < BUSY, found
    assert page.locator(".lab").first.get_attribute("data-state") == "playing"
    assert said == []


@pytest.mark.parametrize(("burden", "long"), [(80, True), (30, False)])
def test_a_page_that_works_on_each_picture_is_found_out(
    context: BrowserContext, base: str, burden: int, long: bool
) -> None:
    """What the test above measures is there to be measured."""
    page, session, _ = run(context, base)
    page.evaluate(BURDEN, burden)
    page.wait_for_timeout(500)
    # A machine under load may draw so few pictures that even this is little work.
    for _ in range(WINDOWS):
        tasks, busy = window(page, session)
        assert all(ms >= LONG for ms in tasks)
        if busy > BUSY and (len(tasks) > 5 or not long):
            break
    else:
        raise AssertionError((busy, tasks))
