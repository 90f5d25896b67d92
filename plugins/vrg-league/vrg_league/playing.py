"""One game, played in its own process, and judged again in another one."""

import contextlib
import faulthandler
import gzip
import logging
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

import msgspec
from msgspec import structs

from vrg.bus.messages import DISQUALIFIED, EMERGENCY_STOP, Call, RefereeState, Stage
from vrg.config.rules import rulebook_of
from vrg.config.setup import CheckedMatch
from vrg.coordinator.evidence import Decided, Entry, Halted, read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.match import state_after
from vrg.errors import LaunchError, VrgError
from vrg.files import write_whole
from vrg.games import has_name
from vrg.launch.fork_server import ForkServer
from vrg.launch.nodes.referee import open_journal
from vrg.launch.sandbox.seal import missing
from vrg.launch.vacancies import disqualification
from vrg.playing import in_process
from vrg.playing.branch import play_on
from vrg.playing.strategies import Strategies
from vrg.runs.change import branch_of
from vrg.runs.evidenced import read_evidenced
from vrg.runs.fingerprint import Fingerprint, read_fingerprint
from vrg.runs.judged import judge_run
from vrg.runs.reasons import reasons
from vrg.runs.run_folder import RunFolder
from vrg_league.games import BROKEN_OFF, FAILED, INVALID, OVER, Played

SHOWN: Final = "shown.json.gz"
"""The file with what shows a game to people."""
SHOWN_EVERY: Final = 0.5
"""The match time in s between two instants of it."""


def played(setup: CheckedMatch, folder: RunFolder, limit: float, server: ForkServer | None = None) -> Played:
    """Play a match in this process, and return what `judged` cannot find out later.

    Args:
        folder: for the journal and the logs.
        limit: the match time in s after which it is broken off.
        server: forks the processes of strategies of files, which are sealed where this machine can; None lets all
            decide in this process.
    """
    folder.prepare()
    began = time.perf_counter()
    apart = None if server is None else Strategies(server, seats=missing() is None)
    setup = setup.at_rate(0.0)
    try:
        branch = branch_of(folder)
        if branch is not None:
            ending = play_on(setup, RunFolder(Path(branch.of)), folder, apart=apart, limit=limit)
        else:
            with open_journal(setup, folder) as journal:
                ending = in_process.play(setup, journal, limit=limit, logs=folder.logs, apart=apart)
    except VrgError as error:
        return Played(ended=FAILED, problem=str(error), wall_time=time.perf_counter() - began)
    ended, halted = _ended(ending.state), ending.state.halted
    why = f"play was halted, and nobody could resume it: {halted}" if halted else "it reached the limit of match time"
    return Played(
        ended=ended,
        problem=why if ended == BROKEN_OFF else "",
        match_time=round(ending.time, 3),
        failures=[f"{failure.player}: {failure.text}" for failure in ending.failures],
        failing=[failure.player for failure in ending.failures],
        thinking={name: round(seconds, 1) for name, seconds in ending.thinking.items()},
        wall_time=round(time.perf_counter() - began, 3),
    )


def _ended(state: RefereeState) -> str:
    return OVER if state.stage is Stage.GAME_OVER else BROKEN_OFF


def judged(setup: CheckedMatch, folder: RunFolder, reported: Played) -> Played:
    """The result of a match by its journal, after the rule book has judged it again.

    This must be a process in which no strategy has ever been.

    Args:
        folder: in which it was played. reported: by the process that has played it.
    """
    if reported.ended == FAILED:
        return reported
    try:
        records = read_journal(folder.journal)[1]
        damage: list[str] = []
        judgement, wrong = judge_run(setup, folder, records, damage)
        entries = (entry for seen in read_evidence(folder.evidence) for entry in seen.tick.entries)
        officials = [words for entry in entries if (words := _without_officials(entry, reported.failing))]
        calls = [call for record in records for call in record.calls]
        standing = records[-1].standing if records else None
        state = state_after(rulebook_of(setup), standing)
    except VrgError as error:
        return invalid(setup, reported, str(error))
    if wrong or officials or damage or judgement.gaps or judgement.unjudged or reported.ended != _ended(state):
        return invalid(setup, reported, str([*wrong, *officials, "its journal or its evidence ends early"][0]))
    teams = {player.name: player.team for player in setup.players}
    return structs.replace(
        reported,
        winner=state.winner,
        score=dict(state.score),
        calls=counted((call.rule, teams.get(call.players[0], "") if call.players else "") for call in calls),
        play_time=round(state.total, 3),
        disqualified=list(dict.fromkeys(name for c in calls if c.rule == DISQUALIFIED for name in c.players)),
        fingerprint=_computed_by(folder),
    )


