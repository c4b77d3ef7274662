"""Labs: steps a second natively, headless and in the browser; what a page with a lab costs.

Run: python benchmarks/labs.py [--seconds S]

1. A course with one lab for each of five models is built in a scratch folder.
2. Steps a second: native MuJoCo in batches, V8 in the build (as the trial measured it), and the
   worker of a page in headless Chromium, all in this run.
3. A page without and with a lab: requests and bytes as sent, time from Play to the first moving
   frame on a warm cache, frame times, long tasks, and how busy the page's thread is while it runs.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parents[1]

PENDULUM = """<mujoco><option timestep="0.002" integrator="RK4"/><worldbody>
<body pos="0 0 1"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
<body pos="0 0 -.5"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
</body></body></worldbody>
<keyframe><key qpos="2 0.5"/></keyframe></mujoco>"""


def chain(links: int) -> str:
    """A hanging chain of capsules with ball joints."""
    body = ""
    for _ in range(links):
        body = (
            '<body pos="0 0 -.1"><joint type="ball" damping=".001"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 -.1" size=".015"/>{body}</body>'
        )
    return (
        '<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>'
        f'<body pos="0 0 2">{body}</body></worldbody></mujoco>'
    )


def boxes(count: int) -> str:
    """Boxes that fall onto a plane in a heap."""
    bodies = "".join(
        f'<body pos="{0.07 * (i % 3):g} {0.05 * (i % 2):g} {0.2 + 0.13 * i:g}"><freejoint/>'
        '<geom type="box" size=".05 .05 .05"/></body>'
        for i in range(count)
    )
    return (
        '<mujoco><option timestep="0.002"/><worldbody><geom type="plane" size="2 2 .1"/>'
        f"{bodies}</worldbody></mujoco>"
    )


MODELS = {
    "tumbling_box": (HERE / "models" / "tumbling_box.xml").read_text(encoding="utf-8"),
    "double_pendulum": PENDULUM,
    "chain": chain(10),
    "six_boxes": boxes(6),
    "twenty_boxes": boxes(20),
}
LESSON = """## {model}

```lab simlab
{{"title": "{model}", "model": "{model}", "verify": {{"seconds": {seconds}, "rtol": 1}},
  "readouts": [{{"label": "time", "expr": "data.time", "digits": 2}}],
  "plots": [{{"ylabel": "height (m)", "xlabel": "time (s)", "window": 10,
             "traces": [{{"label": "z", "expr": "lib.bodyPos(1)[2]"}}]}}]}}
```
"""
SCRIPT = "## None\n\n```python file=examples/one.py\nprint(1)\n```\n\nOutput:\n\n```text\n1\n```\n"


def make_course(folder: Path, seconds: float) -> None:
    """One lesson for each model, and one without a lab."""
    (folder / "content" / "lessons").mkdir(parents=True)
    (folder / "models").mkdir()
    names = ["plain", *MODELS]
    entries = "".join(
        f'[[level.lesson]]\nid = "1.{i}"\nslug = "{name.replace("_", "-")}"\ntitle = "{name}"\n'
        'status = "complete"\n'
        for i, name in enumerate(names)
    )
    head = '[course]\ntitle = "Benchmark"\n[[level]]\nid = "1"\ntitle = "All"\n'
    (folder / "content" / "course.toml").write_text(head + entries)
    for i, name in enumerate(names):
        path = folder / "content" / "lessons" / f"1.{i}-{name.replace('_', '-')}.md"
        path.write_text(SCRIPT if i == 0 else LESSON.format(model=name, seconds=seconds))
    for name, text in MODELS.items():
        (folder / "models" / f"{name}.xml").write_text(text)


def run(folder: Path, *arguments: str) -> str:
    """Run coursebuild in the scratch course."""
    command = [sys.executable, "-m", "coursebuild", "-C", str(folder), *arguments]
    environment = {**os.environ, "PYTHONPATH": str(HERE)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        sys.exit(done.stdout + done.stderr)
    return done.stdout


def native(text: str, seconds: float) -> float:
    """Steps a second of native MuJoCo, stepped in batches."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    steps = round(seconds / model.opt.timestep)
    best = 0.0
    for _ in range(3):
        fresh = mujoco.MjData(model)
        mujoco.mj_copyData(fresh, model, data)
        began = time.perf_counter()
        mujoco.mj_step(model, fresh, nstep=steps)
        best = max(best, steps / (time.perf_counter() - began))
    return best


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Serve a folder on this machine."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: Any) -> None:
            pass

    handler = functools.partial(Quiet, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()


IN_WORKER = """async ([config, steps]) => {
  const base = new URL(config, document.baseURI)
  const lab = await (await fetch(base)).json()
  const at = (name) => new URL(lab[name], base).href
  const worker = new Worker(at('worker'), { type: 'module' })
  const hear = (receive) => worker.addEventListener('message', receive)
  const wait = (type) => new Promise((done, fail) => hear(({ data }) => {
    if (data.type === type) done(data)
    if (data.type === 'error') fail(new Error(data.message))
  }))
  const send = (message) => worker.postMessage({ ...message, lab: lab.id })
  const ready = wait('ready')
  send({ type: 'load', config: lab, module: at('module'), mjb: at('mjb'), wasm: at('wasm') })
  const { scene } = await ready
  send({ type: 'visible', on: true })
  const until = (time) => new Promise((done) => hear(({ data }) => {
    if (data.type !== 'frame') return
    send({ type: 'frame', buffer: null })
    if (data.time >= time - scene.timestep / 2) done()
  }))
  const pass = async (from, n) => {
    const reached = until((from + n) * scene.timestep)
    const began = performance.now()
    send({ type: 'step', n })
    await reached
    return n / (performance.now() - began) * 1000
  }
  await pass(0, steps)
  const speed = await pass(steps, steps)
  worker.terminate()
  return speed
}"""

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


def in_browser(url: str, steps: int) -> tuple[dict[str, float], list[str]]:
    """Speeds of the worker by model, and lines about the pages."""
    from playwright.sync_api import sync_playwright

    speeds: dict[str, float] = {}
    lines: list[str] = []
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=flags)
        for i, name in enumerate(MODELS, 1):
            page = browser.new_page()
            page.goto(f"{url}/lessons/1.{i}-{name.replace('_', '-')}.html")
            config = page.get_attribute(".lab", "data-config")
            speeds[name] = page.evaluate(IN_WORKER, [config, steps])
            page.close()
        for name, address in (("without a lab", "1.0-plain"), ("with a lab", "1.1-tumbling-box")):
            lines.append(page_cost(browser, f"{url}/lessons/{address}.html", name))
        browser.close()
    return speeds, lines


