"""A command with nothing to do: known before its arguments are read.

Entry points: `said_before`, what it says then; `run_unless_unchanged`, which keeps that.

It goes by the arguments as they were given, and by what else decides what is printed. To read
arguments takes longer than to look at the files of a course; a command that is spelled in another
way is another command here.
"""

from __future__ import annotations

import os
import sys

from coursebuild.cli.output import look, print_report, report_text
from coursebuild.core.engine.up_to_date import unchanged
from coursebuild.core.files.course_root import find_course_root

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report

COMMANDS = ("build", "check")
"""Those that may have nothing to do."""
_ALL_ANEW = "--no-cache"
_VARIABLES = ("COURSEBUILD_CACHE", "COURSEBUILD_CACHE_SIZE")
"""Of the environment: what says the same as arguments."""


def said_before(given: Sequence[str]) -> str | None:
    """What this command said when all was as it is now; `None` where that is not known."""
    command = _command_of(given)
    if command is None or _ALL_ANEW in given:
        return None
    try:
        root = (given[1] or ".") if given[0] == "-C" else find_course_root(".")
        return unchanged(os.path.realpath(root), command) if root else None
    except OSError:  # the working directory is gone, for one
        return None


def run_unless_unchanged(
    arguments: argparse.Namespace,
    name: str,
    made: tuple[str, ...],
    work: Callable[[Options], Report],
) -> int:
    """Do the work; where all is well, the same command has nothing to do as long as all stays so.

    `made` is what the command leaves behind.
    """
    from coursebuild.cli.arguments import options_of
    from coursebuild.core.engine.up_to_date import Watcher

    options = options_of(arguments)
    command = _command_of(arguments.given)
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


def _command_of(given: Sequence[str]) -> tuple[str, ...] | None:
    """The name of a command; `None` where it always works.

    Which course is meant is no part of it, since what was said is kept there.
    """
    own = given[2:] if given and given[0] == "-C" else given
    if not own or own[0] not in COMMANDS:
        return None
    words = [word for word in own if word != _ALL_ANEW]
    around = [*look(sys.stdout), *map(os.environ.get, _VARIABLES)]
    if any("/" in w or os.sep in w or os.path.exists(w) for w in words):  # noqa: PTH110
        try:
            around.append(os.getcwd())  # noqa: PTH109  # from where paths are meant
        except OSError:
            return None
    return (*words, *map(repr, around))
