"""What an author is told of text that is no JSON or TOML: `tests/fixtures/texts/`.

Each line of an input is one text, as a string of Python; below it stands in the expected part what
is told of it. `pytest tests/core/syntax --rewrite-fixtures` writes the expected parts anew.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from support.fixture_cases import read_cases, rewrite
from support.json_texts import parse
from support.positioned_nodes import shown

FOLDER = Path(__file__).parents[2] / "fixtures" / "texts"
DEEP = "objects and arrays nest more than 64 deep"


def mistakes(language: str, text: str) -> tuple[Diagnostic, ...]:
    parsed = parse(text) if language == "json" else parse_toml(Source("course.toml", text))
    return parsed.diagnostics


def told(language: str, texts: str) -> str:
    lines = []
    for line in texts.splitlines():
        text = ast.literal_eval(line)
        lines += [line, *(f"  {one}" for one in shown(mistakes(language, text)))]
    return "".join(f"{line}\n" for line in lines)


@pytest.mark.parametrize("language", ["json", "toml"])
def test_what_an_author_is_told(language: str, request: pytest.FixtureRequest) -> None:
    path = FOLDER / f"{language}.md"
    cases = read_cases(path)
    found = [replace(case, expected=told(language, case.input)) for case in cases]
    if request.config.getoption("--rewrite-fixtures"):
        rewrite(path, found)
    for case, now in zip(cases, found, strict=True):
        assert now.expected == case.expected, f"{path.name}:{case.line}: {case.title}"


def test_notes_point_at_the_first_key_and_at_the_bracket() -> None:
    notes = [
        (diagnostics[0].message, note.message, note.span and (note.span.line, note.span.column))
        for diagnostics in (
            mistakes("json", '{"a": 1,\n "a": 2}'),
            mistakes("json", '{"a":\n [1}'),
            mistakes("toml", "[a]\nb = 1\nb = 2\n"),
        )
        for note in diagnostics[0].notes
    ]
    assert notes == [
        ("`a` is given twice", "the first one is here", (1, 2)),
        ("expected `,` or `]`, found `}`", "`[` is opened here", (2, 2)),
        ("`b` is given twice", "the first one is here", (2, 1)),
    ]


@pytest.mark.parametrize(
    ("language", "text", "start", "message"),
    [
        ("json", "[" * 100_000, 64, DEEP),
        ("json", '{"a":' * 100_000, 320, DEEP),
        ("toml", "a = " + "[" * 9_999, 0, "tables, arrays or keys nest too deep"),
        ("json", "[" + "9" * 5000 + "]", 1, "a number of 5000 digits is too long"),
    ],
)
def test_what_is_too_deep_or_too_long(language: str, text: str, start: int, message: str) -> None:
    told = [(one.span.start, one.message) for one in mistakes(language, text)]
    assert told == [(start, message)]


def test_nesting_up_to_the_limit_is_read() -> None:
    assert mistakes("json", "[" * 64 + "]" * 64) == ()
    assert mistakes("toml", "a = " + "[" * 64 + "]" * 64) == ()
    assert mistakes("toml", ".".join("a" * 64) + " = 1") == ()
