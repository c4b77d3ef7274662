"""The courses in `tests/courses`."""

from __future__ import annotations

from pathlib import Path

from support.scratch_course import ROOT, Folder

COURSES = ROOT / "tests" / "courses"


def course_files(name: str) -> dict[str, str | bytes]:
    """The files of a course, by path."""
    origin = COURSES / name / "course"
    paths = (path for path in sorted(origin.rglob("*")) if path.is_file())
    return {path.relative_to(origin).as_posix(): path.read_bytes() for path in paths}


def course_copy(name: str, root: Path, stores: Path) -> Folder:
    """A copy of a course, for a test that changes it."""
    folder = Folder(root)
    for path, data in course_files(name).items():
        folder.write(path, data)
    folder.borrow(stores)
    return folder
