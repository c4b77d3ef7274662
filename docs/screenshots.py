"""The pictures in docs/images, made from the built course.

Entry point: run it as a file, after `make site`: `.venv/bin/python docs/screenshots.py`. The
packages are those of the tests, the browser is Debian's headless Chromium: `make test` installs
both.

1. A page of `public/` is opened from the disk, in a window of a fixed size and in light colours.
2. The subject of the picture is scrolled into sight, and the window is saved as a PNG.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
LIMIT = 300_000
"""Bytes: a picture in a repository is cloned by everybody for ever."""


@dataclass(frozen=True, slots=True)
class Shot:
    """A picture."""

    name: str
    page: str
    """Path in the site."""
    subject: str
    """CSS selector of what is scrolled to the top of the window."""
    margin: int
    """Pixels that stay in sight above the subject."""
    width: int = 1320
    """The width of the window, in CSS pixels."""
    height: int = 860


SHOTS = (
    Shot(
        "lesson.png",
        "lessons/4.2-mass-and-inertia.html",
        'figure[data-script="examples/l4_2_inertia.py"] .output',
        margin=120,
    ),
)


def take(browser: Browser, site: Path, shot: Shot, images: Path) -> Path:
    """Save one picture; return its path.

    Raises:
        ValueError: the page is not there, or the picture is too large.
    """
    page_file = site / shot.page
    if not page_file.is_file():
        raise ValueError(f"there is no {page_file}: run `make site` first")
    page = browser.new_page(
        viewport={"width": shot.width, "height": shot.height}, color_scheme="light"
    )
    page.goto(page_file.as_uri())
    page.evaluate("document.fonts.ready")
    top = page.locator(shot.subject).first.evaluate("e => e.getBoundingClientRect().top")
    page.evaluate("y => window.scrollTo({top: y, behavior: 'instant'})", top - shot.margin)
    page.wait_for_timeout(300)  # the contents list marks the section in sight
    path = images / shot.name
    page.screenshot(path=path)
    page.close()
    if path.stat().st_size > LIMIT:
        raise ValueError(f"{path} has {path.stat().st_size} bytes, more than {LIMIT}")
    return path


def main() -> int:
    """Take every picture."""
    parser = argparse.ArgumentParser(description="Take the pictures in docs/images.")
    parser.add_argument("--site", type=Path, default=ROOT / "public", help="a built site")
    parser.add_argument("--images", type=Path, default=IMAGES, help="where the pictures go")
    arguments = parser.parse_args()
    chromium = shutil.which("chromium-headless-shell")
    if chromium is None:
        print("there is no chromium-headless-shell on PATH", file=sys.stderr)
        return 1
    arguments.images.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        # As root, in a container, Chromium cannot make its sandbox; the page is our own.
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        try:
            for shot in SHOTS:
                path = take(browser, arguments.site.resolve(), shot, arguments.images)
                print(f"{path.name}: {path.stat().st_size} bytes")
        except ValueError as error:
            print(error, file=sys.stderr)
            return 1
        finally:
            browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
