"""Lessons that held are not compared again, until anything that they show may be another."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from support.scratch_course import Folder, Make, block

HEAT = "print('heat 41.5 J')\nprint('loss 3.2 W')"
DATA = "content/time.txt"
READING = f"print('t', open({DATA!r}).read(), 's')"
LESSONS = (
    "## One\n\n" + block("heat.py", HEAT, "heat 41.5 J\nloss 3.2 W"),
    "## Two\n\nIt takes `41.5 J`{out=examples/heat.py}.\n\n" + block("two.py", "print(2)", "2"),
    "## Three\n\n" + block("three.py", READING, "t 3.0 s") + "It takes `3.0`{out} s.\n",
)
LOOSE = '[verify]\ncompare = "rtol"\natol = 9.0\n\n'
MAP, FIRST = "content/course.toml", "content/lessons/1.1-one.md"
RECORD = "content/lessons/1.2-two.recorded.txt"


@pytest.fixture
def held_course(make: Make) -> Folder:
    folder = make(*LESSONS)
    folder.write(DATA, "3.0")
    for _ in range(2):  # the first writes where values were printed
        assert folder.main("check").status == 0
    return folder


def diagnostics(folder: Folder) -> str:
    """What `check` finds, as JSON."""
    return json.dumps(json.loads(folder.main("check", "--format", "json").out)["diagnostics"])


def kept_entries(folder: Folder) -> set[Path]:
    return {*(folder.root / ".coursebuild/held").iterdir()}


def test_after_an_edit_that_lesson_alone_is_compared(held_course: Folder) -> None:
    before = kept_entries(held_course)
    third = held_course.lesson(3)
    held_course.replace(third, "It takes", "In all it takes")
    assert held_course.main("check").status == 0
    assert len(kept_entries(held_course) - before) == 1
    assert before < kept_entries(held_course)


@pytest.mark.parametrize(
    ("path", "old", "new", "places"),
    [
        # The script of another lesson prints another number, which that lesson records.
        (FIRST, "41.5", "41.6", ["1.2-two.md"]),
        (FIRST, "heat 41.5 J", "heat 41.5 mJ", ["1.2-two.md"]),
        (FIRST, "python file=examples/heat.py", "python file=examples/hot.py", ["1.2-two.md"]),
        (FIRST, HEAT, f"{HEAT}\nprint('gain 41.5 J')", ["1.1-one.md"]),
        (FIRST, HEAT, f"{HEAT}\nexit(1)", ["script-failed"]),
        (DATA, "3.0", "3.1", ["output-drift", "1.3-three.md"]),
        (RECORD, "heat # J", "loss # W", ["binding-mismatch", "1.2-two.md"]),
        (MAP, "[course]", '[course]\nlanguage = "de"', []),
        (MAP, "[course]", f"{LOOSE}[course]", ["1.3-three.md"]),
    ],
)
def test_what_changes_beside_a_lesson_is_seen_in_it(
    held_course: Folder, path: str, old: str, new: str, places: list[str]
) -> None:
    held_course.write(path, held_course.text(path).replace(old, new))
    findings = diagnostics(held_course)
    assert findings == diagnostics(held_course)
    shutil.rmtree(held_course.root / ".coursebuild/held")
    assert findings == diagnostics(held_course)
    assert [place for place in places if place not in findings] == [], findings
