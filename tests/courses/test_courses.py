"""Builds of course folders, compared with the expected files.

A case is a folder `tests/courses/<case>/` with `course/` (a course as an author has it) and
`expected/`: `files.txt`, the list of everything that a build makes, and those texts in which the
case differs from others: a page that all have alike stands in `full` alone. A missing and an
unexpected output both fail. `pytest --rewrite-fixtures` writes what stands in `expected/` anew.
Folders without it are courses that other tests use.
"""

from __future__ import annotations

import os
import platform
import re
import zipfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import pytest

from support.built_sites import BuiltCourses

HERE = Path(__file__).parent
CASES = sorted(path.parent.name for path in HERE.glob("*/expected"))
READ = (".html", ".py", ".xml", ".txt")
"""Files that are compared by their text, except assets; of pages, only the part in `<main>`."""


def test_there_are_cases() -> None:
    assert CASES == ["full", "minimal", "unicode"]


@pytest.mark.site
@pytest.mark.parametrize("case", CASES)
def test_course_becomes_what_is_expected(
    case: str, built_courses: BuiltCourses, request: pytest.FixtureRequest
) -> None:
    root = built_courses[case].root
    assert authored(root) == authored(HERE / case / "course")
    expected = HERE / case / "expected"
    texts = outputs(root)
    actual = {name: texts.get(name, "") for name in read_expected(expected)}
    if request.config.getoption("--rewrite-fixtures"):
        for name, text in actual.items():
            (expected / name).write_bytes(text.encode())
    assert actual == read_expected(expected)


def authored(root: Path) -> dict[str, bytes]:
    """Everything of the author's, which a build must not change."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for top in ("content", "models")
        for path in sorted((root / top).rglob("*"))
        if path.is_file()
    }


def outputs(root: Path) -> dict[str, str]:
    """The files to compare, by path: `files.txt` and the texts."""
    texts: dict[str, str] = {}
    names: list[str] = []
    for path in sorted(_files(root), key=lambda path: path.relative_to(root).as_posix()):
        name = path.relative_to(root).as_posix()
        if name.startswith((".coursebuild/", "content/", "models/")):
            continue
        names.append(mark_copy(replace_varying(name)))
        if name.endswith(".zip"):
            members = zipfile.ZipFile(path).namelist()
            names += {
                f"{replace_varying(name)}: {re.sub('/mjcourse/.*', '/mjcourse/…', m)}"
                for m in members
            }
        elif re.fullmatch("public/models/.*xml", name):
            assert path.read_bytes() == (root / name.removeprefix("public/")).read_bytes()
        elif name.endswith(READ) and not name.startswith("public/assets/"):
            texts[name] = main_part(name, replace_varying(path.read_text("utf-8")))
    return {"files.txt": "".join(f"{name}\n" for name in sorted(names)), **texts}


def mark_copy(name: str) -> str:
    """Put compressed copies on the line of the file itself: `index.html + br`."""
    stem, dot, kind = name.rpartition(".")
    return f"{stem} + {kind}" if dot and kind in ("br", "gz") else name


def _files(root: Path) -> Iterator[Path]:
    for folder, _, names in os.walk(root):
        yield from (Path(folder, name) for name in names)


def replace_varying(text: str) -> str:
    """Remove what changes with a style sheet, the Python version or the machine."""
    text = re.sub(r"(assets/[\w./%-]+?)\.[0-9a-f]{8}\.", r"\1.HASH.", text)
    text = re.sub(r"; [^;]*nativem? MuJoCo[^<]*", "; PARITY", text)  # differs by processor
    text = text.replace(f"NumPy {version('numpy')}", "NumPy NUMPY")
    text = text.replace(f"mujoco=={version('mujoco')}", "mujoco==MUJOCO")
    return text.replace(f"Python {platform.python_version()}", "Python PYTHON")


def main_part(name: str, text: str) -> str:
    """The content of a page, without the head and the frame that all pages share."""
    if not name.endswith(".html"):
        return text
    mains = re.findall(r"<main\b.*</main>", text, re.DOTALL)
    assert len(mains) == 1, f"{name} has {len(mains)} main elements"
    return f"{mains[0]}\n"


def read_expected(expected: Path) -> dict[str, str]:
    return {
        path.relative_to(expected).as_posix(): path.read_bytes().decode()
        for path in sorted(expected.rglob("*"))
        if path.is_file()
    }
