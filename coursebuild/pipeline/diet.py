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

import hashlib
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_course
from coursebuild.core.run.machine import machine
from coursebuild.core.text.diagnostics import Diagnostic, sort_diagnostics
from coursebuild.numerics.reports.diet import DietReport
from coursebuild.numerics.reports.records import ReportFailure, diet_path, encode_diet
from coursebuild.pipeline.diet_model import CannotError, DietModel
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.reports import write_record
from coursebuild.pipeline.scenes import CourseScene, find_scenes

if TYPE_CHECKING:
    from coursebuild.numerics.pruning.ablation import Survey
    from coursebuild.numerics.pruning.model_text import ModelText

_KIND = "diet"
_CODE = ("coursebuild/numerics", "coursebuild/pipeline/diet_model.py", "mjcourse/spatial")
_LOCK = "bench-lock"
"""The lock of `bench`: each would disturb the other's times."""
_ROUNDS = 20
"""Most times that something new is found after something was changed."""


class Fixed(Struct, frozen=True):
    """A file that was changed."""

    path: str
    kinds: tuple[str, ...]
    """Of the findings that it was changed for."""


class Dieted(Struct, frozen=True):
    """What a run found."""

    reports: tuple[DietReport, ...]
    """By name."""
    diagnostics: tuple[Diagnostic, ...]
    failures: tuple[ReportFailure, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def wrong(self) -> Dieted:
        """Without the models in which nothing is to be done."""
        return replace(self, reports=tuple(one for one in self.reports if not one.ok))

    @property
    def ok(self) -> bool:
        """Whether nothing is left to be done."""
        return not (self.diagnostics or self.failures) and all(one.ok for one in self.reports)


def diet(options: Options, names: tuple[str, ...] = (), *, quick: bool = False) -> Dieted:
    """Look at the models that the names mean; at all where there are none.

    Raises:
        UsageError: no model is called so.
    """
    found = find_scenes(options.root, names)
    run = _Run(options, quick=quick)
    reports = run.all(found.scenes)
    return Dieted(reports, sort_diagnostics((*found.diagnostics, *run.diagnostics)))


def record(options: Options, names: tuple[str, ...] = (), *, quick: bool = False) -> Dieted:
    """Look at models, and write each report into the course.

    Raises:
        UsageError: no model is called so, or only a part is to be measured.
    """
    if quick:
        raise UsageError("--record takes no --quick: what is recorded is measured in full")
    found = diet(options, names)
    failures: list[ReportFailure] = []
    remarks: list[str] = []
    for report in found.reports:
        said = write_record(options.root, diet_path(report.model), encode_diet(report))
        if isinstance(said, ReportFailure):
            failures.append(said)
        else:
            remarks.append(said)
    return Dieted(found.reports, found.diagnostics, tuple(failures), tuple(remarks))


def fix(options: Options, names: tuple[str, ...] = (), *, quick: bool = False) -> Dieted:
    """Look at models, and make the changes that change no bit; the reports are of what is left.

    Raises:
        UsageError: no model is called so.
    """
    found = find_scenes(options.root, names)
    run = _Run(options, quick=quick)
    reports = run.all(found.scenes, fix=True)
    diagnostics = sort_diagnostics((*found.diagnostics, *run.diagnostics))
    remarks = tuple(f"changed {one.path}: {', '.join(one.kinds)}" for one in run.fixed)
    return Dieted(reports, diagnostics, tuple(run.failures), remarks)


class _Run:
    """Looks at models one after the other."""

    def __init__(self, options: Options, *, quick: bool) -> None:
        self.options = options
        self.root = options.root
        self.quick = quick
        self.diagnostics: list[Diagnostic] = []
        self.failures: list[ReportFailure] = []
        self.fixed: list[Fixed] = []
        self.progress = Progress(quiet=options.quiet)
        options.store.listen(self.progress.say)

    def all(self, scenes: Sequence[CourseScene], *, fix: bool = False) -> tuple[DietReport, ...]:
        """Every model that can be looked at."""
        if not scenes:
            return ()
        self.files = read_course(self.root).value
        self.here = machine()
        self.code = code_digest(*_CODE)
        reports = []
        with self.progress.stage("looking at models", len(scenes)):
            for scene in scenes:
                report = self._one(scene, fix)
                if report is not None:
                    reports.append(report)
        return tuple(reports)

    def _one(self, scene: CourseScene, fix: bool) -> DietReport | None:
        look = DietModel(self.root, self.files, scene)
        key = self._key(look)
        kept = self._kept(key, fix)
        if kept is not None:
            return kept
        with project_lock(self.root, self.progress.say, name=_LOCK):
            kept = self._kept(key, fix)  # somebody else may have looked while we waited
            if kept is not None:
                return kept
            self.progress.started(scene.name)
            began = time.monotonic()
            try:
                report = self._looked(look, fix)
            except CannotError as error:
                self.diagnostics.append(error.diagnostic)
                self.progress.finished(scene.name, "not looked at", time.monotonic() - began)
                return None
            if report is None:
                self.progress.finished(scene.name, "not changed", time.monotonic() - began)
                return None
            report = replace(report, digest=look.digest())
            # Somebody else may have changed the files while we waited.
            if report.digest == scene.digest:
                self.options.store.put_value(_KIND, key, report, local=True)
            self.progress.finished(scene.name, "looked at", time.monotonic() - began)
            return report

    def _looked(self, look: DietModel, fix: bool) -> DietReport | None:
        """What is found, and changed; `None` where it could not be written, which is told."""
        from coursebuild.numerics.engine import silent

        with silent():  # what MuJoCo warns of, it would write into the working directory
            return self._fixed(look) if fix else self._surveyed(look)[0]

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
            self.fixed.append(Fixed(path, tuple(dict.fromkeys(kinds.get(path, ())))))
        return report

    def _key(self, look: DietModel) -> str:
        parts = [look.scene.name, look.scene.digest, f"{self.quick}", self.code]
        here = self.here
        parts += [here.engine, here.python, here.numpy, here.system, here.cpu]
        declared = look.scene.declared
        for one in () if declared is None else declared.keep:
            place = one.finding_span
            parts.append(f"{one.finding}\0{one.reason}\0{place.line}:{place.column}")
        parts += [f"{path}\0{why}" for path, why in look.locked.items()]
        parts += [f"{reader.path}\0{reader.text}" for reader in look.readers.files]
        text = "\0\0".join(parts)
        return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()

    def _kept(self, key: str, fix: bool) -> DietReport | None:
        """What was found before, if there is nothing in it to fix where that is wanted."""
        kept = self.options.store.get_value(_KIND, key, DietReport)
        if kept is not None and fix and any(one.fixable for one in kept.findings):
            return None
        return kept
