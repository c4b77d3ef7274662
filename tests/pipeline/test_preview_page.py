"""The preview in a real browser: it loads again by itself, and shows what is wrong."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator

import pytest
from coursekit import GOOD, Folder
from playwright.sync_api import Browser, expect, sync_playwright
from test_serving import serving

Make = Callable[..., Folder]
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    chromium = shutil.which("chromium")
    assert chromium, "these tests need Debian's chromium on PATH"
    with sync_playwright() as play:
        started = play.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield started
        started.close()


def test_a_page_follows_the_author(make: Make, browser: Browser) -> None:
    filler = "".join(f"Paragraph {n}.\n\n" for n in range(80))
    folder = make(GOOD + filler)
    with serving(folder) as preview:
        preview.heard("ready: ")
        page = browser.new_page()
        said: list[str] = []
        page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.set_default_timeout(30_000)
        page.goto(f"http://127.0.0.1:{preview.port}/lessons/1.1-one.html")
        page.evaluate("window.scrollTo(0, 900)")
        heading = page.locator("h2").first
        overlay = page.get_by_role("alert", name="Problems")
        expect(heading).to_contain_text("Hello")
        expect(overlay).to_have_count(0)

        folder.replace(folder.lesson(), "## Hello\n", "## Hello again\n")
        expect(heading).to_contain_text("Hello again", timeout=30_000)
        page.wait_for_function("window.scrollY === 900")  # the reader stays where they were

        folder.replace(folder.lesson(), "3.14159\n```", "3.14158\n```")
        expect(overlay).to_be_visible(timeout=30_000)
        expect(overlay).to_contain_text("error[output-drift]: recorded output differs")
        expect(overlay).to_contain_text("hello 3.14158")
        expect(heading).to_contain_text("Hello again")

        overlay.get_by_role("button", name="Close").click()
        expect(overlay).to_have_count(0)
        folder.replace(folder.lesson(), "hello 3.14158\n```", "hello 3.1415\n```")
        expect(overlay).to_be_visible(timeout=30_000)

        other = browser.new_page()  # a page that is opened while something is wrong
        other.goto(f"http://127.0.0.1:{preview.port}/")
        expect(other.get_by_role("alert", name="Problems")).to_be_visible(timeout=30_000)

        folder.replace(folder.lesson(), "hello 3.1415\n```", "hello 3.14159\n```")
        expect(overlay).to_have_count(0, timeout=30_000)
        expect(other.get_by_role("alert", name="Problems")).to_have_count(0, timeout=30_000)
        assert said == []
        page.close()
        other.close()
