"""`coursebuild serve`: preview."""

from __future__ import annotations

import argparse
import re
import sys
from typing import NoReturn

from coursebuild.cli.arguments import add_running, options_of, style_of
from coursebuild.preview.serve import serve

EXAMPLES = """\
examples:
  coursebuild serve --open           and open it in a browser
  coursebuild serve --host 0.0.0.0   for other machines too, by a link with a token
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_running(parser)
    parser.add_argument(
        "--port",
        type=_parse_port,
        default=8000,
        help="default: %(default)s; 0: any free one",
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to listen on (default: %(default)s, this machine only); any other one "
        "answers only browsers that open the printed link, with its token",
    )
    parser.add_argument("--open", action="store_true", help="open it in a browser")
    parser.add_argument(
        "--embed",
        action="append",
        type=_parse_origin,
        default=[],
        metavar="ORIGIN",
        help="let pages of this origin show it in a frame, such as vscode-webview:",
    )


def run(arguments: argparse.Namespace) -> NoReturn:
    """Build, serve, rebuild and reload on change, until it is interrupted."""
    serve(
        options_of(arguments),
        arguments.host,
        arguments.port,
        tuple(arguments.embed),
        style_of(sys.stderr),
        browse=arguments.open,
    )


def _parse_port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port: a whole number from 0 to 65535")
    return int(text)


def _parse_origin(text: str) -> str:
    if not re.fullmatch(r"[a-z][a-z0-9+.-]*:(//[\w.*\[\]:-]+)?", text):
        raise argparse.ArgumentTypeError(f"{text!r} is not an origin, such as https://example.org")
    return text
