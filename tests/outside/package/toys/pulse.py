"""A motor protocol with the least that one may have: an axis, without an emulated drive and without a listener.

A drive of the id n sends whether it is on, its position and its speed as 0x300 + n, and hears setpoints as 0x200 + n.
"""

import struct

from vrg.hal.can.axis import Axis, MotorState
from vrg.hal.can.frame import Filter, Frame
from vrg.hal.can.protocols import Protocol

PROTOCOL = Protocol("pulse", axis="toys.pulse:PulseAxis")
REPORT, SETPOINT = 0x300, 0x200
_REPORT = struct.Struct("<?ee")


class PulseAxis(Axis):
    """A motor that turns by a setpoint. A setpoint switches the motor on, and an empty one off."""

    @classmethod
    def check_node(cls, node: int) -> str | None:
        return None if node in range(1, 100) else f"expected 1 to 99, got {node}"

    @property
    def filters(self) -> list[Filter]:
        return [Filter(REPORT + self.node, 0x7FF)]

    @property
    def identified(self) -> bool:
        return self.state is not MotorState.SILENT

    @property
    def problem(self) -> str | None:
        return None

    def receive(self, frame: Frame) -> None:
        if frame.id == REPORT + self.node and len(frame.data) == _REPORT.size:
            on, position, velocity = _REPORT.unpack(frame.data)
            self.heard, self.state = frame.at, MotorState.CLOSED_LOOP if on else MotorState.IDLE
            self._report_on(bool(on), frame.at)
            self._estimate(position, velocity, frame.at)

    def identify(self, patience: float) -> None:
        pass

    def prepare(self) -> None:
        pass

    def start(self) -> None:
        self.command(0.0)

    def command(self, velocity: float) -> None:
        self._send(Frame(SETPOINT + self.node, struct.pack("<f", velocity)))

    def idle(self) -> None:
        self._send(Frame(SETPOINT + self.node), urgent=True)

    def stop_now(self) -> None:
        self.idle()

    def clear(self) -> None:
        pass
