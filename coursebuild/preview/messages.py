"""Messages for an open page: what is wrong, and what its author may accept there.

An offer's id is made from what the file holds and what it would hold. It is accepted only as long
as both are unchanged: nothing is ever written that the author has not seen.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from operator import attrgetter
from typing import Any

from msgspec import Struct

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.write import FileChange, change_files
from coursebuild.core.model import (
    Course,
    Document,
    Recording,
    document_scripts,
    find_blocks,
    output_numbers,
)
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.lesson_record import Addresses, LessonRecord
from coursebuild.core.model.results import ScriptRun, Verdict
from coursebuild.core.pages.library import Library
from coursebuild.core.scripts.bindings import check_bindings, update_outputs
from coursebuild.core.scripts.bound_places import (
    carried_addresses,
    document_bindings,
    document_values,
    reworded_addresses,
)
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.diff import diff_rows
from coursebuild.core.scripts.edit import apply_edits, edited_texts
from coursebuild.core.scripts.figures import figure_difference, prepare_figure
from coursebuild.core.scripts.findings import find_instability
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Source
from coursebuild.pipeline.check import judge
from coursebuild.pipeline.fix import may_edit
from coursebuild.pipeline.recordings import read_recorded
from coursebuild.pipeline.records import record_changes
from coursebuild.preview.session import Session, is_marked
from coursebuild.report import Report
from coursebuild.report.text import location

_MAX_DIAGNOSTICS = 60
"""The most mistakes that are sent to a page."""
_IMAGES = {"svg": "image/svg+xml", "png": "image/png"}


class Offer(Struct, frozen=True):
    """A proposed change of a file of the course."""

    path: str
    old: bytes | None
    new: bytes
    edits: tuple[Edit, ...] = ()
    """Those of a text, which may be made together with others."""

    @classmethod
    def of(cls, *edits: Edit) -> Offer:
        """The offer of edits, of which those of the first one's text are shown."""
        source = edits[0].span.source
        new = apply_edits(source.text, (edit for edit in edits if edit.span.source == source))
        return cls(source.path, source.text.encode(), new.encode(), edits)

    @property
    def id(self) -> str:
        """The id by which it is accepted."""
        digest = hashlib.sha256(self.path.encode())
        elsewhere = [
            f"{edit.span.path}:{edit.span.start}:{edit.text}".encode()
            for edit in self.edits
            if edit.span.path != self.path
        ]
        for data in (self.old or b"", self.new, *elsewhere):
            digest.update(b"%d:" % len(data) + data)
        return digest.hexdigest()[:24]


def printed_outputs(library: Library) -> PrintedOutputs:
    """What the scripts of a course have printed, as far as they have run."""
    return PrintedOutputs(library.results.verdicts, library.results.runs, library.scripts)


def report_now(session: Session) -> Report:
    """Return everything that is wrong, as a report."""
    scripts, labs = session.runs.script_lines, session.runs.trial_lines
    return judge(session.course, session.diagnostics(), scripts=scripts, labs=labs)


def page_news(session: Session, path: str) -> str:
    """Return the messages for the page at a site path, with offers as their ids."""
    with session.condition:
        news = _collect_news(session, path)
        id = attrgetter("id")
        return json.dumps(news, default=id, ensure_ascii=False, separators=(",", ":"))


def accept(session: Session, path: str, ids: str) -> str:
    """Write what is offered on a page under these ids; return why that failed, or an empty text.

    With spaces between them there may be several, of which all or none are still offered.
    `coursebuild undo` takes them back together.
    """
    with session.condition:
        news = _collect_news(session, path)
        parts = (*news["outputs"], *news["figures"], *news["numbers"], *news["problems"])
        parts += tuple(choice for part in news["problems"] for choice in part["choices"])
        offers = {part["offer"].id: part["offer"] for part in parts if part.get("offer")}
        accepted_offers = [offers[id] for id in ids.split() if id in offers]
        if not accepted_offers or len(accepted_offers) < len(ids.split()):
            return "this is no longer what the page offers; look at it again"
        edits = [edit for offer in accepted_offers for edit in offer.edits]
        drawings = [FileChange(o.path, o.old, o.new) for o in accepted_offers if not o.edits]
        changes = changes_of(session, edits, drawings)
    try:  # if two browsers accept the same at once, the second one meets another text
        change_files(session.root, changes, keep=True, beside_commands=True)
    except EffectError as error:
        return error.message
    return ""


