"""`coursebuild check`: verify everything without publishing."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Callable

from msgspec.structs import replace

from coursebuild.cli.unchanged import Watcher, identify_command
from coursebuild.core.files.errors import UsageError
from coursebuild.core.registry import package_paths
from coursebuild.core.text.characters import printable_lines
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.output import CLEAN, write
from coursebuild.pipeline import arguments as shared
from coursebuild.pipeline.arguments import options_of, print_report, report_text
from coursebuild.pipeline.check import check
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.shards import read_shard
from coursebuild.report import Report, unchanged_report
from coursebuild.report.text import diagnostic_text
from coursebuild.report.values import plural, with_hints

EXAMPLES = """\
examples:
  coursebuild check                      the whole course
  coursebuild check 4.2                  one lesson
  coursebuild check -v                   why each script runs
  coursebuild check --fix                mend the form, and no word
  coursebuild check --propose            decide what else to change, one by one
  coursebuild check --format github      annotations in GitHub Actions
  coursebuild check --strict             in CI: warnings are errors
  coursebuild check --sandbox            somebody else's branch
  coursebuild check --against 3.13.0     what another version of MuJoCo changes
"""


_FLAGS = {
    "--fix": "mend mistakes of form, without changing any word or number; `undo` reverts it",
    "--propose": "ask about each change that you should decide; without a terminal, list them",
    "--hints": "also show what is only likely to be a mistake",
    "--sensitivity": "repeat recorded runs, move initial states, halve timesteps, and report which "
    "digits hold",
    "--truth": "list results that are stated and not bound",
}


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    shared.add_running(parser)
    shared.add_executors(parser)
    shared.add_lessons(parser)
    shared.add_format(parser, "text", "json", "junit", "sarif", "github")
    help = "run only part I of N of the scripts and labs, for use on several machines"
    parser.add_argument("--shard", metavar="I/N", help=help)
    help = "run times that make the parts equally long; give every part the same file"
    parser.add_argument("--timings", metavar="FILE", action="append", default=[], help=help)
    parser.add_argument("--write-timings", metavar="FILE", help="write run times to this file")
    shared.add_long(parser)
    shared.add_sandbox(parser)
    shared.add_strict(parser)
    for option, help in _FLAGS.items():
        parser.add_argument(option, action="store_true", help=help)
    help = "run the scripts with this MuJoCo version, or `latest`, and report what it changes"
    parser.add_argument("--against", metavar="VERSION", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Print what is wrong."""
    if arguments.against is not None:
        return _compare_with_version(arguments)
    if arguments.fix or arguments.propose:
        return _mend(arguments)

    def work(options: Options) -> Report:
        report = check(
            options,
            tuple(arguments.lessons),
            shard=read_shard(arguments.shard, arguments.timings),
            timings=arguments.write_timings,
            sensitivity=arguments.sensitivity,
            truth=arguments.truth,
        )
        remarks = [*report.remarks]
        if report.diagnostics:
            from coursebuild.pipeline.fix import proposals

            safe = sum(diagnostic.safe for diagnostic in report.diagnostics)
            of_all = f"{safe} of {len(report.diagnostics)}"
            remarks += [f"`coursebuild check --fix` fixes {of_all}"] if safe else []
            if count := len(proposals(report.diagnostics)):
                remarks.append(f"`coursebuild check --propose` has {plural(count, 'proposal')}")
        if arguments.hints:
            return replace(report, remarks=tuple(remarks), diagnostics=with_hints(report))
        if report.hints:
            remarks.append(f"{plural(len(report.hints), 'hint')}: `check --hints` shows them")
        return replace(report, remarks=tuple(remarks))

    # Other formats say how long it took, which the report of before would not.
    if arguments.format != "text" or arguments.long or _special_options(arguments):
        options = options_of(arguments)
        with contextlib.redirect_stdout(sys.stderr):  # what a feature prints is not of the report
            report = work(options)
        return print_report(report, arguments.format, options)
    return run_unless_unchanged(arguments, ("examples",), work)


def _mend(arguments: argparse.Namespace) -> int:
    """Mend what can be mended, and print what is left."""
    from coursebuild.pipeline.fix import fix, propose

    option = "--fix" if arguments.fix else "--propose"
    conflicts = ["--propose"] if arguments.fix and arguments.propose else []
    conflicts += (o for o in _special_options(arguments) if (option, o) != ("--propose", "--truth"))
    if conflicts:
        raise UsageError(f"{option} cannot be combined with {conflicts[0]}")
    options, names = options_of(arguments), tuple(arguments.lessons)
    streams = (sys.stdin, sys.stdout)
    can_ask = arguments.format == "text" and all(s is not None and s.isatty() for s in streams)
    ask = _ask if can_ask else None
    report = (
        fix(options, names)
        if arguments.fix
        else propose(options, names, ask, truth=arguments.truth)
    )
    return print_report(report, arguments.format, options)


def _ask(diagnostic: Diagnostic, change: str) -> str:
    """Show a proposal, and wait for an answer: `y`, `n` or `q`."""
    style = shared.style_of(sys.stdout)
    sys.stdout.write(f"{diagnostic_text(diagnostic, style)}\n\n{printable_lines(change)}\n")
    while True:
        try:
            word = input("make this change? [y/n/q] ").strip().lower()[:1]
        except EOFError:
            return "q"
        if word in ("y", "n", "q"):
            return word


def _special_options(arguments: argparse.Namespace) -> list[str]:
    """The options given by which it does anything but verify everything, once."""
    names = ("shard", "timings", "write_timings", "sensitivity", "truth")
    return [f"--{name.replace('_', '-')}" for name in names if getattr(arguments, name)]


def _compare_with_version(arguments: argparse.Namespace) -> int:
    """Say what the scripts do with another version of MuJoCo; no difference is a mistake."""
    from coursebuild.pipeline.other_version import compare_with_version
    from coursebuild.report.against import comparison_json, comparison_text

    conflicts = [] if arguments.format in ("text", "json") else [f"--format {arguments.format}"]
    conflicts += _special_options(arguments)
    conflicts += [
        f"--{name}"
        for name in ("sandbox", "strict", "fix", "propose", "hints")
        if getattr(arguments, name)
    ]
    conflicts += [arguments.executor[0].option] if arguments.executor else []
    if conflicts:
        raise UsageError(f"--against cannot be combined with {conflicts[0]}")
    options = options_of(arguments)
    try:
        report = compare_with_version(options, tuple(arguments.lessons), arguments.against)
    finally:
        options.store.close()
    if arguments.format == "json":
        return write(comparison_json(report), CLEAN)
    style = shared.style_of(sys.stdout)
    return write(comparison_text(report, style, quiet=options.progress.quiet), CLEAN)


def run_unless_unchanged(
    arguments: argparse.Namespace, outputs: tuple[str, ...], work: Callable[[Options], Report]
) -> int:
    """Do the work; if it succeeds, the same command has nothing to do while nothing changes.

    `outputs` are the folders that the command writes.
    """
    options = options_of(arguments)
    command = identify_command(arguments.words)
    watcher = None if command is None else Watcher(str(options.root), command)
    report = work(options)
    status = print_report(report, "text", options)
    if watcher is not None and report.ok and report.depends is not None:
        remark = f"nothing has changed since the last {arguments.words[0]}"
        output = report_text(unchanged_report(report, remark), "text", options)
        watcher.keep(output, (*report.depends, *package_paths()), outputs)
    return status
