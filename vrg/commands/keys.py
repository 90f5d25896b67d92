"""The command `vrg keys`, which makes, shows and hands out the keys of a match's seats, and the rules for them."""

import json
import socket
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrg.bus.access import rules as access_rules
from vrg.bus.configuration import check_endpoint, router_settings
from vrg.commands.groups import CommandGroup
from vrg.commands.options import (
    GameArgument,
    JsonOption,
    ListenOption,
    OutputOption,
    RouterOption,
    TlsOption,
    web_address,
    write_text,
)
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.files import write_whole
from vrg.hosts import check_host, is_host
from vrg.kinds import ROUTER
from vrg.names import check_name, name_of
from vrg.seats.credentials import find_credentials
from vrg.seats.seat import NAMED, Seat, SeatKind

if TYPE_CHECKING:
    from vrg.seats.folder import SeatKeys

app = CommandGroup(no_args_is_help=True)

FolderOption = Annotated[Path, typer.Option("--keys", envvar="VRG_KEYS", help="Folder of the keys.")]
KEYS = Path("keys")
"""The folder of keys, unless another one is named."""


@dataclass(frozen=True)
class MakingOptions:
    """The match whose keys are made, and how long and where they are valid."""

    match: GameArgument
    keys: FolderOption = KEYS
    days: Annotated[float, typer.Option(min=0.01, max=730, help="Days for which the keys are valid.")] = 30.0
    host: Annotated[
        list[str] | None,
        typer.Option(
            "--host", help="Host name or IP address of the router's machine, besides this machine's; can be repeated."
        ),
    ] = None


@app.command()
def init(
    on: MakingOptions,
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Remove these keys and make new ones; keys handed out before become invalid."),
    ] = False,
) -> None:
    """Make an authority and the keys of all seats of a match."""
    from vrg.seats.folder import KeysFolder

    setup, folder = _setup(on.match), KeysFolder(on.keys)
    if folder.has_keys and not replace:
        raise ConfigError(
            f"{on.keys}: there are keys already: renew them with `vrg keys renew` where they were made, choose "
            "another folder, or add --replace, which removes them"
        )
    typer.echo(_make(folder.make, setup, on))


@app.command()
def renew(on: MakingOptions) -> None:
    """Make new keys for all seats, including those new in the match file. Old keys stay valid until they expire."""
    from vrg.seats.folder import KeysFolder

    folder = KeysFolder(on.keys)
    typer.echo(f"{_make(folder.renew, _setup(on.match), on)}: hand them out again")
    if folder.sheet.exists():
        typer.echo(f"new players are not on {folder.sheet}: `vrg keys sheet {on.match}` prints it again")


def _make(make: Callable[..., None], setup: MatchSetup, on: MakingOptions) -> str:
    """Make the keys of all seats, and return a sentence about them."""
    roster, now, lasts = setup.roster, datetime.now(UTC), timedelta(days=on.days)
    make(roster.match, roster.seats, now, lasts=lasts, hosts=_hosts(setup, on.host))
    return f"{on.keys}: the keys of {len(roster.seats)} seats, valid until {now + lasts:%Y-%m-%d}"


@app.command()
def show(keys: FolderOption = KEYS, as_json: JsonOption = False) -> None:
    """List the seats whose keys a folder holds, and until when they are valid."""
    from vrg.seats.folder import KeysFolder

    now = datetime.now(UTC)
    rows = []
    for entry in KeysFolder(keys).entries():
        validity, seat = entry.validity, str(_read(entry))
        state = "of another authority" if not entry.genuine else "expired" if validity.is_over(now) else "valid"
        rows.append({"seat": seat, "state": state, "until": validity.ends.isoformat(), "hosts": list(validity.hosts)})
    if as_json:
        typer.echo(json.dumps(rows))
        return
    for row in rows:
        hosts = f"  for {', '.join(row['hosts'])}" if row["hosts"] else ""
        typer.echo(f"{row['seat']:<28} {row['state']:<8} until {str(row['until'])[:16]}{hosts}")


@app.command()
def hand(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to copy the keys to, such as a USB stick.")],
    seats: Annotated[
        list[str] | None, typer.Argument(metavar="[SEAT]...", help="A seat, such as player.ann or commander.red.")
    ] = None,
    keys: FolderOption = KEYS,
) -> None:
    """Copy the keys of some seats, and nothing else, for one machine.

    Without a SEAT, the keys of each player are copied to a folder named after the player.
    """
    from vrg.seats.folder import KeysFolder

    folder = KeysFolder(keys)
    if seats:
        made = folder.hand_out([seat_of(text) for text in seats], output)
    else:
        players = [seat for entry in folder.entries() if (seat := _read(entry)).kind is SeatKind.PLAYER]
        made = [path for seat in players for path in folder.hand_out([seat], output / seat.name)]
        if not made:
            raise ConfigError([f"{keys}: expected keys of players, found none: name the seats whose keys are copied"])
    for path in made:
        typer.echo(path)


