"""Strategies in sealed processes of their own, in a match that is otherwise played in one process.

A fork server that knows nothing of the match forks a process for each strategy. So the memory of such a process has
nothing of the match but what its player gets: a set-up of its own, and a view at each tick. What it answers is decoded,
and nothing in it is run. It is sealed as a player's process is that `vrg play` seals, and reaches no router.
"""

import contextlib
import os
import pickle
import signal
import socket
import struct
import sys
import threading
import traceback
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct, structs

from vrg import __version__
from vrg.agents.strategy import Action, RemoteStrategy, Strategy, View, decided, planned
from vrg.agents.telling import Once, Payload, sendable
from vrg.blame import DecisionTimeoutError, failure_of, tell_of_refusals
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, StrategyError, VrgError
from vrg.hal.models import RobotModel
from vrg.launch.bounds import BUDGET, BoundedOutput, MemoryBound, printing_to
from vrg.launch.fork_server import ForkServer
from vrg.launch.nodes.strategy import strategy_class, strategy_of
from vrg.launch.remote.strategies import RemoteStarter, files_of
from vrg.launch.remote.wire import BANNER
from vrg.launch.sandbox.excess import excess
from vrg.launch.sandbox.player import policy_of
from vrg.launch.sandbox.seal import REFUSAL_ADVICE, seal
from vrg.runs.run_folder import RunFolder
from vrg.types import Twist

_LONGEST = 1_000_000
"""The number of bytes that an answer may have."""
_LOOK = 0.2
"""The real time in s between two looks at a strategy that is being made."""
_SELDOM = 5
"""The looks between two of which at what it keeps, once it has been made."""
_END = 2.0
"""The real time in s within which a process that was killed has ended."""


class _Job(Struct, frozen=True):
    """The ingredients of a strategy: the set-up of its player's process, the player, and the run folder.

    Args:
        sealed: True seals the process before. make: False only imports the class.
        version: that of VRG. files: those that are to be written there first, by their paths; None where this file
            system is the match's own.
    """

    setup: MatchSetup
    name: str
    run: str
    sealed: bool
    make: bool
    version: str = __version__
    files: dict[str, bytes] | None = None


class _Ready(Struct, frozen=True, tag=True):
    """The strategy has been made; errors of its answers have this text, with what is wrong in place of `{}`."""

    priorities: tuple[str, ...]
    complaint: str


class _Decided(Struct, frozen=True, tag=True):
    """The decision of the strategy."""

    twist: Twist
    payload: Payload
    mode: str


class _Failed(Struct, frozen=True, tag=True):
    """It could not be made, or has raised something; `final` as in `StrategyError`."""

    words: str
    final: bool


_answers = msgspec.msgpack.Decoder(_Ready | _Decided | _Failed)


