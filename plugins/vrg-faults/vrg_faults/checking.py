"""What must hold in a match whatever fails: it is checked while a simulated match is played, and after it."""

import shutil
import tempfile
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

from vrg.bus.messages import at_rest
from vrg.bus.pacing import STALL
from vrg.config.setup import MatchSetup
from vrg.coordinator.coordinator import PERIOD, STALL_TICKS
from vrg.coordinator.journal import read_journal
from vrg.errors import VrgError
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg.runs.certificate import certificate_of
from vrg.runs.judged import judge_run
from vrg.runs.run_folder import RunFolder
from vrg_faults.machine import Machine
from vrg_faults.observer import LEASE, Spans
from vrg_faults.plan import REFEREE, WORLD, Fault, FaultKind
from vrg_faults.simulation import SimulatedMatch

MARGIN: Final = 0.15
"""The time in s that a stop may take beyond its time-outs: a period of players, two ticks of the world, a message."""
SILENCE: Final = 5.0
"""The time in s after which a referee that is not heard has been given up: no fault lasts as long."""
SETTLING: Final = 8.0
"""The simulated real time in s after all faults within which a match goes on, is over, or waits in a halt."""
MOVES: Final = 2.0
"""The simulated real time in s within which match time moves on."""
STOPPED: Final = REFEREE_TIMEOUT + COMMAND_TIMEOUT + 2 * MARGIN
"""The match time in s within which all robots stand after a HALT: their players may hear of it by silence only."""
RETURNING: Final = 0.3
"""The time in s after which a process that is linked again has learnt of an emergency stop."""
HALTED: Final = STALL + STALL_TICKS * PERIOD + 0.5
"""The simulated real time in s within which a referee halts a match whose clock has stopped."""
OWED: Final = 1.0
"""The simulated real time in s within which play is halted after the referee or the world was started again."""
ANNOUNCED: Final = 0.5
"""The match time in s within which a call is announced that is in the journal."""
BACKWARDS: Final = 0.2
"""The speed in m/s above which a robot drives backwards, and is not just pushed."""
GIVEN_BACK: Final = LEASE + COMMAND_TIMEOUT + 0.5
"""The match time in s after the last command of a hand within which a robot does not drive backwards any more."""
_ENDING = (FaultKind.KILL, FaultKind.TORN)


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
        self._moved = 0.0
        self._numbers: set[int] = set()
        self._heard = 0
        self._told: set[str] = set()
        self._spans = Spans()
        self._slow = sum(fault.size for fault in match.faults if fault.kind is FaultKind.SLOW)
        self._starts: dict[str, int] = {}
        self._owes_halt: set[str] = set()
        match.heard = self.look
        if match.can is not None:
            from vrg_faults.can_checking import CanChecker  # noqa: PLC0415 - most matches have no CAN buses

            CanChecker(match, match.can, self._note, self._slow)

    def look(self) -> None:
        """Look at what the observer has heard."""
        self._look_at_time()
        self._look_at_calls()
        self._look_at_robots()
        self._look_at_held()
        self._look_at_hands()
        self._look_at_halts()

    def conclude(self) -> None:
        """Look at what is left of the match once it is over."""
        for process in self._match.processes.values():
            self.problems += process.failures
        self._look_at_end()
        self._look_at_journal()
        self._look_at_stops()

    def _look_at_end(self) -> None:
        """Once all faults are over, the match goes on, is over, or waits in a halt that has a reason."""
        match, observer = self._match, self._match.observer
        now = match.clock.now()
        silence = now - observer.heard_at
        if silence > SILENCE:
            self.problems.append(f"the referee was heard {silence:.1f} s before the end, and not since")
        faults_over = max((fault.begin + fault.length for fault in match.faults), default=0.0)
        state = observer.state
        if observer.over or now < faults_over + SETTLING or state is None:
            return
        if state.halted is None and now - self._moved > MOVES:
            self.problems.append(f"match time has stood still since {self._moved:.2f} s, and nothing is halted")
        if state.halted is not None:
            self.problems.append(
                f"{now - faults_over:.1f} s after all faults it is still halted, although an official has resumed play "
                f"{observer.resumed} times: {state.halted or 'without a reason'}"
            )

    def _look_at_journal(self) -> None:
        match, announced = self._match, self._match.observer.calls
        try:
            records = read_journal(match.folder.journal)[1]
            judgement, wrong = judge_run(match.setup, match.folder, records)
        except VrgError as error:
            self.problems.append(f"the journal or its evidence cannot be read: {error}")
            return
        self.problems += [f"judged again: {disagreement}" for disagreement in wrong]
        if judgement.unjudged and all(fault.kind is not FaultKind.FULL for fault in match.faults):
            self.problems.append(f"{judgement.unjudged} calls have no evidence")
        written = {call.number: call.text for record in records for call in record.calls}
        if sorted(written) != list(range(1, len(written) + 1)):
            self.problems.append(f"the calls of the journal are numbered {sorted(written)}")
        for call in announced:
            if written.get(call.number) != call.text:
                self.problems.append(f"call {call.number} was announced, and is not in the journal: {call.text}")
        late = {call.number for record in records if record.time > match.time - ANNOUNCED for call in record.calls}
        lost = [number for number in written if number not in self._numbers and number not in late]
        # An event that is asked for counts only if its sender was heard before. So if the router ends
        # just before the first call of a referee, its listeners may miss that call.
        ended = any((f.process == REFEREE and f.kind in _ENDING) or f.kind is FaultKind.ROUTER for f in match.faults)
        if lost and not ended:
            self.problems.append(f"calls {lost} are in the journal and were not announced")
        clocks = [record.standing.total for record in records]
        if any(after < before - 1e-9 for before, after in pairwise(clocks)):
            self.problems.append("the clock of the journal goes back")

    def _look_at_stops(self) -> None:
        """Robots stop after each HALT and each emergency stop, and stand until play goes on, as `vrg run stops` has it.

        What it has is compared with nothing here: if no robot moves, it must find none that does. A physical robot may
        be measured too seldom to know when it stood; its motors are looked at.
        """
        match = self._match
        certificate = certificate_of(match.setup, match.folder)
        for stop in certificate.stops:
            incident = certificate.incidents[stop.incident]
            where = f"{incident.kind} at {incident.time:.2f} s: {stop.robot}"
            if stop.again is not None:
                self.problems.append(f"{where} moved again after {stop.again:.2f} s")
            elif stop.robot not in match.setup.physical and stop.seconds - stop.resolution > STOPPED + self._slow:
                self.problems.append(f"{where} {stop.outcome}, after {stop.seconds:.2f} s")

    def _look_at_time(self) -> None:
        clock = self._match.observer.clock
        if clock is None:
            return
        if clock.epoch == self._time[0] and clock.time < self._time[1]:
            self._note(f"match time goes back from {self._time[1]:.2f} s to {clock.time:.2f} s in one epoch")
        if (clock.epoch, clock.time) != self._time:
            self._moved = self._match.clock.now()
        self._time = clock.epoch, clock.time

    def _look_at_calls(self) -> None:
        for call in self._match.observer.calls[self._heard :]:
            if call.number in self._numbers:
                self._note(f"call {call.number} is announced twice: {call.text}")
            self._numbers.add(call.number)
        self._heard = len(self._match.observer.calls)

    def _look_at_robots(self) -> None:
        """The robots of players that cannot command them stand, as all do without a referee or a link of the world.

        For robots with emulated drives, this looks at the motors; see `vrg_faults.can_checking`.
        It counts match time, which stands still with the world.
        """
        match, poses = self._match, self._match.observer.poses
        if poses is None:
            return
        bodies = [body for body in poses.body.bodies if not body.physical]
        for body in bodies:
            for name, bound in (
                (body.name, COMMAND_TIMEOUT),
                (REFEREE, REFEREE_TIMEOUT + COMMAND_TIMEOUT),
                (WORLD, COMMAND_TIMEOUT),
            ):
                unable = match.processes[name].unable
                since = 0.0 if unable is None else poses.stamp - unable
                slow = sum(f.size for f in match.faults if f.kind is FaultKind.SLOW and f.process in (name, WORLD))
                if since > bound + MARGIN + slow and body.stands is None and not at_rest(body.twist):
                    self._note(f"{body.name} is driven, though {name} has published nothing for {since:.2f} s")
        world, pressed = match.processes[WORLD], match.observer.pressed
        if pressed is None or world.unable is not None:
            return
        slow = sum(fault.size for fault in match.faults if fault.kind is FaultKind.SLOW and fault.process == WORLD)
        since = poses.stamp - max(pressed, world.able_since) - MARGIN - slow
        for body in bodies:
            if since > RETURNING and body.stands is None and not at_rest(body.twist):
                self._note(f"{body.name} is driven, though the emergency stop is engaged since {pressed:.2f} s")

    def _look_at_held(self) -> None:
        """The robot of a player that may not move stands, unless the referee leases it."""
        state, poses = self._match.observer.state, self._match.observer.poses
        if state is None or poses is None:
            return
        held = {player.name for player in state.players if not player.may_move and player.lease is None}
        for body in poses.body.bodies:
            passed = self._spans.passed(("held", body.name), body.name in held, poses.stamp)
            if passed > STOPPED + self._slow and body.stands is None and not body.physical and not at_rest(body.twist):
                self._note(f"{body.name} is driven, though it may not move for {passed:.2f} s")

    def _look_at_hands(self) -> None:
        """A robot that a person has driven backwards does not go on so when he sends nothing more."""
        poses, driven = self._match.observer.poses, self._match.observer.driven
        if poses is None:
            return
        for body in poses.body.bodies:
            since = poses.stamp - driven.get(body.name, poses.stamp)
            by_hand = body.name in self._match.observer.manual  # strategies drive backwards, too
            lasts = by_hand and since > GIVEN_BACK + self._slow and body.twist.v < -BACKWARDS
            if self._spans.passed(("hand", body.name), lasts, poses.stamp) > 2 * MARGIN:
                self._note(f"{body.name} drives backwards, though its person has sent nothing for {since:.2f} s")

    def _look_at_halts(self) -> None:
        """Play is halted when the world's clock has stopped, and after the world or the referee was started again."""
        match, state, now = self._match, self._match.observer.state, self._match.clock.now()
        world, referee = match.processes[WORLD], match.processes[REFEREE]
        if state is None or match.observer.over:
            return
        goes_on = state.halted is None and referee.unable is None
        if self._numbers:  # before the first call there is nothing that a new process could continue from
            self._owes_halt |= {p.name for p in (world, referee) if p.starts > self._starts[p.name]}
        self._starts = {p.name: p.starts for p in (world, referee)}
        if state.halted is not None:
            self._owes_halt.clear()
        if self._spans.passed("no clock", goes_on and world.unable is not None, now) > HALTED + self._slow:
            self._note("play goes on, though the world is away")
        for name in (WORLD, REFEREE):
            if self._spans.passed(name, goes_on and name in self._owes_halt, now) > OWED + self._slow:
                self._note(f"play goes on, though the {name} was started again")

    def _note(self, text: str) -> None:
        """Note a problem, each kind of it once."""
        kind = text.split(",", maxsplit=1)[0]
        if kind not in self._told:
            self._told.add(kind)
            self.problems.append(f"{self._match.clock.now():.2f} s: {text}")


