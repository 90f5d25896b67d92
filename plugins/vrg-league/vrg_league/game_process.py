"""One game in its own process.

Each game has a fresh process, so that nothing that a strategy leaves behind in its modules can reach the next game, and
the result of a game does not depend on which games its process has played before. A process that dies takes only its
own game with it. The processes are forked from a server that has loaded VRG, and that has never loaded a strategy.
"""

import contextlib
import os
from collections.abc import Sequence
from functools import reduce
from multiprocessing.connection import Connection, wait
from pathlib import Path

import msgspec
from msgspec import structs

from vrg.config.setup import CheckedMatch
from vrg.errors import LaunchError
from vrg.games import GAMES
from vrg.hal.sim.engines import ENGINES
from vrg.launch.fork_server import ForkServer
from vrg.runs.change import Branch, amended, write_branch
from vrg.runs.run_folder import RunFolder
from vrg_league import playing
from vrg_league.games import FAILED, Played

_NODES = (
    "vrg.hal.sim.node",
    "vrg.coordinator.coordinator",
    "vrg.agents.player",
    "vrg.agents.importing",
    "vrg.agents.radio",
)
"""The modules that every game needs, and that are imported only when its nodes are made or when it lines up."""
_RESULT_SIZE = 10_000_000
"""The number of bytes that a result may have."""
EXIT_TIMEOUT = 2.0
"""The real time in s that a process may need to end when its game has ended."""


def server_for(game: str, engine: str, *modules: str) -> ForkServer:
    """A server that forks the processes of games, and has loaded what a game and an engine need. It is to be closed.

    Args:
        modules: further ones that it loads.
    """
    # With a thread for each core in each process, the linear algebra of one game would slow the others.
    for library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    server = ForkServer()
    rules = GAMES.get(game).rules.partition(":")[0]
    server.start([playing.__name__, rules, ENGINES.get(engine).__module__, *_NODES, *modules])
    return server


class GameProcess:
    """A game that is being played, and then judged again in another process, in which no strategy has been.

    Args:
        server: what forks its processes. setup: its match. seed: the seed in place of that of the match.
        folder: for its journal and its logs. limit: the match time in s after which it is broken off.
        branch: the recorded match that is taken up, and how it goes on; None plays the match from its beginning.
        shows: True writes what shows it to people.

    Attributes:
        folder: as given. answer: it can be read when one of the processes has ended.

    Raises:
        LaunchError: no process can be started.
    """

    def __init__(
        self,
        server: ForkServer,
        setup: CheckedMatch,
        seed: int,
        folder: Path,
        limit: float,
        branch: Branch | None = None,
        *,
        shows: bool = False,
    ) -> None:
        self.folder, self._branch, self._shows = folder, branch, shows
        self._server, self._limit = server, limit
        self._setup = structs.replace(setup, seed=seed) if branch is None else setup
        self._told: Played | None = None
        goes_on = setup if branch is None else reduce(amended, branch.changes, setup)
        self._begin(apart=decides_apart(setup) or decides_apart(goes_on))

    def _begin(self, *, apart: bool) -> None:
        arguments = [
            str(self.folder.absolute()),
            str(self._limit),
            *(["apart"] if apart else []),
            *(["shown"] if self._shows else []),
        ]
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            if self._branch is not None:
                write_branch(RunFolder(self.folder), self._branch)
            with (self.folder / "process.log").open("ab") as log:
                self._process = self._server.run(playing.__name__, arguments, log, trusted=not apart)
        except OSError as error:
            raise LaunchError(f"{self.folder}: no game can be played: {error}") from error
        self.answer = Connection(self._process.detached())
        with contextlib.suppress(OSError):  # `result` tells of a process that has ended
            self.answer.send_bytes(msgspec.json.encode((self._setup, self._told)))

    def result(self) -> Played | None:
        """The result of the game, once `answer` can be read; None if it is now judged, and another result will
        follow."""
        problem = ""
        try:
            # A strategy may have written to this pipe, too: what comes is checked, and nothing in it is run.
            result = msgspec.json.decode(self.answer.recv_bytes(_RESULT_SIZE), type=Played)
            # A thread that a strategy has left behind may keep the process from ending.
            self._process.wait(EXIT_TIMEOUT)
        except EOFError:
            self._process.wait(EXIT_TIMEOUT)
            problem = f"the process of the game has ended with status {self._process.poll()}"
        except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            problem = f"the process of the game has sent an invalid answer: {error}"
        self.kill()
        if problem and self._told is not None:
            return playing.invalid(self._setup, self._told, f"its record cannot be judged: {problem}")
        if problem:
            return Played(ended=FAILED, problem=problem)
        if self._told is None and result.ended != FAILED:
            self._told = result
            self._begin(apart=False)
            return None
        return result

    def kill(self) -> None:
        """End the game now. Idempotent."""
        self.answer.close()
        self._process.kill()
        self._process.wait(EXIT_TIMEOUT)


def decides_apart(setup: CheckedMatch) -> bool:
    """True if a strategy of a match decides in its own process when games of it are played, by default sealed.

    It does if it is a file, and nobody has said `--no-sandbox`, by which it is trusted.
    """
    return any(setup.sandboxed(player.name, seats=True) for player in setup.players)


def ended(games: Sequence[GameProcess], timeout: float) -> list[tuple[GameProcess, Played]]:
    """Wait at most `timeout` seconds for one of these games to end, and return those that have, with their results."""
    ready = wait([game.answer for game in games], timeout)
    return [(game, found) for game in games if game.answer in ready and (found := game.result()) is not None]
