"""`coursebuild update` and `extract`: what scripts print, and what they are, into the lessons.

Each lesson is written whole or not at all, and only if nobody changed it meanwhile. A bound number
becomes what stands at its address now; where that is gone, a diagnostic says so.

What is written was printed by one run. Whether another prints the same, and which digits hold, is
found out later: by `serve` when it is idle, and by `check --sensitivity`.
"""

from __future__ import annotations

import difflib
import functools
import time
from collections.abc import Collection, Iterable, Sequence

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.examples import Obstacle
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import check_writable, write_atomic
from coursebuild.core.model import Course, Document
from coursebuild.core.model.lesson_record import known_addresses
from coursebuild.core.model.results import Outcome, ScriptRun, TrialLine
from coursebuild.core.registry import feature_trials
from coursebuild.core.scripts.bindings import update_outputs
from coursebuild.core.scripts.bound_places import (
    carried_addresses,
    document_values,
    reworded_addresses,
)
from coursebuild.core.scripts.compare import verify as compare_all
from coursebuild.core.scripts.edit import adopt_file, block_text, edited_texts
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.extract import extract as extract_course
from coursebuild.core.scripts.figures import figure_findings
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.core.text.source import Source
from coursebuild.pipeline.check import diagnostics_of, judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, select
from coursebuild.pipeline.recordings import (
    check_recorded_runs,
    find_figures,
    keep_prepared,
    read_recorded,
    record_runs,
    write_figures,
)
from coursebuild.pipeline.records import write_records
from coursebuild.pipeline.scripts import (
    ExtractedScripts,
    extract_scripts,
    find_module,
    recorded_outputs,
    run,
    script_lines,
)
from coursebuild.report import UNASKED, Report, ScriptLine

DOUBTFUL = ("file-encoding", "merge-conflict")
"""Rules of files whose text is not what they hold, or not one text."""
_DRIFTS = ("output-drift", "figure-drift")


def update(options: Options, names: tuple[str, ...] = (), *, dry_run: bool = False) -> Report:
    """Record what the scripts of the chosen lessons print now."""
    with project_lock(options.root, options.progress.say):
        began = time.monotonic()
        parsed_course = load(options.root)
        course = parsed_course.value
        if course is None:
            return judge(None, parsed_course.diagnostics, began)
        updater = _Updater(course, parsed_course.diagnostics, options, names, dry_run=dry_run)
        return updater.update(began)


