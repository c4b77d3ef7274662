"""What an address has: files of the site, and what the preview adds to pages.

Entry point: `Answers.find`. Files come from a `Session`, which decides what there is; nothing is
read from disk here.
"""

from __future__ import annotations

import hashlib
import posixpath
from collections.abc import Mapping
from html import escape
from http import HTTPStatus
from urllib.parse import unquote

from coursebuild.preview.session import Session

PREFIX = "/.coursebuild/"
HTML = "text/html; charset=utf-8"
JSON = "application/json; charset=utf-8"
TEXT = "text/plain; charset=utf-8"
_TYPES = {
    ".html": HTML,
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".json": JSON,
    ".xml": "application/xml; charset=utf-8",
    ".txt": TEXT,
    ".md": TEXT,
    ".py": TEXT,
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
_WORKER = "/service-worker.js"
_NOTHING = b"<!DOCTYPE html><html lang=en><title>Preview</title><body><p>%s</p></body></html>"


class Answers:
    """See the module."""

    def __init__(self, session: Session, own: Mapping[str, bytes]) -> None:
        """`own` are the preview's files, by name: `preview.js`, `preview.css`, `worker.js`."""
        self._session = session
        self._own = own
        self.tool = digest(b"".join(own.values()))
        """By which versions of the preview are told apart."""

    def find(self, path: str) -> tuple[HTTPStatus, str, bytes]:
        """Status, content type and bytes of an address path."""
        if path.endswith(_WORKER):
            path = f"{PREFIX}worker.js"
        own = self._own.get(path.removeprefix(PREFIX)) if path.startswith(PREFIX) else None
        if own is not None:
            return HTTPStatus.OK, _type_of(path), own
        name, data = self._file(path)
        if data is not None and not name.endswith(".html"):
            return HTTPStatus.OK, _type_of(name), data
        if data is not None:
            return HTTPStatus.OK, _type_of(name), _tagged(data, name, digest(data))
        if self._session.files.has_page(name):
            text = b"This page cannot be shown before its mistakes are mended."
            return HTTPStatus.OK, HTML, _tagged(_NOTHING % text, name, "")
        missing = self._session.find("404.html")
        if missing is None:
            missing = _NOTHING % b"Nothing is built yet."
        return HTTPStatus.NOT_FOUND, HTML, _tagged(missing, name, "")

    def _file(self, path: str) -> tuple[str, bytes | None]:
        """The path in the site that an address means, and what is there.

        The page for missing addresses names everything from the root of the host, where the
        published site may lie in a folder.
        """
        base = self._session.base()
        names = [path.lstrip("/")]
        if path.startswith(base):
            names.append(path.removeprefix(base))
        found = [
            unquote(name) + ("index.html" if not name or name.endswith("/") else "")
            for name in names
        ]
        for name in found:
            data = self._session.find(name)
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
