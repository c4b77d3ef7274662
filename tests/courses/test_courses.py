"""Course folders and the trees that they must become.

A case is a folder `tests/courses/<case>/` with `course/` (a course as an author has it) and
`expected/`: `files.txt`, the list of everything that a build makes, and the texts worth reading in
a review. A missing and an unexpected output both fail. `pytest --rewrite-fixtures` writes
`expected/`. Folders without it are courses that other tests use.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.built_sites import BuiltCourses

HERE = Path(__file__).parent
CASES = sorted(path.parent.name for path in HERE.glob("*/expected"))
READ = (".html", ".py", ".xml", ".txt")
"""What is compared by its text, but for the assets; of a page that is the part in `<main>`."""


def test_there_are_cases() -> None:
    assert CASES == ["full", "minimal", "unicode"]


@pytest.mark.site
@pytest.mark.parametrize("case", CASES)
def test_course_becomes_what_is_expected(
    case: str, built_courses: BuiltCourses, request: pytest.FixtureRequest
) -> None:
    root = built_courses[case].root
    made = outputs(root)
    assert authored(root) == authored(HERE / case / "course")
    expected = HERE / case / "expected"
    if request.config.getoption("--rewrite-fixtures"):
        rewrite(expected, made)
    assert made == read_expected(expected)


def authored(root: Path) -> dict[str, bytes]:
    """Everything of the author's, which a build must leave alone."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for top in ("content", "models")
        for path in sorted((root / top).rglob("*"))
        if path.is_file()
    }


def outputs(root: Path) -> dict[str, str]:
    """What is compared: `files.txt` and the texts, by path."""
    texts: dict[str, str] = {}
    names: list[str] = []
    for path in sorted(_files(root), key=lambda path: path.relative_to(root).as_posix()):
        name = path.relative_to(root).as_posix()
        if name.startswith((".coursebuild/", "content/", "models/")):
            continue
        names.append(copied(steady(name)))
        if name.endswith(".zip"):
            members = zipfile.ZipFile(path).namelist()
            names += {
                f"{steady(name)}: {re.sub('/mjcourse/.*', '/mjcourse/…', m)}" for m in members
            }
        elif name.startswith("public/examples/") or re.fullmatch("public/models/.*xml", name):
            assert path.read_bytes() == (root / name.removeprefix("public/")).read_bytes()
        elif name.endswith(READ) and not name.startswith("public/assets/"):
            texts[name] = main_part(name, steady(path.read_text("utf-8")))
    return {"files.txt": "".join(f"{name}\n" for name in sorted(names)), **texts}


def copied(name: str) -> str:
    """Compressed copies stand beside the file itself: `index.html`, `index.html + br`."""
    stem, dot, kind = name.rpartition(".")
    return f"{stem} + {kind}" if dot and kind in ("br", "gz") else name


def _files(root: Path) -> Iterator[Path]:
    for folder, _, names in os.walk(root):
        yield from (Path(folder, name) for name in names)


def steady(text: str) -> str:
    """Without what changes with a style sheet, the Python version or the machine."""
    text = re.sub(r"(assets/[\w./-]+?)\.[0-9a-f]{8}\.", r"\1.HASH.", text)
    text = re.sub(r"; [^;]*native MuJoCo[^<]*", "; PARITY", text)  # differs by processor
    return text.replace(f"Python {platform.python_version()}", "Python PYTHON")


def main_part(name: str, text: str) -> str:
    """The content of a page, without the head and the frame that all pages share."""
    if not name.endswith(".html"):
        return text
    found = re.findall(r"<main\b.*</main>", text, re.DOTALL)
    assert len(found) == 1, f"{name} has {len(found)} main elements"
    return f"{found[0]}\n"


def read_expected(expected: Path) -> dict[str, str]:
    return {
        path.relative_to(expected).as_posix(): path.read_bytes().decode()
        for path in sorted(expected.rglob("*"))
        if path.is_file()
    }


def rewrite(expected: Path, made: dict[str, str]) -> None:
    shutil.rmtree(expected, ignore_errors=True)
    for name, text in made.items():
        path = expected / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode())
