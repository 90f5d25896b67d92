"""A match as a ParallelEnv of PettingZoo: each player that learns gets what it sees, and answers with a motion."""

import math
import operator
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from msgspec import structs

from vrg.agents.player import PERIOD
from vrg.bus.messages import DISQUALIFIED, Call, RefereeState
from vrg.bus.node import Node
from vrg.config.loading import check_strategies
from vrg.config.setup import CheckedMatch, MatchSetup
from vrg.errors import ConfigError
from vrg.launch.strategy_class import strategy_of
from vrg.types import Twist
from vrg_learn.action import limits_of, twist_of
from vrg_learn.episode import Episode
from vrg_learn.learning import learning_of
from vrg_learn.matches import learners_of, match_of, with_opponents
from vrg_learn.observation import Vector, names, observe
from vrg_learn.picture import SceneCamera, SceneNode
from vrg_learn.record import MatchRecord
from vrg_learn.rewards import Standpoint, for_calls, for_progress, for_winning, standpoint
from vrg_learn.state import StateLayout

try:
    from gymnasium.spaces import Box, Space
    from pettingzoo import ParallelEnv
except ImportError as error:
    raise ImportError(
        f"an environment needs PettingZoo and Gymnasium: pip install 'virtual-robotic-games[learn]': {error}"
    ) from error

RGB_ARRAY = "rgb_array"
METADATA: dict[str, Any] = {
    "name": "vrg_v0",
    "render_modes": [RGB_ARRAY],
    "render_fps": round(1 / PERIOD),
    "is_parallelizable": True,
}
"""What libraries for learning read of an environment; its name is that of its game."""
MAX_TIME = 3600.0
"""The time of play in s after which a match is cut off, in all rounds together, if no other is asked for."""
_NEXT_SEED = "the next match of an environment"
"""The purpose of the number that the seed of a match gives to the next one."""

Observations = dict[str, Vector]
Infos = dict[str, dict[str, Any]]


