"""A match that is over in a moment, strategies that play it in all kinds of ways, and experiments of these."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from msgspec import structs

from vrg.config.loading import load_match
from vrg_league.conduct import Entrants, opened
from vrg_league.contenders import contenders
from vrg_league.experiment import Definition, define
from vrg_league.games import GameRecord
from vrg_league.running import Experiment

MATCH = """\
name = "tiny"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
lasers = false

[rules]
x = [-3.0, 3.0]
y = [-4.0, 4.0]
zone_depth = 1.5
passes = 1
pass_limit = 20.0
lineup = "place"
slowest = 0.9

[[players]]
name = "shark"
role = "shark"
x = 0.0
y = -3.2
heading = 90.0

[[players]]
name = "ann"
role = "minnow"
x = -1.8
y = 3.2
heading = -90.0

[[players]]
name = "bob"  # it has one of its own, which is replaced
role = "minnow"
strategy = "sharks-and-minnows"
x = 1.8
y = 3.2
heading = -90.0
"""
PLAYERS = """
import os

from vrg.agents import STILL, Strategy, Twist
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer

played = []


class Lazy(Strategy):
    def act(self, view):
        return STILL


class Ahead(Strategy):
    def act(self, view):
        print("ahead")
        return Twist(v=0.7, w=0.0)


class Raises(Strategy):
    def act(self, view):
        raise ValueError("no idea")


class Dies(Strategy):
    def act(self, view):
        os._exit(0)


class Remembers(SharksAndMinnowsPlayer):
    def __init__(self, name, robot):
        super().__init__(name, robot)
        played.append(name)

    def act(self, view):
        return STILL if len(played) > 2 else super().act(view)
"""


OWN = "from vrg.agents import STILL, Strategy, Twist\n\n\nclass Mine(Strategy):\n    def act(self, view):\n        "
"""The beginning of the file of a strategy, up to what it returns."""


def match_in(folder: Path) -> Path:
    """The match file, with `players.py` beside it."""
    file = folder / "tiny.toml"
    file.write_text(MATCH, encoding="utf-8")
    (folder / "players.py").write_text(PLAYERS, encoding="utf-8")
    return file


def unsealed(match: Path) -> None:
    """Let the strategies of a match be played in the process of the game, which takes half the time."""
    match.write_text(MATCH.replace("lasers = false", "lasers = false\nsandbox = false"), encoding="utf-8")


@pytest.fixture
def match(tmp_path: Path) -> Path:
    return match_in(tmp_path)


def alive(processes: Iterable[psutil.Process]) -> bool:
    """Whether one of these runs."""
    running = {p for p in psutil.process_iter(["status"]) if p.info["status"] != psutil.STATUS_ZOMBIE}
    return not running.isdisjoint(processes)


class Never:
    """A stop signal that is not set."""

    def is_set(self) -> bool:
        return False

    def wait(self, timeout: float) -> bool:
        return False


def definition(match: Path, seed: int, *names: str, limit: float = 3600.0) -> Definition:
    """An experiment of two strategies."""
    return define(load_match(match), contenders([target(match, name) for name in names]), seed=seed, limit=limit)


@contextmanager
def experiment(
    match: Path, first: str, second: str, out: str, *, pairs: int, seed: int, limit: float = 3600.0
) -> Iterator[Experiment]:
    """An experiment of two strategies in a folder of its own, in which all games are to be played."""
    both = Entrants(contenders([target(match, first), target(match, second)]))
    folder, games = match.parent / out, 2 * pairs
    with opened(
        load_match(match), both, both.pairings(), folder, games=games, seed=seed, play_all=True, limit=limit
    ) as running:
        yield running


Play = Callable[..., list[GameRecord]]
"""Plays a comparison; see the fixture `play`."""


def target(match: Path, name: str) -> str:
    """A strategy of `players.py` with its whole path; a registered one as it is."""
    return name if name == "sharks-and-minnows" else f"{match.parent / 'players.py'}:{name}"


def timeless(rows: list[GameRecord]) -> list[GameRecord]:
    """The same without the real time that each game, and the code of its players, took."""
    return [structs.replace(row, played=structs.replace(row.played, wall_time=0.0, thinking={})) for row in rows]


def with_vrg() -> dict[str, str]:
    """The environment variables of a shell in which `vrg` is the command of this Python."""
    return os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"}
