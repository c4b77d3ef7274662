"""Labs: steps a second natively, headless and in the browser; what a page with a lab costs.

Run: python benchmarks/labs.py [--rounds N] [--only speed|pages] [--robots ZIP …]

1. A course with one lab for each of five models is built in a scratch folder; what its trials say
   of their speed, with all that is compiled on the way, is in `coursebuild check`.
2. Steps a second, for each model in rounds: native MuJoCo, V8 in the build, the worker of a page in
   headless Chromium asked for the steps at once, and the same worker playing as fast as it can.
   Each makes the same steps from the same start, once untimed to be warm, and the four take turns
   in an order that moves on: what else the machine does, meets all of them. Medians are printed, of
   the speeds and of the ratios within a round.
3. A page without and with a lab: requests and bytes as sent, time from Play to the first moving
   frame on a warm cache, also of a worker without a tape, frame times, long tasks, and how busy the
   page's thread is while it runs.
4. With `--robots`, that alone, for zips of models with their meshes, opened in the editor of a lab.

All but native MuJoCo also do what a lab does besides stepping: look for divergence after each step,
and bring the derived quantities of each eighth step up to date for a plot.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from playwright.sync_api import sync_playwright  # noqa: E402

from benchmarks.measure.lab_pages import page_cost, robot_cost, tape_cost  # noqa: E402
from coursebuild.core.run import gate  # noqa: E402
from support.chromium import Browsers  # noqa: E402
from support.static_host import Host  # noqa: E402

PENDULUM = """<mujoco><option timestep="0.002" integrator="RK4"/><worldbody>
<body pos="0 0 1"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
<body pos="0 0 -.5"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
</body></body></worldbody>
<keyframe><key qpos="2 0.5"/></keyframe></mujoco>"""


def address(i: int, name: str) -> str:
    """The name of a lesson's files."""
    return f"1.{i}-{name.replace('_', '-')}"


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
    "tumbling_box": (ROOT / "models" / "tumbling_box.xml").read_text(encoding="utf-8"),
    "double_pendulum": PENDULUM,
    "chain": chain(10),
    "six_boxes": boxes(6),
    "twenty_boxes": boxes(20),
}
STEPS = {
    "tumbling_box": 40_000,
    "double_pendulum": 40_000,
    "chain": 20_000,
    "six_boxes": 10_000,
    "twenty_boxes": 3_000,
}
"""Steps in a turn: at least a third of a second."""
LESSON = """## {model}

```lab simlab
{{"title": "{model}", "model": "{model}", "verify": {{"seconds": 0.1}},
  "readouts": [{{"label": "time", "expr": "data.time", "digits": 2}}],
  "plots": [{{"ylabel": "height (m)", "xlabel": "time (s)", "window": 10,
             "traces": [{{"label": "z", "expr": "lib.bodyPos(1)[2]"}}]}}]}}
```
"""
PAGES = {"without a lab": "1.0-plain", "with a lab": "1.1-tumbling-box"}
SCRIPT = "## None\n\n```python file=examples/one.py\nprint(1)\n```\n\nOutput:\n\n```text\n1\n```\n"


def make_course(folder: Path) -> None:
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
        path = folder / "content" / "lessons" / f"{address(i, name)}.md"
        path.write_text(SCRIPT if i == 0 else LESSON.format(model=name))
    for name, text in MODELS.items():
        (folder / "models" / f"{name}.xml").write_text(text)


def run(folder: Path, *arguments: str) -> str:
    """Run coursebuild in the scratch course."""
    command = gate.module_command("coursebuild", "-C", str(folder), *arguments)
    done = gate.finish(command, gate.environment(*gate.TOOL))
    if done.status != 0:
        sys.exit((done.output + done.errors).decode())
    return done.output.decode()


@dataclass
class Runner:
    """Something that steps a model, and the speeds it has shown."""

    name: str
    run: Callable[[], float]
    """Make the steps from the start; gives steps a second."""
    speeds: list[float] = field(default_factory=list)


def run_in_turns(runners: list[Runner], rounds: int) -> None:
    """Run all, in rounds, each round beginning with another one."""
    for runner in runners:
        runner.run()
    for i in range(rounds):
        first = i % len(runners)
        for runner in runners[first:] + runners[:first]:
            runner.speeds.append(runner.run())


