"""`coursebuild diet`: what models of the course hold that their scenarios do not need.

1. Names mean models. One that does not compile is reported, and the others are looked at.
2. A part that code of the course may notice is not proved superfluous, and a part without which
   scripts or labs have another output is no finding. A part that is to stay stands in
   `models/NAME.toml` with its reason.
3. Reports are stored by all that they depend on, as those of `bench`.
4. `fix` takes out what is proved, again and again, as what only a removed part needed may go as
   well. A file that was edited meanwhile is left as it is.
5. A finding is shown with its label, what it saves and the change; what is needed, in one line.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec
from msgspec import Raw, Struct
from msgspec.structs import replace

from coursebuild.api import Diagnostic, EffectError, Options, Store, UsageError
from coursebuild.core.files.read import read_course
from coursebuild.core.files.write import FileChange, change_files
from coursebuild.core.model.diet_findings import DietReport
from coursebuild.core.model.report_files import DIET, ReportFailure
from coursebuild.core.values import decode, encode
from coursebuild.features.bench.commands.diet_model import DietModel, Reruns
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    MeasuringRun,
    forbid_quick,
    in_words,
    measurement_json,
    read_task,
    record_reports,
    run_measurement,
)
from coursebuild.features.bench.commands.measuring import FailedJobError, Mjbench
from coursebuild.pipeline.arguments import add_cache, add_executors, add_format, add_quiet
from coursebuild.pipeline.load import load, package_files
from coursebuild.pipeline.scenes import CourseScene, find_scenes

_T = TypeVar("_T")
EXAMPLES = """\
examples:
  coursebuild diet pendulum              what it could do without
  coursebuild diet --fix                 take out what changes nothing
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    parser.add_argument(
        "models", nargs="*", metavar="MODEL", help="a file of models/ (default: all)"
    )
    writes = parser.add_mutually_exclusive_group()
    writes.add_argument(
        "--fix", action="store_true", help="remove what does not change a single bit of the motion"
    )
    writes.add_argument(
        "--record", action="store_true", help="write the findings to content/reports/"
    )
    parser.add_argument("--quick", action="store_true", help="short runs and rough times")
    help = "look for findings of these kinds alone"
    parser.add_argument("--only", nargs="*", default=[], metavar="KIND", help=help)
    add_format(parser, "text", "json")
    add_cache(parser)
    add_executors(parser)


def run(arguments: argparse.Namespace) -> int:
    """Look at models, and mend them or record what was found."""
    settings = {name: getattr(arguments, name) for name in ("quick", "fix", "record", "only")}
    names = tuple(arguments.models)
    quiet = arguments.quiet and arguments.format == "text"

    def measure(options: Options, mjbench: Mjbench) -> Measurement[DietReport]:
        measurement = diet(options, mjbench, names, **settings)
        if quiet:
            pairs = zip(measurement.reports, measurement.values, strict=True)
            values = tuple(value for report, value in pairs if not report.ok)
            reports = tuple(report for report in measurement.reports if not report.ok)
            measurement = replace(measurement, reports=reports, values=values)
            measurement = Measurement(()) if measurement.ok else measurement
        places = {"command": "coursebuild diet {}", "declarations": "models/{}.toml"}
        return in_words(arguments, mjbench, "diet", measurement, **places)

    empty = "" if quiet else "there is no model to look at\n"
    return run_measurement(
        arguments,
        "diet",
        measure,
        lambda measurement: measurement_json(diet_values(measurement), measurement),
        empty=empty,
    )


