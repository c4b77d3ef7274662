"""Each mistake that the lesson format names, alone, through the command line; and the good cases.

The cases are fixtures in `tests/fixtures/mistakes/`. Where a mistake is expected its place is
marked in the input by `‸`, which is taken out before the course is written; the expected text is
the rule. A case whose expected text is empty must be found good.
"""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from coursebuild.cli import main
from coursebuild.rules import RULES
from support.rule_cases import SECOND, Case, Layout, put, read_cases

FIXTURES = Path(__file__).parents[1] / "fixtures" / "mistakes"
MARK = "‸"
CASES = [
    pytest.param(case, id=f"{path.stem}:{case.line}")
    for path in sorted(FIXTURES.glob("*.md"))
    for case in read_cases(path)
]


@dataclass(frozen=True, order=True)
class Place:
    """Where a mistake is, and which."""

    path: str
    line: int
    column: int
    rule: str

    def __str__(self) -> str:
        return f"{self.rule} {self.path}:{self.line}:{self.column}"


def marked(layout: Layout) -> list[tuple[str, int, int]]:
    """Take the marks out of the files, and give their places."""
    places = []
    for path, data in layout.files.items():
        text = data.decode("utf-8", "surrogateescape")
        clean, *rest = text.split(MARK)
        for part in rest:
            before = clean.replace("\r\n", "\n").replace("\r", "\n")
            places.append((path, before.count("\n") + 1, len(before) - before.rfind("\n")))
            clean += part
        layout.files[path] = clean.encode("utf-8", "surrogateescape")
    return sorted(places)


def expected(case: Case, marks: list[tuple[str, int, int]]) -> list[Place]:
    """The rules of a case at its marks, in order; `rule PATH:LINE:COLUMN` needs no mark."""
    places, left = [], list(marks)
    for line in case.expected.splitlines():
        rule, _, place = line.partition(" ")
        if place:
            path, row, column = place.rsplit(":", 2)
            places.append(Place(path, int(row), int(column), rule))
        else:
            places.append(Place(*left.pop(0), rule))
    assert not left, "a mark without a rule"
    return sorted(places)


def run(root: Path, *arguments: str) -> tuple[int, dict[str, list[dict[str, object]]]]:
    """The exit status and the report of a command."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        status = main(["-C", str(root), *arguments, "--jobs", "1"])
    return status, json.loads(out.getvalue())


@pytest.mark.parametrize("case", CASES)
def test_a_mistake_is_told_once_at_its_place(case: Case, tmp_path: Path) -> None:
    layout = Layout.of(case.input)
    places = marked(layout)
    wrong = any(RULES[line.split()[0]].severity == "error" for line in case.expected.splitlines())
    if wrong and "examples/" not in case.input and SECOND in layout.files:
        # Nothing leans on the script that every scratch course has, so it need not be run.
        layout.files[SECOND] = layout.files[SECOND].replace(b"second.py\n", b"second.py norun\n")
    layout.write(tmp_path)
    if layout.later:
        run(tmp_path, "check", "--format", "json")
        for path, data in layout.later.items():
            put(tmp_path / path, data)
    status, report = run(tmp_path, "check", "--format", "json")
    found = sorted(
        Place(str(d["path"]), int(str(d["line"])), int(str(d["column"])), str(d["rule"]))
        for d in report["diagnostics"]
    )
    wanted = expected(case, places)
    assert [str(place) for place in found] == [str(place) for place in wanted]
    assert status == (1 if wrong else 0)
    assert len(wanted) <= 1, "one mistake at a time"


TOGETHER = """\
=== content/course.toml
[course]
title = "T"
engine = ‸"3.1.0"

[[level]]
id = "1"
title = "L"

[[level.lesson]]
id = "1.1"
slug = "first"
title = "F"
status = "complete"
prerequisites = [‸"1.9"]

[[level.lesson]]
id = "1.2"
slug = "second"
title = "S"
status = "complete"
=== content/lessons/1.1-first.md
‸# #

See [this](‸lesson:4.3) and $‸\\nothing$.

```python file=examples/x.py ‸timout=3
print("a 1.0")
```

Output:

```text
a ‸2.0
```

> [!‸nte]
> So `‸3.0`{out}.

```quiz
{"id": "q", "questions": [
  {"kind": "open", "q": "Q", ‸"refrence": "R"},
  {"kind": "mcq", "q": "Which?", "options": ["a", "b"], "answer": ‸2}‸,
]}
```
=== content/lessons/1.2-second.md
```python file=examples/second.py
‸raise ValueError
```

```mjcf
<mujoco>
  ‸<world/>
</mujoco>
```

```lab ‸simlb
{"xml": "<mujoco/>"}
```
=== content/lessons/1.3-third.md
‸Text ‸![](none.png).
=== models/box.xml
<mujoco>
  ‸<world/>
</mujoco>
"""
RULES_TOGETHER = """\
engine-version
prerequisite-unknown
heading-top heading-empty
link-lesson
math-syntax
fence-key-unknown
output-drift
callout-unknown
binding-mismatch
field-unknown
quiz-answer
json-syntax
script-failed
mjcf-error
lab-kind
lesson-unlisted
image-alt
model-error
"""


def test_everything_wrong_is_told_in_one_run_in_order(tmp_path: Path) -> None:
    layout = Layout.of(TOGETHER)
    places = marked(layout)
    layout.write(tmp_path)
    status, report = run(tmp_path, "check", "--format", "json")
    found = [f"{d['rule']} {d['path']}:{d['line']}:{d['column']}" for d in report["diagnostics"]]
    rules = [line.split() for line in RULES_TOGETHER.splitlines()]
    wanted = [
        f"{rule} {path}:{row}:{column}"
        for (path, row, column), names in zip(places, rules, strict=True)
        for rule in names
    ]
    assert sorted(found) == sorted(wanted)
    assert [line.rsplit(" ", 1)[1] for line in found] == [line.rsplit(" ", 1)[1] for line in wanted]
    assert status == 1
