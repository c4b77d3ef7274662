"""Drawings for dark pages."""

from __future__ import annotations

from coursebuild.core.pages.theme import dark_colours, dark_drawing

DRAWING = """<svg viewBox="0 0 9 9"><style>.a{fill:#0072B2}</style>
<defs><g id="x1"/></defs>
<path class="a" style="stroke: #1e1e1c; fill-opacity: 1" fill="none"/>
<path stroke="blue" fill="url(#x1)"/><use href="#x1" color="#fff"/></svg>"""
DARK = """<svg fill="#ffffff" viewBox="0 0 9 9"><style>.a{fill:#56b4e9}</style>
<defs><g id="x1"/></defs>
<path class="a" style="stroke: #e6e3dc; fill-opacity: 1" fill="none"/>
<path stroke="#dadaff" fill="url(#x1)"/><use href="#x1" color="#000000"/></svg>"""
CSS = """--a: light-dark(#0072b2, #56b4e9); --b: light-dark(#1e1e1c,#e6e3dc);
--c: light-dark(#0072b2, #000000); --d: light-dark(rgb(1 2 3 / 5%), #111111)"""


def test_colours_of_pages_are_known_and_others_turned_round() -> None:
    assert dark_drawing(DRAWING, dark_colours(CSS)) == DARK
