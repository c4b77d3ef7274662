"""`coursebuild diet`: what models of the course hold that their scenarios do not need.

Entry points: `diet(options, names, …)`, and `fix` and `record`, which also write.

1. Names mean models. One that does not compile is told, and the others are looked at.
2. Who reads a model are the files of the course that mention it; what any of them reads is no
   finding. A finding that is wanted stands in `models/NAME.toml` with its reason.
3. What was found is kept under all that it depends on, as of `bench`; and one run of a course
   measures at a time.
4. `fix` makes the changes after which every bit is the same, until there is none left: what
   something needed that is gone may go as well. The files are read again, compiled and run before
   they are written; a file that changed meanwhile is left as it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_course
from coursebuild.core.run.machine import machine
from coursebuild.core.text.diagnostics import sort_diagnostics
from coursebuild.numerics.reports.diet import DietReport
from coursebuild.numerics.reports.records import ReportFailure, diet_path, encode_diet
from coursebuild.pipeline.diet_model import CannotError, DietModel
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.reports import (
    Measurement,
    MeasuringRun,
    digest_of,
    machine_parts,
    write_records,
)
from coursebuild.pipeline.scenes import CourseScene, find_scenes

if TYPE_CHECKING:
    from coursebuild.numerics.pruning.ablation import Survey
    from coursebuild.numerics.pruning.model_text import ModelText

_KIND = "diet"
_CODE = ("coursebuild/numerics", "coursebuild/pipeline/diet_model.py", "mjcourse/spatial")
_ROUNDS = 20
"""Most times that something new is found after something was changed."""


def diet(
    options: Options, names: tuple[str, ...] = (), *, quick: bool = False
) -> Measurement[DietReport]:
    """Look at the models that the names mean; at all where there are none.

    Raises:
        UsageError: no model is called so.
    """
    return _diet(options, names, quick=quick)


def _diet(
    options: Options, names: tuple[str, ...], *, quick: bool, fix: bool = False
) -> Measurement[DietReport]:
    found = find_scenes(options.root, names)
    run = _DietRun(options, quick=quick, fix=fix)
    reports = run.each("looking at models", found.scenes, run.look_at)
    diagnostics = sort_diagnostics((*found.diagnostics, *run.diagnostics))
    return Measurement(
        reports, diagnostics, failures=tuple(run.failures), remarks=tuple(run.remarks)
    )


def record(
    options: Options, names: tuple[str, ...] = (), *, quick: bool = False
) -> Measurement[DietReport]:
    """Look at models, and write each report into the course.

    Raises:
        UsageError: no model is called so, or only a part is to be measured.
    """
    if quick:
        raise UsageError("--record takes no --quick: what is recorded is measured in full")
    found = diet(options, names)
    records = ((diet_path(one.model), encode_diet(one)) for one in found.reports)
    failures, remarks = write_records(options.root, records)
    return replace(found, failures=failures, remarks=remarks)


def fix(
    options: Options, names: tuple[str, ...] = (), *, quick: bool = False
) -> Measurement[DietReport]:
    """Look at models, and make the changes that change no bit; the reports are of what is left.

    Raises:
        UsageError: no model is called so.
    """
    return _diet(options, names, quick=quick, fix=True)


class _DietRun(MeasuringRun):
    """Looks at models one after the other."""

    done = "looked at"

    def __init__(self, options: Options, *, quick: bool, fix: bool = False) -> None:
        super().__init__(options)
        self.quick = quick
        self.fix = fix
        self.failures: list[ReportFailure] = []
        self.remarks: list[str] = []
        self.files = read_course(options.root).value
        self.here = machine()
        self.code = code_digest(*_CODE)

    def look_at(self, scene: CourseScene) -> DietReport | None:
        """What is found in a model; `None` where it cannot be looked at, or not be changed."""
        look = DietModel(self.options.root, self.files, scene)
        key = self._key(look)
        return self.one(scene.name, lambda: self._kept(key), lambda: self._looked(look, key))

    def _looked(self, look: DietModel, key: str) -> DietReport | None:
        from coursebuild.numerics.engine import silent

        try:
            with silent():  # what MuJoCo warns of, it would write into the working directory
                report = self._fixed(look) if self.fix else self._surveyed(look)[0]
        except CannotError as error:
            self.diagnostics.append(error.diagnostic)
            return None
        if report is not None:
            report = replace(report, digest=look.digest())
            # Somebody else may have changed the files while we waited.
            if report.digest == look.scene.digest:
                self.options.store.put_value(_KIND, key, report, local=True)
        return report

    def _surveyed(self, look: DietModel) -> tuple[DietReport, Survey, ModelText]:
        tell = lambda text: self.progress.doing(look.scene.name, text)  # noqa: E731
        survey, text = look.survey(quick=self.quick, tell=tell)
        return look.report(survey, self.here, quick=self.quick), survey, text

    def _fixed(self, look: DietModel) -> DietReport | None:
        """Change, look again, and write when nothing is left to change.

        `None` where it could not be written; why is told.
        """
        kinds: dict[str, list[str]] = {}
        for _ in range(_ROUNDS):
            report, survey, text = self._surveyed(look)
            if not survey.edits:
                break
            look.change(survey, text)
            for finding in report.findings:
                if finding.fixable:
                    for path in {edit.path for edit in finding.edits}:
                        kinds.setdefault(path, []).append(finding.kind)
        try:
            look.write()
        except EffectError as error:
            self.failures.append(ReportFailure(error.message, error.help))
            return None
        for path in sorted(look.changed):
            self.remarks.append(f"changed {path}: {', '.join(dict.fromkeys(kinds.get(path, ())))}")
        return report

    def _key(self, look: DietModel) -> str:
        parts = [look.scene.name, look.scene.digest, f"{self.quick}", self.code]
        parts += machine_parts(self.here)
        declared = look.scene.declared
        for one in () if declared is None else declared.keep:
            place = one.finding_span
            parts.append(f"{one.finding}\0{one.reason}\0{place.line}:{place.column}")
        parts += [f"{path}\0{why}" for path, why in look.locked.items()]
        parts += [f"{reader.path}\0{reader.text}" for reader in look.readers.files]
        return digest_of(parts)

    def _kept(self, key: str) -> DietReport | None:
        """What was found before, if there is nothing in it to fix where that is wanted."""
        kept = self.options.store.get_value(_KIND, key, DietReport)
        if kept is not None and self.fix and any(one.fixable for one in kept.findings):
            return None
        return kept
