"""The command line: arguments → pipeline → exit status.

Entry point: `main(arguments)`. Exit status 0: clean; 1: something is wrong in the course; 2: wrong
usage. Heavy imports happen in the command that needs them.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

from coursebuild.effects.errors import EffectError, PublishRefusedError, reason

if TYPE_CHECKING:
    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report, Style

CLEAN, WRONG, USAGE, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143


class _Terminated(KeyboardInterrupt):
    """Somebody asked this process to end: what it has begun is cleaned up, as after Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name; gives the exit status."""
    before = _heed_sigterm()
    collected = gc.get_threshold()
    # What a command makes lives until its end, and hardly any of it is in cycles.
    gc.set_threshold(200_000, 50, 50)
    try:
        return _main(arguments)
    finally:
        gc.set_threshold(*collected)
        if before is not None:
            signal.signal(signal.SIGTERM, before)


def _heed_sigterm() -> Any:
    """Make SIGTERM an exception; gives the handler there was, or nothing where it is left alone."""
    if threading.current_thread() is not threading.main_thread():
        return None

    def terminate(*_: object) -> NoReturn:
        raise _Terminated

    return signal.signal(signal.SIGTERM, terminate)


def _main(arguments: Sequence[str] | None) -> int:
    _utf8_streams()
    options = _parser().parse_args(arguments)
    from coursebuild.pipeline.options import UsageError

    try:
        command: Callable[[argparse.Namespace], int] = options.command
        return command(options)
    except UsageError as error:
        return _fail(USAGE, str(error))
    except PublishRefusedError as error:
        return _fail(USAGE, error.message, error.help)
    except EffectError as error:
        return _fail(WRONG, error.message, error.help)
    except _Terminated:
        return _say(TERMINATED, "terminated")
    except KeyboardInterrupt:
        return _say(INTERRUPTED, "interrupted")


def _fail(status: int, message: str, help: str = "") -> int:
    return _say(status, f"coursebuild: {message}" + (f"\n  help: {help}" if help else ""))


def _say(status: int, text: str) -> int:
    if sys.stderr is not None:  # print would take standard output in its place
        with contextlib.suppress(OSError):  # nobody reads it; the status says it too
            print(text, file=sys.stderr, flush=True)
    return status


def _write(text: str, status: int) -> int:
    """Write to standard output; gives the status, another one where the text cannot be written."""
    if sys.stdout is None:  # closed by whoever started us
        return status
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has seen enough; what was found is as it was
        _forget_stdout()
    except OSError as error:
        _forget_stdout()
        return _fail(WRONG, f"standard output cannot be written: {reason(error)}")
    return status


def _forget_stdout() -> None:
    """Python writes what is left once more when it ends, and would complain."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


