"""Reading in a browser: nothing is too wide, lines are linked to, notes stand beside the text."""

from __future__ import annotations

import contextlib
import itertools
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from coursebuild.core.pages.theme import CODE, INTERFACE, MATH, TEXT
from support.axe import violations
from support.built_sites import Site
from support.fixture_cases import fixture_text
from support.lab_page import (
    becomes,
    has_been,
    note_changes,
    until,
    wait_for_condition,
    wait_until_settled,
)

pytestmark = pytest.mark.browser

LESSON = "lessons/1.1-one.html"
DRAFT = "lessons/1.3-line-ends.html"
"""A draft in the course of every construct: it shows its status."""
OpenPage = Callable[..., Page]


@pytest.fixture
def open_page(browsers: Mapping[str, Browser], sites: Mapping[str, Site]) -> Iterator[OpenPage]:
    """Open the lesson of a course, at a fragment of it, in a window of a width."""
    with contextlib.ExitStack() as stack:

        def open_page(name: str = "nasty", at: str = "", width: int = 1440, **options: Any) -> Page:
            viewport: Any = {"width": width, "height": 900}
            context = browsers["plain"].new_context(viewport=viewport, **options)
            page = stack.enter_context(context).new_page()
            page.goto(sites[name].url(LESSON) + at)
            wait_until_settled(page)
            return page

        yield open_page


OPEN_ALL = "document.querySelectorAll('details').forEach(d => d.open = true)"
FITS = "document.documentElement.scrollWidth <= innerWidth"


def test_hard_cases_behind_the_first_are_folded_where_they_stand_below_each_other(
    open_page: OpenPage,
) -> None:
    page = open_page()
    case = '<details class="case" open><summary>A case</summary></details>'
    page.locator("h1").evaluate(f"node => node.insertAdjacentHTML('afterend', '{case * 3}')")
    for width, count in ((390, 1), (1440, 3)):
        page.set_viewport_size({"width": width, "height": 900})
        expect(page.locator(".case[open]")).to_have_count(count)


@pytest.mark.parametrize("name", ["nasty", "arabic"])
def test_no_page_is_wider_than_its_window(
    sites: Mapping[str, Site], open_page: OpenPage, name: str
) -> None:
    page = open_page(name)
    for path in sites[name].pages():
        page.goto(sites[name].url(path))
        page.evaluate(OPEN_ALL)
        widths = (320, 360, 700, 1000, 1200, 1300) if path == LESSON else (320, 360)
        for width in widths:
            page.set_viewport_size({"width": width, "height": 900})
            until(page, FITS)


def test_far_parts_have_their_sizes_before_a_reader_jumps_to_them(open_page: OpenPage) -> None:
    page = open_page(width=390)
    page.evaluate("document.documentElement.style.setProperty('--below', 'visible')")
    height = page.evaluate("document.documentElement.scrollHeight")
    condition = "height => document.documentElement.scrollHeight === height"
    until(open_page(width=390), condition, height)


def test_wide_things_scroll_in_themselves(open_page: OpenPage) -> None:
    page = open_page(width=360)
    page.evaluate(OPEN_ALL)
    for selector in (".formula", ".formula-inline", ".table", ".script pre", ".output pre"):
        box = page.locator(selector).first
        room = box.evaluate("b => [b.scrollWidth - b.clientWidth, b.tabIndex]")
        assert room[0] > 0 and room[1] == 0, selector
    output = page.locator(".output pre").first
    output.focus()
    page.keyboard.press("End")
    page.keyboard.press("ArrowRight")
    wait_for_condition(page, lambda: output.evaluate("b => b.scrollLeft") > 0)


def test_the_end_of_a_long_line_of_code_keeps_clear_of_the_edge(open_page: OpenPage) -> None:
    for width in (360, 1000):
        page = open_page(width=width)
        page.evaluate(OPEN_ALL)
        box = page.locator(".script pre:has(code)").first
        room = """box => {
          const text = document.createRange()
          text.selectNodeContents(box.querySelector('code'))
          box.scrollLeft = 1e6
          return box.getBoundingClientRect().right - text.getBoundingClientRect().right
        }"""
        box.evaluate("box => box.querySelector('code').prepend('#'.repeat(300))")
        assert box.evaluate(room) >= 12, width


