"""`coursebuild schema`: print a JSON Schema for editors."""

from __future__ import annotations

import argparse

from coursebuild.core.syntax.course_schema import json_schema, schema_roots
from coursebuild.output import CLEAN, USAGE, fail, write

EXAMPLES = """\
examples:
  coursebuild schema course > course.schema.json
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    help = "lab, course, model, or a feature's schema, such as quiz"
    parser.add_argument("name", metavar="SCHEMA", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Print what the course's files may hold."""
    names = sorted(schema_roots())
    if arguments.name not in names:
        return fail(USAGE, f"there is no schema {arguments.name!r}: choose from {', '.join(names)}")
    return write(json_schema(arguments.name).decode(), CLEAN)
