"""One game, played in a process of its own."""

import contextlib
import faulthandler
import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Iterable
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec

from vrg.bus.messages import DISQUALIFIED, Stage
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import read_journal
from vrg.errors import VrgError
from vrg.evaluation.games import BROKEN_OFF, FAILED, OVER, Played
from vrg.launch import in_process
from vrg.launch.apart import Zygote
from vrg.launch.nodes import open_journal
from vrg.launch.run_folder import RunFolder


def played(setup: MatchSetup, folder: RunFolder, limit: float, zygote: Zygote | None = None) -> Played:
    """Play a match in this process, and return what came out of it.

    Args:
        folder: for the journal and the logs.
        limit: the match time in s after which it is broken off.
        zygote: see `vrg.launch.in_process.play`.
    """
    folder.prepare()
    began = time.perf_counter()
    try:
        with open_journal(setup, folder) as journal:
            ending = in_process.play(setup.at_rate(0.0), journal, limit=limit, logs=folder.logs, zygote=zygote)
    except VrgError as error:
        return Played(ended=FAILED, problem=str(error), wall_time=time.perf_counter() - began)
    wall_time = time.perf_counter() - began
    calls = [call for record in read_journal(folder.journal)[1] for call in record.calls]
    teams = {player.name: player.team for player in setup.players}
    return Played(
        ended=OVER if ending.state.stage is Stage.GAME_OVER else BROKEN_OFF,
        winner=ending.state.winner,
        score=dict(ending.state.score),
        calls=counted((call.rule, teams.get(call.players[0], "") if call.players else "") for call in calls),
        match_time=round(ending.time, 3),
        play_time=round(ending.state.total, 3),
        disqualified=list(dict.fromkeys(name for c in calls if c.rule == DISQUALIFIED for name in c.players)),
        failures=list(ending.failures),
        wall_time=round(wall_time, 3),
    )


def counted(calls: Iterable[tuple[str, str]]) -> dict[str, dict[str, int]]:
    """How often each (rule, team) is among the calls, by rule and team."""
    found: dict[str, dict[str, int]] = {}
    for rule, team in calls:
        of_rule = found.setdefault(rule, {})
        of_rule[team] = of_rule.get(team, 0) + 1
    return found


def main(pipe: Connection, folder: Path, limit: float, sealed: bool) -> None:
    """Play a game as the main function of a process.

    What the process prints goes to `process.log` in the folder. It ends when the process that has started it ends.

    Args:
        pipe: the match comes from it as JSON, when the processes of strategies can no longer learn of it; and the
            `Played` is sent there.
        folder: for the journal and the logs.
        limit: the match time in s after which the game is broken off.
        sealed: True seals the strategies that are to be.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever has started it decides what follows
    _end_with_parent()
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "process.log").open("ab") as log:
        for stream in (sys.stdout, sys.stderr):
            os.dup2(log.fileno(), stream.fileno())
    logging.basicConfig(level=logging.WARNING)
    faulthandler.enable()
    with Zygote() if sealed else contextlib.nullcontext() as zygote:
        result = played(msgspec.json.decode(pipe.recv_bytes(), type=MatchSetup), RunFolder(folder), limit, zygote)
    with contextlib.suppress(BrokenPipeError):
        pipe.send_bytes(msgspec.json.encode(result))
    pipe.close()


def _end_with_parent() -> None:
    """Let this process end as soon as the one that has started it has ended, however that happens."""
    parent = multiprocessing.parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
