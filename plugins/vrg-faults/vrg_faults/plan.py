"""The faults of one simulated match, drawn by its seed."""

import enum
from collections.abc import Sequence
from random import Random
from typing import Final

from msgspec import Struct

WORLD, REFEREE, RECORDER = "world", "referee", "recorder"
"""The names of the processes that every match has, besides those of the players. The recorder's does not fail."""
EVERYONE: Final = "everyone"
"""In the place of a process where a fault is that of no process alone."""


class FaultKind(enum.StrEnum):
    """What fails.

    KILL ends a process at once, and it is started again after the fault. FREEZE stops it, and it goes on after the
    fault. Both come at once or in a tick, before anything of that is sent. CUT lets nothing pass over the line of a
    process, which both ends notice when the lease is over; RESET ends the link, which both notice at once. SLOW delays,
    LOSSY loses and DOUBLE doubles what comes over its line, and WRONG lets it come under other keys. CLOCK sets the
    wall clock of its machine. FULL and STALLED are the disk of the referee's journal, which takes nothing, or is not
    done. TORN ends the referee's process in the middle of a line. ROUTER ends the router, which is started again, and
    ESTOP is an emergency stop, which is released after the fault. HALT is one that an official calls. HAND is a person
    who drives a player backwards, and then sends nothing more.

    Where robots have emulated drives: a CAN bus is silent (all frames are lost), lossy, late, or off, which its adapter
    notices; and a drive is silent, frozen (it hears nothing either, and its motor is off), or starts again.
    """

    KILL = "kill"
    FREEZE = "freeze"
    CUT = "cut"
    RESET = "reset"
    SLOW = "slow"
    LOSSY = "lossy"
    DOUBLE = "double"
    WRONG = "wrong"
    CLOCK = "clock"
    FULL = "full"
    STALLED = "stalled"
    TORN = "torn"
    ROUTER = "router"
    ESTOP = "estop"
    HALT = "halt"
    HAND = "hand"
    BUS_SILENT = "bus-silent"
    BUS_LOSSY = "bus-lossy"
    BUS_LATE = "bus-late"
    BUS_OFF = "bus-off"
    DRIVE_SILENT = "drive-silent"
    DRIVE_FROZEN = "drive-frozen"
    DRIVE_RESTART = "drive-restart"


OF_DISK = (FaultKind.FULL, FaultKind.STALLED, FaultKind.TORN)
"""Those that only the referee has."""
OF_ALL = (FaultKind.ROUTER, FaultKind.ESTOP, FaultKind.HALT)
"""Those that are not of one process."""
OF_CAN = tuple(kind for kind in FaultKind if kind.startswith(("bus-", "drive-")))
"""Those that only robots with emulated drives have."""
SIZES: Final = {
    FaultKind.KILL: (0.0, 0.0, 1.0),
    FaultKind.FREEZE: (0.0, 0.0, 1.0),
    FaultKind.TORN: (0.0, 1.0),
    FaultKind.SLOW: (0.03, 0.15, 0.4),
    FaultKind.LOSSY: (0.1, 0.5, 1.0),
    FaultKind.DOUBLE: (0.1, 0.5, 1.0),
    FaultKind.BUS_LOSSY: (0.05, 0.3, 0.7),
    FaultKind.BUS_LATE: (0.01, 0.1, 0.3),
    FaultKind.CLOCK: (-7200.0, -60.0, 60.0, 7200.0),
}
"""The sizes that a fault may have."""


class Fault(Struct, frozen=True, omit_defaults=True):
    """One fault.

    Args:
        kind: what fails. process: whose, or EVERYONE.
        begin: when, simulated real time in s. length: for how long, s.
        size: of SLOW the delay in s, of LOSSY, DOUBLE and BUS_LOSSY the share of messages or frames, of
            BUS_LATE the longest delay in s, of CLOCK the s by which it is set; of
            KILL, FREEZE and TORN 1 in the next tick, 0 at once.
    """

    kind: FaultKind
    process: str
    begin: float
    length: float
    size: float = 0.0

    def __str__(self) -> str:
        size = f" {self.size:g}" if self.size else ""
        return f"{self.kind}{size} {self.process} from {self.begin:.2f} s for {self.length:.2f} s"


class Streams:
    """Random numbers by a seed and a label, so that one more draw in one place does not disturb any other."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def __call__(self, label: str) -> Random:
        """The numbers of a label."""
        return Random(f"{self._seed}:{label}")


def drawn(
    random: Random, players: Sequence[str], seconds: float, count: int, emulated: Sequence[str] = ()
) -> list[Fault]:
    """Faults of a match, in the order of time.

    Args:
        players: their names. seconds: the simulated real time within which they begin, s. count: how many.
        emulated: those of the players whose robots have emulated drives.
    """
    found, kinds = [], [kind for kind in FaultKind if emulated or kind not in OF_CAN]
    for _ in range(count):
        kind = random.choice(kinds)
        # Those that stop all robots are as often the ones that fail as all players.
        process = random.choice([WORLD, REFEREE, random.choice(players)])
        process = REFEREE if kind in OF_DISK else EVERYONE if kind in OF_ALL else process
        if kind is FaultKind.HAND:
            process = random.choice(players)
        if kind in OF_CAN:
            process = random.choice(list(emulated))
        length = random.choice((random.uniform(0.02, 0.4), random.uniform(0.4, 3.0)))
        size = random.choice(SIZES.get(kind, (0.0,)))
        begin = round(random.uniform(0.0, seconds), 3)
        found.append(Fault(kind, process, begin, round(length, 3), size))
    return sorted(found, key=lambda fault: fault.begin)
