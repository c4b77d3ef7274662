"""What becomes of each construct of each format: it is taken, changed or left, and never lost.

Each construct has words of its own, such as `wa1`. They stand in the new course, or in what the
account says is left; and the account counts the construct, in the column that is given here.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from coursebuild.features.importer.convert import ConvertedCourse
from support.converted_folder import account_of, convert_files
from support.fixture_cases import fixture_tables, fixture_text

TAKEN, CHANGED, LEFT = "taken", "changed", "left"
PICTURE = "\x89PNG"
CONSTRUCTS = fixture_tables("imported")
"""By format."""
TARGETS = fixture_text("documents/targets.md")
"""What roles refer to."""
MORE = fixture_tables("imported_beside")["files"]
FORMATS = {
    "myst": "one.md",
    "quarto": "one.qmd",
    "mkdocs": "one.md",
    "mdbook": "one.md",
    "docusaurus": "docs/one.mdx",
}


def counts(course: ConvertedCourse) -> dict[str, dict[str, int]]:
    """The table of IMPORT.md."""
    rows = re.findall(r"^\| (.+?) \| (\d*) \| (\d*) \| (\d*) \|$", account_of(course), re.M)
    columns = (TAKEN, CHANGED, LEFT)
    return {
        kind: {c: int(n or 0) for c, n in zip(columns, numbers, strict=True)}
        for kind, *numbers in rows
    }


def texts_of(course: ConvertedCourse) -> str:
    return "\n".join(
        data.decode("utf-8", "replace")
        for path, data in course.files.items()
        if path.endswith((".md", ".toml", ".bib")) and path != "IMPORT.md"
    )


@pytest.mark.parametrize("format", FORMATS)
def test_every_construct_is_taken_changed_or_left(tmp_path: Path, format: str) -> None:
    name = FORMATS[format]
    failures = []
    for number, (kind, column, text) in enumerate(CONSTRUCTS[format]):
        folder = name.rpartition("/")[0]
        files = {
            name: f"# One\n\n{TARGETS if kind.startswith('role') else ''}\n\n{text}\n\nEnd.\n",
            f"{folder}/two.md".lstrip("/"): "# Two\n\n## Part\n\nText.\n",
            f"{folder}/p.png".lstrip("/"): PICTURE,
            **MORE[format],
        }
        course = convert_files(tmp_path / str(number), files)
        table = counts(course)
        if not table.get(kind, {}).get(column):
            failures.append(f"{text!r} is not {column} as {kind}, but {table}")
        account = account_of(course).partition("## Left")[2]
        words = set(re.findall(r"\bw[a-e]\d+", text))
        words_there = set(re.findall(r"w[a-e]\d+", texts_of(course) + account))
        failures += [f"{text!r}: {word} is lost" for word in sorted(words - words_there)]
    assert not failures, "\n".join(failures)


def test_every_part_of_a_notebook_is_taken_changed_or_left(tmp_path: Path) -> None:
    picture = {"output_type": "display_data", "data": {"image/png": "aGk="}}
    printed = {"output_type": "stream", "name": "stdout", "text": "wn1\n"}
    value = {"output_type": "execute_result", "data": {"text/plain": "'wn2'"}}
    plot = "import matplotlib.pyplot as plt\nplt.plot([1])"
    cells = [
        ("markdown", "# One\n\nText wn3 ![a](attachment:p.png)", []),
        ("code", "print('wn1')", [printed]),
        ("code", "'wn2'", [value]),
        ("code", plot, [picture]),
        ("code", "open('data/wn4.csv')", []),
        ("code", "from google.colab import drive\ndrive.mount('/wn5')\nx = 'wn6'", []),
        ("code", "!pip install wn7", []),
        ("code", "%%html\n<style>p {}</style>", []),
        ("code", "%%bash\necho wn8", []),
        ("raw", "wn9", []),
    ]
    notebook = {
        "cells": [
            {
                "cell_type": kind,
                "source": source,
                "outputs": outputs,
                "attachments": {"p.png": {"image/png": "aGk="}},
            }
            for kind, source, outputs in cells
        ],
        "metadata": {"wn10": 1},
        "nbformat": 4,
    }
    files = {"one.ipynb": json.dumps(notebook), "data/wn4.csv": "1\n", "wn11.csv": "1\n"}
    course = convert_files(tmp_path, files)
    table = counts(course)
    expected = {
        "cell": (0, 5, 1),
        "cell of `bash`": (0, 0, 1),
        "figure of a cell": (0, 1, 0),
        "file": (2, 0, 1),
        "magic": (0, 0, 1),
        "metadata of a text": (0, 0, 1),
        "output that is recorded": (2, 0, 0),
        "path in a cell": (0, 1, 0),
        "picture": (0, 1, 0),
        "statement of a cell": (0, 0, 2),
        "text": (0, 1, 0),
    }
    assert {kind: tuple(table.get(kind, {}).values()) for kind in expected} == expected
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert 'open("content/files/data/wn4.csv")' in lesson
    left = account_of(course).partition("## Left")[2]
    words = {f"wn{number}" for number in range(1, 12)}
    assert words == set(re.findall(r"wn\d+", lesson + left))
    assert {"wn5", "wn7", "wn10", "wn11"} <= set(re.findall(r"wn\d+", left))


def test_every_field_of_a_course_json_is_taken_changed_or_left(tmp_path: Path) -> None:
    lesson = {
        "id": "1.1",
        "title": "wj1",
        "slug": "free-fall",
        "track": "wj2",
        "difficulty": 3,
        "checkpoint": {"question": "wj3", "accept": ["wj4"]},
        "summary": "wj5",
        "objectives": ["wj6"],
        "file": "one.md",
    }
    course_map = {
        "title": "wj7",
        "levels": [{"id": 1, "title": "wj8", "checkpoint": "wj9", "lessons": [lesson]}],
        "pages": [{"title": "wj10"}, {"title": "wj11", "file": "about.md"}],
        "glossary": {"wj12": "wj13"},
    }
    lab = '```lab simlab\n{"camera": {"azimuth": 10, "elevation": 20}, "note": "wj14"}\n```\n'
    quiz = '```quiz\n{"simulation": {"camera": {"azimuth": 10, "elevation": 20}}}\n```\n'
    files = {
        "course.json": json.dumps(course_map),
        "one.md": f"# One\n\n[wj15](#/lesson/free-fall) [wj16](/lesson/9.9)\n\n{lab}\n{quiz}",
        "about.md": "# About\n\nwj17\n",
    }
    course = convert_files(tmp_path, files)
    left = account_of(course).partition("## Left")[2]
    words = set(re.findall(r"wj\d+", texts_of(course) + left))
    assert words == {f"wj{number}" for number in range(1, 18)}
    assert {"wj2", "wj3", "wj4", "wj10", "wj12", "wj13"} <= set(re.findall(r"wj\d+", left))
    lesson_text = course.files["content/lessons/1.1-free-fall.md"].decode()
    assert lesson_text.count('"azimuth": -170') == lesson_text.count('"elevation": -20') == 2
    assert "[wj15](lesson:1.1)" in lesson_text
