"""Sets a drive up before it may be started: its PDOs, its watchdog, its mode of operation."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import canopen

from vrg.errors import RobotError
from vrg.hal.can.cia402.codec import (
    CONTROL_PDO,
    EVENT_TIMER,
    MOTION_PDO,
    NODE_IDS,
    NODE_MASK,
    PROFILE_VELOCITY,
    SETPOINT_PDO,
    STATUS_PDO,
    SUPPLY_PDO,
    Control,
    Function,
    NmtCommand,
    Object,
    Pdo,
    nmt,
)
from vrg.hal.can.cia402.sdo import NoAnswerError, SdoClient
from vrg.hal.can.frame import Frame
from vrg.hal.clock import Clock
from vrg.hal.driver import COMMAND_TIMEOUT

DEADLINE = COMMAND_TIMEOUT
"""s without a setpoint after which the drive stops the motor."""
HEARTBEAT = 0.1
"""s between heartbeats."""
SDO_TIMEOUT = 3.0
"""s to wait for each answer. A drive answers within milliseconds; on a busy computer it is heard later."""
_MODE_TRIES, _MODE_PAUSE = 50, 0.01
"""The number of questions whether the drive has taken the mode of operation, and the time in s between two of them."""
_MISSING = range(0x0602_0000, 0x060A_0000)
"""SDO abort codes which mean that a drive does not have an object."""
_GO_ON, _HAVE_A_FAULT = 0, 1
"""The reactions of a drive to a lost network connection (0x6007)."""
_STAY = 1
"""The network state does not change when the master falls silent (0x1029)."""
_COMMANDS = (Function.RPDO1, Function.RPDO2)


class SetUp:
    """The steps of setting up one drive, in their order: `configure`, `begin`, `wait_for_mode`.

    Args:
        node: the drive's id. sdo: asks it. send: sends a frame. clock: the time by which it is waited for.
        unwatched: a person has allowed that this drive is driven without a watchdog of its own.

    Attributes:
        firmware: the version in words, after `configure`; empty where the drive does not tell it.
        tells_supply: whether the drive sends the voltage of its supply by itself, after `configure`.
        master: the id whose heartbeat the drive watches in place of a deadline for setpoints, after `configure`; None
            where it has such a deadline, or nothing at all.
    """

    def __init__(
        self, node: int, sdo: SdoClient, send: Callable[[Frame], None], clock: Clock, *, unwatched: bool = False
    ) -> None:
        self._node = node
        self._clock = clock
        self._unwatched = unwatched
        self._sdo = sdo
        self._send = send
        self.firmware = ""
        self.tells_supply = False
        self.master: int | None = None

    def configure(self) -> None:
        """Switch the motor off, and give the drive its PDOs, its watchdog and its mode of operation.

        Raises:
            RobotError: it refuses, or does not answer.
        """
        drive = self._sdo.remote
        with self._asking():
            drive.sdo[Object.CONTROLWORD].raw = Control.DISABLE_VOLTAGE
            # Drives let their PDOs be mapped only while they are pre-operational.
            self._send(nmt(self._node, NmtCommand.PRE_OPERATIONAL))
            self.firmware = self._text(Object.FIRMWARE)
            drive.sdo[Object.HEARTBEAT_TIME].raw = round(HEARTBEAT * 1000)
            _map(drive.rpdo[1], CONTROL_PDO, self._node)
            self._map_setpoints(drive.rpdo[2])
            # The drive sends its statusword whenever that changes, and at least this often. An encoder changes all the
            # time: the inhibit time keeps a drive that takes this for an event from filling the bus.
            _map(drive.tpdo[1], STATUS_PDO, self._node, every=0.05)
            _map(drive.tpdo[2], MOTION_PDO, self._node, every=0.01, inhibit=0.01)
            try:
                _map(drive.tpdo[3], SUPPLY_PDO, self._node, every=1.0, inhibit=0.5)
                self.tells_supply = True
            except canopen.SdoAbortedError as error:
                if error.code not in _MISSING:
                    raise
            self._react_when_cut_off()
            drive.sdo[Object.MODE].raw = PROFILE_VELOCITY

    def _react_when_cut_off(self) -> None:
        """Let a drive that would go on without a network have a fault; one without this object has it anyway."""
        option = self._sdo.remote.sdo[Object.ABORT_CONNECTION_OPTION]
        try:
            if option.raw == _GO_ON:
                option.raw = _HAVE_A_FAULT
        except canopen.SdoAbortedError as error:
            if error.code not in _MISSING:
                raise

    def _map_setpoints(self, pdo: canopen.pdo.PdoMap) -> None:
        """Map the PDO of the setpoints, with the deadline that is the drive's watchdog.

        A drive without such a deadline may watch the heartbeat of this master instead.

        Raises:
            RobotError: the drive can do neither.
        """
        try:
            _map(pdo, SETPOINT_PDO, self._node, every=DEADLINE)
            answer = f"{self._sdo.remote.sdo[Object.RPDO + 1][EVENT_TIMER].raw} ms"
        except canopen.SdoAbortedError as error:
            if error.code not in _MISSING:
                raise
            answer = f"that it has none ({error})"
            _map(pdo, SETPOINT_PDO, self._node)
        if answer == f"{round(DEADLINE * 1000)} ms":
            return
        if self._watch_master():
            self.master = master_of(self._node)
        elif not self._unwatched:
            raise RobotError(
                f"node {self._node}: expected a deadline of {DEADLINE:g} s for setpoints (0x1401:05), or for the "
                "heartbeat of the master (0x1016:01 and 0x6007), so that the drive stops the motor when none come; "
                f"of the first it says {answer}. If you can do without, write "
                'watchdog = "unsafe" in the wiring of this robot (`vrg can jog`: --unsafe)'
            )

    def _watch_master(self) -> bool:
        """Let the drive have a fault when this master falls silent; whether it can.

        It stays in its network state then, as after a late setpoint, where it has a choice (0x1029).
        """
        drive = self._sdo.remote
        wanted = master_of(self._node) << 16 | round(DEADLINE * 1000)
        try:
            drive.sdo[Object.CONSUMER_HEARTBEAT][1].raw = wanted
            drive.sdo[Object.ABORT_CONNECTION_OPTION].raw = _HAVE_A_FAULT
            kept = drive.sdo[Object.CONSUMER_HEARTBEAT][1].raw == wanted
            with suppress(canopen.SdoAbortedError):
                drive.sdo[Object.ERROR_BEHAVIOUR][1].raw = _STAY
        except canopen.SdoAbortedError:
            return False
        return kept and master_of(self._node) in NODE_IDS

    def begin(self) -> None:
        """Let the drive's PDOs begin."""
        self._send(nmt(self._node, NmtCommand.START))

    def wait_for_mode(self) -> None:
        """Wait until the drive has taken the mode of operation.

        Raises:
            RobotError: it does not, or it does not answer.
        """
        with self._asking():
            for _ in range(_MODE_TRIES):
                mode = self._sdo.remote.sdo[Object.MODE_DISPLAY].raw
                if mode == PROFILE_VELOCITY:
                    return
                self._clock.sleep(_MODE_PAUSE)
        raise RobotError(f"node {self._node}: expected profile velocity mode (0x6061), the drive stays in {mode}")

    @contextmanager
    def _asking(self) -> Iterator[None]:
        try:
            with self._sdo.transfer(SDO_TIMEOUT):
                yield
        except canopen.SdoAbortedError as error:
            index, subindex = self._sdo.asked
            raise RobotError(
                f"node {self._node}: the drive refuses to be set up: object 0x{index:04X}:{subindex:02X}: {error}"
            ) from None
        except NoAnswerError as error:
            raise RobotError(f"node {self._node}: expected the drive's answers while it is set up: {error}") from None

    def _text(self, index: int) -> str:
        try:
            return str(self._sdo.remote.sdo[index].raw)
        except canopen.SdoAbortedError:
            return ""


def master_of(node: int) -> int:
    """The id by whose heartbeat a drive knows its master: one for each drive, and none that it has itself.

    No other robot's master may keep it going. Another node with this id is found as the watchdog is proved.
    """
    return NODE_MASK - node


def _map(pdo: canopen.pdo.PdoMap, wanted: Pdo, node: int, *, every: float = 0.0, inhibit: float | None = None) -> None:
    """Map a PDO. canopen keeps the right order: off, its settings, no entries, each entry, how many, on.

    Args:
        every: s of its event timer, 0 = none, also for a drive that has no such timer.
        inhibit: s of its inhibit time. None leaves it as it is.
    """
    pdo.cob_id = wanted.function | node
    pdo.enabled, pdo.trans_type = True, 255
    pdo.event_timer = round(every * 1000)
    pdo.rtr_allowed = wanted.function in _COMMANDS  # the bit means nothing there
    pdo.inhibit_time = None if inhibit is None else round(inhibit * 10_000)
    pdo.clear()
    for index in wanted.objects:
        pdo.add_variable(index)
    try:
        pdo.save()
    except canopen.SdoAbortedError as error:
        if every or error.code not in _MISSING:
            raise
        pdo.event_timer = None
        pdo.save()
