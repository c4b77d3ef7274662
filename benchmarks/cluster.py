"""Compare `--cluster` with one machine: the same results, and how long they take.

Run: python benchmarks/cluster.py [--scripts N] [--settings N] [--rounds N]

It needs `plugins/cluster`. A course of its own has many scripts and sweeps of a model. First their
results are found here and by four local workers, of which one is killed midway: they must be equal.
Then they are found by turns with the tool's own two processes and with two workers; printed are the
times of each round, and the ratios. The machine may do other work: only the ratios within a round
count.
"""

from __future__ import annotations

import argparse
import logging
import os
import shutil
import signal
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from distributed import LocalCluster
from msgspec import Raw

from coursebuild.core.engine.store import Store
from coursebuild.core.model.report_files import BENCH
from coursebuild.core.run import gate
from coursebuild.features.bench.commands import bench
from coursebuild.features.bench.commands.measurement import file_of
from coursebuild.features.bench.commands.measuring import Mjbench
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scenes import find_scenes

MODEL = """\
<mujoco>
  <worldbody>
    <body>
      <joint name="hinge" axis="0 1 0" damping="0.01"/>
      <geom name="arm" type="capsule" fromto="0 0 0 0.3 0 0" size="0.02"/>
    </body>
  </worldbody>
</mujoco>
"""
SCRIPT = """\
import mujoco

model = mujoco.MjModel.from_xml_path("models/arm.xml")
data = mujoco.MjData(model)
data.qpos[0] = {number} / 1000
mujoco.mj_step(model, data, {steps})
print(repr(float(data.qpos[0])))
"""
MAP = """\
[course]
title = "Many"

[[level]]
id = "1"
title = "Level"

[[level.lesson]]
id = "1.1"
slug = "one"
title = "One"
status = "complete"
"""
LESSON = "content/lessons/1.1-one.md"
MOST_VALUES = 100
"""Of a sweep."""


def write_course(root: Path, scripts: int, settings: int, steps: int) -> None:
    """Write a course whose scripts have an output that is not recorded yet."""
    blocks = [
        f"```python file=examples/s{number}.py\n{SCRIPT.format(number=number, steps=steps)}```\n\n"
        "Output:\n\n```text\n0.5\n```\n"
        for number in range(scripts)
    ]
    sweeps = []
    for first in range(0, settings, MOST_VALUES):
        numbers = range(first, min(first + MOST_VALUES, settings))
        values = ", ".join(f"{0.001 * (number + 1):.3f}" for number in numbers)
        vary = f'{{ "joint:hinge.damping" = [{values}] }}'
        sweeps.append(f'[[sweep]]\nname = "from-{first}"\nvary = {vary}\n')
    scenario = '[[scenario]]\nname = "swings"\nduration = 0.1\ntimesteps = [0.002]\n\n'
    files = {
        "content/course.toml": MAP,
        LESSON: "## One\n\n" + "\n".join(blocks),
        "models/arm.xml": MODEL,
        "models/arm.toml": scenario + "\n".join(sweeps),
    }
    for path, text in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text)


def record(root: Path) -> None:
    """Record a report without times, which `bench --check` compares with and prints."""
    (scene,) = find_scenes(root).value
    options = Options(root, 1, Store(root))
    with Mjbench(root, "this benchmark") as mjbench:
        report = bench.SceneRun(options, mjbench, (), use_store=False).measure(scene)
        assert report is not None
        data = file_of(mjbench, bench=Raw(report))
    (root / BENCH.path("arm")).parent.mkdir(parents=True)
    (root / BENCH.path("arm")).write_bytes(data)


def run(root: Path, *arguments: str) -> tuple[str, float]:
    """What a command prints, and the seconds that it takes."""
    began = time.monotonic()
    return finish(begin(root, *arguments)), time.monotonic() - began


def finish(process: gate.Process) -> str:
    """What a command prints; the comparison ends here where it could not do its work."""
    out, errors = (text.decode() for text in process.communicate())
    if process.returncode not in (0, 1):  # 1: an output or a figure differs from what is recorded
        sys.exit(errors.strip() or f"a command ended with status {process.returncode}")
    return out


def begin(root: Path, *arguments: str) -> gate.Process:
    """Begin a command."""
    command = gate.module_command("coursebuild", "-C", str(root), *arguments)
    environment, pipe = {**os.environ, "PYTHONSAFEPATH": "1"}, gate.PIPE
    return gate.start(command, environment, stdout=pipe, stderr=pipe, bound=False)


def run_and_kill(cluster: LocalCluster, root: Path, *arguments: str, events: int) -> str:
    """What a command prints while a worker is killed once the scheduler has seen some events."""
    scheduler = cluster.scheduler
    before = scheduler.transition_counter
    process = begin(root, *arguments, "--cluster", cluster.scheduler_address)
    while process.poll() is None and scheduler.transition_counter < before + events:
        time.sleep(0.01)
    victim = next(iter(cluster.workers.values())).pid
    if process.poll() is None:
        os.kill(victim, signal.SIGKILL)
        print(f"  worker {victim} was killed midway")
    return finish(process)


def start(count: int) -> LocalCluster:
    """A scheduler with some workers."""
    return LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        memory_limit=0,
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
    )


def compare(name: str, first: str, second: str) -> None:
    """Say whether two reports are the same."""
    verdict = "equal, byte for byte" if first == second and first else "NOT EQUAL"
    print(f"  {name}: {verdict} ({len(first)} characters)")


def print_ratios(
    name: str, rounds: int, time_here: Callable[[], float], time_there: Callable[[], float]
) -> None:
    """Time two ways by turns."""
    ratios = []
    for turn in range(rounds):
        if turn % 2:
            seconds_there, seconds = time_there(), time_here()
        else:
            seconds, seconds_there = time_here(), time_there()
        ratios.append(seconds_there / seconds)
        print(
            f"  {name}: here {seconds:.1f} s, two workers {seconds_there:.1f} s, ×{ratios[-1]:.2f}"
        )
    print(f"  {name}: median ratio {statistics.median(ratios):.2f}")


def main() -> None:
    """Compare results, then times."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scripts", type=int, default=200, help="(default: %(default)s)")
    parser.add_argument("--settings", type=int, default=400, help="(default: %(default)s)")
    parser.add_argument("--steps", type=int, default=20_000, help="of each script")
    parser.add_argument("--rounds", type=int, default=3, help="(default: %(default)s)")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root, copy = Path(folder) / "course", Path(folder) / "copy"
        write_course(root, arguments.scripts, arguments.settings, arguments.steps)
        record(root)
        shutil.copytree(root, copy)
        sweep = ("bench", "arm", "--check", "--format", "json")
        with start(4) as cluster:
            print(f"{arguments.scripts} scripts and {arguments.settings} settings, four workers:")
            run(root, "update")
            run_and_kill(cluster, copy, "update", events=3 * arguments.scripts)
            compare("scripts", (root / LESSON).read_text(), (copy / LESSON).read_text())
            reports = run(root, *sweep)[0], run_and_kill(cluster, root, *sweep, events=60)
            compare("sweeps", *reports)
        with start(2) as cluster:
            print("times, two workers and the tool's own processes:")
            at = ("--cluster", cluster.scheduler_address)
            check = ("check", "--no-cache", "--jobs", "2")
            run(root, *check, *at)
            for name, words in (("scripts", check), ("sweeps", sweep)):
                print_ratios(
                    name,
                    arguments.rounds,
                    lambda words=words: run(root, *words)[1],
                    lambda words=words: run(root, *words, *at)[1],
                )


if __name__ == "__main__":
    main()