def changes_of(
    session: Session, edits: Collection[Edit], drawings: Iterable[FileChange] = ()
) -> list[FileChange]:
    """The changes of files by what is accepted, and of those that say what it was recorded with."""
    # Two outputs may offer the same number.
    changes = [FileChange.of(*change) for change in edited_texts(edits).items()]
    changes += drawings
    with session.condition:
        addresses = dict(session.runs.addresses)
        reworded = _reword_addresses(session, edits, addresses)
        changes += _change_records(session, changes, reworded, addresses)
        session.runs.addresses = addresses
    return changes


def _reword_addresses(session: Session, edits: Iterable[Edit], addresses: Addresses) -> set[str]:
    """Change addresses that the outputs which these edits record call otherwise; return lessons."""
    library = session.library
    if library is None:
        return set()
    places = [edit.span for edit in edits]
    recorded = [
        verdict
        for verdict in library.results.verdicts
        for span in [verdict.recording.span]
        if any(at.path == span.path and span.start <= at.start < span.end for at in places)
    ]
    reworded = reworded_addresses(addresses, recorded, printed_outputs(library))
    addresses |= reworded
    return {value.path for value in reworded}


def _change_records(
    session: Session,
    changes: Iterable[FileChange],
    reworded: Collection[str],
    addresses: Addresses,
) -> Iterator[FileChange]:
    """Change the records of lessons in which these changes record something, and of `reworded`."""
    library = session.library
    new_files = {change.path: change.new for change in changes}
    for owner, document in () if library is None else library.course.owned_documents:
        figures = {figure.path for figure in recorded_figures(document)}
        path = document.source.path
        new_text = new_files.get(path)
        if library is None or not ({*new_files, *reworded} & {path, *figures}):
            continue
        new_document = document
        if new_text is not None:
            new_document = session.parse(owner, Source(path, new_text.decode())).value

        def read(path: str) -> bytes | None:
            return new_files[path] if path in new_files else read_recorded(session.root, path)

        course, results = library.course, library.results
        verdicts = [v for v in results.verdicts if v.recording.span.path != path]
        verdicts += verify(course, results.runs, addresses, [new_document])
        outputs = PrintedOutputs(verdicts, results.runs, library.scripts)
        values = (
            document_values(document, printed_outputs(library)),
            document_values(new_document, outputs),
        )
        addresses |= carried_addresses(addresses, *values)
        check_bindings(new_document, outputs, addresses)
        yield from record_changes(course, [new_document], outputs, addresses, session.root, read)


def _collect_news(session: Session, path: str) -> dict[str, Any]:
    document, library = session.files.document(path), session.library
    report = report_now(session)
    marks = {at for at, _ in session.mistakes(document)} if document is not None else set()
    document_path = "" if document is None else document.source.path

    def rank(d: Diagnostic) -> tuple[bool, ...]:
        return d.span.path != document_path, not d.is_error

    diagnostics = sorted(report.diagnostics, key=rank)[:_MAX_DIAGNOSTICS]
    news: dict[str, Any] = {
        "problems": [_describe_mistake(session, d, document, marks) for d in diagnostics],
        "hints": [
            _describe_mistake(session, d, document, marks)
            for d in report.hints
            if d.span.path == document_path
        ],
        "more": max(0, len(report.diagnostics) - _MAX_DIAGNOSTICS),
        "busy": session.busy,
        "trouble": session.trouble,
        "running": [
            {"path": path, "began": round(began, 1), "last": last}
            for path, (began, last) in sorted(session.runs.running.items())
        ],
        "scripts": [],
        "outputs": [],
        "figures": [],
        "numbers": [],
    }
    course = session.course
    if document is not None and library is not None and course is not None:
        news["scripts"] = [
            {"path": script.path, "state": _state(library.runs.get(script.path))}
            for script in document_scripts(document)
        ]
        news["outputs"] = list(_outputs(session, library, course, document))
        news["figures"] = list(_figures(session, library, document))
        news["numbers"] = list(_numbers(document, report.diagnostics))
    return news


# --- mistakes


def _describe_mistake(
    session: Session, diagnostic: Diagnostic, document: Document | None, marks: Collection[int]
) -> dict[str, Any]:
    span, offer = diagnostic.span, {}
    if len({edit.span.source for edit in diagnostic.edits}) == 1:
        first = min(diagnostic.edits, key=lambda edit: edit.span.start)
        if may_edit(session.root, first.span.path):
            offered = Offer.of(*diagnostic.edits)
            fixed = Source(offered.path, offered.new.decode()).line_text(first.span.line)
            offer = {"offer": offered, "fixed": fixed}
    is_here = document is not None and span.path == document.source.path
    is_in_text = document is not None and is_marked(diagnostic, document)
    has_mark = is_in_text and span.start in marks
    line = span.source.line_text(span.line)
    end = len(line) if span.end_line > span.line else span.end_column - 1
    choices = [
        {"text": note.message, "offer": Offer.of(*note.edits)}
        for note in diagnostic.notes
        if note.edits and may_edit(session.root, note.edits[0].span.path)
    ]
    return {
        "severity": diagnostic.severity,
        "rule": diagnostic.rule,
        "place": location(span),
        "message": diagnostic.message,
        "label": diagnostic.label,
        "help": diagnostic.help,
        "notes": [
            (note.message if note.span is None else f"{location(note.span)}: {note.message}")
            for note in diagnostic.notes
            if not note.edits
        ],
        "line": line,
        "start": span.column - 1,
        "end": max(end, span.column - 1),
        "here": is_here,
        "mark": f"mistake:{span.start}" if has_mark else "",
        "choices": choices,
        **offer,
    }


