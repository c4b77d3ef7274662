"""Who may use the preview, and what is served at an address.

1. Whoever asks shows a token, which the link that `serve` prints holds. It is first in the address,
   then in the cookie for which it is exchanged. So no other user of the machine can ask anything,
   nor a page whose host name was made to point at this machine (DNS rebinding): a cookie belongs to
   the host that set it.
2. A page of another origin may link to the preview and do nothing else. Browsers say where a
   request comes from (`Sec-Fetch-Site`, `Origin`), and are told to show answers to nobody else.
   Ports of a host share their cookies, so these alone do not keep out a page at another port.
"""

from __future__ import annotations

import hashlib
import json
import posixpath
import re
import secrets
from email.message import Message
from html import escape
from http import HTTPStatus
from mimetypes import MimeTypes
from urllib.parse import parse_qsl, unquote, urlencode, urlsplit

from msgspec import Struct

from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.pages.assets import page_script
from coursebuild.core.pages.materials import strings_for
from coursebuild.core.pages.renderer import DEFAULT_LANGUAGE, Strings
from coursebuild.core.text.regex import regex
from coursebuild.preview.session import Session

_HOST = regex(r"(?:[a-z0-9._-]+|\[[0-9a-f:.]+\])(?::(?P<port>[0-9]{1,5}))?")


class Access(Struct, frozen=True):
    """Decides who may use the preview; see the module."""

    port: int
    token: str
    embed: tuple[str, ...] = ()
    """Origins whose pages may show the preview in a frame."""

    @property
    def headers(self) -> dict[str, str]:
        """Headers of every answer, by which browsers keep it from pages of other origins."""
        framed_by = " ".join(self.embed) or "'none'"
        return {
            "Content-Security-Policy": f"frame-ancestors {framed_by}",
            "Cross-Origin-Resource-Policy": "same-origin",
            "X-Content-Type-Options": "nosniff",
        }

    def refusal(self, method: str, target: str, headers: Message) -> str:
        """Why a request is refused, whoever has the token; empty where it is not."""
        host = headers.get("Host", "").lower()
        match = _HOST.fullmatch(host)
        if match is None or int(match["port"] or 0) > 0xFFFF:
            return "the request does not name its host"
        scheme, separator, rest = target.lower().partition(":")
        if separator and scheme in ("http", "https") and re.split("[/?#]", rest)[2:3] != [host]:
            return "the request went to a different host from the one that it names"
        origin = headers.get("Origin")
        if origin is None and method == "POST":
            return "a request that changes something says where it comes from"
        if origin is not None and origin.lower() not in (f"http://{host}", f"https://{host}"):
            return "pages of other origins cannot use the preview"
        if headers.get("Sec-Fetch-Site", "none") in ("same-origin", "none"):
            return ""
        destinations = ("document", "iframe") if self.embed else ("document",)
        is_link = headers.get("Sec-Fetch-Mode") == "navigate"
        if method == "GET" and is_link and headers.get("Sec-Fetch-Dest") in destinations:
            return ""
        return "pages of other origins can only link to the preview"

    def has_token(self, headers: Message) -> bool:
        """Whether a request shows the token in its cookie."""
        cookies = headers.get("Cookie", "").split(";")
        return any(_is_same(cookie.strip(), self._cookie) for cookie in cookies)

    def exchange(self, address: str, headers: Message) -> tuple[str, bytes] | None:
        """The cookie for the token in an address, and a page that goes on to it without.

        A redirect would be part of the request that led to it: after a link on another site,
        browsers would withhold the new cookie.
        """
        try:
            parts = urlsplit(address)
        except ValueError:
            return None
        fields = dict(parse_qsl(parts.query))
        if not _is_same(fields.pop("token", ""), self.token):
            return None
        query = f"?{urlencode(fields)}" if fields else ""
        # Two slashes at its beginning would name another host.
        place = "/" + parts.path.lstrip("/\\") + query
        is_framed = headers.get("Sec-Fetch-Dest") == "iframe"
        rule = "SameSite=None; Secure; Partitioned" if is_framed else "SameSite=Strict"
        return f"{self._cookie}; Path=/; HttpOnly; {rule}", _NEXT_PAGE.format(
            escape(place)
        ).encode()

    @property
    def _cookie(self) -> str:
        return f"coursebuild-{self.port}={self.token}"


def _is_same(text: str, secret: str) -> bool:
    return secrets.compare_digest(text.encode(), secret.encode())


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


def is_worker(path: str) -> bool:
    """Whether a path is of the script that takes the place of a published site's worker.

    It is for everybody: until it has come, the browser shows that site, and no link gets through.
    """
    return path.endswith(_WORKER)


_NEXT_PAGE = '<!DOCTYPE html><title>…</title><meta http-equiv="refresh" content="0; url={}">'
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
        if is_worker(path):
            path = f"{PREFIX}worker.js"
        if path in self._preview_files:
            return HTTPStatus.OK, _type_of(path), self._preview_files[path]
        name, data = self._find_file(path)
        if data is not None:
            text = self._add_preview(data, name, digest(data)) if name.endswith(".html") else data
            return HTTPStatus.OK, _type_of(name), text
        reason = self._session.unreadable(name)
        if reason is not None or self._session.files.has_page(name):
            words = self._words("preview.blocked")
            message = words if reason is None else f"{reason.span.path}: {reason.message}"
            return HTTPStatus.OK, HTML, self._add_preview(self._message_page(message), name, "")
        missing = self._session.find("404.html")
        if missing is None:
            missing = self._message_page(self._words("preview.unbuilt"))
        return HTTPStatus.NOT_FOUND, HTML, self._add_preview(missing, name, "")

    @property
    def _words(self) -> Strings:
        course = self._session.course
        return strings_for(self._templates, (course and course.language) or DEFAULT_LANGUAGE)

    def _message_page(self, text: str) -> bytes:
        words = self._words
        title = escape(words("preview.title"))
        return _MESSAGE_PAGE.format(words.language, title, escape(text)).encode()

    def _add_preview(self, page: bytes, name: str, state: str) -> bytes:
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
