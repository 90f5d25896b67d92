"""The life of one robot by a seed, and what is found in it."""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from vrg.bus.messages import Estop, EstopRelease, Recover
from vrg.errors import RobotError
from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.workshop.emulated import DriveOptions, EmulatedDrive
from vrg.hal.can.workshop.simulation import Simulation
from vrg.types import STILL, Twist
from vrg_faults.robot.faults import Faults
from vrg_faults.robot.judge import STOP_TIMEOUT, TURNING_SPEED, Judge, WrongError
from vrg_faults.robot.robot import KEYS, LINK, NODE_IDS, OTHER, Robot

EPISODES = 5
"""Sequences of faults in one life."""
REVIVE = 15.0
"""s within which a robot drives again when everything is well."""
_TICK, _CHECKS = 0.1, 5
"""s between two ticks of the player, and how often its motors are looked at in between."""
_CALM = 0.1
"""The share of episodes in which nothing goes wrong."""
_RECOVERIES = 3
"""The number of recoveries that a robot may need when everything is well: drives may still start."""
_BITRATES = (250_000, 500_000, 1_000_000)
_TWISTS = (Twist(0.33, 0.0), Twist(-0.3, 0.0), Twist(0.0, 0.6), Twist(0.2, 0.3), STILL)


@dataclass(frozen=True)
class Counterexample:
    """A sequence after which something is not as it must be, in one line.

    Args:
        protocol: of the drives. seed, episode: which sequence. time: simulated, s. words: what is wrong.
        faults: what had gone wrong in the episode, in words.
    """

    protocol: str
    seed: int
    episode: int
    time: float
    words: str
    faults: tuple[str, ...]

    def __str__(self) -> str:
        return (
            f"--protocol {self.protocol} --seed {self.seed}: episode {self.episode}, at {self.time:.2f} s: "
            f"{self.words}; faults: {', '.join(self.faults) or 'none'}"
        )


