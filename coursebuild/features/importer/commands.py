"""`coursebuild import`: convert, write, try, check.

Each script of the new course is run once, which shows what its fence needs and what it prints.
"""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from msgspec.structs import replace

from coursebuild.cli.arguments import add_running, available_cores
from coursebuild.cli.output import print_report
from coursebuild.core.files.changes import FileChange, change_files
from coursebuild.core.files.errors import UsageError
from coursebuild.core.model import Course, Recording, Script
from coursebuild.core.model.results import Outcome, ScriptRun, Sign
from coursebuild.core.pages.marks import fence
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.features.importer.convert import convert, write_course
from coursebuild.pipeline.check import check
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, open_store
from coursebuild.pipeline.progress import Progress
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
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = (
        "Write a course of another tool as one of coursebuild: a course.json with Markdown,\n"
        "Jupyter notebooks, MyST, Quarto or MkDocs. Its folder is only read."
    )
    add_running(parser)
    parser.add_argument("folder", metavar="FOLDER", help="what to import")
    parser.add_argument(
        "--out",
        metavar="FOLDER",
        help="where the new course goes (default: a folder of the same name here)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the course as one of coursebuild in a new folder, try its scripts, and check it."""
    if arguments.root is not None:
        raise UsageError("import takes no -C: the new course's folder is named by --out")
    source = Path(arguments.folder)
    out = Path(arguments.out or source.resolve().name).absolute()
    store = open_store(out, arguments.cache, arguments.cache_size, fresh=arguments.no_cache)
    progress = Progress(quiet=arguments.quiet)
    options = Options(out, arguments.jobs or available_cores(), store, progress)
    converted = convert(source)
    write_course(converted, out, source)
    remarks = [f"wrote {plural(len(converted.files), 'file')} to {out}"]
    remarks += _try_scripts(options)
    for leftover in converted.leftovers:
        place = f", {leftover.place}" if leftover.place else ""
        remarks.append(f"left: {leftover.path}{place}: {leftover.message}")
    report = check(options)
    report = replace(report, remarks=(*remarks, *report.remarks), depends=None)
    return print_report(report, "text", options)


# --- scripts


def _try_scripts(options: Options) -> tuple[str, ...]:
    """Run each script and add keys and outputs to its lesson; return remarks on the new keys."""
    course = load(options.root).value
    if course is None:
        return ()
    recordings = recorded_outputs(course)
    edits: dict[Source, list[Edit]] = {}
    remarks = []
    scripts = extract_scripts(course, options).runnable
    for extraction, script_run in _run_scripts(scripts, options):
        script = extraction.script
        changes = edits.setdefault(script.span.source, [])
        keys = " ".join(_missing_keys(script, script_run))
        if keys:
            end = script.span.first_line().end
            changes.append(Edit(Span(script.span.source, end, end), f" {keys}"))
            remarks.append(f"{script.path} got `{keys}`")
        if script_run.outcome is Outcome.OK:
            script_recordings = [r for r in recordings if r.script == script.path]
            changes += _output_edits(script, script_recordings, course, script_run.stdout)
    file_changes = (
        FileChange(source.path, source.text.encode(), apply_edits(source.text, changes).encode())
        for source, changes in edits.items()
    )
    change_files(options.root, [change for change in file_changes if change.new != change.old])
    return tuple(remarks)


def _run_scripts(
    scripts: Sequence[Extraction], options: Options
) -> list[tuple[Extraction, ScriptRun]]:
    """Run the scripts, those that took too long once more with more time."""
    runs = list(zip(scripts, run_scripts(scripts, options), strict=True))
    slow = [extraction for extraction, run in runs if run.outcome is Outcome.TIMEOUT]
    retried = [replace(e, script=replace(e.script, timeout=_LONG_TIMEOUT)) for e in slow]
    reruns = {run.path: run for run in run_scripts(retried, options, "running slow scripts")}
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


def _output_edits(
    script: Script, recordings: Sequence[Recording], course: Course, printed: str
) -> Iterator[Edit]:
    """Yield edits that fill empty outputs with what was printed, or add one where there is none."""
    for recording in recordings:
        if isinstance(recording.body, Excerpt) and not recording.body.text.strip():
            comparison = course.comparison_of(recording)
            edit = update_body(recording, comparison, printed, printed)
            if isinstance(edit, Edit):
                yield edit
    if not recordings and printed.strip() and not script.prefix:
        end = script.span.end
        text = "Output:\n\n" + fence("text", printed.rstrip("\n"))
        yield Edit(Span(script.span.source, end, end), f"\n\n{text}")
