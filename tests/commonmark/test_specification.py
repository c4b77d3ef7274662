"""The examples of the CommonMark specification, through our parser and our renderer."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest

from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.markdown_files import commonmark_examples
from support.plain_html import check_formatting, plain_html


class Example(NamedTuple):
    number: int
    markdown: str
    html: str


@pytest.fixture(scope="module")
def examples() -> list[Example]:
    return [
        Example(i, markdown, normalize_tags(html))
        for i, (markdown, html) in enumerate(commonmark_examples(), start=1)
    ]


@pytest.fixture(scope="module")
def differences() -> dict[int, str]:
    text = (Path(__file__).parent / "differences.toml").read_text(encoding="utf-8")
    reasons: dict[str, str] = tomllib.loads(text)["examples"]
    return {int(number): reason for number, reason in reasons.items()}


def render(markdown: str) -> str:
    source = Source("spec.md", markdown)
    return normalize_tags(plain_html(parse_document(source, frozenset(), lesson=True).value))


def normalize_tags(html: str) -> str:
    """HTML whose tags without content end as ours do."""
    return html.replace(" />", ">")


def test_all_examples_are_read(examples: list[Example]) -> None:
    assert len(examples) == 652


def test_examples_stay_the_same_when_formatted(examples: list[Example]) -> None:
    for example in examples:
        check_formatting(example.markdown, 20, lesson=False)


def test_examples(examples: list[Example], differences: dict[int, str]) -> None:
    failures = [
        f"example {e.number}: {e.markdown!r}\n  wanted {e.html!r}\n  got {render(e.markdown)!r}"
        for e in examples
        if e.number not in differences and render(e.markdown) != e.html
    ]
    assert not failures, "\n".join(failures)


def test_line_ends_make_no_difference(examples: list[Example]) -> None:
    for line_end in ("\r\n", "\r"):
        for e in examples:
            html = render(e.markdown.replace("\n", line_end))
            assert html == render(e.markdown), f"example {e.number} with {line_end!r}"


def test_listed_differences_differ_and_have_reasons(
    examples: list[Example], differences: dict[int, str]
) -> None:
    for number, reason in differences.items():
        assert len(reason) > 20, f"example {number} is listed without a reason"
        example = examples[number - 1]
        assert render(example.markdown) != example.html, f"example {number} does not differ"
