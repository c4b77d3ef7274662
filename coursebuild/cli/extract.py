"""`coursebuild extract`: write the scripts to `examples/`."""

from __future__ import annotations

import argparse

from coursebuild.pipeline.arguments import add_quiet, options_of, print_report
from coursebuild.pipeline.outputs import extract

EXAMPLES = """\
examples:
  coursebuild extract --adopt        edits in examples/ go back into the lessons
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    help = "copy edits of extracted files back into their lessons"
    parser.add_argument("--adopt", action="store_true", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Write the scripts, or take over what was edited."""
    options = options_of(arguments)
    return print_report(extract(options, adopt=arguments.adopt), "text", options)
