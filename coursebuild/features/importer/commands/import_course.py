"""`coursebuild import`: convert, write, and check what needs no run; or run and prove it."""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

from msgspec.structs import replace

from coursebuild.api import (
    Options,
    Report,
    UsageError,
    add_running,
    check,
    find_sandbox,
    options_of,
    print_report,
)
from coursebuild.core.files.write import undo_changes
from coursebuild.features.importer.commands.findings import Rank
from coursebuild.features.importer.commands.proof import keep_notebook_outputs, prove
from coursebuild.features.importer.convert import convert, write_course
from coursebuild.features.importer.source_files import SourceFiles
from coursebuild.pipeline.arguments import add_sandbox, available_cores
from coursebuild.pipeline.check import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Progress, check_path, open_store
from coursebuild.pipeline.outputs import unasked_lines
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.scripts import extract_scripts
from coursebuild.pipeline.verify import compile_models
from coursebuild.report.values import plural

EXAMPLES = """\
examples:
  coursebuild import ../old-course --out my-course   nothing is run
  coursebuild -C my-course import --prove            run its scripts, and write what that shows
  coursebuild import pendulum.ipynb
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = (
        "Convert a course of another tool: a course.json with Markdown, Jupyter notebooks, MyST,\n"
        "Quarto, MkDocs, mdBook or Docusaurus. The folder is only read, and nothing of it is run\n"
        "before --prove: use --sandbox there to limit what the cells of strangers can do."
    )
    add_running(parser)
    add_sandbox(parser)
    parser.add_argument(
        "source",
        metavar="FOLDER",
        nargs="?",
        help="what to import: a folder, a notebook or a Markdown file",
    )
    parser.add_argument(
        "--out",
        metavar="FOLDER",
        help="where the new course goes (default: a folder of the same name here)",
    )
    parser.add_argument(
        "--prove",
        action="store_true",
        help="run the scripts and write what that shows; without FOLDER, of an imported course",
    )
    parser.add_argument(
        "--once",
        metavar="SECONDS",
        type=float,
        default=60.0,
        help="with --prove: a script that takes longer is recorded once (default: %(default)g)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the course as one of coursebuild in a new folder; run and check it if asked."""
    if arguments.source is None:
        if not arguments.prove or arguments.out is not None:
            raise UsageError("name a FOLDER to import, or prove what was imported: --prove")
        options = options_of(arguments)
        return print_report(_prove(options, (), arguments.once), "text", options)
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
    keep_notebook_outputs(converted.notebook_outputs, store)
    remarks = (
        f"wrote {plural(len(converted.files), 'file')} to {out}",
        *converted.account.summary(),
    )
    report = (
        _prove(options, remarks, arguments.once) if arguments.prove else _examine(options, remarks)
    )
    return print_report(report, "text", options)


def _prove(options: Options, remarks: tuple[str, ...], most_seconds: float) -> Report:
    findings = prove(options, most_seconds)
    report = check(options, truth=True)
    claims = [d for d in report.diagnostics if d.rule in _LISTED]
    report = replace(
        report, diagnostics=tuple(d for d in report.diagnostics if d.rule not in _LISTED)
    )
    for diagnostic in claims:
        for note in diagnostic.notes:
            message = f" says `{diagnostic.span.text}`, and {note.message}"
            findings.add(Rank.LIKELY, message, diagnostic.span)
    if count := sum(bool(diagnostic.edits) for diagnostic in claims):
        numbers = f"{plural(count, 'number')} of texts, which scripts print, can be bound"
        findings.add(Rank.CHANGED, f"{numbers}: `coursebuild check --propose --truth`")
    findings.write({}, report.diagnostics)
    return replace(report, remarks=(*remarks, *findings.remarks(), *report.remarks), depends=None)


_LISTED = ("number-unproven", "unit-unproven")
"""Rules of what only a list has: an import says what of it is printed."""


def _examine(options: Options, remarks: tuple[str, ...]) -> Report:
    """Report what is wrong in a course, as far as that is seen without running its code."""
    began = time.monotonic()
    with Reader(options) as reader:
        parsed_course = load(options.root, reader, code="refuse")
    course, diagnostics = parsed_course.value, [*parsed_course.diagnostics]
    if course is None:
        return judge(course, diagnostics, began, remarks=remarks)
    extracted = extract_scripts(course, options)
    diagnostics += [*extracted.diagnostics, *compile_models(course, options)[1]]
    reason = "import runs nothing before --prove"
    scripts, labs = unasked_lines(course, extracted.extractions, None, reason)
    if scripts:
        proof = f"run `coursebuild -C {options.root.name} import --prove`"
        remarks += (f"{plural(len(scripts), 'script')} not run: {proof}",)
    return judge(course, diagnostics, began, scripts=scripts, labs=labs, remarks=remarks)
