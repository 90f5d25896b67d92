"""The defence of the page against other sites: headers, and a look at where a connection comes from."""

import ipaddress
from typing import Final
from urllib.parse import urlsplit

PAGE_HEADERS: Final = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""The headers of every answer. The page loads nothing from elsewhere, and is shown in no other page."""


def foreign(origin: str | None, host: str, served: str, machine: str, named: str = "") -> str:
    """Why a connection may be another site's doing, in words; empty if it is not.

    Args:
        origin: of the page that has opened it, as its browser names it; None for a program that is no browser.
        host: the address and port that were asked for. served: the address that is listened on.
        machine: the name of this machine.
        named: a further name by which its owner lets others reach it; empty for none.

    Raises:
        ValueError: the origin or the host is none.
    """
    name = urlsplit(f"//{host}").hostname or ""
    own = {"localhost", served.lower(), machine.lower(), f"{machine.lower()}.local", named.lower()} - {""}
    if name not in own and not _is_address(name):
        return (
            f"expected this machine's address or name ({machine}) in the address of the page, got {name!r}: "
            "another name for this machine may be a trick of another site"
        )
    if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
        return f"expected a connection of the page that is served here, got one of {origin!r}"
    return ""


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
