"""What every command needs to know, and the wrong usage that is no mistake of the course.

Entry points: `Options`, `find_course(directory)`, `select`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from coursebuild.diagnostics import did_you_mean
from coursebuild.effects.errors import EffectError
from coursebuild.effects.read import find_root
from coursebuild.model import Course, Lesson, Status


class UsageError(Exception):
    """The command was called in a way that cannot be; its text is for the user. Exit status 2."""


@dataclass(frozen=True, slots=True)
class Options:
    """Where the course is and how to work on it."""

    root: Path
    """Absolute, links resolved."""
    jobs: int
    """Scripts at a time."""
    quiet: bool


def find_course(directory: str | None) -> Path:
    """The course's folder: the one named, or the nearest above that holds `content/course.toml`.

    A named folder without a map is taken all the same: that the map is missing is then a mistake of
    the course.
    """
    try:
        return find_root(None if directory is None else Path(directory), Path.cwd())
    except EffectError as error:
        raise UsageError(error.message + (f"; {error.help}" if error.help else "")) from None


@dataclass(frozen=True, slots=True)
class Selection:
    """The lessons that a command is about."""

    lessons: tuple[Lesson, ...]
    documents: frozenset[str] | None
    """Paths of their files; `None`: everything, pages included."""


def select(course: Course, names: tuple[str, ...]) -> Selection:
    """The lessons that the names mean (id, slug, `id-slug`, or path); all where there are none.

    Raises `UsageError` for a name that means no lesson, or one that is not written yet.
    """
    if not names:
        written = tuple(lesson for lesson in course.lessons if lesson.document is not None)
        return Selection(written, None)
    by_name: dict[str, Lesson] = {}
    for lesson in course.lessons:
        file = f"{lesson.id}-{lesson.slug}"
        for alias in (lesson.slug, file, f"{file}.md", lesson.path, lesson.id):
            by_name[alias] = lesson
    chosen: dict[str, Lesson] = {}
    for name in names:
        found = by_name.get(name) or by_name.get(Path(name).name)
        if found is None:
            slugs = [lesson.slug for lesson in course.lessons]
            help = did_you_mean(name, [lesson.id for lesson in course.lessons] + slugs)
            raise UsageError(f"no lesson is called `{name}`" + (f"; {help}" if help else ""))
        if found.status is Status.PLANNED:
            raise UsageError(f"lesson {found.id} is planned, so there is nothing in it yet")
        chosen[found.id] = found
    lessons = tuple(lesson for lesson in course.lessons if lesson.id in chosen)
    return Selection(lessons, frozenset(lesson.path for lesson in lessons))
