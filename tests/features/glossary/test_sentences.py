"""The sentence around a term, and the next one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from coursebuild.core.model import Paragraph, Term, plain_text, walk_inlines
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.glossary import definition_of, runs_on
from support.fixture_cases import check_lines


def definition(text: str) -> Iterator[str]:
    """Yield the definition of the first term of a text, and say whether it runs on."""
    document = parse_document(Source("x.md", text), frozenset(), lesson=False).value
    paragraph = document.blocks[0]
    assert isinstance(paragraph, Paragraph)
    term = next(i for i in walk_inlines(paragraph.children) if isinstance(i, Term))
    inlines = definition_of(paragraph.children, term)
    yield plain_text(inlines).strip()
    if runs_on(inlines):
        yield "and runs on"


def test_a_definition_is_the_sentence_of_its_term_and_the_next(rewriting: bool) -> None:
    check_lines(Path(__file__).with_name("sentences.md"), definition, rewriting=rewriting)
