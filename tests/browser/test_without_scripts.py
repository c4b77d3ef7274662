"""Pages with JavaScript off: what stands in them can be read, and what needs a script says so.

That pages hold what authors wrote is seen in `tests/courses`, where they are compared as text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from support.built_sites import Site
from support.fixture_cases import fixture_text

pytestmark = pytest.mark.browser


@pytest.fixture
def page(browsers: Mapping[str, Browser]) -> Iterator[Page]:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        yield context.new_page()


HIDDEN_CONTENT = fixture_text("scripts/hidden_content.js")
"""Texts, pictures and labs that nobody sees."""
EXPECTED_TEXTS = {
    "models": r"Models\s+\S",
    "progress": "Progress is kept by a script",
    "review": "scripts are switched off here",
    "search": "needs JavaScript",
    "offline": "This browser keeps nothing at present.",
}
"""What pages that need a script say."""


NAMES = ("full", "exercises", pytest.param("real", marks=pytest.mark.slow))


@pytest.mark.parametrize("name", NAMES)
def test_everything_can_be_read(sites: Mapping[str, Site], page: Page, name: str) -> None:
    """And no control does nothing."""
    site = sites[name]
    unseen: dict[str, Any] = {}
    for path in site.unlike_pages():
        page.goto(site.url(path))
        unseen[path] = page.evaluate(HIDDEN_CONTENT)
        dead = page.locator("main :is(button, select, textarea, input:not([disabled])):visible")
        expect(dead).to_have_count(0)
        expect(page.locator("h1")).to_have_count(1)
        text = re.compile(EXPECTED_TEXTS.get(site.kind(path), r"[\s\S]{40}"))
        expect(page.locator("main")).to_have_text(text, use_inner_text=True)
    assert {path: texts_found for path, texts_found in unseen.items() if texts_found} == {}


def test_line_is_reached_by_its_address(sites: Mapping[str, Site], page: Page) -> None:
    page.goto(sites["nasty"].url("lessons/1.1-one.html#sub/wide.L60"))
    line = page.locator("[id='sub/wide.L60']")
    expect(line).to_be_visible()  # the browser opens the fold
    expect(line).not_to_have_css("background-color", "rgba(0, 0, 0, 0)")


def test_lesson_in_a_scorm_package_is_a_link_away(scorm: Path, page: Page) -> None:
    page.goto((scorm / "sco/1.1-one.html").as_uri())
    page.get_by_role("link", name="1.1 Lesson one").click()
    expect(page.get_by_role("heading", level=1)).to_have_text(re.compile("Lesson one$"))