def diet(
    options: Options,
    mjbench: Mjbench,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    fix: bool = False,
    record: bool = False,
    only: Sequence[str] = (),
) -> Measurement[DietReport]:
    """Look at the models that the names mean; without names, at all.

    `only`: the kinds of findings to look for; `fix`: what is proved is taken out, and the reports
    are about the rest. `record`: each report is also written into the course.

    Raises:
        UsageError: no model is called so, or only a part is to be recorded.
    """
    if record:
        forbid_quick("--record", quick=quick)
        if only:
            raise UsageError("--record cannot be combined with --only")
    scenes = find_scenes(options.root, names)
    run = _DietRun(options, mjbench, scenes.diagnostics, quick=quick, fix=fix)
    run.only = tuple(only)
    measurement = run.measure_each(scenes.value)
    if record:
        return record_reports(options.root, mjbench, DIET, "diet", measurement)
    return measurement


class _Change(Struct, frozen=True):
    path: str
    before: bytes
    after: bytes


class _Result(Struct, frozen=True):
    """What mjbench has found, and what `--fix` changes."""

    report: Raw
    changes: tuple[_Change, ...]


class _DietRun(MeasuringRun[DietReport]):
    """Looks at models one after the other."""

    stage, success = "looking at models", "looked at"
    function = f"{__name__}:measure_part"
    report_type, kind = DietReport, "diet"
    only: tuple[str, ...] = ()
    """The kinds of findings that are looked for; all if none is named."""

    def __init__(
        self,
        options: Options,
        mjbench: Mjbench,
        diagnostics: Sequence[Diagnostic],
        *,
        quick: bool,
        fix: bool,
    ) -> None:
        super().__init__(options, mjbench, diagnostics)
        self.quick = quick
        self.fix = fix
        self.files = read_course(options.root).value
        self.course = load(options.root).value

    def measure(self, scene: CourseScene) -> bytes | None:
        """Report on a model; `None` if it cannot be looked at, or cannot be changed."""
        model = self.model_of(scene)
        return self.load_or_measure(scene, self._parts(model), lambda: self._report(model))

    def tasks(self, scene: CourseScene) -> Iterator[tuple[Any, ...]]:
        """The model, if no report on it is stored."""
        parts = self._parts(self.model_of(scene))
        if not self.only and self.load(self.kind, parts, bytes) is None:
            yield self._task(scene)

    def model_of(self, scene: CourseScene) -> DietModel:
        """The model of a scene, with its files and readers."""
        return DietModel(self.options.root, self.files, self.course, scene)

    def _task(self, scene: CourseScene) -> tuple[Any, ...]:
        return scene.name, scene.digest, self.quick, self.fix

    def _report(self, model: DietModel) -> bytes | None:
        """Look at a model here, or take what another process has found and changed."""
        data = self.results.pop(self._task(model.scene), b"")
        result = decode(data, cast("type[_Elsewhere]", _Elsewhere))
        if result is None:
            return self.report_here(model)
        report, changes, remarks = result
        if not self._write([FileChange(*change) for change in changes]):
            return None
        self.remarks += remarks
        return report

    def _write(self, changes: Sequence[FileChange]) -> bool:
        try:
            change_files(self.options.root, changes)
        except EffectError as error:
            self.failures.append(ReportFailure(error.message, error.help))
            return False
        return True

    def report_here(self, model: DietModel) -> bytes | None:
        """Look at a model; with `fix`, change it and look again until nothing is left to change.

        `None` if a change could not be written, which is reported as a failure.
        """
        kinds: dict[str, dict[str, None]] = {}
        result = self._survey(model)
        while self.fix and result.changes:
            changes = [FileChange(c.path, c.before, c.after) for c in result.changes]
            if not self._write(changes):
                return None
            report = msgspec.json.decode(result.report, type=DietReport)
            for finding in report.findings:
                for edit in finding.edits if finding.fixable else ():
                    kinds.setdefault(edit.path, {})[finding.kind] = None
            changed = self._read_again(model.scene.name)
            if changed is None:
                return None
            model = changed
            result = self._survey(model)
        self.remarks += [f"changed {path}: {', '.join(kinds[path])}" for path in sorted(kinds)]
        return bytes(result.report)

    def _read_again(self, name: str) -> DietModel | None:
        """The model as it is on the disk now; `None` where it cannot be looked at any more."""
        scenes = find_scenes(self.options.root, (name,))
        self.files = read_course(self.options.root).value
        self.course = load(self.options.root).value
        for scene in scenes.value:
            return self.model_of(scene)
        self.diagnostics += scenes.diagnostics
        return None

    def _survey(self, model: DietModel) -> _Result:
        with_course = not self.quick and self.course is not None
        if with_course and self.course is not None:
            reruns = Reruns(self.options, self.course, model.scene)
            self.mjbench.rerun = reruns.first_difference
        data = self.mjbench.do(
            "diet",
            model.scene,
            readers=model.readers.sources,
            modules=sorted(model.readers.modules),
            keeps=model.keeps,
            locked=model.locked,
            only=self.only,
            quick=self.quick,
            rerun=with_course,
        )
        return msgspec.json.decode(data, type=_Result)

    def _parts(self, model: DietModel) -> tuple[object, ...]:
        """Return all that a report depends on; first the digest of the model."""
        scene, machine = model.scene, self.facts.machine
        parts: list[object] = [scene.digest, scene.name, self.quick, self.code, machine]
        parts += self.only
        for keep in scene.declarations.keep:
            place = keep.finding_span
            parts.append((keep.finding, keep.reason, place.line, place.column))
        parts += [*model.locked.items(), model.readers]
        if model.readers.sources and self.course is not None:
            parts += [(d.source.path, d.source.text) for d in self.course.documents]
            paths = (*self.files.files, *package_files(self.options.root, self.course))
            states = [(path, (self.options.root / path).stat()) for path in paths]
            parts += [(path, state.st_size, state.st_mtime_ns) for path, state in states]
        return tuple(parts)

    def load(self, kind: str, parts: tuple[object, ...], form: type[_T]) -> _T | None:
        """Load the stored report, unless this run is to fix something in it."""
        value = super().load(kind, parts, form)
        if self.fix and isinstance(value, bytes):
            report = msgspec.json.decode(value, type=DietReport)
            if any(finding.fixable for finding in report.findings):
                return None
        return value

    def save(self, kind: str, parts: tuple[object, ...], value: object) -> None:
        """Store a report, unless this run or somebody else has changed the files meanwhile."""
        if isinstance(value, bytes):
            report = msgspec.json.decode(value, type=DietReport)
            if report.digest == parts[0]:
                super().save(kind, parts, value)