# --- scripts and outputs


def _state(run: ScriptRun | None) -> str:
    return "running" if run is None else run.outcome.value


def _outputs(
    session: Session, library: Library, course: Course, document: Document
) -> Iterator[dict[str, Any]]:
    """Describe recorded outputs, each with its number among those of its script on the page."""
    numbers = output_numbers(document)
    for recording in find_blocks(document, Recording):
        if recording.script is None:
            continue
        script, verdict = recording.script, library.verdict(recording)
        nth = numbers[recording.span.start] - 1
        output = {"script": script, "nth": nth, "state": "unchecked"}
        if (state := _state(library.runs.get(script))) != "ok":
            output["state"] = state
        elif verdict is not None:
            output["state"] = verdict.status
            if verdict.status == "drift":
                run = library.runs[verdict.recording.script or ""]
                edits = new_output(session, library, course, verdict)
                output |= {
                    "rows": diff_rows(verdict, run.output_of(recording.part)),
                    "offer": Offer.of(*edits) if isinstance(edits, tuple) and edits else None,
                    "refused": edits.message if isinstance(edits, Diagnostic) else "",
                }
        yield output


def new_output(
    session: Session, library: Library, course: Course, verdict: Verdict
) -> tuple[Edit, ...] | Diagnostic:
    """Make the edits that `coursebuild update` would, unless another run printed something else.

    The first is of the output, the others of numbers that are bound to it.
    """
    run = library.runs[verdict.recording.script or ""]
    unstable_output = find_instability(verdict, run, session.runs.other_runs())
    if unstable_output is not None:
        return unstable_output
    documents, addresses = [d for _, d in course.shown_texts], dict(session.runs.addresses)
    edits, refusals = update_outputs([verdict], documents, printed_outputs(library), addresses)
    return refusals[0] if refusals else tuple(edits)


# --- figures


def _figures(session: Session, library: Library, document: Document) -> Iterator[dict[str, Any]]:
    """Describe figures that scripts now draw differently; there is no image of data."""
    drifted_spans = {d.span for d in session.diagnostics() if d.rule == "figure-drift"}
    for figure in recorded_figures(document):
        run = library.runs.get(figure.script)
        data = dict(run.figures).get(figure.name) if run is not None else None
        drawing = prepare_figure(figure.name, data) if data is not None else ""
        old = read_recorded(session.root, figure.path)
        record = library.course.records.get(document.source.path, LessonRecord())
        if run is None or figure.span not in drifted_spans or isinstance(drawing, str):
            continue
        differs = "nothing is recorded yet"
        if old is not None:
            change, differs = figure_difference(figure, run, old, drawing, record)
            differs += f" ({change})" if change and differs else ""
        if differs:
            kind = _IMAGES.get(figure.name.rpartition(".")[2])
            image = f"data:{kind};base64,{base64.b64encode(drawing).decode()}"
            yield {
                "name": figure.name,
                "differs": differs,
                "drawn": image if kind else "",
                "offer": Offer(figure.path, old, drawing),
            }


# --- bound numbers


def _numbers(document: Document, diagnostics: Iterable[Diagnostic]) -> Iterator[dict[str, Any]]:
    """Describe bound numbers that do not hold, each with its number among those of its text."""
    mismatches = {
        (d.span.start, d.span.end): d
        for d in diagnostics
        if d.rule == "binding-mismatch" and d.span.source.text == document.source.text
    }
    numbers: Counter[str] = Counter()
    for binding in document_bindings(document):
        nth = numbers[binding.text]
        numbers[binding.text] += 1
        mistake = mismatches.get((binding.text_span.start, binding.text_span.end))
        if mistake is not None:
            edit = next(iter(mistake.edits), None)
            yield {
                "text": binding.text,
                "nth": nth,
                "message": mistake.message,
                "label": mistake.label,
                "better": "" if edit is None else edit.text,
                "offer": None if edit is None else Offer.of(edit),
            }
