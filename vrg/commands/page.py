"""What the commands that serve the page share: they choose its port, make its tokens, and print its links."""

import socket
from collections.abc import Sequence

import psutil
from rich.console import Console

from vrg.errors import LaunchError
from vrg.launch.endpoints import free_port
from vrg.ui.web.admission import DEFAULT_PORT, Admission, RoleKind, admission

_EVERYWHERE = ("0.0.0.0", "::")
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_WHO = {RoleKind.VIEWER: "watch", RoleKind.OFFICIAL: "official", RoleKind.SEAT: "drive {}"}


def open_page(host: str, port: int | None, players: Sequence[str], *, deciding: bool = True) -> Admission:
    """Choose a port for the page, and make its tokens. The process that serves it opens the port.

    Args:
        host: the address to listen on. port: the port that was asked for; None takes the usual one, or the next free.
        players: those that may be driven. deciding: False lets everybody only watch.

    Raises:
        LaunchError: the port is not free, or this machine has no such address.
    """
    try:
        found = free_port(host, DEFAULT_PORT) if port is None else free_port(host, port, tries=1)
    except OSError as error:
        raise LaunchError(f"the page cannot be served: {error}") from error
    return admission(host, found, players, deciding=deciding)


def print_links(page: Admission, console: Console) -> None:
    """Print the links of the page, and who can open it."""
    addresses = _addresses() if page.host in _EVERYWHERE else [page.host]
    for address in addresses:
        links = [(_WHO[role.kind].format(role.player), link) for role, link in page.links(address)]
        width = max(len(who) for who, _ in links)
        for who, link in links:
            # A link that is broken into lines cannot be clicked.
            console.print(f"{who:<{width}}  {link}", soft_wrap=True, markup=False)
    if page.port != DEFAULT_PORT:
        console.print(f"the page has port {page.port}")
    if page.host in _LOOPBACK:
        console.print("the page is for browsers on this machine; --web-at 0.0.0.0 serves it to others")
    else:
        console.print(
            "[yellow]everybody who reaches this machine can watch; whoever has a link with a token can decide "
            "or drive, and all of it goes over the network unencrypted[/yellow]",
            soft_wrap=True,
        )


def _addresses() -> list[str]:
    """The addresses of this machine at which others reach it; its own if there are none."""
    found = [
        entry.address
        for entries in psutil.net_if_addrs().values()
        for entry in entries
        if entry.family is socket.AF_INET and not entry.address.startswith("127.")
    ]
    return found or ["127.0.0.1"]
