"""The command `vrg show web`, which serves a running match to browsers.

`vrg play` shares how it chooses a port, makes the tokens of the page, and prints where people find it.
"""

import socket
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import psutil
import typer
from rich.console import Console

from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached, connected, credentials_for
from vrg.commands.options import (
    ListenOption,
    TlsOption,
    make_console,
    port_at,
    stoppable,
    web_address,
)
from vrg.errors import ConfigError, LaunchError
from vrg.files import read_text
from vrg.hosts import netloc
from vrg.kinds import WEB
from vrg.launch.first_state import first_state
from vrg.packages import lacking
from vrg.seats.credentials import is_official
from vrg.seats.folder import LASTS, LOCAL_HOSTS, KeysFolder
from vrg.seats.seat import Seat, SeatKind
from vrg.ui.web.admission import DEFAULT_PORT, OFFICIAL, Admission, VisitorKind, admission, read_admission, tls_context
from vrg.ui.web.drawers import DRAWERS

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.ui.timeline import Timeline

CHECKED_EVERY = 1.0
"""The real time in s between two looks at whether the page is still served."""
EVERYWHERE = "0.0.0.0"
"""The address to listen on for all other machines."""
_SPECIAL = (
    (
        "of Docker or a virtual machine: other machines cannot reach it",
        ("docker", "br-", "veth", "virbr", "vmnet", "vmware", "vboxnet", "virtualbox", "lxc", "podman", "cni"),
    ),
    ("of a VPN: only machines in it can reach it", ("tun", "tap", "wg", "tailscale", "zt", "ppp", "utun", "ipsec")),
)
"""Remarks on network interfaces, by the beginning of their names."""
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_WHO = {VisitorKind.VIEWER: "watch", VisitorKind.OFFICIAL: "official", VisitorKind.SEAT: "drive {}"}


def web(on: MatchOptions, listen: ListenOption = None, tls: TlsOption = False) -> None:
    """Show a running match in browsers. Without the official's keys everybody may only watch."""
    serve_page(on, listen, tls=tls)


def serve_page(on: MatchOptions, listen: str | None, *, tls: bool, drawer: str = "") -> None:
    """Serve the page of a running match until Ctrl-C is pressed.

    Args:
        listen: the address that was typed. tls: True serves it by https.
        drawer: the name of the drawer that the official's link opens; empty for none. With one there is such a link
            without the official's keys, too, which lets its holder look into the drawer, and stop everything.

    Raises:
        ConfigError: there is no such drawer.
        LaunchError: the port is not free, this machine has no such address, or what serves pages is not installed.
    """
    if drawer:
        DRAWERS.get(drawer)
    _need_server()
    host, port = web_address(listen)
    found, seats = attached(on), WEB.seats_of("")
    if drawer:
        found.known_setup()
    official = is_official(credentials_for(found.endpoint, on.keys, *seats))
    with connected(found.endpoint, on.keys, *seats, patience=10.0) as (stop, session):
        state = first_state(session, found.keys, stop)
    if state is not None:
        driven = [player.name for player in state.players] if official else []
        page = open_page(host, port, driven, deciding=official or bool(drawer), tls=tls)
        print_links(page, make_console(), drawer)
        found.serve(WEB, secret=page.encoded())


def open_page(
    host: str,
    port: int | None,
    players: Sequence[str],
    *,
    deciding: bool = True,
    keys: Path | None = None,
    tls: bool = False,
    known: Admission | None = None,
) -> Admission:
    """Choose a port for the page, and make its tokens. The process that serves it opens the port.

    Args:
        host: the address to listen on. port: the port that was asked for; None takes the usual one, or the next free.
        players: those that may be driven. deciding: False lets everybody only watch.
        keys: the folder of the keys of the match. Where `vrg keys sheet` has printed links, these are good.
        tls: True serves it by https. Links of `vrg keys sheet` that begin so are served so in any case.
        known: address and tokens that another program has chosen; they stand above all others.

    Raises:
        ConfigError: the tokens in the folder cannot be read.
        LaunchError: the port is not free, this machine has no such address, or what serves pages is not installed.
    """
    _need_server()
    if known is not None:
        host, port = known.host, known.port
    else:
        known = None if keys is None else known_page(keys)
        port = port or (known.port if known else None)
    found = port_at(host, port, DEFAULT_PORT, "the page")
    page = admission(host, found, players, deciding=deciding, known=known)
    return encrypted(page) if tls or page.certificate else page