@app.command()
def sheet(
    match: GameArgument,
    keys: FolderOption = KEYS,
    listen: ListenOption = None,
    tls: TlsOption = False,
    output: OutputOption = None,
) -> None:
    """Write a sheet for the printer: a strip with a link and its QR code for each player, the official and the public.

    The links are valid whenever `vrg play` serves the page with these keys.
    """
    from vrg.commands.page import EVERYWHERE, encrypted, known_page, reached_at
    from vrg.seats.folder import KeysFolder
    from vrg.ui import sheet as paper
    from vrg.ui.web.admission import DEFAULT_PORT, VisitorKind, admission

    folder, setup = KeysFolder(keys), _setup(match)
    if not folder.has_keys:
        raise ConfigError([f"{keys}: expected a folder of keys, found none: make one with `vrg keys init {match}`"])
    folder.check_match(setup.roster.match)
    host, port = web_address(listen) if listen else (EVERYWHERE, None)
    address, known = reached_at(host)[0], known_page(keys)
    players = [player.name for player in setup.players]
    page = admission(host, port or DEFAULT_PORT, players, known=known)
    page = encrypted(page) if tls else replace(page, certificate="", private_key="")
    purposes = {
        VisitorKind.VIEWER: "watch",
        VisitorKind.OFFICIAL: "halt, continue and end the match: keep this strip",
        VisitorKind.SEAT: "drive with a phone",
    }
    strips = [paper.Strip(role.player or role.kind, purposes[role.kind], link) for role, link in page.links(address)]
    file = output or folder.sheet
    try:
        write_whole(folder.page, page.encoded().encode(), 0o600)
        write_whole(file, paper.page(setup.name, strips).encode(), 0o600)
    except OSError as error:
        raise ConfigError([f"{file}: cannot be written: {error.strerror}: choose another place"]) from None
    at = f"the page at {address}:{page.port}"
    typer.echo(f"{file}: {len(strips)} strips to print, for {at}; whoever holds a strip may take its seat")
    typer.echo(f"to play with them: vrg play {match} --keys {keys} --listen 0.0.0.0:{page.port}")


@app.command()
def rules(
    match: GameArgument,
    keys: FolderOption = KEYS,
    router: RouterOption = "tls/0.0.0.0:7447",
    output: OutputOption = None,
) -> None:
    """Print the whole configuration of the router of a match, as JSON5 for a stock `zenohd -c FILE`."""
    credentials = find_credentials(keys, ROUTER.seats_of(""))
    endpoint = router or ""
    check_endpoint(endpoint, credentials)
    roster = _setup(match).roster
    text = json.dumps(router_settings([endpoint], credentials, access_rules(roster)), indent=2)
    if output is None:
        typer.echo(text)
        return
    write_text(output, f"{text}\n")
    typer.echo(f"{output}: {len(roster.seats) - 1} seats may connect; the files of the keys are named, not copied")


def _read(entry: "SeatKeys") -> Seat:
    """The seat whose keys were found."""
    kind, _, name = entry.validity.common_name.partition(".")
    return Seat(SeatKind(kind), name_of(name))


def seat_of(text: str) -> Seat:
    """The seat that a person means.

    Raises:
        ConfigError: there is no such seat.
    """
    kind, _, name = text.partition(".")
    try:
        return Seat(SeatKind(kind), check_name(name) if name else "")
    except ValueError:
        known = ", ".join(f"{k}.NAME" if k in NAMED else k for k in SeatKind)
        raise ConfigError(f"expected a seat ({known}), got {text!r}") from None


def _setup(match: str) -> MatchSetup:
    from vrg.config.loading import load_match, match_path  # `vrg keys show` needs no match file

    return load_match(match_path(match))


def _hosts(setup: MatchSetup, given: list[str] | None) -> list[str]:
    """The names of the machines of routers: this one, those of the match file, and what was typed besides.

    Raises:
        ConfigError: what was typed is no host.
    """
    from vrg.seats.folder import LOCAL_HOSTS

    own = socket.gethostname()
    addresses = [machine.address for machine in setup.machines.values() if machine.address]
    try:
        typed = [check_host(host) for host in given or ()]
    except ValueError as error:
        raise ConfigError(f"--host: {error}") from None
    return [*LOCAL_HOSTS, *([own] if is_host(own) else []), *addresses, *typed]
