"""The diagnostics of wrong JSON, TOML, course maps, files beside models, labs and quizzes.

The cases are `tests/fixtures/texts/`; `pytest tests/core/syntax --rewrite-fixtures` writes their
expected parts anew.
"""

from __future__ import annotations

import pytest

from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from support.json_fences import parse_lab, parse_quiz
from support.json_fences import parse_text as parse
from support.text_cases import FOLDER, Reader, check_texts

DEEP = "objects and arrays nest more than 64 deep"


def read_toml(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    return None, parse_toml(Source("course.toml", text)).diagnostics


def read_map(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    parsed_map = parse_course_map(Source("content/course.toml", text))
    return parsed_map.value, parsed_map.diagnostics


def read_model(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    parsed_file = parse_declarations(Source("models/arms/arm.toml", text))
    return parsed_file.value, parsed_file.diagnostics


def read_lab(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    parsed_lab = parse_lab(text)
    return parsed_lab.value, parsed_lab.diagnostics


READERS: dict[str, Reader] = {
    "json": lambda text: (None, parse(text).diagnostics),
    "toml": read_toml,
    "map": read_map,
    "model": read_model,
    "lab": read_lab,
    "quiz": lambda text: (None, parse_quiz(text).diagnostics),
}


@pytest.mark.parametrize("name", READERS)
def test_diagnostics_of_wrong_texts(name: str, rewriting: bool) -> None:
    check_texts(name, READERS[name], rewriting=rewriting)


def test_every_file_of_texts_is_read() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == {*READERS, "fields"}


def test_notes_point_at_the_first_key_and_at_the_bracket() -> None:
    notes = [
        (diagnostics[0].message, note.message, note.span and (note.span.line, note.span.column))
        for diagnostics in (
            parse('{"a": 1,\n "a": 2}').diagnostics,
            parse('{"a":\n [1}').diagnostics,
            read_toml("[a]\nb = 1\nb = 2\n")[1],
        )
        for note in diagnostics[0].notes
    ]
    assert notes == [
        ("`a` is given twice", "the first one is here", (1, 2)),
        ("expected `,` or `]`, found `}`", "`[` is opened here", (2, 2)),
        ("`b` is given twice", "the first one is here", (2, 1)),
    ]


def test_deep_nesting_and_long_numbers_are_reported() -> None:
    diagnostics = [
        *parse("[" * 100_000).diagnostics,
        *parse('{"a":' * 100_000).diagnostics,
        *parse("[" + "9" * 5000 + "]").diagnostics,
        *read_toml("a = " + "[" * 9_999)[1],
    ]
    assert [(d.span.start, d.message) for d in diagnostics] == [
        (64, DEEP),
        (320, DEEP),
        (1, "a number of 5000 digits is too long"),
        (0, "tables, arrays or keys nest too deep"),
    ]


def test_nesting_up_to_the_limit_is_read() -> None:
    assert parse("[" * 64 + "]" * 64).diagnostics == ()
    assert read_toml("a = " + "[" * 64 + "]" * 64)[1] == ()
    assert read_toml(".".join("a" * 64) + " = 1")[1] == ()
