"""`vrg class final`: the best of a class play a bracket, as a show."""

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from vrg.api import played_by
from vrg.commands.options import make_console
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.files import write_whole
from vrg.launch.folder_lock import owned
from vrg.playing.by_command import play_file
from vrg.toml_text import with_value
from vrg_class.bracket import first_round, next_round
from vrg_class.command import FolderArgument
from vrg_class.folder import ClassFolder, folder_name
from vrg_class.league import ClassLeague
from vrg_class.tries import teams_of


def final(
    folder: FolderArgument = Path("class"),
    match: Annotated[
        str | None, typer.Option(help="A match file to play on, such as one with physical robots; else the league's.")
    ] = None,
    places: Annotated[int, typer.Option(min=2, max=32, help="How many of the leaderboard take part.")] = 8,
    show: Annotated[
        list[str] | None, typer.Option(help="As for `vrg play`, such as web or 3d; may be given several times.")
    ] = None,
    lockstep: Annotated[bool, typer.Option("--lockstep", help="Play without windows, as fast as possible.")] = False,
    sandbox: Annotated[bool, typer.Option(help="Shut the players' code in.")] = True,
) -> None:
    """Let the best of the class play a bracket: the first against the last, and so on, until one is left.

    Each match is played like `vrg play`, in a window, with the referee's calls in the terminal; where the teams have
    other roles, each pair plays two, with sides changed. A draw is for the one with the higher place. The runs are in
    FOLDER/final.
    """
    place = ClassFolder(folder)
    with owned(place.path / "final"):
        _play(place, match, places, show or (), lockstep=lockstep, sandbox=sandbox)


def _play(
    place: ClassFolder, match: str | None, places: int, show: Sequence[str], *, lockstep: bool, sandbox: bool
) -> None:
    console = make_console()
    league = ClassLeague(place, place.about.match)
    best = [str(row["name"]) for row in league.board if row["games"]][:places]
    if len(best) < 2:
        raise ConfigError(
            f"{place.path}: expected two in the leaderboard, found {len(best)}: let the league play first"
        )
    base = match or place.about.match
    # By the versions that have earned their places.
    files = {name: str(league.files[name]) for name in best}
    options = [
        "--sandbox" if sandbox else "--no-sandbox",
        *(word for one in show for word in (["--web"] if one == "web" else ["--show", one])),
    ]
    options += ["--lockstep", "--headless", "--engine", "planar"] if lockstep else []
    number, pairs = 1, first_round(best)
    while pairs:
        console.print(f"[bold]Round {number}[/bold]: {', '.join(str(pair) for pair in pairs)}", soft_wrap=True)
        winners = []
        for index, pair in enumerate(pairs, 1):
            winner = pair.first
            if pair.second is not None:
                wins: Counter[str | None] = Counter()
                for leg, sides in enumerate(_legs(base, pair.first, pair.second), 1):
                    path = place.path / "final" / f"round-{number}-{index}-{leg}.toml"
                    _write(path, base, "-against-".join(map(folder_name, sides)), *(files[name] for name in sides))
                    wins[_played(path, sides, options, console)] += 1
                winner = pair.second if wins[pair.second] > wins[pair.first] else pair.first
                console.print(f"{winner} goes on", markup=False)
            winners.append(winner)
        number, pairs = number + 1, next_round(winners, best)
    console.print(f"[bold]{winners[0]} wins the class[/bold]")


def _legs(base: str, first: str, second: str) -> list[tuple[str, str]]:
    """Who plays for the two teams of a match: in two matches if the teams have different roles.

    Raises:
        ConfigError: the match cannot be used, or is not one of two teams.
    """
    setup = load_match(match_path(base))
    teams = teams_of(setup)
    if len(teams) != 2:
        raise ConfigError(f"{base}: expected a match of two teams, got {', '.join(teams)}")
    roles = [Counter(player.role for player in setup.players if player.team == team) for team in teams]
    return [(first, second)] if roles[0] == roles[1] else [(first, second), (second, first)]


def _write(path: Path, base: str, name: str, first: str, second: str) -> None:
    """Write the match of two players; its name tells who they are.

    Raises:
        ConfigError: the match or a player cannot be used.
    """
    setup = load_match(match_path(base))
    played = played_by(setup, dict(zip(teams_of(setup), (first, second), strict=True)))
    text = with_value(played.text, ("name",), name)
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    write_whole(path, text.encode())


def _played(path: Path, sides: tuple[str, str], options: Sequence[str], console: Any) -> str | None:
    """Play a match between those who play for its two teams; the name of its winner, None for a draw.

    One that was broken off is played again if the teacher wants it, and is a draw otherwise.

    Args:
        options: further ones of `vrg play`.

    Raises:
        LaunchError: it did not come to its end.
    """
    console.print(f"[bold]{' against '.join(sides)}[/bold]")
    run = play_file(path, path.parent / "runs", options)
    result = run.result
    if (
        result["winner"] is None
        and sys.stdin.isatty()
        and typer.confirm(f"The match was broken off ({result['ended']}). Play it again?")
    ):
        return _played(path, sides, options, console)
    teams = teams_of(run.setup)
    name = dict(zip(teams, sides, strict=True)).get(result["winner"])
    why = next((call["why"] for call in reversed(result["calls"]) if call.get("why")), "")
    outcome = "a draw" if name is None else f"{name} wins"
    console.print(f"{outcome}{f': {why}' if why else ''}", soft_wrap=True, markup=False)
    return name
