"""Teaches a team to play: first lessons by a shipped strategy, then play against that, others and itself.

    python examples/learning/train.py --match roboflag --minutes 20

All players of a match learn one policy, each from what it sees. In the lessons it drives, and is corrected by what the
teacher would have done (DAgger, Ross et al. 2011); after them it learns by the rewards, by proximal policy optimisation
(PPO, Schulman et al. 2017), in numpy alone. It writes policy.npz, which plays in a match, policy.training, from which
`--resume` goes on, and policy.png with the curve. Ctrl-C ends it and keeps what is learned.
"""

import argparse
import json
import math
import os
import shlex
import signal
import sys
import threading
import time
import zipfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # the policy and the value learn in a thread each, which is faster

import numpy as np
from matplotlib.figure import Figure

from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.games import learning_of, strategies_of
from vrg.learning.batch.matches import Batch
from vrg.learning.batch.stepping import Variation
from vrg.learning.network import Adam, Network, Parameters, initial, layout_of
from vrg.learning.policy import Policy, check_place, load, save
from vrg.registry import did_you_mean

GAMMA, LAMBDA = 0.99, 0.95  # the discount of a step, and of the estimates of advantages (Schulman et al. 2016)
CLIP, ENTROPY, EPOCHS, ROWS = 0.2, 0.002, 3, 4096  # ROWS: those of a minibatch
RATE, LEAST_RATE, MOST_RATE, KL = 5e-4, 5e-5, 2e-3, 0.012  # the rate follows how far an update moves the policy
POOL, KEEP_EVERY, DRAW_EVERY = 30, 10, 5  # former selves; updates between two of them, and between two draws
WARM = 8  # updates that teach the value alone, if the policy can play already
FORMER, SHIPPED = 0.2, 0.5  # the shares of the matches against former selves, and against shipped strategies
SCHOOL, CORRECTIONS, LESSON = 0.25, 400_000, 12  # the share of the time, the corrections kept, the steps of a lesson
FASTEST, STRAYING, SPREAD = 2e-3, 0.2, 0.3  # the rate in lessons, and how far the policy tries out in and after them
OWN = ("minutes", "output", "replace", "resume")  # options of one run of this program, not of the training
VARIED = Variation(
    speed=0.15, acceleration=0.2, turning=0.1, position_noise=0.03, heading_noise=0.02, delay=1, loss=0.05
)


class Rival(NamedTuple):
    """Who plays one team of some matches in place of the policy that learns.

    Args:
        matches: which. team: its number. strategy: the name of a shipped one; empty for a former self.
    """

    matches: slice
    team: int
    strategy: str = ""

    @property
    def name(self) -> str:
        """The name in the curve."""
        return self.strategy or "former selves"


