"""`coursebuild diff`: say what a change does to the course, as Markdown for those who review it."""

from __future__ import annotations

import argparse
import contextlib
import functools
import io
import subprocess
import tarfile
from collections.abc import Iterator
from pathlib import Path

from coursebuild.cli.arguments import options_of
from coursebuild.cli.output import CLEAN, write
from coursebuild.core.files.course_root import MAP
from coursebuild.core.files.errors import EffectError, UsageError, reason
from coursebuild.core.files.locks import temporary_folder
from coursebuild.features.diff.report import CourseState, report, weight_section
from coursebuild.pipeline.load import load_course
from coursebuild.pipeline.recordings import read_recorded

EXAMPLES = """\
examples:
  coursebuild diff main              since this branch left main
  coursebuild diff ../before         another copy of the course
  coursebuild diff main --base-site ../before/public --site public
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("base", metavar="BASE", help="a revision of git, or a folder with a course")
    for name, subject in (("--base-site", "BASE"), ("--site", "this course")):
        help = f"where `build` published {subject}, for the weight of pages"
        parser.add_argument(name, metavar="FOLDER", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Print the report; the exit status does not depend on differences."""
    root, sites = options_of(arguments).root, (arguments.base_site, arguments.site)
    if sites.count(None) == 1:
        raise UsageError("--site and --base-site belong together: one is compared with the other")
    with _open_base(root, arguments.base) as (name, folder):
        text = report(name, _load_state(folder), _load_state(root))
    if None not in sites:
        text += f"\n{weight_section(*(root / site for site in sites))}"
    return write(text, CLEAN)


def _load_state(root: Path) -> CourseState:
    return CourseState(load_course(root, code="run"), functools.partial(read_recorded, root))


@contextlib.contextmanager
def _open_base(root: Path, name: str) -> Iterator[tuple[str, Path]]:
    """Provide the earlier state: its name in Markdown, and its folder."""
    if (Path(name) / MAP).is_file():
        yield f"`{name}`", Path(name).resolve()
        return
    commit = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", name + "^{commit}")
    if not commit:
        raise UsageError(f"`{name}` is neither a folder with a course nor a revision of git here")
    since = (_git(root, "merge-base", commit.decode().strip(), "HEAD") or commit).decode().strip()
    with temporary_folder() as folder:
        with tarfile.open(fileobj=io.BytesIO(_git(root, "archive", since))) as archive:
            archive.extractall(folder, filter="data")
        yield f"`{name}` ({since[:7]})", Path(folder).resolve()


def _git(root: Path, *arguments: str) -> bytes:
    """Return what git prints; nothing if it fails."""
    try:
        process = subprocess.run(["git", *arguments], cwd=root, capture_output=True)
    except OSError as error:
        raise EffectError(f"git cannot be run: {reason(error)}") from None
    return process.stdout if process.returncode == 0 else b""
