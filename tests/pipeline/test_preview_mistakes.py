"""Mistakes, drift and figures on the page of a preview, and what is accepted there."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from support.preview_page import LESSON, PreviewPage, lesson_page, see
from support.preview_process import serve_preview
from support.scratch_course import GOOD, WAIT_FOR_GO, Make, block
from support.waiting import wait_for_file

pytestmark = pytest.mark.browser


@pytest.fixture
def browser(browsers: Mapping[str, Browser]) -> Browser:
    return browsers["plain"]


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
            folder.replace(folder.lesson(), "## Hello\n", "## Never\n\n[x](lesson:9.9)\n")
            see(panel)
            expect(panel).to_contain_text("The last good page is shown")
            panel.get_by_role("button", name="content/lessons/1.1-one.md:3:5").click()
            wait_for_file(calls, 1)
            assert calls.read_text() == f"--goto {folder.root / folder.lesson()}:3:5\n"
            expect(panel).to_contain_text("lesson 9.9 is not in the course map")
            expect(panel.locator(".preview-source mark")).to_have_text("lesson:9.9")
            expect(page.locator(".prose h2").first).to_contain_text("Hello")
            see(second_page.page.get_by_role("region", name="Problems"))
            expect(second_page.page.get_by_role("region", name="Problems")).to_contain_text(
                "What is wrong with the course"
            )
            # The list can be closed, by keyboard too, and opens again for another mistake.
            panel.get_by_role("button", name="Close").click()
            expect(panel).to_have_count(0)
            button = page.get_by_role("button", name="1 mistake")
            expect(button).to_be_focused()
            expect(button).to_have_attribute("aria-expanded", "false")
            page.keyboard.press("Enter")
            see(panel)
            page.keyboard.press("Escape")
            expect(panel).to_have_count(0)
            folder.replace(folder.lesson(2), "## Two\n", "[x](lesson:9.9)\n")
            expect(page.get_by_role("button", name="2 mistakes")).to_be_visible()
            folder.replace(folder.lesson(), "[x](lesson:9.9)", "[x](lesson:9.9) $\\frac{1$")
            see(panel)
            # On each page, the mistakes that keep it from being drawn come first.
            kinds = ["Blocks this page", "Blocks this page", "Mistake"]
            expect(panel.locator("strong")).to_have_text(kinds)
            kinds = ["Blocks this page", "Mistake", "Mistake"]
            elsewhere = second_page.page.get_by_role("region", name="Problems")
            expect(elsewhere.locator("strong")).to_have_text(kinds)
            expect(elsewhere.get_by_role("listitem").first).to_contain_text("1.2-two.md:1:5")
            folder.write(folder.lesson(2), "## Two\n\nText.\n")
            expect(panel).to_contain_text("the formula does not parse")
            folder.write(folder.lesson(), GOOD.replace("## Hello", "## Mended"))
            expect(panel).to_have_count(0)
            expect(page.locator(".prose h2").first).to_contain_text("Mended")
            expect(second_page.page.get_by_role("region", name="Problems")).to_have_count(0)
            page_open.check_unbroken()


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
        # Now the number in the prose is the one that does not hold.
        number = page.get_by_role("group", name="A bound number that does not hold")
        see(number)
        expect(number.locator("ins")).to_have_text("2.72")
        expect(box).to_have_count(0)
        expect(output.locator(".receipt")).to_have_class("receipt verified")
        expect(output.locator("samp")).to_contain_text("hello 2.71828")
        number.get_by_role("button", name="Accept").click()
        expect(number).to_have_count(0)
        expect(page.locator(".bound")).to_have_text("2.72")
        expect(page.locator(".preview-button")).to_be_hidden()
        text = GOOD.replace("3.14159", "2.71828") + "About `2.72`{out}.\n"
        assert folder.text(folder.lesson()) == text


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
        sizes = "images => images.map((one) => one.naturalWidth)"
        assert box.locator("img").evaluate_all(sizes) == [50, 40]
        for count in (2, 1, 0):
            accept = page.get_by_role("button", name=re.compile("^Accept th"))
            expect(accept).to_have_count(count + 1)
            accept.first.click()
        expect(page.locator(".preview-drift")).to_have_count(0)
        see(page.get_by_alt_text("A box", exact=True))
        assert page.get_by_alt_text("A box", exact=True).evaluate_all(sizes) == [40]
        expect(page.locator(".preview-button")).to_be_hidden()
        assert "H40" in folder.text("content/lessons/a.svg")
        assert folder.text("content/lessons/a.csv") == "end\n40\n"


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
        panel = page.get_by_role("region", name="Problems")
        expect(panel).to_contain_text("ValueError: no")
