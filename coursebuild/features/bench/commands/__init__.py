"""The commands that measure, `bench` and `diet`, and what `stability` shares with them.

`runs` measures one thing after the other into a `Measurement` (`measurement`), and records it.

Entry points: `add_report_options`; `run_measurement`; `write_measurement`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import Any

from coursebuild.cli.arguments import options_of
from coursebuild.cli.output import CLEAN, FAILURE, style_of, write
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    measurement_json,
    measurement_text,
)
from coursebuild.pipeline.options import Options
from coursebuild.report.terminal import Style


def add_report_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for reports in the course's folder."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--record", action="store_true", help="write what was measured to content/reports/"
    )
    group.add_argument(
        "--check",
        action="store_true",
        help="measure again, and fail if a figure has changed; times are never compared",
    )


def run_measurement(
    arguments: argparse.Namespace, measure: Callable[[Options], Measurement[Any]]
) -> Measurement[Any]:
    """Measure with the options that the arguments give."""
    options = options_of(arguments)
    try:
        return measure(options)
    finally:
        options.store.close()


def write_measurement(
    arguments: argparse.Namespace,
    measurement: Measurement[Any],
    text: Callable[[Style], str],
    values: Mapping[str, object],
    *,
    empty: str = "",
) -> int:
    """Print a measurement as text or as JSON, and return the exit status."""
    status = CLEAN if measurement.ok else FAILURE
    if arguments.format == "json":
        return write(measurement_json(values, measurement), status)
    style = style_of(sys.stdout)
    return write(measurement_text(text(style), measurement, style) or empty, status)
