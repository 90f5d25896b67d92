"""An ODrive's axis without a drive, for tests: its frames are kept, and the test says what a drive would."""

from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.axis import OdriveAxis
from vrg.hal.can.odrive.messages import AxisState
from vrg.hal.simulated_clock import SimulatedClock

IDLE, CLOSED = AxisState.IDLE, AxisState.CLOSED_LOOP_CONTROL


class Wire:
    """An axis whose frames are kept, and what a drive would say to it."""

    def __init__(self, node: int = 4) -> None:
        self.sent: list[Frame] = []
        self.urgent: list[Frame] = []
        self.axis = OdriveAxis(node, self.send, SimulatedClock())

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        self.sent.append(frame)
        if urgent:
            self.urgent.append(frame)

    def hear(self, message: messages.Message, at: float = 1.0, node: int | None = None) -> None:
        frame = codec.encode(self.axis.node if node is None else node, message)
        self.axis.receive(Frame(frame.id, frame.data, at=at))

    def beat(self, state: int = IDLE, error: int = 0, at: float = 1.0) -> None:
        self.hear(messages.Heartbeat(error, state), at)

    def said(self) -> list[messages.Message]:
        """What was sent since the last call, but for questions."""
        sent, self.sent[:] = [codec.decode(f) for f in self.sent if not f.remote], []
        return sent
