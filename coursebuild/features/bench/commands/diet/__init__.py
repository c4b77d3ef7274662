"""`coursebuild diet`: what models hold that their scenarios do not need."""

from __future__ import annotations

import argparse

from msgspec.structs import replace

from coursebuild.cli.arguments import add_cache, add_format, add_quiet
from coursebuild.features.bench.commands import run_measurement
from coursebuild.features.bench.commands.diet.run import diet
from coursebuild.features.bench.commands.diet.text import diet_text, diet_values
from coursebuild.features.bench.commands.measurement import Measurement, measurement_json
from coursebuild.numerics.reports.diet_report import DietReport
from coursebuild.pipeline.options import Options

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
    quiet = arguments.quiet and arguments.format == "text"

    def measure(options: Options) -> Measurement[DietReport]:
        measurement = diet(options, names, **settings)
        if not quiet:
            return measurement
        if measurement.ok:
            return Measurement(())
        return replace(measurement, reports=tuple(r for r in measurement.reports if not r.ok))

    empty = "" if quiet else "there is no model to look at\n"
    return run_measurement(
        arguments,
        measure,
        diet_text,
        lambda measurement: measurement_json(diet_values(measurement.reports), measurement),
        empty=empty,
    )
