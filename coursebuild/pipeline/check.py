"""`coursebuild check`: verify the course, or some lessons of it, and report; publish nothing.

In a report, silenced warnings are left out, the rest is sorted and counted.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Citation, Course, Document, document_scripts, find_inlines
from coursebuild.core.model.lesson_record import record_path
from coursebuild.core.model.results import Reports, Results, ScriptRun, TrialLine
from coursebuild.core.pages.library import named_models
from coursebuild.core.registry import feature_trials, unproven
from coursebuild.core.run.dependencies import sought_files
from coursebuild.core.run.mjcf import model_files
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.scripts.bound_places import find_printed
from coursebuild.core.scripts.edit import shown_files
from coursebuild.core.scripts.extract import extract, is_run
from coursebuild.core.scripts.findings import unproven_units
from coursebuild.core.scripts.noise_warnings import noise_warnings
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.scripts.sensitivity import Sensitivity
from coursebuild.core.syntax.document import read_again
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, sort_diagnostics
from coursebuild.pipeline.load import Code, load
from coursebuild.pipeline.options import Options, select
from coursebuild.pipeline.proofs import remarks_on_proofs
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.records import write_records
from coursebuild.pipeline.scenes import shown_reports
from coursebuild.pipeline.scripts import measure_sensitivity
from coursebuild.pipeline.shards import Shard, write_timings
from coursebuild.pipeline.verify import Verification, verify
from coursebuild.report import Report, ScriptLine
from coursebuild.report.values import unproven_things


def check(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    shard: Shard | None = None,
    timings: str | None = None,
    sensitivity: bool = False,
    truth: bool = False,
) -> Report:
    """Verify the lessons that the names mean; all, and the pages, where there are none.

    `shard` is the part of the scripts and labs that this run takes; `timings` the file into which
    it writes how long each took. `sensitivity`: run again what was recorded from one run, and say
    which printed digits repeat when initial states are moved a little. `truth`: list the
    results that nothing in the course gives.
    """
    with project_lock(options.root, options.progress.say):
        with Reader(options) as reader:
            checked_course = read_and_verify(
                options, reader, names, shard=shard, repeat=sensitivity
            )
        if isinstance(checked_course, Report):
            return checked_course
        course, verification = checked_course.course, checked_course.verification
        if timings is not None:
            seconds = {s.path: s.seconds for s in verification.scripts if s.did_run}
            seconds |= {lab.name: lab.seconds for lab in verification.labs if lab.tried}
            names_of_course = [*(e.path for e in extract(course).value), *feature_trials(course)]
            write_timings(timings, seconds, names_of_course)
        diagnostics: list[Diagnostic] = []
        remarks: tuple[str, ...] = ()
        sensitivities: tuple[Sensitivity, ...] | None = None
        if sensitivity:
            runs, selected = verification.results.runs, checked_course.documents
            sensitivities = measure_sensitivity(
                course, checked_course.options, runs, selected, halve=True
            )
            diagnostics += (warning for s in sensitivities for warning in noise_warnings(s))
        inventory = [*list_unproven(checked_course)] if truth else []
        report = checked_course.report(diagnostics, inventory)
        if shard is None:
            checked_course.write_records()
            remarks = remarks_on_proofs(
                course, options.store, verification, checked_course.documents, report
            )
        part = "" if shard is None else str(shard)
        return replace(report, remarks=remarks, sensitivity=sensitivities, part=part)


class CheckedCourse(Struct, frozen=True):
    """A course with the results of running it and everything that is wrong with it."""

    began: float
    """When the command began, by `time.monotonic`."""
    course: Course
    options: Options
    """With the course's interpreter."""
    documents: frozenset[str] | None
    """The paths of the lessons and pages that the command is about; `None`: all."""
    verification: Verification
    reports: Reports
    """Those that pages may show."""
    diagnostics: tuple[Diagnostic, ...]
    """Those of the whole course; those of what was run are in the verification."""

    def report(
        self, further: Iterable[Diagnostic] = (), inventory: Sequence[Diagnostic] = ()
    ) -> Report:
        """The report; `further` are diagnostics found since, for `inventory` see `judge`."""
        verification, documents = self.verification, self.documents
        runs = verification.results.runs
        root = self.options.root
        diagnostics = diagnostics_of(root, self.course, self.diagnostics, documents, runs)
        report = judge(
            self.course,
            (*diagnostics, *verification.run_diagnostics, *further),
            self.began,
            scripts=verification.scripts,
            documents=documents,
            labs=verification.labs,
            strict=self.options.strict or self.course.strict,
            inventory=inventory,
        )
        if report.summary.unrepeated:  # what repeats them changes no file
            return report
        depends = depends_on(self.course, verification.results, self.options.interpreter)
        return replace(report, depends=depends)

    def write_records(self) -> None:
        """Keep where the values of documents without errors were printed; records nothing."""
        verification = self.verification
        outputs = PrintedOutputs(verification.results.verdicts, ())
        diagnostics = (*self.diagnostics, *verification.run_diagnostics)
        broken = {diagnostic.span.path for diagnostic in diagnostics if diagnostic.is_error}
        documents = [
            document
            for _, document in self.course.shown_texts
            if self.documents is None or document.source.path in self.documents
            if document.source.path not in broken
        ]
        write_records(self.course, documents, outputs, verification.addresses, self.options.root)


