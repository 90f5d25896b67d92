"""Situations and matches for tests of learning."""

import functools
import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vrg.agents.strategy import View
from vrg.bus.messages import RefereeState, Stage
from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import GameState, Observation
from vrg.hal.readings import Readings
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.types import STILL, Pose, Twist, Vector
from vrg_learn.environment import MatchEnvironment
from vrg_learn.learning import Learning, learning_of
from vrg_learn.observation import names, observe

SHARKS = "sharks-and-minnows"
GAMES_LEARNED = (SHARKS, "roboflag", "pursuit-evasion")


@functools.cache
def shipped(game: str) -> MatchSetup:
    """The match that a game ships, with the players and marks of the thesis where it has some."""
    return load_match(_file(game))


def _file(game: str) -> Path:
    return match_path({SHARKS: f"{SHARKS}-table-4-2"}.get(game, game))


class Situation:
    """A hand-made instant of play in the match that a game ships.

    Args:
        game: its name. poses: where players are; the others stand where they start.
        change: makes the state of the game from its first one.
    """

    def __init__(
        self, game: str, poses: Mapping[str, Pose] | None = None, clock: float = 0.0, **change: object
    ) -> None:
        self.setup: MatchSetup = shipped(game)
        self.learning: Learning = learning_of(game)
        match = Match(rulebook_of(self.setup))
        match.stage, match.clock = Stage.PLAY_ROUND, clock
        first = match.game
        assert isinstance(first, GameState)
        match.game = type(first)(**{name: change.get(name, getattr(first, name)) for name in first.__struct_fields__})
        self.poses = {p.name: p.pose for p in self.setup.players} | dict(poses or {})
        self.state: RefereeState = match.state(Observation(self.poses), estop=False)

    def view(
        self, name: str, twist: Twist = STILL, velocities: Mapping[str, Vector] | None = None, *samples: Sample[object]
    ) -> View:
        """What a player sees, whose wheels measure `twist`."""
        odometry = Sample(0.0, 0.0, Odometry(pose=Pose(0.0, 0.0, 0.0), twist=twist))
        me = self.state.player(name)
        assert me is not None
        return View(
            time=1.0,
            me=me,
            readings=Readings(0.0, 0.0, True, False, samples=[odometry, *samples]),
            referee=self.state,
            velocities=velocities or {},
            robot=self.setup.player(name).robot,
            pose=self.poses[name],
        )

    def seen(self, view: View, *, raw: bool = False) -> dict[str, float]:
        """The values of an observation by their names."""
        values = observe(view, self.learning, raw=raw)
        assert values.dtype == np.float32
        words = names(self.learning, len(self.setup.players), raw=raw)
        assert len(words) == len(set(words)) == len(values)
        return dict(zip(words, values.tolist(), strict=True))


def digest(game: str, seed: int, max_time: float) -> str:
    """A hash over all that an environment returns in one match of random actions."""
    env = MatchEnvironment(game, max_time=max_time, shaping=True)
    for number, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(number)
    found = hashlib.sha256()
    observations, _ = env.reset(seed=seed)
    while env.agents:
        for agent in env.agents:
            found.update(observations[agent].tobytes())
        found.update(env.state().tobytes())
        actions = {agent: env.action_space(agent).sample() for agent in env.agents}
        observations, rewards, terminations, truncations, infos = env.step(actions)
        found.update(repr((rewards, terminations, truncations, infos)).encode())
    return found.hexdigest()


def short_match(folder: Path, game: str, rules: str = "", top: str = "", players: str = "") -> Path:
    """The match file of a game with further lines at the top, in [rules] and in each table of a player."""
    text = _file(game).read_text(encoding="utf-8")
    text = text.replace("[rules]", f"{top}\n[rules]\n{rules}").replace("[[players]]", f"[[players]]\n{players}")
    file = folder / "match.toml"
    file.write_text(text, encoding="utf-8")
    return file
