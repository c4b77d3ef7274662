"""Accessibility: what axe finds on a page."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Page

from support.scratch_course import ROOT

_AXE = ROOT / "site" / "node_modules" / "axe-core" / "axe.min.js"
_RUN = """([where, options]) => axe.run(where ?? document, options).then((found) =>
  found.violations.map((v) => [v.id, v.nodes[0].html, v.nodes[0].failureSummary]))"""
_CONTRAST = ("color-contrast", "color-contrast-enhanced")


def violations(page: Page, where: str | None = None) -> list[Any]:
    """What axe finds in light colours, and too little contrast in dark ones.

    Text is held to 7 : 1, which is more than axe asks for by itself.
    """
    if not page.evaluate("'axe' in window"):
        page.evaluate(_AXE.read_text(encoding="utf-8"))
    found: list[Any] = []
    for scheme, options in (
        ("dark", {"runOnly": _CONTRAST}),
        ("light", {"rules": {"color-contrast-enhanced": {"enabled": True}}}),
    ):
        page.emulate_media(color_scheme=scheme)
        found += [[scheme, *one] for one in page.evaluate(_RUN, [where, options])]
    return found
