"""Who may use the preview: its own pages, and whoever opens one of its addresses.

Entry point: `Access`.

1. A page of another origin may link to the preview and do nothing else. Browsers say where a
   request comes from (`Sec-Fetch-Site`, `Origin`), and are told to show answers to nobody else.
2. A host name may be made to point at this machine (DNS rebinding), an address may not. So only
   `localhost` and addresses are good hosts; 0.0.0.0 and [::] are not, which mean this machine to
   some browsers that keep pages from its loopback address.
3. Other machines need a token, first in the address, then in the cookie that it is exchanged for.
   With it any host is good, since a cookie belongs to the host that set it.
"""

from __future__ import annotations

import ipaddress
import re
import secrets
from email.message import Message
from urllib.parse import parse_qsl, urlencode, urlsplit

from msgspec import Struct

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
            return "the request is to another host than it names"
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
