"""The preview's web server: serves a site from memory and tells open pages what is new.

Entry point: `PreviewServer`.

1. It listens on the loopback interface only and answers only requests that name it as their host,
   so that a page elsewhere cannot read the preview through a name that it points here.
2. Files come from a `Session`, which decides what there is; nothing is read from disk here.
3. Pages get one script and one style sheet more. The script listens to `/.coursebuild/events`:
   `page` says which state of the page there is now, `news` what is to be said beside its text.
   A listener is told how things stand when it begins, so that nothing is lost by one that was away.
4. In the place of a published site's service worker there is one that goes: a browser may have met
   such a site at this address before.
5. What an author accepts in a page comes by `POST /.coursebuild/accept`, with a token that only a
   page of this server can know.
"""

from __future__ import annotations

import hashlib
import json
import posixpath
import re
import secrets
import threading
from collections.abc import Mapping
from html import escape
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from coursebuild.preview.messages import accept, page_news
from coursebuild.preview.session import Session

PREFIX = "/.coursebuild/"
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
    ".ttf": "font/ttf",
    ".woff2": "font/woff2",
    ".wasm": "application/wasm",
    ".zip": "application/zip",
    ".pdf": "application/pdf",
    ".webmanifest": "application/manifest+json",
}
_HEARTBEAT = 15.0
"""Seconds between signs of life on an event stream, by which a browser that went away is noticed.
"""
_LASTING = re.compile(r"/(?:[^?#]*/)?assets/[^?#]+\.[0-9a-f]{8}\.[a-z0-9]+")
_WORKER = "/service-worker.js"
_LARGEST = 1 << 16
"""Bytes of a request's body."""
_NOTHING = b"<!DOCTYPE html><html lang=en><title>Preview</title><body><p>%s</p></body></html>"


class PreviewServer:
    """Serves a site on `127.0.0.1:port`; port 0 takes any free one."""

    def __init__(self, port: int, session: Session, own: Mapping[str, bytes]) -> None:
        """`own` are the preview's files, by name: `preview.js`, `preview.css`, `worker.js`."""
        self.session = session
        self.own = own
        self.tool = digest(b"".join(own.values()))
        self.token = secrets.token_urlsafe(18)
        self.ended = False
        self._server = _Server(("127.0.0.1", port), _Handler)
        self._server.preview = self
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, name="preview"
        )
        self._thread.daemon = True

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
        self.ended = True
        changed = self.session.changed
        if changed.acquire(timeout=1.0):  # whoever holds it longer is no reason to wait
            changed.notify_all()
            changed.release()
        if self._thread.ident is not None:  # otherwise nobody would hear of it
            self._server.shutdown()
        self._server.server_close()

    # --- what the handler asks

    def find(self, path: str) -> tuple[HTTPStatus, str, bytes]:
        """Status, content type and bytes of an address path."""
        if path.endswith(_WORKER):
            path = f"{PREFIX}worker.js"
        own = self.own.get(path.removeprefix(PREFIX)) if path.startswith(PREFIX) else None
        if own is not None:
            return HTTPStatus.OK, _type_of(path), own
        name, data = self._file(path)
        if data is not None and not name.endswith(".html"):
            return HTTPStatus.OK, _type_of(name), data
        if data is not None:
            return HTTPStatus.OK, _type_of(name), _tagged(data, name, digest(data))
        if self.session.files.has_page(name):
            text = b"This page cannot be shown before its mistakes are mended."
            return HTTPStatus.OK, _TYPES[".html"], _tagged(_NOTHING % text, name, "")
        missing = self.session.find("404.html")
        if missing is None:
            missing = _NOTHING % b"Nothing is built yet."
        return HTTPStatus.NOT_FOUND, _TYPES[".html"], _tagged(missing, name, "")

    def _file(self, path: str) -> tuple[str, bytes | None]:
        """The path in the site that an address means, and what is there.

        The page for missing addresses names everything from the root of the host, where the
        published site may lie in a folder.
        """
        base = self.session.base()
        names = [path.lstrip("/")]
        if path.startswith(base):
            names.append(path.removeprefix(base))
        found = [
            unquote(name) + ("index.html" if not name or name.endswith("/") else "")
            for name in names
        ]
        for name in found:
            data = self.session.find(name)
            if data is not None:
                return name, data
        return found[0], None


