"""A game on another computer of a cluster: what is sent there, what is done there, and what comes back.

This module knows nothing of the cluster. Whoever works there is only asked to run `play`, which plays the game in a
process of its own, as on this computer: a strategy that ends its process, or hangs, does not harm the worker.
"""

import contextlib
import functools
import tempfile
from collections.abc import Callable
from pathlib import Path

from msgspec import Struct

from vrg.config.loading import load_match
from vrg.errors import LaunchError
from vrg.evaluation.experiment import code_of_vrg
from vrg.evaluation.game_process import GameProcess, ended, server_for
from vrg.evaluation.games import Played
from vrg.evaluation.parcel import packed, unpack
from vrg.launch.fork_server import ForkServer
from vrg.launch.run_folder import RunFolder

_LOOK = 0.2
"""The real time in s between two moments in which a game can be ended."""


class Task(Struct, frozen=True, kw_only=True):
    """A game to be played.

    Args:
        name: the name of the game's folder. seed: the seed of the match.
        limit: the match time in s after which it is broken off.
        code: the SHA-256 of the code of VRG that the worker must have.
    """

    name: str
    seed: int
    limit: float
    code: str


class Answer(Struct, frozen=True, kw_only=True):
    """What comes back.

    Args:
        played: what came out of the game. logs: what it has written, if something has failed; empty otherwise.
    """

    played: Played
    logs: bytes = b""


def play(task: Task, match: bytes, go_on: Callable[[], bool] = lambda: True) -> Answer:
    """Play a game on this computer, and leave nothing behind.

    Args:
        match: the folder with its match file, packed.
        go_on: asked a few times a second; if it returns False, or raises an exception, the game is ended.

    Raises:
        LaunchError: this computer has another release of VRG, or cannot write files, or the game was ended.
        ConfigError: the match cannot be loaded here, for example because a package is missing.
    """
    if task.code != _own_code():
        raise LaunchError("a worker of the cluster has another release of VRG: install this one on every computer")
    with tempfile.TemporaryDirectory(prefix="vrg-", ignore_cleanup_errors=True) as place:
        base, folder = Path(place, "match"), Path(place, task.name)
        unpack(match, base)
        setup = load_match(RunFolder(base).match_file)
        game = GameProcess(_server(setup.game, setup.engine, base), setup, task.seed, folder, task.limit)
        with contextlib.ExitStack() as stack:
            stack.callback(game.kill)
            while not (found := ended([game], _LOOK)):
                if not go_on():
                    raise LaunchError(f"{task.name}: the game was ended")
            stack.pop_all()
        [(_, result)] = found
        failed = result.failures or result.problem
        return Answer(played=result, logs=packed(folder) if failed and folder.exists() else b"")


@functools.cache
def _own_code() -> str:
    return code_of_vrg()


_servers: dict[tuple[str, str], ForkServer] = {}


def _server(game: str, engine: str, base: Path) -> ForkServer:
    """The server of processes for a game and an engine. It is made once, as it loads what they need."""
    key = game, engine
    if key not in _servers:
        _servers[key] = server_for(load_match(RunFolder(base).match_file))
    return _servers[key]
