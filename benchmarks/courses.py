"""Write a course of N lessons for coursebuild or one of its peers.

Run: python benchmarks/courses.py --lessons N --out DIR [--flavor NAME] [--scripts python|mujoco]

The same lessons in each flavor: about 15 kB with 25 formulas, a 90-line script with what it
prints, a quiz, four callouts, three tables and links. Two runs write the same bytes.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.generate.lesson import lesson_name, make_lesson  # noqa: E402

FLAVORS = (
    "coursebuild",
    "course_json",
    "mkdocs",
    "sphinx",
    "pelican",
    "hugo",
    "hugo_reader",
    "eleventy",
    "vitepress",
)


def write_course(
    folder: Path, lessons: int, flavor: str = "coursebuild", scripts: str = "python"
) -> list[str]:
    """Write a course into a folder that is empty or not there yet; gives the lessons' names."""
    if folder.exists() and any(folder.iterdir()):
        raise FileExistsError(f"{folder} is not empty")
    module = importlib.import_module(f"benchmarks.generate.flavors.{flavor}")
    course_lessons = [make_lesson(n, lessons, scripts) for n in range(lessons)]
    module.write(course_lessons, folder)
    return [lesson.name for lesson in course_lessons]


def names_of(lessons: int) -> list[str]:
    """The names of a course's lessons, without making them."""
    return [lesson_name(number) for number in range(lessons)]


def main() -> None:
    """Write one course."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lessons", type=int, default=80)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--flavor", choices=FLAVORS, default="coursebuild")
    parser.add_argument("--scripts", choices=("python", "mujoco"), default="python")
    arguments = parser.parse_args()
    try:
        write_course(arguments.out, arguments.lessons, arguments.flavor, arguments.scripts)
    except FileExistsError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
