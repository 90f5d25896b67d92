"""The process of a strategy that decides apart from its match: it makes the strategy, and answers each view.

`vrg.playing.apart` is the side of the match. From there come an `Assignment` as JSON and then views, as
`vrg.playing.question` packs them. Back go messages of `Answer` as MessagePack, and nothing that would be run: a
student's code may write there, too. Four bytes before each tell its length, the most significant first.
"""

import contextlib
import logging
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec
from msgspec import Struct

from vrg import __version__
from vrg.agents.messages import Once, Payload, sendable
from vrg.agents.strategy import Strategy, decided
from vrg.blame import failure_of, tell_of_refusals
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, StrategyError, VrgError
from vrg.launch.process_log import LOG_FORMAT
from vrg.launch.sandbox.bounds import BoundedOutput, bounded_memory, printing_to, say_where_on_request
from vrg.launch.sandbox.player_policy import policy_of
from vrg.launch.sandbox.seal import REFUSAL_ADVICE, seal
from vrg.launch.strategy_class import strategy_class, strategy_of
from vrg.playing.question import Answering, Wanted
from vrg.runs.run_folder import RunFolder


class Assignment(Struct, frozen=True):
    """The ingredients of a strategy: the set-up of its player's process, the player, and the run folder.

    Args:
        sealed: True seals the process before. make: False only imports the class.
        in_player: it is that of a player's process: what it logs, from INFO on, is among what it prints, and if it is
            sealed it gets one processor core, on which it comes behind others.
        keys: the path of the folder of the keys of the match's seats, of which it is to see nothing; empty for none.
        version: that of VRG. files: those that another machine needs, by their paths.
    """

    setup: MatchSetup
    name: str
    run: str
    sealed: bool
    make: bool
    in_player: bool = False
    keys: str = ""
    version: str = __version__
    files: Mapping[str, bytes] = {}


class Ready(Struct, frozen=True, tag=True):
    """The strategy has been made; errors of its answers have this text, with what is wrong in place of `{}`."""

    priorities: tuple[str, ...]
    complaint: str


class Decision(Struct, frozen=True, tag=True):
    """The decision of the strategy.

    Args:
        motion: v, w, side and climb of its twist. Any numbers pass here, as they do where the strategy is in the
            process of its player, which is the one to judge them.
    """

    motion: tuple[float, float, float, float]
    payload: Payload
    mode: str


class Failed(Struct, frozen=True, tag=True):
    """It could not be made, or has raised something; `final` as in `StrategyError`."""

    words: str
    final: bool


Answer = Ready | Decision | Failed | Wanted


class _Pipe:
    """The two directions of the pipe to the match."""

    def __init__(self, reader: int, writer: int) -> None:
        self._reader, self._writer = Connection(reader, writable=False), Connection(writer, readable=False)
        self._sending = threading.Lock()
        self.receive = self._reader.recv_bytes

    def send(self, answer: Answer) -> None:
        """Send an answer, or a question of any thread."""
        with self._sending:
            self._writer.send_bytes(msgspec.msgpack.encode(answer))


def main(_arguments: Sequence[str] = ()) -> int:
    """Be the process of a strategy of a match on this machine: see `decide`. The standard input goes both ways."""
    return decide(os.dup(0), os.dup(0))


def decide(reader: int, writer: int, placed: Callable[[Assignment], Assignment] = lambda assignment: assignment) -> int:
    """Make a strategy, and answer until the match closes its end.

    Args:
        reader, writer: the descriptors by which it hears the match and answers it.
        placed: what becomes of the assignment before; it may raise a ConfigError.
    """
    from setproctitle import setproctitle  # noqa: PLC0415 - the fork server, which imports this, keeps its name

    pipe = _Pipe(reader, writer)
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    say_where_on_request()
    time = [0.0]
    try:
        assignment = placed(msgspec.json.decode(pipe.receive(), type=Assignment))
        setproctitle(f"vrg strategy {assignment.name} in {Path(assignment.run).name}")
        if not assignment.in_player:
            _wait_for_others()
        if assignment.sealed:
            keys = Path(assignment.keys) if assignment.keys else None
            seal(
                policy_of(
                    assignment.setup,
                    assignment.name,
                    run=RunFolder(Path(assignment.run)),
                    keys=keys,
                    pinned=assignment.in_player,
                )
            )
            tell_of_refusals(REFUSAL_ADVICE)
        sys.stdout.reconfigure(line_buffering=True, encoding="utf-8", errors="backslashreplace")  # type: ignore[union-attr]
        # The seal bounds memory, too.
        memory = contextlib.nullcontext() if assignment.sealed else bounded_memory(assignment.setup.memory)
        with memory, printing_to(BoundedOutput(sys.stdout, lambda: time[0])):
            if not assignment.make:
                strategy_class(assignment.setup.player(assignment.name).strategy, Path(assignment.setup.base))
                pipe.send(Ready((), ""))
                return 0
            if assignment.in_player:
                logging.basicConfig(level=logging.INFO, format=LOG_FORMAT)
            strategy = strategy_of(assignment.setup, assignment.name)
            pipe.send(Ready(tuple(map(str, strategy.priorities)), str(strategy.complaint("{}"))))
            _answer(strategy, pipe, time)
    except EOFError:
        pass
    except BaseException as error:  # a student's code may raise anything, also while it is imported
        failure = error if isinstance(error, VrgError) else failure_of(error)
        final = isinstance(failure, StrategyError) and failure.final
        if not isinstance(error, ConfigError):
            traceback.print_exception(failure.__cause__ or failure, file=sys.__stdout__)
        with contextlib.suppress(OSError):
            pipe.send(Failed(str(failure), final))
    return 0


def _wait_for_others() -> None:
    """Interrupt nobody who sends this process something, and so goes on to send the views of the others first."""
    if hasattr(os, "SCHED_BATCH") and os.sched_getscheduler(0) == os.SCHED_OTHER:
        with contextlib.suppress(OSError):  # a container may forbid it
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _answer(strategy: Strategy, pipe: _Pipe, time: list[float]) -> None:
    """Decide whenever a view comes.

    Args:
        time: its only item is set to the match time, s.

    Raises:
        StrategyError: the strategy has failed. EOFError: the pipe is closed.
    """
    asked = Answering(pipe.receive, pipe.send)
    warn_once = Once()
    while True:
        view = asked.view()
        time[0] = view.time
        action, mode = decided(strategy, view)
        payload, problems = sendable(action)
        for problem in problems:
            if warn_once(problem):
                print(strategy.complaint(problem))
        twist = action.twist
        pipe.send(Decision((twist.v, twist.w, twist.side, twist.climb), payload, mode))


if __name__ == "__main__":
    sys.exit(main())