class StrategyApart(RemoteStrategy):
    """The strategy of a player in a sealed process of its own. It is asked, and fails, as if it were here.

    What it prints goes to its log in the run folder.

    Args:
        server: starts its process: a fork, which knows what the server knows, or one on another machine.
        patience: the longest real time in s that it may take to be made; None for as long as it takes.
        sealed: False does not seal it. make: False only imports the class of the strategy, which then cannot decide.

    Raises:
        ConfigError: there is no such player, or its strategy cannot be imported or made, or not in this time.
    """

    def __init__(
        self,
        server: ForkServer | RemoteStarter,
        setup: MatchSetup,
        name: str,
        run: RunFolder,
        *,
        patience: float | None = None,
        sealed: bool = True,
        make: bool = True,
    ) -> None:
        super().__init__(name, setup.player(name).robot)
        job = _job_of(setup, name, run, sealed=sealed, make=make, away=isinstance(server, RemoteStarter))
        run.prepare()
        (run.logs / f"{name}.json").touch()
        with (run.logs / f"{name}.log").open("ab") as log:
            self._process = server.run(__name__, (), log)
        self._pipe = self._process.connection()
        self._mode = "-"
        self._known: RobotModel | None = None
        self._sent: View | None = None
        with contextlib.suppress(OSError):
            self._pipe.send_bytes(msgspec.json.encode(job))
        self._why, self._made, self._over = "", threading.Event(), threading.Event()
        threading.Thread(target=self._watch, args=(run.path, patience), daemon=True).start()
        try:
            ready = self._answer()
            if isinstance(ready, _Decided):
                raise self._ended("it has decided before it was asked")
        except StrategyError as error:
            target = setup.player(name).strategy
            if self._why:
                raise ConfigError(f"{target}: {self._why}") from None
            raise ConfigError(f"{target}: the strategy ends its program when it is imported or made") from error
        finally:
            self._made.set()
        if isinstance(ready, _Failed):
            self.close()
            raise ConfigError(ready.words)
        self._bound_waiting()
        # Each strategy has its own, so they are no attribute of the class.
        self.priorities = ready.priorities  # type: ignore[misc]
        self._complaint = ready.complaint

    @property
    def mode(self) -> str:
        """The mode of the strategy, in its own words."""
        return self._mode

    def _watch(self, run: Path, patience: float | None) -> None:
        """End a process that takes too long to be made, even if it has begun to answer, or that keeps too much."""
        looks = 0
        while not self._over.wait(_LOOK):
            looks += 1
            making = not self._made.is_set()
            greedy = excess(run, self.name, self._process.pid) if making or looks % _SELDOM == 0 else None
            if greedy is not None:
                self._why = f"while the strategy is made, {greedy}" if making else greedy
            elif making and patience is not None and looks * _LOOK >= patience:
                lasts = f"the strategy is still being made after {patience:g} s"
                self._why = f"{lasts}: look for a loop outside of its methods"
            if self._why:
                self._process.kill()
                return

    def _bound_waiting(self) -> None:
        """Wait for an answer of which only a part comes no longer than for one that does not come."""
        with socket.socket(fileno=os.dup(self._pipe.fileno())) as stream:
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", int(BUDGET) + 1, 0))

    def send(self, view: View) -> None:
        """Send it a view. That its process has ended is found out by `act`."""
        told: dict[str, Any] = dict(vars(view))
        if view.robot is self._known:
            del told["robot"], told["obstacles"]  # the longest parts, and always the same
        self._known, self._sent = view.robot, view
        data = pickle.dumps(told, pickle.HIGHEST_PROTOCOL)
        # A process that reads nothing must not hold up the match, however long a view with pictures is.
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(self._pipe.fileno())) as stream:
            stream.settimeout(BUDGET)
            try:
                stream.sendall(len(data).to_bytes(4, "big") + data)
            except TimeoutError:
                self.close()
            finally:
                stream.settimeout(None)

    def act(self, view: View) -> Action:
        """Return the decision of the strategy.

        Raises:
            StrategyError: it has failed, or its process has ended.
            DecisionTimeoutError: it takes too long.
        """
        if self._sent is not view:
            self.send(view)
        answer = self._decided()
        self._mode, payload = answer.mode, answer.payload
        try:
            say = None if payload.say is None else msgspec.msgpack.decode(payload.say)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise self._ended(f"it has answered what cannot be read: {error}") from None
        return Action(
            answer.twist,
            say,
            () if payload.sightings is None else payload.sightings.seen,
            {bid.lot: bid.cost for bid in payload.bids},
            None if payload.sketch is None else payload.sketch.strokes,
        )

    @property
    def pid(self) -> int:
        """The process id of its process, or of the ssh that holds it."""
        return self._process.pid

    @property
    def gone(self) -> bool:
        """True if its process has ended, or was given up."""
        return self._pipe.closed

    def has_answered(self, patience: float) -> bool:
        """True if its answer is there, or its process has ended.

        Args:
            patience: the longest real time in s to wait for that.
        """
        try:
            return self._pipe.closed or self._pipe.poll(patience)
        except OSError:
            return True

    def skip(self) -> None:
        """Take its answer, and forget it.

        Raises:
            StrategyError: it has failed, or its process has ended.
        """
        self._decided()

    def complaint(self, what: str) -> StrategyError:
        """The error about a wrong answer; only the strategy's own process knows where the answer comes from."""
        return StrategyError(self._complaint.replace("{}", what))

    def close(self) -> None:
        """End its process. Idempotent."""
        self._over.set()
        if not self._pipe.closed:
            self._pipe.close()
            self._process.kill()
            self._process.wait(_END)

    def _decided(self) -> _Decided:
        try:
            answer = self._answer()
        except DecisionTimeoutError as error:
            raise DecisionTimeoutError(str(self.complaint(str(error)))) from None
        if isinstance(answer, _Failed):
            self.close()
            raise StrategyError(answer.words, final=answer.final)
        if not isinstance(answer, _Decided):
            raise self._ended(f"it has answered {type(answer).__name__}")
        return answer

    def _answer(self) -> _Ready | _Decided | _Failed:
        try:
            answer: _Ready | _Decided | _Failed = _answers.decode(self._pipe.recv_bytes(_LONGEST))
            return answer
        except (EOFError, OSError):
            raise self._ended("it has ended") from None
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise self._ended(str(error)) from None
        except BaseException:
            self.close()  # it still decides, and its answer would be taken for that to the next question
            raise

    def _ended(self, why: str) -> StrategyError:
        self.close()
        return StrategyError(f"the process of the strategy is gone: {self._why or why}")


