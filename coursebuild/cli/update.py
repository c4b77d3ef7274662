"""`coursebuild update`: bring recorded outputs up to date."""

from __future__ import annotations

import argparse

from coursebuild.core.files.errors import UsageError
from coursebuild.pipeline import arguments as shared
from coursebuild.pipeline.outputs import update

EXAMPLES = """\
examples:
  coursebuild update --dry-run       what would change
  coursebuild update 4.2             one lesson
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    shared.add_running(parser)
    shared.add_executors(parser)
    shared.add_lessons(parser)
    shared.add_long(parser)
    help = "show what would change; write nothing"
    parser.add_argument("--dry-run", action="store_true", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Record what scripts print now."""
    if arguments.long and arguments.executor:  # what is recorded says which machine made it
        raise UsageError(f"--long cannot be combined with {arguments.executor[0].option}")
    options = shared.options_of(arguments)
    report = update(options, tuple(arguments.lessons), dry_run=arguments.dry_run)
    return shared.print_report(report, "text", options)