def serve_replay(timeline: "Timeline", setup: "MatchSetup", since: float | None, listen: str | None) -> None:
    """Serve a recorded match to browsers until Ctrl-C is pressed.

    Args:
        setup: of the match. since: the match time at which the printed links begin, s; None for the first instant.
        listen: the address that was typed.

    Raises:
        LaunchError: the port is not free, this machine has no such address, or what serves pages is not installed.
    """
    _need_server()
    from vrg.ui.web.replay import ReplaySite

    host, port = web_address(listen)
    found = port_at(host, port, DEFAULT_PORT, "the page")
    site = ReplaySite(host, found, timeline, setup.name)
    with stoppable() as stop:
        site.start()
        for address in reached_at(host):
            typer.echo(f"recorded match: http://{netloc(address, found)}/{'' if since is None else f'#t={since:g}'}")
        typer.echo("(Ctrl-C ends it)")
        try:
            while not stop.wait(CHECKED_EVERY):
                site.check()
        finally:
            site.stop()


def _need_server() -> None:
    if why := lacking("aiohttp"):
        raise LaunchError(why)


def encrypted(page: Admission, named: str = "") -> Admission:
    """The page with a certificate, which it keeps if it has one that is valid.

    Args:
        named: a further name by which browsers reach this machine; empty for none.
    """
    from vrg.seats.authority import make_authority, make_seat, validity

    now = datetime.now(UTC)
    machine = socket.gethostname()
    hosts = [*reached_at(page.host), *LOCAL_HOSTS, machine, f"{machine}.local", *([named] if named else [])]
    if page.certificate:
        known = validity(page.certificate.encode())
        if not known.is_over(now) and (not named or named in known.hosts):
            return page
    # A seat of the match may not have it: whatever serves by a certificate of its authority could pose as the router.
    own = make_seat(make_authority("page", now), Seat(SeatKind.ROUTER), now, LASTS, hosts)
    return replace(page, certificate=own.certificate.decode(), private_key=own.private_key.decode())


def page_of(file: Path) -> Admission:
    """The address and the tokens of the page in a file of another program.

    Raises:
        ConfigError: they cannot be read.
    """
    try:
        return read_admission(read_text(file))
    except (OSError, ValueError) as error:
        raise ConfigError(f"{file}: {error}") from None


def known_page(keys: Path) -> Admission | None:
    """The tokens that `vrg keys sheet` has put into a folder of keys; None if there are none.

    Raises:
        ConfigError: they, or the certificate with them, cannot be read.
    """
    from vrg.seats.authority import validity

    file, what = KeysFolder(keys).page, ""
    try:
        page = read_admission(read_text(file)) if file.exists() else None
        if page is not None and page.certificate:
            what = "expected a certificate and its private key: "
            validity(page.certificate.encode())
            tls_context(page.certificate, page.private_key)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{file}: {what}{error}: remove it, and print new links with `vrg keys sheet`") from None
    return page


def print_links(page: Admission, console: Console, drawer: str = "") -> None:
    """Print the links of the page, and who can open it. The official's link opens the drawer of this name, if any."""
    for address in reached_at(page.host):
        remark = remark_on(address)
        links = [
            (_WHO[role.kind].format(role.player), f"{link}&{drawer}" if drawer and role == OFFICIAL else link)
            for role, link in page.links(address)
        ]
        width = max(len(who) for who, _ in links)
        for who, link in links:
            # A link that is broken into lines cannot be clicked.
            console.print(f"{who:<{width}}  {link}{remark and f'  ({remark})'}", soft_wrap=True, markup=False)
    if page.port != DEFAULT_PORT:
        console.print(f"the page has port {page.port}")
    if page.host in _LOOPBACK:
        console.print("the page is for browsers on this machine; --listen 0.0.0.0 serves it to others")
    else:
        unencrypted = "" if page.certificate else ", and all of it goes over the network unencrypted"
        console.print(
            "[yellow]everybody who reaches this machine can watch; a link with a token lets its holder decide "
            f"or drive{unencrypted}[/yellow]",
            soft_wrap=True,
        )
    if page.certificate:
        from vrg.seats.authority import fingerprint

        console.print(
            "browsers warn that they do not know the certificate of the page: continue if its SHA-256 fingerprint is "
            f"{fingerprint(page.certificate)}",
            soft_wrap=True,
        )


def reached_at(host: str) -> list[str]:
    """The addresses of this machine at which others reach what listens on `host`; its own if there are none.

    Those of which `remark_on` has something to say are last.
    """
    if host not in (EVERYWHERE, "::"):
        return [host]
    return sorted(_interfaces(), key=lambda address: bool(remark_on(address))) or ["127.0.0.1"]


def remark_on(address: str) -> str:
    """Why an address of this machine may be of no use to others, in words; empty for one of a usual network."""
    interface = _interfaces().get(address, "").lower()
    return next((words for words, names in _SPECIAL if interface.startswith(names)), "")


def _interfaces() -> dict[str, str]:
    """The name of the network interface of each address of this machine, but for loopback."""
    return {
        entry.address: name
        for name, entries in psutil.net_if_addrs().items()
        for entry in entries
        if entry.family is socket.AF_INET and not entry.address.startswith("127.")
    }
