"""The commands that measure: `bench`, `stability` and `diet`, with what they record and check.

Nothing heavy is imported before the command that needs it runs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from coursebuild.cli.commands import options_of
from coursebuild.cli.output import CLEAN, WRONG, style_of, write

if TYPE_CHECKING:
    from coursebuild.pipeline.options import Options
    from coursebuild.report.measuring import Measurement
    from coursebuild.report.terminal import Style


def bench(arguments: argparse.Namespace) -> int:
    """Report speed against error of the course's models."""
    from msgspec.structs import replace

    from coursebuild.pipeline import bench as benching
    from coursebuild.report.bench import bench_text
    from coursebuild.report.bench_json import bench_values

    plot = None if arguments.plot is None else benching.plot_file(arguments.plot)

    def measure(options: Options) -> Measurement[Any]:
        names, quick = tuple(arguments.scenes), arguments.quick
        if arguments.check:
            found = benching.check(options, names, quick=quick)
        else:
            found = benching.bench(options, names, quick=quick, record=arguments.record)
        if plot is None:
            return found
        return replace(found, remarks=(*found.remarks, *benching.write_plots(plot, found.reports)))

    _, found = _measured(arguments, measure)
    shown = () if arguments.check else found.reports
    return _write(
        arguments,
        found,
        lambda style: bench_text(shown, style),
        bench_values(found.reports),
        empty="there is no model to measure\n",
    )


def stability(arguments: argparse.Namespace) -> int:
    """Measure MuJoCo on hard cases, beside theory."""
    from coursebuild.pipeline import stability as cases
    from coursebuild.report.measuring import stability_text
    from coursebuild.report.values import json_text

    def measure(options: Options) -> Measurement[Any]:
        names = tuple(arguments.problems)
        if arguments.check:
            return cases.check_stability(options, names)
        return cases.stability(options, names, record=arguments.record)

    _, found = _measured(arguments, measure)
    if arguments.format == "json" and not (arguments.record or arguments.check):
        return write(json_text(found.reports), CLEAN)
    shown = () if arguments.check else found.reports
    values = {"cases": found.reports}
    return _write(arguments, found, lambda style: stability_text(shown, style), values)


def diet(arguments: argparse.Namespace) -> int:
    """Say what models hold that their scenarios do not need."""
    from msgspec.structs import replace

    from coursebuild.pipeline.diet import diet
    from coursebuild.report.diet import diet_text, diet_values

    how = {name: getattr(arguments, name) for name in ("quick", "fix", "record")}
    options, found = _measured(
        arguments, lambda options: diet(options, tuple(arguments.models), **how)
    )
    if options.quiet and arguments.format == "text":
        if found.ok:
            return CLEAN
        found = replace(found, reports=tuple(one for one in found.reports if not one.ok))
    return _write(
        arguments,
        found,
        lambda style: diet_text(found.reports, style),
        diet_values(found.reports),
        empty="there is no model to look at\n",
    )


def _measured(
    arguments: argparse.Namespace, measure: Callable[[Options], Measurement[Any]]
) -> tuple[Options, Measurement[Any]]:
    options = options_of(arguments)
    try:
        return options, measure(options)
    finally:
        options.store.close()


def _write(
    arguments: argparse.Namespace,
    found: Measurement[Any],
    text: Callable[[Style], str],
    values: Mapping[str, object],
    *,
    empty: str = "",
) -> int:
    """Print what was measured, as text or as JSON; the exit status."""
    from coursebuild.report.measuring import measured_json, measured_text

    status = CLEAN if found.ok else WRONG
    if arguments.format == "json":
        return write(measured_json(values, found), status)
    style = style_of(sys.stdout)
    return write(measured_text(text(style), found, style) or empty, status)
