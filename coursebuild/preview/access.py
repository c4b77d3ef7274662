"""Who is answered: the pages of the preview itself, and whoever opens one of its addresses.

Entry point: `Access`.

1. A page of another origin may link to the preview and do nothing else. Browsers say where a
   request comes from (`Sec-Fetch-Site`, `Origin`), and are told to give answers to nobody else.
2. A name may be made to point at this machine (DNS rebinding), an address may not. So only
   `localhost` and addresses are good hosts.
3. Other machines need a token: first in the address, then as the cookie that it is exchanged for.
   With it any host is good, since a cookie belongs to the host that set it.
"""

from __future__ import annotations

import ipaddress
import secrets
from email.message import Message
from urllib.parse import parse_qsl, urlencode, urlsplit

from msgspec import Struct


class Access(Struct, frozen=True):
    """See the module."""

    port: int
    token: str = ""
    """Empty where only this machine can ask."""
    embed: tuple[str, ...] = ()
    """Origins whose pages may show the preview in a frame."""

    @property
    def headers(self) -> dict[str, str]:
        """What every answer says, by which browsers keep it from pages of other origins."""
        framed_by = " ".join(self.embed) or "'none'"
        return {
            "Content-Security-Policy": f"frame-ancestors {framed_by}",
            "Cross-Origin-Resource-Policy": "same-origin",
            "X-Content-Type-Options": "nosniff",
        }

    def refusal(self, method: str, headers: Message) -> str:
        """Why a request is not answered, whatever it knows; empty where it may be."""
        host = headers.get("Host", "").lower()
        if not self.token and not _is_fixed(host):
            return "this preview answers only as localhost"
        origin = headers.get("Origin")
        if origin is None and method == "POST":
            return "a request that changes something says where it comes from"
        if origin is not None and origin.lower().partition("://")[2] != host:
            return "pages of other origins cannot use the preview"
        if headers.get("Sec-Fetch-Site", "none") in ("same-origin", "none"):
            return ""
        shown = ("document", "iframe") if self.embed else ("document",)
        follows = headers.get("Sec-Fetch-Mode") == "navigate"
        if method == "GET" and follows and headers.get("Sec-Fetch-Dest") in shown:
            return ""
        return "pages of other origins can only link to the preview"

    def is_known(self, headers: Message) -> bool:
        """Whether a request shows the token, where one is needed."""
        cookies = headers.get("Cookie", "").split(";")
        return not self.token or any(_is_same(one.strip(), self._cookie) for one in cookies)

    def exchange(self, address: str) -> dict[str, str] | None:
        """The headers that give a cookie for the token in an address, and lead on without it."""
        try:
            parts = urlsplit(address)
        except ValueError:
            return None
        given = dict(parse_qsl(parts.query))
        if not _is_same(given.pop("token", ""), self.token):
            return None
        query = f"?{urlencode(given)}" if given else ""
        return {
            # Two slashes at its beginning would name another host.
            "Location": f"/{parts.path.lstrip('/')}{query}",
            "Set-Cookie": f"{self._cookie}; Path=/; HttpOnly; SameSite=Lax",
        }

    @property
    def _cookie(self) -> str:
        return f"coursebuild-{self.port}={self.token}"  # ports of a host share their cookies


def _is_same(given: str, secret: str) -> bool:
    return secrets.compare_digest(given.encode(), secret.encode())


def _is_fixed(host: str) -> bool:
    """Whether nobody can make a host point elsewhere."""
    try:
        name = urlsplit(f"//{host}").hostname or ""
        return name == "localhost" or bool(ipaddress.ip_address(name))
    except ValueError:
        return False