def _utf8_streams() -> None:
    """Reports hold whatever a lesson holds, so they are UTF-8 whatever the locale says."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(encoding="utf-8", errors="replace")


# --- arguments


def _parser() -> argparse.ArgumentParser:
    from coursebuild import __version__

    parser = argparse.ArgumentParser(
        prog="coursebuild",
        description="Build a course of executable lessons: every recorded output is verified.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "-C",
        dest="root",
        metavar="DIR",
        help="the course's folder (default: the nearest one with content/course.toml)",
    )
    parser.add_argument("--version", action="version", version=f"coursebuild {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    build = _command(commands, "build", _build, "verify everything and publish the site")
    build.add_argument(
        "--out",
        default="public",
        metavar="FOLDER",
        help="where the site goes, from the course's folder (default: %(default)s)",
    )
    check = _command(commands, "check", _check, "verify, publish nothing")
    _lessons(check)
    _format(check)
    _parts(check)
    update = _command(commands, "update", _update, "bring recorded outputs up to date")
    _lessons(update)
    update.add_argument(
        "--dry-run", action="store_true", help="show what would change; write nothing"
    )
    extract = _command(commands, "extract", _extract, "write the scripts to examples/", runs=False)
    extract.add_argument(
        "--adopt",
        action="store_true",
        help="bring extracted files that were edited by hand back into their lessons",
    )
    serve = _command(
        commands, "serve", _serve, "preview: build, serve, rebuild and reload on change"
    )
    serve.add_argument(
        "--port",
        type=_port,
        default=8000,
        help="port on 127.0.0.1 (default: %(default)s; 0: any free one)",
    )
    explain = commands.add_parser(
        "explain",
        help="say why something would run again, and what depends on it",
        description="Say whether a script or lab would run again and why, and what depends on it.",
        allow_abbrev=False,
    )
    explain.add_argument(
        "path", metavar="PATH", help="a script, lesson, page, model, or any file of the project"
    )
    explain.add_argument(
        "--format", choices=("text", "json"), default="text", help="(default: %(default)s)"
    )
    explain.set_defaults(command=_explain, quiet=False)
    schema = commands.add_parser(
        "schema", help="print a JSON Schema for an editor", allow_abbrev=False
    )
    schema.add_argument("name", choices=("quiz", "lab", "course"))
    schema.set_defaults(command=_schema)
    return parser


def _cache(parser: argparse.ArgumentParser) -> None:
    """What is done with results that were made before."""
    parser.add_argument(
        "--cache",
        metavar="PLACE",
        default=None,
        help="share results at a folder or an URL such as s3://… (default: $COURSEBUILD_CACHE)",
    )
    parser.add_argument(
        "--no-cache",
        action="store_true",
        help="run and make everything again, and keep the new results",
    )
    parser.add_argument(
        "--cache-size",
        default=None,
        metavar="SIZE",
        help="what .coursebuild may take, such as 500M (default: $COURSEBUILD_CACHE_SIZE, or 1G)",
    )


def _command(
    commands: argparse._SubParsersAction[argparse.ArgumentParser],
    name: str,
    function: Callable[[argparse.Namespace], int],
    summary: str,
    *,
    runs: bool = True,
) -> argparse.ArgumentParser:
    parser = commands.add_parser(name, help=summary, description=summary, allow_abbrev=False)
    parser.set_defaults(command=function)
    parser.add_argument("--quiet", "-q", action="store_true", help="print only what is wrong")
    if runs:
        parser.add_argument(
            "--jobs",
            "-j",
            type=_jobs,
            default=None,
            metavar="N",
            help="scripts at a time (default: one a core)",
        )
        _cache(parser)
    return parser


def _lessons(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "lessons",
        nargs="*",
        metavar="LESSON",
        help="id, slug or file of a lesson or page (default: all)",
    )


def _format(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--format",
        choices=("text", "json", "junit", "sarif", "github"),
        default="text",
        help="how to print what was found (default: %(default)s)",
    )


def _parts(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--shard",
        metavar="I/N",
        help="run only the I-th of N parts of the scripts and labs, for several machines",
    )
    parser.add_argument(
        "--timings",
        metavar="FILE",
        action="append",
        default=[],
        help="how long each takes, so that the parts take equally long; the same for each part",
    )
    parser.add_argument(
        "--write-timings", metavar="FILE", help="write how long each takes into this file"
    )


def _jobs(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of jobs: a whole number from 1")
    return int(text)


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is no port: a whole number from 0 to 65535")
    return int(text)


# --- commands


def _options(arguments: argparse.Namespace) -> Options:
    from coursebuild.pipeline.options import Options, find_course, open_store

    jobs = getattr(arguments, "jobs", None) or available_cores()
    root = find_course(arguments.root)
    store = None
    if hasattr(arguments, "cache"):
        fresh = arguments.no_cache
        store = open_store(root, arguments.cache, arguments.cache_size, os.environ, fresh=fresh)
    return Options(root, jobs, arguments.quiet, store)


def available_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return os.cpu_count() or 1


def _check(arguments: argparse.Namespace) -> int:
    def work(options: Options) -> Report:
        from coursebuild.pipeline.check import check
        from coursebuild.pipeline.shards import read_shard

        part = read_shard(arguments.shard, arguments.timings)
        lessons = tuple(arguments.lessons)
        return check(options, lessons, shard=part, timings=arguments.write_timings)

    # Machines are told how long it took.
    parts = arguments.shard or arguments.timings or arguments.write_timings
    if arguments.format != "text" or parts:
        options = _options(arguments)
        return _print(work(options), arguments.format, options)
    command = ("check", *arguments.lessons)
    return _unless_unchanged(arguments, command, ("examples",), work)


def _build(arguments: argparse.Namespace) -> int:
    def work(options: Options) -> Report:
        from pathlib import Path

        from coursebuild.pipeline.build import build

        return build(options, Path(arguments.out))

    return _unless_unchanged(arguments, ("build", arguments.out), ("examples", arguments.out), work)


def _unless_unchanged(
    arguments: argparse.Namespace,
    command: tuple[str, ...],
    made: tuple[str, ...],
    work: Callable[[Options], Report],
) -> int:
    """Do the work, unless all is as it was when it was last done and all was well.

    `made` is what the command leaves behind. Nothing is imported before it is needed.
    """
    from coursebuild.effects.place import course_above
    from coursebuild.effects.stamp import Watcher, unchanged

    colour, columns = _look(sys.stdout)
    command = (*command, str(arguments.quiet), str(colour), str(columns))
    root = arguments.root or course_above(".")
    said = None
    if root and not arguments.no_cache:
        said = unchanged(os.path.realpath(root), command)
    if said is not None:
        return _write(said, CLEAN)
    options = _options(arguments)
    watcher = Watcher(str(options.root), command)
    report = work(options)
    status = _print(report, "text", options)
    if report.ok and report.depends is not None:
        from coursebuild.report import unchanged_report

        remark = f"nothing has changed since the last {command[0]}"
        watcher.keep(_text(unchanged_report(report, remark), options), report.depends, made)
    return status


def _update(arguments: argparse.Namespace) -> int:
    from coursebuild.pipeline.update import update

    options = _options(arguments)
    return _print(
        update(options, tuple(arguments.lessons), dry_run=arguments.dry_run), "text", options
    )


def _extract(arguments: argparse.Namespace) -> int:
    from coursebuild.pipeline.extract import extract

    options = _options(arguments)
    return _print(extract(options, adopt=arguments.adopt), "text", options)


def _serve(arguments: argparse.Namespace) -> int:
    from coursebuild.pipeline.serve import serve

    options = _options(arguments)
    try:
        serve(options, arguments.port)
    finally:
        options.store.close()
    return CLEAN


def _explain(arguments: argparse.Namespace) -> int:
    from coursebuild.pipeline.explain import explain
    from coursebuild.report.explained import explained_json, explained_text

    explanation = explain(_options(arguments), arguments.path)
    if arguments.format == "json":
        return _write(explained_json(explanation), CLEAN)
    return _write(explained_text(explanation, _style(sys.stdout)), CLEAN)


def _schema(arguments: argparse.Namespace) -> int:
    from coursebuild.syntax.schemas import json_schema

    return _write(json_schema(arguments.name).decode(), CLEAN)


def _print(report: Report, form: str, options: Options) -> int:
    from coursebuild.report import FORMATS, render_report

    status = CLEAN if report.ok else WRONG
    options.store.close()
    if form == "text":
        return _write(_text(report, options), status)
    chosen = next(known for known in FORMATS if known == form)
    return _write(render_report(report, chosen, _style(sys.stdout)), status)


def _text(report: Report, options: Options) -> str:
    """The report as it is printed: only what is wrong, where the user wants no more."""
    from dataclasses import replace

    from coursebuild.report import render_report

    if options.quiet:
        if not report.diagnostics:
            return ""
        report = replace(report, scripts=(), labs=(), remarks=())
    return render_report(report, "text", _style(sys.stdout))


def _look(stream: TextIO | None) -> tuple[bool, int]:
    """Whether to colour, and how many columns there are.

    Colour only on a terminal whose user does not ask for none (https://no-color.org).
    """
    if stream is None or not stream.isatty():
        return False, 100
    import shutil

    colour = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    return colour, shutil.get_terminal_size((100, 24)).columns


def _style(stream: TextIO | None) -> Style:
    from coursebuild.report import Style

    return Style(*_look(stream))
