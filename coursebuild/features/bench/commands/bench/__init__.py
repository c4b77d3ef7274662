"""`coursebuild bench`: speed against error of the course's models."""

from __future__ import annotations

import argparse
from typing import Any

from msgspec.structs import replace

from coursebuild.cli.arguments import add_cache, add_format, add_quiet
from coursebuild.features.bench.commands import add_recorded, measured, write_measured
from coursebuild.features.bench.commands.bench.run import bench, check, plot_file, write_plots
from coursebuild.features.bench.commands.bench.text import bench_text
from coursebuild.features.bench.commands.bench.values import bench_values
from coursebuild.features.bench.commands.measurement import Measurement
from coursebuild.pipeline.options import Options

EXAMPLES = """\
examples:
  coursebuild bench --quick              a first look at all models
  coursebuild bench pendulum --record    what pages show of it
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """What can be said."""
    add_quiet(parser)
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a model, as in models/SCENE.xml (default: all)"
    )
    add_format(parser, "text", "json")
    parser.add_argument(
        "--quick", action="store_true", help="fewer settings and rough times, for a first look"
    )
    parser.add_argument(
        "--plot",
        metavar="FILE.svg",
        help="draw error against cost, in one file for each scenario",
    )
    add_recorded(parser)
    add_cache(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure, or measure again, and draw."""
    plot = None if arguments.plot is None else plot_file(arguments.plot)
    names, quick = tuple(arguments.scenes), arguments.quick

    def measure(options: Options) -> Measurement[Any]:
        if arguments.check:
            found = check(options, names, quick=quick)
        else:
            found = bench(options, names, quick=quick, record=arguments.record)
        if plot is None:
            return found
        return replace(found, remarks=(*found.remarks, *write_plots(plot, found.reports)))

    found = measured(arguments, measure)
    shown = () if arguments.check else found.reports
    return write_measured(
        arguments,
        found,
        lambda style: bench_text(shown, style),
        bench_values(found.reports),
        empty="there is no model to measure\n",
    )
