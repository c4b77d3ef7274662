"""Figures of scripts, recorded in files of the course.

Entry points: `read_recorded`, `write_figures`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model import Course
from coursebuild.core.model.figures import RecordedFigure, recorded_figures
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.figures import describe_difference, prepare_figure
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.pipeline.options import Options


def find_figures(course: Course, documents: Collection[str] | None) -> list[RecordedFigure]:
    """The figures of scripts in these documents, or in all."""
    return [
        figure
        for document in course.documents
        if documents is None or document.source.path in documents
        for figure in recorded_figures(document)
    ]


def read_recorded(root: Path, path: str) -> bytes | None:
    """A file of the course; `None` where there is none."""
    try:
        return read_bytes(root, path)
    except EffectError:
        return None


def write_figures(
    course: Course,
    documents: Collection[str] | None,
    runs: Sequence[ScriptRun],
    options: Options,
    *,
    dry_run: bool,
) -> tuple[list[str], list[Diagnostic]]:
    """Write the drawings that differ from the recorded ones; a remark for each, and failures."""
    by_path = {run.path: run for run in runs if run.outcome is Outcome.OK}
    remarks: list[str] = []
    failures: list[Diagnostic] = []
    for figure in find_figures(course, documents):
        run = by_path.get(figure.script)
        data = dict(run.figures).get(figure.name) if run is not None else None
        drawing = prepare_figure(figure.name, data) if data is not None else ""
        recorded = read_recorded(options.root, figure.path)
        if isinstance(drawing, str) or (
            recorded is not None and not describe_difference(figure.name, recorded, drawing)
        ):
            continue
        try:
            if not dry_run:
                write_atomic(options.root, figure.path, drawing, expected=recorded)
        except (EffectError, OSError) as error:
            failures.append(diagnose("output-not-updatable", figure.span, str(error)))
        else:
            remarks.append(f"{'would draw' if dry_run else 'drew'} {figure.path}")
    return remarks, failures
