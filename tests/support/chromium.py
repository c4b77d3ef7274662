"""The browser of the tests, and how long they wait for it."""

from __future__ import annotations

import shutil
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Playwright, expect

SLOW = 120_000
"""Milliseconds that a slow machine may take until what is waited for is there."""
expect.set_options(timeout=SLOW)


def launch(playwright: Playwright, *arguments: str) -> Browser:
    """Debian's Chromium without a window; whatever is done in it may take `SLOW`."""
    program = shutil.which("chromium")
    assert program is not None, "no chromium: install Debian's package `chromium`"
    browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", *arguments])
    make = browser.new_context

    def new_context(**options: Any) -> BrowserContext:
        context = make(**options)
        context.set_default_timeout(SLOW)
        return context

    browser.new_context = new_context  # type: ignore[method-assign]
    return browser
