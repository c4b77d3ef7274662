"""What authors write, and the outputs of their scripts: read, checked, drawn, compared.

For each target there is a function that raises where something is wrong, and one that yields its
first inputs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.checks.lessons import check_course
from coursebuild.core.model import Course, Document, Filter
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import update_body
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Source
from coursebuild.report.text import Style, diagnostic_text
from support.fixture_cases import Case, fixture_text, read_cases
from support.plain_html import plain_html
from support.random_lessons import KINDS
from support.sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    recording,
    tolerance,
    update,
)

ROOT = Path(__file__).parents[2]
FIXTURES = ROOT / "tests/fixtures"
PATH = "content/lessons/1.1-one.md"
MAP = fixture_text("documents/fuzz_map.toml")


def seed_texts(name: str) -> Iterator[bytes]:
    """The texts of a file in `seeds`, between which is a line of `=`."""
    path = Path(__file__).parent / f"seeds/{name}.txt"
    yield from path.read_bytes().split(b"=====\n")


# --- lessons


def lesson(text: str) -> None:
    """Read, checked, drawn and told of."""
    parse_result = parse_document(Source(PATH, text), KINDS, lesson=True)
    for diagnostic in parse_result.diagnostics:
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text), diagnostic
    plain_html(parse_result.value)
    course = parse_course_map(Source("content/course.toml", MAP)).value
    assert course is not None
    describe(*parse_result.diagnostics, *check_course(with_document(course, parse_result.value)))


def with_document(course: Course, document: Document) -> Course:
    (level,) = course.levels
    (lesson,) = level.lessons
    lessons = (replace(lesson, document=document),)
    return replace(course, levels=(replace(level, lessons=lessons),))


def describe(*diagnostics: Diagnostic) -> None:
    for diagnostic in diagnostics:
        assert diagnostic.message and diagnostic_text(diagnostic, Style(colour=False))


def _fixture_cases() -> Iterator[Case]:
    for path in sorted(FIXTURES.rglob("*.md")):
        if path.parent.name not in ("documents", "right_texts"):  # whole texts, and not cases
            yield from read_cases(path)


def lessons() -> Iterator[bytes]:
    """Parts of real ones, and those of the fixtures."""
    for path in sorted((ROOT / "content/lessons").glob("*.md")):
        for part in re.split("^(?=## )", path.read_text("utf-8"), flags=re.MULTILINE):
            yield part[:3000].encode()
    yield from (case.input.encode() for case in _fixture_cases())
    for folder in ("documents", "right_texts"):
        yield from (path.read_bytes() for path in sorted(FIXTURES.glob(f"{folder}/*.md")))


def info_string(text: str) -> None:
    lesson(f"```{text}\nprint(1)\n```\n\nOutput:\n\n```text\n1\n```\n")


def info_strings() -> Iterator[bytes]:
    lines = (re.findall(rb"^```(.+)", text, re.MULTILINE) for text in lessons())
    yield from sorted({*chain.from_iterable(lines)})


_JSON = re.compile(rb"^```(quiz|lab|mjcf|bench|io)[^\n]*\n.*?^```$", re.MULTILINE | re.DOTALL)


def json_bodies() -> Iterator[bytes]:
    """Fences that a feature reads, those of the real course last: they are long."""
    bodies = {part[0] for text in lessons() for part in _JSON.finditer(text)}
    yield from sorted(bodies, key=len)


# --- TOML


def course_map(text: str) -> None:
    describe(*parse_course_map(Source("content/course.toml", text)).diagnostics)


def course_maps() -> Iterator[bytes]:
    yield (ROOT / "content/course.toml").read_bytes()[:4000]
    for case in _fixture_cases():
        if "[course]" in case.input:
            yield case.input[case.input.index("[course]") :].encode()


def declarations(text: str) -> None:
    describe(*parse_declarations(Source("models/a.toml", text)).diagnostics)


def declaration_files() -> Iterator[bytes]:
    for path in sorted((ROOT / "models").glob("*.toml")):
        yield path.read_bytes()


# --- outputs

_COMPARISONS = (EXACT, DIGITS, ELLIPSIS, DIGITS_ELLIPSIS, tolerance("0.05", "0.05"))
_UNWRITABLE = "[`~]{3}|[\r\0\ufeff\ud800-\udfff]"
_FILTERS = ((), (Filter(r"\d\.\d", "N"),), (Filter(r"^b.*\n", ""), Filter(" +$", "")))


def comparison(text: str) -> None:
    """A recorded output and a printed one, `how NUL recorded NUL printed`.

    After an update all is well, or it was refused.
    """
    rule, _, rest = text.partition("\0")
    recorded, _, printed = rest.partition("\0")
    by = _COMPARISONS[len(rule) % 5]
    filters = _FILTERS[len(rule) % 3]
    if re.search(_UNWRITABLE, recorded + printed) or not printed.strip():
        return
    body = recording(recorded)
    edit = update_body(body, replace(by, course_filters=filters), printed)
    if isinstance(edit, Edit):
        update(body, printed, by, filters)
    elif edit is None:
        assert compare(body, replace(by, course_filters=filters), printed).status != "drift"


def outputs() -> Iterator[bytes]:
    for length in range(15):
        yield (
            b"x" * length + b"\0a 1.50 b\n ... 2e-3\nc |x=-0.0\0a 1.54 b\nb\n ... 2.1e-3\nc |x=nan"
        )
