"""Teaches a network to play as the strategies of a match file do, by regression of what these do in some matches.

    python examples/learning/imitate.py --match sharks-and-minnows --games 30

Or, as people or strategies did in recorded matches: `vrg run export RUN RUN ... --output pairs.parquet`, then

    python examples/learning/imitate.py --from pairs.parquet --winners

It writes policy.npz, which plays in a match, and from which train.py can go on: `train.py --start policy.npz`.
"""

import argparse
import math
import os
import shlex
import signal
import sys
import time
import zipfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # a process for each core is faster

import numpy as np
from msgspec import structs
from places import check_place
from regression import SPREAD, fit_step

from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, VrgError
from vrg.games import strategies_of
from vrg_learn.action import limits_of
from vrg_learn.demonstration import Pairs, demonstrate
from vrg_learn.learning import learning_of
from vrg_learn.matches import match_of
from vrg_learn.network import Adam, Network, initial, layout_of
from vrg_learn.observation import names
from vrg_learn.policy import Policy, save
from vrg_learn.table import read

ONLY = ("team", "role", "player", "driver")  # the columns of a table by which its rows can be chosen
MATCH, GAMES = "sharks-and-minnows", 30  # what is played if nothing else is asked for
ROWS, RATE = 1024, 2e-3  # the rows of a minibatch, and the rate at the start
LEAST = 100  # the fewest decisions of which anything can be learned


def played(match: str, seed: int) -> Pairs:
    """What the strategies of a match file do with a seed, in the planar engine."""
    return demonstrate(structs.replace(match_of(match, engine="planar", lasers=False), seed=seed))


