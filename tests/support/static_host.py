"""A static host: sends compressed copies, validators and lifetimes as hosts do, and can be away."""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import http.server
import mimetypes
import re
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self
from urllib.parse import unquote, urlsplit

_IMMUTABLE_PATH = re.compile(r".*/assets/.*\.[0-9a-f]{8}\.[a-z0-9]+")


class Host(contextlib.AbstractContextManager["Host"]):
    """Serves a folder at `url`, which stays its address while it is away; `base` is its path."""

    def __init__(self, folder: Path, base: str = "/") -> None:
        self.folder = folder
        self.base = base
        self.requests: list[str] = []
        """Paths that were asked for, with their queries."""
        self.fonts_delay = 0.0
        """Seconds before a font, which on this machine alone comes before anything is drawn."""
        self._server: http.server.ThreadingHTTPServer | None = None
        self._port = 0
        self.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def url(self) -> str:
        return f"http://localhost:{self._port}{self.base}"

    def start(self) -> None:
        handler = type("Handler", (_Handler,), {"host": self})
        self._server = _Server(("127.0.0.1", self._port), handler)
        self._port = self._server.server_address[1]
        threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True).start()

    def stop(self) -> None:
        """Connections are refused from now on, and those that are open end."""
        server, self._server = self._server, None
        if server is not None:
            server.shutdown()
            server.server_close()

    @contextlib.contextmanager
    def away(self) -> Iterator[None]:
        """Stopped for a while; nobody else gets the port meanwhile."""
        self.stop()
        with socket.socket() as reserved:
            reserved.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            reserved.bind(("127.0.0.1", self._port))
            try:
                yield
            finally:
                self.start()

    def take_requests(self) -> list[str]:
        """What was asked for since this was asked the last time."""
        requests, self.requests = self.requests, []
        return sorted(requests)

    def file(self, address: str) -> tuple[int, Path]:
        path = unquote(urlsplit(address).path)
        inner = path.removeprefix(self.base)
        target = self.folder / (inner + "index.html" if not inner or inner[-1] == "/" else inner)
        exists = path.startswith(self.base) and target.is_file()
        return (200, target) if exists else (404, self.folder / "404.html")


class _Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = 128
    """A page asks for many files at once; one that finds no room in the queue waits a second."""

    def __init__(self, *arguments: Any) -> None:
        self.open: set[socket.socket] = set()
        super().__init__(*arguments)

    def process_request(self, request: Any, client_address: Any) -> None:
        self.open.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        self.open.discard(request)
        super().shutdown_request(request)

    def server_close(self) -> None:
        super().server_close()
        for connection in list(self.open):
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that hangs up is no news."""


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    host: Host
    wbufsize = -1
    disable_nagle_algorithm = True

    def log_message(self, format: str, *args: Any) -> None:
        pass

    def do_GET(self) -> None:
        host = self.host
        host.requests.append(self.path.removeprefix(host.base))
        status, path = host.file(self.path)
        time.sleep(host.fonts_delay if path.suffix == ".woff2" else 0.0)
        data = path.read_bytes() if path.is_file() else b""
        tag = f'"{hashlib.sha256(data).hexdigest()[:16]}"'
        if status == 200 and self.headers.get("If-None-Match", "").removeprefix("W/") == tag:
            status, data = 304, b""
        self.send_response(status)
        copy = path.with_name(f"{path.name}.br")
        accepted = self.headers.get("Accept-Encoding", "")
        if data and "br" in accepted and copy.is_file():
            data = copy.read_bytes()
            self.send_header("Content-Encoding", "br")
        kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
        text = "; charset=utf-8" if kind.startswith("text/") else ""
        # Hosts of static pages compress texts without a copy on the way, and so does this one.
        if data and text and not copy.is_file() and "gzip" in accepted:
            data = gzip.compress(data, mtime=0)
            self.send_header("Content-Encoding", "gzip")
        self.send_header("Content-Type", kind + text)
        self.send_header("Vary", "Accept-Encoding")
        self.send_header("ETag", tag)
        lasting = _IMMUTABLE_PATH.fullmatch(urlsplit(self.path).path)
        lifetime = "max-age=31536000, immutable" if lasting else "max-age=0, must-revalidate"
        self.send_header("Cache-Control", lifetime)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    do_HEAD = do_GET
