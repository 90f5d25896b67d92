"""The command `vrg developer`, which opens the developers' view of a running match."""

import typer

from vrg.commands.attaching import SetupArgument, attached
from vrg.commands.options import EndpointOption, KeysOption, NameOption, keys_of, need_display


def developer(
    match: SetupArgument = None, name: NameOption = None, router: EndpointOption = None, seats: KeysOption = None
) -> None:
    """Open the developers' view: all players and the referee, sensors, streams and processes; an official's buttons."""
    from vrg.launch.serving import serve

    found = attached(match, name, router)
    setup = found.known_setup("vrg developer match.toml")
    need_display()
    stop = serve("developer", setup, router=found.endpoint, run=found.run, keys=keys_of(found.endpoint, seats))
    if stop.interrupted:
        raise typer.Exit(130)
