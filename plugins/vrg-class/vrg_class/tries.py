"""The queue of tries: as many at a time as there are processors, each in processes of its own, students in turn.

As many again are played for those who have waited for a while: a picture that comes soon is worth more than an end that
does.
"""

import asyncio
import contextlib
import logging
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

import msgspec

from vrg.api import played_by
from vrg.config.loading import load_match, match_path
from vrg.config.setup import CheckedMatch, MatchSetup
from vrg.errors import VrgError
from vrg.launch.fork_server import Child
from vrg.ui.web.parts import encode
from vrg_class import trial
from vrg_class.faults import fault_of
from vrg_class.folder import CODE
from vrg_class.trial import TrialSpec
from vrg_league.game_process import server_for

LONGEST: Final = 40.0
"""The real time in s that a try may take."""
FAIR: Final = 8.0
"""The real time in s that a try may take while others wait."""
LONG: Final = 3.0
"""The real time in s after which a try is a long one: the next ones of its student leave a place to others."""
SOON: Final = 0.8
"""The real time in s after which a try that waits is played beside those that have a processor."""
_LOOKED: Final = 0.5
"""The real time in s between two looks at how long a try takes."""
REPORTED: Final = 8_000_000
"""The number of bytes that a try may report."""
_MESSAGE: Final = 1_000_000
"""The number of bytes of a message of a try."""
log = logging.getLogger(__name__)


@dataclass(eq=False)
class Try:
    """A try of a student.

    Args:
        owner: who has asked for it; a further one of the same owner replaces it.
        match: the match file, or the name of a game. players: the strategies by team or player. team: the own team.
        goal: of the step; None without one. seconds: the match time of the try, s.
        tell: called on the server's loop with messages, texts of JSON.

    Attributes:
        messages: what it has reported. slow: others wait for a processor while it is played.
    """

    owner: str
    match: str
    players: dict[str, str]
    team: str
    goal: dict[str, Any] | None
    seconds: float
    tell: Callable[[str], None]
    messages: list[str] = field(default_factory=list)
    slow: bool = False
    _asked: float = 0.0
    _child: Child | None = None
    _began: float = 0.0
    _dropped: bool = False
    _late: bool = False

    def add(self, text: str) -> None:
        """Take in a message of its process; on the server's loop."""
        if not self._dropped:
            self.messages.append(text)
            self.tell(text)

    def drop(self) -> None:
        """End it; nothing is heard of it any more. Idempotent."""
        self._dropped = True
        if self._child is not None:
            self._child.kill()


