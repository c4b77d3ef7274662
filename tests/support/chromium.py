"""The browser of the tests, and how long they wait for it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Page, Playwright, expect

SLOW = 120_000
"""Milliseconds that a slow machine may take for anything."""
expect.set_options(timeout=SLOW)

OpenAddress = Callable[[str], Page]
"""Opens a page of the site, by its path."""

_KINDS = {
    "webgl": ("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    "plain": ("--disable-3d-apis",),
}


class Browsers(Mapping[str, Browser]):
    """Chromium that draws labs without a graphics processor, and one without WebGL.

    Each is started on first use, and again if it has crashed.
    """

    def __init__(self, playwright: Playwright) -> None:
        self._playwright = playwright
        self._started: dict[str, Browser] = {}

    def __getitem__(self, kind: str) -> Browser:
        browser = self._started.get(kind)
        if browser is None or not browser.is_connected():
            browser = self._started[kind] = launch(self._playwright, *_KINDS[kind])
        return browser

    def __iter__(self) -> Iterator[str]:
        return iter(_KINDS)

    def __len__(self) -> int:
        return len(_KINDS)

    def close(self) -> None:
        for browser in self._started.values():
            browser.close()


def launch(playwright: Playwright, *arguments: str) -> Browser:
    """Debian's Chromium without a window; every action in it may take `SLOW`."""
    program = shutil.which("chromium-headless-shell")
    assert program is not None, "install Debian's package `chromium-headless-shell`"
    browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", *arguments])
    make = browser.new_context

    def new_context(**options: Any) -> BrowserContext:
        context = make(**options)
        context.set_default_timeout(SLOW)
        return context

    browser.new_context = new_context
    return browser
