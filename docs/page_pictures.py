"""Takes pictures of every kind of page of a built site, to look at; none are in the repository.

Entry point: run it as a file, after `make site`: `.venv/bin/python docs/page_pictures.py FOLDER`.
The packages are those of the tests, the browser is Debian's headless Chromium: `make test`
installs both.

1. The site is served on this machine. The classes of pages say which kinds there are; of each kind
   the largest page is taken, which has the most parts.
2. A page is opened at each width, in light and in dark colours, and once as it is printed. Labs and
   quizzes are started; then the page is saved in pieces of a size to look at.

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
"""The width of a printed A4 page without margins, about, in CSS pixels."""
PIECE = 2400
"""The height of a picture, in CSS pixels."""
ARGUMENTS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_KIND = re.compile(rb'<body class="on-([a-z-]+)"')

WAIT_UNTIL_READY = """async () => {
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
    """Serves files and prints nothing."""

    def log_message(self, format: str, *arguments: object) -> None:
        """Print nothing about requests."""


class Server(http.server.ThreadingHTTPServer):
    """A server that goes on when browsers hang up."""

    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        """Print nothing: a browser may leave a page in the middle of a file."""


@contextmanager
def serve(folder: Path) -> Iterator[str]:
    """Serve a folder on this machine; gives its address."""
    handler = functools.partial(Quiet, directory=str(folder))
    with Server(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://localhost:{server.server_address[1]}/"
        server.shutdown()


def find_kinds(site: Path) -> dict[str, str]:
    """Find the largest page of each kind, by the kind's name.

    Raises:
        ValueError: there are no pages.
    """
    pages_by_kind: dict[str, str] = {}
    for page in sorted(site.rglob("*.html"), key=lambda page: (page.stat().st_size, page)):
        match = _KIND.search(page.read_bytes())
        if match is not None:
            pages_by_kind[match[1].decode()] = page.relative_to(site).as_posix()
    if not pages_by_kind:
        raise ValueError(f"there is no page in {site}: run `make site` first")
    return dict(sorted(pages_by_kind.items()))


def take(page: Page, folder: Path, name: str) -> int:
    """Save a page in pieces; return how many."""
    size = page.evaluate("() => [innerWidth, document.documentElement.scrollHeight]")
    count = 0
    for top in range(0, size[1], PIECE):
        count += 1
        height = min(PIECE, size[1] - top)
        clip = {"x": 0, "y": top, "width": size[0], "height": height}
        picture = folder / f"{name}-{count:02d}.png"
        page.screenshot(path=picture, clip=clip, full_page=True, timeout=0)  # type: ignore[arg-type]
    return count


def take_all(browser: Browser, site: str, kind: str, path: str, folder: Path) -> int:
    """Take all pictures of a page; return how many."""
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
                page.evaluate(WAIT_UNTIL_READY)
                count += take(page, folder, f"{kind}-{width:04d}-{colours}")
    with browser.new_context(viewport={"width": PRINTED, "height": 1000}) as context:
        page = context.new_page()
        page.goto(site + path)
        page.evaluate(WAIT_UNTIL_READY)
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
        pages_by_kind = find_kinds(arguments.site.resolve())
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    arguments.folder.mkdir(parents=True, exist_ok=True)
    with serve(arguments.site.resolve()) as site, sync_playwright() as playwright:
        # As root, in a container, Chromium cannot make its sandbox; the pages are our own.
        browser = playwright.chromium.launch(executable_path=chromium, args=[*ARGUMENTS])
        for kind, path in pages_by_kind.items():
            if arguments.kind is None or kind in arguments.kind:
                count = take_all(browser, site, kind, path, arguments.folder)
                print(f"{kind}: {count} pictures of {path}")
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
