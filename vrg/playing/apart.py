"""The strategies that decide in processes of their own, and which of a match do.

A fork server that knows nothing of the match forks a process for each of these (`vrg.playing.deciding`); over processes
that of its player does, before it has a thread, a session, keys or a driver. So the memory of such a process has
nothing of the match but what its player gets: a set-up of its own, and a view at each tick. What it answers is decoded,
and nothing in it is run. A strategy that does not answer in time forfeits the step, and holds up nothing.

What a player has missed is written to the log of steps. When the match is played again, here or in a process of its
own, it is missed again.
"""

import contextlib
import os
import pickle
import signal
import sys
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import msgspec

from vrg.agents.strategy import Action, ForfeitError, RemoteStrategy, Strategy, View, decided
from vrg.blame import DecisionTimeoutError
from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError, MessageError, StrategyError
from vrg.hal.models import RobotModel
from vrg.launch.fork_server import ForkServer, OwnForks
from vrg.launch.nodes.strategy import strategy_of
from vrg.launch.process_log import ProcessLog
from vrg.launch.pulses import Progress
from vrg.launch.remote.channel import Channel
from vrg.launch.remote.ssh import Connection
from vrg.launch.remote.wire import BANNER, Frames
from vrg.launch.sandbox.bounds import BUDGET
from vrg.launch.sandbox.excess import excess
from vrg.launch.sandbox.seal import check_able
from vrg.playing import deciding
from vrg.playing.deciding import Answer, Assignment, Decision, Failed
from vrg.playing.elsewhere import assignment_elsewhere
from vrg.runs.run_folder import RunFolder, scratch_folder
from vrg.runs.step_log import Line, Missed, Unmade
from vrg.system import POSIX
from vrg.types import Twist

DEADLINE: Final = 1.0
"""The real time in s after which a player that does not answer forfeits a step."""
LOADING_TIME = 20.0
"""The processor time in s that a strategy may take to be imported and made."""
_LOOK = 0.2
"""The real time in s between two looks at a strategy that is being made."""
_SELDOM = 5
"""The looks between two of which at what it keeps, once it has been made."""
_END = 2.0
"""The real time in s within which a process that was killed has ended."""
_GREETING = 100_000
"""The number of bytes that a login shell on another machine may print before."""

_Past = Mapping[float, Missed]
_Write = Callable[[Line], None]


class SteppedStrategy(RemoteStrategy):
    """A strategy that misses the steps that it has missed when the match was played before.

    Args:
        past: what it has missed, by the match time in s. write: notes what it misses.
    """

    def __init__(self, name: str, robot: RobotModel, past: _Past, write: _Write) -> None:
        super().__init__(name, robot)
        self._past, self._write = past, write
        self._mode = "-"

    @property
    def mode(self) -> str:
        """The mode of the strategy, in its own words."""
        return self._mode

    def act(self, view: View) -> Action:
        """Return the decision of the strategy.

        Raises:
            ForfeitError: it has not answered in time.
            StrategyError: it has failed, or its process has ended.
            DecisionTimeoutError: it takes too long.
        """
        missed = self._missed(view)
        if missed is None:
            return self._decided(view)
        self._write(missed)
        if missed.failure:
            self.close()
            raise missed.error
        if missed.asked:
            # Of what it decided too late nothing was heard, also not that it failed, which is another line.
            with contextlib.suppress(BaseException):
                self._decided(view)
        raise ForfeitError

    @abstractmethod
    def _decided(self, view: View) -> Action:
        """Its decision."""

    def _missed(self, view: View) -> Missed | None:
        return self._past.get(round(view.time, 6))


class StrategyHere(SteppedStrategy):
    """A strategy in this process, of a match in which it has missed steps."""

    def __init__(self, strategy: Strategy, past: _Past, write: _Write) -> None:
        super().__init__(strategy.name, strategy.robot, past, write)
        self.priorities = strategy.priorities  # type: ignore[misc]
        self._strategy = strategy

    def send(self, view: View) -> None:
        """It decides in `act`."""

    def _decided(self, view: View) -> Action:
        action, self._mode = decided(self._strategy, view)
        return action

    def complaint(self, what: str) -> StrategyError:
        """See `Strategy.complaint`."""
        return self._strategy.complaint(what)


class SpentStrategy(SteppedStrategy):
    """The strategy of a player whose bank of real time is spent: it forfeits each step."""

    def send(self, view: View) -> None:
        """It decides nothing."""

    def _decided(self, view: View) -> Action:
        self._write(Missed(time=round(view.time, 6), player=self.name, asked=False))
        raise ForfeitError


