"""The preview in a real browser: only what differs is replaced; mistakes, drift, acceptance."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from support.axe import violations
from support.lab_page import wait_for_condition
from support.preview_page import LESSON, PreviewPage, lesson_page
from support.preview_process import serve_preview
from support.scratch_course import GOOD, WAIT_FOR_GO, Make, block
from support.waiting import wait_for_file


def see(locator: Locator) -> None:
    expect(locator).to_be_visible()


def texts(page: Page, text: str) -> None:
    expect(page.locator(".prose")).to_contain_text(text)


FILLER = "".join(f"Paragraph {n}.\n\n" for n in range(80))
QUIZ = {
    "id": "q",
    "title": "Quiz",
    "questions": [{"kind": "numeric", "q": "How many?", "answer": 1, "hints": ["Count."]}],
}
RICH = (
    GOOD
    + f"## Quiz\n\n```quiz\n{json.dumps(QUIZ)}\n```\n\n"
    + "Text with $x^2$ and *emphasis*.\n\n"
    + FILLER
)


@pytest.fixture
def browser(browsers: Mapping[str, Browser]) -> Browser:
    return browsers["plain"]


@pytest.mark.browser
def test_what_was_not_touched_stays_as_and_where_it_is(make: Make, browser: Browser) -> None:
    folder = make(RICH)
    with lesson_page(folder, browser) as page:
        hint = page.locator("details.hint")
        hint.locator("summary").click()
        page.get_by_role("button", name="Copy").focus()
        elements = page.locator("h2, .script, .hint, math").evaluate_all(
            "elements => elements.map((element) => (element.mine = true)).length"
        )
        page.evaluate(
            """() => {
              const text = document.querySelector('em').firstChild
              getSelection().setBaseAndExtent(text, 1, text, 5)
            }"""
        )
        folder.replace(folder.lesson(), "Paragraph 3.", "Paragraph three, with $y$.")
        texts(page, "Paragraph three")
        expect(hint).to_have_attribute("open", "")
        expect(page.get_by_role("button", name="Copy")).to_be_focused()
        wait_for_condition(page, lambda: page.evaluate("String(getSelection())") == "mpha")
        elements_after = page.locator("h2, .script, .hint, math").evaluate_all(
            "elements => elements.filter((element) => element.mine).length"
        )
        assert elements_after == elements
        place = page.locator("p", has_text="Paragraph 40.")
        place.scroll_into_view_if_needed()
        top = "element => element.getBoundingClientRect().top"
        before = place.evaluate(top)
        folder.replace(folder.lesson(), "## Quiz\n", f"{'Much more. ' * 400}\n\n## Quiz\n")
        texts(page, "Much more.")
        expect(page.locator("html")).to_have_css("overflow-anchor", "auto")
        wait_for_condition(page, lambda: abs(place.evaluate(top) - before) < 1)


@pytest.mark.browser
def test_each_kind_of_change_arrives(make: Make, browser: Browser) -> None:
    folder = make(RICH)
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: ")
        with PreviewPage(browser, preview, LESSON) as window:
            page = window.page
            text = folder.text(folder.lesson())
            for old, new, visible_text in (
                ("## Hello", "## Good morning", "main h2:first-of-type >> text=Good morning"),
                ("$x^2$", "$z^{17}$", "math >> text=17"),
                ("*emphasis*", "**strength**", "strong >> text=strength"),
                ("Paragraph 5.", "- a list\n- of two", "li >> text=of two"),
                ("Paragraph 7.\n\n", "", "p >> text=Paragraph 8"),
                ("Paragraph 9.", "```python\nx = 1\n```", ".code >> text=x = 1"),
                ('"How many?"', '"How few?"', ".question >> text=How few?"),
                ("Paragraph 11.", '<p style="color: red">Red</p>', "p >> text=Red"),
            ):
                text = text.replace(old, new)
                folder.write(folder.lesson(), text)
                see(page.locator(visible_text).first)
            expect(page.locator("p", has_text="Paragraph 7.")).to_have_count(0)
            # Scripts also prepare the new parts of a page.
            see(page.locator(".code").get_by_role("button", name="Copy"))
            expect(page.locator(".toc a").first).to_contain_text("Good morning")
            # The updated page equals the page after a reload.
            red = page.locator("p", has_text="Red")
            expect(red).to_have_css("color", "rgb(255, 0, 0)")
            structure = """() => {
              const page = document.querySelector('main').cloneNode(true)
              page.querySelectorAll('.copy').forEach((button) => button.remove())
              for (const element of page.querySelectorAll('*')) {
                element.style.removeProperty('--below')
                if (element.style.length === 0) element.removeAttribute('style')
                for (const name of ['tabindex', 'data-more', 'aria-current', 'open']) {
                  element.removeAttribute(name)
                }
              }
              return page.innerHTML
            }"""
            see(page.locator(".question.is-live"))  # its script is loaded when it is needed
            living = page.evaluate(structure)
            window.check_unbroken()
            page.reload()
            see(page.locator(".question.is-live"))
            wait_for_condition(page, lambda: page.evaluate(structure) == living)


@pytest.mark.browser
def test_lab_that_was_not_touched_goes_on(make: Make, browser: Browser) -> None:
    lab = {"title": "A lab", "model": "ball", "readouts": [{"label": "t", "expr": "data.time"}]}
    folder = make(GOOD + f"```lab\n{json.dumps(lab)}\n```\n\nAfter it.\n")
    ball = "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    folder.write("models/ball.xml", ball)
    with lesson_page(folder, browser) as page:
        live = page.locator(".lab-live")
        see(live)
        live.evaluate("element => (element.mine = true)")
        folder.replace(folder.lesson(), "## Hello", "New before it.\n\n## Hello")
        texts(page, "New before it.")
        folder.replace(folder.lesson(), "After it.", "Later.")
        texts(page, "Later.")
        expect(live).to_have_js_property("mine", True)
        folder.replace(folder.lesson(), '"A lab"', '"Another lab"')
        expect(page.locator(".lab-title")).to_contain_text("Another lab")
        expect(live).not_to_have_js_property("mine", True)
        see(page.locator(".lab.lab-on .lab-live"))
        expect(live).to_have_count(1)


@pytest.mark.browser
def test_page_that_goes_and_one_that_comes(make: Make, browser: Browser) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    map_ = folder.text("content/course.toml")
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: ")
        with PreviewPage(browser, preview, "lessons/1.2-two.html") as window:
            page = window.page
            folder.write("content/course.toml", map_.replace('"two"', '"zwei"'))
            (folder.root / folder.lesson(2)).rename(folder.root / "content/lessons/1.2-zwei.md")
            see(page.locator(".preview-button", has_text="this page no longer exists"))
            window.check_unbroken()
            with PreviewPage(browser, preview, "lessons/1.2-two.html") as missing:
                expect(missing.page.locator("main")).to_contain_text("There is no page")
                family = re.compile("Source Serif")
                expect(missing.page.locator("h1")).to_have_css("font-family", family)
                (folder.root / "content/lessons/1.2-zwei.md").rename(folder.root / folder.lesson(2))
                folder.write("content/course.toml", map_)
                expect(missing.page.locator(".prose h2")).to_contain_text("Two")
            expect(page.locator(".preview-button")).to_be_hidden()


@pytest.mark.browser
def test_preview_that_stops_and_starts_again(make: Make, browser: Browser) -> None:
    folder = make(GOOD)
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: ")
        port = preview.port
        window = PreviewPage(browser, preview, LESSON)
    with window:
        see(window.page.locator(".preview-button", has_text="the preview has stopped"))
        folder.replace(folder.lesson(), "## Hello", "## Back")
        with serve_preview(folder, "--port", str(port)):
            expect(window.page.locator(".prose h2")).to_contain_text("Back")
            expect(window.page.locator(".preview-button")).to_be_hidden()
            assert window.page.evaluate("window.same")


@pytest.mark.browser
def test_preview_has_no_accessibility_fault(make: Make, browser: Browser) -> None:
    """With everything that it can show at once, light and dark."""
    folder = make(GOOD.replace("3.14159\n```", "3\n```") + "`7`{out}\n", "[x](lesson:one)\n")
    with serve_preview(folder) as preview:
        preview.wait_for_line("link-lesson")
        with PreviewPage(browser, preview, LESSON) as window:
            page = window.page
            see(page.get_by_role("button", name="Accept this output"))
            page.locator(".preview-button").click()
            see(page.get_by_role("region", name="Problems"))
            assert violations(page) == []


@pytest.mark.browser
def test_a_mistake_that_knows_its_cure_is_fixed_from_its_page(make: Make, browser: Browser) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    with lesson_page(folder, browser) as page:
        before = folder.text(folder.lesson())
        folder.write(folder.lesson(), f"{before}\n## Part {{#part\n\nSee [y](lesson:9.9).\n")
        panel = page.get_by_role("region", name="Problems")
        page.get_by_role("button", name="2 mistakes").click()
        fix = panel.get_by_role("button", name="Fix it")
        expect(fix).to_have_count(1)
        expect(panel.locator("ins")).to_have_text("## Part {#part}")
        fix.click()
        expect(fix).to_have_count(0)
        text = f"{before}\n## Part {{#part}}\n\nSee [y](lesson:9.9).\n"
        assert folder.text(folder.lesson()) == text
        expect(panel).to_contain_text("lesson 9.9 is not in the course map")


@pytest.mark.browser
def test_mistakes_are_shown_and_clear_by_themselves(
    make: Make, browser: Browser, tmp_path: Path
) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    editor, calls = tmp_path / "code", tmp_path / "told"
    editor.write_text(f'#!/bin/sh\necho "$@" > "{calls}"\n')
    editor.chmod(0o755)
    with serve_preview(folder, env={"VISUAL": str(editor)}) as preview:
        preview.wait_for_line("checked: ")
        second_page = PreviewPage(browser, preview, "lessons/1.2-two.html")
        with second_page, PreviewPage(browser, preview, LESSON) as page_open:
            page = page_open.page
            panel = page.get_by_role("region", name="Problems")
            expect(panel).to_have_count(0)
            folder.replace(folder.lesson(), "## Hello\n", "## Seen\n\n[x](lesson:9.9)\n")
            # The list begins closed; the mistake stands where it is on the page.
            expect(page.locator(".prose h2").first).to_contain_text("Seen")
            note = page.get_by_role("note")
            expect(note).to_contain_text("lesson 9.9 is not in the course map")
            expect(page.locator(".prose").get_by_role("link", name="x", exact=True)).to_have_count(
                0
            )
            expect(panel).to_have_count(0)
            button = page.get_by_role("button", name="1 mistake")
            expect(button).to_have_attribute("aria-expanded", "false")
            button.focus()
            page.keyboard.press("Enter")
            see(panel)
            expect(panel).to_contain_text("What is wrong on this page")
            panel.get_by_role("button", name="content/lessons/1.1-one.md:3:5").click()
            wait_for_file(calls, 1)
            assert calls.read_text() == f"--goto {folder.root / folder.lesson()}:3:5\n"
            expect(panel.locator(".preview-source mark")).to_have_text("lesson:9.9")
            panel.get_by_role("link", name="Show it on the page").click()
            expect(note).to_be_focused()
            expect(note).to_be_in_viewport()
            expect(panel).to_have_count(0)
            button.click()
            page.keyboard.press("Escape")
            expect(panel).to_have_count(0)
            expect(button).to_be_focused()
            other_window = second_page.page
            elsewhere = other_window.get_by_role("region", name="Problems")
            other_window.get_by_role("button", name="1 mistake").click()
            expect(elsewhere).to_contain_text("What is wrong with the course")
            folder.replace(folder.lesson(2), "## Two\n", "[x](lesson:9.9)\n")
            folder.replace(folder.lesson(), "[x](lesson:9.9)", "[x](lesson:9.9) $\\frac{1$")
            page.get_by_role("button", name="3 mistakes").click()
            # On each page, its own mistakes come first.
            expect(panel.get_by_role("list")).to_have_count(2)
            expect(panel.get_by_role("list").first.get_by_role("listitem")).to_have_count(2)
            expect(elsewhere).to_contain_text("Elsewhere in the course")
            expect(elsewhere.get_by_role("listitem").first).to_contain_text("1.2-two.md:1:5")
            expect(note).to_have_count(2)
            expect(page.locator(".prose code.tex")).to_have_text("\\frac{1")
            folder.write(folder.lesson(2), "## Two\n\nText.\n")
            expect(panel).to_contain_text("the formula cannot be typeset")
            folder.write(folder.lesson(), GOOD.replace("## Hello", "## Mended"))
            expect(panel).to_have_count(0)
            expect(page.locator(".prose h2").first).to_contain_text("Mended")
            expect(elsewhere).to_have_count(0)
            expect(note).to_have_count(0)
            page_open.check_unbroken()


@pytest.mark.browser
def test_drift_is_shown_in_its_place_and_accepted(make: Make, browser: Browser) -> None:
    folder = make(GOOD + "About `3.14`{out}.\n")
    with lesson_page(folder, browser) as page:
        output = page.locator(".output")
        expect(output.locator(".receipt")).to_have_class("receipt verified")
        folder.replace(folder.lesson(), 'print("hello", 3.14159)', 'print("hello", 2.71828)')
        box = output.get_by_role("group", name="Recorded output, and this run")
        see(box)
        expect(box.locator("del")).to_have_text("hello 3.14159")
        expect(box.locator("ins")).to_have_text("hello 2.71828")
        expect(box.locator("del mark")).to_have_text("3.14159")
        expect(box.locator(".preview-row .preview-sign")).to_have_text(["−", "+"])
        expect(output.locator("> pre")).to_be_hidden()
        expect(page.get_by_role("region", name="Problems")).to_have_count(0)
        page.get_by_role("button", name="Accept this output").click()
        # The number in the prose follows with it.
        expect(box).to_have_count(0)
        expect(output.locator(".receipt")).to_have_class("receipt verified")
        expect(output.locator("samp")).to_contain_text("hello 2.71828")
        expect(page.locator(".bound")).to_have_text("2.72")
        expect(page.locator(".preview-button")).to_be_hidden()
        text = GOOD.replace("3.14159", "2.71828") + "About `2.72`{out}.\n"
        assert folder.text(folder.lesson()) == text


@pytest.mark.browser
def test_figures_are_shown_side_by_side_and_accepted(make: Make, browser: Browser) -> None:
    """An SVG with its data, and a PNG."""
    code = """from PIL import Image

