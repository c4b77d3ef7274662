"""A command with nothing to do: known before its arguments are read.

Entry points: `said_before`, what it says then; `run_unless_unchanged`, which keeps that;
`split_directory`, by which both know which course is meant.

It goes by the arguments as they were given, and by what else decides what is printed. To read
arguments takes longer than to look at the files of a course; a command that is spelled in another
way is another command here.
"""

from __future__ import annotations

import os
import sys

from coursebuild.cli.output import look, print_report, report_text
from coursebuild.core.engine.up_to_date import Watcher, unchanged
from coursebuild.core.files.course_root import find_course_root

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report

_ALL_ANEW = "--no-cache"
_VARIABLES = ("COURSEBUILD_CACHE", "COURSEBUILD_CACHE_KEY", "COURSEBUILD_CACHE_SIZE")
"""Of the environment: what says the same as arguments."""


def split_directory(given: Sequence[str]) -> tuple[str | None, list[str]]:
    """The folder that `-C DIR` names, wherever it stands before `--`, and all other words."""
    directory, words = None, []
    rest = iter(given)
    for word in rest:
        if word == "--":
            words += [word, *rest]
        elif word[:2] != "-C":
            words.append(word)
        elif word != "-C":
            directory = word[2:]
        elif (folder := next(rest, None)) is not None:
            directory = folder
        else:  # told by who reads the words
            words.append(word)
    return directory, words


def said_before(directory: str | None, words: Sequence[str]) -> str | None:
    """What this command said when all was as it is now; `None` where that is not known."""
    command = _command_of(words)
    if command is None or _ALL_ANEW in words:  # of most commands nothing is ever kept
        return None
    try:
        root = find_course_root(".") if directory is None else directory or "."
        return unchanged(os.path.realpath(root), command) if root else None
    except OSError:  # the working directory is gone, for one
        return None


def run_unless_unchanged(
    arguments: argparse.Namespace,
    made: tuple[str, ...],
    work: Callable[[Options], Report],
) -> int:
    """Do the work; where all is well, the same command has nothing to do as long as all stays so.

    `made` is what the command leaves behind.
    """
    from coursebuild.cli.arguments import options_of

    options = options_of(arguments)
    command = _command_of(arguments.words)
    watcher = None if command is None else Watcher(str(options.root), command)
    report = work(options)
    status = print_report(report, "text", options)
    if watcher is not None and report.ok and report.depends is not None:
        from coursebuild.core.registry import package_paths
        from coursebuild.report import unchanged_report

        remark = f"nothing has changed since the last {arguments.words[0]}"
        said = report_text(unchanged_report(report, remark), "text", options)
        watcher.keep(said, (*report.depends, *package_paths()), made)
    return status


def _command_of(words: Sequence[str]) -> tuple[str, ...] | None:
    """The name of a command; `None` where it cannot have one.

    Which course is meant is no part of it, since what was said is kept there.
    """
    own = [word for word in words if word != _ALL_ANEW]
    around = [*look(sys.stdout), *map(os.environ.get, _VARIABLES)]
    if any("/" in w or os.sep in w or os.path.exists(w) for w in own):  # noqa: PTH110
        try:
            around.append(os.getcwd())  # noqa: PTH109  # from where paths are meant
        except OSError:
            return None
    return (*own, *map(repr, around))
