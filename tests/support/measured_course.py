"""A course with a model, and a fake bench that gives prepared outcomes instead of measuring."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from coursebuild.core.engine.store import Store
from coursebuild.features.bench.commands.measuring import Facts, FailedJobError, Failure, Mjbench
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scenes import CourseScene
from mjbench import jobs
from mjbench.host import LocalHost
from mjbench.reports.scene_report import ScenarioReport
from samples.reports import swing
from support.bench_reports import derived

BOX = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body>
      <joint axis="0 1 0"/>
      <geom size="0.1" pos="0 0 -1"/>
    </body>
  </worldbody>
</mujoco>
"""
PATH = "content/reports/box.bench.json"
TOML = '[[scenario]]\nname = "swing"\nduration = 0.2\nsample = 0.02\nqvel = [1.0]\n'


class Fake(Mjbench):
    """A bench that returns the outcomes it was given, and records what it is asked to measure.

    What measures nothing is done as ever.
    """

    def __init__(self, *outcomes: ScenarioReport | Failure | BaseException) -> None:
        super().__init__(Path("/"), "a test")
        self.outcomes = list(outcomes) or [derived(swing())]
        self.calls: list[tuple[str, int, bool, bool]] = []

    def facts(self) -> Facts:
        """Say what is here."""
        return msgspec.json.decode(self.do("about"), type=Facts)

    def do(self, job: str, scene: CourseScene | None = None, **values: Any) -> bytes:
        if scene is None:
            request = msgspec.json.encode({"job": job, **values})
            return msgspec.json.encode(jobs.answer(request, LocalHost(Path("/"), print)))
        if job == "join":
            parts = {"model": scene.name, "digest": scene.digest, "machine": self.facts().pinned}
            values.pop("card")
            return msgspec.json.encode({**parts, **values})
        assert job == "scenario"
        self.tell("swing: Euler")
        return self.measure(scene, **values)

    def measure(self, scene: CourseScene, *, number: int, quick: bool, timed: bool) -> bytes:
        """The prepared outcome."""
        self.calls.append((scene.name, number, quick, timed))
        outcome = self.outcomes[number]
        if isinstance(outcome, Failure):
            raise FailedJobError(outcome)
        if isinstance(outcome, BaseException):
            raise outcome
        return msgspec.json.encode(outcome)


def bench_course(tmp_path: Path) -> Path:
    root = tmp_path / "a cöurse"
    write(root / "content" / "course.toml", "")
    write(root / "models" / "box.xml", BOX)
    return root


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def options(root: Path, **fields: Any) -> Options:
    return Options(root, 1, Store(root, **fields))


def take_calls(fake: Fake) -> list[str]:
    names = [name for name, *_ in fake.calls]
    fake.calls.clear()
    return names
