"""`coursebuild build`: verify everything and publish the site."""

from __future__ import annotations

import argparse

from coursebuild.cli.arguments import add_running, add_sandbox
from coursebuild.cli.unchanged import run_unless_unchanged

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report

EXAMPLES = """\
examples:
  coursebuild build                  the site in public/
  coursebuild build --out ../site    elsewhere
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """What can be said."""
    add_running(parser)
    add_sandbox(parser)
    parser.add_argument(
        "--out",
        default="public",
        metavar="FOLDER",
        help="where the site goes, from the course's folder (default: %(default)s)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Publish the site, or say why not."""
    out: str = arguments.out

    def work(options: Options) -> Report:
        from pathlib import Path

        from coursebuild.pipeline.build import build

        return build(options, Path(out))

    return run_unless_unchanged(arguments, ("examples", out), work)
