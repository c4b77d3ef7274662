"""Drawings opened at their own address in Chromium, and what they then ask for.

All other hosts are one, which answers nothing and counts who comes: a script that runs, a picture,
a style sheet, a frame, a connection made ahead.
"""

from __future__ import annotations

import http.server
import socketserver
import threading
from pathlib import Path
from typing import Any, Self

from playwright.sync_api import Browser, Dialog, Error, Request

from coursebuild.core.drawing.safe_svg import read_svg
from coursebuild.core.pages.theme import dark_drawing
from coursebuild.core.scripts.figures import prepare_figure
from support.static_host import Host

_TWO_FRAMES = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
_POINTS = ((50, 50), (640, 360))


class _Elsewhere(http.server.ThreadingHTTPServer):
    """All other hosts, as the proxy on the way to them."""

    daemon_threads = True

    def __init__(self) -> None:
        self.visits = 0
        super().__init__(("127.0.0.1", 0), socketserver.BaseRequestHandler)

    def verify_request(self, request: Any, client_address: Any) -> bool:
        self.visits += 1
        return False


class Drawings:
    """A folder of drawings and a window that opens them."""

    def __init__(self, browser: Browser, folder: Path) -> None:
        self._host = Host(folder)
        self._elsewhere = _Elsewhere()
        threading.Thread(target=self._elsewhere.serve_forever, args=(0.02,), daemon=True).start()
        self._context = browser.new_context(
            proxy={
                "server": f"http://127.0.0.1:{self._elsewhere.server_port}",
                "bypass": "localhost",
            }
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.close()
        self._host.stop()
        self._elsewhere.shutdown()
        self._elsewhere.server_close()

    def open(self, data: bytes) -> list[str]:
        """Open a drawing and press what is in it; return what it asked for, or ran."""
        path = self._host.folder / "drawing.svg"
        path.write_bytes(data)
        address = f"{self._host.url}{path.name}"
        traces: list[str] = []

        def note_request(request: Request) -> None:
            if request.url.partition("#")[0] != address and not request.url.startswith("data:"):
                traces.append(request.url)

        def note_dialog(dialog: Dialog) -> None:
            traces.append(dialog.message)
            dialog.dismiss()

        self._elsewhere.visits = 0
        page = self._context.new_page()
        page.on("request", note_request)
        page.on("dialog", note_dialog)
        try:
            page.goto(address)
            page.evaluate(_TWO_FRAMES)
            for x, y in _POINTS:
                page.mouse.click(x, y)
            for key in ("Tab", "Enter"):
                page.keyboard.press(key)
            page.evaluate(_TWO_FRAMES)
        except Error as error:  # it led the page elsewhere
            traces.append(error.message.splitlines()[0])
        page.close()
        if self._elsewhere.visits:
            traces.append(f"{self._elsewhere.visits} visits elsewhere")
        return traces


def published_files(data: bytes) -> list[bytes]:
    """What a site may hold of a file: itself, what is recorded of it, and that for dark pages."""
    files = [] if isinstance(read_svg(data), str) else [data]
    recorded = prepare_figure("x.svg", data)
    if isinstance(recorded, bytes):
        files += [recorded, dark_drawing(recorded.decode(), {}).encode()]
    return files
