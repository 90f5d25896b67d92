"""The command `vrg keys`, which makes, shows and hands out the keys of a match's seats, and the rules for them."""

import json
import socket
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.access import rules as access_rules
from vrg.bus.configuration import check_endpoint, router_settings
from vrg.bus.credentials import find_credentials
from vrg.bus.hosts import check_host, is_host
from vrg.bus.names import check_name, name_of
from vrg.bus.seats import NAMED, Seat, SeatKind, seats_of_node
from vrg.commands.groups import CommandGroup
from vrg.commands.options import GameArgument, JsonOption, OutputOption, RouterOption, write_text
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError

app = CommandGroup(no_args_is_help=True)

FolderOption = Annotated[Path, typer.Option("--keys", envvar="VRG_KEYS", help="Folder of the keys.")]
KEYS = Path("keys")
"""The folder of keys, unless another one is named."""


@dataclass(frozen=True)
class MakingOptions:
    """The match whose keys are made, and how long and where they are valid."""

    match: GameArgument
    keys: FolderOption = KEYS
    days: Annotated[float, typer.Option(min=0.01, max=730, help="For how many days the keys are valid.")] = 30.0
    host: Annotated[
        list[str] | None,
        typer.Option(
            "--host", help="Host name or IP address of the router's machine, besides this machine's; may repeat."
        ),
    ] = None


@app.command()
def init(
    on: MakingOptions,
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Remove these keys, and make others: none that was handed out is good."),
    ] = False,
) -> None:
    """Make an authority and the keys of all seats of a match."""
    from vrg.seats.folder import KeysFolder

    setup, folder = _setup(on.match), KeysFolder(on.keys)
    if folder.has_keys and not replace:
        raise ConfigError(
            f"{on.keys}: there are keys already: renew them by `vrg keys renew` where they were made, choose "
            "another folder, or add --replace, which removes them"
        )
    typer.echo(_make(folder.make, setup, on))


@app.command()
def renew(on: MakingOptions) -> None:
    """Make new keys for all seats, those new in the match file too. Old ones are good until they expire."""
    from vrg.seats.folder import KeysFolder

    typer.echo(f"{_make(KeysFolder(on.keys).renew, _setup(on.match), on)}: hand them out again")


def _make(make: Callable[..., None], setup: MatchSetup, on: MakingOptions) -> str:
    """Make the keys of all seats, and return a sentence about them."""
    roster, now, lasts = setup.roster, datetime.now(UTC), timedelta(days=on.days)
    make(roster.match, roster.seats, now, lasts=lasts, hosts=_hosts(setup, on.host))
    return f"{on.keys}: the keys of {len(roster.seats)} seats, valid until {now + lasts:%Y-%m-%d}"


@app.command()
def show(keys: FolderOption = KEYS, as_json: JsonOption = False) -> None:
    """List the seats that a folder has keys of, and until when they are valid."""
    from vrg.seats.folder import KeysFolder

    now = datetime.now(UTC)
    rows = []
    for entry in KeysFolder(keys).entries():
        validity = entry.validity
        kind, _, name = validity.common_name.partition(".")
        seat = f"{kind}.{name_of(name)}" if name else kind
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
    seats: Annotated[list[str], typer.Argument(metavar="SEAT...", help="Such as player.ann or commander.red.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to copy them to, such as a USB stick.")],
    keys: FolderOption = KEYS,
) -> None:
    """Copy the keys of some seats, and nothing else, for one machine."""
    from vrg.seats.folder import KeysFolder

    for made in KeysFolder(keys).hand_out([seat_of(text) for text in seats], output):
        typer.echo(made)


@app.command()
def rules(
    match: GameArgument,
    keys: FolderOption = KEYS,
    router: RouterOption = "tls/0.0.0.0:7447",
    output: OutputOption = None,
) -> None:
    """Print the whole configuration of the router of a match, as JSON5 for a stock `zenohd -c FILE`."""
    credentials = find_credentials(keys, seats_of_node("router", ""))
    endpoint = router or ""
    check_endpoint(endpoint, credentials)
    roster = _setup(match).roster
    text = json.dumps(router_settings([endpoint], credentials, access_rules(roster)), indent=2)
    if output is None:
        typer.echo(text)
        return
    write_text(output, f"{text}\n")
    typer.echo(f"{output}: {len(roster.seats) - 1} seats may connect; the files of the keys are named, not copied")


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
