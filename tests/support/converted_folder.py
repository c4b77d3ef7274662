"""A folder of another tool that is converted, without a command."""

from __future__ import annotations

from pathlib import Path

from coursebuild.features.importer.convert import ConvertedCourse, convert
from coursebuild.features.importer.source_files import SourceFiles


def convert_files(folder: Path, files: dict[str, str]) -> ConvertedCourse:
    """Convert files, which are written below `folder`."""
    for name, text in files.items():
        path = folder / "old" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return convert(SourceFiles(folder / "old"))


def first_lesson(course: ConvertedCourse) -> str:
    return next(
        data.decode() for path, data in course.files.items() if path.startswith("content/lessons/")
    )


def account_of(course: ConvertedCourse) -> str:
    return course.files["IMPORT.md"].decode()
