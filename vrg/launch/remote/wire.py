"""The messages between the launcher and the agent of another machine, and their form in a byte stream.

A frame is the length of what follows, four bytes, the most significant first, and one message as MessagePack.
"""

from typing import Generic, TypeVar

import msgspec
from msgspec import Struct

from vrg.bus.messages import ProcessStatus
from vrg.errors import MessageError
from vrg.plugins import Finding
from vrg.runs.events import EventKind
from vrg.types import printable

BANNER = b"vrg-host\n"
"""The text that the agent writes before its first frame. Anything that a login shell has printed before is skipped."""
MAX_MESSAGE_SIZE = 1 << 20
"""The length of the longest message, bytes."""
PART = 1 << 18
"""The length of the longest part of a file that one message carries, bytes."""


class FilePart(Struct, frozen=True, tag=True):
    """A part of a file of the run folder, in either direction.

    Args:
        path: the path in the run folder, with `/` between its parts. data: its next bytes.
        begins: True if this is its first part.
    """

    path: str
    data: bytes
    begins: bool


class Prepare(Struct, frozen=True, tag=True):
    """The first order: make a run folder. `FilePart`s and `Load` follow.

    Args:
        run: the name of the run, which no other run has. machine: the name of the machine in the match file.
        display: the display for windows there; None to take what is found.
        address: the address or name of that machine for its router; None if it runs none, or to take the one of ssh.
        window: True if a spectator is opened on some machine. record: True if some machine runs the recorder.
        secret: the secret of the match, see `vrg.config.setup.MatchSetup`.
        logs: how many bytes of each log the launcher has already, by the log's name without its ending.
        examine: True checks whether the match can be played there.
    """

    run: str
    machine: str
    display: str | None
    address: str | None
    window: bool
    record: bool
    secret: str
    logs: dict[str, int]
    examine: bool = False


class Load(Struct, frozen=True, tag=True):
    """Read the match file; `Loaded` comes before `Done`."""


class Serve(Struct, frozen=True, tag=True):
    """Start the router at this endpoint, if it runs there.

    Args:
        upstream: the endpoint of the router of the match, if this is a further one.
    """

    endpoint: str
    upstream: str | None


class Join(Struct, frozen=True, tag=True):
    """Connect to the router."""


class Begin(Struct, frozen=True, tag=True):
    """Start the processes of a group; done when all are ready.

    Args:
        vacant: the players that have failed for good, which are not started until they play by another strategy
            (`Play`). Some may run elsewhere.
    """

    group: int
    vacant: list[str]


class Play(Struct, frozen=True, tag=True):
    """Let a player play by another strategy, in a new process; its files have come before."""

    name: str
    strategy: str


class KeyFile(Struct, frozen=True, tag=True):
    """A file of the keys of a seat on that machine. It is kept apart from the run folder, and deleted at the end;
    where the agent is killed before, the next agent on that machine deletes it.

    Args:
        seat: the common name of the seat. name: of the file.
    """

    seat: str
    name: str
    data: bytes


class StopOrder(Struct, frozen=True, tag=True):
    """Stop the processes of a number."""

    order: int


class Fetch(Struct, frozen=True, tag=True):
    """Send what the processes have written, as `FilePart`s."""


class Goodbye(Struct, frozen=True, tag=True):
    """The last order: delete the run folder there, and end."""


class Beat(Struct, frozen=True, tag=True):
    """The launcher lives. Without it, the agent stops all processes.

    Args:
        sent: the launcher's monotonic time, s, which the agent sends back.
    """

    sent: float


ToAgent = FilePart | KeyFile | Prepare | Load | Serve | Join | Begin | Play | StopOrder | Fetch | Goodbye | Beat


class Hello(Struct, frozen=True, tag=True):
    """The first message of the agent.

    Args:
        version: the version of VRG there. peer: the launcher's address, as it is seen there; empty if it is not known.
        home: the folder there for the folders of runs.
    """

    version: str
    peer: str
    home: str


class Loaded(Struct, frozen=True, tag=True):
    """The facts about that machine once `Load` is done.

    Args:
        endpoint: a free endpoint for a router; empty if none runs there.
        findings: what was found out about it, if that was asked for.
    """

    endpoint: str
    findings: list[Finding]


class Done(Struct, frozen=True, tag=True):
    """An order is done, and so are all before it. `FilePart`, `KeyFile` and `Beat` are not answered.

    Args:
        order: its number among the messages of this connection to the agent; the first is number 1.
    """

    order: int


class Failed(Struct, frozen=True, tag=True):
    """An order cannot be done, or the match cannot go on.

    Args:
        text: the reason, in words.
    """

    text: str


class Notice(Struct, frozen=True, tag=True):
    """An event that a person should know of."""

    text: str


class Noted(Struct, frozen=True, tag=True):
    """Something has happened to a process; see `vrg.runs.events.Notes`."""

    what: EventKind
    process: str
    text: str = ""
    status: int | None = None
    at_next_clock: bool = False


class LogText(Struct, frozen=True, tag=True):
    """The text that was added to the log of a process.

    Args:
        name: of the log, without its ending. text: what was added. end: the size of the log there with it, bytes.
    """

    name: str
    text: bytes
    end: int


class Status(Struct, frozen=True, tag=True):
    """The states of the processes, which also show that the agent lives; twice a second.

    Args:
        beat: `Beat.sent` of the newest beat. held: how long ago that arrived, s.
        wall: the wall clock there, s since 1970.
    """

    processes: list[ProcessStatus]
    beat: float
    held: float
    wall: float


ToLauncher = FilePart | Hello | Loaded | Done | Failed | Notice | Noted | LogText | Status


M = TypeVar("M")


def frame(message: Struct) -> bytes:
    """The frame of a message.

    Raises:
        ValueError: it is too long.
    """
    data = msgspec.msgpack.encode(message)
    if len(data) > MAX_MESSAGE_SIZE:
        raise ValueError(f"expected a message of at most {MAX_MESSAGE_SIZE} bytes, got {len(data)}")
    return len(data).to_bytes(4, "big") + data


class Frames(Generic[M]):
    """Cuts a byte stream into messages: `feed` takes it in, and `next` takes out one message after the other.

    Args:
        kind: the union of the types of the messages. banner: what precedes the first frame; all before it is skipped.

    Attributes:
        banner: as long as that has not come; empty afterwards.
        skipped: the last bytes that came before the banner, for a message about why it did not come.
    """

    def __init__(self, kind: type[M], banner: bytes = b"") -> None:
        self._decoder = msgspec.msgpack.Decoder(kind)
        self.banner = banner
        self._data = bytearray()
        self.skipped = b""

    def feed(self, data: bytes) -> None:
        """Take in bytes."""
        self._data += data
        if self.banner:
            before, banner, rest = self._data.partition(self.banner)
            self.skipped = bytes(before[-2000:])
            # The banner may come in pieces.
            self._data = rest if banner else before[-2000:]
            if banner:
                self.banner = b""

    def next(self) -> M | None:
        """The next message; None until all of it has arrived.

        Raises:
            MessageError: the next bytes are no frame of this release.
        """
        if self.banner or len(self._data) < 4:
            return None
        end = 4 + int.from_bytes(self._data[:4], "big")
        if end > 4 + MAX_MESSAGE_SIZE:
            raise MessageError(f"expected a frame of at most {MAX_MESSAGE_SIZE} bytes, got one of {end - 4}")
        if len(self._data) < end:
            return None
        data = bytes(self._data[4:end])
        del self._data[:end]
        try:
            return self._decoder.decode(data)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise MessageError(f"expected a message of this release of VRG: {printable(str(error))}") from None