class SubprocessStrategy(SteppedStrategy):
    """The strategy of a player in a process of its own. It is asked, and fails, as if it were here.

    What it prints goes to its log in the run folder.

    Args:
        server: forks its process. machine: the name of the machine on which it decides.
        sealed: False does not seal it. pinned: True gives it one processor core, behind others on it.
        keys: the folder of the keys of the match's seats, of which it is to see nothing; None in a match without them.
        shares_output: True lets it print where this process does, and not to its log.
        make: False only imports the class of the strategy, which then cannot decide.
        deadline: the real time in s after which it forfeits a step, which is then noted; None waits for it.
        past, write: see `SteppedStrategy`. now: returns the real time, s.

    Raises:
        ConfigError: there is no such player, or its strategy cannot be imported or made, or not in LOADING_TIME.
        LaunchError: the machine cannot be reached, or has no VRG. OSError: no process can be started.
    """

    def __init__(
        self,
        server: ForkServer,
        setup: MatchSetup,
        name: str,
        run: RunFolder,
        *,
        sealed: bool,
        pinned: bool = False,
        keys: Path | None = None,
        shares_output: bool = False,
        machine: str = HERE,
        make: bool = True,
        deadline: float | None = None,
        past: _Past | None = None,
        write: _Write = lambda _: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(name, setup.player(name).robot, past or {}, write)
        self._deadline, self._now = deadline, now
        self._known: RobotModel | None = None
        self._asked = self._late = False
        self._since = 0.0
        self._answers: list[Answer] = []
        self._why, self._made, self._over = "", threading.Event(), threading.Event()
        self._complaint = "{}"
        if sealed or not shares_output:
            run.prepare()
        log = run.logs / f"{name}.log"
        self._log, self._dumped = ProcessLog(log), 0
        # A union is no class.
        frames: Frames[Answer] = Frames(Answer, BANNER if machine in setup.hosts else b"")  # type: ignore[arg-type]
        self._elsewhere = machine in setup.hosts
        if self._elsewhere:
            assignment = assignment_elsewhere(setup, name, sealed=sealed)
            self._reach(Connection(machine, setup.hosts[machine], log, "node strategy", frames), machine)
        else:
            hidden = "" if keys is None else str(keys.resolve())
            assignment = Assignment(setup.for_player(name), name, str(run.path.resolve()), sealed, make, pinned, hidden)
            with os.fdopen(os.dup(1), "wb") if shares_output else log.open("ab") as file:
                self._process = server.run(deciding.__name__, (), file, trusted=not sealed)
            pipe = self._process.detached()
            self._channel = Channel(pipe, pipe, frames)
        self._send(msgspec.json.encode(assignment))
        threading.Thread(target=self._watch, args=(run.path,), daemon=True).start()
        while not self._has_answered(_LOOK):
            pass
        self._made.set()
        target = setup.player(name).strategy
        ready = self._answers.pop(0) if self._answers else None
        if isinstance(ready, deciding.Ready):
            # Each strategy has its own, so they are no attribute of the class.
            self.priorities = ready.priorities  # type: ignore[misc]
            self._complaint = ready.complaint
            return
        self.close()
        why = self._why or "the strategy ends its program when it is imported or made"
        raise ConfigError(ready.words if isinstance(ready, Failed) else f"{target}: {why}")

    def _reach(self, connection: Connection[Answer], machine: str) -> None:
        """Wait until its process on another machine has started.

        Raises:
            LaunchError: it does not.
        """
        self._process, self._channel = connection.process, connection.channel
        # ssh itself gives up a machine that does not answer.
        while self._channel.frames.banner:
            self._has_answered(_LOOK)
            if self._channel.frames.banner and (self._channel.closed or self._channel.received > _GREETING):
                connection.end()
                raise LaunchError(f"{machine}: {connection.why_ended()}")

    def _watch(self, run: Path) -> None:
        """End a process that takes too long to be made, even if it has begun to answer, or that keeps too much."""
        looks, progress = 0, Progress(time.monotonic(), LOADING_TIME)
        while not self._over.wait(_LOOK):
            looks += 1
            making = not self._made.is_set()
            greedy = excess(run, self.name, self._process.pid) if making or looks % _SELDOM == 0 else None
            if greedy is not None:
                self._why = f"while the strategy is made, {greedy}" if making else greedy
            elif making and (stuck := progress.stuck(self._process.pid, time.monotonic())) is not None:
                self._why = f"the strategy, which is still being made, {stuck}: look for a loop outside of its methods"
            if self._why:
                self._process.kill()
                return

    def send(self, view: View) -> None:
        """Send it a view, unless it still decides by an earlier one. That its process has ended `act` finds out."""
        missed = self._missed(view)
        if missed is not None and (missed.failure or not missed.asked):
            return
        failed = False
        if self._late and self._has_answered(0.0):
            self._late = False
            failed = not self._answers or not isinstance(self._answers[0], Decision)
            if not failed:
                del self._answers[0]  # of what it has decided too late nothing is heard
        self._asked = not self._late and not failed
        if not self._asked:
            return
        if self._channel.backlog and not self._channel.closed:
            self._end("it answers what it has not read")  # what waits for it must not become more and more
        fields: dict[str, Any] = dict(vars(view))
        if view.robot is self._known:
            del fields["robot"], fields["obstacles"]  # the longest parts, and always the same
        self._known, self._since = view.robot, self._now()
        self._send(pickle.dumps(fields, pickle.HIGHEST_PROTOCOL))

    def _send(self, data: bytes) -> None:
        self._channel.send_bytes(len(data).to_bytes(4, "big") + data)

    def _decided(self, view: View) -> Action:
        if self._deadline is None:
            if self._has_answered(BUDGET + 1.0):
                return self._taken()
            self.close()
            raise DecisionTimeoutError(str(self.complaint(f"a decision may take {BUDGET:g} s")))
        try:
            if not self._late and self._has_answered(max(0.0, self._since + self._deadline - self._now())):
                return self._taken()
        except StrategyError as error:
            # Its own code, or somebody's signal: only the former would come again by itself.
            self._noted(view, failure=str(error), final=error.final)
            raise
        except DecisionTimeoutError as error:
            self._noted(view, failure=str(error), hung=True)
            raise
        if self._now() - self._since > BUDGET:
            self.close()
            raise self._noted(view, failure=self._hangs(), hung=True).error
        if not self._late and POSIX and not self._elsewhere:
            self._dumped = self._log.size
            self._process.send_signal(signal.SIGUSR1)  # its log then has the line where it is
        self._late = True
        self._noted(view)
        raise ForfeitError

    def _hangs(self) -> str:
        """That it hangs, in words, with the place where it was when it was asked last."""
        what, place = f"a decision may take {BUDGET:g} s", self._log.place(self._dumped)
        method = self._complaint.partition("{}")[0]
        return f"{method}{what} (it was at {place})" if place else str(self.complaint(what))

    def _noted(self, view: View, *, failure: str = "", final: bool = False, hung: bool = False) -> Missed:
        time, name = round(view.time, 6), self.name
        missed = Missed(time=time, player=name, asked=self._asked, failure=failure, final=final, hung=hung)
        self._write(missed)
        return missed

    def _has_answered(self, patience: float) -> bool:
        """True if its answer is there, or its process has ended.

        Args:
            patience: the longest real time in s to wait for that.
        """
        until = self._now() + patience
        try:
            while not self._answers and not self._channel.closed:
                self._answers += self._channel.pump(max(0.0, until - self._now()))
                if self._now() >= until:
                    break
        except MessageError as error:
            self._end(str(error))
        except DecisionTimeoutError as error:
            self.close()
            raise DecisionTimeoutError(str(self.complaint(str(error)))) from None
        except BaseException:
            self.close()  # it still decides, and its answer would be taken for that to the next question
            raise
        return bool(self._answers) or self._channel.closed

    def _taken(self) -> Action:
        """Take its answer.

        Raises:
            StrategyError: it has failed, or its process has ended or was given up.
        """
        answer = self._answers.pop(0) if self._answers else None
        if isinstance(answer, Failed):
            self.close()
            raise StrategyError(answer.words, final=answer.final)
        if not isinstance(answer, Decision):
            raise self._end("it has ended" if answer is None else f"it has answered {type(answer).__name__}")
        self._mode, payload = answer.mode, answer.payload
        try:
            say = None if payload.say is None else msgspec.msgpack.decode(payload.say)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise self._end(f"it has answered what cannot be read: {error}") from None
        v, w, side = answer.motion
        return Action(
            Twist(v, w, side) if side else Twist(v, w),  # so that it is told in the same words as elsewhere
            say,
            () if payload.sightings is None else payload.sightings.seen,
            {bid.lot: bid.cost for bid in payload.bids},
            None if payload.sketch is None else payload.sketch.strokes,
        )

    def complaint(self, what: str) -> StrategyError:
        """The error about a wrong answer; only the strategy's own process knows where the answer comes from."""
        return StrategyError(self._complaint.replace("{}", what))

    def close(self) -> None:
        """End its process. Idempotent."""
        if not self._over.is_set():
            self._over.set()
            self._channel.close()
            self._process.kill()
            self._process.wait(_END)

    def _end(self, why: str) -> StrategyError:
        """End its process, and return why it is gone."""
        self._why = self._why or why
        self.close()
        return StrategyError(f"the process of the strategy is gone: {self._why}")


def begun(setup: MatchSetup, name: str, run: RunFolder, keys: Path | None) -> SubprocessStrategy | None:
    """The strategy of the player whose process this is, in a process of its own; None for one that is trusted.

    It is called before this process has a thread, a session, keys or a driver, so that the other one has none of them.

    Raises:
        StrategyError: it cannot be imported or made. LaunchError: no process can be started.
        SandboxError: it is to be sealed, and this machine cannot do it.
    """
    from vrg.launch.serving import is_sealed  # noqa: PLC0415 - it loads the bus, which a match in one process does not

    sealed = is_sealed(setup, name, seats=keys is not None)
    if not POSIX or not (sealed or setup.strategy_file(name) is not None):
        return None
    if sealed:
        check_able()
    # On macOS a process that has loaded the system's libraries cannot fork safely.
    server = OwnForks() if sys.platform == "linux" else ForkServer()
    try:
        return SubprocessStrategy(
            server, setup, name, run, sealed=sealed, pinned=sealed, keys=keys, shares_output=True, deadline=DEADLINE
        )
    except ConfigError as error:
        raise StrategyError(str(error), final=True) from None
    except OSError as error:
        raise LaunchError(f"{name}: its strategy cannot be started: {error}") from error


@dataclass(frozen=True)
class Strategies:
    """Makes the strategies of a match, here or in processes of their own. What was missed is missed again.

    Args:
        server: forks these processes; None lets all decide here.
        every: True for all strategies; False for those alone that are to be sealed in a match with seats.
        strangers: True seals all strategies of files, here, whatever the match file says: it is a stranger's as well.
        deadline: the real time in s after which one forfeits a step, if the match was not played before; None waits.
        run: the run folder; None without one, and then all decide here.
        past: the log of the match when it was played before. write: adds to the log of steps.
        now: returns the match time in s; None before the first step.
    """

    server: ForkServer | None = None
    every: bool = False
    strangers: bool = False
    deadline: float | None = None
    run: RunFolder | None = None
    past: Sequence[Line] = ()
    write: _Write = lambda _: None
    now: Callable[[], float | None] = lambda: None
    _opened: list[SubprocessStrategy] = field(default_factory=list, init=False)

    def is_apart(self, setup: MatchSetup, name: str) -> bool:
        """True if the strategy of a player decides in a process of its own."""
        if self.server is None or self.run is None:
            return False
        return self.every or self._is_strangers(setup, name) or setup.sandboxed(name, seats=True)

    def _is_strangers(self, setup: MatchSetup, name: str) -> bool:
        return self.strangers and setup.strategy_file(name) is not None

    def tried(self, setup: MatchSetup, name: str) -> None:
        """Import and make the strategy of a player where it would decide, to find out whether that can be done.

        Raises:
            ConfigError: it cannot.
        """
        with scratch_folder() as place:
            trial = replace(self, run=RunFolder(place))
            trial.maker(setup, name)()
            trial.close()

    def maker(self, setup: MatchSetup, name: str) -> Callable[[], Strategy]:
        """A function that makes the strategy of a player, for the first time or again."""
        mine = [line for line in self.past if isinstance(line, Missed | Unmade) and line.player == name]
        missed = {line.time: line for line in mine if isinstance(line, Missed)}
        unmade = {line.time: line.why for line in mine if isinstance(line, Unmade)}

        def make() -> Strategy:
            now = self.now()
            try:
                if now is not None and (why := unmade.get(round(now, 6))) is not None:
                    raise ConfigError(why)
                return self._made(setup, name, missed)
            except ConfigError as error:
                if now is not None:
                    self.write(Unmade(time=round(now, 6), player=name, why=str(error)))
                raise

        return make

    def spent(self, setup: MatchSetup, name: str) -> Strategy:
        """The strategy of a player whose bank of real time is spent."""
        return SpentStrategy(name, setup.player(name).robot, {}, self.write)

    def close(self) -> None:
        """End all that decide in processes of their own. Idempotent."""
        for strategy in self._opened:
            strategy.close()

    def _made(self, setup: MatchSetup, name: str, missed: _Past) -> Strategy:
        """Make a strategy.

        Raises:
            ConfigError: it cannot be made.
        """
        if self.server is None or self.run is None or not self.is_apart(setup, name):
            strategy = strategy_of(setup, name)
            return StrategyHere(strategy, missed, self.write) if missed else strategy
        from vrg.launch.serving import is_sealed  # noqa: PLC0415 - it loads the bus, which no other match here needs

        sealed = not self.every or self._is_strangers(setup, name) or is_sealed(setup, name, seats=False)
        try:
            made = SubprocessStrategy(
                self.server, setup, name, self.run, sealed=sealed, deadline=None if self.past else self.deadline,
                machine=HERE if self.strangers else setup.place.get(name, HERE), past=missed, write=self.write,
            )  # fmt: skip
        except (LaunchError, OSError) as error:
            raise ConfigError(str(error)) from None
        self._opened.append(made)
        return made
