"""Pages with JavaScript off: everything that the author wrote can be read on them.

What has to be there comes from the documents as they are parsed, not from the pages.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from html import unescape
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from coursebuild.core.model import (
    CodeBlock,
    CodeSpan,
    Course,
    Document,
    Heading,
    Image,
    Inline,
    Math,
    MathBlock,
    Mjcf,
    NumberBinding,
    PlainCode,
    Recording,
    Script,
    Table,
    Text,
    document_blocks,
    document_inlines,
)
from coursebuild.core.model.results import Formula
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.pages.urls import lesson_path, page_path
from coursebuild.core.run.v8 import MathEngine
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.io.model import Io
from coursebuild.features.lab.model import Lab
from coursebuild.features.quiz.model import ChoiceQuestion, NumericQuestion, OrderQuestion, Quiz
from support.built_sites import Site

pytestmark = pytest.mark.browser


def squeezed(text: str) -> str:
    """Text without what only sets it: kinds of space, joiners, capitals, the kind of minus."""
    plain = text.replace("\u2212", "-").casefold()
    return re.sub(r"[\s\u00a0\u202f\u2009\u2060-\u2064\u200b\ufeff]+", "", plain)


def documents(site: Site) -> Iterator[tuple[str, Document]]:
    """The documents of a course, and the site paths of their pages."""
    course = course_of(site)
    known = frozenset(kind.name for kind in (*CALLOUTS, *course.callouts))
    owners = [(lesson_path(x), x.path, True) for x in course.lessons]
    owners += [(page_path(x), x.path, False) for x in course.pages]
    for page, path, lesson in owners:
        if (site.root / path).is_file():
            text = (site.root / path).read_bytes().decode()
            parsed = parse_document(Source(path, text), known, lesson=lesson)
            assert parsed.value is not None
            yield page, parsed.value


def course_of(site: Site) -> Course:
    path = "content/course.toml"
    parsed = parse_course_map(Source(path, (site.root / path).read_text(encoding="utf-8")))
    assert parsed.value is not None
    return parsed.value


def words(inlines: Iterable[Inline]) -> Iterator[str]:
    for inline in inlines:
        if isinstance(inline, Text | CodeSpan | NumberBinding):
            yield inline.text


def texts(document: Document) -> Iterator[str]:
    """Every piece of text that a reader has to find."""
    # The label of a paragraph `Figure:` says what it is, and is not shown.
    yield from (text for text in words(document_inlines(document)) if text != "Figure: ")
    for block in document_blocks(document):
        if isinstance(block, Script | CodeBlock | Mjcf | PlainCode):
            yield from block.code.text.splitlines()
        elif isinstance(block, Recording) and not isinstance(block.body, Table):
            yield from block.body.text.splitlines()
        elif isinstance(block, Heading):
            yield "".join(words(block.children))
        elif isinstance(block, Io):
            yield from words((*block.input, *block.process, *block.output))
        elif isinstance(block, Lab):
            yield block.fields.title
            yield from (control.label for control in block.fields.controls)
            yield from (readout.label for readout in block.fields.readouts)
        elif isinstance(block, Quiz):
            yield block.title


def formulas(document: Document) -> Iterator[Formula]:
    for inline in document_inlines(document):
        if isinstance(inline, Math):
            yield Formula(inline.tex.text, inline.display)
    for block in document_blocks(document):
        if isinstance(block, MathBlock):
            yield Formula(block.tex.text, True)


@pytest.fixture
def page(browsers: Mapping[str, Browser]) -> Iterator[Page]:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        yield context.new_page()


NAMES = [pytest.param("real", marks=pytest.mark.slow), "full"]


@pytest.mark.parametrize("name", NAMES)
def test_everything_written_can_be_read(sites: Mapping[str, Site], page: Page, name: str) -> None:
    """Sentences, scripts and outputs, formulas, answers and pictures."""
    missing: list[Any] = []
    count = dict.fromkeys(("pieces", "formulas", "answers", "pictures"), 0)
    with MathEngine() as engine:
        for path, document in documents(sites[name]):
            page.goto(sites[name].url(path))
            page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true })")
            shown = squeezed(page.locator("body").inner_text())
            pieces = [text for text in texts(document) if squeezed(text)]
            missing += [(path, text) for text in pieces if squeezed(text) not in shown]
            count["pieces"] += len(pieces)
            signs = signs_wanted(engine, document)
            set_in = squeezed(page.locator("body").evaluate(SIGNS))
            missing += [(path, one) for one in signs if one not in set_in]
            count["formulas"] += len(signs)
            missing += [(path, "a formula is not drawn")] * page.evaluate(UNDRAWN)
            answers = list(answers_shown(page, document))
            missing += [(path, text) for text, there in answers if not there]
            count["answers"] += len(answers)
            pictures = page.evaluate(PICTURES)
            missing += [(path, alt) for alt, is_drawn in pictures if not is_drawn]
            alts = {squeezed(alt) for alt, _ in pictures}
            images = [i for i in document_inlines(document) if isinstance(i, Image)]
            missing += [(path, i.alt) for i in images if squeezed(unescape(i.alt)) not in alts]
            missing += [(path, "a lab has no picture")] * page.evaluate(LABS_WITHOUT)
            count["pictures"] += len(pictures)
    assert missing == []
    least = {"pieces": 300, "formulas": 10, "answers": 4, "pictures": 1}
    assert {kind: number for kind, number in count.items() if number < least[kind]} == {}


SIGNS = """body => {
  for (const annotation of body.querySelectorAll('annotation')) annotation.remove()
  return [...body.querySelectorAll('math')].map(math => math.textContent).join('')
}"""
UNDRAWN = """[...document.querySelectorAll('math')]
  .filter(one => one.getBoundingClientRect().width === 0).length"""
PICTURES = """Promise.all(
[...document.querySelectorAll('main img:not(.figure-dark)')].map(async (one) => {
  one.loading = 'eager'
  await one.decode()
  return [one.alt, one.naturalWidth > 0 && one.getBoundingClientRect().width > 0]
}))"""
LABS_WITHOUT = """[...document.querySelectorAll('[data-lab][data-config]')].filter(lab => {
  const first = lab.querySelector('img, svg')
  return !first || (lab.querySelector('img') && !first.checkVisibility())
}).length"""


def signs_wanted(engine: MathEngine, document: Document) -> list[str]:
    """The signs of formulas; a long one stands in pieces, between which a line may end."""
    wanted = engine.typeset(list(formulas(document)))
    signs = [squeezed(signs_of(found)) for found in wanted if isinstance(found, str)]
    assert len(signs) == len(wanted)
    return signs


def signs_of(mathml: str) -> str:
    return unescape(re.sub(r"(?s)<annotation\b.*?</annotation>|<[^>]*>", "", mathml))


def answers_shown(page: Page, document: Document) -> Iterator[tuple[str, bool]]:
    """What right answers say, and whether it stands with its question."""
    for quiz in document_blocks(document):
        if isinstance(quiz, Quiz):
            answers = page.locator(f'[data-quiz="{quiz.id}"] details.answer').all_inner_texts()
            assert len(answers) == len(quiz.questions)
            for question, answer in zip(quiz.questions, answers, strict=True):
                yield from ((t, squeezed(t) in squeezed(answer)) for t in keys(question))


def keys(question: object) -> Iterator[str]:
    """What the right answer to a question says."""
    if isinstance(question, ChoiceQuestion):
        for index in question.answers:
            yield from words(question.options[index].text)
    elif isinstance(question, NumericQuestion):
        yield question.answer_text
    elif isinstance(question, OrderQuestion):
        for item in question.items:
            yield from words(item)


def test_no_page_waits_for_a_script(sites: Mapping[str, Site], page: Page) -> None:
    """No control that does nothing, nothing empty where something is promised."""
    for path in sites["full"].kinds().values():
        page.goto(sites["full"].url(path))
        dead = page.locator("main :is(button, select, textarea, input:not([disabled])):visible")
        expect(dead).to_have_count(0)
        expect(page.locator("h1")).to_have_count(1)
        expect(page.locator("main")).to_have_text(re.compile(r"[\s\S]{40}"), use_inner_text=True)
