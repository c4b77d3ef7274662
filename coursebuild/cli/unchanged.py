"""Recognizes a command that has nothing to do, before its arguments are parsed.

Entry points: `previous_output`, what such a command prints; `run_unless_unchanged`, which stores
it; `split_directory`, which finds the course's folder among the arguments.

A command is identified by its arguments as they were given, and by whatever else decides what it
prints. Parsing arguments takes longer than looking at the files of a course; so a command that is
spelled in another way counts as another command.
"""

from __future__ import annotations

import os
import sys

from coursebuild.cli.output import print_report, report_text, terminal_style
from coursebuild.core.engine.up_to_date import Watcher, unchanged
from coursebuild.core.files.course_root import find_course_root

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report

_NO_CACHE = "--no-cache"
_VARIABLES = ("COURSEBUILD_CACHE", "COURSEBUILD_CACHE_KEY", "COURSEBUILD_CACHE_SIZE")
"""Environment variables that replace arguments."""


def split_directory(all_words: Sequence[str]) -> tuple[str | None, list[str]]:
    """Return the folder that `-C DIR` names, anywhere before `--`, and all other words."""
    directory, words = None, []
    rest = iter(all_words)
    for word in rest:
        if word == "--":
            words += [word, *rest]
        elif word[:2] != "-C":
            words.append(word)
        elif word != "-C":
            directory = word[2:]
        elif (folder := next(rest, None)) is not None:
            directory = folder
        else:  # the parser reports it
            words.append(word)
    return directory, words


def previous_output(directory: str | None, words: Sequence[str]) -> str | None:
    """Return what this command printed when all was as it is now; `None` if that is unknown."""
    command = _identify_command(words)
    if command is None or _NO_CACHE in words:  # most commands store nothing
        return None
    try:
        root = find_course_root(".") if directory is None else directory or "."
        return unchanged(os.path.realpath(root), command) if root else None
    except OSError:  # the working directory is gone, for one
        return None


def run_unless_unchanged(
    arguments: argparse.Namespace,
    outputs: tuple[str, ...],
    work: Callable[[Options], Report],
) -> int:
    """Do the work; if it succeeds, the same command has nothing to do while nothing changes.

    `outputs` are the folders that the command writes.
    """
    from coursebuild.cli.arguments import options_of

    options = options_of(arguments)
    command = _identify_command(arguments.words)
    watcher = None if command is None else Watcher(str(options.root), command)
    report = work(options)
    status = print_report(report, "text", options)
    if watcher is not None and report.ok and report.depends is not None:
        from coursebuild.core.registry import package_paths
        from coursebuild.report import unchanged_report

        remark = f"nothing has changed since the last {arguments.words[0]}"
        output = report_text(unchanged_report(report, remark), "text", options)
        watcher.keep(output, (*report.depends, *package_paths()), outputs)
    return status


def _identify_command(words: Sequence[str]) -> tuple[str, ...] | None:
    """The identity of a command; `None` where it cannot have one.

    The course is no part of it, since its folder holds what was printed.
    """
    relevant_words = [word for word in words if word != _NO_CACHE]
    conditions = [*terminal_style(sys.stdout), *map(os.environ.get, _VARIABLES)]
    if any("/" in w or os.sep in w or os.path.exists(w) for w in relevant_words):  # noqa: PTH110
        try:
            conditions.append(os.getcwd())  # noqa: PTH109  # from where paths are meant
        except OSError:
            return None
    return (*relevant_words, *map(repr, conditions))
