"""Guard of a local server: access control by token, origin and host.

A foreign page in the same browser can send requests to any port of this machine. It does not know the token, and has
another origin, or another host if its own name resolves to this machine (DNS rebinding). Every request needs all three,
including one that opens a socket.
"""

from __future__ import annotations

import hmac
from dataclasses import dataclass
from typing import Protocol

NAMES = ("127.0.0.1", "localhost")
OWN_SITES = ("same-origin", "none")
"""Accepted values of `Sec-Fetch-Site`: requests from pages of this server, and those typed by the user."""

ALWAYS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
"""HTTP headers of every answer."""


class Headers(Protocol):
    """HTTP headers of a request; a header can have several values."""

    def get_all(self, name: str, /) -> list[str] | None: ...


@dataclass(frozen=True, slots=True)
class Guard:
    token: str
    port: int

    @property
    def address(self) -> str:
        return f"http://{NAMES[0]}:{self.port}/{self.token}/"

    def path(self, target: str, headers: Headers) -> str | None:
        """Return the requested path after the token, or None if the request is rejected.

        Args:
            target: request target, ``/TOKEN/PATH?QUERY``.
            headers: headers of the request.
        """
        if not target.startswith("/"):
            return None
        _, token, *rest = target.partition("?")[0].split("/")
        known = hmac.compare_digest(token.encode("utf-8", "surrogateescape"), self.token.encode("ascii"))
        return "/".join(rest) if known and rest and self._from_here(headers) else None

    def opens(self, headers: Headers) -> bool:
        """Return whether a request to open a WebSocket comes from a page of this server."""
        return headers.get_all("Origin") == [f"http://{host}" for host in headers.get_all("Host") or [""]]

    def _from_here(self, headers: Headers) -> bool:
        hosts = headers.get_all("Host") or []
        if len(hosts) != 1 or hosts[0] not in [f"{name}:{self.port}" for name in NAMES]:
            return False
        return all(site in OWN_SITES for site in headers.get_all("Sec-Fetch-Site") or [])
