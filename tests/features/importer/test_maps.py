"""What becomes of the files of a folder: a map of lessons in their order, and their texts."""

from __future__ import annotations

import tomllib
from pathlib import Path

from coursebuild.features.importer.convert import ConvertedCourse
from support.converted_folder import convert_files
from support.fixture_cases import FIXTURES, Case, check_cases
from support.rule_cases import parts


def outline(course: ConvertedCourse) -> str:
    """The titles of levels, with summaries, of their lessons, planned ones with `?`, and of pages.

    Then what is left.
    """
    table = tomllib.loads(course.files["content/course.toml"].decode())
    lines = []
    for level in table["level"]:
        lines.append(": ".join(level[key] for key in ("title", "summary") if key in level))
        for lesson in level["lesson"]:
            lines.append(f"  {lesson['title']}{'?' * (lesson['status'] == 'planned')}")
    lines += (f"page: {page['title']}" for page in table.get("page", ()))
    lines += (f"left: {leftover.message}" for leftover in course.account.leftovers)
    return "".join(f"{line}\n" for line in lines)


def import_map(folder: Path, files: dict[str, str]) -> ConvertedCourse:
    """Convert files; one without a text has its path as its title."""
    texts = {name: text or f"# {name}\n\nText.\n" for name, text in files.items()}
    return convert_files(folder, texts)


def test_the_map_of_another_tool_is_the_map_of_the_course(tmp_path: Path, rewriting: bool) -> None:
    def render(case: Case) -> str:
        files = {path: text for _, path, text in parts(case.input)}
        return outline(import_map(tmp_path / str(case.line), files))

    check_cases(FIXTURES / "imports/maps.md", render, rewriting=rewriting)


def test_the_new_course_keeps_all_that_readers_see(tmp_path: Path, rewriting: bool) -> None:
    def render(case: Case) -> str:
        files = {path: text for _, path, text in parts(case.input)}
        course = convert_files(tmp_path / str(case.line), files)
        course_map = tomllib.loads(course.files["content/course.toml"].decode())
        title, macros = course_map["course"]["title"], course_map.get("macros", {})
        definitions = "".join(f"\\{name}: {tex}\n" for name, tex in macros.items())
        texts = "".join(
            f"=== {path}\n{data.decode()}"
            for path, data in sorted(course.files.items())
            if path.startswith("content/") and path.endswith((".md", ".svg", ".bib"))
        )
        return f"{title}\n{outline(course)}{definitions}{texts}"

    check_cases(FIXTURES / "imports/folders.md", render, rewriting=rewriting)
