"""A listener on the CAN bus of a match."""

from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.odrive import codec, messages

STANDING = 0.5
"""turn/s of a motor below which it stands: 1 cm/s of the wheel."""


class Tap:
    """Everything on a bus, as it comes; a context manager."""

    def __init__(self, link: Link) -> None:
        self.frames: list[Frame] = []
        self.bus = CanBus(link, self.frames.append)

    def __enter__(self) -> "Tap":
        self.bus.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bus.stop()

    def newest(self, node: int, command: messages.Command) -> messages.Message | None:
        """The newest of this kind."""
        wanted = codec.frame_id(node, command)
        found = next((f for f in reversed(self.frames) if f.id == wanted and not f.remote), None)
        return codec.decode(found) if found is not None else None

    def count(self, node: int, command: messages.Command, since: int = 0) -> int:
        """How many of this kind have come since frame number `since`."""
        return sum(f.id == codec.frame_id(node, command) for f in self.frames[since:])

    def setpoints(self, node: int, after: float) -> int:
        """How many were on the bus after this monotonic time: on a busy machine some wait to be heard."""
        wanted = codec.frame_id(node, messages.Command.SET_INPUT_VEL)
        return sum(f.id == wanted and f.at > after for f in self.frames)

    def _beats(self, node: int, since: int = 0) -> list[Frame]:
        """The heartbeats that a drive has sent. A remote frame asks for one, and is none."""
        wanted = codec.frame_id(node, messages.Command.HEARTBEAT)
        return [f for f in self.frames[since:] if f.id == wanted and not f.remote]

    def velocity(self, node: int) -> float:
        """turn/s, by the encoder; a motor that has not been heard does not stand."""
        estimate = self.newest(node, messages.Command.ENCODER_ESTIMATES)
        return estimate.velocity if isinstance(estimate, messages.EncoderEstimates) else float("inf")

    def errors(self, node: int) -> int:
        """By the newest heartbeat."""
        heartbeat = self.newest(node, messages.Command.HEARTBEAT)
        return heartbeat.error if isinstance(heartbeat, messages.Heartbeat) else 0

    def standing(self, *nodes: int) -> bool:
        """Whether these motors stand."""
        return all(abs(self.velocity(node)) < STANDING for node in nodes)
