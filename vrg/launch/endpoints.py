"""Endpoints at which a router can be started."""

import socket
from collections.abc import Sequence
from typing import Any

from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.hosts import netloc


def free_port(host: str, wanted: int, tries: int = 20) -> int:
    """The wanted port of this machine, or the next one that no other program has.

    Args:
        host: the address to listen on. tries: how many ports are looked at.

    Raises:
        OSError: none of them is free, or this machine has no such address.
    """
    problem: OSError | None = None
    for port in range(wanted, min(wanted + tries, 65536)):
        addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        try:
            return _bound(addresses[:1])
        except OSError as error:
            problem = error
    reason = problem.strerror if problem is not None else "no such port"
    if tries == 1:
        raise OSError(f"port {wanted} of {host} cannot be used: {reason}: choose another one, or name none")
    raise OSError(f"no free port at {host} from {wanted} on: {reason}")


def free_endpoint(host: str | None = None, *, secure: bool = False, usual: bool = True) -> str:
    """An endpoint with the default port, or with a free one if another program has that.

    Args:
        host: the address or name of this machine at which others reach it. The default is that of DEFAULT_ENDPOINT,
            which only processes of this machine reach.
        secure: True for an endpoint of a match with seats. usual: False leaves the default port to others.

    Raises:
        OSError: there is no free port, or this machine has no such address.
    """
    own, port = DEFAULT_ENDPOINT.removeprefix("tcp/").split(":")
    wanted = own if host is None else host.strip("[]")
    problem: OSError | None = None
    for candidate in (int(port), 0) if usual else (0,):
        addresses = socket.getaddrinfo(wanted, candidate, type=socket.SOCK_STREAM)
        try:
            found = _bound(addresses)
        except OSError as error:
            problem = error
        else:
            return f"{'tls' if secure else 'tcp'}/{netloc(wanted, found)}"
    raise OSError(f"no free port at {wanted}: {problem}")


def _bound(addresses: Sequence[tuple[Any, ...]]) -> int:
    """The port of the first of some addresses that a program can listen at.

    Args:
        addresses: as `socket.getaddrinfo` returns them.

    Raises:
        OSError: there is none.
    """
    problem = OSError("no such address")
    for family, kind, protocol, _, address in addresses:
        try:
            with socket.socket(family, kind, protocol) as probe:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind(address)
                return int(probe.getsockname()[1])
        except OSError as error:
            problem = error
    raise problem
