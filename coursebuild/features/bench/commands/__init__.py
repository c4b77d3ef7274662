"""The commands that measure, `bench` and `diet`, and what `stability` shares with them.

`runs` measures one thing after the other into a `Measurement` (`measurement`), and records it.

Entry points: `add_report_options`; `run_measurement`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any

from coursebuild.cli.arguments import options_of, style_of
from coursebuild.cli.output import CLEAN, FAILURE, write
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    measurement_text,
)
from coursebuild.pipeline.options import Options
from coursebuild.report.text import Style


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
    arguments: argparse.Namespace,
    measure: Callable[[Options], Measurement[Any]],
    text: Callable[[Sequence[Any], Style], str],
    json: Callable[[Measurement[Any]], str],
    *,
    empty: str = "",
) -> int:
    """Measure with the options that the arguments give, print it, and return the exit status.

    `text` is of the reports, `json` of the whole; `empty` is for no text at all.
    """
    options = options_of(arguments)
    try:
        measurement = measure(options)
    finally:
        options.store.close()
    status = CLEAN if measurement.ok else FAILURE
    if arguments.format == "json":
        return write(json(measurement), status)
    style = style_of(sys.stdout)
    reports = text(measurement.reports, style)
    return write(measurement_text(reports, measurement, style) or empty, status)