def page_cost(browser: Any, url: str, name: str) -> str:
    """What a page costs, and how its lab runs."""
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
    page.evaluate(WATCH)
    clock = "document.querySelector('.lab-time').textContent"
    started = page.evaluate(
        f"""async () => {{
          const first = {clock}; const began = performance.now()
          document.querySelector('.lab-play').click()
          while ({clock} === first) await new Promise(requestAnimationFrame)
          return performance.now() - began
        }}"""
    )
    session = context.new_cdp_session(page)
    session.send("Performance.enable")

    def busy() -> tuple[float, float]:
        found = {m["name"]: m["value"] for m in session.send("Performance.getMetrics")["metrics"]}
        return found["TaskDuration"], found["Timestamp"]

    task, stamp = busy()
    page.evaluate("() => { window.frames_.length = 0; window.long_.length = 0 }")
    page.wait_for_timeout(5000)
    frames = page.evaluate("window.frames_")
    long = page.evaluate("window.long_")
    task_end, stamp_end = busy()
    context.close()
    median = statistics.median(frames)
    slow = sorted(frames)[int(0.99 * len(frames))]
    return (
        f"  page {name}: {before}; {after}\n"
        f"    Play to first moving frame {started:.0f} ms (warm cache); frame median"
        f" {median:.1f} ms, 99th percentile {slow:.1f} ms; {len(long)} tasks over 50 ms in 5 s;"
        f" page thread busy {100 * (task_end - task) / (stamp_end - stamp):.0f} %"
    )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated, for each speed")
    seconds = parser.parse_args().seconds
    cores = len(os.sched_getaffinity(0))
    print(f"{platform.platform()}, {cores} cores; Python {platform.python_version()}", end="")
    print("".join(f", {name} {version(name)}" for name in ("mujoco", "mini-racer", "playwright")))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        make_course(folder, seconds)
        report = json.loads(run(folder, "check", "--quiet", "--format", "json"))
        headless = {lab["title"]: lab["steps_per_second"] for lab in report["labs"]}
        run(folder, "build", "--quiet")
        with served(folder / "public") as url:
            speeds, lines = in_browser(url, round(seconds / 0.002))
        print("\nsteps a second            native     V8 headless      browser worker")
        for name, text in MODELS.items():
            own = native(text, seconds)
            v8, worker = headless[name], speeds[name]
            print(
                f"  {name:<18} {own:12,.0f}  {v8:12,.0f} (x {v8 / own:.2f})"
                f"  {worker:12,.0f} (x {worker / own:.2f}, {worker / v8:.2f} of headless)"
            )
        print("\npages")
        print("\n".join(lines))


if __name__ == "__main__":
    main()
