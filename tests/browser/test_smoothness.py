"""While a lab runs the page answers: its thread is free, and no task holds it for long.

Counted is the processor time of tasks: other work on the machine makes none of them longer.
"""

from __future__ import annotations

import json
from collections import defaultdict

import pytest
from playwright.sync_api import BrowserContext, Page

from support.lab_page import PAGE, SWING, lab, reach, time_of, wait_for_condition, watch_page

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PICTURES = 180
LONG = 50
"""ms: from here on a browser calls a task long."""
BUSY = 0.25
"""Largest share of the time that the page's thread may work."""

# Work on each picture, to see that this file's tests see it.
BURDEN = """(ms) => {
  const work = () => {
    const end = performance.now() + ms
    while (performance.now() < end);
    requestAnimationFrame(work)
  }
  requestAnimationFrame(work)
}"""
DRAW = """(n) => new Promise((done) => {
  const begun = performance.now()
  const next = () => (n-- > 0 ? requestAnimationFrame(next) : done(performance.now() - begun))
  next()
})"""


def run(context: BrowserContext, base: str) -> tuple[Page, list[str]]:
    """The swing with its plot, running for a while."""
    page, console = watch_page(context)
    page.goto(base + PAGE)
    swing = lab(page)
    swing.get_by_role("button", name="Play").click()
    reach(page, SWING, "playing")
    wait_for_condition(page, lambda: time_of(swing) > 1)
    return page, console


def tasks(page: Page, pictures: int) -> tuple[list[float], float]:
    """Of each task of the page's thread the processor time, while so many pictures are drawn.

    And how long that took; both in ms.
    """
    browser = page.context.browser
    assert browser is not None
    browser.start_tracing(page=page, categories=["disabled-by-default-devtools.timeline"])
    elapsed = float(page.evaluate(DRAW, pictures))
    events = json.loads(browser.stop_tracing())["traceEvents"]
    main = {
        (event["pid"], event["tid"])
        for event in events
        if event["name"] == "thread_name" and event["args"]["name"] == "CrRendererMain"
    }
    task_times: dict[tuple[int, int], list[float]] = defaultdict(list)
    for event in events:
        thread = event["pid"], event["tid"]
        if event["name"] == "RunTask" and thread in main:
            task_times[thread].append(event.get("tdur", 0) / 1000)
    return max(task_times.values(), key=sum), elapsed


def test_no_task_is_long_and_the_thread_is_free(context: BrowserContext, base: str) -> None:
    page, console = run(context, base)
    task_times, elapsed = tasks(page, PICTURES)
    assert [ms for ms in task_times if ms > LONG] == []
    assert sum(task_times) < BUSY * elapsed
    assert page.locator(".lab").first.get_attribute("data-state") == "playing"
    assert console == []


def test_page_that_works_on_each_picture_is_found_out(context: BrowserContext, base: str) -> None:
    """What the test above measures is there to be measured."""
    page, _ = run(context, base)
    page.evaluate(BURDEN, 30)
    task_times, _ = tasks(page, 30)
    assert [ms for ms in task_times if ms > LONG] == []
    assert sum(task_times) > BUSY * 30 * 1000 / 60  # at sixty pictures in a second
    page.evaluate(BURDEN, 500)  # of which a processor that others want gives it a part
    task_times, _ = tasks(page, 5)
    assert len([ms for ms in task_times if ms > LONG]) >= 4


def test_simulated_time_never_runs_ahead_and_lateness_is_told(
    context: BrowserContext, base: str
) -> None:
    page, _ = run(context, base)
    clock = "() => [performance.now() / 1000, document.querySelector('.lab-time').textContent]"

    def window() -> tuple[float, float, str]:
        start, first = page.evaluate(clock)
        page.evaluate(DRAW, 120)
        end, last = page.evaluate(clock)
        late = page.inner_text(".lab-late")
        return float(last.split()[0]) - float(first.split()[0]), end - start, late

    samples = []

    def holds() -> bool:
        simulated, elapsed, late = window()
        samples.append((simulated, elapsed, late))
        # A number may be shown late, so that from there on more seems to have passed than has; a
        # clock that runs ahead does so in every window. How fast a machine is decides nothing;
        # that it could not keep up must be said.
        return 0 < simulated < elapsed + 0.2 and (simulated > 0.8 * elapsed or "×" in late)

    assert any(holds() for _ in range(6)), samples
