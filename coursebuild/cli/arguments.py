"""What can be said on the command line.

Entry point: `parser(given)`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from coursebuild.cli.commands import (
    bench_command,
    build_command,
    check_command,
    diet_command,
    explain_command,
    export_command,
    extract_command,
    import_command,
    schema_command,
    serve_command,
    stability_command,
    update_command,
)


def parser(given: Sequence[str]) -> argparse.ArgumentParser:
    """What can be said, each command with the function that does it.

    Of a command whose name is not among what is given only that is told: to declare what else can
    be said to all of them takes as long as looking at every file of a course.
    """
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
    for name, summary, function, declare in _COMMANDS:
        if name not in given:
            commands.add_parser(name, help=summary, add_help=False)
            continue
        command = commands.add_parser(name, help=summary, description=summary, allow_abbrev=False)
        command.set_defaults(command=function)
        declare(command)
    return parser


# --- what each command takes


def _build(parser: argparse.ArgumentParser) -> None:
    _running(parser)
    parser.add_argument(
        "--out",
        default="public",
        metavar="FOLDER",
        help="where the site goes, from the course's folder (default: %(default)s)",
    )


def _check(parser: argparse.ArgumentParser) -> None:
    _running(parser)
    _lessons(parser)
    _format(parser, "text", "json", "junit", "sarif", "github")
    _parts(parser)
    parser.add_argument(
        "--executor",
        metavar="PLACE",
        default=None,
        help="run the scripts on a Dask cluster: dask://HOST:PORT",
    )
    _long(parser)
    parser.add_argument(
        "--sensitivity",
        action="store_true",
        help="move initial states by 1e-12, and say which printed digits hold",
    )
    parser.add_argument(
        "--truth",
        action="store_true",
        help="list the numbers and the arithmetic that nothing proves",
    )
    parser.add_argument(
        "--against",
        metavar="VERSION",
        default=None,
        help="run the scripts with this version of MuJoCo, and say what it changes",
    )


def _update(parser: argparse.ArgumentParser) -> None:
    _running(parser)
    _lessons(parser)
    _long(parser)
    parser.add_argument(
        "--dry-run", action="store_true", help="show what would change; write nothing"
    )


def _long(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--long", action="store_true", help="run scripts too that are recorded once"
    )


def _extract(parser: argparse.ArgumentParser) -> None:
    _quiet(parser)
    parser.add_argument(
        "--adopt",
        action="store_true",
        help="bring extracted files that were edited by hand back into their lessons",
    )


def _serve(parser: argparse.ArgumentParser) -> None:
    _running(parser)
    parser.add_argument(
        "--port",
        type=_port,
        default=8000,
        help="port on 127.0.0.1 (default: %(default)s; 0: any free one)",
    )


def _export(parser: argparse.ArgumentParser) -> None:
    from coursebuild.core.registry import features

    _running(parser)
    known = [exporter for feature in features() for exporter in feature.exporters]
    offers = ", ".join(f"{one.name} ({one.summary})" for one in known)
    files = ", ".join(one.file for one in known)
    parser.add_argument(
        "name", metavar="NAME", help=f"{offers}, or what a feature of the course itself can write"
    )
    parser.add_argument(
        "--out",
        default=None,
        metavar="FILE",
        help=f"from the course's folder (default: {files})",
    )


def _import(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Write a course of another tool as one of coursebuild: a course.json with Markdown, "
        "Jupyter notebooks, MyST or Quarto. Its folder is only read."
    )
    _running(parser)
    parser.add_argument("folder", metavar="FOLDER", help="what to import")
    parser.add_argument(
        "--out",
        default=None,
        metavar="FOLDER",
        help="where the new course goes (default: a folder of the same name here)",
    )


def _explain(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Say whether a script or lab would run again and why, and what depends on it."
    )
    parser.set_defaults(quiet=False)
    parser.add_argument(
        "path",
        metavar="PATH",
        help="a script, lab, lesson, page, model, or any file of the project",
    )
    _format(parser, "text", "json")


def _bench(parser: argparse.ArgumentParser) -> None:
    _quiet(parser)
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a model, as in models/SCENE.xml (default: all)"
    )
    _format(parser, "text", "json")
    parser.add_argument(
        "--quick", action="store_true", help="fewer settings and rough times, for a first look"
    )
    parser.add_argument(
        "--plot",
        metavar="FILE.svg",
        default=None,
        help="draw error against cost; of several scenarios each into a file of its own",
    )
    _recorded(parser)
    _cache(parser)


def _stability(parser: argparse.ArgumentParser) -> None:
    _quiet(parser)
    parser.add_argument(
        "problems", nargs="*", metavar="PROBLEM", help="a hard case or a family (default: all)"
    )
    _format(parser, "text", "json")
    _recorded(parser)
    _cache(parser)


def _diet(parser: argparse.ArgumentParser) -> None:
    _quiet(parser)
    parser.add_argument(
        "models", nargs="*", metavar="MODEL", help="a file of models/ (default: all)"
    )
    writes = parser.add_mutually_exclusive_group()
    writes.add_argument(
        "--fix", action="store_true", help="change what leaves every bit of the motion as it is"
    )
    writes.add_argument(
        "--record", action="store_true", help="write what was found to content/reports/"
    )
    parser.add_argument("--quick", action="store_true", help="short runs, rough times")
    _format(parser, "text", "json")
    _cache(parser)


def _schema(parser: argparse.ArgumentParser) -> None:
    parser.description = None
    parser.add_argument("name", metavar="NAME", help="lab, course, model, or of a feature, as quiz")


_COMMANDS = (
    ("build", "verify everything and publish the site", build_command, _build),
    ("check", "verify, publish nothing", check_command, _check),
    ("update", "bring recorded outputs up to date", update_command, _update),
    ("extract", "write the scripts to examples/", extract_command, _extract),
    ("serve", "preview: build, serve, rebuild and reload on change", serve_command, _serve),
    (
        "export",
        "verify everything and write the course as one file",
        export_command,
        _export,
    ),
    ("import", "make a course of one that was written for another tool", import_command, _import),
    (
        "explain",
        "say why something would run again, and what depends on it",
        explain_command,
        _explain,
    ),
    ("bench", "measure speed against error of the course's models", bench_command, _bench),
    ("stability", "measure MuJoCo on hard cases, beside theory", stability_command, _stability),
    ("diet", "say what models hold that their scenarios do not need", diet_command, _diet),
    ("schema", "print a JSON Schema for an editor", schema_command, _schema),
)


# --- what several take


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


def _quiet(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quiet", "-q", action="store_true", help="print only what is wrong")


def _running(parser: argparse.ArgumentParser) -> None:
    """What commands take that run scripts."""
    _quiet(parser)
    parser.add_argument(
        "--jobs",
        "-j",
        type=_jobs,
        default=None,
        metavar="N",
        help="scripts at a time (default: one a core)",
    )
    _cache(parser)


def _lessons(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "lessons",
        nargs="*",
        metavar="LESSON",
        help="id, slug or file of a lesson or page (default: all)",
    )


def _format(parser: argparse.ArgumentParser, *formats: str) -> None:
    said = "(default: %(default)s)"
    parser.add_argument(
        "--format",
        choices=formats,
        default="text",
        help=f"how to print what was found {said}" if len(formats) > 2 else said,
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
