"""What every command needs to know: where the course is, its store, the lessons named."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.core.engine.store import SIZE, Store
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.errors import UsageError as UsageError
from coursebuild.core.files.read import find_root
from coursebuild.core.files.trust import FOLDER, FOREIGN
from coursebuild.core.files.write import undo_changes
from coursebuild.core.model import Course, Lesson, Owner
from coursebuild.core.run.run_store import RunStore
from coursebuild.core.run.script_environment import course_environment
from coursebuild.core.text.diagnostics import did_you_mean, nearest
from coursebuild.pipeline.progress import Progress

if TYPE_CHECKING:
    from coursebuild.core.features import Executor
    from coursebuild.core.model.results import ScriptRun
    from coursebuild.core.run.sandbox import Sandbox
    from coursebuild.core.run.script_environment import Interpreter
    from coursebuild.core.run.script_server import RunAll


class Options(Struct, frozen=True):
    """Where the course is and how to work on it."""

    root: Path
    """Absolute, links resolved."""
    jobs: int
    """How many scripts run at a time."""
    store: Store
    """Results made before."""
    progress: Progress = field(default_factory=lambda: Progress(quiet=True))
    """Says what is done; by default nothing."""
    long: bool = False
    """Whether scripts run that have a recorded run in the course."""
    verbose: bool = False
    """Whether to say why each script runs."""
    run_all: RunAll | None = None
    """Runs scripts, where a `ScriptServer` stays warm from run to run."""
    executor: Executor | None = None
    """Other processes that do the work of this one; `run_all` is theirs then."""
    on_start: Callable[[str, float | None], object] | None = None
    """Takes the path of each script that begins, and the seconds that it took the last time."""
    on_result: Callable[[ScriptRun], object] | None = None
    """Takes the result of each script that runs, while others run."""
    interpreter: Interpreter | None = None
    """The interpreter of scripts, if it is another than ours; see `for_course`."""
    strict: bool = False
    """Whether warnings count as errors, whatever the map says."""
    sandbox: Sandbox | None = None
    """The sandbox of each script; with one, no other code of the course runs."""

    def for_course(self, course: Course) -> Options:
        """The same options, with the environment that the map names for scripts, if it works."""
        return replace(self, interpreter=course_environment(self.root, course).value)

    def run_store(self, *, fresh: bool = False) -> RunStore:
        """The remembered results of scripts; `fresh`: all scripts are to run again."""
        return RunStore(self.root, self.store, fresh=fresh, interpreter=self.interpreter)


def find_course(directory: str | None) -> Path:
    """Find the course's folder: the one named, or the nearest above with `content/course.toml`.

    A named folder without a map is taken all the same: the missing map is then a mistake of the
    course. What a killed command left half changed is undone.
    """
    try:
        start = Path.cwd()
    except OSError:
        raise UsageError("the working directory no longer exists") from None
    root = find_root(None if directory is None else Path(directory), start)
    check_path(root)
    undo_changes(root, Progress().say)
    return root


def check_path(root: Path) -> None:
    """Refuse a folder that no course can lie in.

    MuJoCo opens no file whose path is not UTF-8, and a script cannot print it.
    """
    try:
        str(root).encode()
    except UnicodeEncodeError:
        path_text = os.fsencode(root).decode("utf-8", "backslashreplace")
        raise UsageError(f"the path of the course is not UTF-8: {path_text}") from None


def open_store(root: Path, location: str | None, size: str | None, *, fresh: bool = False) -> Store:
    """Open the store of results: here, and at a shared place.

    What the command line does not set (`None`), the environment may: `COURSEBUILD_CACHE` the place,
    `COURSEBUILD_CACHE_SIZE` the size of the store here. `COURSEBUILD_CACHE_KEY` signs the entries
    at the shared place: a secret, which must not stand on a command line.

    Raises:
        UsageError: the place or the size is not valid.
    """
    option = "--cache-size"
    if size is None:
        option, size = "COURSEBUILD_CACHE_SIZE", os.environ.get("COURSEBUILD_CACHE_SIZE") or None
    limit = SIZE
    if size is not None:
        match = re.fullmatch(r"([0-9]{1,15})([KMGT]?)", size, re.IGNORECASE)
        if match is None:
            message = f"{option}: {size!r} is not a size: a whole number, perhaps with K, M, G or T"
            raise UsageError(message)
        limit = int(match[1]) << (10 * " KMGT".index(match[2].upper() or " "))
    if location is None:
        location = os.environ.get("COURSEBUILD_CACHE") or None
    elif not location:
        raise UsageError("--cache needs a place")
    shared = None
    if location is not None:
        from coursebuild.core.engine.shared_place import shared_place

        try:
            key = os.environ.get("COURSEBUILD_CACHE_KEY", "").encode("utf-8", "surrogateescape")
            shared = shared_place(location, key)
        except EffectError as error:
            raise UsageError(error.message, help=error.help) from None
    store = Store(root, shared=shared, size=limit, fresh=fresh)
    if store.set_aside not in ("", FOREIGN):
        Progress().say(f"warning: {FOLDER} {store.set_aside}; it is set aside")
    return store


def select(course: Course, names: tuple[str, ...], root: Path) -> frozenset[str] | None:
    """Find the lessons named by id, slug, `id-slug` or file, and the pages named by id or file.

    Return the paths of their files; `None`, for everything, where there are no names. A file may be
    given from the course's folder or from the working directory.

    Raises:
        UsageError: a name means nothing, or a lesson that is not written yet.
    """
    return frozenset(find_owner(course, name, root).path for name in names) if names else None


def documents_by_name(course: Course) -> dict[str, Owner]:
    """Lessons by id, slug, `id-slug` and file, pages by id and file."""
    owners: dict[str, Owner] = {}
    for page in course.pages:
        owners |= {page.id: page, page.path: page}
    for lesson in course.lessons:
        file = f"{lesson.id}-{lesson.slug}"
        for alias in (lesson.slug, file, f"{file}.md", lesson.path, lesson.id):
            owners[alias] = lesson
    return owners


def path_from_root(name: str, root: Path) -> str:
    """The path in the course of a file named from its folder or from the working directory."""
    for start in (root, Path.cwd()):
        path = Path(os.path.normpath(start / name))
        if path.exists() and path.is_relative_to(root):
            return path.relative_to(root).as_posix()
    return name


def find_owner(course: Course, name: str, root: Path) -> Owner:
    """The lesson or page of a name.

    Raises:
        UsageError: there is none, or nothing is written of it yet.
    """
    by_name = documents_by_name(course)
    owner = by_name.get(name) or by_name.get(path_from_root(name, root))
    if owner is None:
        closest = nearest(name, [alias for alias in by_name if ("/" in alias) == ("/" in name)])
        lesson_ids = [lesson.id for lesson in course.lessons if lesson.status != "planned"]
        alternatives = did_you_mean("", [*lesson_ids, *(page.id for page in course.pages)])
        help = f"did you mean `{closest}`?" if closest is not None else alternatives
        raise UsageError(f"no lesson or page is called `{name}`", help=help)
    if isinstance(owner, Lesson) and owner.status == "planned":
        raise UsageError(f"lesson {owner.id} is planned, so there is nothing in it yet")
    return owner