def collected(match: str, games: int, seed: int) -> Pairs:
    """What the strategies do in several games, on all cores. Ctrl-C keeps those that were played."""
    parts = []
    # Ctrl-C is for this process alone: the others end with it, after the games that they play.
    with ProcessPoolExecutor(initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)) as processes:
        try:
            for number, pairs in enumerate(processes.map(played, [match] * games, range(seed, seed + games)), 1):
                parts.append(pairs)
                print(f"game {number} of {games}: {sum(len(part.actions) for part in parts)} decisions", flush=True)
        except KeyboardInterrupt:
            print("stopping: the games that are being played are left out", flush=True)
            processes.shutdown(cancel_futures=True)
            if not parts:
                raise
    return Pairs(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def kept(file: Path, setup: MatchSetup) -> Pairs:
    """The pairs of a file that `--pairs` has kept.

    Raises:
        ConfigError: it is no such file, or one of another game, number of players or version of VRG.
    """
    anew = "delete it, and the match is played anew"
    try:
        with np.load(file) as found:
            pairs = Pairs(found["observations"], found["actions"])
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise ConfigError(f"{file}: expected pairs that --pairs has kept: {error}: {anew}") from None
    shapes = pairs.observations.shape[1:], pairs.actions.shape[1:]
    widths = (len(names(learning_of(setup.game), len(setup.players))),), (len(limits_of(setup.players[0].robot)),)
    if shapes != widths:
        raise ConfigError(f"{file}: expected rows of {widths} values as in {setup.game}, got {shapes}: {anew}")
    return pairs


def fitted(game: str, pairs: Pairs, minutes: float, seed: int = 0, epochs: int = 1000) -> tuple[Policy, list[float]]:
    """The policy that does most nearly the same, and its squared error on a tenth of the pairs after each epoch.

    Ctrl-C ends it early.
    """
    rng, layout = np.random.default_rng(seed), layout_of(learning_of(game))
    actions = pairs.actions.shape[1]
    network = Network(initial(len(layout.own), len(layout.slot), actions, rng))
    adam, errors, begin = Adam(network.parameters), list[float](), time.monotonic()
    order = rng.permutation(len(pairs.actions))
    tested, rest = np.split(order, [max(1, len(order) // 10)])

    stop: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: stop.append(number))
    done, shown = 0.0, begin
    try:
        while not stop and done < 1.0 and len(errors) < epochs:
            for rows in np.array_split(rng.permutation(rest), max(1, len(rest) // ROWS)):
                fit_step(network, adam, pairs.observations[rows], pairs.actions[rows], RATE * (1.0 - 0.95 * done))
            off = np.tanh(network(pairs.observations[tested])) - pairs.actions[tested]
            errors.append(float(np.square(off).mean()))
            now = time.monotonic()
            done = max((now - begin) / (60.0 * minutes), len(errors) / epochs)
            if now - shown > 5.0:
                left = max(0.0, 60.0 * minutes + begin - now)
                print(f"epoch {len(errors)}: squared error {errors[-1]:.4f}; at most {left:.0f} s left", flush=True)
                shown = now
    finally:
        signal.signal(signal.SIGINT, before)
    what = f"imitate.py: {len(order)} decisions of {game}"
    return Policy(game, network, np.full(actions, np.log(SPREAD), dtype=np.float32), what), errors


def make_parser() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--match", help=f"a game, or a match file ({MATCH})")
    parser.add_argument("--games", type=int, help=f"how many are played ({GAMES})")
    parser.add_argument("--from", dest="file", type=Path, help="learn from this file of `vrg run export`; play nothing")
    for what in ONLY:
        parser.add_argument(f"--{what}", help=f"learn from this {what} in the file alone")
    parser.add_argument("--winners", action="store_true", help="learn from those in the file whose team won, alone")
    parser.add_argument("--minutes", type=float, default=2.0, help="how long to learn from them (%(default)g)")
    parser.add_argument("--seed", type=int, default=0, help="of the first game, and of the network (%(default)s)")
    parser.add_argument("--pairs", type=Path, help="keep what was played in this file (npz), or use what is there")
    parser.add_argument("--output", type=Path, default=Path("policy.npz"), help="the file of the policy (%(default)s)")
    parser.add_argument("--replace", action="store_true", help="overwrite a policy that is there")
    return parser


def main() -> None:
    """Read the command line, play, learn, and write what was learned."""
    parser = make_parser()
    options = parser.parse_args()
    only = {what: word for what in ONLY if (word := getattr(options, what)) is not None}
    only |= {"won": True} if options.winners else {}
    if only and not options.file:
        chosen = ", ".join("--winners" if what == "won" else f"--{what}" for what in only)
        parser.error(f"{chosen}: expected --from, whose decisions are chosen by them")
    needless = [f"--{what}" for what in ("match", "games", "pairs") if getattr(options, what) is not None]
    if needless and options.file:
        parser.error(f"{', '.join(needless)}: expected none of these with --from, by which nothing is played")
    if options.games is not None and options.pairs and options.pairs.exists():
        parser.error(f"--games: {options.pairs} has what was played: leave out --games, or choose another --pairs")
    if not 0.0 < options.minutes < math.inf:
        parser.error(f"--minutes: expected a number above 0, got {options.minutes:g}")
    if options.seed < 0:
        parser.error(f"--seed: expected 0 or more, got {options.seed}")
    if options.games is not None and options.games < 1:
        parser.error(f"--games: expected 1 or more, got {options.games}")
    try:
        check_place("--output", options.output, replace=options.replace)
        if options.pairs:
            if options.pairs == options.output:
                parser.error(f"--pairs: expected another file than that of --output, got {options.pairs}")
            check_place("--pairs", options.pairs, replace=True)
        learn(options, only)
    except (VrgError, OSError) as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("stopped before there was anything to write")


def learn(options: argparse.Namespace, only: dict[str, str | bool]) -> None:
    """Play or read, learn, and write what was learned.

    Args:
        only: the values that rows of a table must have, by column.

    Raises:
        VrgError: there is no such match, a strategy has failed, or a file cannot be used.
    """
    if options.file:
        match, pairs = read(options.file, **only)
        game = match
    else:
        match = options.match or MATCH
        setup = match_of(match, engine=None, lasers=None)
        game = setup.game
        if options.pairs and options.pairs.exists():
            pairs = kept(options.pairs, setup)
        else:
            pairs = collected(match, GAMES if options.games is None else options.games, options.seed)
            if options.pairs:
                np.savez_compressed(options.pairs, **pairs._asdict())
    if len(pairs.actions) < LEAST:
        sys.exit(f"expected {LEAST} decisions or more to learn from, got {len(pairs.actions)}: take more games or runs")
    policy, errors = fitted(game, pairs, options.minutes, options.seed)
    save(policy, options.output)
    mean = float(np.square(pairs.actions - pairs.actions.mean(axis=0)).mean())
    print(f"squared error {errors[-1]:.4f} after {len(errors)} epochs; of the mean action it would be {mean:.4f}")
    file, match = shlex.quote(str(options.output)), shlex.quote(match)
    shipped = strategies_of(game)
    hint = f". Play it: vrg compare {file} {shipped[0]} --match {match}" if shipped else ""
    print(f"wrote {options.output}{hint}")


if __name__ == "__main__":
    main()
