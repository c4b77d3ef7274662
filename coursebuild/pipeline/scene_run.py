"""Measuring scenes one after the other, from what is kept where that is there.

Entry point: `SceneRun(options, …).all(scenes)`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.run.machine import machine
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.numerics.reports.bench import Machine, ScenarioReport, SceneReport
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reports import MeasuringRun, digest_of, machine_parts
from coursebuild.pipeline.scenes import CourseScene

if TYPE_CHECKING:
    from coursebuild.pipeline.measuring import CompiledScene

_SCENE, _SCENARIO = "bench", "bench-scenarios"
"""Kinds of what is kept."""
_T = TypeVar("_T")
_CODE = ("coursebuild/numerics", "coursebuild/pipeline/measuring.py", "mjcourse/spatial")
"""What measures and says what was measured."""


class Measuring(Protocol):
    """What measures: `pipeline.measuring`."""

    def scenarios_of(
        self, root: Path, scene: CourseScene, *, quick: bool
    ) -> CompiledScene | Diagnostic:
        """The scenarios of a scene, ready to run, or why they cannot be."""

    def measured(
        self,
        loaded: CompiledScene,
        number: int,
        *,
        quick: bool,
        timed: bool,
        tell: Callable[[str], None],
    ) -> ScenarioReport | Diagnostic:
        """What was measured in one of them, or why nothing can be."""


class SceneRun(MeasuringRun):
    """Measures scenes one after the other."""

    def __init__(
        self,
        options: Options,
        measuring: Measuring | None,
        *,
        quick: bool,
        again: bool = False,
        cards: bool = False,
    ) -> None:
        super().__init__(options)
        self.quick = quick
        self.again = again
        """Whether nothing is taken from what is kept, and times do not matter."""
        self.cards = cards
        """Whether it is also told what the models are made of."""
        self._measuring = measuring

    def all(self, scenes: Sequence[CourseScene]) -> tuple[SceneReport, ...]:
        """Every scene that can be measured."""
        here, code = machine(), code_digest(*_CODE)
        return self.each("measuring", scenes, lambda scene: self._one(scene, here, code))

    def _one(self, scene: CourseScene, here: Machine, code: str) -> SceneReport | None:
        parts = (scene.name, scene.digest, f"{self.quick}", code, *machine_parts(here))

        def kept() -> SceneReport | None:
            found = self._kept(_SCENE, parts, SceneReport)
            whole = found and (found.card or not self.cards or not found.scenarios)
            return found if whole else None

        return self.one(scene.name, kept, lambda: self._report(scene, here, parts))

    def _report(
        self, scene: CourseScene, here: Machine, parts: tuple[str, ...]
    ) -> SceneReport | None:
        report = self._kept(_SCENE, parts, SceneReport)
        if report is None:
            found = self._scenarios(scene, parts)
            if found is None:
                return None
            report = SceneReport(scene.name, scene.digest, self.quick, here, found)
            self._keep(_SCENE, parts, report)
        if self.cards and report.card is None and report.scenarios:
            from coursebuild.pipeline.measuring import with_card

            self.progress.doing(scene.name, "what it is made of")
            report = with_card(self.options.root, scene, report)
            self._keep(_SCENE, parts, report)
        return report

    def _scenarios(
        self, scene: CourseScene, parts: tuple[str, ...]
    ) -> tuple[ScenarioReport, ...] | None:
        """Each scenario, from what is kept or measured now; nothing where one cannot be."""
        loaded = self.measuring.scenarios_of(self.options.root, scene, quick=self.quick)
        if isinstance(loaded, Diagnostic):
            self.diagnostics.append(loaded)
            return None
        reports = []
        for number in range(len(loaded.scenarios)):
            own = (*parts, f"{number}")
            report = self._kept(_SCENARIO, own, ScenarioReport)
            if report is None:
                found = self.measuring.measured(
                    loaded,
                    number,
                    quick=self.quick,
                    timed=not self.again,
                    tell=lambda text: self.progress.doing(scene.name, text),
                )
                if isinstance(found, Diagnostic):
                    self.diagnostics.append(found)
                    return None
                report = found
                self._keep(_SCENARIO, own, report)
            reports.append(report)
        return tuple(reports)

    @property
    def measuring(self) -> Measuring:
        """What measures, which is heavy."""
        if self._measuring is None:
            from coursebuild.pipeline import measuring

            self._measuring = measuring
        return self._measuring

    # --- what is kept

    def _kept(self, kind: str, parts: tuple[str, ...], what: type[_T]) -> _T | None:
        return None if self.again else self.options.store.get_value(kind, digest_of(parts), what)

    def _keep(self, kind: str, parts: tuple[str, ...], value: object) -> None:
        if not self.again:
            self.options.store.put_value(kind, digest_of(parts), value, local=True)
