"""What every command needs to know, and the wrong usage that is no mistake of the course.

Entry points: `Options`, `find_course(directory)`, `open_store`, `select`.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.memo import SIZE, Memo
from coursebuild.core.files.changes import undo_changes
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.errors import UsageError as UsageError
from coursebuild.core.files.read import find_root
from coursebuild.core.model import Course, Lesson, Owner, Page
from coursebuild.core.run.interpreter import course_environment
from coursebuild.core.run.memory import Memory
from coursebuild.core.text.diagnostics import did_you_mean, nearest

if TYPE_CHECKING:
    from coursebuild.core.run.runner import RunAll
    from coursebuild.core.run.sandbox import Sandbox
    from coursebuild.core.run.script_environment import Interpreter


class Options(Struct, frozen=True):
    """Where the course is and how to work on it."""

    root: Path
    """Absolute, links resolved."""
    jobs: int
    """Scripts at a time."""
    quiet: bool
    cache: Memo | None = None
    """What was made before; what is kept in the course's folder where nothing is said."""
    long: bool = False
    """Whether scripts run of which the course keeps a run."""
    verbose: bool = False
    """Whether it is said of each script why it runs."""
    run_all: RunAll | None = None
    """What runs scripts, where a `ScriptServer` stays warm from run to run."""
    interpreter: Interpreter | None = None
    """Where scripts run, where that is not here; see `for_course`."""
    sandbox: Sandbox | None = None
    """What is around each script; then no other code of the course runs."""

    @property
    def store(self) -> Memo:
        """Where results are kept."""
        return Memo(self.root) if self.cache is None else self.cache

    def for_course(self, course: Course) -> Options:
        """With the environment that the map names for scripts, as far as they can run there."""
        return replace(self, interpreter=course_environment(self.root, course).value)

    def memory(self, *, fresh: bool = False) -> Memory:
        """What is remembered of scripts; `fresh`: all are to run again."""
        return Memory(self.root, self.store, fresh=fresh, interpreter=self.interpreter)


def find_course(directory: str | None) -> Path:
    """The course's folder: the one named, or the nearest above that holds `content/course.toml`.

    A named folder without a map is taken all the same: that the map is missing is then a mistake of
    the course. What a killed command left half changed there is undone.
    """
    try:
        start = Path.cwd()
    except OSError:
        raise UsageError("the working directory is not there any more") from None
    root = find_root(None if directory is None else Path(directory), start)
    check_path(root)
    undo_changes(root)
    return root


def check_path(root: Path) -> None:
    """Refuse a folder that no course can lie in.

    MuJoCo opens no file whose path is not UTF-8, and a script cannot print it.
    """
    try:
        str(root).encode()
    except UnicodeEncodeError:
        shown = os.fsencode(root).decode("utf-8", "backslashreplace")
        raise UsageError(f"the path of the course is not UTF-8: {shown}") from None


def open_store(root: Path, where: str | None, size: str | None, *, fresh: bool = False) -> Memo:
    """The results made before: here, and at a shared place.

    What the command line does not say (`None`), the environment may: `COURSEBUILD_CACHE` a place,
    `COURSEBUILD_CACHE_SIZE` what the store here may take. `COURSEBUILD_CACHE_KEY` is what entries
    at the shared place are signed with: a secret, which no command line shows.

    Raises:
        UsageError: one of them cannot be.
    """
    said = "--cache-size"
    if size is None:
        said, size = "COURSEBUILD_CACHE_SIZE", os.environ.get("COURSEBUILD_CACHE_SIZE") or None
    limit = SIZE if size is None else _size(said, size)
    if where is None:
        where = os.environ.get("COURSEBUILD_CACHE") or None
    elif not where:
        raise UsageError("--cache names no place")
    shared = None
    if where is not None:
        from coursebuild.core.engine.shared_cache import shared_cache

        try:
            key = os.environ.get("COURSEBUILD_CACHE_KEY", "").encode("utf-8", "surrogateescape")
            shared = shared_cache(where, key)
        except EffectError as error:
            raise UsageError(error.message, help=error.help) from None
    return Memo(root, shared=shared, size=limit, fresh=fresh)


def _size(said: str, text: str) -> int:
    """Bytes."""
    match = re.fullmatch(r"([0-9]{1,15})([KMGT]?)", text, re.IGNORECASE)
    if match is None:
        raise UsageError(f"{said}: {text!r} is no size: a whole number, perhaps with K, M, G or T")
    return int(match[1]) << (10 * " KMGT".index(match[2].upper() or " "))


class Selection(Struct, frozen=True):
    """The lessons and pages that a command is about."""

    lessons: tuple[Lesson, ...]
    pages: tuple[Page, ...]
    documents: frozenset[str] | None
    """Paths of their files; `None`: everything."""


def select(course: Course, names: tuple[str, ...], root: Path) -> Selection:
    """What the names mean: lessons by id, slug, `id-slug` or file, pages by id or file.

    Everything where there are none. A file may be given from the course's folder or from the
    working directory.

    Raises `UsageError` for a name that means nothing, or a lesson that is not written yet.
    """
    if not names:
        written = tuple(lesson for lesson in course.lessons if lesson.document is not None)
        return Selection(written, course.pages, None)
    chosen = [_named(course, name, root) for name in names]
    lessons = tuple(lesson for lesson in course.lessons if lesson in chosen)
    pages = tuple(page for page in course.pages if page in chosen)
    paths = {lesson.path for lesson in lessons} | {page.path for page in pages}
    return Selection(lessons, pages, frozenset(paths))


def documents_by_name(course: Course) -> dict[str, Owner]:
    """Lessons by id, slug, `id-slug` and file, pages by id and file."""
    found: dict[str, Owner] = {}
    for page in course.pages:
        found |= {page.id: page, page.path: page}
    for lesson in course.lessons:
        file = f"{lesson.id}-{lesson.slug}"
        for alias in (lesson.slug, file, f"{file}.md", lesson.path, lesson.id):
            found[alias] = lesson
    return found


def path_from_root(name: str, root: Path) -> str:
    """A path as the course names it: given from its folder, or from the working directory."""
    for start in (root, Path.cwd()):
        path = Path(os.path.normpath(start / name))
        if path.exists() and path.is_relative_to(root):
            return path.relative_to(root).as_posix()
    return name


def _named(course: Course, name: str, root: Path) -> Owner:
    by_name = documents_by_name(course)
    found = by_name.get(name) or by_name.get(path_from_root(name, root))
    if found is None:
        near = nearest(name, [alias for alias in by_name if ("/" in alias) == ("/" in name)])
        written = [lesson.id for lesson in course.lessons if lesson.status != "planned"]
        known = did_you_mean("", [*written, *(page.id for page in course.pages)])
        help = f"did you mean `{near}`?" if near is not None else known
        raise UsageError(f"no lesson or page is called `{name}`", help=help)
    if isinstance(found, Lesson) and found.status == "planned":
        raise UsageError(f"lesson {found.id} is planned, so there is nothing in it yet")
    return found
