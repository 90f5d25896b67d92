"""The process in which one call of an agent is done: a game, a comparison, or a look at a run.

A task comes over the standard input as a line of JSON, and its answer goes back as another one. No strategy that is a
file decides in this process: each has a sealed one of its own, and the games of a comparison are sealed as a whole.
"""

import base64
import contextlib
import io
import json
import math
import os
import signal
import socket
import sys
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import typer
from rich.console import Console

from vrg.api import played_by
from vrg.bus.messages import DISQUALIFIED
from vrg.bus.stopping import stop_on_signals
from vrg.commands.practice import match_text
from vrg.config.loading import check_match, load_match
from vrg.config.setup import CheckedMatch, MatchSetup
from vrg.config.targets import whole_target
from vrg.coordinator.evidence import read_evidence
from vrg.errors import ConfigError, VrgError
from vrg.launch.fork_server import ForkServer
from vrg.playing.launch import How, Launch
from vrg.playing.match import new_run, prepare
from vrg.playing.match import play as play_match
from vrg.playing.run import Run
from vrg.runs.run_folder import RunFolder, delete
from vrg.runs.step_log import Missed, Unmade, read_steps
from vrg_league.conduct import enter, opened, workers_of
from vrg_mcp.answers import fault, quoted

MEMORY: Final = 500
"""The memory that a strategy may use, MB."""
KEPT: Final = 60
"""The number of folders of runs that are kept, and that of comparisons; older ones are deleted."""
CALLS: Final = 40
"""The number of calls of a run that are listed."""
_LOG: Final = 100_000
"""The bytes of what a player has printed that are kept."""
_SIZE: Final = (900, 760)
"""The pixels of a picture of the field."""
_SAMPLES: Final = 12
"""The number of places of a robot that are reported."""


class WorkError(VrgError):
    """What was asked for could not be done. Its text may be that of code."""


def play(
    server: ForkServer, match: str, players: Mapping[str, str], seed: int, seconds: float, named: bool, runs: str
) -> dict[str, Any]:
    """Play a match; see `vrg_mcp.server`.

    Args:
        match: the match file. players: strategies, by team; a file by its path. seconds: the longest match time, s.
        named: True if a person has named the match file: then its robots are simulated, whatever they are.
        runs: the folder for the run.

    Raises:
        VrgError: it cannot be played.
    """
    setup = virtual(Path(match), named, seed=seed)
    return _played(server, played_by(setup, players), seconds, runs)


def practice(server: ForkServer, player: str, map_: str, seconds: float, runs: str) -> dict[str, Any]:
    """Let one robot drive alone on a map; see `play`."""
    text = match_text(map_, 1, "P2AT", whole_target(player), seconds, None)
    setup = check_match(text, Path("practice.toml"), Path(runs), engine="planar", memory=MEMORY)
    return _played(server, setup, seconds + 5.0, runs)


def virtual(path: Path, named: bool, *, seed: int | None = None, sandbox: bool | None = None) -> CheckedMatch:
    """A match in which all robots are simulated, here.

    Raises:
        ConfigError: it cannot be read, or has robots that are no virtual ones, and nobody has named it.
    """
    setup = load_match(path, engine="planar", memory=MEMORY, virtual=named, seed=seed, sandbox=sandbox)
    if real := sorted({p.backend for p in setup.players if p.backend != "sim"}):
        raise ConfigError(f"{setup.name}: expected virtual robots alone, got the backend {', '.join(real)}")
    return setup.all_here()


def _played(server: ForkServer, setup: CheckedMatch, seconds: float, runs: str) -> dict[str, Any]:
    # Without a recording the evidence shows the match, and nothing that code has sketched.
    launch = Launch(
        setup=setup.all_here(), how=How.LOCKSTEP, console=Console(quiet=True), record=False, strangers=True,
        limit=seconds,
    )  # fmt: skip
    launch = prepare(launch, server)
    folder = new_run(launch, Path(runs))
    try:
        over = play_match(launch, folder, server).over
    finally:
        _tidy(folder.path)
    return told_of(folder) | {"run": folder.path.name, "over": over, "players": _motions(folder, launch.setup)}


