"""`coursebuild export`: write the course, or a lesson of it, as one file."""

from __future__ import annotations

import argparse
from pathlib import Path

from coursebuild.core.registry import features
from coursebuild.pipeline.arguments import add_running, add_sandbox, options_of, print_report
from coursebuild.pipeline.publication import export

EXAMPLES = """\
examples:
  coursebuild export epub
  coursebuild export scorm --out course.zip
  coursebuild export slides 1.1
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_running(parser)
    add_sandbox(parser)
    exporters = [exporter for feature in features() for exporter in feature.exporters]
    offers = ", ".join(f"{e.name} ({e.summary})" for e in exporters)
    files = ", ".join(f"LESSON-{e.file}" if e.of_lesson else e.file for e in exporters)
    of_lesson = ", ".join(e.name for e in exporters if e.of_lesson)
    help = f"{offers}, or an export that a feature of the course adds"
    parser.add_argument("name", metavar="EXPORT", help=help)
    help = f"the lesson to export ({of_lesson} only)"
    parser.add_argument("lesson", metavar="LESSON", nargs="?", default="", help=help)
    help = f"output file, from the course's folder (default: {files})"
    parser.add_argument("--out", metavar="FILE", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Write the course in a form that a feature knows."""
    options = options_of(arguments)
    out = Path(arguments.out) if arguments.out else None
    return print_report(export(options, arguments.name, arguments.lesson, out), "text", options)
