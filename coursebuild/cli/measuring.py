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
    from coursebuild.pipeline.recorded_cases import Cases


def bench(arguments: argparse.Namespace) -> int:
    """Report speed against error of the course's models."""
    from msgspec.structs import replace

    from coursebuild.pipeline.plots import plot_file, write_plots
    from coursebuild.report.measured import bench_report, bench_values

    options = options_of(arguments)
    plot = None if arguments.plot is None else plot_file(arguments.plot)
    try:
        found = _benched(options, arguments)
        if plot is not None:
            found = replace(found, remarks=(*found.remarks, *write_plots(plot, found.scenes)))
    finally:
        options.store.close()
    status = CLEAN if found.ok else WRONG
    parts = (found.diagnostics, found.failures, found.checked, found.remarks)
    if arguments.format == "json":
        return write(bench_values(found.scenes, *parts), status)
    shown = () if arguments.check else found.scenes
    return write(bench_report(shown, *parts, style_of(sys.stdout)), status)


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
    from coursebuild.report.measured import cases_report, cases_values

    options = options_of(arguments)
    try:
        found = _cases(options, arguments)
    finally:
        options.store.close()
    status = CLEAN if found.ok else WRONG
    parts = (found.failures, found.checked, found.remarks)
    if arguments.format == "json":
        recorded = arguments.record or arguments.check
        return write(cases_values(found.cases, *parts, recorded=recorded), status)
    shown = () if arguments.check else found.cases
    return write(cases_report(shown, *parts, style_of(sys.stdout)), status)


def _cases(options: Options, arguments: argparse.Namespace) -> Cases:
    from coursebuild.pipeline.recorded_cases import Cases, check_stability, record_stability
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
    from coursebuild.report.diet import diet_report, diet_values

    options = options_of(arguments)
    work = dieting.fix if arguments.fix else dieting.record if arguments.record else dieting.diet
    try:
        found = work(options, tuple(arguments.models), quick=arguments.quick)
    finally:
        options.store.close()
    status = CLEAN if found.ok else WRONG
    if arguments.format == "json":
        parts = (found.reports, found.diagnostics, found.failures, found.remarks)
        return write(diet_values(*parts), status)
    if options.quiet:
        if found.ok:
            return status
        found = found.wrong
    parts = (found.reports, found.diagnostics, found.failures, found.remarks)
    return write(diet_report(*parts, style_of(sys.stdout)), status)
