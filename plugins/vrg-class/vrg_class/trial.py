"""A try: a match of one process in its own process, whose players' code is sealed in further ones.

It ends once the goal is reached, or at the first error of the code: an announcement that a robot is disqualified for
an error looks as if it had broken a rule. It reports over its standard input what there is to see, as fast as the
match is played, in messages of JSON:

    about   the match, the own team and its players, and the colours of the page
    at      a match time, and those parts of the picture that have changed since the last one; see vrg.ui.web.parts
    call    a call of the referee
    print   what the code has printed
    view    what a player of the own team saw: expressions and their values
    error   what went wrong in the code, with its line
    end     how it ended, and whether the goal was reached
"""

import contextlib
import itertools
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct

from vrg.agents.strategy import ForfeitError, Strategy, View
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.config.setup import CheckedMatch, MatchSetup
from vrg.errors import VrgError
from vrg.launch.fork_server import ForkServer
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.playing.strategies import Strategies
from vrg.runs.run_folder import RunFolder
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.web import parts
from vrg_class.faults import ENDLESS, Fault, fault_of
from vrg_class.folder import CODE
from vrg_class.lesson import Goal
from vrg_class.progress import Progress
from vrg_class.seen import seen

FRAME: Final = 0.1
"""The match time in s between two pictures."""
LOOKED: Final = 0.2
"""The match time in s between two views of a player that are reported."""
PATIENCE: Final = 2.0
"""The real time in s that a decision may take."""
_DUMP: Final = 0.3
"""The real time in s that a process has to write where it hangs."""
FAILED: Final = "Stop/failed"
"""What a player reports as its mode when its code has failed."""
PRINTED: Final = 20_000
"""The number of letters that a try may print; more is left out."""
PRINTS: Final = 2_000
"""The number of lines that a try may print."""
_LINE: Final = 500
"""The number of letters of a line that is printed."""
_TRACES: Final = ("Traceback (most recent", "Current thread", "Thread 0x", "Fatal Python")
"""How lines begin that Python writes about a failure."""


class Kind(Struct, frozen=True):
    """The kind of a message."""

    t: str


_KINDS: Final = msgspec.json.Decoder(Kind)


def kind_of(text: str) -> str:
    """The kind of a message; empty if it is not one."""
    try:
        return _KINDS.decode(text).t
    except msgspec.DecodeError:
        return ""


class TrialSpec(Struct, frozen=True, kw_only=True):
    """A try that is to be played.

    Args:
        setup: of the match. team: the own team. goal: of the step, as a table; None without one.
        seconds: the match time after which it ends.
        sealed: False lets the code do all that the server can.
    """

    setup: CheckedMatch
    team: str
    goal: dict[str, Any] | None = None
    seconds: float
    sealed: bool = True


@dataclass(frozen=True)
class Watched(Strategies):
    """The strategies of a try: it notes what the own players see, and that a decision lasts too long.

    Args:
        own: the names of the own players. looked: called with a player and its view.
        hung: called when a decision has lasted too long; the log of its process will have the place.
    """

    own: frozenset[str] = frozenset()
    looked: Callable[[str, View], None] = lambda _player, _view: None
    hung: Callable[[], None] = lambda: None

    def maker(self, setup: MatchSetup, name: str) -> Callable[[], Strategy]:
        """See `Strategies`."""
        make = super().maker(setup, name)
        return (lambda: self._watched(make())) if name in self.own else make

    def _watched(self, strategy: Strategy) -> Strategy:
        act = strategy.act

        def watched(view: View) -> Any:
            self.looked(strategy.name, view)
            try:
                return act(view)
            except ForfeitError:
                self.hung()
                raise

        strategy.act = watched  # type: ignore[method-assign]
        return strategy


