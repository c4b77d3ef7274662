"""Raw HTML that a course allows, as a browser's parser reads the page that shows it."""

from __future__ import annotations

import html
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import (
    HtmlBlock,
    RawInline,
    block_inlines,
    document_blocks,
    walk_inlines,
)
from coursebuild.core.pages.html_xml import HtmlContent, HtmlElement, parse_html
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.fixture_cases import fixture_text
from support.hostile_html import PAGES
from support.plain_html import PlainWriter

REFUSED_TAGS = fixture_text("html/refused.txt").rstrip("\n").split("\n\n")
ALLOWED_TAGS = fixture_text("html/allowed.txt").rstrip("\n").split("\n\n")
ACTIVE = frozenset(
    "script iframe object embed form input button base meta link style foreignobject animate set "
    "template noscript textarea select frame frameset applet portal".split()
)
PIECES = (
    *(
        piece
        for text in (*REFUSED_TAGS, *ALLOWED_TAGS)
        for piece in re.split(r"(?=[<>\"'= ])", text)
    ),
    *("\n\n", "\n", "`", "*", "$", "&lt;", "> ", "| a | b |\n|---|---|\n| ", " |\n"),
)


def check_page(text: str) -> tuple[list[str], str]:
    """The messages about the HTML of a lesson, and its page."""
    parsed_page = parse_document(Source("x.md", text), frozenset(), lesson=False)
    messages = [d.message for d in parsed_page.diagnostics if d.rule == "link-scheme"]
    for block in document_blocks(parsed_page.value):
        raw = [i for i in walk_inlines(block_inlines(block)) if isinstance(i, RawInline)]
        for node in [*raw, *([block] if isinstance(block, HtmlBlock) else ())]:
            messages += [part.message for part in node.forbidden]
    return messages, str(PlainWriter().render_blocks(parsed_page.value.blocks))


def find_active(content: list[HtmlContent]) -> list[str]:
    """What could run, load or send something, as a browser reads it."""
    offenders = []
    for element in (item for item in content if isinstance(item, HtmlElement)):
        offenders += [element.name] if element.name.lower() in ACTIVE else []
        for name, value in element.attributes.items():
            address = re.sub(r"[\x00-\x20]", "", html.unescape(value)).lower()
            acts = name.startswith("on") or name in ("srcdoc", "formaction", "is", "ping")
            if acts or address.startswith(("javascript:", "vbscript:", "data:text")):
                offenders.append(f"{element.name} {name}={value}")
        offenders += find_active(element.children)
    return offenders


@pytest.mark.parametrize("context", ["{}", "a {} b", "> {}", "- {}", "| a |\n|---|\n| {} |"])
def test_active_html_is_refused_in_every_context(context: str) -> None:
    accepted = [
        tag for tag in REFUSED_TAGS if not check_page(context.format(tag.replace("\n", " ")))[0]
    ]
    pages = {tag: check_page(context.format(tag))[1] for tag in accepted}
    assert not [tag for tag, page in pages.items() if find_active(parse_html(page))]
    assert len(accepted) < 5, "some are no tags in a line of Markdown, and shown as text"


def test_harmless_html_is_allowed() -> None:
    assert [check_page(tag)[0] for tag in ALLOWED_TAGS] == [[] for _ in ALLOWED_TAGS]


@given(st.lists(st.sampled_from(PIECES), max_size=25).map("".join) | PAGES | st.text())
def test_a_browser_finds_nothing_active_in_a_page_that_is_allowed(text: str) -> None:
    messages, page = check_page(text)
    if not messages:
        assert find_active(parse_html(page)) == []
