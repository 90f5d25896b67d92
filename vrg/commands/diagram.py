"""The command `vrg diagram`, which prints the automaton of a player as Mermaid."""

from typing import Annotated

import typer

from vrg.agents.diagram import mermaid
from vrg.config.loading import load_match, match_path
from vrg.launch.nodes import strategy_of


def diagram(
    game: Annotated[str, typer.Argument(metavar="GAME|match.toml", help="Game or match file of the player.")],
    player: Annotated[str | None, typer.Option(help="Name of the player; the default is the first one.")] = None,
) -> None:
    """Print the statechart of a player as Mermaid."""
    setup = load_match(match_path(game))
    name = player or setup.players[0].name
    strategy = strategy_of(setup, name)
    agent = getattr(strategy, "agent", None)
    if agent is None:
        raise typer.BadParameter(f"{name}'s strategy, {type(strategy).__name__}, is no automaton")
    typer.echo(mermaid(agent()), nl=False)
