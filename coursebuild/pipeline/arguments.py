"""What several commands share: their arguments, and how they print what they have found."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from functools import partial
from pathlib import Path
from typing import TextIO

from msgspec.structs import replace

from coursebuild.core.engine.store import Store
from coursebuild.core.registry import installed_features
from coursebuild.core.run.sandbox import find_sandbox
from coursebuild.output import CLEAN, FAILURE, terminal_style, write
from coursebuild.pipeline.options import Options, Progress, find_course, open_store
from coursebuild.report import Report, Style, render_report


def options_of(arguments: argparse.Namespace) -> Options:
    """Make the options of a command from its arguments."""
    jobs = getattr(arguments, "jobs", None) or available_cores()
    root = find_course(arguments.root)
    if hasattr(arguments, "cache"):
        fresh = arguments.no_cache
        store = open_store(root, arguments.cache, arguments.cache_size, fresh=fresh)
    else:
        store = Store(root)
    sandbox = find_sandbox(root) if getattr(arguments, "sandbox", False) else None
    quiet, long, verbose, strict = (
        getattr(arguments, name, False) for name in ("quiet", "long", "verbose", "strict")
    )
    progress = Progress(quiet=quiet)
    options = Options(root, jobs, store, progress, long, verbose, strict=strict, sandbox=sandbox)
    kind, value = getattr(arguments, "executor", None) or (None, "")
    if kind is not None:
        start = importlib.import_module(kind.module).start
        executor = start(value, root, jobs, sandbox is not None, progress.say)
        arguments.resources.callback(executor.close)
        options = replace(options, executor=executor, run_all=executor.run)
    return options


def available_cores() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


# --- declarations


def add_quiet(parser: argparse.ArgumentParser) -> None:
    """Declare `--quiet`."""
    parser.add_argument("--quiet", "-q", action="store_true", help="print only problems")


def add_cache(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments about stored results."""
    help = "share results in a folder or at a URL such as s3://… (default: $COURSEBUILD_CACHE)"
    parser.add_argument("--cache", metavar="PLACE", help=help)
    help = "ignore kept results, and keep the new ones"
    parser.add_argument("--no-cache", action="store_true", help=help)
    help = "size limit of .coursebuild, such as 500M (default: $COURSEBUILD_CACHE_SIZE, or 1G)"
    parser.add_argument("--cache-size", metavar="SIZE", help=help)


def add_running(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of commands that run scripts."""

    def parse_jobs(text: str) -> int:
        if text.isdecimal() and 1 <= int(text) <= 1024:
            return int(text)
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of jobs: a whole number from 1")

    add_quiet(parser)
    parser.add_argument("--verbose", "-v", action="store_true", help="say why each script runs")
    help = "scripts to run at a time (default: one per core)"
    parser.add_argument("--jobs", "-j", type=parse_jobs, metavar="N", help=help)
    add_cache(parser)


def add_executors(parser: argparse.ArgumentParser) -> None:
    """Declare the options of features for work in other processes."""
    parser.set_defaults(executor=None)
    kinds = [kind for feature in installed_features() for kind in feature.executors]
    group = parser.add_mutually_exclusive_group() if kinds else parser  # help needs members
    for kind in kinds:
        bind = partial(lambda kind, value: (kind, value), kind)
        group.add_argument(
            kind.option, dest="executor", type=bind, metavar=kind.metavar, help=kind.help
        )


def add_sandbox(parser: argparse.ArgumentParser) -> None:
    """Declare `--sandbox`."""
    help = "run each script without network, able to see and write only the course"
    parser.add_argument("--sandbox", action="store_true", help=help)


def add_strict(parser: argparse.ArgumentParser) -> None:
    """Declare `--strict`."""
    help = "treat warnings as errors, and reject scripts that are not run"
    parser.add_argument("--strict", action="store_true", help=help)


def add_lessons(parser: argparse.ArgumentParser) -> None:
    """Declare the names of lessons and pages."""
    help = "id, slug or file of a lesson or page (default: all)"
    parser.add_argument("lessons", nargs="*", metavar="LESSON", help=help)


def add_long(parser: argparse.ArgumentParser) -> None:
    """Declare `--long`."""
    help = "also run scripts that are recorded once"
    parser.add_argument("--long", action="store_true", help=help)


def add_format(parser: argparse.ArgumentParser, *formats: str) -> None:
    """Declare `--format`."""
    help = "output format (default: %(default)s)"
    parser.add_argument("--format", choices=formats, default="text", help=help)


# --- what is printed


def print_report(report: Report, form: str, options: Options) -> int:
    """Write a report in one of its formats; return the status of the command."""
    options.store.close()
    status = CLEAN if report.ok else FAILURE
    return write(report_text(report, form, options), status, commands=form == "github")


def report_text(report: Report, form: str, options: Options) -> str:
    """Return the report as it is printed; as text and if quiet, only what is wrong."""
    # A workflow names its checkout, of which the course may be a folder.
    place = os.path.relpath(options.root, os.environ.get("GITHUB_WORKSPACE") or options.root)
    if place != os.curdir and not place.startswith(os.pardir):
        report = replace(report, folder=f"{Path(place).as_posix()}/")
    return render_report(report, form, style_of(sys.stdout), brief=options.progress.quiet)


def style_of(stream: TextIO | None) -> Style:
    """The style of text on a stream."""
    return Style(*terminal_style(is_terminal=stream is not None and stream.isatty()))
