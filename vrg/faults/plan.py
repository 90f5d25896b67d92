"""The faults of one simulated match, drawn by its seed."""

import enum
from collections.abc import Sequence
from random import Random

from msgspec import Struct

WORLD, REFEREE = "world", "referee"
"""The names of the processes that every match has, besides those of the players."""


class Streams:
    """Random numbers by a seed and a label, so that one more draw in one place does not disturb any other."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def __call__(self, label: str) -> Random:
        """The numbers of a label."""
        return Random(f"{self._seed}:{label}")


class FaultKind(enum.StrEnum):
    """What fails.

    KILL ends a process at once, and it is started again after the fault. FREEZE stops it, and it goes on after the
    fault. CUT loses the link of a process. SLOW delays, LOSSY loses and DOUBLE doubles what comes over its link, and
    WRONG lets it come under other keys. FULL and STALLED are the disk of the referee's journal, which takes nothing, or
    is not done. TORN ends the referee's process in the middle of a line. CLOCK sets the time of day of a process. BUS
    silences the CAN bus of a robot, MUTE one of its drives, and REBOOT lets a drive start again.
    """

    KILL = "kill"
    FREEZE = "freeze"
    CUT = "cut"
    SLOW = "slow"
    LOSSY = "lossy"
    DOUBLE = "double"
    WRONG = "wrong"
    FULL = "full"
    STALLED = "stalled"
    TORN = "torn"
    CLOCK = "clock"
    BUS = "bus"
    MUTE = "mute"
    REBOOT = "reboot"


OF_DISK = (FaultKind.FULL, FaultKind.STALLED, FaultKind.TORN)
"""Those that only the referee has."""
OF_CAN = (FaultKind.BUS, FaultKind.MUTE, FaultKind.REBOOT)
"""Those that only robots with emulated drives have."""


class Fault(Struct, frozen=True, omit_defaults=True):
    """One fault.

    Args:
        kind: what fails. process: whose.
        begin: when, simulated real time in s. length: for how long, s.
        size: of SLOW the delay in s, of LOSSY and DOUBLE the share of messages, of CLOCK the step in s.
    """

    kind: FaultKind
    process: str
    begin: float
    length: float
    size: float = 0.0

    def __str__(self) -> str:
        size = f" {self.size:g}" if self.size else ""
        return f"{self.kind}{size} {self.process} from {self.begin:.2f} s for {self.length:.2f} s"


def drawn(
    random: Random, players: Sequence[str], seconds: float, count: int, physical: Sequence[str] = ()
) -> list[Fault]:
    """Faults of a match, in the order of time.

    Args:
        players: their names. seconds: the simulated real time within which they begin, s. count: how many.
        physical: those of the players whose robots have emulated drives.
    """
    found, kinds = [], [kind for kind in FaultKind if physical or kind not in OF_CAN]
    for _ in range(count):
        kind = random.choice(kinds)
        able = (REFEREE,) if kind in OF_DISK else physical if kind in OF_CAN else (WORLD, REFEREE, *players)
        process = random.choice(able)
        length = random.choice((random.uniform(0.02, 0.4), random.uniform(0.4, 3.0)))
        size = 0.0
        if kind is FaultKind.SLOW:
            size = random.choice((0.03, 0.15, 0.4))
        elif kind in (FaultKind.LOSSY, FaultKind.DOUBLE):
            size = random.choice((0.1, 0.5, 1.0))
        elif kind is FaultKind.CLOCK:
            size = random.choice((-86400.0, -90.0, 300.0, 7200.0))
        begin = round(random.uniform(0.0, seconds), 3)
        found.append(Fault(kind, process, begin, round(length, 3), size))
    return sorted(found, key=lambda fault: fault.begin)
