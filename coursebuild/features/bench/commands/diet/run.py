"""`coursebuild diet`: what models of the course hold that their scenarios do not need.

Entry point: `diet(options, names, …)`.

1. Names mean models. One that does not compile is reported, and the others are looked at.
2. A part that code of the course may notice is not proved superfluous, and a part without which
   scripts or labs have another output is no finding. A part that is to stay stands in
   `models/NAME.toml` with its reason.
3. Reports are stored by all that they depend on, as those of `bench`.
4. `fix` takes out what is proved, again and again, as what only a removed part needed may go as
   well. A file that was edited meanwhile is left as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_course
from coursebuild.core.run.machine import machine
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.features.bench.commands.diet.model import DietModel
from coursebuild.features.bench.commands.diet.readers import Reruns
from coursebuild.features.bench.commands.measurement import Measurement
from coursebuild.features.bench.commands.runs import MeasuringRun, forbid_quick, write_records
from coursebuild.numerics.engine import silent
from coursebuild.numerics.pruning.survey import Survey
from coursebuild.numerics.reports.diet_report import DietReport
from coursebuild.numerics.reports.records import DIET, ReportFailure
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scenes import CourseScene, find_scenes

_T = TypeVar("_T")
_CODE = (
    "coursebuild/numerics",
    "coursebuild/features/bench/commands/diet/model.py",
    "coursebuild/features/bench/commands/diet/readers.py",
    "mjcourse/spatial",
)


def diet(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    fix: bool = False,
    record: bool = False,
) -> Measurement[DietReport]:
    """Look at the models that the names mean; without names, at all.

    `fix`: what is proved is taken out, and the reports are about the rest. `record`: each report
    is also written into the course.

    Raises:
        UsageError: no model is called so, or only a part is to be recorded.
    """
    if record:
        forbid_quick("--record", quick=quick)
    scenes = find_scenes(options.root, names)
    run = _DietRun(options, scenes.diagnostics, quick=quick, fix=fix)
    measurement = run.measure_each(scenes.value, run.look_at)
    if not record:
        return measurement
    records = ((DIET.path(report.model), DIET.encode(report)) for report in measurement.reports)
    return write_records(options.root, measurement, records)


def _file_state(file: Path) -> tuple[int, int]:
    """Return what changes when a file is edited."""
    status = file.stat()
    return status.st_size, status.st_mtime_ns


class _DietRun(MeasuringRun):
    """Looks at models one after the other."""

    stage, success = "looking at models", "looked at"

    def __init__(
        self, options: Options, diagnostics: Sequence[Diagnostic], *, quick: bool, fix: bool
    ) -> None:
        super().__init__(options, diagnostics)
        self.quick = quick
        self.fix = fix
        self.files = read_course(options.root).value
        self.course = load(options.root).value
        self.machine = machine()
        self.code = code_digest(*_CODE)

    def look_at(self, scene: CourseScene) -> DietReport | None:
        """Report on a model; `None` if it cannot be looked at, or cannot be changed."""
        model = DietModel(self.options.root, self.files, self.course, scene)
        return self.load_or_measure(
            scene.name, "diet", self._parts(model), DietReport, lambda: self._report(model)
        )

    def _report(self, model: DietModel) -> DietReport | None:
        with silent():  # MuJoCo would write its warnings into the working directory
            report = self._fix(model) if self.fix else self._survey(model).report
        return None if report is None else replace(report, digest=model.digest())

    def _survey(self, model: DietModel) -> Survey:
        tell, rerun = partial(self.progress.describe, model.scene.name), None
        if not self.quick and self.course is not None:
            rerun = Reruns(self.options, self.course, model.scene).first_difference
        return model.survey(self.machine, quick=self.quick, tell=tell, rerun=rerun)

    def _fix(self, model: DietModel) -> DietReport | None:
        """Change the model and look again until nothing is left to change.

        `None` if a change could not be written, which is reported as a failure.
        """
        kinds: dict[str, dict[str, None]] = {}
        survey = self._survey(model)
        while survey.edits:
            try:
                model.write(survey)
            except EffectError as error:
                self.failures.append(ReportFailure(error.message, error.help))
                return None
            for finding in survey.report.findings:
                for edit in finding.edits if finding.fixable else ():
                    kinds.setdefault(edit.path, {})[finding.kind] = None
            survey = self._survey(model)
        self.remarks += [f"changed {path}: {', '.join(kinds[path])}" for path in sorted(kinds)]
        return survey.report

    def _parts(self, model: DietModel) -> tuple[object, ...]:
        """Return all that a report depends on; first the digest of the model."""
        scene = model.scene
        parts: list[object] = [scene.digest, scene.name, self.quick, self.code, self.machine]
        for keep in scene.declarations.keep:
            place = keep.finding_span
            parts.append((keep.finding, keep.reason, place.line, place.column))
        parts += model.locked.items()
        if model.readers and self.course is not None:
            parts += [(d.source.path, d.source.text) for d in self.course.documents]
            parts += [(path, _file_state(self.options.root / path)) for path in self.files.files]
        return tuple(parts)

    def load(self, kind: str, parts: tuple[object, ...], report_type: type[_T]) -> _T | None:
        """Load the stored report, unless this run is to fix something in it."""
        report = super().load(kind, parts, report_type)
        if self.fix and isinstance(report, DietReport) and any(f.fixable for f in report.findings):
            return None
        return report

    def save(self, kind: str, parts: tuple[object, ...], value: object) -> None:
        """Store a report, unless this run or somebody else has changed the files meanwhile."""
        if isinstance(value, DietReport) and value.digest == parts[0]:
            super().save(kind, parts, value)