class Training:
    """A policy that learns, with all that goes on in it.

    Args:
        options: as the command line gives them: match, seed, matches, horizon, hold, most, vary, start, teacher and
            against.
        again: True for a training that goes on: the policy of `start` is not read again.

    Raises:
        ConfigError: the game cannot be played in a batch, has no such strategy there, or needs more matches.
    """

    def __init__(self, options: dict[str, Any], *, again: bool = False) -> None:
        self.options = options
        setup = load_match(match_path(options["match"]))
        self.game, self.layout = setup.game, layout_of(learning_of(setup.game))
        self.rng = np.random.default_rng(options["seed"])
        vary = VARIED if options["vary"] else Variation()
        self.batch = Batch(
            setup, options["matches"], seed=options["seed"], vary=vary, shaping=True, most=options["most"]
        )
        shipped = self.batch.strategies
        self.teacher = options["teacher"]
        if self.teacher is None:
            self.teacher = shipped[0] if shipped else "none"
        self.against = shipped if options["against"] is None else [n for n in options["against"] if n != "none"]
        for option, names in (("--teacher", [self.teacher]), ("--against", self.against)):
            if strange := [name for name in names if name not in (*shipped, "none")]:
                known, guess = ", ".join((*shipped, "none")), did_you_mean(strange[0], shipped)
                of = f"{self.game} (--match {options['match']})"
                raise ConfigError(f"{option}: expected one of {known} for {of}, got {strange[0]!r}{guess}")
        own, slot = len(self.layout.own), len(self.layout.slot)
        actor: Parameters = {**initial(own, slot, 2, self.rng), "log_std": np.full(2, -0.5, dtype=np.float32)}
        self.taught = bool(options["start"]) or self.teacher == "none"
        self.knows = bool(options["start"]) or self.teacher != "none"
        if options["start"] and not again:
            policy = load(Path(options["start"]))
            if policy.game != self.game or len(policy.log_std) != 2:
                got = f"one of {policy.game} with {len(policy.log_std)}"
                raise ConfigError(
                    f"{options['start']}: expected a policy of {self.game} with 2 numbers in an action, got {got}"
                )
            actor = {**policy.network.parameters, "log_std": policy.log_std.copy()}
        critic = initial(own, slot, 1, self.rng, last=0.1)
        self.actor, self.critic = Adam(actor), Adam(critic)
        self.policy, self.value = Network(actor), Network(critic)
        self.threads = ThreadPoolExecutor(2)
        self.pool: list[Parameters] = [{name: values.copy() for name, values in actor.items()}]
        self.updates, self.decisions, self.rate = 0, 0, RATE
        self.curve: list[dict[str, float]] = []
        self.rivals = rivals_of(options["matches"], self.against)
        self.drawn = [0 for _ in self.rivals]
        self.won = {rival.name: 0.5 for rival in self.rivals}
        self.learns = np.ones((options["matches"], len(self.batch.sides)), dtype=bool)
        for rival in self.rivals:
            self.learns[rival.matches] = self.batch.sides != rival.team
        self.corrections, self.given, self.schooled = np.zeros((0, 0), dtype=np.float32), 0, 0.0
        self.batch.reset()
        self.batch.step(np.zeros((*self.learns.shape, 2), dtype=np.float32))  # the first step compiles
        (self.play_for_rewards if self.taught else self.play_for_lessons)()

    def play_for_lessons(self) -> None:
        """Let the teacher advise half of the teams, and drive a quarter of them, and others the rest."""
        self.corrections = np.zeros((CORRECTIONS, self.batch.length + 2), dtype=np.float32)
        self.advised, others = np.zeros_like(self.learns), (*self.against, self.teacher)
        for match in range(self.batch.matches):
            for team, name in enumerate(self.batch.teams[:2]):
                turn = (match + team) % 4
                strategy = self.teacher if turn < 3 else others[match // 4 % len(others)]
                self.batch.play_by(slice(match, match + 1), name, strategy, advice=turn < 2)
                self.advised[match, self.batch.sides == team] = turn < 3
        self.begin()

    def play_for_rewards(self) -> None:
        """Let the rivals play, and the policy learn from the rewards from now on."""
        self.taught, self.corrections = True, np.zeros((0, 0), dtype=np.float32)
        for team in self.batch.teams[:2]:
            self.batch.play_by(slice(None), team, None)
        for rival in self.rivals:
            if rival.strategy:
                self.batch.play_by(rival.matches, self.batch.teams[rival.team], rival.strategy)
        self.pool = [{name: values.copy() for name, values in self.actor.parameters.items()}]
        self.begin()

    def begin(self) -> None:
        """Begin all matches anew."""
        self.seen, self.able = self.batch.reset().copy(), self.batch.out.able.copy()

    def lesson(self, rate: float) -> float:
        """Play a little, be corrected, and return by how much, as the root of the mean square.

        Args:
            rate: that of learning.
        """
        for _ in range(LESSON):
            means = np.tanh(self.outputs(self.policy, self.seen.reshape(-1, self.batch.length)))
            means += STRAYING * self.rng.standard_normal(means.shape, dtype=np.float32)
            action = np.clip(means, -1.0, 1.0).reshape(*self.learns.shape, 2)
            able = self.advised & self.able
            for number in range(self.options["hold"]):
                out = self.batch.step(action)
                if number == 0:
                    new = np.concatenate((self.seen[able], self.batch.advice[able]), axis=1)
                    self.corrections[(self.given + np.arange(len(new))) % CORRECTIONS] = new
                    self.given += len(new)
            self.seen, self.able = out.observations.copy(), out.able.copy()
            self.decisions += self.options["hold"] * self.learns.size
        off = 0.0
        for _ in range(LESSON):
            rows = self.rng.integers(min(self.given, CORRECTIONS), size=2048)
            off += self.correct(self.corrections[rows, :-2], self.corrections[rows, -2:], rate) / LESSON
        return math.sqrt(off)

    def correct(self, seen: np.ndarray, advice: np.ndarray, rate: float) -> float:
        """Bring the policy nearer to what the teacher would have done, and return how far off it was, squared."""
        off = [0.0]

        def slope(outputs: np.ndarray, rows: slice) -> np.ndarray:
            means = np.tanh(outputs)
            off[0] += float(np.square(means - advice[rows]).sum()) / advice.size
            found: np.ndarray = (means - advice[rows]) * (1.0 - means * means) / len(advice)
            return found

        # The spread of the policy has no part in this.
        self.actor.update({**self.policy.slopes(seen, slope), "log_std": np.zeros(2, dtype=np.float32)}, rate)
        self.policy.parameters["log_std"][:] = math.log(SPREAD)
        return off[0]

    def update(self) -> None:
        """Play `horizon` decisions of all matches, and learn from them."""
        if self.updates % DRAW_EVERY == 0:
            self.drawn = [int(self.rng.integers(len(self.pool))) for _ in self.rivals]
        seen, wanted, chance, advantages, returns, active, side = self.play()
        for team in (0, 1):  # they learn alike, however few a team has
            able = (side == team) & (active > 0.0)
            if able.any():
                advantages[side == team] -= advantages[able].mean()
                advantages[side == team] /= advantages[able].std() + 1e-6
                active[able] *= 0.5 * np.count_nonzero(active) / np.count_nonzero(able)
        rows = len(seen)
        orders = [np.array_split(self.rng.permutation(rows), max(1, rows // ROWS)) for _ in range(EPOCHS)]
        learning = self.threads.submit(self.learn_value, seen, returns, orders)
        # A value that knows nothing yet would spoil what a policy has learned already.
        for order in [] if self.knows and self.updates < WARM else orders:
            moved = [self.learn_policy(seen[p], wanted[p], chance[p], advantages[p], active[p]) for p in order]
            self.rate *= 1 / 1.5 if np.mean(moved) > 1.5 * KL else 1.5 if np.mean(moved) < KL / 1.5 else 1.0
            self.rate = min(MOST_RATE, max(LEAST_RATE, self.rate))
        learning.result()
        self.updates += 1
        if self.updates % KEEP_EVERY == 0:
            if len(self.pool) == POOL:
                self.pool.pop(int(self.rng.integers(POOL)))
            self.pool.append({name: values.copy() for name, values in self.policy.parameters.items()})

    def learn_value(self, seen: np.ndarray, returns: np.ndarray, orders: list[list[np.ndarray]]) -> None:
        """Fit the value to the returns."""

        def fit(rows: np.ndarray) -> None:
            wanted = returns[rows, None]
            slopes = self.value.slopes(seen[rows], lambda values, part: (values - wanted[part]) / len(wanted))
            self.critic.update(slopes, RATE)

        for rows in (rows for order in orders for rows in order):
            fit(rows)

    def learn_policy(
        self, seen: np.ndarray, wanted: np.ndarray, chance: np.ndarray, advantages: np.ndarray, active: np.ndarray
    ) -> float:
        """Change the policy by one minibatch, and return how far it has moved (an estimate of the KL divergence)."""
        log_std, count = self.policy.parameters["log_std"], max(1.0, float(active.sum()))
        spread, pulls, moved = np.exp(log_std), np.zeros(2, dtype=np.float32), [0.0]

        def slope(outputs: np.ndarray, rows: slice) -> np.ndarray:
            means = np.tanh(outputs)
            off, advantage = (wanted[rows] - means) / spread, advantages[rows]
            change = likelihood(off, log_std) - chance[rows]
            ratio = np.exp(np.minimum(change, 10.0))
            inside = np.where(advantage > 0.0, ratio < 1.0 + CLIP, ratio > 1.0 - CLIP)
            pull = (-advantage * ratio * inside * active[rows] / count)[:, None]
            pulls[:] += (pull * (off * off - 1.0)).sum(axis=0)
            moved[0] += float(((ratio - 1.0 - change) * active[rows]).sum()) / count
            found: np.ndarray = pull * off / spread * (1.0 - means * means)
            return found

        slopes = self.policy.slopes(seen, slope)
        self.actor.update({**slopes, "log_std": pulls - ENTROPY}, self.rate)
        np.clip(log_std, -2.0, 0.0, out=log_std)
        return moved[0]

    def play(self) -> tuple[np.ndarray, ...]:
        """Play, and return a row for each decision of each player that learns: what it saw, what it wanted, the
        logarithm of the chance of that, its advantage, its return, whether it could move, and its team's number."""
        steps, players, mine = self.options["horizon"], self.learns.shape, self.learns
        saw = np.zeros((steps + 1, *self.seen.shape), dtype=np.float32)
        wanted, noise = np.zeros((steps, *players, 2), dtype=np.float32), np.exp(self.policy.parameters["log_std"])
        chance, rewards = np.zeros((steps, *players), dtype=np.float32), np.zeros((steps, *players), dtype=np.float32)
        over, cut = np.zeros((steps, players[0]), dtype=bool), np.zeros((steps, players[0]), dtype=bool)
        ends: list[tuple[int, np.ndarray, np.ndarray]] = []
        active = np.zeros((steps, *players), dtype=np.float32)
        saw[0] = self.seen
        for step in range(steps):
            off = self.rng.standard_normal((*players, 2), dtype=np.float32)
            wanted[step][mine] = np.tanh(self.outputs(self.policy, saw[step][mine])) + noise * off[mine]
            chance[step] = likelihood(off, self.policy.parameters["log_std"])
            for rival, former in zip(self.rivals, self.drawn, strict=True):
                if not rival.strategy:
                    theirs, spread = ~mine[rival.matches], np.exp(self.pool[former]["log_std"])
                    means = np.tanh(Network(self.pool[former])(saw[step][rival.matches][theirs]))
                    wanted[step][rival.matches][theirs] = means + spread * off[rival.matches][theirs]
            action, active[step] = np.clip(wanted[step], -1.0, 1.0), self.able
            for _ in range(self.options["hold"]):
                out = self.batch.step(action)
                going = ~(over[step] | cut[step])
                rewards[step] += out.rewards * going[:, None]
                ended = (out.terminated | out.truncated) & going
                if ended.any():
                    ends.append((step, np.flatnonzero(out.truncated & ended), out.last[out.truncated & ended].copy()))
                over[step], cut[step] = over[step] | (out.terminated & going), cut[step] | (out.truncated & going)
                for rival in self.rivals:
                    for winner in out.winners[rival.matches][ended[rival.matches]]:
                        result = 0.5 if winner not in (0, 1) else float(winner != rival.team)
                        self.won[rival.name] += 0.02 * (result - self.won[rival.name])
            saw[step + 1], self.able = out.observations, out.able.copy()
        self.seen = saw[-1].copy()
        self.decisions += steps * self.options["hold"] * mine.size
        values = np.zeros((steps + 1, *players), dtype=np.float32)
        values[:, mine] = self.outputs(self.value, saw[:, mine])[..., 0].reshape(steps + 1, -1)
        beyond = values[1:].copy()
        for step, matches, last in ends:
            if len(matches):
                beyond[step, matches] = self.value(last.reshape(-1, saw.shape[-1])).reshape(len(matches), -1)
        beyond[over] = 0.0
        advantages = advantages_of(rewards + GAMMA * beyond - values[:-1], ~(over | cut))
        reward = float(rewards[:, mine].mean()) / self.options["hold"] * 600.0
        self.curve.append({"decisions": self.decisions, "reward": reward, **self.won})
        learns = np.broadcast_to(mine, rewards.shape)
        returns, side = advantages + values[:-1], np.broadcast_to(self.batch.sides, rewards.shape)
        found = saw[:-1], wanted, chance, advantages, returns, active, side
        return tuple(array[learns] for array in found)

    def outputs(self, network: Network, seen: np.ndarray) -> np.ndarray:
        """The outputs of a network for what players see in all matches, half of them in each thread."""
        rows = seen.reshape(-1, seen.shape[-1])
        return np.concatenate(list(self.threads.map(network, np.array_split(rows, 2))))

    def learned(self) -> Policy:
        """The policy as it is now."""
        parameters = {name: values for name, values in self.policy.parameters.items() if name != "log_std"}
        what = f"train.py: {self.decisions / 1e6:.1f} million decisions of {self.options['match']}"
        return Policy(self.game, Network(parameters), self.policy.parameters["log_std"], what)

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays that change, by name; they can be written to."""
        found = {"seen": self.seen, "out": self.batch.out.observations, "able": self.able}
        for kind, adam in (("actor", self.actor), ("critic", self.critic)):
            for part, group in (("", adam.parameters), (" mean", adam.means), (" square", adam.squares)):
                found |= {f"{kind}{part} {name}": values for name, values in group.items()}
        for name, records in self.batch.records._asdict().items():
            if isinstance(records, np.recarray):
                found[f"batch {name}"] = records.view(np.ndarray).view(np.uint8)
        return found

    def state(self) -> str:
        """How it goes, in words."""
        won = ", ".join(f"{100 * share:.0f} % against {name}" for name, share in self.won.items())
        return f"reward {self.curve[-1]['reward']:+.2f} a minute; won {won}"

    def write(self, output: Path) -> None:
        """Write the policy, and beside it all that is needed to go on."""
        save(self.learned(), output)
        self.save(output.with_suffix(".training"))

    def save(self, file: Path) -> None:
        """Write all that is needed to go on."""
        kept = {"options": self.options, "updates": self.updates, "decisions": self.decisions, "rate": self.rate}
        kept |= {
            "taught": self.taught,
            "schooled": self.schooled,
            "won": self.won,
            "drawn": self.drawn,
            "curve": self.curve,
            "pool": len(self.pool),
        }
        kept |= {"steps": [self.actor.steps, self.critic.steps], "rng": self.rng.bit_generator.state}
        pool = {f"pool {n} {name}": v for n, former in enumerate(self.pool) for name, v in former.items()}
        part = file.with_name(f"{file.name}.part")
        with part.open("wb") as stream:
            np.savez(stream, kept=np.array(json.dumps(kept)), **self.arrays(), **pool)
        os.replace(part, file)  # a training that is killed meanwhile leaves the one before


def rivals_of(matches: int, strategies: Sequence[str]) -> list[Rival]:
    """Former selves and shipped strategies for a part of the matches, each as each of the teams.

    Raises:
        ConfigError: these are too few.
    """
    kinds = [("", FORMER / 2)] * 2 + [(name, SHIPPED / len(strategies)) for name in strategies]
    found, first = [], 0
    for strategy, share in kinds:
        for team in (0, 1):
            size = max(1, round(matches * share / 2))
            found.append(Rival(slice(first, first + size), team, strategy))
            first += size
    if first >= matches:
        raise ConfigError(f"--matches: expected more than {first}, so that each rival has one, got {matches}")
    return found


def resumed(file: Path) -> Training:
    """The training that was saved in a file.

    Raises:
        ConfigError: it is none, or its match is not what it was.
        OSError: it cannot be read.
    """
    try:
        with np.load(file, allow_pickle=False) as found:
            return restored(found)
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(
            f"--resume {file}: expected a training as this version of train.py writes it, and the match that it was "
            f"begun with: {error}: begin anew, with --start {file.with_suffix('.npz').name} if that is there"
        ) from None


def restored(found: Mapping[str, np.ndarray]) -> Training:
    """The training whose arrays were saved.

    Raises:
        KeyError, ValueError: they are not those of a training of this match.
    """
    kept = json.loads(str(found["kept"]))
    training = Training(kept["options"], again=True)
    if kept["taught"]:
        training.play_for_rewards()
    for name, values in training.arrays().items():
        values[...] = found[name]
    names = list(training.pool[0])
    training.pool = [{name: found[f"pool {n} {name}"] for name in names} for n in range(kept["pool"])]
    training.updates, training.decisions, training.rate = kept["updates"], kept["decisions"], kept["rate"]
    training.won, training.drawn, training.curve = kept["won"], kept["drawn"], kept["curve"]
    training.schooled = kept["schooled"]
    training.actor.steps, training.critic.steps = kept["steps"]
    training.rng.bit_generator.state = kept["rng"]
    return training


def advantages_of(surprises: np.ndarray, going: np.ndarray) -> np.ndarray:
    """The generalised estimates of advantages.

    Args:
        surprises: how much better each step was than its value, shape (steps, matches, players).
        going: whether the match has gone on, shape (steps, matches).
    """
    found, carried = np.zeros_like(surprises), np.zeros_like(surprises[0])
    for step in reversed(range(len(surprises))):
        found[step] = carried = surprises[step] + GAMMA * LAMBDA * carried * going[step][:, None]
    return found


def likelihood(off: np.ndarray, log_std: np.ndarray) -> np.ndarray:
    """The logarithm of the chance of actions, up to a constant, by how many standard deviations they are off."""
    found: np.ndarray = -0.5 * (off * off).sum(axis=-1) - log_std.sum()
    return found


def draw(curve: list[dict[str, float]], file: Path) -> None:
    """Draw how the training went."""
    decisions = np.array([point["decisions"] for point in curve]) / 1e6
    figure = Figure(figsize=(8, 6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(decisions, [point["reward"] for point in curve])
    above.set_ylabel("reward of a player in a minute")
    for name in list(curve[0])[2:]:
        below.plot(decisions, [100 * point[name] for point in curve], label=name)
    below.set(ylabel="won against others (%)", xlabel="million decisions", ylim=(0, 100))
    below.legend()
    figure.savefig(file)


def make_parser() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--match", help="a game, or a match file (the game of --start, or roboflag)")
    add("--minutes", type=float, default=5.0, help="how long, without compiling (%(default)g)")
    add("--output", type=Path, help="the file of the policy (policy.npz, or that of --resume)")
    add("--replace", action="store_true", help="overwrite a policy that is there")
    add("--resume", type=Path, help="go on with a training, such as policy.training, by its options")
    add("--start", help="begin with this policy, such as one of imitate.py, without lessons")
    add("--teacher", help="the shipped strategy of the game that gives lessons at first, or none (the game's first)")
    add("--against", nargs="+", help="the shipped strategies of the game to play against, or none (all)")
    add("--vary", action="store_true", help="each match has robots and links of its own")
    add("--seed", type=int, default=0, help="of all that is drawn (%(default)s)")
    add("--matches", type=int, default=128, help="how many are played at once (%(default)s)")
    add("--horizon", type=int, default=48, help="steps between two updates (%(default)s)")
    add("--hold", type=int, default=3, help="decisions of 0.1 s in a step, with the same action (%(default)s)")
    add("--most", type=int, default=1500, help="decisions after which a match is cut off (%(default)s)")
    return parser


def asked_for(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """The options of the command line, as far as they fit together; a mistake ends the program."""
    options = parser.parse_args()
    given = [name for name, value in vars(options).items() if name not in OWN and value != parser.get_default(name)]
    if options.resume and given:
        parser.error(f"--resume goes on with the options of that training: leave out --{', --'.join(given)}")
    if options.start and options.teacher:
        parser.error("--start begins with what a policy knows, and --teacher with lessons: choose one")
    if options.resume and options.resume.suffix != ".training":
        parser.error(
            f"--resume: expected NAME.training, got {options.resume}; to begin with a policy: --start NAME.npz"
        )
    if not 0.0 < options.minutes < math.inf:
        parser.error(f"--minutes: expected a number above 0, got {options.minutes:g}")
    for name in ("matches", "horizon", "hold", "most"):
        if getattr(options, name) < 1:
            parser.error(f"--{name}: expected 1 or more, got {getattr(options, name)}")
    return options


def begun(options: argparse.Namespace) -> Training:
    """The training that was asked for.

    Raises:
        ConfigError: something that it needs is not there, or what it writes is.
        OSError: a file cannot be read.
    """
    check_place(options.output, replace=options.replace or options.resume == options.output.with_suffix(".training"))
    if options.resume:
        return resumed(options.resume)
    if options.match is None:
        options.match = load(Path(options.start)).game if options.start else "roboflag"
    return Training({name: value for name, value in vars(options).items() if name not in OWN})


def go(training: Training, minutes: float, output: Path) -> None:
    """Train, tell how it goes, and write the policy every few seconds and at the end."""
    stop: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: stop.append(number))
    begin = shown = time.monotonic()
    counted, seconds = training.decisions, 60.0 * minutes
    while not stop and time.monotonic() < begin + seconds:
        done = training.schooled / (SCHOOL * seconds)
        if not training.taught and done >= 1.0:
            training.play_for_rewards()
        last = time.monotonic()
        if training.taught:
            training.update()
            what = training.state()
        else:
            off = training.lesson(FASTEST * (1.0 - 0.95 * done))
            training.schooled += time.monotonic() - last
            what = f"{off:.2f} off what {training.teacher} would have done"
        now = time.monotonic()
        if now - shown > 5.0:
            speed, left = (training.decisions - counted) / (now - shown), max(0.0, begin + seconds - now)
            count = f"{training.decisions / 1e6:6.1f} million decisions, {speed / 1e3:4.0f} thousand a second"
            print(f"{count}; {what}; {left:4.0f} s left", flush=True)
            shown, counted = now, training.decisions
            training.write(output)
    training.write(output)
    if training.curve:
        draw(training.curve, output.with_suffix(".png"))


def main() -> None:
    """Read the command line, train, and write what was learned."""
    options = asked_for(make_parser())
    options.output = options.output or (options.resume or Path("policy.npz")).with_suffix(".npz")
    slow = threading.Timer(2.0, print, ["compiling the game: about a minute, the first time"], {"flush": True})
    slow.start()
    try:
        training = begun(options)
    except (ConfigError, OSError) as error:
        sys.exit(str(error))
    finally:
        slow.cancel()
    before = training.decisions
    go(training, options.minutes, options.output)
    training.batch.close()
    new = f", {(training.decisions - before) / 1e6:.1f} of them now" if before else ""
    print(f"{training.decisions / 1e6:.1f} million decisions{new}; wrote {options.output}. To see how good it is:")
    opponent, match = strategies_of(training.game)[0], shlex.quote(training.options["match"])
    print(f"    vrg compare {shlex.quote(str(options.output))} {opponent} --match {match}")


if __name__ == "__main__":
    main()
