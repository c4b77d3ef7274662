"""The preview of a lesson in a real browser, for tests."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from playwright.sync_api import Browser, Page

from support.preview_process import Preview, serve_preview
from support.scratch_course import Folder

LESSON = "lessons/1.1-one.html"


class PreviewPage:
    def __init__(self, browser: Browser, preview: Preview, path: str, **options: object) -> None:
        self.context = browser.new_context(**options)
        self.page = self.context.new_page()
        self.console: list[str] = []
        self.page.on("console", lambda message: self.console.append(message.text))
        self.page.on("pageerror", lambda error: self.console.append(str(error)))
        self.page.goto(preview.link.replace("/?", f"/{path}?"))
        self.page.wait_for_url(f"**/{path}")  # without the token
        # A page that is loaded again loses this.
        self.page.evaluate("window.same = true")

    def __enter__(self) -> PreviewPage:
        return self

    def __exit__(self, *_: object) -> None:
        self.context.close()

    def check_unbroken(self) -> None:
        """It is still the same document, and nothing went wrong in it."""
        assert self.page.evaluate("window.same")
        assert self.console == []


@contextlib.contextmanager
def lesson_page(folder: Folder, browser: Browser) -> Iterator[Page]:
    """The page of a lesson, which stays the same document, with nothing that goes wrong in it."""
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: ")
        with PreviewPage(browser, preview, LESSON) as preview_page:
            yield preview_page.page
            preview_page.check_unbroken()
