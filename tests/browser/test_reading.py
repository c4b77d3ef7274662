"""Reading in a browser: nothing is too wide, lines are linked to, notes stand beside the text."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from support.built_sites import Site
from support.lab_page import until
from support.reading_courses import ARABIC, LONG, NASTY, build
from support.scratch_course import Folder
from support.static_host import Host

pytestmark = pytest.mark.browser

LESSON = "lessons/1.1-one.html"
MODULES = Path(__file__).parents[2] / "site" / "node_modules"


@pytest.fixture(scope="module")
def hosts(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[dict[str, Host]]:
    """A course of what is hard to fit, and one from the right."""
    found = {}
    texts = {"nasty": (NASTY, f"Nasty {LONG}", "en"), "arabic": (ARABIC, "مقرر", "ar")}
    for name, (text, title, language) in texts.items():
        folder = Folder(tmp_path_factory.mktemp(name) / "course")
        found[name] = Host(build(folder, stores, text, title, language), "/c/")
    yield found
    for host in found.values():
        host.stop()


@pytest.fixture
def open_page(browsers: dict[str, Browser]) -> Iterator[Any]:
    """Open an address in a window of a width."""
    contexts = []

    def open_page(url: str, width: int = 1440, **options: Any) -> Page:
        viewport: Any = {"width": width, "height": 900}
        context = browsers["plain"].new_context(viewport=viewport, **options)
        contexts.append(context)
        page = context.new_page()
        page.goto(url)
        return page

    yield open_page
    for context in contexts:
        context.close()


def pages(host: Host) -> list[str]:
    return sorted(p.relative_to(host.folder).as_posix() for p in host.folder.rglob("*.html"))


OPEN_ALL = "document.querySelectorAll('details').forEach(d => d.open = true)"
WIDTH = "document.documentElement.scrollWidth"


@pytest.mark.parametrize("width", [320, 360])
@pytest.mark.parametrize("name", ["nasty", "arabic", "real"])
def test_no_page_is_wider_than_a_narrow_window(
    hosts: dict[str, Host], sites: dict[str, Site], open_page: Any, name: str, width: int
) -> None:
    """Every page but those of planned lessons, of which one stands for all."""
    host = sites["real"].host if name == "real" else hosts[name]
    page = open_page(host.url, width)
    stubs = 0
    for path in pages(host):
        planned = b'class="on-stub"' in (host.folder / path).read_bytes()
        stubs += planned
        if planned and stubs > 1:
            continue
        page.goto(host.url + path)
        page.evaluate(OPEN_ALL)
        assert page.evaluate(WIDTH) <= width, path


@pytest.mark.parametrize("width", [700, 1000, 1200, 1300])
def test_nor_than_a_wider_one(hosts: dict[str, Host], open_page: Any, width: int) -> None:
    page = open_page(hosts["nasty"].url + LESSON, width)
    page.evaluate(OPEN_ALL)
    assert page.evaluate(WIDTH) <= width


def test_wide_things_scroll_in_themselves(hosts: dict[str, Host], open_page: Any) -> None:
    page = open_page(hosts["nasty"].url + LESSON, 360)
    for selector in (".formula", ".formula-inline", ".table", ".script pre", ".output pre"):
        box = page.locator(selector).first
        room = box.evaluate("b => [b.scrollWidth - b.clientWidth, b.tabIndex]")
        assert room[0] > 0 and room[1] == 0, selector


@pytest.mark.parametrize("width", [800, 1200, 1440])
def test_code_in_a_callout_is_as_wide_as_elsewhere(
    hosts: dict[str, Host], open_page: Any, width: int
) -> None:
    page = open_page(hosts["nasty"].url + LESSON, width)

    def end(selector: str) -> float:
        box = page.locator(selector).first.bounding_box()
        return float(box["x"] + box["width"])

    assert end(".callout-solution > .code") == pytest.approx(end(".prose > .script"), abs=1)
    assert end(".callout-solution > p >> nth=1") == pytest.approx(end(".prose > p"), abs=1)


def test_formulas_of_usual_height_leave_lines_where_they_are(
    hosts: dict[str, Host], open_page: Any
) -> None:
    page = open_page(hosts["nasty"].url + LESSON)
    item = page.locator("li:has(msqrt)")
    height = "e => e.getBoundingClientRect().height"
    without = item.locator("xpath=following-sibling::li[1]")
    assert item.evaluate(height) == without.evaluate(height)
    end = "getBoundingClientRect().right"
    gap = item.locator("msqrt").evaluate(f"e => e.{end} - e.querySelector('mi').{end}")
    assert gap < 2, "nothing behind a root"


# ------------------------------------------------------------------------------- line links


def marked(page: Page) -> list[str]:
    found: list[str] = page.evaluate("[...document.querySelectorAll('.marked')].map(e => e.id)")
    return found


def test_a_line_in_a_fold_is_shown_and_marked(hosts: dict[str, Host], open_page: Any) -> None:
    url = hosts["nasty"].url + LESSON
    page = open_page(f"{url}#sub/wide.L60-L62")
    assert marked(page) == ["sub/wide.L60", "sub/wide.L61", "sub/wide.L62"]
    line = page.locator("[id='sub/wide.L60']")
    assert line.is_visible()
    top = line.bounding_box()["y"]
    assert 0 < top < 900
    page.evaluate("location.hash = '#sub/wide.L4'")
    until(page, "document.querySelector('.marked')?.id === 'sub/wide.L4'")


def test_a_long_line_is_shown_from_its_beginning(hosts: dict[str, Host], open_page: Any) -> None:
    page = open_page(f"{hosts['nasty'].url}{LESSON}#sub/wide.L5", 800)
    box = page.locator("pre:has([id='sub/wide.L5'])")
    assert box.evaluate("b => [b.scrollWidth > b.clientWidth, b.scrollLeft]") == [True, 0]


def test_a_line_is_reached_without_scripts(hosts: dict[str, Host], open_page: Any) -> None:
    page = open_page(f"{hosts['nasty'].url}{LESSON}#sub/wide.L60", java_script_enabled=False)
    line = page.locator("[id='sub/wide.L60']")
    assert line.is_visible(), "the browser opens the fold"
    background = line.evaluate("e => getComputedStyle(e).backgroundColor")
    assert background != "rgba(0, 0, 0, 0)"


@pytest.mark.parametrize("hash", ["#sub/wide.L0", "#sub/wide.L9999", "#%", "#x.L1-L99999999"])
def test_an_address_of_no_line_does_no_harm(
    hosts: dict[str, Host], open_page: Any, hash: str
) -> None:
    page = open_page(hosts["nasty"].url + LESSON + hash)
    assert marked(page) == []
    assert page.locator(".lines").count() > 0


def test_lines_are_marked_by_pointer_and_by_keys(hosts: dict[str, Host], open_page: Any) -> None:
    page = open_page(hosts["nasty"].url + LESSON)
    column = page.locator(".script > pre > .lines").first
    column.scroll_into_view_if_needed()
    first = int(column.get_attribute("aria-valuemin"))
    box = column.bounding_box()
    height = box["height"] / column.inner_text().count("\n", 0) if box else 0
    column.click(position={"x": 20, "y": height * 2.2})
    start = marked(page)
    assert len(start) == 1 and page.evaluate("location.hash") == f"#{start[0]}"
    column.press("Shift+ArrowDown")
    assert len(marked(page)) == 2
    assert re.fullmatch(r"#sub/wide\.L\d+-L\d+", page.evaluate("location.hash"))
    column.press("Home")
    assert marked(page) == [f"sub/wide.L{first}"]
    assert column.get_attribute("aria-valuenow") == str(first)
    assert page.locator(".lines").first.get_attribute("role") == "slider", "one control, one name"


def test_numbers_are_neither_copied_nor_selected(hosts: dict[str, Host], open_page: Any) -> None:
    page = open_page(hosts["nasty"].url + LESSON)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    script = page.locator(".script[data-script]").first
    script.get_by_role("button", name="Copy").click()
    script.get_by_role("button", name="Copied").wait_for()
    text = page.evaluate("navigator.clipboard.readText()")
    assert text == (hosts["nasty"].folder / "examples/sub/wide.py").read_text()
    chosen = page.evaluate(
        "() => { const chosen = getSelection()\n"
        "chosen.selectAllChildren(document.querySelector('.script pre'))\n"
        "return chosen.toString() }"
    )
    assert not re.search(r"^\d+$", chosen, re.MULTILINE)


# ------------------------------------------------------------------------------- side notes

NOTES = """() => [...document.querySelectorAll('.footnotes > ol > li')].map((note) => {
  const { top, bottom, left, right } = note.getBoundingClientRect()
  const mark = document.getElementById(note.id.replace('fn:', 'fnref:')).getBoundingClientRect()
  return { id: note.id, aside: note.classList.contains('aside'), top, bottom, left, right,
    mark: mark.top, text: note.textContent }
})"""
IN_THE_WAY = """([left, right]) =>
  [...document.querySelectorAll('.prose > :not(.footnotes), .formula')]
  .map((box) => box.getBoundingClientRect())
  .filter((box) => box.height && box.left < right && box.right > left)
  .map(({ top, bottom }) => [top, bottom])"""


@pytest.mark.parametrize("name", ["nasty", "arabic"])
def test_notes_stand_in_the_margin_and_on_nothing(
    hosts: dict[str, Host], open_page: Any, name: str
) -> None:
    page = open_page(hosts[name].url + LESSON)
    until(page, "document.querySelector('.footnotes .aside') !== null")
    page.wait_for_timeout(300)
    notes = page.evaluate(NOTES)
    placed = [note for note in notes if note["aside"]]
    assert placed
    prose = page.locator(".prose > p").first.bounding_box()
    for note in placed:
        beside = (
            note["left"] >= prose["x"] + prose["width"]
            if name == "nasty"
            else note["right"] <= prose["x"]
        )
        assert beside, note
        assert abs(note["top"] - note["mark"]) < 720
    for one, other in itertools.pairwise(placed):
        assert one["bottom"] <= other["top"], "in the order of their marks"
    for top, bottom in page.evaluate(IN_THE_WAY, [placed[0]["left"], placed[0]["right"]]):
        for note in placed:
            assert note["bottom"] <= top + 1 or note["top"] >= bottom - 1, note


def test_each_note_is_there_once_and_folded_ones_wait(
    hosts: dict[str, Host], open_page: Any
) -> None:
    page = open_page(hosts["nasty"].url + LESSON)
    until(page, "document.querySelector('.footnotes .aside') !== null")
    folded = page.locator(".footnotes li", has_text="folded away")
    assert page.get_by_text("A note whose mark is folded away.").count() == 1
    assert "aside" not in (folded.get_attribute("class") or "")
    page.locator("summary.callout-head").click()
    until(page, "document.getElementById('fn:5').classList.contains('aside')")
    page.set_viewport_size({"width": 1000, "height": 900})
    until(page, "document.querySelector('.footnotes .aside') === null")
    order = page.evaluate(NOTES)
    assert [n["id"] for n in order] == sorted((n["id"] for n in order), key=lambda i: int(i[3:]))
    assert all(a["bottom"] <= b["top"] for a, b in itertools.pairwise(order)), "a list at the end"


# ------------------------------------------------------------------------- from the right


def test_a_page_from_the_right_is_mirrored_and_its_code_is_not(
    hosts: dict[str, Host], open_page: Any
) -> None:
    page = open_page(hosts["arabic"].url + LESSON)

    def box(selector: str) -> dict[str, float]:
        found = page.locator(selector).first.bounding_box()
        assert found is not None, selector
        return {**found, "end": found["x"] + found["width"]}

    assert page.locator("html").get_attribute("dir") == "rtl"
    assert box(".toc")["x"] > box(".prose > p")["end"] > box(".dock-lab")["end"]
    assert box(".callout")["end"] == pytest.approx(box(".callout-head")["end"] + 20.8, abs=3)
    assert box("h1 .number")["x"] > 720, "the number stands first"
    directions = page.evaluate(
        "['pre', 'code', 'math', '.output pre', '.lab-picture'].map(s =>"
        " getComputedStyle(document.querySelector(s)).direction)"
    )
    assert directions == ["ltr"] * 5


POSITIONS = """(selector) => {
  const box = document.querySelector(selector)
  const walker = document.createTreeWalker(box, NodeFilter.SHOW_TEXT)
  const found = []
  for (let node = walker.nextNode(); node; node = walker.nextNode())
    for (let at = 0; at < node.length; at++) {
      const range = document.createRange()
      range.setStart(node, at)
      range.setEnd(node, at + 1)
      found.push([node.data[at], range.getBoundingClientRect().left])
    }
  return found
}"""


@pytest.mark.parametrize(
    ("selector", "text"),
    [
        (".prose > p bdi", "-9.81\u00a0m/s²"),
        ("p:has(.bound) bdi", "1.25\u00a0s"),
        ("td:last-child", "-2.5\u00a0kg"),
        (".lead bdi", "-10\u00a0m"),
        ("pre code", 'print("t =", 1.25, "s")\n'),
    ],
)
def test_quantities_read_from_the_left(
    hosts: dict[str, Host], open_page: Any, selector: str, text: str
) -> None:
    found = open_page(hosts["arabic"].url + LESSON).evaluate(POSITIONS, selector)
    assert "".join(letter for letter, _ in found) == text
    places = [left for letter, left in found if letter != "\n"]
    assert places == sorted(places)


# ------------------------------------------------------------------------------- standards

AXE = """axe.run(document, {rules: {"color-contrast-enhanced": {enabled: true}}}).then(found =>
    found.violations.map(v => [v.id, v.nodes[0].html, v.nodes[0].failureSummary]))"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1440])
@pytest.mark.parametrize("name", ["nasty", "arabic"])
def test_axe_finds_nothing(
    hosts: dict[str, Host], open_page: Any, name: str, width: int, scheme: str
) -> None:
    axe = (MODULES / "axe-core" / "axe.min.js").read_text(encoding="utf-8")
    url = hosts[name].url + LESSON + ("#sub/wide.L6-L9" if name == "nasty" else "")
    page = open_page(url, width, color_scheme=scheme, bypass_csp=True)
    page.evaluate(OPEN_ALL)
    page.evaluate(axe)
    assert page.evaluate(AXE) == []


def test_colours_of_the_reader_are_kept(hosts: dict[str, Host], open_page: Any) -> None:
    """High contrast: what is told by a colour of ours is told by one of the system's."""
    page = open_page(f"{hosts['nasty'].url}{LESSON}#sub/wide.L6", forced_colors="active")
    line, other = (page.locator(f"[id='sub/wide.L{n}']") for n in (6, 3))
    colour = "e => getComputedStyle(e).backgroundColor"
    assert line.evaluate(colour) != other.evaluate(colour)
    shape = page.locator(".status").first.evaluate(
        "e => getComputedStyle(e, '::before').borderTopStyle"
    )
    assert shape == "solid"
