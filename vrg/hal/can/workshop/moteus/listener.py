"""moteus controllers on a bus: how they are recognised, and what they tell."""

from vrg.hal.can.axis import NEVER
from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.moteus import codec
from vrg.hal.can.moteus.axis import HOST, STOP, MoteusAxis
from vrg.hal.can.moteus.codec import Kind, Resolution
from vrg.hal.can.moteus.registers import Register
from vrg.hal.can.workshop.listener import AxisListener, Claim, Found

_GREETING = (codec.read(Register.MODE, 1, Resolution.INT8), codec.read(Register.FAULT, 1, Resolution.INT16))


class MoteusListener(AxisListener):
    """See `Listener`. A drive is recognised by a CAN FD frame that tells registers. It speaks only when it is asked."""

    word = "moteus"
    title = "moteus"

    axis_type = MoteusAxis

    def claim(self, frame: Frame) -> Claim:
        """An answer of a drive is certainly one: no other protocol here has CAN FD frames."""
        source, destination, _ = codec.address_of(frame.id)
        if not codec.is_plain(frame) or not frame.fd or source not in codec.NODES or destination in codec.NODES:
            return Claim.NONE
        try:
            told = any(subframe.kind is Kind.REPLY for subframe in codec.decode(frame))
        except FrameError:
            told = False
        return Claim.CERTAIN if told or source in self.found else Claim.NONE

    def hear(self, frame: Frame) -> None:
        """Take in an answer."""
        number = codec.address_of(frame.id).source
        node = self._tell(number, frame)
        axis = self.axes[number]
        if axis.measured != NEVER:
            node.position, node.velocity = axis.position, axis.velocity

    def greet(self) -> None:
        """Ask every drive how it is."""
        self._send(codec.encode(HOST, codec.BROADCAST, _GREETING, reply=True))

    def ask(self, node: Found) -> None:
        """Ask a drive for its values; the answers come to `hear`, so that this waits for nothing."""
        self.axes[node.node].identify(0.0)

    def stop(self) -> None:
        """Stop every drive: all at once, and each that is known by its id as well."""
        for number in (codec.BROADCAST, *self.found):
            self._send(codec.encode(HOST, number, STOP), urgent=True)

    def rename(self, node: Found, serial: str, to: int) -> None:
        """Give a drive another id, which it keeps until it is switched off, unless it is saved.

        Raises:
            RobotError: it could not be sent.
        """
        order = codec.write(Register.MULTIPLEX_ID, [to], Resolution.INT8)
        self._send(codec.encode(HOST, node.node, [order]))
