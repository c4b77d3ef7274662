"""Mistakes that only a whole course shows, and good cases that resemble them.

The cases are fixtures in `tests/fixtures/mistakes/`. Where a mistake is expected its place is
marked in the input by `‸`, which is taken out before the course is written; the expected text is
the rule. A case whose expected text is empty must give no diagnostic. The wording is tested
elsewhere: of each rule in `fixtures/rules`, of each parser in `tests/core/syntax`.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.pipeline.check import check
from support.fixture_cases import Case, read_cases
from support.rule_cases import Layout, Workshop
from support.rule_cases import workshop as workshop

FIXTURES = Path(__file__).parents[2] / "fixtures" / "mistakes"
MARK = "‸"
FILES = sorted(FIXTURES.glob("*.md"))
SITE = pytest.mark.site
TIERS = {"labs": pytest.mark.engine, "mjcf": SITE, "scripts": SITE, "together": SITE}


def take_marks(layout: Layout) -> list[tuple[str, int, int]]:
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


def expected_rules(case: Case, marks: list[tuple[str, int, int]]) -> list[str]:
    """The rules that a case expects, with their places.

    Each line has the rules of one mark. A line `rule PATH:LINE:COLUMN` needs no mark.
    """
    places, unused_marks = [], list(marks)
    for line in case.expected.splitlines():
        if ":" in line:
            places.append(line)
        else:
            path, row, column = unused_marks.pop(0)
            places += [f"{rule} {path}:{row}:{column}" for rule in line.split()]
    assert not unused_marks, f"{case.title}: a mark without a rule"
    return places


def compare(case: Case, root: Path, workshop: Workshop) -> str | None:
    """How the rules found in a case differ from those expected, if they do."""
    layout = Layout.of(case.input)
    expected = expected_rules(case, take_marks(layout))
    layout.write(root)
    if layout.later:
        check(workshop.options(root))
        layout.write_later(root)
    if "```lab" in case.input and "file=examples" not in case.input:
        diagnostics = workshop.try_labs(root)
    else:
        diagnostics = check(workshop.options(root)).diagnostics
    rules = [f"{d.rule} {d.span.path}:{d.span.line}:{d.span.column}" for d in diagnostics]
    # The diagnostics of one place may come in any order.
    if sorted(rules) == sorted(expected) and [*map(place_of, rules)] == [*map(place_of, expected)]:
        return None
    return f"line {case.line}, {case.title}: {rules}, not {expected}"


def place_of(rule: str) -> str:
    return rule.partition(" ")[2]


@pytest.mark.parametrize(
    "path", [pytest.param(path, id=path.stem, marks=TIERS.get(path.stem, ())) for path in FILES]
)
def test_mistakes_are_reported_once_at_their_places(
    path: Path, workshop: Workshop, tmp_path: Path
) -> None:
    cases = read_cases(path)
    failures = [compare(case, tmp_path / str(case.line), workshop) for case in cases]
    assert [failure for failure in failures if failure is not None] == []
