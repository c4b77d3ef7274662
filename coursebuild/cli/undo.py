"""`coursebuild undo`: undo the last change of `check --fix` or of a click in the preview."""

from __future__ import annotations

import argparse

from coursebuild.core.files.write import take_back
from coursebuild.output import CLEAN, FAILURE, fail, write
from coursebuild.pipeline.options import Progress, find_course

EXAMPLES = """\
examples:
  coursebuild undo                after `check --fix`, or *Fix it* in the preview
"""


_HELP = "what `check --fix` changed can be undone, and what was fixed or accepted in the preview"


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare no arguments."""


def run(arguments: argparse.Namespace) -> int:
    """Give the files their texts of before; those that were edited since stay."""
    outcome = take_back(find_course(arguments.root), Progress().say)
    if outcome is None:
        return fail(FAILURE, "there is nothing to undo", _HELP)
    restored_paths, edited_paths = outcome
    status = write("".join(f"restored {path}\n" for path in restored_paths), CLEAN)
    for path in edited_paths:
        status = fail(FAILURE, f"{path} has been edited since, and was left as it is")
    return status