class _Updater:
    """Updates the recorded outputs of some lessons."""

    def __init__(
        self,
        course: Course,
        diagnostics: Sequence[Diagnostic],
        options: Options,
        names: tuple[str, ...],
        *,
        dry_run: bool,
    ) -> None:
        self.course = course
        self.diagnostics = diagnostics
        """Those of reading the course."""
        self.options = options.for_course(course)
        self.dry_run = dry_run
        self.documents = select(course, names, options.root)
        self.recordings = recorded_outputs(course, self.documents)
        self.extracted_scripts = extract_scripts(course, self.options)
        paths = {recording.script for recording in self.recordings}
        paths |= {figure.script for figure in find_figures(course, self.documents)}
        self.scripts = [e for e in self.extracted_scripts.runnable if e.path in paths]
        """The scripts that have an output or a figure to bring up to date."""
        self.addresses = known_addresses(course.records)
        self.reworded: set[str] = set()
        """The lessons with values that are called otherwise in outputs now."""

    def update(self, began: float) -> Report:
        runs = run(self.course, self.scripts, self.options)
        edits, refusals = self._make_edits(runs)
        remarks, failures = self._write(edits)
        figure_remarks, figure_failures = write_figures(
            self.course, self.documents, runs, self.options, dry_run=self.dry_run
        )
        remarks += figure_remarks
        if self.options.long and not self.dry_run:
            record_runs(self.scripts, runs, self.options)
        new_course, read_diagnostics = self.course, self.diagnostics
        if remarks and not self.dry_run:
            parsed_course = load(self.options.root)
            new_course = parsed_course.value or self.course
            read_diagnostics = parsed_course.diagnostics
        diagnostics = [*read_diagnostics, *self.extracted_scripts.diagnostics]
        root = self.options.root
        diagnostics = [*diagnostics_of(root, new_course, diagnostics, self.documents, runs)]
        diagnostics += [*refusals, *failures, *figure_failures]
        diagnostics += check_recorded_runs(self.scripts, self.options)
        told_paths = {d.span.path for d in diagnostics if d.rule == "output-not-updatable"}
        diagnostics += [
            d
            for d in self._diagnose_updated(new_course, runs)
            if d.rule not in _DRIFTS or not (self.dry_run or d.span.path in told_paths)
        ]
        record_remarks = [] if self.dry_run else self._write_records(new_course, runs)
        outdated = len(remarks) if self.dry_run else 0
        if not remarks and all(not d.is_error for d in diagnostics):
            remarks = ["every recorded output is up to date"]
        remarks += record_remarks
        verdicts = [v for v in compare_all(new_course, runs) if v.status == "verified"]
        asked_paths = {extraction.path for extraction in self.scripts}
        unasked_scripts = (
            e for e in self.extracted_scripts.extractions if e.path not in asked_paths
        )
        reason = "update runs what is recorded"
        scripts, labs = unasked_lines(self.course, unasked_scripts, self.documents, reason)
        report = judge(
            self.course,
            diagnostics,
            began,
            scripts=(*script_lines(self.scripts, runs, verdicts, self.course), *scripts),
            labs=labs,
            documents=self.documents,
            remarks=tuple(remarks),
        )
        return replace(report, outdated=outdated)

    # --- edits

    def _make_edits(self, runs: Sequence[ScriptRun]) -> tuple[list[Edit], list[Diagnostic]]:
        # Of paths that several scripts have, nobody knows whose output is recorded.
        repeated_paths = {
            d.span.text.strip("\"'")
            for d in self.extracted_scripts.diagnostics
            if d.rule == "script-repeated"
        }
        good_paths = {run.path for run in runs if run.outcome is Outcome.OK} - repeated_paths
        outputs = self._outputs(self.course, runs)
        documents = self._chosen_documents(self.course)
        verdicts = [
            verdict
            for document in documents
            for verdict in outputs.of_document(document)
            if verdict.recording.script in good_paths and verdict.recording.readable
        ]
        edits = update_outputs(verdicts, documents, outputs, self.addresses)
        reworded = reworded_addresses(self.addresses, verdicts, outputs)
        self.addresses |= reworded
        self.reworded |= {value.path for value in reworded}
        return edits

    def _outputs(self, course: Course, runs: Sequence[ScriptRun]) -> PrintedOutputs:
        paths = (e.path for e in self.extracted_scripts.extractions)
        return PrintedOutputs(compare_all(course, runs, self.addresses), runs, paths)

    def _chosen_documents(self, course: Course, further: Collection[str] = ()) -> list[Document]:
        return [
            document
            for _, document in course.shown_texts
            if self.documents is None or document.source.path in {*self.documents, *further}
        ]

    def _write(self, edits: Iterable[Edit]) -> tuple[list[str], list[Diagnostic]]:
        """Make these edits, and those of parts of files, where a text is what its file holds."""
        root, verb = self.options.root, "would update" if self.dry_run else "updated"
        remarks: list[str] = []
        failures: list[Diagnostic] = []
        doubtful_paths = {d.span.path for d in self.diagnostics if d.rule in DOUBTFUL}
        parts = [d for d in self.diagnostics if d.rule == "source-part"]
        stale = [d for d in parts if self.documents is None or d.span.path in self.documents]
        all_edits = [*edits, *(edit for d in stale for edit in d.edits)]
        all_edits = [edit for edit in all_edits if edit.span.path not in doubtful_paths]
        for source, new in edited_texts(all_edits).items():
            try:
                if self.dry_run:
                    check_writable(root, source.path)
                else:
                    write_atomic(root, source.path, new.encode(), expected=source.text.encode())
            except EffectError as error:
                spans = (edit.span for edit in all_edits if edit.span.source is source)
                span = min(spans, key=lambda span: span.start)
                failures.append(
                    diagnose("output-not-updatable", span, error.message, help=error.help)
                )
            else:
                remarks.append(changed_text(verb, source, new))
        return remarks, failures

    # --- the lessons as they are then

    def _write_records(self, new_course: Course, runs: Sequence[ScriptRun]) -> list[str]:
        """Write what the lessons were recorded with, and where values stand, beside them."""
        documents = self._chosen_documents(new_course, self.reworded)
        outputs, root = self._outputs(new_course, runs), self.options.root
        changes = write_records(new_course, documents, outputs, self.addresses, root)
        return [f"{'wrote' if change.new else 'removed'} {change.path}" for change in changes]

    def _diagnose_updated(self, new_course: Course, runs: Sequence[ScriptRun]) -> list[Diagnostic]:
        paths = {extraction.path for extraction in self.scripts}
        # What was written above a script has moved it.
        extractions = [e for e in extract_course(new_course).value if e.path in paths]
        if new_course is not self.course:
            # The addresses of numbers that were written anew
            before, now = self._outputs(self.course, runs), self._outputs(new_course, runs)
            new_documents = {d.source.path: d for d in self._chosen_documents(new_course)}
            for document in self._chosen_documents(self.course):
                if (new_document := new_documents.get(document.source.path)) is not None:
                    old, new = document_values(document, before), document_values(new_document, now)
                    self.addresses |= carried_addresses(self.addresses, old, new)
        chosen_paths = {document.source.path for document in self._chosen_documents(new_course)}
        chosen_documents = [p for p in new_course.shown_texts if p[1].source.path in chosen_paths]
        verdicts = compare_all(new_course, runs, self.addresses)
        return [
            *script_findings(
                new_course,
                chosen_documents,
                extractions,
                runs,
                [v for v in verdicts if v.recording.script in paths],
                self.addresses,
                find_module=functools.partial(find_module, self.options.root),
            ),
            *figure_findings(
                new_course,
                runs,
                functools.partial(read_recorded, self.options.root),
                functools.partial(keep_prepared, self.options.store),
            ),
        ]