with open("a.svg", "w") as file:
    file.write('<svg xmlns="http://www.w3.org/2000/svg" width="90" height="90">')
    file.write('<path d="M0 0H50"/></svg>')
with open("a.csv", "w") as file:
    file.write("end\\n50\\n")
with open("b.png", "wb") as file:
    Image.new("L", (50, 20), 50).save(file, "PNG")
"""
    lesson = block("a.py", code, info="figure=a.svg,a.csv,b.png")
    folder = make(f"## A\n\n{lesson}Figure: ![A line](a.svg)\n\nFigure: ![A box](b.png)\n")
    assert folder.run("update").status == 0
    with lesson_page(folder, browser) as page:
        folder.write(folder.lesson(), folder.text(folder.lesson()).replace("50", "40"))
        for name in ("A line", "A box"):
            figures = page.locator("figure.figure", has=page.get_by_alt_text(name, exact=True))
            box = figures.get_by_role("group", name="Recorded figure, and this run").first
            see(box)
            see(box.get_by_alt_text(f"{name} (recorded)"))
            see(box.get_by_alt_text(f"{name} (this run)"))
            expect(figures.locator("> img").first).to_be_hidden()
        expect(page.get_by_role("region", name="Problems")).to_have_count(0)
        for image, width in zip(box.locator("img").all(), (50, 40), strict=True):
            expect(image).to_have_js_property("naturalWidth", width)
        accept = page.get_by_role("button", name=re.compile("^Accept th"))
        expect(accept).to_have_count(3)
        accept.first.click()
        expect(accept).to_have_count(2)
        page.get_by_role("button", name="Accept all on this page (2)").click()
        expect(page.locator(".preview-drift")).to_have_count(0)
        see(page.get_by_alt_text("A box", exact=True))
        accepted = page.get_by_alt_text("A box", exact=True)
        expect(accepted).to_have_js_property("naturalWidth", 40)
        expect(page.locator(".preview-button")).to_be_hidden()
        assert "H40" in folder.text("content/lessons/a.svg")
        assert folder.text("content/lessons/a.csv") == "end\n40\n"


@pytest.mark.browser
def test_script_that_runs_and_fails_is_marked(make: Make, browser: Browser) -> None:
    folder = make(GOOD)
    with lesson_page(folder, browser) as page:
        folder.replace(folder.lesson(), 'print("hello"', f'{WAIT_FOR_GO}print("hello"')
        mark = page.locator(".output").get_by_role("status")
        expect(mark).to_have_text("The script is running.")
        folder.write("go", "")
        expect(mark).to_have_count(0)
        folder.replace(folder.lesson(), "print(", "raise ValueError('no')\nprint(")
        expect(mark).to_have_text("The script failed.")
        page.locator(".preview-button").click()
        panel = page.get_by_role("region", name="Problems")
        expect(panel).to_contain_text("ValueError: no")