class MatchEnvironment(ParallelEnv[str, npt.NDArray[Any], npt.NDArray[Any]]):
    """A match of any game that can be learned, with virtual robots in this process.

    One step is one decision: 0.1 s of match time. Before each round robots are put on their marks at once, and what
    happens between two rounds is a part of the step before, so that every step is one of play. A player that is out of
    play, or driven by the referee, stays in `agents`: its actions do nothing, and `infos[agent]["able"]` is False. (The
    `action_mask` of other environments tells which of some choices are allowed; here there are none.)

    An observation is described in `vrg_learn.observation`, and `observation_names` names its values. An action is
    (v, w), as fractions of the top speeds of the player's robot, from -1 to 1; a robot that can drive sideways has a
    third one, to the left. What is beyond is cut off. A reward is what the referee's calls since the last step are
    worth by the game's table, and 1 or -1 at the end for who wins or loses.

    The same seed and the same actions give the same match. The strategies of the others decide in this process, so
    their code is trusted: nothing bounds its time and its memory.

    A copy, by `copy.deepcopy` or by pickle, goes on from the same instant: it plays the match again by its seed and its
    actions, as strategies may hold anything. It leaves no run folder.

    Args:
        match: a game's name, the path of a match file, or a match that was read.
        learners: the players that learn; None for all that are no opponents. Without any, a match plays by itself.
        opponents: strategies of players that do not learn, by the player or by the team: a name such as
            `conservative`, `module:Class` or `file.py:Class`. Without one, such a player plays as the match file says.
            Each match begins with the files of strategies as they are then.
        engine: the physics engine; None for that of the match. `planar` is the fastest one.
        lasers: False simulates no range finders, which is faster; None for what the match says. Learners see scans in
            pursuit-evasion alone.
        raw: True gives observations and takes actions in SI units, without bounds for the observations.
        shaping: True adds rewards for what leads there: for calls by the game's second table, and for coming nearer to
            a goal. `infos[agent]["shaping"]` is that part of the reward.
        gamma: the discount by which rewards for coming nearer are made, so that they do not change what is best.
        max_time: the time of play in s after which the match is cut off, in all rounds together.
        render_mode: `rgb_array` lets `render` return pictures; None draws nothing.
        record: the folder in which every match leaves a run folder, as `vrg play` does; None leaves nothing.
        strict: True passes every message through the codec of the bus, which is slow.

    Attributes:
        possible_agents: the players that learn. agents: those that still play.
        state_space: the space of `state`. state_names: the names of its values.
        match_seed: the seed of the match that is played, or of the next one before the first.
        over: True if the match has ended, and before the first.

    Raises:
        ConfigError: the match cannot be learned, or an argument is wrong.
    """

    metadata = METADATA

    def __init__(
        self,
        match: str | Path | CheckedMatch,
        *,
        learners: Sequence[str] | None = None,
        opponents: Mapping[str, str] | None = None,
        engine: str | None = "planar",
        lasers: bool | None = None,
        raw: bool = False,
        shaping: bool = False,
        gamma: float = 0.99,
        max_time: float = MAX_TIME,
        render_mode: str | None = None,
        record: Path | str | None = None,
        strict: bool = False,
    ) -> None:
        setup, named = with_opponents(match_of(match, engine=engine, lasers=lasers), opponents or {})
        learning = learning_of(setup.game)
        if render_mode not in (None, RGB_ARRAY):
            raise ConfigError(f"render_mode: expected {RGB_ARRAY!r} or None, got {render_mode!r}")
        if not 0.0 <= gamma <= 1.0:
            raise ConfigError(f"gamma: expected a discount from 0 to 1, got {gamma!r}")
        if not max_time > 0.0:
            raise ConfigError(f"max_time: expected a time above 0 s, got {max_time!r}")
        self.possible_agents = learners_of(setup, learners, named)
        self.agents: list[str] = []
        self.metadata = {**METADATA, "name": f"vrg_{setup.game.replace('-', '_')}_v0"}
        self.render_mode = render_mode
        self.match_seed = setup.seed
        self.over = True
        self._setup, self._learning = setup, learning
        self._raw, self._shaping, self._gamma, self._max_time, self._strict = raw, shaping, gamma, max_time, strict
        self._runs = None if record is None else Path(record)
        self._record: MatchRecord | None = None
        self._robots = {player.name: player.robot for player in setup.players}
        self._teams = {player.name: player.team for player in setup.players}
        check_strategies(setup, self._checked)
        layout = StateLayout(setup, learning)
        self.state_names, self._layout = layout.names, layout
        self.state_space = Box(-1.0, 1.0, (len(layout.names),), np.float32)
        self.observation_names = names(learning, len(setup.players), raw=raw)
        bound = math.inf if raw else 1.0
        self.observation_spaces = {
            agent: Box(-bound, bound, (len(self.observation_names),), np.float32) for agent in self.possible_agents
        }
        self._limits = {agent: limits_of(self._robots[agent]) for agent in self.possible_agents}
        self.action_spaces = {agent: _actions(limits, raw=raw) for agent, limits in self._limits.items()}
        self._episode: Episode | None = None
        self._picture: SceneNode | None = None
        self._camera: SceneCamera | None = None
        self._begun = False
        self._standpoints: dict[str, Standpoint] = {}
        self._past: list[dict[str, Twist]] = []
        """The motions of all decisions of the match that is played."""

    def __getstate__(self) -> dict[str, Any]:
        """The data from which a copy is made."""
        options = {
            "learners": self.possible_agents, "raw": self._raw, "shaping": self._shaping, "gamma": self._gamma,
            "max_time": self._max_time, "render_mode": self.render_mode, "strict": self._strict,
        }  # fmt: skip
        past = None if self._episode is None else list(self._past)
        return {
            "match": self._setup, "options": options, "spaces": self.action_spaces, "seed": self.match_seed,
            "begun": self._begun, "past": past,
        }  # fmt: skip

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Become a copy.

        Raises:
            ConfigError: as the constructor. StrategyError, LaunchError: as `step`.
        """
        MatchEnvironment.__init__(self, state["match"], engine=None, **state["options"])
        self.action_spaces, self.match_seed, past = state["spaces"], state["seed"], state["past"]
        if past is not None:
            self.reset(self.match_seed)
            for twists in past:
                self._decide(twists)
        self._begun = state["begun"]

    @property
    def referee(self) -> RefereeState:
        """The state of the match as the referee publishes it to all players.

        Raises:
            ConfigError: no match is being played.
        """
        return self._playing("referee").state

    def observation_space(self, agent: str) -> Space[npt.NDArray[Any]]:
        """The space of a player's observations, always the same object.

        Raises:
            ConfigError: the player does not learn.
        """
        return self.observation_spaces[self._known(agent)]

    def action_space(self, agent: str) -> Space[npt.NDArray[Any]]:
        """The space of a player's actions, always the same object.

        Raises:
            ConfigError: the player does not learn.
        """
        return self.action_spaces[self._known(agent)]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observations, Infos]:
        """Begin a match, and go on to the first decision of play.

        Args:
            seed: of the match. Without one, the first match has that of the match file, and each further one a seed
                that follows from the one before.
            options: there are none; all are ignored.

        Returns:
            what each player sees, and infos, both by player.

        Raises:
            ConfigError: the seed is wrong, or a strategy cannot be made.
            StrategyError: as `step`. LaunchError: no round begins, or the match cannot be recorded.
        """
        self._end()
        if seed is not None:
            self.match_seed = _seed(seed)
        elif self._begun:
            self.match_seed = structs.replace(self._setup, seed=self.match_seed).draw(_NEXT_SEED)
        self._begun = True
        try:
            self._episode = episode = self._start(structs.replace(self._setup, seed=self.match_seed))
            episode.start()
        except BaseException:
            self._end()
            raise
        self.agents, self.over, self._past = list(self.possible_agents), episode.over, []
        observations = self._observations(episode, self.agents)
        if self._shaping:
            self._standpoints = self._stand(episode, self.agents)
        return observations, self._infos(episode.state, self.agents)

    def step(
        self, actions: Mapping[str, npt.ArrayLike]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Let all players decide, and go on to their next decision.

        Args:
            actions: the action of each player in `agents`.

        Returns:
            five dicts, by the players that were in `agents` before: what each sees, its reward, whether it is done for
            good (the game is over, or it is disqualified), whether the match was cut off, and infos.

        Raises:
            ConfigError: an action is missing or wrong (then nothing has happened), or no match is being played.
            StrategyError: the strategy of another player has failed. LaunchError: play was halted. After both `reset`
                begins another match.
        """
        episode = self._episode
        if episode is None or self.over:
            when = "has ended" if self._begun else "has not begun"
            raise ConfigError(f"step: expected a match that is being played, but it {when}: call reset() first")
        return self._decide(self._twists(actions, self.agents))

    def _decide(
        self, twists: dict[str, Twist]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Do what `step` does, once the motions of all players are known."""
        episode, agents = self._playing("step"), self.agents
        try:
            calls = episode.decide(twists)
        except BaseException:
            self._end()
            raise
        self._past.append(twists)
        state = episode.state
        cut = not episode.over and state.total >= self._max_time - 1e-9
        self.over = episode.over or cut
        out = {player.name for player in state.players if player.state == DISQUALIFIED}
        infos = self._infos(state, agents)
        rewards = self._rewards(episode, agents, calls, infos)
        terminations = {agent: episode.over or agent in out for agent in agents}
        truncations = dict.fromkeys(agents, cut)
        self.agents = [agent for agent in agents if not (terminations[agent] or cut)]
        observations = self._observations(episode, agents)
        if self.over:
            self._conclude(linger=episode.over)
        return observations, rewards, terminations, truncations, infos

    def state(self) -> Vector:
        """Return the whole state of the match, also what no player sees; `state_names` names its values.

        Raises:
            ConfigError: no match is being played.
        """
        episode = self._playing("state")
        return self._layout.vector(episode.state, episode.bodies)

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return a picture as the spectator's window shows it: shape (height, width, 3); None without a render mode.

        Raises:
            ConfigError: no match is being played.
        """
        if self.render_mode is None:
            return None
        self._playing("render")
        if self._picture is None:
            raise ConfigError("render: expected a match that began with a render mode: call reset() first")
        if self._camera is None:
            self._camera = SceneCamera()
        return self._camera.picture(self._picture.scene)

    def close(self) -> None:
        """End the match. Idempotent; `reset` begins another one."""
        self._end()

    def _playing(self, what: str) -> Episode:
        if self._episode is None:
            raise ConfigError(f"{what}: expected a match that has begun: call reset() first")
        return self._episode

    def _known(self, agent: str) -> str:
        if agent not in self._limits:
            raise ConfigError(f"expected a player that learns ({', '.join(self.possible_agents)}), got {agent!r}")
        return agent

    def _checked(self, setup: MatchSetup, name: str) -> None:
        """Make the strategy of a player if it will be asked anything."""
        if self._learning.talks or name not in self.possible_agents:
            strategy_of(setup, name)

    def _start(self, setup: CheckedMatch) -> Episode:
        """Make the nodes of a match, with what it leaves behind if it is recorded."""
        watchers: list[Node] = []
        if self.render_mode is not None:
            self._picture = SceneNode(setup)
            watchers.append(self._picture)
        journal = None
        if self._runs is not None:
            self._record = MatchRecord(self._runs, setup, self.possible_agents)
            journal = self._record.journal
            watchers.append(self._record.recorder)
        return Episode(
            setup,
            self.possible_agents,
            talks=self._learning.talks,
            journal=journal,
            watchers=watchers,
            strict=self._strict,
        )

    def _end(self) -> None:
        """End the match that is being played, if there is one; nothing more can be asked of it."""
        self.agents, self.over = [], True
        try:
            self._conclude(linger=False)
        finally:
            self._episode = None

    def _conclude(self, *, linger: bool) -> None:
        """Stop the nodes of the match, and conclude its record; its last state can still be asked for.

        Args:
            linger: True lets every node hear how the match ended, if it is recorded.
        """
        episode, record, self._record = self._episode, self._record, None
        try:
            if episode is not None:
                episode.close(linger=linger and record is not None)
        finally:
            if record is not None:
                record.close(None if episode is None or not episode.begun else episode.state)

    def _twists(self, actions: Mapping[str, npt.ArrayLike], agents: Sequence[str]) -> dict[str, Twist]:
        """The motions of all players that still play.

        Raises:
            ConfigError: an action is missing or wrong.
        """
        if missing := [agent for agent in agents if agent not in actions]:
            raise ConfigError(
                f"step: expected an action of each of {', '.join(agents)}, got none of {', '.join(missing)}"
            )
        for agent in actions:
            self._known(agent)
        twists = {}
        for agent in agents:
            try:
                twists[agent] = twist_of(actions[agent], self._limits[agent], raw=self._raw)
            except ConfigError as error:
                raise ConfigError(f"the action of {agent}: {error}") from None
        return twists

    def _observations(self, episode: Episode, agents: Sequence[str]) -> Observations:
        """What players see. One whose robot reports nothing still sees what it saw last."""
        seen = {}
        for agent in agents:
            view = episode.puppets[agent].view
            if view is None:
                seen[agent] = np.zeros(len(self.observation_names), np.float32)
            else:
                seen[agent] = observe(view, self._learning, raw=self._raw)
        return seen

    def _stand(self, episode: Episode, agents: Sequence[str]) -> dict[str, Standpoint]:
        views = {agent: episode.puppets[agent].view for agent in agents}
        return {agent: standpoint(view, self._learning) for agent, view in views.items() if view is not None}

    def _rewards(
        self, episode: Episode, agents: Sequence[str], calls: Sequence[Call], infos: Infos
    ) -> dict[str, float]:
        """The reward of each player for what has happened since its last decision."""
        earned = for_calls(calls, self._learning.rewards, self._teams)
        won = for_winning(episode.state.winner if episode.over else None, self._teams)
        rewards = {agent: earned[agent] + won[agent] for agent in agents}
        if not self._shaping:
            return rewards
        extra = for_calls(calls, self._learning.shaping, self._teams)
        before, self._standpoints = self._standpoints, self._stand(episode, agents)
        for agent in agents:
            if agent in before and agent in self._standpoints:
                extra[agent] += for_progress(before[agent], self._standpoints[agent], self._gamma)
            infos[agent]["shaping"] = extra[agent]
            rewards[agent] += extra[agent]
        return rewards

    def _infos(self, state: RefereeState, agents: Sequence[str]) -> Infos:
        able = {player.name: player.may_move and player.lease is None for player in state.players}
        infos: Infos = {agent: {"able": able[agent]} for agent in agents}
        if self._shaping:
            for info in infos.values():
                info["shaping"] = 0.0
        if state.winner is not None:
            for info in infos.values():
                info["winner"] = state.winner
        return infos


def _actions(limits: Sequence[float], *, raw: bool) -> Box:
    high = np.array(limits if raw else [1.0] * len(limits), dtype=np.float32)
    return Box(-high, high, dtype=np.float32)


def _seed(seed: object) -> int:
    """A seed as a number.

    Raises:
        ConfigError: it is not one.
    """
    try:
        number = operator.index(seed)  # type: ignore[arg-type]
    except TypeError:
        number = -1
    if not 0 <= number < 2**63:
        raise ConfigError(f"seed: expected a whole number from 0 to 2**63 - 1, got {seed!r}")
    return number