def run_native(text: str, steps: int) -> Callable[[], float]:
    """Native MuJoCo, which makes the steps in one call."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)

    def run() -> float:
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        else:
            mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        start = time.perf_counter()
        mujoco.mj_step(model, data, nstep=steps)
        return steps / (time.perf_counter() - start)

    return run


def run_headless(engine: Any, lab: Any, mjb: bytes, steps: int) -> Callable[[], float]:
    """The main run of a trial, in the V8 of this process, without recording for parity."""
    from coursebuild.features.lab.compile import compile_lab

    module = compile_lab(lab, "lab")
    request = {"config": module.config, "code": module.literal, "parity": False}

    def run() -> float:
        reply = engine.trial({**request, "seconds": 0.002 * steps}, mjb, 60.0)
        if reply["failures"]:
            sys.exit(str(reply["failures"]))
        if reply["main"]["steps"] != steps:
            sys.exit(f"{reply['main']['steps']} steps were made, not {steps}")
        return float(reply["stepsPerSecond"])

    return run


def run_in_worker(page: Any, mode: str, steps: int) -> Callable[[], float]:
    """The worker of a page that `WORKER` has prepared."""
    return lambda: float(page.evaluate("([mode, n]) => window.pass(mode, n)", [mode, steps]))


WORKER = """async (config) => {
  const base = new URL(config, document.baseURI)
  const lab = await (await fetch(base)).json()
  const at = (name) => new URL(lab[name], base).href
  const worker = new Worker(at('worker'), { type: 'module' })
  const send = (message) => worker.postMessage({ ...message, lab: lab.id })
  let hear = () => {}
  const next = (test) => new Promise((done, fail) => (hear = (data) => {
    if (data.type === 'error') fail(new Error(data.message))
    if (test(data)) done(data)
  }))
  worker.onmessage = ({ data }) => {
    hear(data)
    // As a page does: the buffer goes back when the frame has been drawn.
    const back = () => send({ type: 'frame', buffer: data.buffer })
    if (data.type === 'frame') requestAnimationFrame(back)
  }
  const ready = next(({ type }) => type === 'ready')
  send({ type: 'load', config: lab, module: at('module'), mjb: at('mjb'), wasm: at('wasm') })
  const { scene: { timestep } } = await ready
  send({ type: 'visible', on: true })
  send({ type: 'speed', factor: 1e6 })
  const steps = ({ time }) => Math.round(time / timestep)
  const frame = (test) => next((data) => data.type === 'frame' && test(steps(data)))
  window.pass = async (mode, n) => {
    const back = frame((made) => made === 0)
    send({ type: 'reset' })
    await back
    const there = frame((made) => made >= n)
    const began = performance.now()
    send({ type: mode, n })
    const made = steps(await there)
    const speed = made / (performance.now() - began) * 1000
    if (mode === 'play') {
      const still = next(({ type }) => type === 'paused') // the others' turn
      send({ type: 'pause' })
      await still
    }
    return speed
  }
}"""


def run_race(folder: Path, browser: Any, url: str, rounds: int) -> Iterator[str]:
    """A line for each model."""
    from coursebuild.core.syntax.document import parse_document
    from coursebuild.core.text.source import Source
    from coursebuild.features.lab.engines.browser import LabEngine
    from coursebuild.features.lab.engines.native import NativeEngine
    from coursebuild.features.lab.model import Lab

    with LabEngine() as engine, NativeEngine(folder) as saver:
        for i, (name, text) in enumerate(MODELS.items(), 1):
            steps = STEPS[name]
            source = Source(f"content/lessons/1.{i}-x.md", LESSON.format(model=name))
            document = parse_document(source, frozenset({name}), lesson=True).value
            (lab,) = (block for block in document.blocks if isinstance(block, Lab))
            mjb = saver.save(f"models/{name}.xml", text)
            page = browser.new_page()
            page.goto(f"{url}lessons/1.0-plain.html")  # where nothing runs besides
            html = (folder / "public" / "lessons" / f"{address(i, name)}.html").read_text()
            page.evaluate(WORKER, re.findall('data-config="([^"]+)"', html)[0])
            runners = [
                Runner("native", run_native(text, steps)),
                Runner("headless", run_headless(engine, lab, mjb, steps)),
                Runner("worker", run_in_worker(page, "step", steps)),
                Runner("playing", run_in_worker(page, "play", steps)),
            ]
            run_in_turns(runners, rounds)
            page.close()
            yield row(name, *(runner.speeds for runner in runners))


def row(name: str, native: list[float], v8: list[float], *workers: list[float]) -> str:
    """A line of speeds, with their ratios to others in the same round."""

    def ratio(speeds: list[float], base: list[float]) -> float:
        return statistics.median(a / b for a, b in zip(speeds, base, strict=True))

    line = f"  {name:<16}{statistics.median(native):10,.0f}"
    line += f"{statistics.median(v8):11,.0f} (x {ratio(v8, native):.2f})"
    for worker in workers:
        line += f"{statistics.median(worker):11,.0f}"
        line += f" (x {ratio(worker, native):.2f}, {ratio(worker, v8):.2f})"
    return line


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9, help="of each model")
    parser.add_argument("--only", choices=("speed", "pages"))
    parser.add_argument("--robots", type=Path, nargs="+", metavar="ZIP", help="nothing but these")
    arguments = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    print(f"{platform.platform()}, {cores} cores; Python {platform.python_version()}", end="")
    print("".join(f", {name} {version(name)}" for name in ("mujoco", "mini-racer", "playwright")))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        make_course(folder)
        report = json.loads(run(folder, "check", "--quiet", "--format", "json"))
        run(folder, "build", "--quiet")
        with sync_playwright() as playwright, Host(folder / "public") as host:
            browser, url = Browsers(playwright)["webgl"], host.url
            print(f"Chromium {browser.version}")
            for path in arguments.robots or ():
                lab_page = f"{url}lessons/{PAGES['with a lab']}.html"
                print(robot_cost(browser, lab_page, path), flush=True)
            if arguments.robots:
                return
            if arguments.only != "pages":
                print("\nsteps a second, as `coursebuild check` tells them")
                for lab in report["labs"]:
                    print(f"  {lab['title']:<16}{lab['steps_per_second']:10,}")
                print("\nsteps a second      native      V8 headless", end="")
                print("        worker, in one go         worker, playing")
                print(f"{'':<31}(x: of native)       (x: of native, of headless)")
                for line in run_race(folder, browser, url, arguments.rounds):
                    print(line, flush=True)
            if arguments.only != "speed":
                print("\npages")
                for name, page in PAGES.items():
                    print(page_cost(browser, f"{url}lessons/{page}.html", name))
                lab_page = f"{url}lessons/{PAGES['with a lab']}.html"
                print(tape_cost(browser, lab_page, arguments.rounds))


if __name__ == "__main__":
    main()
