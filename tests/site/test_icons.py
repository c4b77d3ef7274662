"""The pictures of the icon are what a browser makes of the SVG."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser

from support.fixture_cases import fixture_text
from support.model_files import read_png

ROOT = Path(__file__).resolve().parents[2]
ICON = (ROOT / "templates" / "icon.svg").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def icons() -> Any:
    """The module that draws them; dataclasses of it need its name to be known."""
    sys.path.insert(0, str(ROOT / "site"))
    try:
        import prepare_icons
    finally:
        sys.path.remove(str(ROOT / "site"))
    return prepare_icons


@pytest.mark.browser
def test_icons_are_what_a_browser_draws(icons: Any, browsers: Mapping[str, Browser]) -> None:
    draw = fixture_text("scripts/draw_icon.js")
    shapes = icons.shapes(ICON)
    with browsers["plain"].new_context() as context:
        page = context.new_page()
        for side in (64, 192):
            theirs = np.array(page.evaluate(draw, [ICON, side]), float).reshape(side, side, 4)
            ours = read_png(icons.draw(shapes, icons.Picture("x", side))).astype(float)
            # Without opacity a colour means nothing.
            off = np.abs(theirs * theirs[..., 3:] - ours * ours[..., 3:]) / 255
            assert off.mean() < 1, side
            assert (off.max(axis=2) > 48).mean() < 0.002, side


def test_icon_has_ground_where_a_system_cuts(icons: Any) -> None:
    shapes = icons.shapes(ICON)
    pixels = read_png(icons.draw(shapes, icons.Picture("x", 96, full=True, share=0.8)))
    assert (pixels[..., 3] == 255).all()
    ground = np.array(shapes[0].colour)
    y, x = np.mgrid[0:96, 0:96] + 0.5
    outside = np.hypot(x - 48, y - 48) > 0.4 * 96
    assert (pixels[outside][:, :3] == ground).all(), (
        "nothing of the drawing lies where it may be cut"
    )
    assert not (pixels[~outside][:, :3] == ground).all()


@pytest.mark.site
def test_icons_are_drawn_once_for_the_same_icon(icons: Any, tmp_path: Path) -> None:
    for name in ("old", "new", "again"):
        (tmp_path / name).mkdir()
    icons.main(tmp_path / "old")
    picture = tmp_path / "old/icons/icon-192.png"
    first_picture = picture.read_bytes()
    picture.write_bytes(b"of before")
    icons.main(tmp_path / "new", tmp_path / "old")
    old = {path.name: path.read_bytes() for path in (tmp_path / "old/icons").iterdir()}
    assert old == {path.name: path.read_bytes() for path in (tmp_path / "new/icons").iterdir()}
    assert set(old) == {picture.name for picture in icons.PICTURES} | {"source.json"}
    (tmp_path / "old/icons/source.json").write_text(json.dumps("of another icon"))
    icons.main(tmp_path / "again", tmp_path / "old")
    assert (tmp_path / "again/icons/icon-192.png").read_bytes() == first_picture


GROUND = '<rect width="32" height="32" fill="#000000"/>'


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("<ellipse/>", "the icon has an element `ellipse`"),
        ('<circle cx="1" cy="1" r="1" fill="red"/>', "the icon has a colour 'red'"),
        ('<path d="M0 0C1 1 2 2 3 3" fill="none" stroke-linecap="round"/>', "a path `M0 0C1"),
        ('<path d="M0 0l1 1" fill="#ffffff"/>', "a path that is filled"),
        ('<path d="M0 0" fill="none" stroke-linecap="round" stroke-width="1"/>', "a path `M0 0`"),
    ],
)
def test_what_cannot_be_drawn_is_an_error(icons: Any, inside: str, message: str) -> None:
    start = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">'
    with pytest.raises(icons.IconError, match=message):
        icons.shapes(f"{start}{GROUND}{inside}</svg>")
    with pytest.raises(icons.IconError, match="first shape"):
        icons.shapes(f"{start}</svg>")
