"""Strategies that decide in processes of their own: the side of the match.

A fork server that knows nothing of the match forks a process for each of these (`vrg.playing.strategy_process`). Over
processes that of its player does, before it has a thread, a session, keys or a driver. So the memory of such a process
has nothing of the match but what its player gets: a set-up of its own, and a view at each tick. What it answers is
decoded, and nothing in it is run. A strategy that does not answer in time forfeits the step, and holds up nothing.

What a player has missed is written to the log of steps. When the match is played again, here or in a process of its
own, it is missed again.
"""

import contextlib
import logging
import math
import os
import signal
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, Self

import msgspec

from vrg.agents.strategy import Action, ForfeitError, RemoteStrategy, Strategy, View, decided
from vrg.blame import DecisionTimeoutError
from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError, MessageError, StrategyError
from vrg.hal.models import RobotModel
from vrg.launch.fork_server import ForkServer
from vrg.launch.process_log import ProcessLog
from vrg.launch.pulses import BUSY_TIMEOUT, StartupProbe
from vrg.launch.remote.channel import Channel
from vrg.launch.remote.ssh import Connection
from vrg.launch.remote.wire import BANNER, Frames
from vrg.launch.sandbox.excess import excess
from vrg.playing import strategy_process
from vrg.playing.elsewhere import assignment_elsewhere
from vrg.playing.question import Questions, TooManyQuestionsError, Wanted
from vrg.playing.strategy_process import Answer, Assignment, Decision, Failed
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import Line, Missed
from vrg.system import POSIX
from vrg.types import Twist

log = logging.getLogger(__name__)

DEADLINE: Final = 1.0
"""The real time in s after which a player that does not answer forfeits a step."""
BUDGET = 5.0
"""The real time in s that a decision may take."""
LOADING_TIME = 20.0
"""The processor time in s that a strategy may take to be imported and made."""
_LOOK = 0.2
"""The real time in s between two looks at a strategy that is being made."""
_WHERE = 50
"""The looks, one in 10 ms, for the line at which a strategy is that has not answered."""
_SERVE = 0.005
"""The real time in s for which others wait for an answer to their questions while one is waited for."""
_SELDOM = 5
"""The looks between two of which at what it keeps, once it has been made."""
_LEAVE = 0.5
"""The real time in s in which a process that decides nothing may end by itself."""
_TELL = 10.0
"""The real time in s between two words about decisions that are forfeited."""
_END = 2.0
"""The real time in s within which a process that was killed has ended."""
_GREETING = 100_000
"""The number of bytes that a login shell on another machine may print before."""

Past = Mapping[float, Missed]
"""What a player has missed when the match was played before, by the match time in s."""
Write = Callable[[Line], None]
"""Notes what a player misses."""


class SteppedStrategy(RemoteStrategy):
    """A strategy that misses the steps that it has missed when the match was played before.

    Args:
        past: what it has missed, by the match time in s. write: notes what it misses.
    """

    def __init__(self, name: str, robot: RobotModel, past: Past, write: Write) -> None:
        super().__init__(name, robot)
        self._past, self._write = past, write
        self._noting = True
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
            # Nothing was heard of a decision that came too late, nor of its failure, which is another line.
            self._noting = False
            with contextlib.suppress(BaseException):
                self._decided(view)
            self._noting = True
        raise ForfeitError

    @abstractmethod
    def _decided(self, view: View) -> Action:
        """Its decision."""

    def _missed(self, view: View) -> Missed | None:
        return self._past.get(round(view.time, 6))


