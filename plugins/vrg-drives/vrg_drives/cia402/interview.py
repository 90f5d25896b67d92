"""Questions to a drive before it is set up: can it do what is wanted, and in which units does it report?"""

from vrg.hal.clock import MonotonicClock
from vrg_drives.cia402.codec import PROFILE, SERIAL_NUMBER, SUPPORTS_PROFILE_VELOCITY, Object
from vrg_drives.cia402.sdo import NoAnswerError, SdoClient
from vrg_drives.cia402.units import Cia402Options, Units, units

_QUESTIONS = (
    (Object.DEVICE_TYPE, 0), (Object.HEARTBEAT_TIME, 0), (Object.SUPPORTED_MODES, 0), (Object.ENCODER_RESOLUTION, 1),
    (Object.ENCODER_RESOLUTION, 2), (Object.VELOCITY_UNIT, 0), (Object.IDENTITY, SERIAL_NUMBER),
)  # fmt: skip
"""The serial number is last: a second drive's answer to it may come a little later."""
_TRIES = 3
"""The number of times that one question is sent in one go. Of two drives that share an id, the late answer of the one
to the question before may be taken for an answer to this one, which it does not fit."""


class Interview:
    """The questions to one drive and its answers.

    The heartbeat's period is not asked for but set, as drives come without a heartbeat.

    Args:
        sdo: asks the drive.
        heartbeat: the period of its heartbeat, ms.
        options: a person's options for the drive, which stand above its own objects.
        clock: the time by which answers are waited for.
    """

    def __init__(self, sdo: SdoClient, heartbeat: int, options: Cia402Options, clock: MonotonicClock) -> None:
        self._sdo = sdo
        self._clock = clock
        self._options = options
        self._period = heartbeat
        self._answers: dict[tuple[int, int], int | None] = {}
        self._serial_asked = 0

    def ask(self, patience: float) -> None:
        """Put the questions that have no answer yet. It ends early where an answer fails to come, or is a problem.

        Args:
            patience: s to wait in all.

        Raises:
            RobotError: a question could not be sent.
        """
        deadline = self._clock.now() + patience
        for question in _QUESTIONS:
            if question not in self._answers and (self.problem or not self._put(question, deadline)):
                return

    @property
    def complete(self) -> bool:
        """True if every question has its answer."""
        return all(question in self._answers for question in _QUESTIONS)

    @property
    def units(self) -> Units | None:
        """The units of the drive's numbers; None where they are not known, or make no sense."""
        increments, turns = (self._number(Object.ENCODER_RESOLUTION, sub) or 0 for sub in (1, 2))
        said = self._options
        counts, per = (increments, turns) if said.counts is None else (said.counts, 1)
        return units(counts, per, said.velocity_code or self._number(Object.VELOCITY_UNIT))

    @property
    def problem(self) -> str | None:
        """Why this drive cannot be used, as far as it has answered."""
        return self._identity_problem or (self._ability_problem if self.complete else None)

    def _put(self, question: tuple[int, int], deadline: float) -> bool:
        """Put a question, until monotonic time `deadline` at most; whether there is an answer."""
        for _ in range(_TRIES):
            left = deadline - self._clock.now()
            if left > 0:
                try:
                    self._answers[question] = self._answer(question, left)
                except NoAnswerError:
                    continue
                return True
        return False

    def _answer(self, question: tuple[int, int], timeout: float) -> int | None:
        """The answer to a question; None where the drive refuses it."""
        if question[0] == Object.HEARTBEAT_TIME:
            done = self._sdo.write(*question, self._period.to_bytes(2, "little"), timeout)
            return self._period if done else None
        self._serial_asked += question[0] == Object.IDENTITY
        data = self._sdo.read(*question, timeout)
        return None if data is None else int.from_bytes(data[:4], "little")  # some drives send more than it has

    @property
    def _identity_problem(self) -> str | None:
        serials = sorted(self._sdo.serials)
        if len(serials) > 1:
            return f"two drives have this id: serial numbers {serials[0]:X} and {serials[1]:X}; give one another id"
        if serials == [0] and self._sdo.serial_answers > self._serial_asked:
            return "two drives have this id, as both answer; give one another id"
        profile = (self._number(Object.DEVICE_TYPE) or 0) & 0xFFFF
        if (Object.DEVICE_TYPE, 0) in self._answers and profile != PROFILE:
            return f"expected a drive of profile {PROFILE} (device type, 0x1000), its profile is {profile}"
        return None

    @property
    def _ability_problem(self) -> str | None:
        modes = self._number(Object.SUPPORTED_MODES)
        if modes is not None and not modes & SUPPORTS_PROFILE_VELOCITY:
            return f"expected a drive with profile velocity mode, its modes (0x6502) are 0x{modes:X}"
        if self.units is not None:
            return None
        counts, turns = (self._number(Object.ENCODER_RESOLUTION, sub) for sub in (1, 2))
        unit = self._number(Object.VELOCITY_UNIT)
        reported = f"says 0x{unit:08X}" if unit else "says nothing"
        resolution = f"{counts} for {turns} turns" if counts is not None else "nothing"
        return (
            f"expected to know the units of its numbers: of its velocity it {reported} (0x60A9), of its encoder's "
            f"counts {resolution} (0x608F). Look them up in its manual, and write counts, for one turn of the motor, "
            'and velocity_unit, such as "1/min", into [backends.can.robots.<name>.options]'
        )

    def _number(self, index: int, sub: int = 0) -> int | None:
        return self._answers.get((index, sub))