def changed_text(verb: str, source: Source, new: str) -> str:
    """Make a remark that says which file was changed, and how."""
    diff = difflib.unified_diff(
        source.text.splitlines(), new.splitlines(), source.path, source.path, n=1, lineterm=""
    )
    return "\n".join([f"{verb} {source.path}", *diff])


# --- extract


def extract(options: Options, *, adopt: bool = False) -> Report:
    """Extract; with `adopt` the lessons take over what was edited by hand in `examples/`."""
    with project_lock(options.root, options.progress.say):
        began = time.monotonic()
        parsed_course = load(options.root, code="run before")
        course = parsed_course.value
        if course is None:
            return judge(None, parsed_course.diagnostics, began)
        extracted_scripts = extract_scripts(course, options)
        remarks = _list_changes(extracted_scripts)
        refusals: list[Diagnostic] = []
        if adopt and extracted_scripts.files.blocked:
            adoptions, refusals, files_read = _adopt(options, extracted_scripts)
            if files_read:
                parsed_course = load(options.root, code="run before")
                course = parsed_course.value or course
                # A block holds no line ends of an editor's and no blank lines at the end, and one
                # parts it from the next: a file that differs would count as edited for ever.
                for extraction in extract_course(course).value:
                    path, data = extraction.path, extraction.data
                    old = files_read.get(path, data)
                    if old != data and _has_code(old, extraction.text):
                        write_atomic(options.root, path, data, expected=old, durable=False)
                extracted_scripts = extract_scripts(course, options)
            remarks += [*adoptions, *_list_changes(extracted_scripts)]
        diagnostics = [*parsed_course.diagnostics, *extracted_scripts.diagnostics, *refusals]
        if not remarks and all(not d.is_error for d in diagnostics):
            remarks.append("every script is extracted already")
        scripts, labs = unasked_lines(
            course, extracted_scripts.extractions, None, "extract runs nothing"
        )
        return judge(course, diagnostics, began, scripts=scripts, labs=labs, remarks=tuple(remarks))


def unasked_lines(
    course: Course,
    extractions: Iterable[Extraction],
    documents: Collection[str] | None,
    reason: str,
) -> tuple[tuple[ScriptLine, ...], tuple[TrialLine, ...]]:
    """The lines of what a command was not asked to run in these documents, or in all."""
    paths = {document.source.path for document in course.documents}
    paths &= paths if documents is None else {*documents}
    scripts = (
        ScriptLine(e.path, e.owner, UNASKED, 0.0, False, reasons=(reason,))
        for e in extractions
        if e.document in paths
    )
    labs = (
        TrialLine(trial.name, "", trial.owner, UNASKED, untried=reason)
        for _, trial in feature_trials(course).values()
        if trial.block.span.path in paths
    )
    return tuple(scripts), tuple(labs)


def _list_changes(extracted_scripts: ExtractedScripts) -> list[str]:
    removals = (
        f"removed {path}, which no lesson has now" for path in extracted_scripts.files.removed
    )
    return [*(f"wrote {path}" for path in extracted_scripts.files.written), *removals]


def _has_code(data: bytes, code: str) -> bool:
    """Whether a file holds this code, whatever its line ends and empty lines are."""
    texts = (block_text(data) or "", code)
    lines, code_lines = ([line for line in text.split("\n") if line] for text in texts)
    return lines == code_lines


def _adopt(
    options: Options, extracted_scripts: ExtractedScripts
) -> tuple[list[str], list[Diagnostic], dict[str, bytes]]:
    """Write the edited files into their lessons' blocks; also return what these files held."""
    by_path = {e.path: e for e in extracted_scripts.extractions}
    edits: list[Edit] = []
    refusals: list[Diagnostic] = []
    files_read: dict[str, bytes] = {}
    for example in extracted_scripts.files.blocked:
        extraction = by_path.get(example.path)
        if extraction is None or example.obstacle not in (Obstacle.EDITED, Obstacle.FOREIGN):
            continue
        data = read_bytes(options.root, example.path)
        if example.diverged and not _has_code(data, extraction.text):
            continue  # taking one would lose the other; the diagnostic says how to go on
        adoption = adopt_file(extraction.script, data)
        if isinstance(adoption, Diagnostic):
            refusals.append(adoption)
        else:
            edits += adoption
            files_read[example.path] = data
    remarks: list[str] = []
    texts = edited_texts(edits)
    for source in texts:  # all or none
        check_writable(options.root, source.path)
    for source, new in texts.items():
        write_atomic(options.root, source.path, new.encode(), expected=source.text.encode())
        remarks.append(changed_text("updated", source, new))
    return remarks, refusals, files_read
