"""The preview's web server: serves a site from memory and tells open pages when it changed.

Entry point: `PreviewServer`.

1. It listens on the loopback interface only and answers only requests that name it as their host,
   so that a page elsewhere cannot read the preview through a name that it points here.
2. Files come from a mapping that is replaced whole, so a page never sees half a build. Nothing is
   read from disk.
3. Pages get one script more, which listens to `/.coursebuild/events`: `reload` after a build,
   `problems` with the diagnostics when something is wrong. The last good site stays.
"""

from __future__ import annotations

import contextlib
import json
import posixpath
import queue
import threading
from collections.abc import Iterable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import unquote, urlsplit

from coursebuild.results import OutputFile

PREFIX = "/.coursebuild/"
_TAG = b'<script src="/.coursebuild/preview.js"></script>'
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".json": "application/json; charset=utf-8",
    ".xml": "application/xml; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
    ".md": "text/plain; charset=utf-8",
    ".py": "text/plain; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".webp": "image/webp",
    ".gif": "image/gif",
    ".ico": "image/x-icon",
    ".woff2": "font/woff2",
    ".wasm": "application/wasm",
    ".zip": "application/zip",
    ".pdf": "application/pdf",
    ".webmanifest": "application/manifest+json",
}
_HEARTBEAT = 15.0
"""Seconds between signs of life on an event stream, by which a browser that went away is noticed.
"""


class PreviewServer:
    """Serves the site on `127.0.0.1:port`; port 0 takes any free one."""

    def __init__(self, port: int, script: bytes) -> None:
        self._files: Mapping[str, bytes] = {}
        self._problems = ""
        self._version = 0
        self._listeners: set[queue.SimpleQueue[tuple[str, str] | None]] = set()
        self._lock = threading.Lock()
        self._script = script
        self._server = _Server(("127.0.0.1", port), _Handler)
        self._server.preview = self
        self._thread = threading.Thread(
            target=self._server.serve_forever, name="preview", daemon=True
        )

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._server.server_address[1])

    @property
    def url(self) -> str:
        """Where the preview is."""
        return f"http://127.0.0.1:{self.port}/"

    def start(self) -> None:
        """Begin to answer, in a thread of its own."""
        self._thread.start()

    def stop(self) -> None:
        """End all event streams and stop answering."""
        with self._lock:
            for listener in self._listeners:
                listener.put(None)
        self._server.shutdown()
        self._server.server_close()

    def publish(self, files: Iterable[OutputFile]) -> None:
        """Serve these files from now on, and have open pages load again."""
        self._files = {file.path: file.data for file in files}
        self._problems = ""
        self._version += 1
        self._tell("reload", str(self._version))

    def problems(self, text: str) -> None:
        """Keep the last good site, and show what is wrong over it."""
        self._problems = text
        self._tell("problems", json.dumps(text))

    def _tell(self, event: str, data: str) -> None:
        with self._lock:
            for listener in self._listeners:
                listener.put((event, data))

    # --- what the handler asks

    def listen(self) -> queue.SimpleQueue[tuple[str, str] | None]:
        """A queue of events, beginning with the state as it is now."""
        events: queue.SimpleQueue[tuple[str, str] | None] = queue.SimpleQueue()
        with self._lock:
            events.put(("hello", str(self._version)))
            if self._problems:
                events.put(("problems", json.dumps(self._problems)))
            self._listeners.add(events)
        return events

    def leave(self, events: queue.SimpleQueue[tuple[str, str] | None]) -> None:
        """Forget a listener."""
        with self._lock:
            self._listeners.discard(events)

    def find(self, path: str) -> tuple[HTTPStatus, str, bytes]:
        """Status, content type and bytes of an address path."""
        if path == f"{PREFIX}preview.js":
            return HTTPStatus.OK, _TYPES[".js"], self._script
        name = unquote(path).lstrip("/")
        if name == "" or name.endswith("/"):
            name += "index.html"
        status = HTTPStatus.OK
        files = self._files
        data = files.get(name)
        if data is None:
            status, name = HTTPStatus.NOT_FOUND, "404.html"
            data = files.get(
                name,
                b"<!DOCTYPE html><html lang=en><title>Preview</title><p>Nothing is built yet.</p>",
            )
        kind = _TYPES.get(posixpath.splitext(name)[1].lower(), "application/octet-stream")
        if kind.startswith("text/html"):
            head, end, tail = data.rpartition(b"</body>")
            data = head + _TAG + end + tail if end else data + _TAG
        return status, kind, data


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    preview: PreviewServer

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that hangs up is no news."""


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    protocol_version = "HTTP/1.1"
    server: _Server
    timeout = 60

    def do_GET(self) -> None:
        """Answer with a file, or with the stream of events."""
        try:
            path = urlsplit(self.path).path
        except ValueError:
            path = ""  # no address of a page
        if not self._trusted():
            self._send(
                HTTPStatus.FORBIDDEN,
                "text/plain; charset=utf-8",
                b"this preview answers only on this machine\n",
            )
        elif path == f"{PREFIX}events":
            self._events()
        else:
            self._send(*self.server.preview.find(path))

    do_HEAD = do_GET

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are not news."""

    def _trusted(self) -> bool:
        port = self.server.preview.port
        hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost", "[::1]")}
        if port == 80:
            hosts |= {"127.0.0.1", "localhost", "[::1]"}
        origin = self.headers.get("Origin")
        return self.headers.get("Host", "").lower() in hosts and (
            origin is None or origin.lower().removeprefix("http://") in hosts
        )

    def _send(self, status: HTTPStatus, kind: str, data: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    def _events(self) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream; charset=utf-8")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.end_headers()
        self.close_connection = True
        if self.command == "HEAD":
            return
        events = self.server.preview.listen()
        try:
            while True:
                try:
                    event = events.get(timeout=_HEARTBEAT)
                except queue.Empty:
                    self.wfile.write(b": still here\n\n")
                else:
                    if event is None:
                        return
                    self.wfile.write(f"event: {event[0]}\ndata: {event[1]}\n\n".encode())
                self.wfile.flush()
        except OSError:
            return
        finally:
            with contextlib.suppress(Exception):
                self.server.preview.leave(events)