def digest(data: bytes | None) -> str:
    """By which two states of a page are told apart; empty where there is no page."""
    return "" if data is None else hashlib.sha256(data).hexdigest()[:16]


def _type_of(name: str) -> str:
    return _TYPES.get(posixpath.splitext(name)[1].lower(), "application/octet-stream")


def _tagged(page: bytes, name: str, state: str) -> bytes:
    """The page with what the preview adds to it."""
    about = f'data-page="{escape(name)}" data-state="{state}"'
    tags = (
        f'<link rel="stylesheet" href="{PREFIX}preview.css">'
        f'<script src="{PREFIX}preview.js" {about}></script>'
    ).encode("utf-8", "replace")
    head, end, tail = page.rpartition(b"</body>")
    return head + tags + end + tail if end else page + tags


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
        if not self._trusted():
            self._refuse()
        elif path == f"{PREFIX}events":
            self._events(query.get("page", ["index.html"])[0])
        else:
            self._send(*self.server.preview.find(path))

    do_HEAD = do_GET

    def do_POST(self) -> None:
        """Accept what a page offers."""
        preview = self.server.preview
        body = self._body()
        given = self.headers.get("X-Coursebuild-Token", "")
        if self.path != f"{PREFIX}accept":
            self._say(HTTPStatus.METHOD_NOT_ALLOWED, "nothing is accepted here")
        elif not (self._trusted() and self.headers.get("Origin")):
            self._refuse()
        elif not secrets.compare_digest(given.encode(), preview.token.encode()):
            self._say(HTTPStatus.FORBIDDEN, "this page is older than the preview; load it again")
        else:
            wanted = _wanted(body)
            if wanted is None:
                self._say(HTTPStatus.BAD_REQUEST, "the request cannot be read")
            else:
                why = accept(preview.session, *wanted)
                self._say(HTTPStatus.CONFLICT if why else HTTPStatus.OK, why)

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

    def _body(self) -> bytes:
        """The body of a request; of one that is too long, or does not say how long, nothing."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LARGEST:
            self.close_connection = True
            return b""
        return self.rfile.read(int(length))

    def _refuse(self) -> None:
        text = b"this preview answers only on this machine\n"
        self._send(HTTPStatus.FORBIDDEN, "text/plain; charset=utf-8", text)

    def _say(self, status: HTTPStatus, message: str) -> None:
        self._send(status, _TYPES[".json"], json.dumps({"message": message}).encode())

    def _send(self, status: HTTPStatus, kind: str, data: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        # What has a hash of its content in its name may be kept: fonts are there without a flash.
        lasting = status is HTTPStatus.OK and _LASTING.fullmatch(self.path)
        kept = "max-age=31536000, immutable" if lasting else "no-store"
        self.send_header("Cache-Control", kept)
        self.send_header("X-Content-Type-Options", "nosniff")
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
        preview, session = self.server.preview, self.server.preview.session
        self._tell("hello", json.dumps({"tool": preview.tool, "token": preview.token}))
        seen, state, news = -1, None, None

        def stir() -> bool:
            return preview.ended or session.version != seen

        while True:
            with session.changed:
                stirred = session.changed.wait_for(stir, _HEARTBEAT)
                seen = session.version
            if preview.ended:
                return
            now = digest(session.find(page))
            if now != state:
                state, news = now, None  # whoever takes the page is told again what belongs to it
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


def _wanted(body: bytes) -> tuple[str, str] | None:
    """The page and the id of what is accepted."""
    try:
        asked = json.loads(body)
        page, id = asked["page"], asked["id"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    return (page, id) if isinstance(page, str) and isinstance(id, str) else None
