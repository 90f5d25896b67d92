"""The referee's state, for what must know the players of a match before it is made."""

from typing import TYPE_CHECKING

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Keys

if TYPE_CHECKING:
    from vrg.bus.session import Session  # a match in one process has none, and does not load zenoh

POLL = 0.05
"""The real time in s between two looks at whether the referee has spoken."""


def first_state(session: "Session", keys: Keys, stop: StopSignal) -> RefereeState | None:
    """The referee's state, as soon as it speaks; None if that was interrupted."""
    from rich.console import Console  # noqa: PLC0415 - few processes wait for it

    mailbox = Mailbox()
    states = mailbox.subscribe(keys.referee_state)
    session.attach(mailbox)
    with Console(stderr=True).status("waiting for the referee"):
        while not stop.is_set():
            session.receive()
            mailbox.handover(0.0)
            if states.latest is not None:
                return states.latest.body
            stop.wait(POLL)
    return None
