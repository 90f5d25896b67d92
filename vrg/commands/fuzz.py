"""The command `vrg fuzz`, which plays matches with faults that a seed draws, in simulated time."""

import gc
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Annotated, Final

import typer

from vrg.bus.stopping import stop_on_signals
from vrg.commands.options import GameArgument, exit_if_interrupted

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.faults.plan import Fault

_LOOK: Final = 0.1
"""The real time in s between two looks at whether a match has been played."""


def fuzz(
    match: GameArgument,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first match.")] = 0,
    games: Annotated[int, typer.Option(min=1, help="How many, each with a seed of its own.")] = 100,
    faults: Annotated[int, typer.Option(min=0, help="Faults in each match.")] = 4,
    seconds: Annotated[float, typer.Option("--for", min=1.0, help="The longest match, s of simulated time.")] = 30.0,
) -> None:
    """Play matches in which processes, links and disks fail, and check what must hold whatever fails.

    All is simulated, in one thread and in simulated time: the nodes, the codec and the journal are those of a real
    match. A seed gives the same match and the same faults each time. Of a match in which something does not hold the
    fewest faults are found with which it does not. The exit status is 1 if there is one.
    """
    from rich.console import Console
    from rich.progress import Progress

    from vrg.config.loading import load_match, match_path
    from vrg.launch.fork_server import cores

    setup = load_match(match_path(match)).all_here().at_rate(1.0)
    console = Console(highlight=False, emoji=False)
    wrong = done = 0
    with (
        stop_on_signals() as stop,
        ProcessPoolExecutor(cores(), initializer=_begin, initargs=(os.getpid(),)) as pool,
        Progress(console=console, transient=True) as bar,
    ):
        task = bar.add_task("matches", total=games)
        play = partial(played, setup, count=faults, seconds=seconds)
        for number, future in enumerate([pool.submit(play, number) for number in range(seed, seed + games)], seed):
            while not stop.is_set() and not future.done():
                stop.wait(_LOOK)
            if stop.is_set():
                _end(pool)
                break
            found, fewest = future.result()
            done += 1
            bar.advance(task)
            if not found:
                continue
            wrong += 1
            console.print(f"seed {number}: {'; '.join(map(str, fewest)) or 'no fault'}", markup=False, soft_wrap=True)
            for problem in found:
                console.print(f"    {problem}", markup=False, soft_wrap=True)
    seeds = f"seed {seed}" if done == 1 else f"seeds {seed} to {seed + done - 1}"
    matches = "1 match" if done == 1 else f"{done} matches"
    typer.echo(f"{matches}{f' ({seeds})' if done else ''}, {faults} faults each: in {wrong} something did not hold")
    if wrong:
        typer.echo(f"To repeat one: vrg fuzz {match} --seed SEED --games 1 --faults {faults} --for {seconds:g}")
    exit_if_interrupted(stop)
    if wrong:
        raise typer.Exit(1)


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


def played(setup: "MatchSetup", seed: int, *, count: int, seconds: float) -> "tuple[list[str], list[Fault]]":
    """Play one match; what did not hold, in words, and the fewest faults with which something does not."""
    from vrg.faults.checking import problems_of, shortest
    from vrg.faults.plan import Streams, drawn

    logging.disable(logging.CRITICAL)
    players = [player.name for player in setup.players]
    faults = drawn(Streams(seed)("faults"), players, 0.6 * seconds, count, setup.physical)
    found = problems_of(setup, seed, faults, seconds)
    if not found:
        return [], []
    problems = {tuple(faults): found}

    def fails(fewer: "Sequence[Fault]") -> bool:
        problems[tuple(fewer)] = problems_of(setup, seed, fewer, seconds)
        return bool(problems[tuple(fewer)])

    fewest = shortest(faults, fails)
    return problems[tuple(fewest)], fewest
