"""A match as processes on one machine or several: how they are started, watched and stopped together."""

import contextlib
import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import (
    REASON_LENGTH,
    Official,
    OfficialAction,
    Processes,
    Pulse,
    RefereeState,
    Stage,
    shortened,
)
from vrg.bus.node import sender_of
from vrg.bus.process import PULSE_PERIOD
from vrg.bus.session import Session, open_session
from vrg.bus.stopping import StopSignal
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.files import write_json
from vrg.kinds import SPECTATOR
from vrg.launch.host import GROUPS, Host
from vrg.launch.listening import Listening
from vrg.launch.process_log import LogWarnings
from vrg.launch.running import RunningMatch, registered
from vrg.launch.vacancies import LAUNCHER, Vacancies
from vrg.runs.events import EventKind
from vrg.runs.run_folder import RunFolder
from vrg.seats.credentials import Credentials, find_credentials
from vrg.seats.seat import Seat, SeatKind
from vrg.types import few

LINGER = 1.0
"""The real time in s that all processes go on after the game is over, so that everybody hears how it ended."""
POLL_PERIOD = 0.05
"""The real time in s between two looks at the processes."""
_REPEAT_PERIOD = 0.5
"""The real time in s after which the referee is asked once more to halt play."""
_AWAITED = 10.0
"""The real time in s without another process that is ready after which those that are awaited are named."""
_LOOK = 0.02
"""The real time in s between two looks at whether starting processes are ready."""