def problems_of(setup: MatchSetup, seed: int, faults: Sequence[Fault], seconds: float) -> list[str]:
    """Play one match with some faults, and return what did not hold, in words.

    Args:
        seconds: the longest simulated real time, s.
    """
    with tempfile.TemporaryDirectory(prefix="vrg-fuzz-") as name:
        folder = Path(name) / "run"
        problems, journal = checked(setup, folder, seed, faults, seconds)
        clocks = [fault for fault in faults if fault.kind is FaultKind.CLOCK]
        if clocks and Machine.asked:
            # Some code has read the wall clock, perhaps of a library that was just loaded. So the match is played with
            # wall clocks that nobody sets, in the same folder, as journals name it.
            shutil.rmtree(folder)
            others = [fault for fault in faults if fault.kind is not FaultKind.CLOCK]
            if checked(setup, folder, seed, others, seconds)[1] != journal:
                problems.append(
                    f"the match depends on wall clocks, or on chance without a seed: {'; '.join(map(str, clocks))}"
                )
    return problems


def checked(
    setup: MatchSetup, folder: Path, seed: int, faults: Sequence[Fault], seconds: float
) -> tuple[list[str], bytes]:
    """Play one match in a folder, and return what did not hold, in words, and its journal."""
    run = RunFolder(folder)
    run.prepare()
    match = SimulatedMatch(setup, run, seed, faults)
    checker = Checker(match)
    try:
        match.run(seconds)
    except Exception as error:  # of a callback of a bus, which in a match of processes would be logged
        checker.problems.append(f"{match.clock.now():.2f} s: {type(error).__name__}: {error}")
    checker.conclude()
    return checker.problems, run.journal.read_bytes()


def shortest(faults: Sequence[Fault], fails: Callable[[Sequence[Fault]], bool]) -> list[Fault]:
    """The fewest of some faults with which a match still fails, by leaving out one after the other.

    Args:
        fails: plays the match with some faults.
    """
    kept = list(faults)
    for fault in faults:
        fewer = [other for other in kept if other is not fault]
        if fails(fewer):
            kept = fewer
    return kept
