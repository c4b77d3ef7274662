"""The commands that measure: `bench`, `stability` and `diet`, with what they record and check.

Nothing heavy is imported before the command that needs it runs.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from coursebuild.cli.commands import options_of
from coursebuild.cli.output import CLEAN, WRONG, style_of, write

if TYPE_CHECKING:
    from coursebuild.pipeline.bench import Benched
    from coursebuild.pipeline.options import Options
    from coursebuild.pipeline.stability import Cases

_RECORDED = ("failures", "checked", "remarks")
"""What commands say of recorded reports."""
_NOTHING_TO_MEASURE = "there is no model to measure\n"


def bench(arguments: argparse.Namespace) -> int:
    """Report speed against error of the course's models."""
    from msgspec.structs import replace

    from coursebuild.pipeline.bench import plot_file, write_plots
    from coursebuild.report.bench import bench_text
    from coursebuild.report.bench_json import bench_values
    from coursebuild.report.measuring import measured_json, measured_text

    options = options_of(arguments)
    plot = None if arguments.plot is None else plot_file(arguments.plot)
    try:
        found = _benched(options, arguments)
        if plot is not None:
            found = replace(found, remarks=(*found.remarks, *write_plots(plot, found.scenes)))
    finally:
        options.store.close()
    status = CLEAN if found.ok else WRONG
    around = {name: getattr(found, name) for name in ("diagnostics", *_RECORDED)}
    if arguments.format == "json":
        return write(measured_json(bench_values(found.scenes), **around), status)
    style = style_of(sys.stdout)
    shown = bench_text(() if arguments.check else found.scenes, style)
    return write(measured_text(shown, style, **around) or _NOTHING_TO_MEASURE, status)


def _benched(options: Options, arguments: argparse.Namespace) -> Benched:
    from coursebuild.pipeline import bench as benching

    names, quick = tuple(arguments.scenes), arguments.quick
    if arguments.record:
        return benching.record(options, names, quick=quick)
    if arguments.check:
        return benching.check(options, names, quick=quick)
    return benching.bench(options, names, quick=quick)


def stability(arguments: argparse.Namespace) -> int:
    """Measure MuJoCo on hard cases, beside theory."""
    from coursebuild.report.measuring import measured_json, measured_text, stability_text
    from coursebuild.report.values import json_text

    options = options_of(arguments)
    try:
        found = _cases(options, arguments)
    finally:
        options.store.close()
    status = CLEAN if found.ok else WRONG
    around = {name: getattr(found, name) for name in _RECORDED}
    if arguments.format == "json":
        if arguments.record or arguments.check:
            return write(measured_json({"cases": found.cases}, **around), status)
        return write(json_text(found.cases), status)
    style = style_of(sys.stdout)
    shown = stability_text(() if arguments.check else found.cases, style)
    return write(measured_text(shown, style, **around), status)


def _cases(options: Options, arguments: argparse.Namespace) -> Cases:
    from coursebuild.pipeline.stability import Cases, check_stability, record_stability
    from coursebuild.pipeline.stability import stability as measured

    names = tuple(arguments.problems)
    if arguments.record:
        return record_stability(options, names)
    if arguments.check:
        return check_stability(options, names)
    return Cases(measured(options, names))


def diet(arguments: argparse.Namespace) -> int:
    """Say what models hold that their scenarios do not need."""
    from coursebuild.pipeline import diet as dieting
    from coursebuild.report.diet import diet_text, diet_values
    from coursebuild.report.measuring import measured_json, measured_text

    options = options_of(arguments)
    work = dieting.fix if arguments.fix else dieting.record if arguments.record else dieting.diet
    try:
        found = work(options, tuple(arguments.models), quick=arguments.quick)
    finally:
        options.store.close()
    status = CLEAN if found.ok else WRONG
    if options.quiet and arguments.format == "text":
        if found.ok:
            return status
        found = found.wrong
    around = {name: getattr(found, name) for name in ("diagnostics", "failures", "remarks")}
    if arguments.format == "json":
        return write(measured_json(diet_values(found.reports), **around), status)
    style = style_of(sys.stdout)
    told = measured_text(diet_text(found.reports, style), style, **around)
    return write(told or "there is no model to look at\n", status)