def told_of(folder: RunFolder) -> dict[str, Any]:
    """The result and the calls of a run, and, each under a name of its own, what failed and was printed by code."""
    run = Run(folder.path)
    calls: list[dict[str, Any]] = [
        {"call": c.number, "rule": c.rule, "clock": round(c.clock, 1)}
        | ({"players": list(c.players)} if c.rule == DISQUALIFIED else {"text": c.text})
        for c in run.calls
    ]
    most = calls if len(calls) <= CALLS else [*calls[: CALLS // 2], *calls[-CALLS // 2 :]]
    given_up = run.result["ended"].startswith("given up")
    return {
        "result": "it was given up" if given_up else run.conclusion, "winner": run.winner, "score": dict(run.score),
        "play_time": run.result["play_time"], "calls_in_all": len(calls), "calls": most, **_by_code(folder, run.setup),
    }  # fmt: skip


def _motions(folder: RunFolder, setup: MatchSetup) -> list[dict[str, Any]]:
    """How far each player drove, m, and where it was at some instants: match time (s), x and y (m), heading (rad)."""
    looks, found = [exhibit.tick for exhibit in read_evidence(folder.evidence)], []
    for player in setup.players:
        poses = [(look.time, p) for look in looks if (p := look.field.poses.get(player.name)) is not None]
        way = sum(math.dist((a.x, a.y), (b.x, b.y)) for (_, a), (_, b) in pairwise(poses))
        some = poses[:: max(1, len(poses) // _SAMPLES)] if len(setup.players) == 1 else poses[-1:]
        places = [[round(t, 1), round(p.x, 2), round(p.y, 2), round(p.theta, 2)] for t, p in some]
        found.append({"name": player.name, "team": player.team, "drove_m": round(way, 1), "t_x_y_heading": places})
    return found


def _by_code(folder: RunFolder, setup: MatchSetup) -> dict[str, Any]:
    """What failed in code, where it did not answer, and what it printed; that of files alone."""
    faults, late, prints = list[dict[str, object]](), Counter[str](), dict[str, str]()
    for line in read_steps(folder.steps):
        if isinstance(line, Missed) and not line.failure:
            late[line.player] += 1
        elif isinstance(line, Missed | Unmade):
            text = line.failure if isinstance(line, Missed) else line.why
            faults.append(fault(text, player=line.player, time=round(line.time, 1)))
    files = {p.name: own.name for p in setup.players if (own := setup.strategy_file(p.name)) is not None}
    for name, code in [*files.items()][:3]:
        with contextlib.suppress(OSError), (folder.logs / f"{name}.log").open("rb") as file:
            text = file.read(_LOG).decode("utf-8", "replace")
            prints |= {name: quoted(text)} if text else {}
            if name in late:
                # Its process has written where it was.
                at = [line for line in text.rpartition("most recent call first")[2].splitlines() if f'{code}"' in line]
                why = f"no answer within a second: {at[0].strip() if at else 'where is not known'}"
                faults.append(fault(why, player=name, steps_without_answer=late[name]))
    return {"faults": faults[:6], "faults_in_all": len(faults), "prints": prints}


def _tidy(folder: Path) -> None:
    """Keep little of what code has written, in a run or in a comparison, and few of those beside it."""
    for written in (folder / "players", folder / "playing"):
        delete(written)
    with contextlib.suppress(OSError):
        for log in folder.rglob("*.log"):
            os.truncate(log, min(_LOG, log.stat().st_size))
        there = [(entry.stat(follow_symlinks=False).st_mtime, entry.path) for entry in os.scandir(folder.parent)]
        for _, path in sorted(there, reverse=True)[KEPT:]:
            delete(Path(path))


def compare(
    _server: ForkServer, first: str, second: str, match: str, games: int, seed: int, named: bool, runs: str
) -> dict[str, Any]:
    """Compare two strategies as `vrg compare` does, sealed; the games of an earlier call with the same code count.

    Raises:
        VrgError: the match or a strategy cannot be used.
    """
    from vrg_league.comparison import Comparison  # noqa: PLC0415 - it starts threads, and a fork must have one

    setup = virtual(Path(match), named, sandbox=True)
    os.chdir(Path(runs).parent)  # the games are in its folder runs
    with stop_on_signals() as stop:
        entrants = enter([first, second], setup, jobs=None, warn=lambda _: None)
        with opened(setup, entrants, entrants.pairings(), "compare", games=games, seed=seed) as experiment:
            try:
                if not experiment.over:
                    experiment.run(workers_of(experiment, None), stop)
                found = Comparison(experiment, 0.95)
            finally:
                _tidy(experiment.folder.path)
    low, high = found.interval
    return {
        "result": found.result, "share": found.rate, "interval": [round(low, 3), round(high, 3)],
        "games": len(found.rows), "confidence": 0.95, "sides": found.tables[0],
        "interrupted": stop.is_set(), "sentence": quoted("\n".join((found.sentence, *found.remarks)), 900),
    }  # fmt: skip


def look(_server: ForkServer, run: str, runs: str) -> dict[str, Any]:
    """The result of a run, its calls, and what failed."""
    return told_of(RunFolder(Path(run)))


def why(_server: ForkServer, run: str, call: int, runs: str) -> dict[str, Any]:
    """Why the referee made a call, with a picture where there is something to see.

    Raises:
        VrgError: there is no such call, or files cannot be read.
    """
    of = Run(run)
    found = of.why(call)
    code = any(c.rule == DISQUALIFIED for c in of.calls if c.number == call)
    return {"by_code" if code else "why": quoted(found, 3000), **_drawn(found.png())}


def picture(_server: ForkServer, run: str, seconds: float, runs: str) -> dict[str, Any]:
    """The field at a match time, s, of a run, as a replay shows it.

    Raises:
        VrgError: there is nothing to show.
    """
    import pygame  # noqa: PLC0415 - only what draws needs it

    from vrg.playing.replay import read_for_window  # noqa: PLC0415 - as above
    from vrg.ui.window import field, text, window  # noqa: PLC0415 - as above

    of = Run(run)
    timeline = read_for_window(RunFolder(of.path), of.setup).timeline
    at = min(max(seconds, timeline.begin), timeline.end)
    surface, scene = pygame.Surface(_SIZE), timeline.at(at)
    field.FieldPainter(text.Fonts()).draw(surface, surface.get_rect(), scene, 1.2, None)
    robots = [[b.name, b.role, b.state, round(b.pose.x, 2), round(b.pose.y, 2)] for b in scene.bodies]
    return {"time": round(at, 2), "end": round(timeline.end, 2), "robots": robots, **_drawn(window.png(surface))}


def decide(_server: ForkServer, action: str, reason: str, runs: str) -> dict[str, Any]:
    """Halt, resume or end the match that runs on this machine, as `vrg official` does.

    Raises:
        VrgError: there is none, it is not clear which is meant, or the referee refuses it.
    """
    from vrg.commands import groups, matches, official  # noqa: PLC0415 - most agents are no officials

    on = groups.DecisionOptions(reason=reason)
    if action == "resume" and matches.attached(on).known_setup().physical:
        raise ConfigError("the match has physical robots: a person lets them drive, with `vrg official resume`")
    with contextlib.redirect_stdout(io.StringIO()) as words:
        try:
            {"halt": official.halt, "resume": official.resume, "end": official.end}[action](**vars(on))
        except typer.Exit:
            raise WorkError(words.getvalue()) from None
    return {"words": quoted(words.getvalue())}


def _drawn(data: bytes | None) -> dict[str, str]:
    return {} if data is None else {"png": base64.b64encode(data).decode()}


_ALL: Final[Sequence[Callable[..., dict[str, Any]]]] = (play, practice, compare, look, why, picture, decide)
WORK: Final = {work.__name__: work for work in _ALL}
"""What can be asked for, by name."""


def main(_arguments: Sequence[str] = ()) -> int:
    """Do one task, as the main function of a process."""
    channel, server = socket.socket(fileno=os.dup(0)), ForkServer()
    with channel.makefile("rwb") as stream:
        task = json.loads(stream.readline())
        work = WORK[task.pop("kind")]
        server.start_as_fork()  # before there is a second thread
        threading.Thread(target=_ends_with, args=(channel,), daemon=True).start()
        try:
            answer = work(server, **task)
        except Exception as error:  # the agent also gets words about a mistake of ours
            if not isinstance(error, VrgError):
                traceback.print_exc()  # into the log of the server
            what = str(error) if isinstance(error, VrgError) else f"{type(error).__name__}: {error}"
            answer = {"problem": what.replace(f"{Path(task['runs']).parent}/", "")}
        finally:
            server.close()
        stream.write(json.dumps(answer, default=str).encode() + b"\n")
    return 0


def _ends_with(channel: socket.socket) -> None:
    """End this process soon after nobody waits for its answer any more."""
    with contextlib.suppress(OSError):
        channel.recv(1)  # nothing comes but the end
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(5.0)
    os._exit(1)


if __name__ == "__main__":
    sys.exit(main())
