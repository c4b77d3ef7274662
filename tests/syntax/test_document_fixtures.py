"""What a document becomes, and what its author is told: the fixture files, case by case.

A file in `tests/fixtures/syntax/` whose name begins with `page` is parsed as a page, all others as
lessons.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.source import Source
from coursebuild.syntax.document import parse_document
from coursebuild.vocabulary import CALLOUTS
from support.fixture_cases import Case, read_cases, rewritten
from support.tree_dump import dump

FOLDER = Path(__file__).parents[1] / "fixtures" / "syntax"
FILES = sorted(FOLDER.glob("*.md"))
KINDS = frozenset(kind.name for kind in CALLOUTS)
CASES = [
    pytest.param(path, case, id=f"{path.stem}:{case.line}")
    for path in FILES
    for case in read_cases(path)
]


def found(path: Path, case: Case) -> str:
    source = Source("content/lessons/1.1-x.md", case.input)
    return dump(parse_document(source, KINDS, lesson=not path.stem.startswith("page")))


def test_there_are_fixtures() -> None:
    assert len(FILES) >= 10
    assert {path.suffix for path in FOLDER.iterdir()} == {".md"}, "a file that no test reads"


@pytest.mark.parametrize(("path", "case"), CASES)
def test_a_case(path: Path, case: Case, request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--rewrite-fixtures"):
        pytest.skip("expected parts are being written anew")
    assert found(path, case) == case.expected


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_is_as_it_would_be_rewritten(path: Path, request: pytest.FixtureRequest) -> None:
    cases = read_cases(path)
    if request.config.getoption("--rewrite-fixtures"):
        text = rewritten(cases, [found(path, case) for case in cases])
        path.write_text(text, encoding="utf-8", newline="\n")
        cases = read_cases(path)
    assert path.read_text(encoding="utf-8") == rewritten(cases, [case.expected for case in cases])
