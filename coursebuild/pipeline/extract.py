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
from coursebuild.pipeline.scripts import ExtractedScripts, extract_scripts
from coursebuild.pipeline.update import changed_text
from coursebuild.report import Report


def extract(options: Options, *, adopt: bool = False) -> Report:
    """Extract; with `adopt` the lessons take over what was edited by hand in `examples/`."""
    with project_lock(options.root, options.progress.say):
        return _extract(options, adopt=adopt)


def _extract(options: Options, *, adopt: bool) -> Report:
    began = time.monotonic()
    parsed_course = load(options.root)
    course = parsed_course.value
    if course is None:
        return judge(None, parsed_course.diagnostics, began)
    extracted_scripts = extract_scripts(course, options)
    remarks = _list_changes(extracted_scripts)
    refusals: list[Diagnostic] = []
    if adopt and extracted_scripts.files.blocked:
        adoptions, refusals, files_read = _adopt(options, extracted_scripts)
        if files_read:
            parsed_course = load(options.root)
            course = parsed_course.value or course
            _write_as_extracted(options, course, files_read)
            extracted_scripts = extract_scripts(course, options)
        remarks += [*adoptions, *_list_changes(extracted_scripts)]
    diagnostics = [*parsed_course.diagnostics, *extracted_scripts.diagnostics, *refusals]
    if not remarks and all(not d.is_error for d in diagnostics):
        remarks.append("every script is extracted already")
    return judge(course, diagnostics, began, remarks=tuple(remarks))


def _list_changes(extracted_scripts: ExtractedScripts) -> list[str]:
    removals = (
        f"removed {path}, which no lesson has any more" for path in extracted_scripts.files.removed
    )
    return [*(f"wrote {path}" for path in extracted_scripts.files.written), *removals]


def _adopt(
    options: Options, extracted_scripts: ExtractedScripts
) -> tuple[list[str], list[Diagnostic], dict[str, bytes]]:
    """Write the edited files into their lessons' blocks; also return what these files held."""
    by_path = {e.path: e for e in extracted_scripts.extractions}
    edits: dict[Source, list[Edit]] = {}
    refusals: list[Diagnostic] = []
    files_read: dict[str, bytes] = {}
    for example in extracted_scripts.files.blocked:
        extraction = by_path.get(example.path)
        if extraction is None or example.obstacle not in (Obstacle.EDITED, Obstacle.FOREIGN):
            continue
        data = read_bytes(options.root, example.path)
        if example.diverged and block_text(data) != extraction.text:
            continue  # taking one would lose the other; the diagnostic says how to go on
        adoption = adopt_file(extraction.script, data)
        if isinstance(adoption, Edit):
            edits.setdefault(adoption.span.source, []).append(adoption)
            files_read[example.path] = data
        else:
            refusals.append(adoption)
    remarks: list[str] = []
    for source in edits:  # all or none
        check_writable(options.root, source.path)
    for source, changes in edits.items():
        new = apply_edits(source.text, changes)
        if new != source.text:
            write_atomic(options.root, source.path, new.encode(), expected=source.text.encode())
            remarks.append(changed_text("updated", source, new))
    return remarks, refusals, files_read


def _write_as_extracted(options: Options, course: Course, files_read: Mapping[str, bytes]) -> None:
    """Make each adopted file what its block extracts to now.

    A block holds no line ends of an editor's and no blank lines at the end: without this the file
    would count as edited for ever.
    """
    for extraction in extract_course(course).value:
        data = files_read.get(extraction.path, extraction.data)
        if data != extraction.data and block_text(data) == extraction.text:
            write_atomic(
                options.root, extraction.path, extraction.data, expected=data, durable=False
            )
