"""The pictures in docs/images, made from the built course.

Entry point: run it as a file, after `make site`: `.venv/bin/python docs/screenshots.py`. The
packages are those of the tests, the browser is Debian's headless Chromium: `make test` installs
both.

1. The site in `public/` is served on this machine, and a page is opened in light colours.
2. What a reader would do is done: a lab is set going, a question is answered, wrongly.
3. The window around the subject, or the subject alone, is saved as a PNG.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from page_pictures import ARGUMENTS, serve
from playwright.sync_api import Browser, Page, sync_playwright

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
    act: Callable[[Page], None] | None = None
    """What a reader does first."""
    alone: bool = False
    """Whether only the subject is seen."""


WIDTH, HEIGHT = 1320, 860
"""Of the window, in CSS pixels."""
MARGIN = 120
"""Pixels that stay in sight above the subject."""


def run_lab(page: Page) -> None:
    """Let the box tumble until it has turned over."""
    lab = page.locator('[data-lab="4.2-lab-1"]')
    lab.scroll_into_view_if_needed()
    lab.get_by_role("button", name="Play").click()
    page.wait_for_timeout(6000)


def answer(page: Page) -> None:
    """Give an answer that is ten times as large as the right one."""
    question = page.locator('#\\34 \\.2-check [data-kind="numeric"]')
    question.scroll_into_view_if_needed()
    question.locator("input").first.fill("0.8")
    question.locator(".quiz-check").click()
    page.wait_for_timeout(300)


LESSON = "lessons/4.2-mass-and-inertia.html"
SHOTS = (
    Shot("lesson.png", LESSON, 'figure[data-script="examples/l4_2_inertia.py"] .output'),
    Shot("lab.png", LESSON, '[data-lab="4.2-lab-1"]', run_lab),
    Shot("quiz.png", LESSON, '#\\34 \\.2-check [data-kind="numeric"]', answer, alone=True),
)


def take(browser: Browser, site: str, shot: Shot, images: Path) -> Path:
    """Save one picture; return its path.

    Raises:
        ValueError: the page is not there, or the picture is too large.
    """
    page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light")
    response = page.goto(site + shot.page)
    if response is None or not response.ok:
        raise ValueError(f"there is no {shot.page}: run `make site` first")
    page.evaluate("document.fonts.ready")
    path, subject = images / shot.name, page.locator(shot.subject).first
    if shot.act is not None:
        shot.act(page)
    if shot.alone:
        subject.screenshot(path=path)
    else:
        top = subject.evaluate("e => e.getBoundingClientRect().top")
        page.evaluate("y => window.scrollBy({top: y, behavior: 'instant'})", top - MARGIN)
        page.wait_for_timeout(300)  # the contents list marks the section in sight
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
    with serve(arguments.site.resolve()) as site, sync_playwright() as playwright:
        # As root, in a container, Chromium cannot make its sandbox; the page is our own.
        browser = playwright.chromium.launch(executable_path=chromium, args=[*ARGUMENTS])
        try:
            for shot in SHOTS:
                path = take(browser, site, shot, arguments.images)
                print(f"{path.name}: {path.stat().st_size} bytes")
        except ValueError as error:
            print(error, file=sys.stderr)
            return 1
        finally:
            browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