class StrategyHere(SteppedStrategy):
    """A strategy in this process, of a match in which it has missed steps."""

    def __init__(self, strategy: Strategy, past: Past, write: Write) -> None:
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
    """The strategy of a player in its own process. It is asked, and fails, as if it were here.

    What it prints goes to its log in the run folder. Its process begins at once; `made` waits for it.

    Args:
        server: forks its process. machine: the name of the machine on which it decides.
        sealed: False does not seal it.
        keys: the folder of the keys of the match's seats, of which it is to see nothing; None in a match without them.
        in_player: True in the process of its player: it prints and logs where that does, and one that is sealed gets
            one processor core, on which it comes behind others.
        make: False only imports the class of the strategy, which then cannot decide.
        deadline: the real time in s after which it forfeits a step, which is then noted; None waits for it.
        past, write: see `SteppedStrategy`. now: returns the real time, s.
        meanwhile: called again and again while it is waited for: others may have questions, too.

    Raises:
        ConfigError: there is no such player.
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
        keys: Path | None = None,
        in_player: bool = False,
        machine: str = HERE,
        make: bool = True,
        deadline: float | None = None,
        past: Past | None = None,
        write: Write = lambda _: None,
        now: Callable[[], float] = time.monotonic,
        meanwhile: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__(name, setup.player(name).robot, past or {}, write)
        self._deadline, self._now, self._meanwhile = deadline, now, meanwhile
        self._questions = Questions()
        self._asked = self._late = False
        self._since, self._asked_where, self._told = 0.0, -math.inf, -math.inf
        self._answers: list[Answer] = []
        self._why, self._made, self._over = "", threading.Event(), threading.Event()
        self._complaint = "{}"
        self._in_player = in_player
        if sealed or not in_player:
            run.prepare()
        log = run.logs / f"{name}.log"
        self._log, self._dumped = ProcessLog(log), 0
        frames: Frames[Answer] = Frames(Answer, BANNER if machine in setup.hosts else b"")  # type: ignore[arg-type]  # a union
        self._elsewhere = machine in setup.hosts
        if self._elsewhere:
            assignment = assignment_elsewhere(setup, name, sealed=sealed)
            self._reach(Connection(machine, setup.hosts[machine], log, "node strategy", frames), machine)
        else:
            hidden = "" if keys is None else str(keys.resolve())
            assignment = Assignment(
                setup.for_player(name), name, str(run.path.resolve()), sealed, make, in_player, hidden
            )
            with os.fdopen(os.dup(1), "wb") if in_player else log.open("ab") as file:
                self._process = server.run(strategy_process.__name__, (), file, trusted=not sealed)
            pipe = self._process.detached()
            self._channel = Channel(pipe, pipe, frames)
        self._send(msgspec.json.encode(assignment))
        self._target = setup.player(name).strategy
        threading.Thread(target=self._watch, args=(run.path,), daemon=True).start()

    def made(self) -> Self:
        """Wait until it is made.

        Raises:
            ConfigError: it cannot be imported or made, or not in LOADING_TIME. Its process has ended then.
        """
        while not self._has_answered(_LOOK):
            pass
        self._made.set()
        ready = self._answers.pop(0) if self._answers else None
        if isinstance(ready, strategy_process.Ready):
            # Each strategy has its own, so they are no attribute of the class.
            self.priorities = ready.priorities  # type: ignore[misc]
            self._complaint = ready.complaint
            return self
        self.close()
        why = self._why or "the strategy ends its program when it is imported or made"
        raise ConfigError(ready.words if isinstance(ready, Failed) else f"{self._target}: {why}")

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
        # In its player's process it is waited for as for any process.
        looks, probe = 0, StartupProbe(time.monotonic(), BUSY_TIMEOUT if self._in_player else LOADING_TIME)
        while not self._over.wait(_LOOK):
            looks += 1
            making = not self._made.is_set()
            greedy = excess(run, self.name, self._process.pid) if making or looks % _SELDOM == 0 else None
            if greedy is not None:
                self._why = f"while the strategy is made, {greedy}" if making else greedy
            elif making and (stuck := probe.stuck(self._process.pid, time.monotonic())) is not None:
                self._why = f"while it is made, the strategy {stuck}: look for a loop outside of its methods"
            if self._why:
                self._process.kill()
                return

    def send(self, view: View) -> None:
        """Send it a view, unless it still decides by an earlier one. `act` finds out that its process has ended."""
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
            self._end("it answers questions that it has not read")  # what waits for it must not become more and more
        data = self._questions.packed(view)
        self._since = self._now()
        self._send(data)

    def _send(self, data: bytes) -> None:
        self._channel.send_bytes(len(data).to_bytes(4, "big") + data)

    def _decided(self, view: View) -> Action:
        try:
            if self._deadline is None:
                if not self._has_answered(BUDGET / 2):
                    self._ask_where()
                if self._has_answered(BUDGET / 2):
                    return self._taken()
            elif not self._late and self._has_answered(max(0.0, self._since + self._deadline - self._now())):
                return self._taken()
        except StrategyError as error:
            # Its own code, or somebody's signal: only the former would come again by itself.
            self._noted(view, failure=str(error), final=error.final)
            raise
        except DecisionTimeoutError as error:
            self._noted(view, failure=str(error), hung=True)
            raise
        if self._deadline is None or self._now() - self._since > BUDGET:
            self.close()
            raise self._noted(view, failure=self._hangs(), hung=True).error
        if self._now() - self._asked_where > BUDGET / 2:
            self._ask_where()
        self._late = True
        self._forfeited()
        self._noted(view)
        raise ForfeitError

    def _ask_where(self) -> None:
        """Let it write to its log at which line it is."""
        if POSIX and not self._elsewhere:
            self._asked_where, self._dumped = self._now(), self._log.size
            self._process.send_signal(signal.SIGUSR1)

    def _await_where(self) -> None:
        """Give it a moment to write at which line it is: a match may be over just after it was asked."""
        for _ in range(_WHERE):
            if self._log.size > self._dumped or self._process.wait(0.0):
                break
            time.sleep(0.01)

    def _forfeited(self) -> None:
        """Count a forfeited decision, and report it now and then."""
        self.forfeited += 1
        if self._now() - self._told > _TELL:
            self._told = self._now()
            whose = "" if self._in_player else f"{self.name}: "
            log.warning("%sa decision took more than %g s: forfeited, %d so far", whose, self._deadline, self.forfeited)

    def check(self) -> None:
        """See `RemoteStrategy.check`. In a match in steps `act` finds this out, so that a repetition has it, too."""
        if not self._in_player:
            return
        if self._has_answered(0.0):
            if not self._answers:
                raise self._end("it has ended")
        elif self._late and self._now() - self._since > BUDGET:
            self.close()
            raise DecisionTimeoutError(self._hangs())

    def _hangs(self) -> str:
        """Says that it hangs, and where it was when it was asked last."""
        what, place = f"a decision may take {BUDGET:g} s", self._log.place(self._dumped)
        method = self._complaint.partition("{}")[0]
        return f"{method}{what} (it was at {place})" if place else str(self.complaint(what))

    def _noted(self, view: View, *, failure: str = "", final: bool = False, hung: bool = False) -> Missed:
        time, name = round(view.time, 6), self.name
        missed = Missed(time=time, player=name, asked=self._asked, failure=failure, final=final, hung=hung)
        if self._noting:
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
                self._take_in(min(_SERVE, max(0.0, until - self._now())))
                if self._now() >= until:
                    break
                if not self._answers:
                    self._meanwhile()
        except (MessageError, TooManyQuestionsError) as error:
            self._end(str(error))
        except DecisionTimeoutError as error:
            self.close()
            raise DecisionTimeoutError(str(self.complaint(str(error)))) from None
        except BaseException:
            self.close()  # it still decides, and its answer would be taken for that to the next question
            raise
        return bool(self._answers) or self._channel.closed

    def _take_in(self, patience: float) -> None:
        """Keep what it answers, and answer what it asks; see `vrg.launch.remote.channel.Channel.pump`."""
        for answer in self._channel.pump(patience):
            if isinstance(answer, Wanted):
                self._send(self._questions.told(answer))
            else:
                self._answers.append(answer)

    def serve(self) -> None:
        """Answer what it asks while another one is waited for. What goes wrong is found out when it is waited for."""
        if not self._answers and not self._channel.closed:
            self._has_answered(0.0)

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
            raise self._end(f"it has sent an answer that cannot be read: {error}") from None
        v, w, side, climb = answer.motion
        return Action(
            # So that it is told in the same words as elsewhere.
            Twist(v, w, side, climb) if climb else Twist(v, w, side) if side else Twist(v, w),
            say,
            () if payload.sightings is None else payload.sightings.seen,
            {bid.lot: bid.cost for bid in payload.bids},
            None if payload.sketch is None else payload.sketch.strokes,
            payload.use,
        )

    def complaint(self, what: str) -> StrategyError:
        """The error about a wrong answer; only the strategy's own process knows where the answer comes from."""
        return StrategyError(self._complaint.replace("{}", what))

    def close(self) -> None:
        """End its process. Idempotent."""
        if not self._over.is_set():
            self._over.set()
            if self._late and not self._elsewhere and POSIX:
                self._await_where()
            self._channel.close()
            if self._in_player and not self._late:
                self._process.wait(_LEAVE)  # it may have something to do at its end
            self._process.kill()
            self._process.wait(_END)

    def _end(self, why: str) -> StrategyError:
        """End its process, and return why it is gone."""
        if self._in_player and self._process.wait(_LOOK) and (status := self._process.poll()):
            why = f"{why}, {f'by signal {-status}' if status < 0 else f'with status {status}'}"
        self._why = self._why or why
        self.close()
        return StrategyError(f"the process of the strategy is gone: {self._why}")
