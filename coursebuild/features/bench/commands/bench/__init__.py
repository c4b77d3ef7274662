"""`coursebuild bench`: speed against error of the course's models."""

from __future__ import annotations

import argparse
from typing import Any

from coursebuild.cli.arguments import add_cache, add_format, add_quiet
from coursebuild.features.bench.commands import (
    add_report_options,
    run_measurement,
)
from coursebuild.features.bench.commands.bench.run import bench, check
from coursebuild.features.bench.commands.bench.text import bench_text
from coursebuild.features.bench.commands.measurement import Measurement, measurement_json
from coursebuild.pipeline.options import Options

EXAMPLES = """\
examples:
  coursebuild bench --quick              a first look at all models
  coursebuild bench pendulum --record    what pages show of it
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a model, as in models/SCENE.xml (default: all)"
    )
    add_format(parser, "text", "json")
    parser.add_argument(
        "--quick", action="store_true", help="fewer settings and rough times, for a first look"
    )
    add_report_options(parser)
    add_cache(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure models, or check their recorded reports."""
    names, quick = tuple(arguments.scenes), arguments.quick

    def measure(options: Options) -> Measurement[Any]:
        if arguments.check:
            return check(options, names, quick=quick)
        return bench(options, names, quick=quick, record=arguments.record)

    return run_measurement(
        arguments,
        measure,
        lambda reports, style: "" if arguments.check else bench_text(reports, style),
        lambda measurement: measurement_json({"scenes": measurement.reports}, measurement),
        empty="there is no model to measure\n",
    )
