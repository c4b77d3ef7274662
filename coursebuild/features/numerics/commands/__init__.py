"""`coursebuild stability`: MuJoCo on hard cases, beside theory."""

from __future__ import annotations

import argparse
from typing import Any

from coursebuild.cli.arguments import add_cache, add_format, add_quiet
from coursebuild.features.bench.commands import add_report_options, run_measurement
from coursebuild.features.bench.commands.measurement import Measurement, measurement_json
from coursebuild.features.numerics.commands.stability import check_stability, stability
from coursebuild.features.numerics.commands.text import stability_text
from coursebuild.pipeline.options import Options
from coursebuild.report.values import json_text

EXAMPLES = """\
examples:
  coursebuild stability impact           one family of hard cases
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    parser.add_argument(
        "problems",
        nargs="*",
        metavar="PROBLEM",
        help="a hard case, or a family of them (default: all)",
    )
    add_format(parser, "text", "json")
    add_report_options(parser)
    add_cache(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure, or check by measuring again."""
    names = tuple(arguments.problems)

    def measure(options: Options) -> Measurement[Any]:
        if arguments.check:
            return check_stability(options, names)
        return stability(options, names, record=arguments.record)

    def as_json(measurement: Measurement[Any]) -> str:
        if measurement.ok and not (arguments.record or arguments.check):
            return json_text(measurement.reports)
        return measurement_json({"cases": measurement.reports}, measurement)

    return run_measurement(
        arguments,
        measure,
        lambda reports, style: "" if arguments.check else stability_text(reports, style),
        as_json,
    )
