"""The contract between the launcher and a machine on which processes of a match run."""

from collections.abc import Callable, Collection, Sequence
from typing import Protocol

from vrg.bus.messages import ProcessStatus
from vrg.bus.session import Session
from vrg.bus.stopping import StopSignal

GROUPS = (1, 2)
"""Processes of the first group are started on all machines before those of the second group on any."""


class Host(Protocol):
    """A machine. The supervisor is one, for the launcher's own machine; see `vrg.launch.remote` for the others.

    Attributes:
        machine: its name in the match file.
    """

    machine: str

    @property
    def names(self) -> Sequence[str]:
        """The names of its processes, without those that have ended and are not started again."""

    def keep(self) -> None:
        """Let the agent there know that the launcher lives; called at least every few seconds."""

    def start_router(self, stop: StopSignal, meanwhile: Callable[[], None]) -> bool:
        """Start the router, if it runs there, and wait until it answers. Return False if `stop` was set before.

        Args:
            meanwhile: called again and again while it waits.

        Raises:
            LaunchError: the router ended or makes no progress, for example because another one has its endpoint.
        """

    def attach(self, session: Session) -> None:
        """Use this session of the launcher, which is connected to the router."""

    def begin(self, group: int) -> None:
        """Start all processes of a group. Then call `started` again and again until nothing is `starting`.

        Raises:
            LaunchError: a process cannot be started.
        """

    @property
    def starting(self) -> Collection[str]:
        """The names of the processes that were begun and are not ready yet."""

    def started(self) -> list[str]:
        """Look once at the processes that are starting, and name those that have become ready since.

        Raises:
            LaunchError: a process ended before it was ready, or makes no progress. The message has the end of its log.
        """

    def poll(self) -> None:
        """Look at all processes once: restart those that have died, and kill those that hang.

        Raises:
            LaunchError: an essential process has died too often.
        """

    @property
    def trouble(self) -> str | None:
        """Why the machine cannot be relied on now, in words; None if it can. Play is then halted."""

    def take_failed(self) -> dict[str, str]:
        """The players that have failed for good since the last call, each with the reason."""

    def play(self, name: str, strategy: str) -> None:
        """Let a player of this machine play by another strategy, in a new process.

        Raises:
            LaunchError: it cannot be started.
        """

    def statuses(self) -> list[ProcessStatus]:
        """The state of each of its processes."""

    @property
    def stop_orders(self) -> Collection[int]:
        """The numbers for `stop`."""

    def stop(self, order: int) -> None:
        """Ask the processes of one number to stop."""

    def wait_stopped(self, order: int, meanwhile: Callable[[], None]) -> None:
        """Wait until the processes of one number have stopped. One that does not stop in time is killed."""

    def fetch(self) -> None:
        """Begin to bring what the processes there have written into the run folder."""

    def close(self, meanwhile: Callable[[], None]) -> None:
        """Stop whatever still runs there, and wait until everything was fetched. Idempotent."""
