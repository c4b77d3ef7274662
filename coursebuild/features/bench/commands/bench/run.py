"""`coursebuild bench`: speed against error of the course's models.

Entry points: `bench(options, names, …)`, `check(…)`.

1. Names mean models. One that does not compile is told, and the others are measured.
2. What was measured is kept under all that it depends on, a scenario at a time: a run that was
   stopped goes on where it was. Times say something of this machine only, so they are not shared.
3. Recording writes what was measured into `content/reports/`; checking measures again, whatever is
   kept, and holds figures of accuracy against what is recorded there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

from msgspec.structs import replace

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.run.machine import machine
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.features.bench.commands.bench import measuring
from coursebuild.features.bench.commands.measurement import Measurement
from coursebuild.features.bench.commands.runs import MeasuringRun, forbid_quick, with_records
from coursebuild.numerics.reports.bench import ScenarioReport, SceneReport
from coursebuild.numerics.reports.departures import RecordCheck, scene_departures
from coursebuild.numerics.reports.records import BENCH, ReportFailure
from coursebuild.numerics.reports.sweep import SweepReport
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scenes import CourseScene, find_scenes
from coursebuild.pipeline.shown_reports import read_record

_T = TypeVar("_T")
_CODE = (
    "coursebuild/numerics",
    "coursebuild/features/bench/commands/bench/measuring.py",
    "mjcourse/spatial",
)
"""What measures and says what was measured."""


def bench(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    record: bool = False,
    measuring: Any = measuring,
) -> Measurement[SceneReport]:
    """Measure the models that the names mean; all where there are none.

    `record`: each model's report is also written into the course. `measuring`: what measures.

    Raises:
        UsageError: no model is called so, or only a part is to be recorded.
    """
    if record:
        forbid_quick("--record", quick=quick)
    scenes = find_scenes(options.root, names)
    run = SceneRun(options, scenes.diagnostics, measuring, quick=quick, cards=record)
    found = run.each(scenes.value, run.measure)
    if not record:
        return found
    records = ((BENCH.path(one.model), BENCH.encode(one)) for one in found.reports)
    return with_records(options.root, found, records)


def check(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    measuring: Any = measuring,
) -> Measurement[SceneReport]:
    """Measure again, and hold it against what is recorded.

    A model without a recorded report, or with one that cannot be read, is not measured.

    Raises:
        UsageError: no model is called so, or only a part is to be measured.
    """
    forbid_quick("--check", quick=quick)
    scenes = find_scenes(options.root, names)
    run = SceneRun(options, scenes.diagnostics, measuring, again=True)
    recorded: dict[str, SceneReport] = {}
    for scene in scenes.value:
        report = read_record(options.root, BENCH, scene.name)
        if isinstance(report, ReportFailure):
            run.failures.append(report)
        else:
            recorded[scene.name] = report
    known = {scene.name: scene for scene in scenes.value if scene.name in recorded}
    found = run.each(tuple(known.values()), run.measure)
    checked = [_checked(recorded[one.model], one, known[one.model]) for one in found.reports]
    return replace(found, checked=tuple(checked))


def _checked(recorded: SceneReport, measured: SceneReport, scene: CourseScene) -> RecordCheck:
    remarks = []
    if recorded.digest != measured.digest:
        remarks.append("the model or its scenarios have changed since it was recorded")
    old, new = recorded.machine, measured.machine
    for what, before, now in (
        ("MuJoCo ", old.engine, new.engine),
        ("NumPy ", old.numpy, new.numpy),
        ("Python ", old.python, new.python),
        ("", old.system, new.system),
    ):
        if before != now:
            remarks.append(f"recorded with {what}{before}, measured with {now}")
    departures = scene_departures(recorded, measured, scene.declared.bench)
    return RecordCheck(measured.model, BENCH.path(measured.model), departures, tuple(remarks))


class SceneRun(MeasuringRun):
    """Measures scenes one after the other."""

    def __init__(
        self,
        options: Options,
        diagnostics: Sequence[Diagnostic],
        measuring: Any,
        *,
        quick: bool = False,
        again: bool = False,
        cards: bool = False,
    ) -> None:
        super().__init__(options, diagnostics, again=again)  # again, times do not matter
        self.quick = quick
        self.cards = cards
        """Whether it is also told what the models are made of."""
        self.measuring = measuring
        self.here = machine(pinned=True)
        self.code = code_digest(*_CODE)

    def measure(self, scene: CourseScene) -> SceneReport | None:
        """What was measured on a scene; `None` where it cannot be."""
        parts = (scene.name, scene.digest, self.quick, self.code, self.here)
        whole = (*parts, self.cards)
        return self.once(
            scene.name, "bench", whole, SceneReport, lambda: self._report(scene, parts)
        )

    def _report(self, scene: CourseScene, parts: tuple[object, ...]) -> SceneReport:
        root, timed, name = self.options.root, not self.again, scene.name
        loaded = self.measuring.scenarios_of(root, scene, quick=self.quick)

        def tell(text: str) -> None:
            self.progress.doing(name, text)

        how = {"quick": self.quick, "timed": timed, "tell": tell}
        report = SceneReport(
            model=name,
            digest=scene.digest,
            quick=self.quick,
            machine=self.here,
            scenarios=tuple(
                self._part(
                    "bench-scenarios",
                    (*parts, n),
                    ScenarioReport,
                    partial(self.measuring.measured, loaded, n, **how),
                )
                for n in range(len(loaded.scenarios))
            ),
            sweeps=tuple(
                self._part(
                    "bench-sweeps",
                    (*parts, one.name),
                    SweepReport,
                    partial(self.measuring.swept, loaded, one, **how),
                )
                for one in scene.declared.sweeps
            ),
        )
        if self.cards and report.scenarios:
            tell("what it is made of")
            report = self.measuring.with_card(root, scene, report)
        return report

    def _part(
        self, kind: str, parts: tuple[object, ...], what: type[_T], measure: Callable[[], _T]
    ) -> _T:
        """A scenario or a sweep, from what is kept or measured now."""
        found = self.kept(kind, parts, what)
        if found is None:
            found = measure()
            self.keep(kind, parts, found)
        return found
