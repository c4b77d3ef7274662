"""Figures of scripts, recorded in files of the course, and other drawings there.

Entry points: `read_recorded`, `write_figures`, `check_drawings`.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from coursebuild.core.drawing.safe_svg import read_svg
from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model import Course
from coursebuild.core.model.addresses import RecordedFigure, recorded_figures
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.figures import SVG_HELP, describe_difference, prepare_figure
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Source
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


def check_drawings(course: Course, options: Options) -> Iterator[Diagnostic]:
    """Judge the files in SVG, which are published as they are."""
    if course.html == "trusted":
        return
    for path in course.files:
        if path.lower().endswith((".svg", ".svgz")):
            data = read_recorded(options.root, path) or b""
            key = step_key("drawing", hashlib.sha256(data).hexdigest())
            fault = options.store.get_or_create("drawings", key, functools.partial(_fault, data))
            if fault:
                message = f"`{path}` {fault.decode()}"
                help = f'{SVG_HELP}, unless the map says `html = "trusted"`'
                place = Source(path, "").span(0, 0)
                yield diagnose("image-forbidden", place, message, help=help)


def _fault(data: bytes) -> bytes:
    """Why a drawing must not be published, in words; empty where it may."""
    drawing = read_svg(data)
    return drawing.encode() if isinstance(drawing, str) else b""
