"""`coursebuild serve`: preview."""

from __future__ import annotations

import argparse

from coursebuild.cli.arguments import add_running, options_of
from coursebuild.cli.output import CLEAN
from coursebuild.preview.serve import serve

EXAMPLES = """\
examples:
  coursebuild serve --port 0         at any free port
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """What can be said."""
    add_running(parser)
    parser.add_argument(
        "--port",
        type=_port,
        default=8000,
        help="port on 127.0.0.1 (default: %(default)s; 0: any free one)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Build, serve, rebuild and reload on change, until it is interrupted."""
    serve(options_of(arguments), arguments.port)
    return CLEAN


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is no port: a whole number from 0 to 65535")
    return int(text)
