"""Where each process of a match runs: the [machines] and [place] tables of a match file, and the players' machines."""

from collections.abc import Mapping, Sequence

from vrg.config.files import PLACED, MatchFile
from vrg.config.setup import HERE, Machine
from vrg.errors import Problem
from vrg.registry import expected_one_of


def machine_problems(file: MatchFile, companions: Sequence[str]) -> list[Problem]:
    """What is wrong with where processes are placed.

    Args:
        companions: the names of the companions of the players' robots.
    """
    known = [HERE, *(name for name in file.machines if name != HERE)]
    found = [problem for name in file.machines for problem in _table_problems(file, name)]
    for process, machine in file.place.items():
        if process not in (*PLACED, *companions):
            text = expected_one_of([*PLACED, *companions], process)
            if process in [player.name for player in file.players]:
                text = f"write `machine = {machine!r}` into the table of the player {process} in place of this"
            found.append(Problem(text, ("place", process)))
        if machine not in known:
            found.append(Problem(expected_one_of(known, machine), ("place", process)))
    for number, player in enumerate(file.players):
        if player.machine not in known:
            found.append(Problem(expected_one_of(known, player.machine), ("players", number, "machine")))
    return found


def _table_problems(file: MatchFile, name: str) -> list[Problem]:
    """What is wrong with the table of one machine."""
    table, where = file.machines[name], ("machines", name)
    found = []
    if name == HERE and table.host is not None:
        found.append(Problem("this is the machine where the match is launched: leave it out", (*where, "host")))
    if name == HERE and table.router:
        found.append(Problem("a further router is on another machine: leave it out", (*where, "router")))
    if name != HERE and table.host is None:
        found.append(Problem("expected a host for ssh, such as robot@lab2.local, found none", where))
    if table.via is not None:
        routers = [other for other, at in file.machines.items() if at.router and other != name]
        if table.via not in routers:
            known = ", ".join(routers) or "there is none"
            text = f"expected a machine with `router = true` ({known}), got {table.via!r}"
            found.append(Problem(text, (*where, "via")))
        elif file.place.get("router", HERE) == name:
            found.append(Problem("the router of the match runs there: leave it out", (*where, "via")))
        elif table.router:
            found.append(Problem("a machine with a router of its own uses that: leave it out", (*where, "via")))
    return found


def machines_of(file: MatchFile, companions: Mapping[str, str]) -> tuple[dict[str, Machine], dict[str, str]]:
    """The machines that a match uses besides the one where it is launched, and where its processes run.

    Args:
        companions: the machine of each companion, where [place] names no other.

    Returns:
        the machines by name, and the machine of each process by the process' name; what is missing runs where the match
        is launched.
    """
    place = {**{player.name: player.machine for player in file.players}, **companions, **file.place}
    place = {process: machine for process, machine in place.items() if machine != HERE}
    used = {HERE, *place.values()}
    used |= {via for name in used if name in file.machines and (via := file.machines[name].via)}
    main = place.get("router", HERE)
    machines = {
        name: Machine(
            host=table.host or "",
            address=table.address,
            vrg=table.vrg,
            display=table.display,
            router=table.router and name != main,
            via=None if table.via == main else table.via,
        )
        for name, table in file.machines.items()
        if name in used
    }
    return machines, place
