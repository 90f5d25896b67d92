"""The buses and the time that everything here gets from outside: those of this computer, or simulated ones."""

from collections.abc import Callable, Iterable
from typing import Final, Protocol

from vrg.hal.can.frame import Filter, Frame
from vrg.hal.can.link import Link
from vrg.hal.clock import Clock

SEND_PATIENCE: Final = 0.02
"""s that a frame may wait for those before it; one that would wait longer is refused. A queue of ten frames is emptied
in half that time."""
QUIET: Final = 0.05
"""s without a frame that is wanted after which a bus tells that nothing waits to be heard."""


class Bus(Protocol):
    """One bus, as `vrg.hal.can.bus.CanBus` documents it.

    Attributes:
        link: how it is reached.
    """

    link: Link

    def start(self) -> None:
        """Open the bus and begin to listen. Idempotent.

        Raises:
            RobotError: there is no such interface or channel; says what to do.
        """

    def listen_to(self, wanted: Iterable[Filter] | None) -> None:
        """Drop all frames but those that one of the filters lets through; None hears everything again."""

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        """Send a frame within SEND_PATIENCE or never.

        Raises:
            RobotError: it could not be sent; says why.
        """

    def restart(self) -> str | None:
        """Bring the controller of a closed bus back if it is bus-off.

        Returns:
            why it still is, and what to do, in words; None where it is not, or where nobody can tell.
        """

    def stop(self) -> None:
        """Close the bus. Idempotent. Hold no lock that its callbacks want."""


class Medium(Protocol):
    """Buses and their time."""

    @property
    def clock(self) -> Clock:
        """The time of its buses."""

    def bus(
        self,
        link: Link,
        on_frame: Callable[[Frame], None],
        on_trouble: Callable[[str], None] = ...,
        on_quiet: Callable[[float], None] = ...,
    ) -> Bus:
        """Make a bus, which is not open yet; the arguments are those of `vrg.hal.can.bus.CanBus`."""
