"""The conduct of an experiment: strategies enter it, those that cannot play are left out, and the games are played."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError
from vrg.launch.fork_server import cores
from vrg.launch.sandbox import seal
from vrg_league import contenders
from vrg_league.contenders import Contender, LeftOut
from vrg_league.experiment import Origin, define
from vrg_league.folder import ExperimentFolder
from vrg_league.game_process import decides_apart
from vrg_league.games import LIMIT, Pairing
from vrg_league.running import Experiment
from vrg_league.series import Series
from vrg_league.workers import WORKERS, Workers


class Entrants(NamedTuple):
    """The strategies that play, and those that take no part."""

    playing: list[Contender]
    left_out: Sequence[LeftOut] = ()

    def pairings(self, *, mirror: bool = False) -> list[Pairing]:
        """Each strategy against each other one, and with `mirror` against itself, too."""
        labels = [contender.label for contender in self.playing]
        return [Pairing(a, b) for i, a in enumerate(labels) for b in labels[i if mirror else i + 1 :]]


def enter(
    targets: Sequence[str],
    setup: CheckedMatch,
    *,
    jobs: int | None,
    warn: Callable[[str], None],
    tries: Callable[[int], None] = lambda _: None,
    teams: Sequence[str] | None = None,
    leave_out: bool = False,
) -> Entrants:
    """Find strategies, and let them try whether they can play.

    Args:
        targets: the strategies as they were typed. jobs: the number of trials at a time; None for one for each core.
        warn: called with what a person must know, in words.
        tries: called with the number of strategies before these play TRIAL s alone, which they do with `leave_out`.
        teams: those for which they play; None for both.
        leave_out: True takes folders of strategies, too, and leaves out what cannot play, or fails in a trial.

    Raises:
        ConfigError: a strategy cannot be used where none may be left out, or too few are left.
        LaunchError: no game can be played.
    """
    teams = teams or contenders.teams_of(setup)
    found, missing = contenders.entered(targets, folders=leave_out)
    _check_number(found, missing, targets, leave_out=leave_out)
    playing = [contenders.with_strategies(setup, dict.fromkeys(teams, contender.target)) for contender in found]
    if (lacking := seal.missing()) is not None and any(map(decides_apart, playing)):
        if setup.sandbox:
            raise ConfigError([f"--sandbox, or `sandbox = true`: {lacking}"])
        warning = f"the code of strategies is not sandboxed, and can do all that you can: {lacking}"
        if any(Path(target).is_dir() for target in targets):
            raise ConfigError([f"{warning}; --no-sandbox lets the files of a folder play anyway"])
        warn(warning)
    if leave_out:
        tries(len(found))
    lasting = contenders.TRIAL if leave_out else 0.0
    unable = contenders.unable(setup, found, jobs or cores(), match_time=lasting, teams=teams)
    missing += [contenders.left_out(contender.label, why.problem) for contender, why in unable.items()]
    found = [contender for contender in found if contender not in unable]
    _check_number(found, missing, targets, leave_out=leave_out)
    return Entrants(found, missing)


def _check_number(
    found: Sequence[Contender], missing: Sequence[LeftOut], typed: Sequence[str], *, leave_out: bool
) -> None:
    """Check that enough strategies are there to play.

    Raises:
        ConfigError: there are not, or one cannot play where none may be left out.
    """
    if missing and not leave_out:
        raise ConfigError(list(dict.fromkeys(why for _, why in missing)))
    different = len({contender.target for contender in found})
    if different < (2 if leave_out else 1):
        expected = f"expected two or more different strategies, found {different} in {' '.join(typed)}"
        raise ConfigError([*(f"{own}: {why}" for own, why in missing), expected])


@contextmanager
def opened(
    setup: CheckedMatch,
    entrants: Entrants,
    pairings: Sequence[Pairing],
    folder: Path | str,
    *,
    games: int,
    seed: int = 0,
    confidence: float = 0.95,
    play_all: bool = False,
    limit: float = LIMIT,
    origin: Origin | None = None,
) -> Iterator[Experiment]:
    """An experiment in its folder, which no other process can use meanwhile, with the games that are there already.

    Args:
        folder: a path, or the beginning of a name below `runs`, to which what belongs to this experiment is added.
        games: the most games of a pairing; an odd number is rounded up. seed: that of the first pair of games.
        confidence: of the intervals. play_all: True plays all games, even if a difference was found before.
        limit: the match time in s after which a game is broken off.
        origin: the instant from which the games go on; None for the beginning.

    Raises:
        ConfigError: the match or a strategy cannot be used, or the folder is that of another experiment.
        LaunchError: the folder cannot be used.
    """
    definition = define(setup, entrants.playing, seed=seed, limit=limit, origin=origin)
    series = {pairing: Series((games + 1) // 2, confidence, play_all=play_all) for pairing in pairings}
    path = folder if isinstance(folder, Path) else Path("runs") / f"{folder}-{definition.digest}"
    with ExperimentFolder(path, definition) as open_folder:
        yield Experiment(open_folder, setup, series, entrants.left_out)


def workers_of(experiment: Experiment, jobs: int | None, ray: str | None = None) -> Workers:
    """What plays the games of an experiment.

    Args:
        jobs: the number of games at a time; None for as many as there are cores.
        ray: the address of a cluster of Ray, on which they are played; None plays them here.

    Raises:
        ConfigError: nothing that is installed plays games there. LaunchError: the cluster cannot be used.
    """
    if ray is not None:
        return WORKERS.get("ray").at(ray, jobs, cores(), experiment.folder)
    return Workers(jobs or cores(), experiment.folder, experiment.setup)
