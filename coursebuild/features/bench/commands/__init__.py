"""The commands that measure: `bench`, `diet`, and what `stability` shares with them.

`runs` measures one thing after the other and records what was found, a `Measurement`
(`measurement`).

Entry points: `add_recorded`, what is done with reports in the course's folder; `measured`, which
runs; `write_measured`, which prints what was found.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import Any

from coursebuild.cli.arguments import options_of
from coursebuild.cli.output import CLEAN, WRONG, style_of, write
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    measured_json,
    measured_text,
)
from coursebuild.pipeline.options import Options
from coursebuild.report.terminal import Style


def add_recorded(parser: argparse.ArgumentParser) -> None:
    """What is done with reports in the course's folder."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--record", action="store_true", help="write what was measured to content/reports/"
    )
    group.add_argument(
        "--check",
        action="store_true",
        help="measure again, and fail if a figure has changed; times are never compared",
    )


def measured(
    arguments: argparse.Namespace, measure: Callable[[Options], Measurement[Any]]
) -> Measurement[Any]:
    """What a run with the options of the arguments finds."""
    options = options_of(arguments)
    try:
        return measure(options)
    finally:
        options.store.close()


def write_measured(
    arguments: argparse.Namespace,
    found: Measurement[Any],
    text: Callable[[Style], str],
    values: Mapping[str, object],
    *,
    empty: str = "",
) -> int:
    """Print what was measured, as text or as JSON; the exit status."""
    status = CLEAN if found.ok else WRONG
    if arguments.format == "json":
        return write(measured_json(values, found), status)
    style = style_of(sys.stdout)
    return write(measured_text(text(style), found, style) or empty, status)
