"""`coursebuild init`: make a small complete course to begin with."""

from __future__ import annotations

import argparse
import os
import shlex
from pathlib import Path

from coursebuild import __version__
from coursebuild.cli.output import CLEAN, USAGE, fail, write
from coursebuild.core.files.changes import FileChange, change_files, undo_changes
from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.syntax.schemas import json_schema
from coursebuild.pipeline.options import check_path
from coursebuild.report.values import plural

EXAMPLES = """\
examples:
  coursebuild init my-course      in a new folder
  coursebuild init                in this folder
"""

_COURSE = Path(__file__).parents[1] / "course"
_HIDDEN = {
    "gitignore": ".gitignore",
    "settings.json": ".vscode/settings.json",
    "extensions.json": ".vscode/extensions.json",
    "course.yml": ".github/workflows/course.yml",
    "weekly.yml": ".github/workflows/weekly.yml",
}
"""Files that would mean something where they lie here, by their places in a course."""


def declare(parser: argparse.ArgumentParser) -> None:
    """What can be said."""
    parser.add_argument("folder", nargs="?", default=".", metavar="DIR", help="default: this one")


def run(arguments: argparse.Namespace) -> int:
    """Write the files, unless one is there."""
    named = os.path.join(arguments.root or "", arguments.folder)  # noqa: PTH118  # as it was written
    root = Path(named).resolve()
    check_path(root)
    undo_changes(root)
    files = _files()
    taken = [path for path in files if (root / path).exists() or (root / path).is_symlink()]
    if taken:
        message = f"{named} has {', '.join(taken)} already, so nothing was written"
        return fail(USAGE, message, "name another folder, as in `coursebuild init my-course`")
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EffectError(f"{named} cannot be made: {reason(error)}") from None
    change_files(root, [FileChange(path, None, data) for path, data in files.items()])
    where = "" if root == Path.cwd() else f" -C {shlex.quote(named)}"
    return write(
        f"wrote {plural(len(files), 'file')} to {named}\n\n"
        f"  coursebuild{where} serve    look at the course, and write\n"
        f"  coursebuild{where} build    verify it, and write the site to public/\n",
        CLEAN,
    )


def _files() -> dict[str, bytes]:
    """All files of the course, by path."""
    found = {".vscode/course.schema.json": json_schema("course")}
    for file in sorted(_COURSE.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            path = file.relative_to(_COURSE).as_posix()
            data = file.read_bytes().replace(b"VERSION", __version__.encode())
            found[_HIDDEN.get(path, path)] = data
    return found
