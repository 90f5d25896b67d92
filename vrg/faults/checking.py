"""What must hold in a match whatever fails: it is checked while a simulated match is played, and after it."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Final

from vrg.bus.messages import Stage, at_rest
from vrg.bus.messages.match import DISQUALIFIED
from vrg.coordinator.journal import read_journal
from vrg.errors import VrgError
from vrg.faults.can import CanProcess
from vrg.faults.plan import REFEREE, WORLD, Fault, FaultKind
from vrg.faults.simulation import SimulatedMatch
from vrg.hal.can.guard import HEARTBEAT_TIMEOUT
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.hal.gate import REFEREE_TIMEOUT
from vrg.launch.judged import judge_run

MARGIN: Final = 0.15
"""The time in s that a stop may take beyond its time-outs: a period of players, two ticks of the world, a message."""
BRAKING: Final = 0.5
"""The time in s that the motors of a robot with drives take to stand, and its encoders to show it."""
SILENCE: Final = 5.0
"""The time in s after which a referee that is not heard has been given up: no fault lasts as long."""

GOING_ON: Final = 10.0
"""The simulated real time in s that a match may stay halted once all faults are over: the official asks every 2.5 s."""
HALTING: Final = HEARTBEAT_TIMEOUT + 0.5
"""The simulated real time in s after which a match in play halts for a bus that is silent: what a driver needs to miss
its drives, a report, and a tick of the referee."""


class Checker:
    """Watches one simulated match.

    Args:
        match: which.

    Attributes:
        problems: what does not hold, in words.
    """

    def __init__(self, match: SimulatedMatch) -> None:
        self.problems: list[str] = []
        self._match = match
        self._time: tuple[int, float] = (0, 0.0)
        self._numbers: set[int] = set()
        self._heard = 0
        self._told: set[str] = set()
        self._halted = False
        self._since = self._steady = 0.0

    def look(self) -> None:
        """Look at what the observer has heard."""
        self._look_at_time()
        self._look_at_calls()
        self._look_at_robots()
        self._look_at_drives()
        self._look_at_halts()

    def conclude(self) -> None:
        """Look at what is left of the match once it is over."""
        match = self._match
        for process in match.processes.values():
            self.problems += process.failures
        silence = match.network.now - match.heard_at
        if silence > SILENCE:
            self.problems.append(f"the referee was heard {silence:.1f} s before the end, and not since")
        try:
            records = read_journal(match.folder.journal)[1]
            judgement, wrong = judge_run(match.setup, match.folder, records)
        except VrgError as error:
            self.problems.append(f"the journal or its evidence cannot be read: {error}")
            return
        self.problems += [f"judged again: {disagreement}" for disagreement in wrong]
        if judgement.unjudged:
            self.problems.append(f"{judgement.unjudged} calls have no evidence")
        written = {call.number: call.text for record in records for call in record.calls}
        if sorted(written) != list(range(1, len(written) + 1)):
            self.problems.append(f"the calls of the journal are numbered {sorted(written)}")
        for call in match.calls:
            if written.get(call.number) != call.text:
                self.problems.append(f"call {call.number} was announced, and is not in the journal: {call.text}")
        lost = [number for number in written if number not in self._numbers]
        if lost and not any(fault.process == REFEREE for fault in match.faults):
            self.problems.append(f"calls {lost} are in the journal and were not announced")
        clocks = [record.standing.total for record in records]
        if any(after < before - 1e-9 for before, after in pairwise(clocks)):
            self.problems.append("the clock of the journal goes back")

    def _look_at_time(self) -> None:
        clock = self._match.clock
        if clock is None:
            return
        if clock.epoch == self._time[0] and clock.time < self._time[1]:
            self._note(f"match time goes back from {self._time[1]:.2f} s to {clock.time:.2f} s in one epoch")
        self._time = clock.epoch, clock.time

    def _look_at_calls(self) -> None:
        for call in self._match.calls[self._heard :]:
            if call.number in self._numbers:
                self._note(f"call {call.number} is announced twice: {call.text}")
            self._numbers.add(call.number)
        self._heard = len(self._match.calls)

    def _look_at_robots(self) -> None:
        """The robots of players that cannot command them stand, as all do without a referee or a link of the world.

        It counts match time, which stands still with the world.
        """
        match, poses = self._match, self._match.poses
        if poses is None:
            return
        for body in poses.body.bodies:
            for name, bound in (
                (body.name, COMMAND_TIMEOUT),
                (REFEREE, REFEREE_TIMEOUT + COMMAND_TIMEOUT),
                (WORLD, COMMAND_TIMEOUT),
            ):
                unable = match.processes[name].unable
                since = 0.0 if unable is None else poses.stamp - unable
                slow = sum(f.size for f in match.faults if f.kind is FaultKind.SLOW and f.process in (name, WORLD))
                braking = BRAKING if body.physical else 0.0
                if since > bound + MARGIN + slow + braking and body.stands is None and not at_rest(body.twist):
                    self._note(f"{body.name} is driven, though {name} has published nothing for {since:.2f} s")

    def _look_at_drives(self) -> None:
        """The motors of a robot are off once its drives hear nothing, or one of them says nothing."""
        now = self._match.network.now
        for process in self._match.processes.values():
            if not isinstance(process, CanProcess):
                continue
            longest = max(drive.options.watchdog for drive in process.drives)
            for since, bound, what in (
                (process.silent, longest, "its drives hear nothing"),
                (process.muted, HEARTBEAT_TIMEOUT + longest, "one of its drives says nothing"),
            ):
                if since is not None and now - since > bound + MARGIN and any(d.driven for d in process.drives):
                    self._note(f"{process.name} is driven, though {what}, for {now - since:.2f} s")

    def _look_at_halts(self) -> None:
        """A match in play halts soon after a bus has fallen silent, and any match goes on once all faults are over."""
        match, now, state = self._match, self._match.network.now, self._match.state
        if state is None:
            return
        halted = state.halted is not None
        if not halted or not self._halted:
            self._since = now
        self._halted = halted
        over = max((fault.begin + fault.length for fault in match.faults), default=0.0)
        if halted and not state.halted:
            self._note("play is halted, without a reason")
        waits = now - max(self._since, over)
        if halted and not match.over and waits > GOING_ON:
            self._note(f"play is halted for {waits:.1f} s, though all faults are over: {state.halted}")
        if any(process.unable is not None for process in match.processes.values()) or halted:
            self._steady = now
        for process in match.processes.values():
            if not isinstance(process, CanProcess) or process.silent is None:
                continue
            silent = now - max(process.silent, self._steady)
            slow = sum(f.size for f in match.faults if f.kind is FaultKind.SLOW)
            out = any(p.name == process.name and p.state == DISQUALIFIED for p in state.players)
            if state.stage is Stage.PLAY_ROUND and not out and silent > HALTING + slow:
                self._note(f"play goes on, though {process.name} has not reached its drives for {silent:.2f} s")

    def _note(self, text: str) -> None:
        """Note a problem, each kind of it once."""
        kind = text.split(",", maxsplit=1)[0]
        if kind not in self._told:
            self._told.add(kind)
            self.problems.append(f"{self._match.network.now:.2f} s: {text}")


def checked(match: SimulatedMatch, seconds: float) -> list[str]:
    """Play a simulated match, and return what did not hold.

    Args:
        seconds: the longest simulated real time, s.
    """
    checker = Checker(match)
    match.run(seconds, checker.look)
    checker.conclude()
    return checker.problems


def shortest(faults: Sequence[Fault], play: Callable[[Sequence[Fault]], list[str]]) -> tuple[list[str], list[Fault]]:
    """What does not hold, in words, with the fewest of some faults, by leaving out one after the other; and those.

    Args:
        play: plays the match with some faults, and returns what does not hold.
    """
    kept, problems = list(faults), play(faults)
    for fault in faults if problems else ():
        fewer = [other for other in kept if other is not fault]
        if found := play(fewer):
            kept, problems = fewer, found
    return (problems, kept) if problems else ([], [])
