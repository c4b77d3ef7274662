"""The preview's web server: serves a site from memory and sends news to open pages.

1. Pages get another script and style sheet. The script listens to `/.coursebuild/events`: `page` is
   a digest of the page as it is now, `news` its messages. Both are sent whenever a page connects,
   so that a page that was disconnected misses nothing.
2. A published site's service worker is replaced by one that removes itself: a browser may have seen
   such a site at this address before.
3. `POST /.coursebuild/open` opens a place where something is wrong in the author's editor: that of
   `$VISUAL` or `$EDITOR` if it opens a window, as the terminal is the preview's; otherwise the
   first installed one that is known. Where there is none, pages link to `vscode://file/…`.
4. Where a request ends is never in doubt: a proxy before the preview may send those of others over
   the same connection. So a head is read strictly, and a connection goes on only after a request
   without a body that was answered.
"""

from __future__ import annotations

import contextlib
import hmac
import ipaddress
import json
import os
import re
import secrets
import shlex
import socket
import socketserver
import threading
import time
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from coursebuild.core.files.errors import reason
from coursebuild.core.files.trust import store_key
from coursebuild.core.run import gate
from coursebuild.core.text.regex import regex
from coursebuild.preview.answers import HTML, PREFIX, TEXT, Access, Answers, digest, is_worker
from coursebuild.preview.messages import accept, page_news
from coursebuild.preview.session import Session
from coursebuild.report.text import location

_HEARTBEAT = 15.0
"""Seconds between signs of life on an event stream, by which a browser that went away is noticed.
"""
_IMMUTABLE = regex(r"/(?:[^?#]*/)?assets/[^?#]+\.[0-9a-f]{8}\.[a-z0-9]+")
_LARGEST = 1 << 16
"""Bytes of a line of a request's head, and of its body."""
_MOST_LINES = 100
"""Lines of a request's head."""
_REQUEST_LINE = regex(rb"[A-Z]+ [!-~]+ HTTP/1\.[01]\r\n")
_HEADER_LINE = regex(rb"([\w!#$%&'*+.^`|~-]+):[ \t]*+([\t -~\x80-\xff]*+)\r\n", re.ASCII)
_ONCE = (b"content-length", b"host", b"origin", b"sec-fetch-site", b"sec-fetch-mode")
"""Headers by which a request is judged."""
_DRAWING_POLICY = "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Of an SVG at its own address: a preview shows a course before it is judged."""


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
        # The same after a restart, of a course and its user
        key = store_key(str(session.root)) or secrets.token_bytes()
        name = b"preview\0" + os.fsencode(session.root.resolve())
        self.access = Access(self._port, hmac.digest(key, name, "sha256").hex()[:32], embed)
        self.is_local = self._address.is_loopback
        self.linked_folder = str(session.root) if self.is_local and not _find_editor() else ""
        """The folder of the files that pages link to for VS Code, where no editor can be started
        here; empty where the browser may be another machine's."""
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
            hosts = ["127.0.0.1"]
            # The address at which other machines reach this one, if any; nothing is sent
            with (
                socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe,
                contextlib.suppress(OSError),
            ):
                probe.connect(("192.0.2.1", 9))
                hosts.append(probe.getsockname()[0])
        names = [f"[{host}]" if ":" in host else host for host in hosts]
        return [f"http://{host}:{self._port}/?token={self.access.token}" for host in names]

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


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    protocol_version = "HTTP/1.1"
    server: PreviewServer
    raw_requestline: bytes
    timeout = 60
    # Otherwise each body waits until its head is acknowledged.
    wbufsize = -1
    disable_nagle_algorithm = True

    def parse_request(self) -> bool:
        """Read the head of a request; where it can be read in two ways, refuse it."""
        self.command, self.requestline, self.request_version = "", "", "HTTP/1.1"
        head: list[bytes] = []
        while not head or head[-1].strip(b"\r\n"):
            head.append(self.rfile.readline(_LARGEST))
            if len(head) > _MOST_LINES:
                self.send_error(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE)
                return False
        first, *rest, last = [self.raw_requestline, *head]
        headers = [match.groups() for line in rest if (match := _HEADER_LINE.fullmatch(line))]
        names = [name.lower() for name, _ in headers]
        lengths = [value for name, value in headers if name.lower() == b"content-length"]
        # Only a head that every reader takes for the same, with a body that is not long
        if (
            _REQUEST_LINE.fullmatch(first) is None
            or (len(headers), last) != (len(rest), b"\r\n")
            or max(map(names.count, _ONCE)) > 1
            or b"transfer-encoding" in names
            or not all(re.fullmatch(rb"[0-9]{1,9}", n) and int(n) <= _LARGEST for n in lengths)
        ):
            self._send_message(HTTPStatus.BAD_REQUEST, "the request cannot be read")
            return False
        stream, self.rfile = self.rfile, BytesIO(b"".join(head))
        try:
            is_read = super().parse_request()
        finally:
            self.rfile = stream
        if "Content-Length" in self.headers:
            self.close_connection = True
        return is_read

    def do_GET(self) -> None:
        try:
            parts = urlsplit(self.path)
            path, query = parts.path, parse_qs(parts.query)
        except ValueError:
            path, query = "", {}  # not the address of a page
        if not self._is_allowed(path):
            return
        if path == f"{PREFIX}events":
            self._stream_events(query.get("page", ["index.html"])[0])
        else:
            self._send(*self.server.answers.find(path))

    do_HEAD = do_GET

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length", "0")))
        if not self._is_allowed():
            return
        session = self.server.session
        try:
            texts = msgspec.json.decode(body, type=dict[str, str])
        except (msgspec.DecodeError, UnicodeDecodeError):
            texts = {}
        match self.path.removeprefix(PREFIX), texts:
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

    def _is_allowed(self, path: str = "") -> bool:
        """Whether a request may be answered, with what is at a path; if not, answer why."""
        access = self.server.access
        refusal = access.refusal(self.command, self.path, self.headers)
        exchange = None if refusal else access.exchange(self.path, self.headers)
        if exchange is not None:
            cookie, page = exchange
            self._send(HTTPStatus.OK, HTML, page, {"Set-Cookie": cookie})
            return False
        if not refusal and (access.has_token(self.headers) or is_worker(path)):
            return True
        message = refusal or "open the address that the terminal shows, which lets this browser in"
        self._send(HTTPStatus.FORBIDDEN, TEXT, f"{message}\n".encode())
        return False

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
        if kind == "image/svg+xml":
            self.send_header("Content-Security-Policy", _DRAWING_POLICY)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        # Browsers may keep files with a hash of their content in their name, such as fonts.
        is_immutable = status is HTTPStatus.OK and _IMMUTABLE.fullmatch(self.path)
        cache_control = "max-age=31536000, immutable" if is_immutable else "no-store"
        self.send_header("Cache-Control", cache_control)
        if self.close_connection or status >= HTTPStatus.BAD_REQUEST:
            self.send_header("Connection", "close")
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
        if self.command == "HEAD":
            return
        try:
            self._follow(page)
        except OSError:  # the browser has gone
            return

    def _follow(self, page: str) -> None:
        server, session = self.server, self.server.session
        hello = {"tool": server.answers.tool, "now": time.time(), "folder": server.linked_folder}
        self._send_event("hello", json.dumps(hello))
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