_Elsewhere = tuple[bytes, tuple[tuple[str, bytes, bytes], ...], tuple[str, ...]]
"""A report, the files that `--fix` has changed, before and after, and what is said of that."""


def measure_part(root: Path, data: bytes) -> bytes:
    """Look at a model, as a task of `Executor.map`."""
    with Mjbench(root, "`coursebuild diet`") as mjbench:
        task = read_task(data, mjbench)
        if task is None:
            return b""
        name, digest, quick, fix = task
        options = Options(root, 1, Store(root, fresh=True))
        run = _DietRun(options, mjbench, (), quick=quick, fix=fix)
        for scene in find_scenes(root, (name,)).value:
            if scene.digest != digest:  # its files have been edited meanwhile
                return b""
            model = run.model_of(scene)
            files = {path: root / path for path in model.paths}
            before = {path: file.read_bytes() for path, file in files.items() if file.is_file()}
            try:
                report = run.report_here(model)
            except FailedJobError:  # which is found and told where the command is
                return b""
            after = {path: files[path].read_bytes() for path in before}
            changes = tuple((p, before[p], after[p]) for p in before if before[p] != after[p])
            return b"" if report is None else encode((report, changes, tuple(run.remarks)))
    return b""


def diet_values(measurement: Measurement[DietReport]) -> dict[str, object]:
    """Return the reports as plain values, each with whether nothing is left to be done."""
    pairs = zip(measurement.values, measurement.reports, strict=True)
    return {"models": [value | {"ok": report.ok} for value, report in pairs]}
