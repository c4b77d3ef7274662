"""The preview's web server: serves a site from memory and tells open pages what is new.

Entry point: `PreviewServer`.

1. `access` decides who is answered. Without `--host` it listens on the loopback interface only.
2. Files come from a `Session`, which decides what there is; nothing is read from disk here.
3. Pages get one script and one style sheet more. The script listens to `/.coursebuild/events`:
   `page` is a digest of the page as it is now, `news` what to say beside its text. Both are sent
   whenever a page connects, so that one which was away misses nothing.
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
_LASTING = re.compile(r"/(?:[^?#]*/)?assets/[^?#]+\.[0-9a-f]{8}\.[a-z0-9]+")
_LARGEST = 1 << 16
"""Bytes of a request's body."""


class PreviewServer(ThreadingHTTPServer):
    """Serves a site."""

    daemon_threads = True

    def __init__(self, host: str, port: int, session: Session, embed: tuple[str, ...] = ()) -> None:
        """Take a port of a host; port 0 is any free one.

        Pages of the origins `embed` may show the preview in a frame.

        Raises:
            OSError: the port cannot be had.
        """
        self.session = session
        self.answers = Answers(session)
        self.ended = False
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        self.address_family, _, _, _, (address, *_) = found[0]
        super().__init__((str(address), port), _Handler)
        self._address = ipaddress.ip_address(str(self.server_address[0]))
        self._port = int(self.server_address[1])
        token = "" if self._address.is_loopback else secrets.token_urlsafe(12)
        self.access = Access(self._port, token, embed)
        self._thread = threading.Thread(
            target=self.serve_forever, kwargs={"poll_interval": 0.05}, name="preview", daemon=True
        )

    def server_bind(self) -> None:
        """Without the name of this host, which may take long to find."""
        socketserver.TCPServer.server_bind(self)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that hangs up is no news."""

    @property
    def links(self) -> list[str]:
        """Addresses of the preview: one for this machine, then one for others."""
        hosts = [str(self._address)]
        if self._address.is_unspecified:
            hosts = ["127.0.0.1", *_outer_address()]
        shown = [f"[{host}]" if ":" in host else host for host in hosts]
        query = f"?token={self.access.token}" if self.access.token else ""
        return [f"http://{host}:{self._port}/{query}" for host in shown]

    def start(self) -> None:
        """Begin to answer, in a thread of its own."""
        self._thread.start()

    def stop(self) -> None:
        """End all event streams and stop answering."""
        self.ended = True
        changed = self.session.changed
        if changed.acquire(timeout=1.0):  # whoever holds it longer is no reason to wait
            changed.notify_all()
            changed.release()
        if self._thread.ident is not None:  # otherwise `shutdown` would wait forever
            self.shutdown()
        self.server_close()


def _outer_address() -> list[str]:
    """The address at which other machines reach this one, if there is one; nothing is sent."""
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
    # Without it each answer's body waits for the acknowledgement of its head.
    wbufsize = -1
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Answer with a file, or with the stream of events."""
        try:
            parts = urlsplit(self.path)
            path, query = parts.path, parse_qs(parts.query)
        except ValueError:
            path, query = "", {}  # no address of a page
        if not self._may_ask():
            return
        if path == f"{PREFIX}events":
            self._events(query.get("page", ["index.html"])[0])
        else:
            self._send(*self.server.answers.find(path))

    do_HEAD = do_GET

    def do_POST(self) -> None:
        """Accept what a page offers, or open a place in an editor."""
        body = self._body()
        if not self._may_ask():
            return
        session = self.server.session
        match self.path.removeprefix(PREFIX), _texts(body):
            case "accept", {"page": page, "id": id}:
                why = accept(session, page, id)
            case "open", {"place": place}:
                why = open_in_editor(session, place)
            case "accept" | "open", _:
                self._say(HTTPStatus.BAD_REQUEST, "the request cannot be read")
                return
            case _:
                self._say(HTTPStatus.METHOD_NOT_ALLOWED, "nothing is accepted here")
                return
        self._say(HTTPStatus.CONFLICT if why else HTTPStatus.OK, why)

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are not news."""

    def end_headers(self) -> None:
        """Whatever is answered, errors of the base class too, is for pages of the preview only."""
        for name, value in self.server.access.headers.items():
            self.send_header(name, value)
        super().end_headers()

    def _may_ask(self) -> bool:
        """Whether a request is answered; one that is not is told why."""
        access = self.server.access
        why = access.refusal(self.command, self.headers)
        if not why and access.is_known(self.headers):
            return True
        entrance = None if why else access.exchange(self.path)
        why = why or "open the address that the terminal shows, which lets this browser in"
        status = HTTPStatus.FORBIDDEN if entrance is None else HTTPStatus.SEE_OTHER
        self._send(status, TEXT, f"{why}\n".encode(), entrance or {})
        return False

    def _body(self) -> bytes:
        """The body of a request; of one that is too long, or does not say how long, nothing."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LARGEST:
            self.close_connection = True
            return b""
        return self.rfile.read(int(length))

    def _say(self, status: HTTPStatus, message: str) -> None:
        self._send(status, "application/json", json.dumps({"message": message}).encode())

    def _send(
        self, status: HTTPStatus, kind: str, data: bytes, more: Mapping[str, str] | None = None
    ) -> None:
        self.send_response(status)
        for name, value in (more or {}).items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        # What has a hash of its content in its name may be kept: fonts are there without a flash.
        lasting = status is HTTPStatus.OK and _LASTING.fullmatch(self.path)
        kept = "max-age=31536000, immutable" if lasting else "no-store"
        self.send_header("Cache-Control", kept)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    # --- the stream of events

    def _events(self, page: str) -> None:
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
        self._tell("hello", json.dumps({"tool": server.answers.tool}))
        seen, state, news = -1, None, None

        def stir() -> bool:
            return server.ended or session.version != seen

        while True:
            with session.changed:
                stirred = session.changed.wait_for(stir, _HEARTBEAT)
                seen = session.version
            if server.ended:
                return
            now = digest(session.find(page))
            if now != state:
                state, news = now, None  # the news is sent again for the new page
                self._tell("page", json.dumps(now))
            latest = page_news(session, page)
            if latest != news:
                news = latest
                self._tell("news", latest)
            if not stirred:
                self.wfile.write(b": still here\n\n")
                self.wfile.flush()

    def _tell(self, event: str, data: str) -> None:
        self.wfile.write(f"event: {event}\ndata: {data}\n\n".encode("utf-8", "replace"))
        self.wfile.flush()


def _texts(body: bytes) -> dict[str, str]:
    """A JSON object of texts; empty where the body is something else."""
    try:
        return msgspec.json.decode(body, type=dict[str, str])
    except msgspec.DecodeError:
        return {}