def _job_of(setup: MatchSetup, name: str, run: RunFolder, *, sealed: bool, make: bool, away: bool) -> _Job:
    """The job of a strategy's process.

    Args:
        away: True if that is on another machine.

    Raises:
        ConfigError: there is no such player, or its files cannot be read.
    """
    files = None
    if away:
        target, files = files_of(setup, name)
        setup = structs.replace(setup.substituted(name, target), base="", origin="", map="")
    return _Job(setup.for_player(name), name, str(run.path.resolve()), sealed, make, files=files)


class _TwoWay:
    """A connection of two pipes, as ssh has them."""

    def __init__(self, reader: int, writer: int) -> None:
        self._reader, self._writer = Connection(reader, writable=False), Connection(writer, readable=False)
        self.recv_bytes, self.send_bytes = self._reader.recv_bytes, self._writer.send_bytes


def _written(job: _Job, home: Path) -> _Job:
    """The job, once its files are written to a folder.

    Raises:
        ConfigError: it comes from another version of VRG, or they cannot be written.
    """
    if job.version != __version__:
        raise ConfigError(f"expected VRG {__version__} as on this machine, got {job.version}: install one on both")
    try:
        for name, data in (job.files or {}).items():
            path = home / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        run = RunFolder(home)
        run.prepare()
        (run.logs / f"{job.name}.json").touch()
        os.chdir(home)
    except OSError as error:
        raise ConfigError(f"{home}: cannot be written: {error.strerror}") from None
    setup = structs.replace(job.setup, base=str(home), origin=str(run.match_file))
    return structs.replace(job, setup=setup, run=str(home))


def main(arguments: Sequence[str] = ()) -> int:
    """Be the process of a strategy: make it, and answer on the standard input until that is closed.

    Args:
        arguments: `away` and the folder for its files, if the match is on another machine; the answers then go to the
            standard output.
    """
    from setproctitle import setproctitle  # noqa: PLC0415 - the fork server, which imports this, keeps its name

    pipe: Connection | _TwoWay
    if arguments:
        pipe = _TwoWay(os.dup(0), os.dup(1))
        os.write(1, BANNER)
        os.dup2(2, 1)
    else:
        pipe = Connection(os.dup(0))
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    time = [0.0]
    try:
        job = msgspec.json.decode(pipe.recv_bytes(), type=_Job)
        if arguments:
            job = _written(job, Path(arguments[1]))
        setproctitle(f"vrg strategy {job.name} in {Path(job.run).name}")
        if job.sealed:
            seal(policy_of(job.setup, job.name, router=None, run=RunFolder(Path(job.run)), seat=None))
            tell_of_refusals(REFUSAL_ADVICE)
        sys.stdout.reconfigure(line_buffering=True, encoding="utf-8", errors="backslashreplace")  # type: ignore[union-attr]
        # The seal bounds memory, too.
        memory = contextlib.nullcontext() if job.sealed else MemoryBound(job.setup.memory)
        with memory, printing_to(BoundedOutput(sys.stdout, lambda: time[0])):
            if not job.make:
                strategy_class(job.setup.player(job.name).strategy, Path(job.setup.base))
                pipe.send_bytes(msgspec.msgpack.encode(_Ready((), "")))
                return 0
            strategy = strategy_of(job.setup, job.name)
            ready = _Ready(tuple(map(str, strategy.priorities)), str(strategy.complaint("{}")))
            pipe.send_bytes(msgspec.msgpack.encode(ready))
            _answer(strategy, pipe, time)
    except EOFError:
        pass
    except BaseException as error:  # a student's code may raise anything, also while it is imported
        failure = error if isinstance(error, VrgError) else failure_of(error)
        final = isinstance(failure, StrategyError) and failure.final
        if not isinstance(error, ConfigError):
            traceback.print_exception(failure.__cause__ or failure, file=sys.__stdout__)
        with contextlib.suppress(OSError):
            pipe.send_bytes(msgspec.msgpack.encode(_Failed(str(failure), final)))
    return 0


def _answer(strategy: Strategy, pipe: Connection | _TwoWay, time: list[float]) -> None:
    """Decide whenever a view comes.

    Args:
        time: its only item is set to the match time, s.

    Raises:
        StrategyError: the strategy has failed. EOFError: the pipe is closed.
    """
    same: dict[str, Any] = {}
    warn_once = Once()
    while True:
        told = pickle.loads(pipe.recv_bytes())
        told = same | told
        same = {name: told[name] for name in ("robot", "obstacles")}
        view = View(**told)
        time[0] = view.time
        action, mode = decided(strategy, view)
        payload, problems = sendable(action)
        for problem in problems:
            if warn_once(problem):
                print(strategy.complaint(problem))
        twist = planned(strategy, view, action.twist)
        pipe.send_bytes(msgspec.msgpack.encode(_Decided(twist, payload, mode)))


if __name__ == "__main__":
    sys.exit(main())
