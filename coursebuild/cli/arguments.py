"""What can be said on the command line.

Entry points: `parser(given)`; `options_of`, what arguments say to every command; and what several
commands take: `add_lessons`, `add_format` and others.

A command is a name, a summary, and a module with `declare(parser)`, which adds its arguments, and
`run(arguments)`, which gives the exit status. Features add theirs (`core.features.Command`). Only
the module of the command that is given is imported.
"""

from __future__ import annotations

import argparse
import importlib
import os
from collections.abc import Iterator, Sequence

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from coursebuild.pipeline.options import Options

_COMMANDS = {
    "build": "verify everything and publish the site",
    "check": "verify, publish nothing",
    "update": "bring recorded outputs up to date",
    "extract": "write the scripts to examples/",
    "serve": "preview: build, serve, rebuild and reload on change",
    "export": "verify everything and write the course as one file",
    "explain": "say why something would run again, and what depends on it",
    "schema": "print a JSON Schema for an editor",
}
"""Those of every course, each in the module of its name."""


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
    word = _command_word(given)
    for name, summary, module in _commands(with_features=word not in (*_COMMANDS, "--version")):
        if name != word:
            commands.add_parser(name, help=summary, add_help=False)
            continue
        command = commands.add_parser(name, help=summary, description=summary, allow_abbrev=False)
        code = importlib.import_module(module)
        command.set_defaults(command=code.run)
        code.declare(command)
    return parser


def _command_word(given: Sequence[str]) -> str:
    """The first word that is no folder behind `-C`; empty where there is none."""
    before = ("", *given)
    words = (word for last, word in zip(before, given, strict=False) if last != "-C")
    return next((word for word in words if word == "--version" or not word.startswith("-")), "")


def _commands(*, with_features: bool) -> Iterator[tuple[str, str, str]]:
    """Name, summary and module of each command."""
    for name, summary in _COMMANDS.items():
        yield name, summary, f"coursebuild.cli.{name}"
    if with_features:  # which takes longer than all the rest
        from coursebuild.core.registry import features

        for feature in features():
            for command in feature.commands:
                yield command.name, command.summary, command.module


def options_of(arguments: argparse.Namespace) -> Options:
    """What the arguments say to every command."""
    from coursebuild.pipeline.options import Options, find_course, open_store

    jobs = getattr(arguments, "jobs", None) or available_cores()
    root = find_course(arguments.root)
    store = None
    if hasattr(arguments, "cache"):
        fresh = arguments.no_cache
        store = open_store(root, arguments.cache, arguments.cache_size, os.environ, fresh=fresh)
    quiet, long = getattr(arguments, "quiet", False), getattr(arguments, "long", False)
    return Options(root, jobs, quiet, store, long)


def available_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return os.cpu_count() or 1


# --- what several commands take


def add_quiet(parser: argparse.ArgumentParser) -> None:
    """Whether only what is wrong is printed."""
    parser.add_argument("--quiet", "-q", action="store_true", help="print only what is wrong")


def add_cache(parser: argparse.ArgumentParser) -> None:
    """What is done with results that were made before."""
    parser.add_argument(
        "--cache",
        metavar="PLACE",
        help="share results at a folder or an URL such as s3://… (default: $COURSEBUILD_CACHE)",
    )
    parser.add_argument(
        "--no-cache",
        action="store_true",
        help="run and make everything again, and keep the new results",
    )
    parser.add_argument(
        "--cache-size",
        metavar="SIZE",
        help="what .coursebuild may take, such as 500M (default: $COURSEBUILD_CACHE_SIZE, or 1G)",
    )


def add_running(parser: argparse.ArgumentParser) -> None:
    """What commands take that run scripts."""
    add_quiet(parser)
    parser.add_argument(
        "--jobs",
        "-j",
        type=_jobs,
        metavar="N",
        help="scripts at a time (default: one a core)",
    )
    add_cache(parser)


def _jobs(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of jobs: a whole number from 1")
    return int(text)


def add_lessons(parser: argparse.ArgumentParser) -> None:
    """The lessons and pages that a command is about."""
    parser.add_argument(
        "lessons",
        nargs="*",
        metavar="LESSON",
        help="id, slug or file of a lesson or page (default: all)",
    )


def add_long(parser: argparse.ArgumentParser) -> None:
    """What is done with scripts of which the course keeps a run."""
    parser.add_argument(
        "--long", action="store_true", help="run scripts too that are recorded once"
    )


def add_format(parser: argparse.ArgumentParser, *formats: str) -> None:
    """The formats of what is printed."""
    said = "(default: %(default)s)"
    parser.add_argument(
        "--format",
        choices=formats,
        default="text",
        help=f"how to print what was found {said}" if len(formats) > 2 else said,
    )
