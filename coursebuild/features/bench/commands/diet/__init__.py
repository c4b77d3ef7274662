"""`coursebuild diet`: what models hold that their scenarios do not need."""

from __future__ import annotations

import argparse

from msgspec.structs import replace

from coursebuild.cli.arguments import add_cache, add_format, add_quiet
from coursebuild.cli.output import CLEAN
from coursebuild.features.bench.commands import run_measurement, write_measurement
from coursebuild.features.bench.commands.diet.run import diet
from coursebuild.features.bench.commands.diet.text import diet_text, diet_values

EXAMPLES = """\
examples:
  coursebuild diet pendulum              what it could be without
  coursebuild diet --fix                 take out what changes nothing
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    parser.add_argument(
        "models", nargs="*", metavar="MODEL", help="a file of models/ (default: all)"
    )
    writes = parser.add_mutually_exclusive_group()
    writes.add_argument(
        "--fix", action="store_true", help="change what leaves every bit of the motion as it is"
    )
    writes.add_argument(
        "--record", action="store_true", help="write what was found to content/reports/"
    )
    parser.add_argument("--quick", action="store_true", help="short runs, rough times")
    add_format(parser, "text", "json")
    add_cache(parser)


def run(arguments: argparse.Namespace) -> int:
    """Look at models, and mend them or record what was found."""
    settings = {name: getattr(arguments, name) for name in ("quick", "fix", "record")}
    names = tuple(arguments.models)
    measurement = run_measurement(arguments, lambda options: diet(options, names, **settings))
    if arguments.quiet and arguments.format == "text":
        if measurement.ok:
            return CLEAN
        reports = tuple(report for report in measurement.reports if not report.ok)
        measurement = replace(measurement, reports=reports)
    return write_measurement(
        arguments,
        measurement,
        lambda style: diet_text(measurement.reports, style),
        diet_values(measurement.reports),
        empty="there is no model to look at\n",
    )
