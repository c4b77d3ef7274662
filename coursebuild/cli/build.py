"""`coursebuild build`: verify everything and publish the site."""

from __future__ import annotations

import argparse
from pathlib import Path

from coursebuild.cli.check import run_unless_unchanged
from coursebuild.pipeline.arguments import add_running, add_sandbox, add_strict
from coursebuild.pipeline.publication import build

EXAMPLES = """\
examples:
  coursebuild build                  the site in public/
  coursebuild build --out ../site    elsewhere
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_running(parser)
    add_sandbox(parser)
    add_strict(parser)
    help = "folder of the site, from the course's folder (default: %(default)s)"
    parser.add_argument("--out", default="public", metavar="FOLDER", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Publish the site, or say why not."""
    out: str = arguments.out
    outputs = ("examples", out)
    return run_unless_unchanged(arguments, outputs, lambda options: build(options, Path(out)))
