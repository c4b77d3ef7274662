"""A course with a model, and a fake bench that gives prepared outcomes instead of measuring."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from coursebuild.core.engine.store import Store
from coursebuild.core.model.measurements import ScenarioReport, SceneReport
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.features.bench.commands.measurement import CannotMeasureError
from coursebuild.features.bench.commands.measuring import CompiledScene
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scenes import CourseScene
from support.bench_reports import swing

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


class Fake:
    """A bench that returns the outcomes it was given, and records its calls."""

    def __init__(self, *outcomes: ScenarioReport | Diagnostic | BaseException) -> None:
        self.outcomes = list(outcomes) or [swing()]
        self.calls: list[tuple[str, int, bool, bool]] = []

    def compile_scene(self, root: Path, scene: CourseScene, *, quick: bool) -> CompiledScene:
        assert root.is_absolute()
        scenes: Any = tuple(self.outcomes)
        return CompiledScene(scene, None, scenes)

    def add_card(self, root: Path, scene: CourseScene, report: SceneReport) -> SceneReport:
        """Add nothing: the card of a model has tests of its own."""
        return report

    def run_scenario(
        self,
        compiled_scene: CompiledScene,
        number: int,
        *,
        quick: bool,
        timed: bool,
        tell: Callable[[str], None],
    ) -> ScenarioReport:
        tell("swing: Euler")
        self.calls.append((compiled_scene.scene.name, number, quick, timed))
        outcome = self.outcomes[number]
        if isinstance(outcome, Diagnostic):
            raise CannotMeasureError(outcome)
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome


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
