"""VESCs on a bus: how they are recognised, and what they tell."""

import os

from vrg.hal.can.axis import Send
from vrg.hal.can.frame import Frame
from vrg.hal.can.vesc import codec
from vrg.hal.can.vesc.axis import VescAxis
from vrg.hal.can.vesc.codec import Comm, Packet
from vrg.hal.can.workshop.listener import ANSWER_PATIENCE, AxisListener, Claim, Found
from vrg.hal.clock import Clock

_TOLD = (Packet.STATUS, Packet.STATUS_2, Packet.STATUS_3, Packet.STATUS_4, Packet.STATUS_5, Packet.STATUS_6)


class VescListener(AxisListener):
    """See `Listener`. A drive is recognised by its status messages, or by its answer to a ping.

    It counts electrical revolutions, so that turns of the shaft are known to the wiring alone and not told here.
    """

    word = "vesc"
    title = "VESC"

    axis_type = VescAxis

    def __init__(self, send: Send, clock: Clock) -> None:
        super().__init__(send, clock)
        self._host = codec.host_of(os.getpid())

    def claim(self, frame: Frame) -> Claim:
        """A status message or a pong is likely one: other protocols may use the same identifiers."""
        if not frame.extended or frame.remote:
            return Claim.NONE
        packet, node = codec.packet_of(frame), codec.node_of(frame)
        if node == self._host:
            return Claim.LIKELY if packet == Packet.PONG or self.found else Claim.NONE
        return Claim.LIKELY if packet in _TOLD and len(frame.data) == 8 else Claim.NONE

    def hear(self, frame: Frame) -> None:
        """Take in a frame."""
        if codec.node_of(frame) != self._host:
            self._tell(codec.node_of(frame), frame)
        elif codec.packet_of(frame) == Packet.PONG:
            if frame.data and frame.data[0] in codec.NODES:
                self._tell(frame.data[0], frame)
        else:
            for number in list(self.found):
                self._tell(number, frame)

    def greet(self) -> None:
        """Ask every drive to show itself."""
        ping = Frame(codec.frame_id(Packet.PING, codec.BROADCAST), bytes([self._host]), extended=True)
        self._send(ping)

    def ask(self, node: Found) -> None:
        """Ask a drive for its version and its fault. Answers of several at once would get mixed up, so this waits."""
        axis = self.axes[node.node]
        axis.clear()  # it asks for the fault that there is now
        self._send(codec.ask_values(axis.host, node.node, codec.FLAGS_BIT))
        axis.serial = ""
        self._send(codec.ask(axis.host, node.node, bytes([Comm.FW_VERSION])))
        self._clock.wait(lambda: axis.serial, ANSWER_PATIENCE)

    def stop(self) -> None:
        """Let every drive go of its motor: all at once, and each that is known by its id as well."""
        for number in (codec.BROADCAST, *self.found):
            self._send(codec.setpoint(Packet.SET_CURRENT, number, 0), urgent=True)
