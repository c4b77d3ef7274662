"""The documents and diagnostics of the fixture files, case by case.

A file in `tests/fixtures/syntax/` whose name begins with `page` is parsed as a page, all others as
lessons. `pytest tests/core/syntax --rewrite-fixtures` writes the expected parts anew.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.fixture_cases import Case, check_cases
from support.tree_dump import dump

FOLDER = Path(__file__).parents[2] / "fixtures" / "syntax"
FILES = sorted(FOLDER.glob("*.md"))
KINDS = frozenset(CALLOUTS)


def dump_document(path: Path, case: Case) -> str:
    source = Source("content/lessons/1.1-x.md", case.input)
    return dump(parse_document(source, KINDS, lesson=not path.stem.startswith("page")))


def test_every_file_of_the_folder_is_read() -> None:
    assert len(FILES) >= 10
    assert set(FOLDER.iterdir()) == set(FILES)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_documents_are_as_their_fixtures_say(path: Path, rewriting: bool) -> None:
    check_cases(path, lambda case: dump_document(path, case), rewriting=rewriting)
