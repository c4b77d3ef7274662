"""The preview's web server: serves a site from memory and sends news to open pages.

Entry point: `PreviewServer`.

1. `access` decides whose requests are answered. Without `--host` the server listens on the loopback
   interface only.
2. Files come from a `Session`; nothing is read from disk here.
3. Pages get another script and style sheet. The script listens to `/.coursebuild/events`: `page` is
   a digest of the page as it is now, `news` its messages. Both are sent whenever a page connects,
   so that a page that was disconnected misses nothing.
4. A published site's service worker is replaced by one that removes itself: a browser may have seen
   such a site at this address before.
5. `POST /.coursebuild/accept` accepts an output, a figure or a number for the author;
   `POST /.coursebuild/open` opens a place in the editor.
"""

from __future__ import annotations

import ipaddress
import json
import re
import secrets
import socket
import socketserver
import threading
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from coursebuild.preview.access import Access
from coursebuild.preview.answers import PREFIX, TEXT, Answers, digest
from coursebuild.preview.editor import open_in_editor
from coursebuild.preview.messages import accept, page_news
from coursebuild.preview.session import Session

_HEARTBEAT = 15.0
"""Seconds between signs of life on an event stream, by which a browser that went away is noticed.
"""
_IMMUTABLE = re.compile(r"/(?:[^?#]*/)?assets/[^?#]+\.[0-9a-f]{8}\.[a-z0-9]+")
_LARGEST = 1 << 16
"""Bytes of a request's body."""


