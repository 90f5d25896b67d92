"""The command `vrg fuzz`: matches and single robots with faults that a seed draws, in simulated time."""

import gc
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Annotated, Final

import typer

from vrg.bus.stopping import Stop, stop_on_signals
from vrg.commands.options import exit_if_stopped

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup

_LOOK: Final = 0.1
"""The real time in s between two looks at whether a match has been played."""
Case = Callable[[], list[str]]
"""Plays one match, or lives the life of one robot; returns what did not hold, in lines."""


def fuzz(
    match: Annotated[str | None, typer.Argument(metavar="[GAME|match.toml]", help="The match.")] = None,
    protocol: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Test single robots with these drives, in place of matches; or 'all'."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first match or robot.")] = 0,
    games: Annotated[int, typer.Option(min=1, help="How many matches or robots, each with its own seed.")] = 100,
    faults: Annotated[int, typer.Option(min=0, help="Faults in each match.")] = 4,
    seconds: Annotated[float, typer.Option("--for", min=1.0, help="The longest match, s of simulated time.")] = 30.0,
) -> None:
    """Play matches in which processes, links and disks fail, and check what must hold whatever fails.

    All is simulated, in one thread and in simulated time: the nodes, the codec and the journal are those of a real
    match. A seed gives the same match and the same faults each time. If something does not hold in a match, the
    command finds the fewest faults with which it does not. With --protocol, drives, bus and player of a single robot
    fail; with --games 1 its life is printed step by step. The exit status is 1 if something did not hold.
    """
    if (match is None) is (protocol is None):
        raise typer.BadParameter("expected either a match or --protocol", param_hint="MATCH")
    if match is not None:
        from vrg.config.loading import load_match, match_path

        setup = load_match(match_path(match)).all_here().at_rate(1.0)
        cases = [partial(played, setup, n, count=faults, seconds=seconds) for n in range(seed, seed + games)]
        what, again = "matches", f"vrg fuzz {match} --seed SEED --games 1 --faults {faults} --for {seconds:g}"
    else:
        names = _protocols(protocol or [])
        cases = [partial(lived, name, number) for number in range(seed, seed + games) for name in names]
        what, again = "robots", "vrg fuzz --protocol NAME --seed SEED --games 1"
        if games == 1:
            cases = [partial(lived, name, seed, typer.echo) for name in names]
    with stop_on_signals() as stop:
        wrong = done = 0
        for found in _run(cases, what, stop) if match is not None or games > 1 else (case() for case in cases):
            done += 1
            wrong += bool(found)
            for line in found:
                typer.echo(line)
    begun = "" if done == len(cases) else f" of {len(cases)}, when it was broken off"
    typer.echo(f"{what}: {done}{begun}, from seed {seed} on; in {wrong} something did not hold")
    if wrong:
        typer.echo(f"To repeat one: {again}")
    if done < len(cases):
        exit_if_stopped(stop)
    if wrong:
        raise typer.Exit(1)


def _protocols(typed: Sequence[str]) -> list[str]:
    """The protocols that were typed.

    Raises:
        ConfigError: there is no such protocol, or it cannot be imported.
    """
    from vrg.hal.can.protocols import PROTOCOLS

    names = PROTOCOLS.names() if "all" in typed else list(typed)
    for name in names:
        PROTOCOLS.get(name)
    return names


def _run(cases: Sequence[Case], what: str, stop: Stop) -> Iterator[list[str]]:
    """What was found in each case, in their order, by as many processes as there are cores."""
    from rich.console import Console
    from rich.progress import Progress

    from vrg.launch.fork_server import cores

    console = Console(highlight=False, emoji=False, stderr=True)
    with (
        ProcessPoolExecutor(cores(), initializer=_begin, initargs=(os.getpid(),)) as pool,
        Progress(console=console, transient=True) as bar,
    ):
        task = bar.add_task(what, total=len(cases))
        for future in [pool.submit(case) for case in cases]:
            while not stop.is_set() and not future.done():
                stop.wait(_LOOK)
            if stop.is_set():
                _end(pool)
                return
            bar.advance(task)
            yield future.result()


def _begin(parent: int) -> None:
    """Prepare a process that plays matches: it leaves Ctrl-C to its parent, and ends when that is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _end(pool: ProcessPoolExecutor) -> None:
    """End matches that are being played, and begin no more."""
    processes = multiprocessing.active_children()
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.kill()


def played(setup: "MatchSetup", seed: int, *, count: int, seconds: float) -> list[str]:
    """Play one match: the fewest faults with which something does not hold, and what it is; nothing if all holds."""
    from vrg_faults.checking import problems_of, shortest
    from vrg_faults.plan import Fault, Streams, drawn

    logging.disable(logging.CRITICAL)
    players = [player.name for player in setup.players]
    faults = drawn(Streams(seed)("faults"), players, 0.6 * seconds, count, setup.physical)
    found = problems_of(setup, seed, faults, seconds)
    if not found:
        return []
    problems = {tuple(faults): found}

    def fails(fewer: Sequence[Fault]) -> bool:
        problems[tuple(fewer)] = problems_of(setup, seed, fewer, seconds)
        return bool(problems[tuple(fewer)])

    fewest = tuple(shortest(faults, fails))
    words = "; ".join(map(str, fewest)) or "no fault"
    return [f"seed {seed}: {words}", *(f"    {problem}" for problem in problems[fewest])]


def lived(protocol: str, seed: int, tell: Callable[[str], None] | None = None) -> list[str]:
    """Live the life of one robot: what did not hold, in a line; nothing if all holds.

    Args:
        tell: called with each step, in words.
    """
    from vrg_faults.robot.life import Life

    logging.disable(logging.CRITICAL)  # every fault is logged, too
    if tell is not None:
        tell(f"{protocol}, seed {seed}:")
    found = Life(protocol, seed, (lambda _: None) if tell is None else lambda words: tell(f"    {words}")).run()
    return [] if found is None else [str(found)]
