"""The plan of `vrg play --dry-run`: which process of a match would run where, and what would travel there."""

from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from vrg.config.files import HERE
from vrg.config.loading import idle_machines
from vrg.config.setup import CheckedMatch
from vrg.kinds import WEB
from vrg.launch.plan import planned
from vrg.launch.process import Process
from vrg.runs.keeping import files_of


def print_plan(setup: CheckedMatch, console: Console, *, window: bool, record: bool, web: bool = False) -> None:
    """Print it.

    Args:
        window: True if the spectator would be opened. record: True if the recorder would run.
        web: True if the page would be served.
    """
    views = [Process(name=WEB.process, kind=WEB.name)] if web else []
    processes = list(planned(setup, window=window, record=record, views=views))
    players = {player.name: player for player in setup.players}
    grid = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    for name in ("machine", "host", "process", "what it runs"):
        grid.add_column(name)
    for machine in (HERE, *setup.hosts):
        host = setup.hosts[machine].host if machine in setup.hosts else "this machine"
        first = True
        for process in (one.name for one in processes if one.machine == machine):
            player = players.get(process)
            what = "" if player is None else f"{player.role}, {player.backend}, {player.strategy}"
            shown = (machine, host) if first else ("", "")
            grid.add_row(*map(escape, (*shown, process, what)))
            first = False
    console.print(f"{setup.name}: nothing is started", soft_wrap=True)
    console.print(grid)
    if idle := idle_machines(setup):
        console.print(f"[yellow]{escape(idle)}[/yellow]", soft_wrap=True)
    if setup.hosts:
        copies = files_of(setup).copies
        files = ", ".join(["match.toml", *(Path(place).as_posix() for place in copies)])
        console.print(f"travels to {', '.join(setup.hosts)}: {files}", soft_wrap=True)