def read_and_verify(
    options: Options,
    reader: Reader,
    names: tuple[str, ...] = (),
    *,
    static: bool = False,
    shard: Shard | None = None,
    repeat: bool = False,
    texts: Mapping[str, str] = {},
) -> CheckedCourse | Report:
    """What `check`, `build` and `export` do: read a course, check it, run it.

    Where the map cannot be read, there is only a report. The caller holds the course's lock.
    `static`: with the static forms of labs, for pages. `repeat`: see `verify`. `texts`: those
    that files are to have, by path, in place of what they hold.
    """
    began = time.monotonic()
    code: Code = "run" if options.sandbox is None else "refuse"
    parsed_course = load(options.root, reader, texts, code=code)
    course = parsed_course.value
    if course is None:
        return judge(None, parsed_course.diagnostics, began, strict=options.strict)
    selected = select(course, names, options.root)
    options = options.for_course(course)
    verification = verify(
        course,
        options,
        selected,
        static=static,
        shard=shard,
        repeat=repeat,
        imports=reader.imports,
    )
    reports = shown_reports(options.root, course)
    diagnostics = (
        *parsed_course.diagnostics,
        *verification.course_diagnostics,
        *reports.diagnostics,
    )
    return CheckedCourse(began, course, options, selected, verification, reports.value, diagnostics)


# --- from diagnostics to a report


def list_unproven(checked_course: CheckedCourse) -> Iterator[Diagnostic]:
    """What nothing gives in the checked documents, and in what the map says of their lessons."""
    course, results = checked_course.course, checked_course.verification.results
    places = [
        (owner.span, document.source.path)
        for owner, document in course.owned_documents
        if checked_course.documents is None or document.source.path in checked_course.documents
    ]
    entries, paths = {span for span, _ in places}, {path for _, path in places}
    diagnostics = (*unproven(course), *unproven_units(course, results.runs, results.verdicts))
    outputs = PrintedOutputs(results.verdicts, results.runs)
    texts = {document.source.path: (owner, document) for owner, document in course.owned_documents}

    @functools.cache
    def read(path: str) -> Document:
        return read_again(course, *texts[path])

    for diagnostic in diagnostics:
        path = diagnostic.span.path
        if diagnostic.span in entries or path in paths:
            is_number = diagnostic.rule == "number-unproven" and path in texts
            yield find_printed(diagnostic, read(path), outputs) if is_number else diagnostic


def diagnostics_of(
    root: Path,
    course: Course,
    diagnostics: Iterable[Diagnostic],
    documents: Collection[str] | None,
    runs: Iterable[ScriptRun],
) -> tuple[Diagnostic, ...]:
    """Those that concern these lessons and pages; all where `documents` is `None`.

    They are those in their files and in the map, and the errors and hints in files that they use.
    `runs` are those of their scripts.
    """
    if documents is None:
        return tuple(diagnostics)
    own_paths = {*documents, course.map.path}
    # The files that some lessons and pages use: models, what scripts read, the list of sources
    paths = {file for run in runs if run.trace is not None for file in run.trace.files}
    for document in course.documents:
        if document.source.path in documents:
            paths |= {f"models/{name}.xml" for name in named_models(document)}
            if course.bibliography is not None and any(find_inlines(document, Citation)):
                paths.add(course.bibliography.path)
    models = {model.source.path: model.source.text for model in course.models}
    for path in paths & {*models}:
        paths |= {*model_files(root, path, models[path])}
    used_paths = paths | {f"{path.removesuffix('.xml')}.toml" for path in paths & {*models}}
    return tuple(
        d
        for d in diagnostics
        if d.span.path in own_paths or (d.severity != "warning" and d.span.path in used_paths)
    )


