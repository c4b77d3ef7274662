"""A folder served on this machine for the length of a `with`."""

from __future__ import annotations

import contextlib
import functools
import http.server
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any


class _Handler(http.server.SimpleHTTPRequestHandler):
    def __init__(self, *args: Any, missing: str | None, **named: Any) -> None:
        self._missing = missing
        super().__init__(*args, **named)

    def log_message(self, format: str, *args: object) -> None:
        pass

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        if self._missing is None:
            super().send_error(code, message, explain)
            return
        body = (Path(self.directory) / self._missing).read_bytes()
        self.send_response(code)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.end_headers()
        self.wfile.write(body)


class _Server(http.server.ThreadingHTTPServer):
    request_queue_size = 128
    """A page asks for many files at once; one that finds no room in the queue waits a second."""


@contextlib.contextmanager
def served(folder: Path, *, missing: str | None = None) -> Iterator[str]:
    """The address of a folder; `missing` is its page for addresses that it does not have."""
    handler = functools.partial(_Handler, directory=str(folder), missing=missing)
    with _Server(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://localhost:{server.server_address[1]}/"
        finally:
            server.shutdown()
            thread.join()
