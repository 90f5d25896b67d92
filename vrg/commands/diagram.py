"""`vrg diagram GAME`: the players' automaton as Mermaid."""

from typing import Annotated

import typer

from vrg.agents.diagram import mermaid
from vrg.config import load_match, match_path


def diagram(
    game: Annotated[str, typer.Argument(metavar="GAME|match.toml", help="Whose players.")],
    player: Annotated[str | None, typer.Option(help="Of a match file; the first if missing.")] = None,
) -> None:
    """Print the statechart of a player as Mermaid."""
    setup = load_match(match_path(game))
    name = player or setup.file.players[0].name
    strategy = setup.strategy(name)
    agent = getattr(strategy, "agent", None)
    if agent is None:
        raise typer.BadParameter(f"{name}'s strategy, {type(strategy).__name__}, is no automaton")
    typer.echo(mermaid(agent()), nl=False)