_ARGUMENTS = {
    "--goto {file}:{line}:{column}": "code code-insiders codium cursor windsurf positron",
    "{file}:{line}:{column}": "subl zed zeditor",
    "--line {line} --column {column} {file}": "pycharm idea webstorm clion kate",
    "+{line}:{column} {file}": "emacs emacsclient gedit",
    "+{line} {file}": "gvim mvim",
}
"""The arguments by which editors open a place."""
_EDITORS = {name: words for words, names in _ARGUMENTS.items() for name in names.split()}
_PATIENCE = 2.0
"""Seconds in which an editor that cannot open a window ends."""


def open_in_editor(session: Session, place: str) -> str:
    """Open a place in the editor; return why that failed, or an empty text."""
    span = next((d.span for d in session.diagnostics() if location(d.span) == place), None)
    if span is None:
        return "nothing is wrong there now"
    words = _find_editor()
    if not words:
        return "no editor that opens a window was found: set VISUAL to one, such as `code`"
    file = session.root / span.path
    program = Path(words[0]).name
    arguments = [
        part.format(file=file, line=span.line, column=span.column)
        for part in _EDITORS[_name(words[0])].split()
    ]
    variables = gate.environment(*gate.DESKTOP)
    try:
        status = gate.start([*words, *arguments], variables, bound=False).wait(_PATIENCE)
    except OSError as error:
        return f"{program} cannot be started: {reason(error)}"
    except gate.StillRunningError:  # it is open
        return ""
    return f"{program} ended with status {status}" if status else ""


def _find_editor() -> list[str]:
    for command in (os.environ.get("VISUAL"), os.environ.get("EDITOR"), *_EDITORS):
        program, *options = shlex.split(command or "") or [""]
        if _name(program) in _EDITORS and (place := gate.find_program(program)):
            return [place, *options]
    return []


def _name(program: str) -> str:
    return Path(program).stem.lower()
