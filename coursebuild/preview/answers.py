"""Who may use the preview, and what is served at an address.

1. A page of another origin may link to the preview and do nothing else. Browsers say where a
   request comes from (`Sec-Fetch-Site`, `Origin`), and are told to show answers to nobody else.
2. A host name may be made to point at this machine (DNS rebinding), an address may not. So only
   `localhost` and addresses are good hosts; 0.0.0.0 and [::] are not, which mean this machine to
   some browsers that keep pages from its loopback address.
3. Other machines need a token, first in the address, then in the cookie that it is exchanged for.
   With it any host is good, since a cookie belongs to the host that set it.
"""

from __future__ import annotations

import hashlib
import ipaddress
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
from coursebuild.preview.session import Session

_HOST = re.compile(r"(?P<name>[a-z0-9._-]+|\[[0-9a-f:.]+\])(?::(?P<port>[0-9]{1,5}))?")


class Access(Struct, frozen=True):
    """Decides who may use the preview; see the module."""

    port: int
    token: str = ""
    """Empty where only this machine can reach the preview."""
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
        """Why a request is refused, with or without token; empty where it is not."""
        host = headers.get("Host", "").lower()
        match = _HOST.fullmatch(host)
        if match is None or int(match["port"] or 0) > 0xFFFF:
            return "the request does not name its host"
        if not self.token and not _is_fixed(match["name"]):
            return "this preview answers only as localhost"
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
        """Whether a request shows the token, where one is needed."""
        cookies = headers.get("Cookie", "").split(";")
        return not self.token or any(_is_same(cookie.strip(), self._cookie) for cookie in cookies)

    def exchange(self, address: str) -> dict[str, str] | None:
        """The headers that set a cookie for the token in an address, and redirect to it without."""
        try:
            parts = urlsplit(address)
        except ValueError:
            return None
        fields = dict(parse_qsl(parts.query))
        if not _is_same(fields.pop("token", ""), self.token):
            return None
        query = f"?{urlencode(fields)}" if fields else ""
        return {
            # Two slashes at its beginning would name another host.
            "Location": f"/{parts.path.lstrip('/')}{query}",
            "Set-Cookie": f"{self._cookie}; Path=/; HttpOnly; SameSite=Lax",
        }

    @property
    def _cookie(self) -> str:
        return f"coursebuild-{self.port}={self.token}"  # ports of a host share their cookies


def _is_same(text: str, secret: str) -> bool:
    return secrets.compare_digest(text.encode(), secret.encode())


def _is_fixed(name: str) -> bool:
    """Whether a host is `localhost` or an address, which nobody can make point elsewhere."""
    try:
        address = ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return name == "localhost"
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return not (mapped or address).is_unspecified and (address.version == 6) == ("[" in name)


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
