"""`coursebuild extract`: write the scripts to `examples/`, or bring edits made there back.

Entry point: `extract(options, adopt=…)`.
"""

from __future__ import annotations

import time

from coursebuild.diagnostics import Diagnostic, Edit
from coursebuild.effects.examples import Obstacle
from coursebuild.effects.locks import project_lock
from coursebuild.effects.read import read_bytes
from coursebuild.effects.write import write_atomic
from coursebuild.pipeline.judge import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.verify import ExtractedScripts, extract_scripts
from coursebuild.report import Report
from coursebuild.scripts.adopt import adopted
from coursebuild.scripts.edit import apply_edits
from coursebuild.source import Source


def extract(options: Options, *, adopt: bool = False) -> Report:
    """Extract; with `adopt` the lessons take over what was edited by hand in `examples/`."""
    with project_lock(options.root, Progress(quiet=options.quiet).say):
        return _extract(options, adopt=adopt)


def _extract(options: Options, *, adopt: bool) -> Report:
    began = time.monotonic()
    loaded = load(options.root)
    course = loaded.course
    if course is None:
        return judge(None, loaded.diagnostics, (), time.monotonic() - began, lessons=0)
    extracted = extract_scripts(course, options)
    remarks: list[str] = []
    refused: list[Diagnostic] = []
    if adopt and extracted.blocked:
        adoptions, refused = _adopt(options, extracted)
        remarks += adoptions
        if adoptions:
            loaded = load(options.root)
            course = loaded.course or course
            extracted = extract_scripts(course, options)
    remarks += [f"wrote {path}" for path in extracted.written]
    remarks += [f"removed {path}, which no lesson has any more" for path in extracted.removed]
    if not remarks:
        remarks.append("every script is extracted already")
    found = [*loaded.diagnostics, *extracted.diagnostics, *refused]
    lessons = sum(lesson.document is not None for lesson in course.lessons)
    seconds = time.monotonic() - began
    return judge(course, found, (), seconds, lessons=lessons, remarks=tuple(remarks))


def _adopt(options: Options, extracted: ExtractedScripts) -> tuple[list[str], list[Diagnostic]]:
    """Write the edited files into their lessons' blocks."""
    by_path = {e.path: e for e in extracted.all}
    edits: dict[Source, list[Edit]] = {}
    remarks: list[str] = []
    refused: list[Diagnostic] = []
    for example in extracted.blocked:
        extraction = by_path.get(example.path)
        if extraction is None or example.obstacle not in (Obstacle.EDITED, Obstacle.FOREIGN):
            continue
        made = adopted(extraction.script, read_bytes(options.root, example.path))
        if isinstance(made, Edit):
            edits.setdefault(made.span.source, []).append(made)
            remarks.append(f"brought {example.path} into {extraction.document}")
        else:
            refused.append(made)
    for source, changes in edits.items():
        new = apply_edits(source.text, changes)
        write_atomic(options.root, source.path, new.encode(), expected=source.text.encode())
    return remarks, refused
