"""What a page with a lab costs its reader: bytes, the first frame, how often pictures come.

Entry points: `page_cost`, `tape_cost`, `robot_cost`.
"""

from __future__ import annotations

import re
import statistics
import sys
from pathlib import Path
from typing import Any

WORKER_FILE = "**/worker.*.js"
NO_TAPE = (
    "{range:{start:0,end:0,marks:[],touches:[]},isPast:false,before:()=>null,"
    "clear(){},after(){},event(){},mark(){},cut(){}}"
)
"""What stands in the place of a lab's tape, in JavaScript, to see what the tape costs."""
WATCH = """() => {
  window.frames_ = []; window.long_ = []
  new PerformanceObserver((list) => list.getEntries().forEach((e) => window.long_.push(e.duration)))
    .observe({ entryTypes: ['longtask'] })
  let last = null
  const tick = (now) => {
    if (last !== null) window.frames_.push(now - last)
    last = now
    requestAnimationFrame(tick)
  }
  requestAnimationFrame(tick)
}"""


def page_cost(browser: Any, url: str, name: str) -> str:
    """The weight of a page, and how its lab runs."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    sizes: list[int] = []
    page = context.new_page()
    page.on("response", lambda r: sizes.append(int(r.headers.get("content-length", 0))))
    page.goto(url, wait_until="networkidle")
    before = f"{len(sizes)} requests, {sum(sizes) / 1e3:.0f} kB"
    if page.locator(".lab").count() == 0:
        context.close()
        return f"  page {name}: {before}"
    page.locator(".lab").first.scroll_into_view_if_needed()
    page.wait_for_selector(".lab-play", timeout=60_000)
    page.wait_for_load_state("networkidle")
    after = f"{len(sizes)} requests, {sum(sizes) / 1e3:.0f} kB when the lab is near"
    page.reload(wait_until="networkidle")
    page.locator(".lab").first.scroll_into_view_if_needed()
    page.wait_for_selector(".lab-play", timeout=60_000)
    run = run_cost(context, page)
    context.close()
    return f"  page {name}: {before}; {after}\n    {run}"


def run_cost(context: Any, page: Any) -> str:
    """How the lab of a page runs, from Play on."""
    page.evaluate(WATCH)
    start_ms = first_frame(page)
    return f"Play to first moving frame {start_ms:.0f} ms (warm cache); {frame_cost(context, page)}"


def first_frame(page: Any) -> float:
    """Milliseconds from Play to the first moving frame of a page's first lab, which is in sight."""
    clock = "document.querySelector('.lab-time').textContent"
    return page.evaluate(
        f"""async () => {{
          const first = {clock}; const began = performance.now()
          document.querySelector('.lab-play').click()
          while ({clock} === first) await new Promise(requestAnimationFrame)
          return performance.now() - began
        }}"""
    )


def pass_on(route: Any) -> None:
    """Answer the request for the worker by the worker, as late as by another one."""
    route.fulfill(response=route.fetch())


def leave_out_tape(route: Any) -> None:
    """Answer the request for the worker by one that keeps no run."""
    text, count = re.subn(r"\.tape=new \w+\(this\.lab\)", f".tape={NO_TAPE}", route.fetch().text())
    if count != 1:
        sys.exit("the worker does not make a tape as expected")
    route.fulfill(body=text, content_type="text/javascript")


def tape_cost(browser: Any, url: str, rounds: int) -> str:
    """The time to the first moving frame with the tape and without, in turns."""
    starts: dict[bool, list[float]] = {True: [], False: []}
    for has_tape in [True, False] * (rounds + 1):
        context = browser.new_context(
            viewport={"width": 1280, "height": 900}, service_workers="block"
        )
        page = context.new_page()
        page.route(WORKER_FILE, pass_on if has_tape else leave_out_tape)
        page.goto(url, wait_until="networkidle")
        page.locator(".lab").first.scroll_into_view_if_needed()
        page.wait_for_selector(".lab-play", timeout=60_000)
        with page.expect_request(WORKER_FILE):  # else the tape would have been left in
            starts[has_tape].append(first_frame(page))
        context.close()
    taped, plain = (statistics.median(times[1:]) for times in starts.values())
    return f"  first moving frame {taped:.0f} ms with the tape, {plain:.0f} ms without (medians)"


COUNT_PICTURES = """
  const { fenceSync } = WebGL2RenderingContext.prototype
  window.pictures_ = 0
  WebGL2RenderingContext.prototype.fenceSync = function (...all) {
    window.pictures_ += 1
    return fenceSync.apply(this, all)
  }"""
"""Without a graphics processor the stage of a page waits for a fence behind each picture."""
SETTLED = 10_000  # ms, after which a page has found how coarsely to draw


def robot_cost(browser: Any, url: str, path: Path) -> str:
    """How the model of a zip is drawn that a reader opens in the editor of a lab."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.add_init_script(COUNT_PICTURES)
    page.goto(url)
    lab = page.locator(".lab").first
    lab.scroll_into_view_if_needed()
    lab.get_by_role("button", name="Open in the editor").click()
    lab.locator("input[type=file]").set_input_files(path)
    page.wait_for_selector('.lab[data-state="playing"]', timeout=120_000)
    page.evaluate(WATCH)
    page.wait_for_timeout(SETTLED)
    count = "() => [window.pictures_, performance.now() / 1000]"
    first, start = page.evaluate(count)
    cost = frame_cost(context, page)
    last, end = page.evaluate(count)
    rate = (last - first) / (end - start)
    width = lab.locator("canvas.lab-canvas").get_attribute("width")
    text = lab.locator(".lab-late").last.inner_text() or "nothing"
    context.close()
    return f"  {path.stem}: {rate:.0f} pictures a second, {width} pixels wide; said: {text}; {cost}"


def frame_cost(context: Any, page: Any) -> str:
    """The frames of a lab that runs, in a page that is watched."""
    session = context.new_cdp_session(page)
    session.send("Performance.enable")

    def read_busy_time() -> tuple[float, float]:
        metrics = {m["name"]: m["value"] for m in session.send("Performance.getMetrics")["metrics"]}
        return metrics["TaskDuration"], metrics["Timestamp"]

    task, stamp = read_busy_time()
    page.evaluate("() => { window.frames_.length = 0; window.long_.length = 0 }")
    page.wait_for_timeout(5000)
    frames = page.evaluate("window.frames_")
    long = page.evaluate("window.long_")
    task_end, stamp_end = read_busy_time()
    median = statistics.median(frames)
    slow = sorted(frames)[int(0.99 * len(frames))]
    busy = (task_end - task) / (stamp_end - stamp)
    per_frame = 1000 * (task_end - task) / len(frames)
    return (
        f"frame median {median:.1f} ms, 99th percentile {slow:.1f} ms; {len(long)} tasks over 50 ms"
        f" in 5 s; page thread busy {100 * busy:.0f} %, {per_frame:.1f} ms a frame"
    )