def test_code_in_a_callout_is_as_wide_as_elsewhere(open_page: OpenPage) -> None:
    page = open_page()

    def ends(*selectors: str) -> bool:
        boxes = [page.locator(selector).first.bounding_box() for selector in selectors]
        first_end, second_end = (box["x"] + box["width"] for box in boxes if box is not None)
        return bool(first_end == pytest.approx(second_end, abs=1))

    for width in (800, 1200, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        wait_for_condition(page, lambda: ends(".callout-solution > .code", ".prose > .script"))
        wait_for_condition(page, lambda: ends(".callout-solution > p >> nth=1", ".prose > p"))


def test_formulas_of_usual_height_leave_lines_where_they_are(open_page: OpenPage) -> None:
    page = open_page()
    item = page.locator("li:has(msqrt)")
    height = "e => e.getBoundingClientRect().height"
    plain_item = item.locator("xpath=following-sibling::li[1]")
    assert item.evaluate(height) == plain_item.evaluate(height)
    end = "getBoundingClientRect().right"
    gap = item.locator("msqrt").evaluate(f"e => e.{end} - e.querySelector('mi').{end}")
    assert gap < 2, "nothing behind a root"


def test_text_code_and_formulas_are_set_in_the_fonts_of_the_site(open_page: OpenPage) -> None:
    families_script = "[...document.fonts].filter(f => f.status === 'loaded').map(f => f.family)"
    families = {name.strip('"') for name in open_page().evaluate(families_script)}
    assert families >= {TEXT, INTERFACE, CODE, MATH}


def test_colours_are_kept_and_set_before_anything_is_drawn(open_page: OpenPage) -> None:
    page = open_page()
    background = "getComputedStyle(document.documentElement).backgroundColor"
    light = page.evaluate(background)
    page.get_by_label("Colours").select_option("dark")
    expect(page.locator("html")).not_to_have_css("background-color", light)
    dark = page.evaluate(background)
    early = "() => { window.early = document.documentElement.dataset.theme }"
    page.add_init_script(f"addEventListener('DOMContentLoaded', {early})")
    page.reload()
    until(page, "window.early === 'dark'")
    expect(page.locator("html")).to_have_css("background-color", dark)
    expect(page.get_by_label("Colours")).to_have_value("dark")
    page.get_by_label("Colours").select_option("auto")
    until(page, "localStorage.length === 0")


# ------------------------------------------------------------------------------- line links


def marked_ids(page: Page) -> list[str]:
    ids: list[str] = page.evaluate("[...document.querySelectorAll('.marked')].map(e => e.id)")
    return ids


def test_a_line_in_a_fold_is_shown_and_marked(open_page: OpenPage) -> None:
    page = open_page(at="#sub/wide.L60-L62")
    becomes(page, lambda: marked_ids(page), ["sub/wide.L60", "sub/wide.L61", "sub/wide.L62"])
    expect(page.locator("[id='sub/wide.L60']")).to_be_in_viewport()
    page.evaluate("location.hash = '#sub/wide.L4'")
    becomes(page, lambda: marked_ids(page), ["sub/wide.L4"])


def test_a_hidden_part_is_shown_where_a_link_leads_to_it(open_page: OpenPage) -> None:
    page = open_page()
    for line in (1, 8):
        code = page.locator(f"[id='walk.L{line}']")
        expect(code).to_be_hidden()
        page.evaluate(f"location.hash = '#walk.L{line}-L{line}'")
        expect(code).to_be_in_viewport()
        becomes(page, lambda line=line: marked_ids(page), [f"walk.L{line}"])
    expect(page.locator("[hidden=until-found]")).to_have_count(0)
    assert page.locator("[id='walk.py'] pre").first.inner_text().strip().endswith("steps = 3")


def test_a_long_line_is_shown_from_its_beginning(open_page: OpenPage) -> None:
    page = open_page(at="#sub/wide.L5", width=800)
    becomes(page, lambda: marked_ids(page), ["sub/wide.L5"])
    box = page.locator("pre:has([id='sub/wide.L5'])")
    measure = "b => [b.scrollWidth > b.clientWidth, b.scrollLeft]"
    becomes(page, lambda: box.evaluate(measure), [True, 0])


def test_a_link_opens_the_section_that_it_leads_into(
    sites: Mapping[str, Site], open_page: OpenPage
) -> None:
    page = open_page()
    for name, text in (
        ("Callouts", "text=Of the kind established."),
        ("Links lead in here", "#inside"),
    ):
        page.goto("about:blank")
        page.goto(sites["full"].url("lessons/1.1-text.html") + "#prose")
        inside = page.locator(text)
        expect(inside).not_to_be_visible()
        page.locator(".toc").get_by_role("link", name=name, exact=True).click()
        expect(inside).to_be_in_viewport()


def test_an_address_of_no_line_does_no_harm(open_page: OpenPage) -> None:
    page = open_page(at="#sub/wide.L3")
    for address in ("#sub/wide.L0", "#sub/wide.L9999", "#%", "#x.L1-L99999999"):
        page.evaluate("location.hash = '#sub/wide.L3'")
        becomes(page, lambda: marked_ids(page), ["sub/wide.L3"])
        page.evaluate("to => { location.hash = to }", address)
        becomes(page, lambda: marked_ids(page), [])
        page.reload()
        wait_until_settled(page)
        assert marked_ids(page) == [], address
    page.evaluate(OPEN_ALL)
    expect(page.locator(".lines").first).to_be_visible()


def test_lines_are_marked_by_pointer_and_by_keys(open_page: OpenPage) -> None:
    page = open_page()
    page.evaluate(OPEN_ALL)
    column = page.locator(".script pre > .lines").first
    column.scroll_into_view_if_needed()
    first = int(column.get_attribute("aria-valuemin"))
    box = column.bounding_box()
    height = box["height"] / column.inner_text().count("\n", 0) if box else 0
    column.click(position={"x": 20, "y": height * 2.2})
    wait_for_condition(page, lambda: len(marked_ids(page)) == 1)
    expect(page).to_have_url(re.compile(r"#sub/wide\.L\d+$"))
    becomes(page, lambda: marked_ids(page), [page.url.partition("#")[2]])
    column.press("Shift+ArrowDown")
    wait_for_condition(page, lambda: len(marked_ids(page)) == 2)
    expect(page).to_have_url(re.compile(r"#sub/wide\.L\d+-L\d+$"))
    column.press("Home")
    becomes(page, lambda: marked_ids(page), [f"sub/wide.L{first}"])
    expect(column).to_have_attribute("aria-valuenow", str(first))
    expect(page.locator(".lines").first).to_have_attribute("role", "slider")  # one control


def test_numbers_are_neither_copied_nor_selected(
    sites: Mapping[str, Site], open_page: OpenPage
) -> None:
    page = open_page()
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    script = page.locator(".script[data-script]").first
    button = script.get_by_role("button", name="Copy")
    note_changes(button)
    button.click()
    has_been(button, "Copied")
    text = page.evaluate("navigator.clipboard.readText()")
    assert text == (sites["nasty"].root / "examples/sub/wide.py").read_text()
    page.evaluate(OPEN_ALL)
    selection = page.evaluate(
        "() => { const chosen = getSelection()\n"
        "chosen.selectAllChildren(document.querySelector('.script pre'))\n"
        "return chosen.toString() }"
    )
    assert "import math" in selection
    assert not re.search(r"^\d+$", selection, re.MULTILINE)


# ------------------------------------------------------------------------------- side notes

NOTES = fixture_text("scripts/notes.js")
IN_THE_WAY = """([left, right]) =>
  [...document.querySelectorAll('.prose > :not(.footnotes), .formula')]
  .map((box) => box.getBoundingClientRect())
  .filter((box) => box.height && box.left < right && box.right > left)
  .map(({ top, bottom }) => [top, bottom])"""


def misplaced(page: Page, from_right: bool) -> list[Any]:
    """Notes in the margin that are not beside the text, out of order, or on something."""
    notes = [note for note in page.evaluate(NOTES) if note["aside"]]
    if not notes:
        return ["no note is in the margin"]
    prose = page.locator(".prose > p").first.bounding_box()
    assert prose is not None
    end = prose["x"] + prose["width"]
    obstacles = page.evaluate(IN_THE_WAY, [notes[0]["left"], notes[0]["right"]])
    is_beside = [
        note["right"] <= prose["x"] if from_right else note["left"] >= end for note in notes
    ]
    is_near = [abs(note["top"] - note["mark"]) < 720 for note in notes]
    is_clear = [all(n["bottom"] <= a + 1 or n["top"] >= b - 1 for a, b in obstacles) for n in notes]
    bad_notes: list[Any] = [
        note
        for note, *good in zip(notes, is_beside, is_near, is_clear, strict=True)
        if not all(good)
    ]
    return bad_notes + [
        two for two in itertools.pairwise(notes) if two[0]["bottom"] > two[1]["top"]
    ]


@pytest.mark.parametrize("name", ["nasty", "arabic"])
def test_notes_stand_in_the_margin_and_on_nothing(open_page: OpenPage, name: str) -> None:
    page = open_page(name)
    becomes(page, lambda: misplaced(page, name == "arabic"), [])


def test_each_note_is_there_once_and_folded_ones_wait(open_page: OpenPage) -> None:
    page = open_page()
    until(page, "document.querySelector('.footnotes .aside') !== null")
    folded = page.locator(".footnotes li", has_text="folded away")
    expect(page.get_by_text("A note whose mark is folded away.")).to_have_count(1)
    expect(folded).not_to_contain_class("aside")
    page.locator("summary.callout-head").click()
    until(page, "document.getElementById('fn:5').classList.contains('aside')")
    page.set_viewport_size({"width": 1000, "height": 900})
    until(page, "document.querySelector('.footnotes .aside') === null")

    def is_listed() -> bool:
        order = page.evaluate(NOTES)
        ids = [int(note["id"][3:]) for note in order]
        is_ordered = all(a["bottom"] <= b["top"] for a, b in itertools.pairwise(order))
        return is_ordered and ids == sorted(ids)

    wait_for_condition(page, is_listed)  # at the end


# ------------------------------------------------------------------------- from the right


def test_a_page_from_the_right_is_mirrored_and_its_code_is_not(
    sites: Mapping[str, Site], open_page: OpenPage
) -> None:
    page = open_page("arabic")

    def box(selector: str) -> dict[str, float]:
        bounds = page.locator(selector).first.bounding_box()
        assert bounds is not None, selector
        return {**bounds, "end": bounds["x"] + bounds["width"]}

    assert page.locator("html").get_attribute("dir") == "rtl"
    assert box(".toc")["x"] > box(".prose > p")["end"] > box(".dock-lab")["end"]
    assert box(".callout")["end"] == pytest.approx(box(".callout-head")["end"] + 20.8, abs=3)
    assert box("h1 .number")["x"] > 720, "the number stands first"
    directions = page.evaluate(
        "['pre', 'code', 'math', '.output pre', '.lab-picture'].map(s =>"
        " getComputedStyle(document.querySelector(s)).direction)"
    )
    assert directions == ["ltr"] * 5
    page.goto(sites["arabic"].url("lessons/1.2-two.html"))
    page.set_viewport_size({"width": 390, "height": 900})
    expect(page.locator(".level-nav .way").first).to_have_css(
        "transform", "matrix(-1, 0, 0, 1, 0, 0)"
    )


POSITIONS = fixture_text("scripts/positions.js")


QUANTITIES = {
    ".prose > p bdi": "-9.81\u00a0m/s²",
    "p:has(.bound) bdi": "1.25\u00a0s",
    "td:last-child": "-2.5\u00a0kg",
    ".lead bdi": "-10\u00a0m",
    "pre code": 'print("t =", 1.25, "s")\n',
}


def test_quantities_read_from_the_left(open_page: OpenPage) -> None:
    page = open_page("arabic")
    for selector, text in QUANTITIES.items():
        positions = page.evaluate(POSITIONS, selector)
        assert "".join(letter for letter, _ in positions) == text
        places = [left for letter, left in positions if letter != "\n"]
        assert places == sorted(places), selector


# ------------------------------------------------------------------------------- standards


@pytest.mark.parametrize("name", ["nasty", "arabic"])
def test_axe_finds_nothing(open_page: OpenPage, name: str) -> None:
    page = open_page(name, "#sub/wide.L6-L9" if name == "nasty" else "")
    page.evaluate(OPEN_ALL)
    assert violations(page) == []


def test_colours_of_the_reader_are_kept(sites: Mapping[str, Site], open_page: OpenPage) -> None:
    """High contrast: what is told by a colour of ours is told by one of the system's."""
    page = open_page(at="#sub/wide.L6", forced_colors="active")
    becomes(page, lambda: marked_ids(page), ["sub/wide.L6"])
    line, second_line = (page.locator(f"[id='sub/wide.L{n}']") for n in (6, 3))
    colour = "e => getComputedStyle(e).backgroundColor"
    assert line.evaluate(colour) != second_line.evaluate(colour)
    page.goto(sites["full"].url(DRAFT))
    shape = page.locator(".status-draft").first.evaluate(
        "e => getComputedStyle(e, '::before').borderTopStyle"
    )
    assert shape == "solid"