class PreviewServer(ThreadingHTTPServer):
    """Serves a site."""

    daemon_threads = True

    def __init__(self, host: str, port: int, session: Session, embed: tuple[str, ...] = ()) -> None:
        """Bind a port of a host; 0 is any free one.

        Pages of the origins `embed` may show the preview in a frame.

        Raises:
            OSError: the port cannot be had.
        """
        self.session = session
        self.answers = Answers(session)
        self.is_stopped = False
        addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        self.address_family, _, _, _, (address, *_) = addresses[0]
        super().__init__((str(address), port), _Handler)
        self._address = ipaddress.ip_address(str(self.server_address[0]))
        self._port = int(self.server_address[1])
        token = "" if self._address.is_loopback else secrets.token_urlsafe(12)
        self.access = Access(self._port, token, embed)
        self._thread = threading.Thread(
            target=self.serve_forever, kwargs={"poll_interval": 0.05}, name="preview", daemon=True
        )

    def server_bind(self) -> None:
        """Bind without looking up the name of this host, which may take long."""
        socketserver.TCPServer.server_bind(self)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print nothing: browsers hang up all the time."""

    @property
    def links(self) -> list[str]:
        """The addresses of the preview: one for this machine, then one for others."""
        hosts = [str(self._address)]
        if self._address.is_unspecified:
            hosts = ["127.0.0.1", *_outer_address()]
        names = [f"[{host}]" if ":" in host else host for host in hosts]
        query = f"?token={self.access.token}" if self.access.token else ""
        return [f"http://{host}:{self._port}/{query}" for host in names]

    def start(self) -> None:
        """Answer requests, in a thread."""
        self._thread.start()

    def stop(self) -> None:
        """End all event streams and stop answering."""
        self.is_stopped = True
        condition = self.session.condition
        if condition.acquire(timeout=1.0):  # do not wait for whoever holds it longer
            condition.notify_all()
            condition.release()
        if self._thread.ident is not None:  # otherwise `shutdown` would wait forever
            self.shutdown()
        self.server_close()


def _outer_address() -> list[str]:
    """Find the address at which other machines reach this one, if any; nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return []
        return [probe.getsockname()[0]]


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    protocol_version = "HTTP/1.1"
    server: PreviewServer
    timeout = 60
    # Otherwise each body waits until its head is acknowledged.
    wbufsize = -1
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Answer with a file, or with the stream of events."""
        try:
            parts = urlsplit(self.path)
            path, query = parts.path, parse_qs(parts.query)
        except ValueError:
            path, query = "", {}  # not the address of a page
        if not self._is_allowed():
            return
        if path == f"{PREFIX}events":
            self._stream_events(query.get("page", ["index.html"])[0])
        else:
            self._send(*self.server.answers.find(path))

    do_HEAD = do_GET

    def do_POST(self) -> None:
        """Accept what a page offers, or open a place in an editor."""
        body = self._read_body()
        if not self._is_allowed():
            return
        session = self.server.session
        match self.path.removeprefix(PREFIX), _decode_texts(body):
            case "accept", {"page": page, "id": id}:
                failure = accept(session, page, id)
            case "open", {"place": place}:
                failure = open_in_editor(session, place)
            case "accept" | "open", _:
                self._send_message(HTTPStatus.BAD_REQUEST, "the request cannot be read")
                return
            case _:
                self._send_message(HTTPStatus.METHOD_NOT_ALLOWED, "nothing is accepted here")
                return
        self._send_message(HTTPStatus.CONFLICT if failure else HTTPStatus.OK, failure)

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing about requests."""

    def end_headers(self) -> None:
        """Send the headers of every answer, also of errors that the base class sends."""
        for name, value in self.server.access.headers.items():
            self.send_header(name, value)
        super().end_headers()

    def _is_allowed(self) -> bool:
        """Whether a request may be answered; if not, answer why."""
        access = self.server.access
        refusal = access.refusal(self.command, self.headers)
        if not refusal and access.has_token(self.headers):
            return True
        redirect = None if refusal else access.exchange(self.path)
        message = refusal or "open the address that the terminal shows, which lets this browser in"
        status = HTTPStatus.FORBIDDEN if redirect is None else HTTPStatus.SEE_OTHER
        self._send(status, TEXT, f"{message}\n".encode(), redirect or {})
        return False

    def _read_body(self) -> bytes:
        """Read the body of a request; empty if it is too long or its length is not given."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LARGEST:
            self.close_connection = True
            return b""
        return self.rfile.read(int(length))

    def _send_message(self, status: HTTPStatus, message: str) -> None:
        self._send(status, "application/json", json.dumps({"message": message}).encode())

    def _send(
        self,
        status: HTTPStatus,
        kind: str,
        data: bytes,
        further_headers: Mapping[str, str] | None = None,
    ) -> None:
        self.send_response(status)
        for name, value in (further_headers or {}).items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        # Browsers may keep files with a hash of their content in their name, such as fonts.
        is_immutable = status is HTTPStatus.OK and _IMMUTABLE.fullmatch(self.path)
        cache_control = "max-age=31536000, immutable" if is_immutable else "no-store"
        self.send_header("Cache-Control", cache_control)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    # --- the stream of events

    def _stream_events(self, page: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream; charset=utf-8")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.end_headers()
        self.close_connection = True
        if self.command == "HEAD":
            return
        try:
            self._follow(page)
        except OSError:  # the browser has gone
            return

    def _follow(self, page: str) -> None:
        server, session = self.server, self.server.session
        self._send_event("hello", json.dumps({"tool": server.answers.tool}))
        version, page_digest, news = -1, None, None

        def has_news() -> bool:
            return server.is_stopped or session.version != version

        while True:
            with session.condition:
                is_news = session.condition.wait_for(has_news, _HEARTBEAT)
                version = session.version
            if server.is_stopped:
                return
            digest_now = digest(session.find(page))
            if digest_now != page_digest:
                page_digest, news = digest_now, None  # the news is sent again for the new page
                self._send_event("page", json.dumps(digest_now))
            latest = page_news(session, page)
            if latest != news:
                news = latest
                self._send_event("news", latest)
            if not is_news:
                self.wfile.write(b": still here\n\n")
                self.wfile.flush()

    def _send_event(self, event: str, data: str) -> None:
        self.wfile.write(f"event: {event}\ndata: {data}\n\n".encode("utf-8", "replace"))
        self.wfile.flush()


def _decode_texts(body: bytes) -> dict[str, str]:
    """Decode a JSON object of texts; empty if the body is something else."""
    try:
        return msgspec.json.decode(body, type=dict[str, str])
    except (msgspec.DecodeError, UnicodeDecodeError):
        return {}