def _computed_by(folder: RunFolder) -> Fingerprint | None:
    """The fingerprint of what computed a game; None if it is not known, or damaged."""
    try:
        return read_fingerprint(folder)
    except LaunchError:
        return None


def shown(setup: CheckedMatch, run: RunFolder) -> str:
    """What shows a match to people who may not know what players' code has raised; see `vrg.ui.web.share.recorded`.

    Raises:
        VrgError: its journal or its evidence cannot be read.
    """
    from vrg.ui.timeline import Timeline  # noqa: PLC0415 - a game of an experiment draws nothing
    from vrg.ui.web.share import recorded  # noqa: PLC0415 - as above

    match = read_evidenced(run, setup)
    match.calls[:] = [(time, _public(call)) for time, call in match.calls]
    sizes = {player.name: player.robot.size for player in setup.players}
    why = reasons(run, setup)
    return recorded(Timeline(match, sizes=sizes, obstacles=setup.obstacles), setup.name, why, SHOWN_EVERY)


def _public(call: Call) -> Call:
    """A call without the error of a player's code, which is for its author."""
    if call.rule != DISQUALIFIED:
        return call
    return structs.replace(call, text=f"{', '.join(call.players)} is disqualified", why="")


def _without_officials(entry: Entry, failing: Sequence[str]) -> str | None:
    """The act of a person in an entry of the evidence, which no comparison has; None if there is none.

    A player whose code has failed for good, as `failing` tells, is disqualified by a decision, too.
    """
    if isinstance(entry, Halted) and entry.cause == EMERGENCY_STOP:
        return f"nobody may halt it: {entry.reason}"
    if not isinstance(entry, Decided):
        return None
    official = entry.official
    if official.subject in failing and official == disqualification(official.subject or "", official.reason):
        return None
    return f"an official has decided, but there is none: {official.action}"


def invalid(setup: CheckedMatch, reported: Played, why: str) -> Played:
    """A match that is not valid: it is lost for the team whose code alone could change what the referee writes."""
    sealed = missing() is None
    teams = list(dict.fromkeys(player.team for player in setup.players))
    own = [player for player in setup.players if not has_name(player.strategy)]
    able = {player.team for player in own if not (sealed and setup.sandboxed(player.name, seats=True))}
    # Strategies with a name come with VRG or are installed: their code is trusted.
    others = [team for team in teams if team not in able]
    return structs.replace(reported, ended=INVALID, problem=why, winner=others[0] if len(others) == 1 else None)


def counted(calls: Iterable[tuple[str, str]]) -> dict[str, dict[str, int]]:
    """The number of times that each (rule, team) is among the calls, by rule and team."""
    found: dict[str, dict[str, int]] = {}
    for rule, team in calls:
        of_rule = found.setdefault(rule, {})
        of_rule[team] = of_rule.get(team, 0) + 1
    return found


def main(arguments: Sequence[str]) -> int:
    """Play a game, or judge one, as the main function of a process.

    On its standard input come, when the processes of strategies can no longer learn of it, the match as JSON and what
    came out of the game if it was played; a `Played` is sent there. The process ends when this is closed.

    Args:
        arguments: the folder for the journal and the logs; the match time in s after which the game is broken off;
            `apart` to let strategies of files decide in processes of their own; `shown` to write what shows it to
            people.
    """
    folder, limit, apart = Path(arguments[0]), float(arguments[1]), "apart" in arguments[2:]
    pipe = Connection(os.dup(0))
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that has started it decides what follows
    logging.basicConfig(level=logging.WARNING)
    faulthandler.enable()
    server = ForkServer()
    if apart:
        server.start_as_fork()
    try:
        setup, reported = msgspec.json.decode(pipe.recv_bytes(), type=tuple[CheckedMatch, Played | None])
        threading.Thread(target=_end_with, args=(os.dup(pipe.fileno()),), daemon=True).start()
        run = RunFolder(folder)
        result = judged(setup, run, reported) if reported else played(setup, run, limit, server if apart else None)
        if reported and "shown" in arguments[2:]:
            try:
                write_whole(folder / SHOWN, gzip.compress(shown(setup, run).encode(), mtime=0))
            except Exception:  # a game that cannot be shown, by the rules of any game, counts anyway
                logging.exception("the game cannot be shown")
    finally:
        server.close()
    with contextlib.suppress(OSError):
        pipe.send_bytes(msgspec.json.encode(result))
    pipe.close()
    return 0


def _end_with(descriptor: int) -> None:
    """End this process as soon as the one that has started it has closed its end of a socket, or has ended."""
    select.select([descriptor], [], [])
    os._exit(1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
