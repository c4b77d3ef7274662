"""One function for each command: its arguments → pipeline → exit status.

Nothing heavy is imported before the command that needs it runs.
"""

from __future__ import annotations

import argparse
import os
import sys

from coursebuild.cli.output import CLEAN, USAGE, fail, print_report, report_text, style_of, write

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from collections.abc import Callable

    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report


def options_of(arguments: argparse.Namespace) -> Options:
    """What the arguments say to every command."""
    from coursebuild.pipeline.options import Options, find_course, open_executor, open_store

    jobs = getattr(arguments, "jobs", None) or available_cores()
    root = find_course(arguments.root)
    store = None
    if hasattr(arguments, "cache"):
        fresh = arguments.no_cache
        store = open_store(root, arguments.cache, arguments.cache_size, os.environ, fresh=fresh)
    where = getattr(arguments, "executor", None)
    executor = None if where is None else open_executor(where)
    long = getattr(arguments, "long", False)
    return Options(root, jobs, arguments.quiet, store, executor, long)


def available_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return os.cpu_count() or 1


def check_command(arguments: argparse.Namespace) -> int:
    """Verify, publish nothing."""
    if arguments.against is not None:
        return _against(arguments)

    def work(options: Options) -> Report:
        from coursebuild.pipeline.check import check
        from coursebuild.pipeline.shards import read_shard

        part = read_shard(arguments.shard, arguments.timings)
        lessons = tuple(arguments.lessons)
        return check(
            options,
            lessons,
            shard=part,
            timings=arguments.write_timings,
            sensitivity=arguments.sensitivity,
            truth=arguments.truth,
        )

    # Machines are told how long it took.
    parts = arguments.shard or arguments.timings or arguments.write_timings
    if (
        arguments.format != "text"
        or parts
        or any((arguments.sensitivity, arguments.truth, arguments.long))
    ):
        options = options_of(arguments)
        return print_report(work(options), arguments.format, options)
    return _once_while_unchanged(arguments, "check", ("examples",), work)


def _against(arguments: argparse.Namespace) -> int:
    """Tell what the scripts do with another version of MuJoCo; no difference is a mistake."""
    from coursebuild.pipeline.against import against, forbid
    from coursebuild.report.against import against_json, against_text

    forbid(arguments.format not in ("text", "json"), f"--format {arguments.format}")
    forbid(arguments.executor is not None, "--executor")
    forbid(arguments.shard is not None, "--shard")
    forbid(bool(arguments.timings), "--timings")
    forbid(arguments.write_timings is not None, "--write-timings")
    forbid(arguments.sensitivity, "--sensitivity")
    forbid(arguments.truth, "--truth")
    options = options_of(arguments)
    try:
        report = against(options, tuple(arguments.lessons), arguments.against)
    finally:
        options.store.close()
    if arguments.format == "json":
        return write(against_json(report), CLEAN)
    return write(against_text(report, style_of(sys.stdout), quiet=options.quiet), CLEAN)


def build_command(arguments: argparse.Namespace) -> int:
    """Verify everything and publish the site."""
    out: str = arguments.out

    def work(options: Options) -> Report:
        from pathlib import Path

        from coursebuild.pipeline.build import build

        return build(options, Path(out))

    return _once_while_unchanged(arguments, "build", ("examples", out), work)


def _once_while_unchanged(
    arguments: argparse.Namespace,
    name: str,
    made: tuple[str, ...],
    work: Callable[[Options], Report],
) -> int:
    """Do the work; where all is well, the same command has nothing to do as long as all stays so.

    `made` is what the command leaves behind.
    """
    from coursebuild.cli.unchanged import command_of
    from coursebuild.core.engine.up_to_date import Watcher

    options = options_of(arguments)
    command = command_of(arguments.given)
    watcher = None if command is None else Watcher(str(options.root), command)
    report = work(options)
    status = print_report(report, "text", options)
    if watcher is not None and report.ok and report.depends is not None:
        from coursebuild.core.registry import package_paths
        from coursebuild.report import unchanged_report

        remark = f"nothing has changed since the last {name}"
        said = report_text(unchanged_report(report, remark), options)
        watcher.keep(said, (*report.depends, *package_paths()), made)
    return status


def update_command(arguments: argparse.Namespace) -> int:
    """Bring recorded outputs up to date."""
    from coursebuild.pipeline.update import update

    options = options_of(arguments)
    return print_report(
        update(options, tuple(arguments.lessons), dry_run=arguments.dry_run), "text", options
    )


def extract_command(arguments: argparse.Namespace) -> int:
    """Write the scripts to `examples/`."""
    from coursebuild.pipeline.extract import extract

    options = options_of(arguments)
    return print_report(extract(options, adopt=arguments.adopt), "text", options)


def export_command(arguments: argparse.Namespace) -> int:
    """Write the course as one file."""
    from pathlib import Path

    from coursebuild.pipeline.export import export

    options = options_of(arguments)
    out = Path(arguments.out) if arguments.out else None
    return print_report(export(options, arguments.name, out), "text", options)


def serve_command(arguments: argparse.Namespace) -> int:
    """Preview."""
    from coursebuild.preview.serve import serve

    serve(options_of(arguments), arguments.port)
    return CLEAN


def import_command(arguments: argparse.Namespace) -> int:
    """Make a course of one that was written for another tool."""
    from pathlib import Path

    from coursebuild.core.files.errors import UsageError
    from coursebuild.importer.command import import_course
    from coursebuild.pipeline.options import Options, open_store

    if arguments.root is not None:
        raise UsageError("import takes no -C: the new course's folder is named by --out")
    source = Path(arguments.folder)
    out = Path(arguments.out or source.resolve().name).absolute()
    store = open_store(
        out, arguments.cache, arguments.cache_size, os.environ, fresh=arguments.no_cache
    )
    options = Options(out, arguments.jobs or available_cores(), arguments.quiet, store)
    return print_report(import_course(source, options), "text", options)


def explain_command(arguments: argparse.Namespace) -> int:
    """Say why something would run again, and what depends on it."""
    from coursebuild.pipeline.explain import explain
    from coursebuild.report.explained import explained_text
    from coursebuild.report.values import json_text

    explanation = explain(options_of(arguments), arguments.path)
    if arguments.format == "json":
        return write(json_text(explanation), CLEAN)
    return write(explained_text(explanation, style_of(sys.stdout)), CLEAN)


def bench_command(arguments: argparse.Namespace) -> int:
    """Report speed against error of the course's models."""
    from coursebuild.cli import measuring

    return measuring.bench(arguments)


def stability_command(arguments: argparse.Namespace) -> int:
    """Measure MuJoCo on hard cases, beside theory."""
    from coursebuild.cli import measuring

    return measuring.stability(arguments)


def diet_command(arguments: argparse.Namespace) -> int:
    """Say what models hold that their scenarios do not need."""
    from coursebuild.cli import measuring

    return measuring.diet(arguments)


def schema_command(arguments: argparse.Namespace) -> int:
    """Print a JSON Schema."""
    from coursebuild.core.syntax.schemas import json_schema, schema_roots

    names = sorted(schema_roots())
    if arguments.name not in names:
        return fail(USAGE, f"there is no schema {arguments.name!r}: choose from {', '.join(names)}")
    return write(json_schema(arguments.name).decode(), CLEAN)
