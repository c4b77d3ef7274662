"""`coursebuild extract`: write the scripts to `examples/`, or bring edits made there back.

Entry point: `extract(options, adopt=…)`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from coursebuild.core.files.examples import Obstacle
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import check_writable, write_atomic
from coursebuild.core.model import Course
from coursebuild.core.scripts.edit import adopt_file, apply_edits, block_text
from coursebuild.core.scripts.extract import extract as extract_course
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Source
from coursebuild.pipeline.judge import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scripts import ExtractedScripts, extract_scripts
from coursebuild.pipeline.update import changed_text
from coursebuild.report import Report


def extract(options: Options, *, adopt: bool = False) -> Report:
    """Extract; with `adopt` the lessons take over what was edited by hand in `examples/`."""
    with project_lock(options.root, Progress(quiet=options.quiet).say):
        return _extract(options, adopt=adopt)


def _extract(options: Options, *, adopt: bool) -> Report:
    began = time.monotonic()
    loaded = load(options.root)
    course = loaded.value
    if course is None:
        return judge(None, loaded.diagnostics, began)
    extracted = extract_scripts(course, options)
    remarks = _remarks(extracted)
    refused: list[Diagnostic] = []
    if adopt and extracted.blocked:
        adoptions, refused, read = _adopt(options, extracted)
        if read:
            loaded = load(options.root)
            course = loaded.value or course
            _write_as_extracted(options, course, read)
            extracted = extract_scripts(course, options)
        remarks += [*adoptions, *_remarks(extracted)]
    found = [*loaded.diagnostics, *extracted.diagnostics, *refused]
    if not remarks and all(not d.is_error for d in found):
        remarks.append("every script is extracted already")
    return judge(course, found, began, remarks=tuple(remarks))


def _remarks(extracted: ExtractedScripts) -> list[str]:
    removed = (f"removed {path}, which no lesson has any more" for path in extracted.removed)
    return [*(f"wrote {path}" for path in extracted.written), *removed]


def _adopt(
    options: Options, extracted: ExtractedScripts
) -> tuple[list[str], list[Diagnostic], dict[str, bytes]]:
    """Write the edited files into their lessons' blocks; also gives what was in these files."""
    by_path = {e.path: e for e in extracted.all}
    edits: dict[Source, list[Edit]] = {}
    refused: list[Diagnostic] = []
    read: dict[str, bytes] = {}
    for example in extracted.blocked:
        extraction = by_path.get(example.path)
        if extraction is None or example.obstacle not in (Obstacle.EDITED, Obstacle.FOREIGN):
            continue
        data = read_bytes(options.root, example.path)
        if example.diverged and block_text(data) != extraction.text:
            continue  # taking one would lose the other; how to go on is told with it
        made = adopt_file(extraction.script, data)
        if isinstance(made, Edit):
            edits.setdefault(made.span.source, []).append(made)
            read[example.path] = data
        else:
            refused.append(made)
    remarks: list[str] = []
    for source in edits:  # all or none
        check_writable(options.root, source.path)
    for source, changes in edits.items():
        new = apply_edits(source.text, changes)
        if new != source.text:
            write_atomic(options.root, source.path, new.encode(), expected=source.text.encode())
            remarks.append(changed_text("updated", source, new))
    return remarks, refused, read


def _write_as_extracted(options: Options, course: Course, read: Mapping[str, bytes]) -> None:
    """Make each adopted file what its block extracts to now.

    An editor's line ends or blank lines at the end are nothing that a block holds; without this the
    file would count as edited for ever.
    """
    for extraction in extract_course(course).value:
        data = read.get(extraction.path, extraction.data)
        if data != extraction.data and block_text(data) == extraction.text:
            write_atomic(
                options.root, extraction.path, extraction.data, expected=data, durable=False
            )
