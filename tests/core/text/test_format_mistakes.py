"""Mistakes whose place only a whole course shows, each alone; and the good cases beside them.

The cases are fixtures in `tests/fixtures/mistakes/`. Where a mistake is expected its place is
marked in the input by `‸`, which is taken out before the course is written; the expected text is
the rule. A case whose expected text is empty must be found good. Words are tested elsewhere: those
of each rule in `fixtures/rules`, those of each parser in `tests/core/syntax`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from coursebuild.core.text.rules import RULES
from coursebuild.pipeline.check import check
from support.fixture_cases import Case, read_cases
from support.rule_cases import Layout, Workshop

FIXTURES = Path(__file__).parents[2] / "fixtures" / "mistakes"
MARK = "‸"
FILES = sorted(FIXTURES.glob("*.md"))
TIERS = {"labs": pytest.mark.engine, "mjcf": pytest.mark.site, "scripts": pytest.mark.site}


@dataclass(frozen=True, order=True)
class Place:
    """Where a mistake is, and which."""

    path: str
    line: int
    column: int
    rule: str

    def __str__(self) -> str:
        return f"{self.rule} {self.path}:{self.line}:{self.column}"


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workshop]:
    with Workshop(tmp_path_factory.mktemp("workshop")) as workshop:
        yield workshop


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
    assert not left, f"{case.title}: a mark without a rule"
    assert len(places) <= 1, f"{case.title}: one mistake at a time"
    return sorted(places)


def compared(case: Case, root: Path, workshop: Workshop) -> str | None:
    """How what is found differs from what is expected, if it does."""
    layout = Layout.of(case.input)
    wanted = expected(case, marked(layout))
    layout.write(root)
    if layout.later:
        check(workshop.options(root))
        layout.write_later(root)
    if "```lab" in case.input:
        diagnostics = workshop.try_labs(root)
    else:
        diagnostics = check(workshop.options(root)).diagnostics
    found = sorted(Place(d.span.path, d.span.line, d.span.column, d.rule) for d in diagnostics)
    assert all(d.severity.value == RULES[d.rule].severity for d in diagnostics)
    if found == wanted:
        return None
    return f"line {case.line}, {case.title}: {[*map(str, found)]}, not {[*map(str, wanted)]}"


@pytest.mark.parametrize(
    "path", [pytest.param(path, id=path.stem, marks=TIERS.get(path.stem, ())) for path in FILES]
)
def test_each_mistake_is_told_once_at_its_place(
    path: Path, workshop: Workshop, tmp_path: Path
) -> None:
    cases = read_cases(path)
    wrong = [compared(case, tmp_path / str(case.line), workshop) for case in cases]
    assert [one for one in wrong if one is not None] == []


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


@pytest.mark.site
def test_everything_wrong_is_told_in_one_run_in_order(workshop: Workshop, tmp_path: Path) -> None:
    layout = Layout.of(TOGETHER)
    places = marked(layout)
    layout.write(tmp_path)
    found = [
        str(Place(d.span.path, d.span.line, d.span.column, d.rule))
        for d in check(workshop.options(tmp_path)).diagnostics
    ]
    rules = [line.split() for line in RULES_TOGETHER.splitlines()]
    wanted = [
        f"{rule} {path}:{row}:{column}"
        for (path, row, column), names in zip(places, rules, strict=True)
        for rule in names
    ]
    assert sorted(found) == sorted(wanted)
    assert [line.rsplit(" ", 1)[1] for line in found] == [line.rsplit(" ", 1)[1] for line in wanted]
