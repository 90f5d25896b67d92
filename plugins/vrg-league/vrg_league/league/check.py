"""The judge of a league, for an author: it does with a strategy what a league does."""

from collections.abc import Callable, Sequence
from pathlib import Path

from vrg.bus.stopping import stop_on_signals
from vrg.config.setup import CheckedMatch
from vrg.config.targets import whole_target
from vrg.errors import ConfigError, VrgError
from vrg.games import strategies_of
from vrg_league.conduct import Entrants, opened, workers_of
from vrg_league.contenders import TRIAL, Contender, contenders, unable
from vrg_league.entries import Source, read_entry
from vrg_league.folder import read_records
from vrg_league.games import GameRecord, Pairing
from vrg_league.league.folder import Version, playing, targets
from vrg_league.league.league import failed_games
from vrg_league.standings import ratings


class BrokenOffError(VrgError):
    """A signal has ended a check, so that it is not known whether the entry can play.

    Attributes:
        status: that of a program that the signal ends.
    """

    def __init__(self, number: int) -> None:
        super().__init__("it was broken off before all games were played, so it is not known whether it can play")
        self.status = 128 + number


def check_entry(
    file: Path,
    setup: CheckedMatch,
    league: Path | None,
    place: Path,
    jobs: int,
    *,
    read: Callable[[Source], None],
    tries: Callable[[], None],
    played: Callable[[Sequence[GameRecord] | None], None],
) -> list[str]:
    """Read an entry, let it play alone, and let it play both sides of a game, sealed.

    Args:
        file: that of a strategy, or a folder with one. setup: the match.
        league: the folder of a league against whose leader it plays; None for the strategies that come with the game.
        place: a folder for what is written. jobs: the number of games at a time.
        read: called with the entry. tries: called before it plays alone.
        played: called with the games; None if nothing in the league plays yet, so that there is no opponent.

    Returns:
        what is wrong with it, in words.

    Raises:
        ConfigError: the match or the league cannot be used. LaunchError: no game can be played.
        KeyboardInterrupt: Ctrl-C was pressed before it played a game. BrokenOffError: a signal has ended the games.
    """
    source = read_entry(file)
    if source is None:
        return [f"{file}: expected the file of a strategy, such as mine.py, or a folder with one"]
    if source.problem:
        return [f"it cannot be read: {source.problem}"]
    copy = place / "entry"
    main = source.write(copy)
    read(source)
    try:
        own = Contender(label=source.entry, target=whole_target(str(main)))
    except ConfigError as error:
        return [str(error).replace(f"{copy}/", "")]
    tries()
    if why := unable(setup, [own], jobs, match_time=TRIAL).get(own):
        return [f"it fails alone: {why.problem}".replace(f"{copy}/", "")]
    both = [own, *_opponents(setup, league)]
    own, *others = found = contenders([one.target for one in both], [one.label for one in both])
    if not others:
        played(None)
        return []
    pairings = [Pairing(own.label, other.label) for other in others]
    place /= "games"
    with (
        stop_on_signals() as stop,
        opened(setup, Entrants(found), pairings, place, games=2, play_all=True) as experiment,
    ):
        experiment.run(workers_of(experiment, jobs), stop)
        played(experiment.rows())
        failed = [part.replace(f"{copy}/", "") for part in failed_games(experiment.folder, {own.label})]
        if not failed and not experiment.over and stop.signal is not None:
            raise BrokenOffError(stop.signal)
        return failed


def _opponents(setup: CheckedMatch, league: Path | None) -> list[Contender]:
    """The leader of a league, or else the strategies that come with the game."""
    if league is None:
        return [Contender(label=name, target=name) for name in strategies_of(setup.game)]
    versions = read_records(league / "versions.jsonl", Version)
    known = targets(league, versions)
    current = {version.label for version in playing(versions).values()}
    rows = read_records(league / "games.jsonl", GameRecord)
    rated = [rating.label for rating in ratings(list(known), rows) if rating.label in current]
    return [Contender(label=label.replace(".", " "), target=known[label]) for label in rated[:1]]
