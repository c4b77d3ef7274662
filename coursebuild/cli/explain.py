"""`coursebuild explain`: say why something would run again, and what depends on it."""

from __future__ import annotations

import argparse
import sys

from coursebuild.cli.arguments import add_format, options_of
from coursebuild.cli.output import CLEAN, style_of, write
from coursebuild.pipeline.explain import explain
from coursebuild.report.explained import explained_text
from coursebuild.report.values import json_text


def declare(parser: argparse.ArgumentParser) -> None:
    """What can be said."""
    parser.description = (
        "Say whether a script or lab would run again and why, and what depends on it."
    )
    parser.add_argument(
        "path",
        metavar="PATH",
        help="a script, lab, lesson, page, model, or any file of the project",
    )
    add_format(parser, "text", "json")


def run(arguments: argparse.Namespace) -> int:
    """Tell what is known of a path."""
    explanation = explain(options_of(arguments), arguments.path)
    if arguments.format == "json":
        return write(json_text(explanation), CLEAN)
    return write(explained_text(explanation, style_of(sys.stdout)), CLEAN)
