"""The comparison of two strategies as a function, for programs and notebooks: `vrg_league.compare`."""

import logging
from pathlib import Path

from vrg.bus.stopping import StopSignal, stop_on_signals
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg_league.comparison import Comparison
from vrg_league.conduct import enter, opened, workers_of

log = logging.getLogger(__name__)


def compare(
    first: str | Path,
    second: str | Path,
    *,
    match: str | Path,
    games: int = 200,
    seed: int = 0,
    engine: str | None = None,
    jobs: int | None = None,
    confidence: float = 0.95,
    sandbox: bool | None = None,
    output: str | Path | None = None,
    stop: StopSignal | None = None,
) -> Comparison:
    """Let two strategies play many games, each seed twice with the sides swapped, until one is shown to be better.

    The games are kept: the same call goes on where another one was broken off.

    Args:
        first, second: a name, `mine.py`, `mine.py:Class`, `module:Class` or `policy.npz`.
        match: a match file, or the name of a game, of two teams.
        games: the most games, 1 or more; an odd number is rounded up. seed: of the first pair of games.
        engine: the physics engine; None for `planar`. jobs: games at a time; None for one for each core.
        confidence: of the interval, 0.5 to 0.9999.
        sandbox: whether strategies that are files are sealed in their processes; None for the match's own choice.
        output: the folder of the games; None for one in `runs` that belongs to these strategies, match and seed.
        stop: what breaks it off when it is set, such as a `threading.Event`. What is returned tells of the games that
            were played.

    Raises:
        ConfigError: the match, a strategy or a number cannot be used, or the folder has other games.
        LaunchError: the folder cannot be written, or no game can be played.
        KeyboardInterrupt: it was broken off by Ctrl-C, which only the main thread hears.
    """
    for name, number, least in (("games", games, 1), ("seed", seed, 0), ("jobs", 1 if jobs is None else jobs, 1)):
        if not isinstance(number, int) or number < least:
            raise ConfigError([f"{name}: expected a whole number of at least {least}, got {number!r}"])
    if not isinstance(confidence, float) or not 0.5 <= confidence <= 0.9999:
        raise ConfigError([f"confidence: expected a number from 0.5 to 0.9999, got {confidence!r}"])
    setup = load_match(match_path(str(match)), engine=engine or "planar", sandbox=sandbox)
    entrants = enter([str(first), str(second)], setup, jobs=jobs, warn=log.warning)
    folder = "compare" if output is None else Path(output)
    with (
        stop_on_signals(stop) as ends,
        opened(
            setup, entrants, entrants.pairings(), folder, games=games, seed=seed, confidence=confidence
        ) as experiment,
    ):
        if not experiment.over:
            experiment.run(workers_of(experiment, jobs), ends)
        found = Comparison(experiment, confidence)
        found.write()
    if ends.is_set() and not (stop is not None and stop.is_set()):
        raise KeyboardInterrupt(f"the games are kept in {found.path}")
    return found
