"""Pages with JavaScript off: everything that the author wrote can be read on them.

What has to be there comes from the documents as they are parsed, not from the pages.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from html import unescape

import pytest
from playwright.sync_api import Browser, Page

from coursebuild.effects.v8 import MathEngine
from coursebuild.model import (
    ChoiceQuestion,
    CodeBlock,
    CodeSpan,
    Course,
    Document,
    Heading,
    Image,
    Inline,
    Io,
    Lab,
    Math,
    MathBlock,
    Mjcf,
    NumberBinding,
    NumericQuestion,
    OrderQuestion,
    PlainCode,
    Quiz,
    Recording,
    Script,
    Table,
    Text,
    document_blocks,
    document_inlines,
)
from coursebuild.render.urls import lesson_path, page_path
from coursebuild.results import Formula
from coursebuild.source import Source
from coursebuild.syntax.coursemap import parse_course_map
from coursebuild.syntax.document import parse_document
from coursebuild.vocabulary import CALLOUTS
from support.built_sites import Site

pytestmark = pytest.mark.browser
NAMES = ("real", "full")


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
    yield from words(document_inlines(document))
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
            yield block.title
            yield from (control.label for control in block.controls)
            yield from (readout.label for readout in block.readouts)
        elif isinstance(block, Quiz):
            yield block.title


def formulas(document: Document) -> Iterator[Formula]:
    for inline in document_inlines(document):
        if isinstance(inline, Math):
            yield Formula(inline.tex.text, inline.display)
    for block in document_blocks(document):
        if isinstance(block, MathBlock):
            yield Formula(block.tex.text, True)


def opened(page: Page, site: Site, path: str) -> str:
    """A page with all that is folded open: what is in sight on it."""
    page.goto(site.url(path))
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true })")
    return squeezed(page.locator("body").inner_text())


@pytest.fixture
def page(browsers: dict[str, Browser]) -> Iterator[Page]:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        yield context.new_page()


@pytest.mark.parametrize("name", NAMES)
def test_every_sentence_script_and_output_is_there(
    sites: dict[str, Site], page: Page, name: str
) -> None:
    count = 0
    for path, document in documents(sites[name]):
        shown = opened(page, sites[name], path)
        pieces = [squeezed(text) for text in texts(document)]
        assert [piece for piece in pieces if piece not in shown] == [], path
        count += len(pieces)
    assert count > 300


@pytest.mark.parametrize("name", NAMES)
def test_every_formula_is_there(sites: dict[str, Site], page: Page, name: str) -> None:
    """By the signs that it is set in; a long one stands in pieces, between which a line may end."""
    count = 0
    with MathEngine() as engine:
        for path, document in documents(sites[name]):
            opened(page, sites[name], path)
            shown = squeezed(page.locator("body").evaluate(SIGNS))
            wanted = engine.typeset(list(formulas(document)))
            signs = [squeezed(signs_of(found)) for found in wanted if isinstance(found, str)]
            assert len(signs) == len(wanted)
            assert [one for one in signs if one not in shown] == [], path
            boxes = "all => all.filter(one => one.getBoundingClientRect().width === 0).length"
            assert page.locator("math").evaluate_all(boxes) == 0, f"{path}: not drawn"
            count += len(signs)
    assert count > 10


SIGNS = """body => {
  for (const annotation of body.querySelectorAll('annotation')) annotation.remove()
  return [...body.querySelectorAll('math')].map(math => math.textContent).join('')
}"""


def signs_of(mathml: str) -> str:
    return unescape(re.sub(r"(?s)<annotation\b.*?</annotation>|<[^>]*>", "", mathml))


@pytest.mark.parametrize("name", NAMES)
def test_every_answer_is_there(sites: dict[str, Site], page: Page, name: str) -> None:
    count = 0
    for path, document in documents(sites[name]):
        quizzes = [block for block in document_blocks(document) if isinstance(block, Quiz)]
        if not quizzes:
            continue
        opened(page, sites[name], path)
        for quiz in quizzes:
            place = page.locator(f'[data-quiz="{quiz.id}"]')
            answers = place.locator("details.answer").all()
            assert len(answers) == len(quiz.questions)
            for question, answer in zip(quiz.questions, answers, strict=True):
                shown = squeezed(answer.inner_text())
                for text in keys(question):
                    assert squeezed(text) in shown, (path, question.key)
                    count += 1
    assert count >= 4


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


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_is_there(sites: dict[str, Site], page: Page, name: str) -> None:
    """Pictures of the author's, and the recorded picture of each lab."""
    count = 0
    for path, document in documents(sites[name]):
        images = [i for i in document_inlines(document) if isinstance(i, Image)]
        labs = [b for b in document_blocks(document) if isinstance(b, Lab)]
        if not images and not labs:
            continue
        opened(page, sites[name], path)
        found = page.locator("main img").evaluate_all(
            """all => Promise.all(all.map(async (one) => {
              one.loading = 'eager'
              await one.decode()
              return [one.alt, one.naturalWidth > 0 && one.getBoundingClientRect().width > 0]
            }))"""
        )
        drawn = [squeezed(alt) for alt, is_drawn in found if is_drawn]
        assert len(drawn) == len(found), path
        for image in images:
            assert squeezed(unescape(image.alt)) in drawn, path
        assert len(found) >= len(images), path
        for lab in page.locator("[data-lab][data-config]").all():
            picture = lab.locator("img, svg")
            assert picture.count() >= 1 and (
                lab.locator("img").count() == 0 or picture.first.is_visible()
            )
        count += len(found)
    assert count >= 1


def test_no_page_waits_for_a_script(sites: dict[str, Site], page: Page) -> None:
    """No control that does nothing, nothing empty where something is promised."""
    for site in sites.values():
        for kind, path in site.kinds().items():
            page.goto(site.url(path))
            dead = page.locator("main :is(button, select, textarea, input:not([disabled])):visible")
            assert dead.count() == 0, (site.name, kind)
            assert page.locator("h1").count() == 1, (site.name, kind)
            assert len(page.locator("main").inner_text()) > 40, (site.name, kind)
