"""`coursebuild init`: create a small, complete course."""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import shlex
import shutil
from collections.abc import Iterator
from importlib.metadata import requires
from pathlib import Path

from coursebuild import __version__
from coursebuild.api import CLEAN, EffectError, gate, write
from coursebuild.core.files.errors import reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.resources import locked_requirements
from coursebuild.core.files.trust import FOLDER, find_store
from coursebuild.core.files.write import FileChange, change_files, undo_changes
from coursebuild.core.run.script_environment import package_version
from coursebuild.core.syntax.course_schema import json_schema
from coursebuild.output import USAGE, fail
from coursebuild.pipeline.options import Progress, check_path
from coursebuild.report.values import plural

EXAMPLES = """\
examples:
  coursebuild init my-course      in a new folder
  coursebuild init                in this folder
"""

_COURSE = Path(__file__).parents[1] / "course"
_PATHS_BY_FILE = {
    "gitattributes": ".gitattributes",
    "gitignore": ".gitignore",
    "settings.json": ".vscode/settings.json",
    "extensions.json": ".vscode/extensions.json",
    "course.yml": ".github/workflows/course.yml",
    "weekly.yml": ".github/workflows/weekly.yml",
    "coursebuild.txt": ".github/coursebuild.txt",
}
"""Paths in a new course, for files that tools would read if they had these names here."""
_KEPT = (".gitattributes", "README.md", "requirements.txt")
"""Files that a folder may have already; they stay as they are."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument(
        "folder",
        nargs="?",
        default=".",
        metavar="DIR",
        help="folder of the course (default: this one)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the files, unless one of them exists."""
    folder = os.path.join(arguments.root or "", arguments.folder)  # noqa: PTH118  # as the user wrote it
    root = Path(folder).resolve()
    check_path(root)
    undo_changes(root, Progress().say)
    needs = [line for line in requires("coursebuild") or () if "extra ==" not in line]
    requirements = locked_requirements(re.split(r"[^\w.-]", line)[0] for line in needs)
    engine = re.findall(r"(?m)^mujoco==(\S+)", requirements)[0]
    files = {".vscode/course.schema.json": json_schema("course")}
    for file in sorted(_COURSE.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            path = file.relative_to(_COURSE).as_posix()
            data = file.read_bytes().replace(b"VERSION", __version__.encode())
            data = data.replace(b"ENGINE", engine.encode())
            files[_PATHS_BY_FILE.get(path, path)] = data
    comment = f"# What coursebuild {__version__} was tested with, as its release locks it.\n"
    files["requirements.lock"] = f"{comment}{requirements}".encode()
    files["requirements.txt"] += "".join(_installed_extras()).encode()
    existing = [path for path in files if (root / path).exists() or (root / path).is_symlink()]
    for path in (path for path in _KEPT if path in existing):
        existing.remove(path)
        del files[path]
    if existing:
        message = f"{folder} has {', '.join(existing)} already, so nothing was written"
        return fail(USAGE, message, "name another folder, as in `coursebuild init my-course`")
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EffectError(f"{folder} cannot be created: {reason(error)}") from None
    with _new_repository(root) as is_made:
        change_files(root, [FileChange(path, None, data) for path, data in files.items()])
    repository = ", in a new Git repository" if is_made else ""
    installed = package_version("mujoco")
    remark = ""
    if installed != engine:  # then `check` would refuse what was recorded with another
        remark = (
            f"  MuJoCo {installed} is installed here, and the course is for {engine}, as its labs "
            "are;\n  `pip install --require-hashes -r requirements.lock` installs that\n\n"
        )
    option = "" if root == Path.cwd() else f" -C {shlex.quote(folder)}"
    return write(
        f"wrote {plural(len(files), 'file')} to {folder}{repository}\n\n{remark}"
        f"  coursebuild{option} serve    look at the course, and write\n"
        f"  coursebuild{option} build    verify it, and write the site to public/\n",
        CLEAN,
    )


def _installed_extras() -> Iterator[str]:
    """Lines that pin what draws figures, where it is installed here."""
    for requirement in requires("coursebuild") or ():
        if match := re.match(r"([\w.-]+)[^;]*; extra == ['\"]figures['\"]", requirement):
            version = package_version(match[1])
            if version != "none":
                yield f"{match[1]}=={version}\n"


@contextlib.contextmanager
def _new_repository(root: Path) -> Iterator[bool]:
    """A Git repository for what is written meanwhile; whether one was made.

    None is, where there is no Git, or a repository around the course. It is made in the store, and
    moved when it is whole; if writing fails, it goes again.
    """
    git = gate.find_program("git")
    if git is None or any(os.path.lexists(folder / ".git") for folder in (root, *root.parents)):
        yield False
        return
    store, strangeness = find_store(str(root))
    place, slot = root / ".git", Path(store, "repository")
    try:
        with project_lock(root):
            shutil.rmtree(slot, ignore_errors=True)  # of a command that was killed
            is_there = slot.parent.is_dir()  # the lock has made it, where it can be made
            problem = _make_repository(git, slot, place) if is_there else f"{FOLDER} {strangeness}"
        try:
            yield not problem
        except BaseException:
            if not problem:
                place.rename(slot / ".git")
            raise
        if problem:
            Progress().say(f"no Git repository was made: {problem}")
    finally:
        shutil.rmtree(slot, ignore_errors=True)


def _make_repository(git: str, slot: Path, place: Path) -> str:
    """Make a repository in a slot, and move it to its place; return why it cannot be."""
    command = [git, "-c", "init.defaultBranch=main", "init", "--quiet", str(slot)]
    answer = gate.finish(command, gate.environment())
    if answer.status:
        return answer.last_line()
    try:
        (slot / ".git").rename(place)
    except OSError as error:
        return reason(error)
    return ""