def judge(
    course: Course | None,
    diagnostics: Iterable[Diagnostic],
    began: float | None = None,
    *,
    scripts: Sequence[ScriptLine] = (),
    labs: tuple[TrialLine, ...] = (),
    documents: Collection[str] | None = None,
    remarks: tuple[str, ...] = (),
    strict: bool = False,
    inventory: Sequence[Diagnostic] = (),
) -> Report:
    """Make the report of a command that began at this moment of `time.monotonic`.

    `documents`: the lessons and pages that it is about, by path. `strict`: warnings count as
    errors, and so does a script that was not run, unless the map lets it pass. `inventory`:
    warnings that somebody asked for, such as a list of numbers; they stay warnings.
    """
    if strict and course is not None:
        diagnostics = (*diagnostics, *_refuse_unproven(course, scripts))
    if course is None:
        lesson_count = 0
    elif documents is None:
        lesson_count = len(course.written_lessons)
    else:
        lesson_count = sum(lesson.path in documents for lesson in course.lessons)
    relevant = sort_diagnostics(_without_consequences([*diagnostics, *inventory]))
    silences = course.silences if course is not None else ()
    mild = {d.rule for d in inventory}

    def is_silenced(diagnostic: Diagnostic) -> bool:  # a map that silences an error is not valid
        return any(
            silence.rule == diagnostic.rule
            and (silence.path is None or fnmatchcase(diagnostic.span.path, silence.path))
            for silence in silences
        )

    unsilenced = [d for d in relevant if not is_silenced(d)]
    hints = tuple(d for d in unsilenced if d.severity == "hint")
    reported = tuple(
        replace(d, strict=strict and d.rule not in mild) for d in unsilenced if d.severity != "hint"
    )
    return Report(
        diagnostics=reported,
        scripts=tuple(scripts),
        labs=labs,
        lessons=lesson_count,
        silenced=len(relevant) - len(unsilenced),
        seconds=0.0 if began is None else time.monotonic() - began,
        remarks=remarks,
        hints=hints,
    )


def _refuse_unproven(course: Course, lines: Iterable[ScriptLine]) -> Iterator[Diagnostic]:
    by_path = {s.path: s for document in course.documents for s in document_scripts(document)}
    allowed_paths = {entry.path for entry in course.unproven}
    for line in lines:
        if line.did_run or line.path in allowed_paths:
            continue
        script = by_path[line.path]
        if not line.missing and is_run(course, script):
            continue  # another mistake says why
        names = " and ".join(f"`{name}`" for name in line.missing)
        are = "are" if len(line.missing) > 1 else "is"
        reason, cure = f"{names} {are} not installed", f"install {names}"
        if not line.missing:
            reason, cure = "its fence says `norun`", "remove `norun`"
            if not script.norun:
                reason = f"`[runners]` of the map has nothing for `{script.language}`"
                cure = "name what runs it"
        unproven = unproven_things(line) or "that it runs"
        yield diagnose(
            "script-unproven",
            script.span.first_line(),
            f"`{line.path}` was not run ({reason}), so nothing proves {unproven}",
            help=f'{cure}, or allow it: `unproven = ["{line.path}"]` in `[verify]` of the map',
        )


_LOSSES = frozenset(
    "anchor-repeated fence-unclosed heading-attributes html-unbalanced label-attribute "
    "math-unclosed output-unmarked recording-body script-kind".split()
)
"""Rules of a part of a page that is not read as what it was meant to be."""
_ABSENCES = "binding-orphan footnote-undefined footnote-unused link-anchor shown-as-written"
"""Rules of what has no other half on its page, which may be in a part that is lost."""
_CAUSES = {
    **dict.fromkeys(_ABSENCES.split(), _LOSSES),
    "control-character": {"file-encoding"},
    "recording-body": {"fence-unclosed"},
}


def _without_consequences(diagnostics: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """The diagnostics without what only follows from another one, of the same page or line."""
    rules = {(d.span.path, d.rule) for d in diagnostics}
    mild = ("html-unbalanced", "shown-as-written")
    told_lines = {
        (d.span.path, d.span.line)
        for d in diagnostics
        if d.rule == "markup-foreign" or (d.is_error and d.rule not in mild)
    }
    for diagnostic in diagnostics:
        rule, span = diagnostic.rule, diagnostic.span
        causes = {"merge-conflict", *_CAUSES.get(rule, ())} - {rule}
        follows = any((span.path, cause) in rules for cause in causes)
        if not follows and (rule not in mild or (span.path, span.line) not in told_lines):
            yield diagnostic


def depends_on(
    course: Course, results: Results, interpreter: Interpreter | None
) -> tuple[str, ...] | None:
    """The files outside the course's own folders that the report depends on.

    `None` where they cannot all be known, as where a script starts other programs.
    """
    packages = {package.path for package in course.packages}  # archives hold all of them
    if "." in packages:
        return None
    pages = [page.path for page in course.pages]
    files = {*pages, *map(record_path, pages), *shown_files(course), *packages}
    if interpreter is not None:
        files |= {interpreter.python, f"{interpreter.prefix}/pyvenv.cfg", *interpreter.packages}
    for run in results.runs:
        if not run.did_run:
            continue  # installed packages are compared in any case
        if run.trace is None or run.trace.opaque or "." in run.trace.folders:
            return None
        files |= {*run.trace.files, *run.trace.folders, *run.trace.outside}
        files |= {name for name, _ in (*run.trace.existence, *run.trace.statuses)}
        files |= {file for name in run.trace.sought for file in sought_files(name)}
    for _, result in results.models:
        if result.facts is not None:
            files |= {*result.facts.includes}
    return tuple(sorted(files))