class LaunchedMatch:
    """A match whose processes run on one machine or several.

    Args:
        setup: the match. folder: its run folder, on this machine.
        endpoint: the endpoint at which the router is started.
        hosts: the machines on which processes of the match run.
        announce: called with a text about each event that a person should know of.
        listening: what logs the events of the match. keys: the folder of the keys of the match's seats, if it has any.

    Attributes:
        state: the last state of the referee; None as long as there is none. folder, endpoint, keys: as given.
    """

    def __init__(
        self,
        setup: MatchSetup,
        folder: RunFolder,
        endpoint: str,
        hosts: Sequence[Host],
        announce: Callable[[str], None],
        listening: Listening,
        *,
        keys: Path | None = None,
    ) -> None:
        self._setup = setup
        self._announce = announce
        self._warnings = [LogWarnings(folder.logs / f"{name}.log") for name in setup.trackers]
        self.folder = folder
        self._hosts = hosts
        self._listening = listening
        self.keys = keys
        self.endpoint = endpoint
        self.state: RefereeState | None = None
        self._mailbox = Mailbox(sender_of(LAUNCHER, LAUNCHER))
        self._referee = self._mailbox.subscribe(setup.keys.referee_state)
        self._seats = Vacancies(
            self._mailbox,
            setup.keys,
            [player.name for player in setup.players],
            self._replace,
            announce,
            folder.logs,
            disqualify=setup.on_fault == "disqualify",
        )
        self._told = 0.0
        self._away: set[str] = set()
        self._halted_for: set[str] = set()
        self._asked = 0.0
        self._refused: Counter[str] = Counter()

    @property
    def names(self) -> list[str]:
        """The names of the processes."""
        return [name for host in self._hosts for name in host.names]

    def credentials_of(self, *seats: Seat) -> Credentials | None:
        """The credentials of the first of some seats that has keys; None in a match without seats.

        Raises:
            CredentialsError: none of them has any.
        """
        return None if self.keys is None else find_credentials(self.keys, seats)

    def serve(self, stop: StopSignal) -> bool:
        """Start the router; `run` starts the other processes.

        Returns:
            False if `stop` was set before the router answered; no process then runs.

        Raises:
            LaunchError: the router cannot serve at the endpoint; no process then runs.
        """
        served = False
        try:
            served = all(host.start_router(stop, self._keep) for host in self._hosts)
        finally:
            if not served:
                self._stop()
        return served

    def run(
        self,
        stop: StopSignal,
        *,
        progress: Callable[[str], None],
        started: Callable[[Session], None],
        ending: Callable[[], None],
        until_closed: Callable[[], None] | None,
    ) -> None:
        """Start, supervise and stop the processes of the match. No process is left behind, whatever happens.

        Args:
            stop: set it to break the match off.
            progress: called with the name of each process that is ready.
            started: called with the launcher's session when all processes are ready.
            ending: called before the processes are stopped.
            until_closed: called once when the game is over, and then all goes on until the window is closed, or asks
                to watch the match again; None ends the match with the game.

        Raises:
            LaunchError: a process does not start or dies too often.
        """
        try:
            opened = open_session(self.endpoint, stop=stop, credentials=self.credentials_of(Seat(SeatKind.LAUNCHER)))
            with opened as session, self._registered():
                self._refused = session.refused
                session.attach(self._mailbox)
                self._listening.attach(session)
                self._listening.note(EventKind.BEGAN)
                for host in self._hosts:
                    host.attach(session)
                if not self._start(session, stop, progress):
                    return
                started(session)
                over_since: float | None = None
                reported, names = False, self.names
                while not stop.wait(POLL_PERIOD):
                    for host in self._hosts:
                        host.poll()
                        self._look_for_trouble(host, session)
                    self._look(session)
                    self._tell_warnings()
                    if self.state is not None and self.state.stage is Stage.GAME_OVER:
                        over_since = over_since or time.monotonic()
                        if time.monotonic() - over_since < LINGER:
                            continue
                        if until_closed is None or SPECTATOR.process not in self.names or self.folder.again.exists():
                            break
                        if not reported:
                            reported = True
                            until_closed()
                    elif self.names != names:
                        names = self.names
                        self._announce("the match goes on; Ctrl-C ends it")
        finally:
            try:
                ending()
            finally:
                self._stop()
                self._listening.note(EventKind.ENDED)
                self._keep_refused()

    def _tell_warnings(self) -> None:
        """Announce why sources of fixes see nothing: elsewhere it is only seen that robots are lost."""
        for warnings in self._warnings:
            for text in warnings.new():
                self._announce(text)

    def _keep_refused(self) -> None:
        """Keep for the result what the launcher's own session has refused."""
        if self._refused:
            try:
                write_json(self.folder.logs / f"{LAUNCHER}.json", {"refused": dict(self._refused)})
            except OSError as error:
                self._announce(f"what the launcher has refused cannot be kept: {error}")

    def _start(self, session: Session, stop: StopSignal, progress: Callable[[str], None]) -> bool:
        """Start all processes but the router, each group when the one before is ready on all machines.

        Returns:
            False if the start was broken off.
        """
        for group in GROUPS:
            if stop.is_set():
                return False
            for host in self._hosts:
                host.begin(group)
            heard = time.monotonic()
            while any(host.starting for host in self._hosts):
                for host in self._hosts:
                    for name in host.started():
                        progress(name)
                        heard = time.monotonic()
                if time.monotonic() - heard > _AWAITED:
                    heard = time.monotonic()
                    awaited = [name for host in self._hosts for name in host.starting]
                    self._announce(f"waiting for {few(awaited)} to start (logs: {self.folder.logs})")
                self._look(session)
                if stop.wait(_LOOK):
                    return False
        return True

    def _look(self, session: Session) -> None:
        """Take in the messages of the bus and the events of the machines, and report them."""
        session.receive()
        self._listening.look()
        self._mailbox.handover(0.0)
        if self._referee.latest is not None:
            self.state = self._referee.latest.body
        now = time.monotonic()
        for host in self._hosts:
            for name, why in host.take_failed().items():
                self._seats.vacate(name, why, now)
        self._seats.look(now)
        if now - self._told >= PULSE_PERIOD:
            self._told = now
            keys = self._setup.keys
            self._mailbox.publish(
                keys.pulse(LAUNCHER, LAUNCHER), Pulse(ticks=0, missed=0, refused=session.refused.total())
            )
            statuses = tuple(status for host in self._hosts for status in host.statuses())
            self._mailbox.publish(keys.processes, Processes(processes=statuses))
        session.send(self._mailbox.collect())

    def _look_for_trouble(self, host: Host, session: Session) -> None:
        """Halt play when a machine stops answering: what follows is not its players' fault.

        The referee would otherwise take players out that have been silent for too long. It is asked at once, before
        anything else is done, and again until play is halted; once an official has continued play without the machine,
        it is not halted again because of it.
        """
        trouble, now = host.trouble, time.monotonic()
        if trouble is None:
            self._halted_for.discard(host.machine)
        elif host.machine not in self._halted_for and self.state is not None:
            if self.state.halted is not None or self.state.stage is Stage.GAME_OVER:
                self._halted_for.add(host.machine)
            elif now - self._asked >= _REPEAT_PERIOD:
                self._asked = now
                reason = shortened(trouble, REASON_LENGTH)
                halt = Official(action=OfficialAction.HALT, by=LAUNCHER, reason=reason)
                self._mailbox.publish(self._setup.keys.official, halt)
                session.send(self._mailbox.collect())
        if (trouble is not None) != (host.machine in self._away):
            self._away ^= {host.machine}
            self._listening.note(EventKind.BACK if trouble is None else EventKind.AWAY, host.machine, trouble or "")

    def _replace(self, name: str, strategy: str) -> None:
        """Let a player play by another strategy.

        Raises:
            LaunchError: its process cannot be started.
        """
        for host in self._hosts:
            if name in host.names:
                host.play(name, strategy)
                return
        raise LaunchError("its machine does not answer; try again when it does", name)

    def _stop(self) -> None:
        """Stop all processes on all machines, players first and the router last."""
        try:
            for order in sorted({order for host in self._hosts for order in host.stop_orders}):
                for host in self._hosts:
                    host.stop(order)
                for host in self._hosts:
                    host.wait_stopped(order, self._keep)
        finally:
            for host in self._hosts:
                host.fetch()
            for host in self._hosts:
                try:
                    host.close(self._keep)
                except (LaunchError, OSError) as error:
                    self._announce(f"{host.machine}: {error}")

    def _keep(self) -> None:
        """Let all machines know that the launcher lives, while it waits for one of them."""
        for host in self._hosts:
            host.keep()

    def _registered(self) -> contextlib.AbstractContextManager[None]:
        return registered(
            RunningMatch(
                match=self._setup.name,
                router=self.endpoint,
                run=str(self.folder.path.resolve()),
                pid=os.getpid(),
                folder=str(Path.cwd()),
                keys="" if self.keys is None else str(self.keys.resolve()),
            )
        )
