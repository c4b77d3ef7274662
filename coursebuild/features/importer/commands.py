"""`coursebuild import`: convert, write, try, check."""

from __future__ import annotations

import argparse
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import shorten

from msgspec.structs import replace

from coursebuild.api import (
    Course,
    Edit,
    Excerpt,
    Options,
    Outcome,
    Recording,
    ScriptRun,
    Source,
    Span,
    UsageError,
    add_running,
    check,
    find_sandbox,
    print_report,
)
from coursebuild.core.files.write import FileChange, undo_changes
from coursebuild.core.model import Script
from coursebuild.core.model.results import Change, Sign
from coursebuild.core.pages.marks import fence
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.scripts.extract import Extraction
from coursebuild.features.importer.convert import (
    change_tried_lessons,
    convert,
    write_course,
)
from coursebuild.features.importer.source_files import SourceFiles
from coursebuild.pipeline.arguments import add_sandbox, available_cores
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Progress, check_path, open_store
from coursebuild.pipeline.scripts import extract_scripts, recorded_outputs
from coursebuild.pipeline.scripts import run as run_scripts
from coursebuild.report.values import plural

_LONG_TIMEOUT = 900.0
"""Seconds allowed in the second run of a script that exceeded the usual time."""
_TIME_FACTOR = 3.0
"""A script's new time limit, as a multiple of the time it took here."""
_MISSING_MODULE = re.compile(r"^ModuleNotFoundError: No module named '([\w.]+)'", re.MULTILINE)


EXAMPLES = """\
examples:
  coursebuild import ../old-course --out my-course
  coursebuild import pendulum.ipynb
  coursebuild import ../from-elsewhere --sandbox     what a stranger wrote
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = (
        "Convert a course of another tool: a course.json with Markdown, Jupyter notebooks,\n"
        "MyST, Quarto or MkDocs. The folder is only read, but its code is run: use --sandbox\n"
        "to limit what the cells and scripts of strangers can do."
    )
    add_running(parser)
    add_sandbox(parser)
    parser.add_argument(
        "source", metavar="FOLDER", help="what to import: a folder, a notebook or a Markdown file"
    )
    parser.add_argument(
        "--out",
        metavar="FOLDER",
        help="where the new course goes (default: a folder of the same name here)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the course as one of coursebuild in a new folder, try its scripts, and check it."""
    if arguments.root is not None:
        raise UsageError("import does not take -C: name the new course's folder with --out")
    files = SourceFiles(Path(arguments.source))
    out = Path(os.path.realpath(arguments.out or files.name))
    check_path(out)
    store = open_store(out, arguments.cache, arguments.cache_size, fresh=arguments.no_cache)
    options = Options(
        out,
        arguments.jobs or available_cores(),
        store,
        Progress(quiet=arguments.quiet),
        verbose=arguments.verbose,
        sandbox=find_sandbox(out) if arguments.sandbox else None,
    )
    converted = convert(files)
    undo_changes(out, Progress().say)
    write_course(converted, out, files, store)
    remarks = [f"wrote {plural(len(converted.files), 'file')} to {out}"]
    remarks += _try_scripts(options, converted.notebook_outputs)
    for leftover in converted.leftovers:
        place = f", {leftover.place}" if leftover.place else ""
        remarks.append(f"left: {leftover.path}{place}: {leftover.message}")
    report = check(options)
    report = replace(report, remarks=(*remarks, *report.remarks), depends=None)
    return print_report(report, "text", options)


# --- scripts