class Reporter(Node):
    """Reports what there is to see, and looks at the goal.

    Args:
        setup: of the match. team: the own team. goal: None without one. logs: the folder with what players print.
        send: sends a message, a text of JSON.

    Attributes:
        over: the goal is reached, or the code has failed.
    """

    kind = "spectator"

    def __init__(
        self, setup: MatchSetup, team: str, goal: Goal | None, logs: Path, send: Callable[[str], None]
    ) -> None:
        mailbox = Mailbox()
        super().__init__("class", mailbox, FRAME)
        self.own = frozenset(player.name for player in setup.players if player.team == team)
        keys = setup.keys
        self._inlets = SceneInlets(mailbox, keys)
        self._state, self._poses = mailbox.subscribe(keys.referee_state), mailbox.subscribe(keys.poses)
        sizes = {player.name: player.robot.size for player in setup.players}
        self._builder = SceneBuilder(sizes=sizes, obstacles=setup.obstacles)
        self.progress = None if goal is None else Progress(goal, team, self.own, sizes.keys() - self.own)
        self._send, self._logs = send, logs
        self._kept: dict[str, tuple[object, str]] = {}
        self._shown: dict[str, str] = {}
        self._read: dict[str, int] = {}
        self._left, self._rows = PRINTED, PRINTS
        self._looked: dict[str, float] = {}
        self.over = False
        about = {"t": "about", "match": setup.name, "team": team, "own": sorted(self.own), "colours": parts.colours()}
        send(parts.encode(about))

    def tick(self, tick: Tick) -> None:
        """Report what is new."""
        calls = [call for call in self._inlets.feed(self._builder) if call.rule != "refused"]
        scene = self._builder.build(live=True)
        texts = parts.parts(scene, self._kept)
        changed = [text for name, text in texts.items() if self._shown.get(name) != text]
        self._shown = texts
        self._send(f'{{"t":"at","time":{tick.time:.3f},"parts":[{",".join(changed)}]}}')
        for call in calls:
            self._send(f'{{"t":"call","time":{tick.time:.3f},"call":{parts.call(call, scene.game)}}}')
        printed = self._report_printed(tick.time)
        states, poses = self._state.take(), self._poses.take()
        if self.progress is not None and states:
            bodies = poses[-1].body.bodies if poses else ()
            self.progress.take(states[-1].body, bodies, calls, printed=printed)
        failed = any(player.name in self.own and player.mode == FAILED for player in scene.players)
        self.over = failed or (self.progress is not None and self.progress.reached is not None)

    def looked(self, player: str, view: View) -> None:
        """Report now and then what a player sees."""
        if view.time - self._looked.get(player, -LOOKED) >= LOOKED - 1e-6:
            self._looked[player] = view.time
            found = {"t": "view", "time": round(view.time, 3), "player": player, "values": seen(view)}
            self._send(parts.encode(found))

    def _report_printed(self, time: float) -> bool:
        """Report what own players have printed; whether there was anything."""
        found = False
        for name in sorted(self.own):
            path, before = self._logs / f"{name}.log", self._read.get(name, 0)
            with contextlib.suppress(OSError), path.open("rb") as file:
                file.seek(before)
                text = file.read(PRINTED + 1)
                self._read[name] = before + len(text)
                lines = text.decode("utf-8", "replace").splitlines()
                # What follows the first line about a failure is reported as such.
                for line in itertools.takewhile(lambda line: not line.startswith(_TRACES), lines):
                    if self._left <= 0 or self._rows <= 0:
                        break
                    found = True
                    self._left, self._rows = self._left - len(line), self._rows - 1
                    words = {"t": "print", "time": round(time, 3), "player": name, "text": line[:_LINE]}
                    self._send(parts.encode(words))
        return found


def _hung_at(logs: Path) -> int | None:
    """The line of the student's code in the last stack that a process has written; None if there is none."""
    time.sleep(_DUMP)
    wanted = re.compile(rf'File "[^"]*{re.escape(CODE)}", line (\d+)')
    for log in logs.glob("*.log"):
        with contextlib.suppress(OSError):
            found = wanted.search(log.read_text(errors="replace").rpartition("Current thread")[2])
            if found:
                return int(found[1])
    return None


def play(spec: TrialSpec, folder: RunFolder, send: Callable[[str], None], server: ForkServer | None) -> None:
    """Play a try, and report it.

    Args:
        folder: for what it leaves. send: sends a message. server: forks the processes of sealed strategies.
    """
    folder.prepare()
    goal = None if spec.goal is None else Goal.model_validate(spec.goal)
    reporter = Reporter(spec.setup, spec.team, goal, folder.logs, send)
    hung: list[int | None] = []
    strategies = Watched(
        server, strangers=spec.sealed, deadline=PATIENCE, own=reporter.own, looked=reporter.looked,
        hung=lambda: hung.append(_hung_at(folder.logs)),
    )  # fmt: skip
    faults: list[Fault] = []
    ended, winner, score = "", None, {}
    try:
        with open_journal(spec.setup, folder) as journal:
            ending = in_process.play(
                spec.setup.at_rate(1.0), journal, watchers=[reporter], limit=spec.seconds, logs=folder.logs,
                apart=strategies, pace=lambda _: not hung and not reporter.over,
            )  # fmt: skip
    except VrgError as error:
        faults.append(fault_of(str(error), CODE))
    else:
        faults += [fault_of(failure.text, CODE) for failure in ending.failures if failure.player in reporter.own]
        winner, score, ended = ending.state.winner, dict(ending.state.score), ending.state.ended or ""
    if hung:
        faults = [Fault(text=f"act took more than {PATIENCE:g} s", line=hung[0], kind=ENDLESS, limit=PATIENCE)]
    for fault in faults[:5]:
        send(parts.encode({"t": "error", **msgspec.to_builtins(fault)}))
    progress = reporter.progress
    found = None if progress is None else {
        "reached": progress.reached, "spoiled": progress.spoiled, "rule": progress.goal.never,
        "within": progress.goal.within,
    }  # fmt: skip
    send(parts.encode({"t": "end", "ended": ended, "winner": winner, "score": score, "goal": found}))


def main(arguments: Sequence[str]) -> int:
    """Play a try, as the main function of a process. On its standard input arrives a `TrialSpec` as JSON.

    Args:
        arguments: the folder for what it leaves.
    """
    pipe = Connection(os.dup(0))
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server decides what follows
    server = ForkServer()
    server.start_as_fork()
    try:
        spec = msgspec.json.decode(pipe.recv_bytes(), type=TrialSpec)
        play(spec, RunFolder(Path(arguments[0])), lambda text: pipe.send_bytes(text.encode()), server)
    except (BrokenPipeError, ConnectionResetError, EOFError):
        return 1  # nobody looks any more
    finally:
        server.close()
    pipe.close()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
