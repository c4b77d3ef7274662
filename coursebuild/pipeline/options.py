"""What every command needs to know, and the wrong usage that is no mistake of the course.

Entry points: `Options`, `find_root(directory)`, `select(course, names)`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from coursebuild.diagnostics import did_you_mean
from coursebuild.model import Course, Lesson

MARKER = Path("content") / "course.toml"


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


def find_root(directory: str | None) -> Path:
    """The course's folder: the one named, or the nearest above that holds `content/course.toml`.

    A named folder without a map is taken all the same: that the map is missing is then a mistake of
    the course.
    """
    if directory is not None:
        root = Path(directory)
        if not root.is_dir():
            raise UsageError(f"-C {directory}: there is no such folder")
        return root.resolve()
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / MARKER).is_file():
            return folder.resolve()
    return here.resolve()


def select(course: Course, names: tuple[str, ...]) -> tuple[Lesson, ...]:
    """The lessons that the names mean (id, slug, `id-slug`, or path); all where there are none.

    Raises `UsageError` for a name that means no lesson.
    """
    if not names:
        return course.lessons
    by_name: dict[str, Lesson] = {}
    for lesson in course.lessons:
        file = f"{lesson.id}-{lesson.slug}"
        for alias in (lesson.slug, file, f"{file}.md", lesson.path, lesson.id):
            by_name[alias] = lesson
    chosen: dict[str, Lesson] = {}
    for name in names:
        found = by_name.get(name) or by_name.get(Path(name).name)
        if found is None:
            help = did_you_mean(
                name, [lesson.id for lesson in course.lessons] + [x.slug for x in course.lessons]
            )
            raise UsageError(f"no lesson is called `{name}`" + (f"; {help}" if help else ""))
        chosen[found.id] = found
    return tuple(lesson for lesson in course.lessons if lesson.id in chosen)
