"""Tables that Pandoc reads are tables here as well; what only looks like one is left alone."""

from __future__ import annotations

import pytest

from coursebuild.features.importer.pandoc_tables import rewrite_tables
from support.fixture_cases import FIXTURES, Case, check_cases, fixture_tables


def rewritten(case: Case) -> str:
    """The new text without the empty lines that keep the places of what follows."""

    def leave(line: int) -> None:
        raise AssertionError(f"line {line} is left")

    new, _ = rewrite_tables(case.input, leave)
    assert new.count("\n") == case.input.count("\n")
    return "".join(f"{line}\n" for line in new.split("\n") if line.strip("> "))


def test_what_pandoc_reads_as_a_table_is_one(rewriting: bool) -> None:
    check_cases(FIXTURES / "imports/pandoc_tables.md", rewritten, rewriting=rewriting)


@pytest.mark.parametrize("text", fixture_tables("no_tables")["texts"])
def test_what_is_no_table_stays(text: str) -> None:
    assert rewrite_tables(text, lambda line: None) == (text, 0)