def _try_scripts(options: Options, notebook_outputs: Mapping[str, str]) -> tuple[str, ...]:
    """Run each script and add keys and outputs to its lesson; return remarks on what is new.

    Of `notebook_outputs`, those that do not hold here are replaced.
    """
    course = load(options.root, code="run" if options.sandbox is None else "refuse").value
    if course is None:
        return ()
    recordings = recorded_outputs(course)
    edits: dict[Source, list[Edit]] = {}
    remarks = []
    scripts = extract_scripts(course, options).runnable
    for extraction, script_run in _run_scripts(course, scripts, options):
        script = extraction.script
        changes = edits.setdefault(script.span.source, [])
        keys = " ".join(_missing_keys(script, script_run))
        if keys:
            end = script.span.first_line().end
            changes.append(Edit(Span(script.span.source, end, end), f" {keys}"))
            remarks.append(f"{script.path} got `{keys}`")
        if script_run.outcome is Outcome.OK:
            script_recordings = [r for r in recordings if r.script == script.path]
            notebook = notebook_outputs.get(script.path)
            for recording in script_recordings:
                comparison = course.comparison_of(recording)
                printed = script_run.output_of(recording.part)
                verdict = compare(recording, comparison, printed)
                if not _is_blank(recording) and (notebook is None or not verdict.changes):
                    continue
                edit = update_body(recording, comparison, printed)
                if isinstance(edit, Edit):
                    changes.append(edit)
                    if not _is_blank(recording):
                        remarks.append(f"{notebook}: {_describe_changes(verdict.changes)}")
            for part, block in enumerate(script.parts or (script,)):
                printed = script_run.output_of(part)
                is_recorded = any(recording.part == part for recording in script_recordings)
                if printed.strip() and not is_recorded and not block.prefix:
                    end, text = block.span.end, fence("output", printed.rstrip("\n"))
                    changes.append(Edit(Span(block.span.source, end, end), f"\n\n{text}"))
    file_changes = (
        FileChange(source.path, source.text.encode(), apply_edits(source.text, changes).encode())
        for source, changes in edits.items()
    )
    lessons = [change for change in file_changes if change.new != change.old]
    change_tried_lessons(options.root, lessons, options.store)
    return tuple(remarks)


def _run_scripts(
    course: Course, scripts: Sequence[Extraction], options: Options
) -> list[tuple[Extraction, ScriptRun]]:
    """Run the scripts, those that took too long once more with more time."""
    runs = list(zip(scripts, run_scripts(course, scripts, options), strict=True))
    slow = [extraction for extraction, run in runs if run.outcome is Outcome.TIMEOUT]
    retried = [replace(e, script=replace(e.script, timeout=_LONG_TIMEOUT)) for e in slow]
    reruns = {
        run.path: run for run in run_scripts(course, retried, options, "running slow scripts")
    }
    return [(extraction, reruns.get(extraction.path, run)) for extraction, run in runs]


def _missing_keys(script: Script, script_run: ScriptRun) -> Iterator[str]:
    """Yield the keys that a script's fence needs after this run, as `key=value`."""
    if script_run.outcome is Outcome.FAILED and not script.requires:
        missing = _MISSING_MODULE.search(script_run.stderr)
        if missing is not None:
            yield f"requires={missing[1].partition('.')[0]}"
    limit = script_run.seconds * _TIME_FACTOR
    is_slow = script_run.outcome is Outcome.OK and limit > script.timeout
    if is_slow and "timeout=" not in script.span.first_line().text:
        yield f"timeout={math.ceil(limit / 10) * 10}"
    trace = script_run.trace
    signs = {d.sign for d in trace.divergences} if trace is not None else set()
    if signs - {Sign.CONTACT} and not script.diverges:
        yield "diverges"
    if Sign.CONTACT in signs and not script.deep:
        yield "deep"


def _is_blank(recording: Recording) -> bool:
    return isinstance(recording.body, Excerpt) and not recording.body.text.strip()


def _describe_changes(changes: Sequence[Change]) -> str:
    recorded, printed = (
        f"`{text}`" if text else "nothing"
        for text in (
            shorten(t, 60, placeholder="…") for t in (changes[0].recorded, changes[0].printed)
        )
    )
    rest = f", and {plural(len(changes) - 1, 'more difference')}" if changes[1:] else ""
    return (
        "the recorded output does not hold here and is replaced: "
        f"{recorded} was recorded, {printed} is printed{rest}"
    )
