"""Sets a drive up before it may be started: its PDOs, its watchdog, its mode of operation."""

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import canopen

from vrg.errors import RobotError
from vrg.hal.can.frame import Frame
from vrg.hal.clock import MonotonicClock
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg_drives.cia402 import codec
from vrg_drives.cia402.codec import Control, Function, NmtCommand, Object, Pdo
from vrg_drives.cia402.sdo import NoAnswerError, SdoClient

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
_READ_ONLY = 0x0601_0002
"""The SDO abort code for an object that cannot be written."""
_NO_REMOTE = 1 << 30
"""The bit of a COB-ID by which a PDO is not to be asked for."""
_GO_ON, _HAVE_A_FAULT = 0, 1
"""The reactions of a drive to a lost network connection (0x6007)."""
_STAY = 1
"""The network state does not change when the master falls silent (0x1029)."""
_COMMANDS = (Function.RPDO1, Function.RPDO2, Function.RPDO3)


class SetUp:
    """The steps of setting up one drive, in their order: `configure`, `begin`, `wait_for_mode`.

    Args:
        node: the drive's id. sdo: asks it. send: sends a frame. clock: the time by which it is waited for.
        unwatched: a person has allowed that this drive is driven without a watchdog of its own.
        outputs: the bits of its digital outputs that actuators are wired to.

    Attributes:
        firmware: the version in words, after `configure`; empty where the drive does not tell it.
        tells_supply: whether the drive sends the voltage of its supply by itself, after `configure`.
        master: the id whose heartbeat the drive watches in place of a deadline for setpoints, after `configure`; None
            where it has such a deadline, or nothing at all.
    """

    def __init__(
        self,
        node: int,
        sdo: SdoClient,
        send: Callable[[Frame], None],
        clock: MonotonicClock,
        *,
        unwatched: bool = False,
        outputs: int = 0,
    ) -> None:
        self._node = node
        self._clock = clock
        self._unwatched = unwatched
        self._outputs = outputs
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
        with self._asking():
            self._write(Object.CONTROLWORD, 0, Control.DISABLE_VOLTAGE, 2)
            # Drives let their PDOs be mapped only while they are pre-operational.
            self._send(codec.nmt(self._node, NmtCommand.PRE_OPERATIONAL))
            self.firmware = self._text(Object.FIRMWARE)
            self._write(Object.HEARTBEAT_TIME, 0, round(HEARTBEAT * 1000), 2)
            self._map(codec.CONTROL_PDO)
            self._map_setpoints()
            # The drive sends its statusword whenever that changes, and at least this often. An encoder changes all the
            # time: the inhibit time keeps a drive that takes this for an event from filling the bus.
            self._map(codec.STATUS_PDO, every=0.05)
            self._map(codec.MOTION_PDO, every=0.01, inhibit=0.01)
            try:
                self._map(codec.SUPPLY_PDO, every=1.0, inhibit=0.5)
                self.tells_supply = True
            except canopen.SdoAbortedError as error:
                if error.code not in _MISSING:
                    raise
            if self._outputs:
                self._map_outputs()
            self._react_when_cut_off()
            self._write(Object.MODE, 0, codec.PROFILE_VELOCITY, 1)

    def _react_when_cut_off(self) -> None:
        """Let a drive that would go on without a network have a fault; one without this object has it anyway."""
        try:
            if self._number(Object.ABORT_CONNECTION_OPTION, 0, 2) == _GO_ON:
                self._write(Object.ABORT_CONNECTION_OPTION, 0, _HAVE_A_FAULT, 2)
        except canopen.SdoAbortedError as error:
            if error.code not in _MISSING:
                raise

    def _map_outputs(self) -> None:
        """Switch the digital outputs off, let those that are wired follow 0x60FE:01, and map that.

        Without a mask the brake would follow it too, as it is bit 0.

        Raises:
            RobotError: the drive cannot do this.
        """
        try:
            self._write(Object.DIGITAL_OUTPUTS, 1, 0, 4)
            self._write(Object.DIGITAL_OUTPUTS, 2, self._outputs, 4)
            self._map(codec.OUTPUT_PDO)
        except canopen.SdoAbortedError as error:
            raise RobotError(
                f"node {self._node}: expected digital outputs with a mask that a PDO can carry (0x60FE:01 and 02), got "
                f"{error}: wire the actuator to another drive, or remove it from `outputs` in the wiring of this robot"
            ) from None

    def _map_setpoints(self) -> None:
        """Map the PDO of the setpoints, with the deadline that is the drive's watchdog.

        A drive without such a deadline may watch the heartbeat of this master instead.

        Raises:
            RobotError: the drive can do neither.
        """
        try:
            self._map(codec.SETPOINT_PDO, every=DEADLINE)
            answer = f"{self._number(Object.RPDO + 1, codec.EVENT_TIMER, 2)} ms"
        except canopen.SdoAbortedError as error:
            if error.code not in _MISSING:
                raise
            answer = f"that it has none ({error})"
            self._map(codec.SETPOINT_PDO)
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
        wanted = master_of(self._node) << 16 | round(DEADLINE * 1000)
        try:
            self._write(Object.CONSUMER_HEARTBEAT, 1, wanted, 4)
            self._write(Object.ABORT_CONNECTION_OPTION, 0, _HAVE_A_FAULT, 2)
            kept = self._number(Object.CONSUMER_HEARTBEAT, 1, 4) == wanted
            with suppress(canopen.SdoAbortedError):
                self._write(Object.ERROR_BEHAVIOUR, 1, _STAY, 1)
        except canopen.SdoAbortedError:
            return False
        return kept and master_of(self._node) in codec.NODE_IDS

    def begin(self) -> None:
        """Let the drive's PDOs begin."""
        self._send(codec.nmt(self._node, NmtCommand.START))

    def wait_for_mode(self) -> None:
        """Wait until the drive has taken the mode of operation.

        Raises:
            RobotError: it does not, or it does not answer.
        """
        with self._asking():
            for _ in range(_MODE_TRIES):
                mode = self._number(Object.MODE_DISPLAY, 0, 1, signed=True)
                if mode == codec.PROFILE_VELOCITY:
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
            return self._sdo.upload(index, 0).decode("ascii", "ignore").rstrip("\0")
        except canopen.SdoAbortedError:
            return ""

    def _number(self, index: int, sub: int, size: int, *, signed: bool = False) -> int:
        """The number of `size` bytes in an object; some drives send more bytes than it has."""
        return int.from_bytes(self._sdo.upload(index, sub)[:size], "little", signed=signed)

    def _write(self, index: int, sub: int, value: int, size: int) -> None:
        self._sdo.download(index, sub, value.to_bytes(size, "little"))

    def _map(self, pdo: Pdo, *, every: float = 0.0, inhibit: float | None = None) -> None:
        """Map a PDO in the right order: off, its settings, no entries, each entry, how many, on.

        Args:
            every: s of its event timer, 0 = none, also for a drive that has no such timer.
            inhibit: s of its inhibit time. None leaves it as it is.
        """
        commands = pdo.function in _COMMANDS
        number = pdo.function - Function.TPDO1 >> 8
        settings = (Object.RPDO if commands else Object.TPDO) + number
        mapping = settings + Object.RPDO_MAPPING - Object.RPDO
        # The bit that refuses remote frames means nothing in the PDOs that the drive hears.
        identifier = pdo.function | self._node | (0 if commands else _NO_REMOTE)
        self._write(settings, codec.COB_ID, identifier | codec.NOT_VALID, 4)
        self._write(settings, codec.TRANSMISSION, 255, 1)
        if inhibit is not None:
            self._write(settings, codec.INHIBIT, round(inhibit * 10_000), 2)
        try:
            self._write(settings, codec.EVENT_TIMER, round(every * 1000), 2)
        except canopen.SdoAbortedError as error:
            if every or error.code not in _MISSING:
                raise
        self._map_objects(mapping, pdo)
        self._write(settings, codec.COB_ID, identifier, 4)

    def _map_objects(self, mapping: int, pdo: Pdo) -> None:
        """Write the entries of a mapping. A drive whose number of entries is fixed gets empty ones too."""
        sizes = (8 * struct.calcsize(kind) for kind in pdo.packing.format.lstrip("<"))
        entries = [codec.mapping_entry(index, bits, pdo.sub) for index, bits in zip(pdo.objects, sizes, strict=True)]
        try:
            self._write(mapping, 0, 0, 1)
        except canopen.SdoAbortedError:
            entries += [0] * (self._number(mapping, 0, 1) - len(entries))
        for sub, entry in enumerate(entries, 1):
            self._write(mapping, sub, entry, 4)
        try:
            self._write(mapping, 0, len(entries), 1)
        except canopen.SdoAbortedError as error:
            if error.code != _READ_ONLY:
                raise


def master_of(node: int) -> int:
    """The id by whose heartbeat a drive knows its master: one for each drive, and none that it has itself.

    No other robot's master may keep it going. Another node with this id is found as the watchdog is proved.
    """
    return codec.NODE_MASK - node
