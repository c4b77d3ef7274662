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
from coursebuild.core.files.errors import UsageError
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model import Course, Recording, Script
from coursebuild.core.model.results import Outcome, ScriptRun, Sign
from coursebuild.core.pages.marks import fence
from coursebuild.core.scripts.edit import apply_edits, updated_body
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

_LONGEST = 900.0
"""Seconds that a script may take that was not through after the usual time."""
_ROOM = 3.0
"""How many times as long a script may take as it took here."""
_MISSING = re.compile(r"^ModuleNotFoundError: No module named '([\w.]+)'", re.MULTILINE)


EXAMPLES = """\
examples:
  coursebuild import ../old-course --out my-course
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """What can be said."""
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
    options = Options(out, arguments.jobs or available_cores(), arguments.quiet, store)
    converted = convert(source)
    write_course(converted, out, source)
    said = [f"wrote {plural(len(converted.files), 'file')} to {out}"]
    said += _try_scripts(options, Progress(quiet=options.quiet))
    for left in converted.left:
        place = f", {left.place}" if left.place else ""
        said.append(f"left: {left.path}{place}: {left.what}")
    report = check(options)
    report = replace(report, remarks=(*said, *report.remarks), depends=None)
    return print_report(report, "text", options)


# --- scripts


def _try_scripts(options: Options, progress: Progress) -> tuple[str, ...]:
    """Run each script and write into the lessons what that showed; what fences got, in words."""
    course = load(options.root).value
    if course is None:
        return ()
    recordings = recorded_outputs(course)
    edits: dict[Source, list[Edit]] = {}
    said = []
    for extraction, done in _runs(extract_scripts(course, options).runnable, options, progress):
        script = extraction.script
        changes = edits.setdefault(script.span.source, [])
        keys = " ".join(_keys(script, done))
        if keys:
            end = script.span.first_line().end
            changes.append(Edit(Span(script.span.source, end, end), f" {keys}"))
            said.append(f"{script.path} got `{keys}`")
        if done.outcome is Outcome.OK:
            its = [recording for recording in recordings if recording.script == script.path]
            changes += _outputs(script, its, course, done.stdout)
    for source, changes in edits.items():
        new = apply_edits(source.text, changes)
        if new != source.text:
            write_atomic(options.root, source.path, new.encode(), expected=source.text.encode())
    return tuple(said)


def _runs(
    scripts: Sequence[Extraction], options: Options, progress: Progress
) -> list[tuple[Extraction, ScriptRun]]:
    """The runs of scripts; of those that took too long with more time."""
    runs = list(zip(scripts, run_scripts(scripts, options, progress), strict=True))
    slow = [extraction for extraction, done in runs if done.outcome is Outcome.TIMEOUT]
    patient = [replace(e, script=replace(e.script, timeout=_LONGEST)) for e in slow]
    again = {
        done.path: done for done in run_scripts(patient, options, progress, "running slow scripts")
    }
    return [(extraction, again.get(extraction.path, done)) for extraction, done in runs]


def _keys(script: Script, done: ScriptRun) -> Iterator[str]:
    """What the fence has to say of a script that did this, as `key=value`."""
    missing = _MISSING.search(done.stderr) if done.outcome is Outcome.FAILED else None
    if missing is not None and not script.requires:
        yield f"requires={missing[1].partition('.')[0]}"
    long = done.outcome is Outcome.OK and done.seconds * _ROOM > script.timeout
    if long and "timeout=" not in script.span.first_line().text:
        yield f"timeout={math.ceil(done.seconds * _ROOM / 10) * 10}"
    signs = {d.sign for d in done.trace.divergences} if done.trace is not None else set()
    if signs - {Sign.CONTACT} and not script.diverges:
        yield "diverges"
    if Sign.CONTACT in signs and not script.deep:
        yield "deep"


def _outputs(
    script: Script, recordings: Sequence[Recording], course: Course, printed: str
) -> Iterator[Edit]:
    """What is printed, into outputs that hold nothing, or below a script that has none."""
    for recording in recordings:
        if isinstance(recording.body, Excerpt) and not recording.body.text.strip():
            comparison = recording.comparison or course.comparison
            edit = updated_body(recording, comparison, course.filters, printed, printed)
            if isinstance(edit, Edit):
                yield edit
    if not recordings and printed.strip() and not script.prefix:
        end = script.span.end
        text = "Output:\n\n" + fence("text", printed.rstrip("\n"))
        yield Edit(Span(script.span.source, end, end), f"\n\n{text}")
