"""Who may ask the studio: pages of its own, under its own name and port."""

import ipaddress
import socket
from collections.abc import Mapping
from email.message import Message
from urllib.parse import urlsplit

LOCAL = ("localhost", "127.0.0.1", "::1")

OWN_SITES = (None, "same-origin", "none")
"""What browsers say of where a request comes from, if it comes from the studio or from a typed address."""


class Guard:
    """Refuses what other sites make a browser ask, also those whose names are led to this machine.

    Args:
        host: name or address that the studio was told to serve.
        port: that it listens at.
    """

    def __init__(self, host: str, port: int):
        self._port = port
        self._open = not is_local(host)
        self._names = {*LOCAL, host.lower()}
        if self._open:
            self._names |= {socket.gethostname().lower(), socket.getfqdn().lower()}

    def refusal(self, headers: Message | Mapping[str, str]) -> str | None:
        """Why a request with these headers is refused; None if it is not."""
        host, origin = headers.get("Host"), headers.get("Origin")
        if isinstance(headers, Message) and len(headers.get_all("Host", [])) > 1:
            return "two hosts"
        if host is None or not self._is_own(f"//{host}", ""):
            return f"it asks for the host {host!r}; open the address that the studio printed"
        if origin is not None and not self._is_own(origin, "http"):
            return f"it comes from {origin!r}"
        if (site := headers.get("Sec-Fetch-Site")) not in OWN_SITES:
            return f"it comes from another site ({site}); type the address instead"
        return None

    def _is_own(self, address: str, scheme: str) -> bool:
        try:
            parts = urlsplit(address)
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return False
        rest = parts.path or parts.query or parts.fragment or parts.username
        if parts.scheme != scheme or rest or port != self._port:
            return False
        # A name that is no address may be anybody's and lead here; an address is nobody's but the machine's.
        return name in self._names or (self._open and _is_address(name))


def is_local(host: str) -> bool:
    """Whether a host is this machine alone."""
    return host.lower() == "localhost" or (_is_address(host) and ipaddress.ip_address(host).is_loopback)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
