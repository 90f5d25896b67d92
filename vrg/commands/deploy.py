"""The command `vrg deploy`, which prepares machines on which matches run for a long time."""

import getpass
from pathlib import Path, PurePosixPath
from typing import Annotated

import typer

from vrg.bus.hosts import in_endpoint
from vrg.commands.groups import CommandGroup
from vrg.commands.options import GameArgument
from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError

PORT = 7447
"""The port of the routers of a permanent installation."""

app = CommandGroup(no_args_is_help=True)


@app.callback()
def _deploy() -> None:
    """Keep `systemd` a subcommand, although it is the only one."""


@app.command()
def systemd(
    match: GameArgument,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for the units; one folder for each machine is made in it.")
    ] = Path("units"),
    vrg: Annotated[str, typer.Option(help="Path of the command `vrg` on the machines.")] = "/opt/vrg/.venv/bin/vrg",
    folder: Annotated[str, typer.Option(help="Folder of the match file on the machines.")] = "/opt/vrg/match",
    user: Annotated[str | None, typer.Option(help="Who runs the processes there; you, if missing.")] = None,
    keys: Annotated[
        str | None, typer.Option(help="Folder of the keys on the machines; the match then has seats, and links TLS.")
    ] = None,
    window: Annotated[bool, typer.Option("--window", help="Start the window, too.")] = False,
) -> None:
    """Write units of systemd that start the processes of a match on the machines that the match file names."""
    from vrg.config.loading import load_match, match_path  # it loads what checks match files
    from vrg.launch.systemd import Installation, install_commands, unit_files, used_machines

    setup = load_match(match_path(match))
    if keys is None and setup.has_seats:
        raise ConfigError(
            f"expected the folder of the keys with --keys, as the match {setup.name} has seats, got none: make "
            "them by `vrg keys init`, hand each machine those of its own seats, and name their folder there; or "
            "write `seats = false` at the top of the match file"
        )
    if keys is not None and not PurePosixPath(keys).is_absolute():
        raise ConfigError(f"--keys: expected a folder on the machines that begins with /, got {keys!r}")
    scheme = "tcp" if keys is None else "tls"
    installations = {
        machine: Installation(
            vrg=PurePosixPath(vrg),
            folder=PurePosixPath(folder),
            match_file=match_path(match).name,
            user=user or getpass.getuser(),
            router=_endpoint(setup, setup.router_at(machine), scheme),
            upstream=_endpoint(setup, setup.place.get("router", HERE), scheme),
            keys=None if keys is None else PurePosixPath(keys),
            display=setup.machines[machine].display if machine in setup.machines else None,
        )
        for machine in used_machines(setup, window=window)
    }
    for machine, texts in unit_files(setup, installations, window=window).items():
        place = output / machine
        place.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (place / name).write_text(text, encoding="utf-8")
        typer.echo(f"{place}: {len(texts)} units. VRG must be there as {vrg}. To install them, type here:")
        for line in install_commands(setup, machine, sorted(texts), place, folder, keys, window=window):
            typer.echo(f"  {line}")


def _endpoint(setup: MatchSetup, machine: str, scheme: str) -> str:
    """The endpoint of the router of a machine.

    Raises:
        ConfigError: the machine's address is not known.
    """
    at = setup.machines.get(machine)
    if at is not None and at.address:
        return f"{scheme}/{in_endpoint(at.address)}:{PORT}"
    if not setup.hosts:
        return f"{scheme}/127.0.0.1:{PORT}"
    raise ConfigError(
        f"expected `address = ...` in [machines.{machine}], as its router must be found without ssh, found none"
    )
