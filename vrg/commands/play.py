"""The commands `vrg play`, which plays a match, and `vrg check`, which checks a match file."""

import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from vrg.commands.groups import PlayOptions
from vrg.commands.options import GameArgument
from vrg.launch.fork_server import fork_server

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup


def check(match: GameArgument) -> None:
    """Say whether a match file can be played, or what is wrong with it."""
    from vrg.config.loading import (  # `vrg play` must start quickly
        check_strategies,
        idle_machines,
        load_match,
        match_path,
        unverified_properties,
    )
    from vrg.config.rules import rulebook_of
    from vrg.hal.sim.engines import check_installed
    from vrg.playing.match import undriven
    from vrg.playing.trial import trial, untried

    setup = load_match(match_path(match))
    if "world" not in setup.place:
        check_installed(setup.engine)
    with trial() as tried:
        check_strategies(setup, tried.make)
    book = rulebook_of(setup)
    rounds = "1 round" if book.rounds == 1 else f"{book.rounds} rounds"
    players = "1 player" if len(setup.players) == 1 else f"{len(setup.players)} players"
    typer.echo(f"{match}: can be played: {setup.game}, {players}, {rounds}, map {setup.map}")
    for remark in unverified_properties(setup):
        typer.echo(f"not proved: {remark}")
    for note in filter(None, (idle_machines(setup), untried(), *undriven(setup), _unwritten(setup))):
        typer.echo(f"note: {note}")


def _unwritten(setup: "MatchSetup") -> str | None:
    """The names of a match that windows cannot show, in words; None if there are none."""
    from vrg.ui.letters import PACKAGE, unwritten

    names = unwritten([setup.name, *(player.name for player in setup.players)])
    if not names:
        return None
    return (
        f"no font of this machine has the letters of {', '.join(names)}, so windows and plots show boxes: install one, "
        f"such as the package {PACKAGE}"
    )


def play(match: GameArgument, options: PlayOptions) -> None:
    """Play a match, show it, and say who won and where the run is recorded."""
    options.check()
    # The fork server loads what the match's processes need while this process loads the code that checks match files.
    with fork_server(wanted=not (options.in_process or options.dry_run)) as server:
        from vrg.commands.playing import play_match, wants_replay

        played = play_match(match, options, server)
    if played is None:
        return
    _print_next(played[0].path)
    if wants_replay(played[0]):
        from vrg.playing.replay import replay_window
        from vrg.ui.window.replay import show

        show(replay_window(*played, runs=options.runs))


def _print_next(run: Path) -> None:
    """Print what somebody may want to do after a match, as commands for this shell."""
    found = shutil.which("vrg")
    # Windows leaves the ending of a program's name out.
    command = "vrg" if found and Path(found).with_suffix("") == Path(sys.argv[0]).absolute() else sys.argv[0]
    rest = {
        f"run why {run}": "the calls of the referee; with --call N the rule and the number that decided one",
        f"run replay {run}": "watch it again, at any speed",
        "practice": "drive a robot by hand; practice mine.py:Mine lets your own player drive it",
    }
    width = max(map(len, rest))
    typer.echo("Next:")
    for words, why in rest.items():
        typer.echo(f"    {command} {words:<{width}}  {why}")
