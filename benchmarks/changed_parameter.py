"""What one changed parameter costs an author: edits by hand, and seconds to a green check.

In a copy of the course, a number in a script of each of ten lessons is changed. `update` writes
what it can, and `check` says what is left. An error counts as one edit by hand: the edit that it
proposes is made, or the number that its message names is typed in place of the marked one. Nothing
else is known to mend it, so what is left after that is printed as such.

    python benchmarks/changed_parameter.py
    python benchmarks/changed_parameter.py --course OTHER --python OTHER/.venv/bin/python

The second line measures another version of coursebuild with its own course.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from coursebuild.core.run import gate

ROOT = Path(__file__).parents[1]
FOLDERS = ("content", "models", "lib", "runs")
CHANGES = (
    ("0.1", "HEIGHT = 5.0 ", "HEIGHT = 6.0 "),
    ("0.3", "WAY = 0.2  # m, by", "WAY = 0.25  # m, by"),
    ("1.1", "ANGLE = 0.3 ", "ANGLE = 0.35 "),
    ("1.2", '    data.joint("elbow").qvel = 1.0 ', '    data.joint("elbow").qvel = 1.2 '),
    ("2.2", "TORQUE = 0.01 ", "TORQUE = 0.012 "),
    ("4.2", "DURATION = 20.0 ", "DURATION = 25.0 "),
    ("4.3", "SPEED = 0.5 ", "SPEED = 0.6 "),
    ("9.2", "STEP = 0.002 ", "STEP = 0.0025 "),
    ("9.3", "FRICTION = 0.5 ", "FRICTION = 0.55 "),
    ("18.1", "FORCE = 12 ", "FORCE = 13 "),
)
"""Lesson, a line of one of its scripts as it begins, and its beginning afterwards."""
_ROUNDS = 12
_NAMED = re.compile(r"(?:printed|value is) (-?[0-9.]+(?:e[+-]?[0-9]+)?)(?![\w.])")
_NUMBER = re.compile(r"[-\u2212]?[0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?")


class Course:
    """A copy of the course, and the commands of one version of the tool."""

    def __init__(self, folder: Path, python: str) -> None:
        self.folder, self.python = folder, python
        self.commands = 0

    def run(self, *words: str) -> gate.Completed:
        """Run a command of coursebuild."""
        self.commands += 1
        command = gate.python_command("-m", "coursebuild", *words, "-q", program=self.python)
        return gate.finish(command, gate.environment(*gate.TOOL), folder=self.folder)

    def errors(self, lesson: str) -> list[dict[str, Any]]:
        """The errors of a check of one lesson."""
        result = self.run("check", lesson, "--format", "json")
        if not result.output.startswith(b"{"):
            sys.exit(result.last_line())
        return [d for d in json.loads(result.output)["diagnostics"] if d["severity"] == "error"]

    def mend(self, error: dict[str, Any]) -> bool:
        """Make the edit that an error proposes, or type the number that it names."""
        edits = error["edits"] or [edit] if (edit := self._typed(error)) else error["edits"]
        for edit in sorted(edits, key=_place, reverse=True):
            path = self.folder / edit["path"]
            lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
            first, last = edit["line"] - 1, edit["end_line"] - 1
            text = lines[first][: edit["column"] - 1] + edit["text"]
            lines[first : last + 1] = [text + lines[last][edit["end_column"] - 1 :]]
            path.write_text("".join(lines), encoding="utf-8")
        return bool(edits)

    def _typed(self, error: dict[str, Any]) -> dict[str, Any] | None:
        printed_value = _NAMED.search(error["label"])
        if printed_value is None or error["line"] != error["end_line"]:
            return None
        line = (self.folder / error["path"]).read_text(encoding="utf-8").split("\n")
        old_text = line[error["line"] - 1][error["column"] - 1 : error["end_column"] - 1]
        number = _NUMBER.search(old_text)
        if number is None:
            return None
        decimals = len(number[0].partition("e")[0].partition(".")[2])
        form = f".{decimals}{'e' if 'e' in number[0] else 'f'}"
        text = (
            old_text[: number.start()]
            + format(float(printed_value[1]), form)
            + old_text[number.end() :]
        )
        return {**error, "text": text}


def _place(edit: dict[str, Any]) -> tuple[str, int, int]:
    return edit["path"], edit["line"], edit["column"]


def change(course: Course, lesson: str, old: str, new: str) -> str:
    """Change a parameter, mend what `check` says, and say what that took."""
    (path,) = (course.folder / "content/lessons").glob(f"{lesson}-*.md")
    text = path.read_text(encoding="utf-8")
    begins = f"\n{old}" if f"\n{old}" in text else f"\n> {old}"
    path.write_text(text.replace(begins, begins.replace(old, new), 1), encoding="utf-8")
    assert begins in text, f"lesson {lesson} has no line {old!r}"
    course.commands, began = 0, time.monotonic()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    course.run("update", lesson)
    edits, left = 0, course.errors(lesson)
    for _ in range(_ROUNDS):
        # From the end to the beginning, so that an edit moves none of those before it.
        mended = [course.mend(e) for e in sorted(left, key=_place, reverse=True)]
        edits += sum(mended)
        if not any(mended):
            break
        left = course.errors(lesson)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    seconds = time.monotonic() - began
    rules = ", ".join(sorted({error["rule"] for error in left}))
    return (
        f"{lesson:>6}  {new.split('#')[0].strip():<18}{edits:>6}{course.commands:>10}"
        f"{processor:>10.1f}{seconds:>9.1f}  {f'{len(left)} left: {rules}' if left else 'green'}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--course", type=Path, default=ROOT, help="default: this repository's")
    parser.add_argument("--python", default=sys.executable, help="runs the version to measure")
    parser.add_argument("lessons", nargs="*", metavar="LESSON", help="default: all ten")
    arguments = parser.parse_args()
    changes = [c for c in CHANGES if not arguments.lessons or c[0] in arguments.lessons]
    with tempfile.TemporaryDirectory() as name:
        course = Course(Path(name) / "course", str(Path(arguments.python).absolute()))
        for folder in FOLDERS:
            if (arguments.course / folder).is_dir():
                shutil.copytree(arguments.course / folder, course.folder / folder)
        shutil.copy(arguments.course / "matplotlibrc", course.folder)
        original = Path(name) / "content"
        shutil.copytree(course.folder / "content", original)
        names = [lesson for lesson, _, _ in changes]
        print(course.run("check", *names).output.decode(), end="", flush=True)
        print("lesson  change           edits  commands  processor  seconds", flush=True)
        for lesson, old, new in changes:
            print(change(course, lesson, old, new), flush=True)
            shutil.rmtree(course.folder / "content")
            shutil.copytree(original, course.folder / "content")


if __name__ == "__main__":
    main()
