"""Pictures of every kind of page of a built site, to look at; none is kept in the repository.

Entry point: run it as a file, after `make site`: `.venv/bin/python docs/page_pictures.py FOLDER`.
The packages are those of the tests, the browser is Debian's headless Chromium: `make test`
installs both.

1. The site is served on this machine. Its kinds of pages are those that its pages say they are of;
   of each kind the largest page is taken, which has most to it.
2. A page is opened at each width, in light and in dark colours, and once as it is printed. Labs and
   quizzes are brought to life; then the page is saved in pieces that can be looked at.

A picture is `KIND-WIDTH-COLOURS-PIECE.png` (`lesson-0360-dark-02.png`), or `KIND-print-PIECE.png`.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import re
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
WIDTHS = (360, 800, 1440)
COLOURS = ("light", "dark")
PRINTED = 720
"""CSS pixels of a printed line of A4 with margins, about."""
PIECE = 2400
"""CSS pixels of a picture's height."""
ARGUMENTS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_KIND = re.compile(rb'<body class="on-([a-z-]+)"')

SETTLED = """async () => {
  document.documentElement.style.setProperty('--below', 'visible')
  for (let y = 0; y < document.documentElement.scrollHeight; y += innerHeight) {
    scrollTo({ top: y, behavior: 'instant' })
    await new Promise((done) => setTimeout(done, 60))
  }
  const busy = () => document.querySelector('main [data-lab][data-state="loading"]')
  for (let n = 0; busy() && n < 200; n++) await new Promise((done) => setTimeout(done, 100))
  scrollTo({ top: 0, behavior: 'instant' })
  await document.fonts.ready
  await new Promise((done) => setTimeout(done, 300))
}"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves files without a word."""

    def log_message(self, format: str, *arguments: object) -> None:
        """Requests are not news."""


class Server(http.server.ThreadingHTTPServer):
    """Outlives browsers that hang up."""

    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        """A page that is left in the middle of a file is no news."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a folder on this machine."""
    handler = functools.partial(Quiet, directory=str(folder))
    with Server(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://localhost:{server.server_address[1]}/"
        server.shutdown()


def kinds(site: Path) -> dict[str, str]:
    """The largest page of each kind, by the kind's name.

    Raises:
        ValueError: there are no pages.
    """
    found: dict[str, str] = {}
    for page in sorted(site.rglob("*.html"), key=lambda page: (page.stat().st_size, page)):
        match = _KIND.search(page.read_bytes())
        if match is not None:
            found[match[1].decode()] = page.relative_to(site).as_posix()
    if not found:
        raise ValueError(f"there is no page in {site}: run `make site` first")
    return dict(sorted(found.items()))


def take(page: Page, folder: Path, name: str) -> int:
    """Save a page in pieces; gives how many."""
    size = page.evaluate("() => [innerWidth, document.documentElement.scrollHeight]")
    count = 0
    for top in range(0, size[1], PIECE):
        count += 1
        height = min(PIECE, size[1] - top)
        clip = {"x": 0, "y": top, "width": size[0], "height": height}
        page.screenshot(path=folder / f"{name}-{count:02d}.png", clip=clip, full_page=True)  # type: ignore[arg-type]
    return count


def pictures(browser: Browser, site: str, kind: str, path: str, folder: Path) -> int:
    """Take all pictures of a page; gives how many."""
    count = 0
    for width in WIDTHS:
        for colours in COLOURS:
            with browser.new_context(
                viewport={"width": width, "height": 900},
                color_scheme=colours,  # type: ignore[arg-type]
                reduced_motion="reduce",
            ) as context:
                page = context.new_page()
                page.goto(site + path)
                page.evaluate(SETTLED)
                count += take(page, folder, f"{kind}-{width:04d}-{colours}")
    with browser.new_context(viewport={"width": PRINTED, "height": 1000}) as context:
        page = context.new_page()
        page.goto(site + path)
        page.evaluate(SETTLED)
        page.emulate_media(media="print")
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        count += take(page, folder, f"{kind}-print")
    return count


def main() -> int:
    """Take every picture."""
    parser = argparse.ArgumentParser(description="Take pictures of every kind of page.")
    parser.add_argument("folder", type=Path, help="where the pictures go")
    parser.add_argument("--site", type=Path, default=ROOT / "public", help="a built site")
    parser.add_argument("--kind", action="append", help="only pages of this kind; may be repeated")
    arguments = parser.parse_args()
    chromium = shutil.which("chromium-headless-shell")
    if chromium is None:
        print("there is no chromium-headless-shell on PATH", file=sys.stderr)
        return 1
    try:
        chosen = kinds(arguments.site.resolve())
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    arguments.folder.mkdir(parents=True, exist_ok=True)
    with served(arguments.site.resolve()) as site, sync_playwright() as playwright:
        # As root, in a container, Chromium cannot make its sandbox; the pages are our own.
        browser = playwright.chromium.launch(executable_path=chromium, args=[*ARGUMENTS])
        for kind, path in chosen.items():
            if arguments.kind is None or kind in arguments.kind:
                count = pictures(browser, site, kind, path, arguments.folder)
                print(f"{kind}: {count} pictures of {path}")
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