class Tries:
    """The queue of tries. All methods are for the server's loop.

    Args:
        jobs: the number of tries at a time. game, engine: what most tries need, which is loaded before.
        sealed: False lets the code do all that this process can.
    """

    def __init__(self, jobs: int, game: str, engine: str, *, sealed: bool) -> None:
        self.jobs, self.sealed = jobs, sealed
        self.halted = False
        self._waiting: deque[Try] = deque()
        self._long: set[str] = set()
        self._running: set[Try] = set()
        self._server, self._turn = (
            server_for(game, engine, trial.__name__, "vrg.playing.strategy_process"),
            threading.Lock(),
        )
        self._tasks: set[asyncio.Task[None]] = set()
        self._threads = ThreadPoolExecutor(2 * jobs)

    @property
    def busy(self) -> int:
        """The number of tries that run or wait."""
        return len(self._running) + len(self._waiting)

    def ask(self, wanted: Try) -> int:
        """Put a try into the queue, in place of another one of its owner; the number of those before it."""
        for other in [*self._waiting, *self._running]:
            if other.owner == wanted.owner:
                self._leave(other)
        wanted._asked = time.monotonic()
        self._waiting.append(wanted)
        self._go_on()
        return self._waiting.index(wanted) + 1 if wanted in self._waiting else 0

    def halt(self, *, halted: bool) -> None:
        """Start no try any more, or start them again."""
        self.halted = halted
        self._go_on()

    def close(self) -> None:
        """End all tries."""
        for one in [*self._waiting, *self._running]:
            self._leave(one)
        self._server.close()

    def _leave(self, one: Try) -> None:
        one.drop()
        with contextlib.suppress(ValueError):
            self._waiting.remove(one)

    def _go_on(self) -> None:
        while not self.halted and (one := self._next()) is not None:
            self._waiting.remove(one)
            self._running.add(one)
            task = asyncio.get_running_loop().create_task(self._played(one))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        for place, one in enumerate(self._waiting, 1):
            one.tell(encode({"t": "queue", "place": place}))

    def _next(self) -> Try | None:
        """The try that begins now. Those of students whose last one was long never take the last place."""
        now, running = time.monotonic(), len(self._running)
        long = sum(one.owner in self._long for one in self._running)
        for one in self._waiting:
            places = self.jobs if now - one._asked < SOON else 2 * self.jobs
            if running < places and (one.owner not in self._long or long < max(1, self.jobs - 1)):
                return one
        return None

    async def _played(self, one: Try) -> None:
        loop = asyncio.get_running_loop()

        def add(text: str) -> None:
            loop.call_soon_threadsafe(one.add, text)

        try:
            playing = loop.run_in_executor(self._threads, self._play, one, add)
            while not (await asyncio.wait([playing], timeout=_LOOKED))[0]:
                if self._next() is not None:
                    self._go_on()
                one.slow = self.busy > self.jobs
                if one._child is not None and time.monotonic() - one._began > (FAIR if one.slow else LONGEST):
                    one._late = True
                    await loop.run_in_executor(None, self._kill, one._child)
            await playing
        except VrgError as error:
            loop.call_soon(one.add, encode({"t": "error", **msgspec.to_builtins(fault_of(str(error), CODE))}))
            loop.call_soon(one.add, ended(""))
        except Exception:  # one try that fails must not keep others from being played
            log.exception("a try has failed")
            loop.call_soon(one.add, ended("failed"))
        finally:
            was_long = one._child is not None and time.monotonic() - one._began > LONG
            (self._long.add if was_long else self._long.discard)(one.owner)
            self._running.discard(one)
            self._go_on()

    def _play(self, one: Try, add: Callable[[str], None]) -> None:
        """Play a try, on its own thread.

        Raises:
            VrgError: it cannot be played.
        """
        with tempfile.TemporaryDirectory(prefix="vrg-try-", ignore_cleanup_errors=True) as place:
            self._play_in(Path(place), one, add)

    def _play_in(self, place: Path, one: Try, add: Callable[[str], None]) -> None:
        setup = setup_of(one.match, one.players)
        spec = TrialSpec(
            setup=setup, team=one.team or setup.players[0].team, goal=one.goal, seconds=one.seconds,
            sealed=self.sealed,
        )  # fmt: skip
        with (place / "process.log").open("ab") as output, self._turn:
            child = self._server.run(trial.__name__, [str(place / "run")], output)
        one._began, one._child = time.monotonic(), child
        if one._dropped:
            child.kill()
        complete = False
        try:
            with Connection(child.detached()) as pipe:
                pipe.send_bytes(msgspec.json.encode(spec))
                size = 0
                while size < REPORTED:
                    data = pipe.recv_bytes(_MESSAGE)
                    size += len(data)
                    text = data.decode()
                    complete |= trial.kind_of(text) == "end"
                    add(text)
        except (EOFError, OSError, UnicodeDecodeError):
            pass  # it has ended, or what it sends is no message of a try
        finally:
            self._kill(child)
        if not complete:
            add(ended("failed" if not one._late else "slow" if one.slow else "long"))

    def _kill(self, child: Child) -> None:
        with self._turn:
            child.kill()
            child.wait(1.0)


def ended(why: str) -> str:
    """The last message of a try that did not come to an end of its own.

    Args:
        why: it has `failed`, took too `long`, or was too `slow` while others waited; empty where an error says it.
    """
    found = {"ended": "", "why": why, "most": FAIR if why == "slow" else LONGEST}
    return encode({"t": "end", "winner": None, "score": {}, "goal": None, **found})


def setup_of(match: str, players: dict[str, str]) -> CheckedMatch:
    """A match with other strategies than those of its file.

    Args:
        match: the path of a match file, or the name of a game. players: strategies by team or by player.

    Raises:
        ConfigError: the match or a strategy cannot be used.
    """
    return played_by(load_match(match_path(match), engine="planar"), players)


def teams_of(setup: MatchSetup) -> list[str]:
    """The teams of a match, in the order of its players."""
    return list(dict.fromkeys(player.team for player in setup.players))


def others_of(teams: Iterable[str], own: str) -> list[str]:
    """The other teams than the own one."""
    return [team for team in teams if team != own]
