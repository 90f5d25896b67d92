"""Teaches a team to play: first lessons by a shipped strategy, then play against that, others and itself.

    python examples/learning/train.py --match roboflag --minutes 20

All players of a match learn one policy, each from what it sees. In the lessons (lessons.py) it drives, and is corrected
by what a teacher would have done; after them it learns by the rewards (ppo.py). It writes policy.npz, which plays in a
match, policy.training, from which `--resume` goes on, and policy.png with the curve. Ctrl-C ends it and keeps what is
learned.
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
from pathlib import Path
from typing import Any, NamedTuple

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # the policy and the value learn in a thread each, which is faster

import numpy as np
from lessons import Lessons
from matplotlib.figure import Figure
from places import check_place
from ppo import GAMMA, Experience, Learner, advantages_of, likelihood

from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.registry import did_you_mean
from vrg_learn.batch.matches import Batch
from vrg_learn.batch.refereed import OWN_STRATEGY
from vrg_learn.batch.stepping import Variation
from vrg_learn.learning import learning_of
from vrg_learn.network import Network, Parameters, initial, layout_of
from vrg_learn.policy import Policy, load, save

POOL, KEEP_EVERY, DRAW_EVERY = 30, 10, 5  # former selves; updates between two of them, and between two draws
WARM = 8  # updates that teach the value alone, as one that knows nothing yet would spoil what a policy can already
FORMER, SHIPPED = 0.2, 0.5  # the shares of the matches against former selves, and against shipped strategies
SCHOOL = 0.25  # the share of the time for lessons
KEPT = ("options", "text", "updates", "decisions", "school", "schooled", "won", "drawn", "curve")  # saved attributes
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

    Attributes:
        game, text: the game, and the match file. batch: the matches. learner: the policy and the value.
        lessons: those that it has, until they are over; None after them.
        school, schooled: the real time in s that all lessons take, and that they have taken.
        teacher, against: the names of strategies. pool: former selves.
        rivals: who plays in place of the policy, and drawn: as which of the pool. won: the shares of games, by name.
        learns: whose decisions are learned from, shape (matches, players).
        knows: True if the policy can play already, when it begins to learn by rewards.
        updates, decisions: how many so far. curve: a point for each update.

    Raises:
        ConfigError: the game cannot be played in a batch, has no such strategy there, or needs more matches.
    """

    def __init__(self, options: dict[str, Any], *, again: bool = False) -> None:
        self.options = options
        setup = load_match(match_path(options["match"]))
        self.game, self.text = setup.game, setup.text
        layout = layout_of(learning_of(setup.game))
        self.rng = np.random.default_rng(options["seed"])
        vary = VARIED if options["vary"] else Variation()
        self.batch = Batch(
            setup, options["matches"], seed=options["seed"], vary=vary, shaping=True, most=options["most"]
        )
        self.teacher, self.against = self._strategies()
        own, slot = len(layout.own), len(layout.slot)
        actor: Parameters = {**initial(own, slot, 2, self.rng), "log_std": np.full(2, -0.5, dtype=np.float32)}
        if options["start"] and not again:
            policy = load(Path(options["start"]))
            if policy.game != self.game or len(policy.log_std) != 2:
                got = f"one of {policy.game} with {len(policy.log_std)}"
                raise ConfigError(
                    f"{options['start']}: expected a policy of {self.game} with 2 numbers in an action, got {got}"
                )
            actor = {**policy.network.parameters, "log_std": policy.log_std.copy()}
        self.learner = Learner(actor, initial(own, slot, 1, self.rng, last=0.1), self.rng)
        self.pool: list[Parameters] = []
        self.updates = self.decisions = 0
        self.school = self.schooled = 0.0
        self.curve: list[dict[str, float]] = []
        self.rivals = rivals_of(options["matches"], self.against)
        self.drawn = [0 for _ in self.rivals]
        self.won = {rival.name: 0.5 for rival in self.rivals}
        self.learns = np.ones((options["matches"], len(self.batch.sides)), dtype=bool)
        for rival in self.rivals:
            self.learns[rival.matches] = self.batch.sides != rival.team
        self.lessons: Lessons | None = None
        self.knows = bool(options["start"]) or self.teacher != "none"
        if options["start"] or self.teacher == "none":
            self.play_for_rewards()
        else:
            self.lessons = Lessons(self.batch, self.learner, self.teacher, self.against, options["hold"])
        self.batch.step(np.zeros((*self.learns.shape, 2), dtype=np.float32))  # the first step compiles

    def _strategies(self) -> tuple[str, list[str]]:
        """The teacher, and the strategies to play against."""
        shipped = self.batch.strategies
        teacher = self.options["teacher"] or (shipped[0] if shipped else "none")
        against = [name for name in self.options["against"] or shipped if name != "none"]
        for option, names in (("--teacher", [teacher]), ("--against", against)):
            if strange := [name for name in names if name not in (*shipped, "none")]:
                known, guess = ", ".join((*shipped, "none")), did_you_mean(strange[0], shipped)
                of = f"{self.game} (--match {self.options['match']})"
                raise ConfigError(f"{option}: expected one of {known} for {of}, got {strange[0]!r}{guess}")
        return teacher, against

    def play_for_rewards(self) -> None:
        """End the lessons: from now on the rivals play, and the policy learns from the rewards."""
        self.lessons = None
        for team in self.batch.teams[:2]:
            self.batch.play_by(slice(None), team, None)
        for rival in self.rivals:
            if rival.strategy:
                self.batch.play_by(rival.matches, self.batch.teams[rival.team], rival.strategy)
        self.keep()
        self.batch.reset()

    def keep(self) -> None:
        """Put the policy as it is now into the pool of former selves."""
        if len(self.pool) == POOL:
            self.pool.pop(int(self.rng.integers(POOL)))
        self.pool.append({name: values.copy() for name, values in self.learner.policy.parameters.items()})

    def go_on(self) -> float:
        """Have a lesson, or play and learn from it; return how far off the teacher it was, or the reward a minute."""
        left = 1.0 - self.schooled / self.school if self.school else 0.0
        if self.lessons is not None and left > 0.0:
            begin = time.monotonic()
            off = self.lessons.lesson(left)
            self.decisions += self.lessons.decisions
            self.schooled += time.monotonic() - begin
            return off
        if self.lessons is not None:
            self.play_for_rewards()
        if self.updates % DRAW_EVERY == 0:
            self.drawn = [int(self.rng.integers(len(self.pool))) for _ in self.rivals]
        self.learner.learn(self.play(), value_alone=self.knows and self.updates < WARM)
        self.updates += 1
        if self.updates % KEEP_EVERY == 0:
            self.keep()
        return self.curve[-1]["reward"]

    def told(self, value: float) -> str:
        """What `go_on` has returned, in words."""
        if self.lessons is not None:
            return f"{value:.2f} off what {self.teacher} would have done"
        won = ", ".join(f"{100 * share:.0f} % against {name}" for name, share in self.won.items())
        return f"reward {value:+.2f} a minute; won {won}"

    def play(self) -> Experience:
        """Play `horizon` steps of all matches, and return the decisions of the players that learn."""
        learner, steps, players, mine = self.learner, self.options["horizon"], self.learns.shape, self.learns
        saw = np.zeros((steps + 1, *players, self.batch.length), dtype=np.float32)
        wanted = np.zeros((steps, *players, 2), dtype=np.float32)
        chance, rewards, able = np.zeros((3, steps, *players), dtype=np.float32)
        over, cut = np.zeros((2, steps, players[0]), dtype=bool)
        ends: list[tuple[int, np.ndarray, np.ndarray]] = []
        saw[0] = self.batch.out.observations
        for step in range(steps):
            able[step] = self.batch.out.able
            off = self.rng.standard_normal((*players, 2), dtype=np.float32)
            means = np.tanh(learner.outputs(learner.policy, saw[step][mine]))
            wanted[step][mine] = means + np.exp(learner.log_std) * off[mine]
            chance[step] = likelihood(off, learner.log_std)
            for rival, former in zip(self.rivals, self.drawn, strict=True):
                if not rival.strategy:
                    theirs, spread = ~mine[rival.matches], np.exp(self.pool[former]["log_std"])
                    means = np.tanh(Network(self.pool[former])(saw[step][rival.matches][theirs]))
                    wanted[step][rival.matches][theirs] = means + spread * off[rival.matches][theirs]
            action = np.clip(wanted[step], -1.0, 1.0)
            for _ in range(self.options["hold"]):
                out = self.batch.step(action)
                going = ~(over[step] | cut[step])
                rewards[step] += out.rewards * going[:, None]
                ended = (out.terminated | out.truncated) & going
                cut_now = out.truncated & going
                if cut_now.any():
                    ends.append((step, np.flatnonzero(cut_now), out.last[cut_now]))
                over[step] |= out.terminated & going
                cut[step] |= cut_now
                self.count(out.winners, ended)
            saw[step + 1] = out.observations
        self.decisions += steps * self.options["hold"] * mine.size
        values = np.zeros((steps + 1, *players), dtype=np.float32)
        values[:, mine] = learner.outputs(learner.value, saw[:, mine])[..., 0].reshape(steps + 1, -1)
        beyond = values[1:].copy()
        for step, matches, last in ends:
            beyond[step, matches] = learner.value(last.reshape(-1, saw.shape[-1])).reshape(len(matches), -1)
        beyond[over] = 0.0
        advantages = advantages_of(rewards + GAMMA * beyond - values[:-1], ~(over | cut))
        reward = float(rewards[:, mine].mean()) / self.options["hold"] * 600.0
        self.curve.append({"decisions": self.decisions, "reward": reward, **self.won})
        side = np.broadcast_to(self.batch.sides, rewards.shape)
        found = saw[:-1], wanted, chance, advantages, advantages + values[:-1], able, side
        return Experience(*(array[np.broadcast_to(mine, rewards.shape)] for array in found))

    def count(self, winners: np.ndarray, ended: np.ndarray) -> None:
        """Count the games that have ended, the last 50 or so against each rival."""
        for rival in self.rivals:
            for winner in winners[rival.matches][ended[rival.matches]]:
                result = 0.5 if winner not in (0, 1) else float(winner != rival.team)
                self.won[rival.name] += 0.02 * (result - self.won[rival.name])

    def learned(self) -> Policy:
        """The policy as it is now."""
        parameters = {name: values for name, values in self.learner.policy.parameters.items() if name != "log_std"}
        what = f"train.py: {self.decisions / 1e6:.1f} million decisions of {self.options['match']}"
        return Policy(self.game, Network(parameters), self.learner.log_std, what)

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays that change, by name; they can be written to."""
        found = {"out": self.batch.out.observations, "able": self.batch.out.able}
        for kind, adam in (("actor", self.learner.actor), ("critic", self.learner.critic)):
            for part, group in (("", adam.parameters), (" mean", adam.means), (" square", adam.squares)):
                found |= {f"{kind}{part} {name}": values for name, values in group.items()}
        for name, records in self.batch.records._asdict().items():
            if isinstance(records, np.recarray):
                found[f"batch {name}"] = records.view(np.ndarray).view(np.uint8)
        return found

    def write(self, output: Path) -> None:
        """Write the policy, and beside it all that is needed to go on."""
        save(self.learned(), output)
        self.write_training(output.with_suffix(".training"))

    def write_training(self, file: Path) -> None:
        """Write all that is needed to go on."""
        kept = {name: getattr(self, name) for name in KEPT} | {
            "rate": self.learner.rate,
            "taught": self.lessons is None,
            "pool": len(self.pool),
            "steps": [self.learner.actor.steps, self.learner.critic.steps],
            "rng": self.rng.bit_generator.state,
        }
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
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
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
    if training.text != kept["text"]:
        raise ConfigError(f"--resume: {kept['options']['match']} has changed since: begin anew, or put it back")
    if kept["taught"]:
        training.play_for_rewards()
    for name, values in training.arrays().items():
        values[...] = found[name]
    for name in KEPT:
        setattr(training, name, kept[name])
    names = list(training.learner.policy.parameters)
    training.pool = [{name: found[f"pool {n} {name}"] for name in names} for n in range(kept["pool"])]
    training.learner.rate = kept["rate"]
    training.learner.actor.steps, training.learner.critic.steps = kept["steps"]
    training.rng.bit_generator.state = kept["rng"]
    if training.batch.referees is not None:  # which are not kept, so their matches begin again
        training.batch.reset()
    return training


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
    if options.seed < 0:
        parser.error(f"--seed: expected 0 or more, got {options.seed}")
    return options


def begun(options: argparse.Namespace) -> Training:
    """The training that was asked for.

    Raises:
        ConfigError: something that it needs is not there, or what it writes is.
        OSError: a file cannot be read.
    """
    own = options.resume == options.output.with_suffix(".training")
    check_place("--output", options.output, ".training", ".png", replace=options.replace or own)
    if options.resume:
        return resumed(options.resume)
    if options.match is None:
        options.match = load(Path(options.start)).game if options.start else "roboflag"
    if Path(options.match).is_file():
        options.match = str(Path(options.match).resolve())  # `--resume` may be typed elsewhere
    return Training({name: value for name, value in vars(options).items() if name not in OWN})


def go(training: Training, minutes: float, output: Path) -> None:
    """Train, tell how it goes, and write the policy every few seconds and at the end."""
    stop: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: stop.append(number))
    begin = shown = time.monotonic()
    counted, seconds = training.decisions, 60.0 * minutes
    training.school = training.school or SCHOOL * seconds
    while not stop and time.monotonic() < begin + seconds:
        value = training.go_on()
        now = time.monotonic()
        if now - shown > 5.0:
            speed, left = (training.decisions - counted) / (now - shown), max(0.0, begin + seconds - now)
            count = f"{training.decisions / 1e6:6.1f} million decisions, {speed / 1e3:4.0f} thousand a second"
            print(f"{count}; {training.told(value)}; {left:4.0f} s left", flush=True)
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
        slow.cancel()
        before = training.decisions
        go(training, options.minutes, options.output)
        training.batch.close()
    except (ConfigError, OSError) as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("stopped before there was anything to write")
    finally:
        slow.cancel()
    new = f", {(training.decisions - before) / 1e6:.1f} of them now" if before else ""
    print(f"{training.decisions / 1e6:.1f} million decisions{new}; wrote {options.output}")
    match = shlex.quote(training.options["match"])
    if shipped := [name for name in training.batch.strategies if name != OWN_STRATEGY]:
        print("To see how good it is:")
        print(f"    vrg compare {shlex.quote(str(options.output))} {shipped[0]} --match {match}")


if __name__ == "__main__":
    main()
