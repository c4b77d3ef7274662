"""What an open page is told beside its text, and what its author may accept there.

Entry points: `page_news(session, path)`, as JSON; `accept(session, path, id)`.

1. Every mistake of the course: first those that keep the page as it was, then others of its
   document. Each says whether the page shows it in its place.
2. For each script of the page how it did, for each recorded output or figure that differs the two
   side by side, and for each bound number what would be right.
3. What is offered has an id made from what the file holds and would hold. It is written only as
   long as both are still the same: nothing is ever written that was not seen.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from msgspec import Struct

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model import (
    Course,
    Document,
    NumberBinding,
    Recording,
    Script,
    document_blocks,
)
from coursebuild.core.model.figures import RecordedFigure, recorded_figures
from coursebuild.core.model.results import Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.bindings import document_bindings
from coursebuild.core.scripts.diff import DiffRow, diff_rows
from coursebuild.core.scripts.edit import apply_edits, updated_body
from coursebuild.core.scripts.figures import difference, drawn_file
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Severity
from coursebuild.core.text.source import Span
from coursebuild.pipeline.figures import read_recorded
from coursebuild.pipeline.judge import judge
from coursebuild.preview.session import Session
from coursebuild.report import Report
from coursebuild.report.text import location

_MOST = 60
"""Mistakes that a page is told of."""
_IN_PLACE = ("output-drift", "binding-mismatch", "figure-drift")
"""Rules whose mistakes a page shows where they are."""
_IMAGES = {"svg": "image/svg+xml", "png": "image/png"}


class Offer(Struct, frozen=True):
    """What a file of the course would hold instead."""

    path: str
    old: bytes | None
    new: bytes

    @classmethod
    def of(cls, edit: Edit) -> Offer:
        """A lesson with an edit."""
        source = edit.span.source
        new = apply_edits(source.text, [edit])
        return cls(source.path, source.text.encode(), new.encode())

    @property
    def id(self) -> str:
        """By which it is accepted."""
        digest = hashlib.sha256(self.path.encode())
        for data in (self.old or b"", self.new):
            digest.update(b"%d:" % len(data) + data)
        return digest.hexdigest()[:24]


def report_now(session: Session) -> Report:
    """Everything that is wrong, as a report."""
    return judge(session.course, session.diagnostics())


def page_news(session: Session, path: str) -> str:
    """What the page at a site path is told."""
    with session.changed:
        document = session.files.document(path)
        report = report_now(session)
        blocking, own = session.blocking(path), "" if document is None else document.source.path

        def rank(d: Diagnostic) -> tuple[bool, ...]:
            return d not in blocking, d.severity is not Severity.ERROR, d.span.path != own

        found = sorted(report.diagnostics, key=rank)[:_MOST]
        news: dict[str, Any] = {
            "problems": [{**_problem(d, own), "blocks": d in blocking} for d in found],
            "more": max(0, len(report.diagnostics) - _MOST),
            "kept": session.files.is_kept(path),
            "busy": session.busy,
            "trouble": session.trouble,
            "scripts": [],
            "outputs": [],
            "figures": [],
            "numbers": [],
        }
        if document is not None and session.course is not None:
            news["scripts"] = list(_scripts(session, document))
            news["outputs"] = list(_outputs(session, session.course, document))
            news["figures"] = list(_figures(session, document))
            news["numbers"] = list(_numbers(document, report.diagnostics))
        return json.dumps(news, ensure_ascii=False, separators=(",", ":"))


# --- mistakes


def _problem(diagnostic: Diagnostic, own: str) -> dict[str, Any]:
    """A mistake on the page of a document with this path."""
    span = diagnostic.span
    line = span.source.line_text(span.line)
    end = len(line) if span.end_line > span.line else span.end_column - 1
    return {
        "severity": diagnostic.severity.value,
        "rule": diagnostic.rule,
        "place": location(span),
        "message": diagnostic.message,
        "label": diagnostic.label,
        "help": diagnostic.help,
        "notes": [_note(note.message, note.span) for note in diagnostic.notes],
        "line": line,
        "start": span.column - 1,
        "end": max(end, span.column - 1),
        "inPlace": span.path == own and diagnostic.rule in _IN_PLACE,
    }


def _note(message: str, span: Span | None) -> str:
    return message if span is None else f"{location(span)}: {message}"


# --- scripts and outputs


def _scripts(session: Session, document: Document) -> Iterator[dict[str, str]]:
    assert session.library is not None
    for script in (b for b in document_blocks(document) if isinstance(b, Script)):
        run = session.library.runs.get(script.path)
        yield {"path": script.path, "state": _state(run)}


def _state(run: ScriptRun | None) -> str:
    return "running" if run is None else run.outcome.value


def _outputs(session: Session, course: Course, document: Document) -> Iterator[dict[str, Any]]:
    """The recorded outputs, each with its number among those of its script on the page."""
    assert session.library is not None
    numbers: Counter[str] = Counter()
    for recording in (b for b in document_blocks(document) if isinstance(b, Recording)):
        if recording.script is None:
            continue
        nth = numbers[recording.script]
        numbers[recording.script] += 1
        verdict = session.library.verdict(recording)
        run = session.library.runs.get(recording.script)
        told: dict[str, Any] = {"script": recording.script, "nth": nth, "state": "unchecked"}
        if run is None:
            told["state"] = "running"
        elif run.outcome is not Outcome.OK:
            told["state"] = run.outcome.value
        elif verdict is not None:
            told["state"] = verdict.status
            if verdict.status == "drift":
                told |= _drift(session, course, verdict, run)
        yield told


def _drift(session: Session, course: Course, verdict: Verdict, run: ScriptRun) -> dict[str, Any]:
    rows = diff_rows(verdict.recording, verdict, course.filters, run.stdout)
    offered = new_output(session, course, verdict, run)
    told: dict[str, Any] = {"rows": [_row(row) for row in rows], "offer": None, "refused": ""}
    if isinstance(offered, Edit):
        told["offer"] = Offer.of(offered).id
    elif offered is not None:
        told["refused"] = offered.message
    return told


def _row(row: DiffRow) -> list[Any]:
    return [row.mark, [[piece.text, piece.changed] for piece in row.pieces]]


def new_output(
    session: Session, course: Course, verdict: Verdict, run: ScriptRun
) -> Edit | Diagnostic | None:
    """What `coursebuild update` would write; nothing as long as the script was run only once."""
    again = session.printed_again(run.path)
    if again is None:
        return None
    filters = course.filters
    return updated_body(verdict.recording, verdict.comparison, filters, run.stdout, again)


# --- figures


def _figures(session: Session, document: Document) -> Iterator[dict[str, Any]]:
    """The figures of which scripts draw another now; of data there is no image."""
    for figure, offer in _drawn(session, document):
        kind = _IMAGES.get(figure.name.rpartition(".")[2])
        image = f"data:{kind};base64,{base64.b64encode(offer.new).decode()}"
        yield {
            "name": figure.name,
            "differs": _differs(figure, offer),
            "drawn": image if kind else "",
            "offer": offer.id,
        }


def _drawn(session: Session, document: Document) -> Iterator[tuple[RecordedFigure, Offer]]:
    """The figures of which scripts draw another now, and what that is."""
    assert session.library is not None
    wrong = {d.span for d in session.diagnostics() if d.rule == "figure-drift"}
    for figure in recorded_figures(document):
        run = session.library.runs.get(figure.script)
        data = dict(run.figures).get(figure.name) if run is not None else None
        drawn = drawn_file(figure.name, data) if data is not None else ""
        if figure.span in wrong and isinstance(drawn, bytes):
            offer = Offer(figure.path, read_recorded(session.root, figure.path), drawn)
            if _differs(figure, offer):
                yield figure, offer


def _differs(figure: RecordedFigure, offer: Offer) -> str:
    """How a drawing differs from the recorded one, in words; empty where it does not."""
    if offer.old is None:
        return "nothing is recorded yet"
    return difference(figure.name, offer.old, offer.new)


# --- bound numbers


def _numbers(document: Document, found: Iterable[Diagnostic]) -> Iterator[dict[str, Any]]:
    """The bound numbers that do not hold, each with its number among those of the same text."""
    wrong = {
        (d.span.start, d.span.end): d
        for d in found
        if d.rule == "binding-mismatch" and d.span.source.text == document.source.text
    }
    numbers: Counter[str] = Counter()
    for binding in document_bindings(document):
        nth = numbers[binding.text]
        numbers[binding.text] += 1
        told = wrong.get((binding.text_span.start, binding.text_span.end))
        if told is not None:
            yield _number(binding, nth, told)


def _number(binding: NumberBinding, nth: int, told: Diagnostic) -> dict[str, Any]:
    edit = next(iter(told.edits), None)
    return {
        "text": binding.text,
        "nth": nth,
        "message": told.message,
        "label": told.label,
        "better": "" if edit is None else edit.text,
        "offer": None if edit is None else Offer.of(edit).id,
    }


# --- accepting


def accept(session: Session, path: str, id: str) -> str:
    """Write what is offered on a page under this id; gives why not, or nothing.

    The lock is held, so that two browsers cannot accept the same at once.
    """
    with session.changed:
        offer = next((offer for offer in _offers(session, path) if offer.id == id), None)
        if offer is None:
            return "this is no longer what the page offers; look at it again"
        try:
            write_atomic(session.root, offer.path, offer.new, expected=offer.old)
        except EffectError as error:
            return error.message
        return ""


def _offers(session: Session, path: str) -> Iterator[Offer]:
    """What may be accepted on a page."""
    document, course, library = session.files.document(path), session.course, session.library
    if document is None or course is None or library is None:
        return
    for recording in (b for b in document_blocks(document) if isinstance(b, Recording)):
        verdict, run = library.verdict(recording), library.runs.get(recording.script or "")
        if verdict is not None and verdict.status == "drift" and run is not None:
            edit = new_output(session, course, verdict, run)
            if isinstance(edit, Edit):
                yield Offer.of(edit)
    for _, offer in _drawn(session, document):
        yield offer
    for diagnostic in session.diagnostics():
        if diagnostic.rule == "binding-mismatch" and diagnostic.span.path == document.source.path:
            yield from map(Offer.of, diagnostic.edits)
