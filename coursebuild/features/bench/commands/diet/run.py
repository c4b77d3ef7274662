"""`coursebuild diet`: what models of the course hold that their scenarios do not need.

Entry point: `diet(options, names, …)`.

1. Names mean models. One that does not compile is told, and the others are looked at.
2. What code of the course may notice is not proved, and what scripts and labs say otherwise without
   is no finding. A finding that is wanted stands in `models/NAME.toml` with its reason.
3. What was found is kept under all that it depends on, as of `bench`.
4. `fix` takes out what is proved, until nothing is left: what something needed that is gone may go
   as well. A file that changed meanwhile is left as it is.
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
from coursebuild.features.bench.commands.runs import MeasuringRun, forbid_quick, with_records
from coursebuild.numerics.engine import silent
from coursebuild.numerics.pruning.survey import Survey
from coursebuild.numerics.reports.diet import DietReport
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
    """Look at the models that the names mean; at all where there are none.

    `fix`: what is proved is taken out, and the reports are of what is left. `record`:
    each report is also written into the course.

    Raises:
        UsageError: no model is called so, or only a part is to be recorded.
    """
    if record:
        forbid_quick("--record", quick=quick)
    scenes = find_scenes(options.root, names)
    run = _DietRun(options, scenes.diagnostics, quick=quick, fix=fix)
    found = run.each(scenes.value, run.look_at)
    if not record:
        return found
    records = ((DIET.path(one.model), DIET.encode(one)) for one in found.reports)
    return with_records(options.root, found, records)


def _state(file: Path) -> tuple[int, int]:
    """What tells whether a file is another one."""
    status = file.stat()
    return status.st_size, status.st_mtime_ns


class _DietRun(MeasuringRun):
    """Looks at models one after the other."""

    stage, done = "looking at models", "looked at"

    def __init__(
        self, options: Options, diagnostics: Sequence[Diagnostic], *, quick: bool, fix: bool
    ) -> None:
        super().__init__(options, diagnostics)
        self.quick = quick
        self.fix = fix
        self.files = read_course(options.root).value
        self.course = load(options.root).value
        self.here = machine()
        self.code = code_digest(*_CODE)

    def look_at(self, scene: CourseScene) -> DietReport | None:
        """What is found in a model; `None` where it cannot be looked at, or not be changed."""
        look = DietModel(self.options.root, self.files, self.course, scene)
        return self.once(
            scene.name, "diet", self._parts(look), DietReport, lambda: self._looked(look)
        )

    def _looked(self, look: DietModel) -> DietReport | None:
        with silent():  # what MuJoCo warns of, it would write into the working directory
            report = self._fixed(look) if self.fix else self._surveyed(look).report
        return None if report is None else replace(report, digest=look.digest())

    def _surveyed(self, look: DietModel) -> Survey:
        tell, rerun = partial(self.progress.doing, look.scene.name), None
        if not self.quick and self.course is not None:
            rerun = Reruns(self.options, self.course, look.scene).differing
        return look.survey(self.here, quick=self.quick, tell=tell, rerun=rerun)

    def _fixed(self, look: DietModel) -> DietReport | None:
        """Change and look again until nothing is left to change.

        `None` where it could not be written; why is told.
        """
        kinds: dict[str, dict[str, None]] = {}
        survey = self._surveyed(look)
        while survey.edits:
            try:
                look.write(survey)
            except EffectError as error:
                self.failures.append(ReportFailure(error.message, error.help))
                return None
            for finding in survey.report.findings:
                for edit in finding.edits if finding.fixable else ():
                    kinds.setdefault(edit.path, {})[finding.kind] = None
            survey = self._surveyed(look)
        self.remarks += [f"changed {path}: {', '.join(kinds[path])}" for path in sorted(kinds)]
        return survey.report

    def _parts(self, look: DietModel) -> tuple[object, ...]:
        """All that what is found depends on; first the digest of the model."""
        parts: list[object] = [look.scene.digest, look.scene.name, self.quick, self.code, self.here]
        for one in look.scene.declared.keep:
            place = one.finding_span
            parts.append((one.finding, one.reason, place.line, place.column))
        parts += look.locked.items()
        if look.readers and self.course is not None:
            parts += [(one.source.path, one.source.text) for one in self.course.documents]
            parts += [(path, _state(self.options.root / path)) for path in self.files.files]
        return tuple(parts)

    def kept(self, kind: str, parts: tuple[object, ...], what: type[_T]) -> _T | None:
        """What was found before, if there is nothing in it to fix where that is wanted."""
        found = super().kept(kind, parts, what)
        if self.fix and isinstance(found, DietReport) and any(o.fixable for o in found.findings):
            return None
        return found

    def keep(self, kind: str, parts: tuple[object, ...], value: object) -> None:
        """Keep what was found, unless the files changed meanwhile, by us or somebody else."""
        if isinstance(value, DietReport) and value.digest == parts[0]:
            super().keep(kind, parts, value)
