"""What is served at an address: files of the site, with what the preview adds to pages.

Entry point: `Answers.find`. The files of the site come from a `Session`.
"""

from __future__ import annotations

import hashlib
import json
import posixpath
from html import escape
from http import HTTPStatus
from mimetypes import MimeTypes
from urllib.parse import unquote

from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.pages.assets import page_script, strings_for
from coursebuild.core.pages.strings import DEFAULT_LANGUAGE, Strings
from coursebuild.preview.session import Session

PREFIX = "/.coursebuild/"
HTML, TEXT = "text/html; charset=utf-8", "text/plain; charset=utf-8"
_TYPES = MimeTypes().types_map[True] | {
    ".js": "text/javascript",
    ".md": "text/plain",
    ".mjs": "text/javascript",
    ".py": "text/plain",
    ".ttf": "font/ttf",
    ".webp": "image/webp",
    ".woff2": "font/woff2",
}
"""Python's own table, and what it lacks in some version or has otherwise."""
_WORKER = "/service-worker.js"
_MESSAGE_PAGE = "<!DOCTYPE html><html lang={}><title>{}</title><body><p>{}</p></body></html>"


class Answers:
    """Finds what is served at an address."""

    def __init__(self, session: Session) -> None:
        self._session = session
        bundled = Bundle()
        self._templates = template_texts()
        self._preview_files = {
            f"{PREFIX}preview.js": page_script(bundled["js/preview.js"]),
            f"{PREFIX}preview.css": bundled["css/preview.css"],
            f"{PREFIX}worker.js": page_script(bundled["js/preview-worker.js"]),
        }
        self.tool = digest(b"".join(self._preview_files.values()))
        """A digest of these files: pages reload when the preview's own scripts have changed."""

    def find(self, path: str) -> tuple[HTTPStatus, str, bytes]:
        """Return the status, content type and bytes for the path of an address."""
        if path.endswith(_WORKER):
            path = f"{PREFIX}worker.js"
        if path in self._preview_files:
            return HTTPStatus.OK, _type_of(path), self._preview_files[path]
        name, data = self._find_file(path)
        if data is not None:
            text = self._add_preview(data, name, digest(data)) if name.endswith(".html") else data
            return HTTPStatus.OK, _type_of(name), text
        if self._session.files.has_page(name):
            return HTTPStatus.OK, HTML, self._add_preview(self._message_page("blocked"), name, "")
        missing = self._session.find("404.html")
        if missing is None:
            missing = self._message_page("unbuilt")
        return HTTPStatus.NOT_FOUND, HTML, self._add_preview(missing, name, "")

    @property
    def _words(self) -> Strings:
        course = self._session.course
        return strings_for(self._templates, (course and course.language) or DEFAULT_LANGUAGE)

    def _message_page(self, key: str) -> bytes:
        words = self._words
        texts = escape(words("preview.title")), escape(words(f"preview.{key}"))
        return _MESSAGE_PAGE.format(words.language, *texts).encode()

    def _add_preview(self, page: bytes, name: str, state: str) -> bytes:
        """Return a page with the preview's style sheet and script, and the texts of that."""
        texts = {k: text for k, text in self._words.texts.items() if k.startswith("preview.")}
        words = escape(json.dumps(texts, ensure_ascii=False))
        attributes = f'data-page="{escape(name)}" data-state="{state}" data-words="{words}"'
        tags = (
            f'<link rel="stylesheet" href="{PREFIX}preview.css">'
            f'<script src="{PREFIX}preview.js" {attributes}></script>'
        ).encode("utf-8", "replace")
        head, end, tail = page.rpartition(b"</body>")
        return head + tags + end + tail if end else page + tags

    def _find_file(self, path: str) -> tuple[str, bytes | None]:
        """Find the path in the site that an address means, and the file there.

        The page for missing addresses links to everything from the root of the host, but the
        published site may lie in a folder of it.
        """
        base = self._session.base()
        names = [path.lstrip("/")]
        if path.startswith(base):
            names.append(path.removeprefix(base))
        site_paths = [
            unquote(name) + ("index.html" if not name or name.endswith("/") else "")
            for name in names
        ]
        for name in site_paths:
            data = self._session.find(name)
            if data is not None:
                return name, data
        return site_paths[0], None


def digest(data: bytes | None) -> str:
    """A digest of a page; empty where there is no page."""
    return "" if data is None else hashlib.sha256(data).hexdigest()[:16]


def _type_of(name: str) -> str:
    kind = _TYPES.get(posixpath.splitext(name)[1].lower(), "application/octet-stream")
    return f"{kind}; charset=utf-8" if kind.startswith("text/") else kind