class Life:
    """The life of one robot.

    Args:
        protocol: the protocol's name. seed: of everything that happens.
        tell: called with what happens, in words.
    """

    def __init__(self, protocol: str, seed: int, tell: Callable[[str], None] = lambda _: None) -> None:
        self.protocol = protocol
        self.seed = seed
        self._tell = tell
        self._told: list[str] = []
        self._rng = random.Random(f"{protocol} {seed}")
        self._simulation = Simulation(strict=True)
        self._clock = self._simulation.clock
        spoken = PROTOCOLS.get(protocol)
        options = spoken.axis_type.options_type.model_validate(spoken.drive_type.wiring)
        self._drives: list[EmulatedDrive] = [
            spoken.drive_type(
                node, DriveOptions(serial=node, watchdog=0.25, protocol=options), 0.0, random.Random(f"{seed} {node}")
            )
            for node in NODE_IDS
        ]
        link = Link(interface=LINK.interface, channel=LINK.channel, bitrate=self._rng.choice(_BITRATES))
        # A drive of another robot speaks there, too.
        other = spoken.drive_type(OTHER, DriveOptions(serial=OTHER, protocol=options), 0.0, random.Random(f"{seed}"))
        self._simulation.wire(link).attach([*self._drives, other])
        self._faults = Faults(self._simulation, self._drives, self._rng, self._note)
        self._robot = Robot(self._simulation, protocol)
        self._judge = Judge(self._robot.device.features, self._drives, self._clock.now)
        self._twist = _TWISTS[0]
        self._frozen = self._dead = self._silent = False
        self._busy = 0

    def run(self) -> Counterexample | None:
        """Live it; what is found, if anything."""
        episode = 0
        try:
            self._revive()
            for episode in range(1, EPISODES + 1):  # noqa: B007 - it is told by what is found
                self._told.clear()
                self._go_wrong()
                self._be_well()
                self._fall_silent()
                self._revive()
        except WrongError as wrong:
            return self._finding(episode, str(wrong))
        except Exception as error:
            place = error.__traceback__
            while place is not None and place.tb_next is not None:
                place = place.tb_next
            where = "" if place is None else f" ({place.tb_frame.f_code.co_filename}:{place.tb_lineno})"
            return self._finding(episode, f"{error!r}{where}")
        finally:
            self._clock.close()
        return None

    def _finding(self, episode: int, words: str) -> Counterexample:
        return Counterexample(self.protocol, self.seed, episode, self._clock.now(), words, tuple(self._told))

    def _note(self, words: str) -> None:
        words = f"{words} at {self._clock.now():.2f} s"
        self._told.append(words)
        self._tell(words)

    def _pass(self, seconds: float) -> None:
        """Let time pass: the player ticks, and everything is judged."""
        end = self._clock.now() + seconds - 1e-9
        while self._clock.now() < end:
            self._tick()
            for _ in range(_CHECKS):
                self._clock.sleep(_TICK / _CHECKS)
                self._judge.look(awake=self._awake, strangers=self._faults.strangers > 0)

    @property
    def _awake(self) -> bool:
        return not (self._dead or self._frozen or self._silent)

    def _tick(self) -> None:
        if not self._awake:
            return
        if not self._robot.connected:
            try:
                self._robot.device.start()
            except RobotError as error:
                self._tell(f"{self._clock.now():.2f}: it cannot be connected: {error}")
                return
            self._robot.connected = True
        self._judge.ticked(*self._robot.tick(self._twist))

    # What happens in an episode.

    def _go_wrong(self) -> None:
        """Up to three things go wrong within a second, each for a while, and up to two seconds more pass.

        Raises:
            WrongError: a fault is reported though nothing is wrong with the robot.
        """
        self._twist = self._rng.choice(_TWISTS)
        self._pass(self._rng.choice((0.1, 0.3, 0.6)))
        faults = self._faults
        if self._rng.random() < _CALM:
            self._stay_well()
            return
        kinds = (
            *[faults.of_a_drive] * 6, faults.brown_out, faults.lose, faults.delay, faults.repeat, faults.spoil,
            faults.strange_frames, faults.other_master, faults.crowd, faults.trouble, self._be_busy, self._be_killed,
            self._estop,
        )  # fmt: skip
        chosen = self._rng.choices(kinds, k=self._rng.choice((1, 1, 2, 3)))
        for kind in chosen:
            kind()
            self._pass(self._rng.choice((0.0, 0.1, 0.4)))
        self._pass(self._rng.choice((0.4, 1.2, 2.0)))
        if all(kind == self._be_busy for kind in chosen):
            self._thaw(self._busy)
            self._pass(3 * _TICK)
            if self._judge.fault:
                raise WrongError(
                    f"its player did not run for a while, which is no fault, but it reports {self._judge.fault}"
                )

    def _stay_well(self) -> None:
        """Nothing goes wrong, so nothing may be reported.

        Raises:
            WrongError: something is.
        """
        for _ in range(20):
            self._pass(_TICK)
            if self._judge.reported:
                raise WrongError(f"nothing is wrong, but it reports {self._judge.fault or 'that it stops'}")

    def _be_well(self) -> None:
        """Nothing is wrong any more."""
        self._faults.end()
        self._thaw(self._busy)
        self._clock.sleep(0.02)
        # The last frame of a stranger, or a late one, may still be followed by a drive until its watchdog ends it.
        self._judge.forgive()

    def _fall_silent(self) -> None:
        """The player commands nothing any more: the motors must stand.

        Raises:
            WrongError: one does not.
        """
        self._silent = True
        self._pass(STOP_TIMEOUT)
        for drive in self._drives:
            velocity = drive.motor.velocity
            if abs(velocity) > TURNING_SPEED:
                raise WrongError(
                    f"motor {drive.node} turns at {velocity:.1f} turn/s {STOP_TIMEOUT:g} s after the last command"
                )
        self._silent = False

    def _revive(self) -> None:
        """An official releases the emergency stop and lets the robot recover: it must drive again.

        Where a stranger may have written settings into the drives, a person switches them off and on if nothing else
        helps.

        Raises:
            WrongError: it does not.
        """
        self._twist = _TWISTS[0]
        if self._dead:
            self._robot = Robot(self._simulation, self.protocol)
            self._dead = False
            self._judge.begin()
        end, asked, recoveries = self._clock.now() + REVIVE, -math.inf, 0
        while not all(drive.motor.velocity > 10.0 for drive in self._drives):
            if self._clock.now() > end:
                fault = self._judge.fault or "no fault"
                raise WrongError(f"it does not drive {REVIVE:g} s after everything was well again, and reports {fault}")
            if self._judge.reported and self._robot.connected and self._clock.now() - asked > 1.5:
                asked, recoveries = self._clock.now(), recoveries + 1
                if recoveries > _RECOVERIES and self._faults.written:
                    self._faults.switch_off_and_on()
                    end, recoveries = self._clock.now() + REVIVE, 0
                elif recoveries > _RECOVERIES:
                    raise WrongError(f"it has recovered {_RECOVERIES} times and still reports {self._judge.fault}")
                self._robot.hear(KEYS.estop_release, EstopRelease(by="fuzzer"))
                self._robot.hear(KEYS.recover("r"), Recover(by="fuzzer"))
            self._pass(_TICK)

    # Events that can happen to the player.

    def _be_busy(self) -> None:
        """The process of the player does not get to run for a while."""
        if self._frozen or self._dead:
            return
        seconds = self._rng.choice((0.1, 0.25, 0.5, 1.5))
        self._note(f"a player that does not run for {seconds:g} s")
        self._frozen = True
        self._robot.port.freeze()
        self._busy += 1
        self._clock.at(self._clock.now() + seconds, partial(self._thaw, self._busy))

    def _thaw(self, number: int) -> None:
        """The process that does not run for the `number`th time runs again, unless it has before."""
        if self._frozen and number == self._busy:
            self._frozen = False
            self._robot.port.thaw()

    def _be_killed(self) -> None:
        """The process of the player ends silently; the next one comes when everything is well."""
        if self._frozen or self._dead:
            return
        self._note("a killed player")
        self._dead = True
        self._robot.port.stop()

    def _estop(self) -> None:
        """The emergency stop of the match."""
        if self._frozen or self._dead:
            return
        self._note("an emergency stop")
        self._robot.hear(KEYS.estop, Estop(by="fuzzer"))
