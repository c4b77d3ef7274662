"""Checks accessibility with axe."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Page

from support.chromium import SLOW
from support.scratch_course import ROOT

_AXE = ROOT / "site" / "node_modules" / "axe-core" / "axe.min.js"
_RUN = """([where, options, limit]) => Promise.race([
  axe.run(where ?? document, options),
  new Promise((_, reject) => setTimeout(() => reject(new Error('axe does not end')), limit))
]).then((found) =>
  found.violations.map((v) => [v.id, v.nodes[0].html, v.nodes[0].failureSummary]))"""
_CONTRAST = ("color-contrast", "color-contrast-enhanced")


def violations(page: Page, selector: str | None = None) -> list[Any]:
    """Return axe's violations in light colours, and those of contrast, 7 : 1, in dark ones."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(_AXE.read_text(encoding="utf-8"))
    results: list[Any] = []
    for scheme, options in (
        ("dark", {"runOnly": _CONTRAST}),
        ("light", {"rules": {"color-contrast-enhanced": {"enabled": True}}}),
    ):
        page.emulate_media(color_scheme=scheme)
        results += [
            [scheme, *violation] for violation in page.evaluate(_RUN, [selector, options, SLOW])
        ]
    return results
