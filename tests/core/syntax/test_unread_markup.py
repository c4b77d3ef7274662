"""Markup that was not read, and prose that only looks like it: `tests/fixtures/markup/`.

`pytest tests/core/syntax --rewrite-fixtures` writes the expected parts anew; those of
`innocent.md` stay empty.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.fixture_cases import check_cases, read_cases

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "tests/fixtures/markup"
MARKUP = {"markup-unread", "markup-foreign", "math-unread", "control-character", "merge-conflict"}


def mistakes(path: str, text: str) -> list[str]:
    source = Source(path, text)
    document = parse_document(source, frozenset(CALLOUTS), lesson="lessons" in path)
    return [
        f"{d.rule} {d.span.line}:{d.span.column} {d.span.first_line().text!r}"
        for d in document.diagnostics
    ]


def test_mistakes_are_reported_at_their_places(rewriting: bool) -> None:
    def render(case_text: str) -> str:
        return "".join(f"{line}\n" for line in mistakes("content/lessons/1.1-x.md", case_text))

    check_cases(FOLDER / "mistakes.md", lambda case: render(case.input), rewriting=rewriting)


def test_every_mistake_is_reported() -> None:
    cases = read_cases(FOLDER / "mistakes.md")
    silent = [case.title for case in cases if not case.expected]
    assert len(cases) >= 100
    assert silent == []


def test_ordinary_prose_and_escaped_markup_are_no_mistakes() -> None:
    cases = read_cases(FOLDER / "innocent.md")
    failures = {
        f"{case.line}: {case.title}": rules
        for case in cases
        if (rules := mistakes("content/lessons/1.1-x.md", case.input))
    }
    assert len(cases) >= 90
    assert failures == {}


@pytest.mark.parametrize("folder", ["content", "docs"])
def test_what_this_repository_publishes_has_no_unread_markup(folder: str) -> None:
    failures = {}
    for path in sorted((ROOT / folder).rglob("*.md")):
        name = path.relative_to(ROOT).as_posix()
        rules = [m for m in mistakes(name, path.read_text("utf-8")) if m.split()[0] in MARKUP]
        if rules:
            failures[name] = rules
    assert failures == {}
