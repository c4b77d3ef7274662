"""What can be said on the command line.

Entry point: `parser()`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

from coursebuild.cli.commands import (
    bench_command,
    build_command,
    check_command,
    diet_command,
    explain_command,
    export_command,
    extract_command,
    schema_command,
    serve_command,
    stability_command,
    update_command,
)


def parser() -> argparse.ArgumentParser:
    """What can be said, each command with the function that does it."""
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
    commands = parser.add_subparsers(
        title="commands", metavar="COMMAND", required=True, prog=parser.prog
    )
    build = _command(commands, "build", build_command, "verify everything and publish the site")
    build.add_argument(
        "--out",
        default="public",
        metavar="FOLDER",
        help="where the site goes, from the course's folder (default: %(default)s)",
    )
    check = _command(commands, "check", check_command, "verify, publish nothing")
    _lessons(check)
    _format(check)
    _parts(check)
    check.add_argument(
        "--executor",
        metavar="PLACE",
        default=None,
        help="run the scripts on a Dask cluster: dask://HOST:PORT",
    )
    check.add_argument(
        "--sensitivity",
        action="store_true",
        help="move initial states by 1e-12, and say which printed digits hold",
    )
    check.add_argument(
        "--against",
        metavar="VERSION",
        default=None,
        help="run the scripts with this version of MuJoCo, and say what it changes",
    )
    update = _command(commands, "update", update_command, "bring recorded outputs up to date")
    _lessons(update)
    update.add_argument(
        "--dry-run", action="store_true", help="show what would change; write nothing"
    )
    extract = _command(
        commands, "extract", extract_command, "write the scripts to examples/", runs=False
    )
    extract.add_argument(
        "--adopt",
        action="store_true",
        help="bring extracted files that were edited by hand back into their lessons",
    )
    serve = _command(
        commands,
        "serve",
        serve_command,
        "preview: build, serve, rebuild and reload on change",
    )
    serve.add_argument(
        "--port",
        type=_port,
        default=8000,
        help="port on 127.0.0.1 (default: %(default)s; 0: any free one)",
    )
    export = _command(
        commands,
        "export",
        export_command,
        "verify everything and write an archive for learning platforms",
    )
    export.add_argument(
        "kind",
        choices=("qti", "scorm"),
        help="the quizzes as IMS QTI 2.1, or the course as SCORM 1.2",
    )
    export.add_argument(
        "--out",
        default=None,
        metavar="FILE",
        help="from the course's folder (default: quizzes-qti.zip, course-scorm.zip)",
    )
    explain = commands.add_parser(
        "explain",
        help="say why something would run again, and what depends on it",
        description="Say whether a script or lab would run again and why, and what depends on it.",
        allow_abbrev=False,
    )
    explain.add_argument(
        "path",
        metavar="PATH",
        help="a script, lab, lesson, page, model, or any file of the project",
    )
    explain.add_argument(
        "--format", choices=("text", "json"), default="text", help="(default: %(default)s)"
    )
    explain.set_defaults(command=explain_command, quiet=False)
    bench = _command(
        commands,
        "bench",
        bench_command,
        "measure speed against error of the course's models",
        runs=False,
    )
    bench.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a model, as in models/SCENE.xml (default: all)"
    )
    bench.add_argument(
        "--format", choices=("text", "json"), default="text", help="(default: %(default)s)"
    )
    bench.add_argument(
        "--quick", action="store_true", help="fewer settings and rough times, for a first look"
    )
    bench.add_argument(
        "--plot",
        metavar="FILE.svg",
        default=None,
        help="draw error against cost; of several scenarios each into a file of its own",
    )
    _recorded(bench)
    _cache(bench)
    stability = _command(
        commands,
        "stability",
        stability_command,
        "measure MuJoCo on hard cases, beside theory",
        runs=False,
    )
    stability.add_argument(
        "problems", nargs="*", metavar="PROBLEM", help="a hard case or a family (default: all)"
    )
    stability.add_argument(
        "--format", choices=("text", "json"), default="text", help="(default: %(default)s)"
    )
    _recorded(stability)
    _cache(stability)
    diet = _command(
        commands,
        "diet",
        diet_command,
        "say what models hold that their scenarios do not need",
        runs=False,
    )
    diet.add_argument("models", nargs="*", metavar="MODEL", help="a file of models/ (default: all)")
    writes = diet.add_mutually_exclusive_group()
    writes.add_argument(
        "--fix", action="store_true", help="change what leaves every bit of the motion as it is"
    )
    writes.add_argument(
        "--record", action="store_true", help="write what was found to content/reports/"
    )
    diet.add_argument("--quick", action="store_true", help="short runs, rough times")
    diet.add_argument(
        "--format", choices=("text", "json"), default="text", help="(default: %(default)s)"
    )
    _cache(diet)
    schema = commands.add_parser(
        "schema", help="print a JSON Schema for an editor", allow_abbrev=False
    )
    schema.add_argument("name", choices=("quiz", "lab", "course", "model"))
    schema.set_defaults(command=schema_command)
    return parser


def _recorded(parser: argparse.ArgumentParser) -> None:
    """What is done with reports in the course's folder."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--record", action="store_true", help="write what was measured into content/reports/"
    )
    group.add_argument(
        "--check",
        action="store_true",
        help="measure again, and fail where a figure is not as recorded; times never are compared",
    )


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
