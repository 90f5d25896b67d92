"""Plays matches in a batch, lets the referee of a match judge the same poses, and compares the calls of both."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from msgspec import structs

from vrg.bus.messages import Stage
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.coordinator.look import NO_ONE
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Call, Observation
from vrg.types import Pose
from vrg_learn.batch.matches import Batch
from vrg_learn.batch.stepping import PERIOD

Singles = npt.NDArray[np.float32]
Drives = Callable[[Singles, np.random.Generator], Singles]
"""Returns actions for observations: both of shape (matches, players, values)."""
Leaps = Callable[[npt.NDArray[np.float64], np.random.Generator], None]
"""Puts robots somewhere else: changes poses, of shape (matches, players, 3)."""
Made = tuple[str, tuple[str, ...]]
"""A call: its rule, and the players that it names."""
TURNS, ASTRAY, ARC = 0.02, 0.3, 0.1
"""How often a player changes its mind at a decision, how often it then goes astray, and how much it turns there."""


class Spirits:
    """Moves players through one another and through walls, to one place after another, and no driver moves them.

    So what is decided where rules meet happens often: also the inactive are where they may not be.

    Args:
        places: those to go to, (x, y) in m, and `near` how near each is gone to, m. step: how far at a look, m.
    """

    def __init__(self, places: Collection[tuple[float, float]], near: float = 1.0, step: float = 0.4) -> None:
        self._places, self._near, self._step = np.array(list(places)), near, step
        self._goals: Any = None

    def __call__(self, poses: npt.NDArray[np.float64], rng: np.random.Generator) -> None:
        """Move all of them by a step, in place."""
        shape = poses.shape[:2]
        drawn = self._places[rng.integers(len(self._places), size=shape)] + rng.normal(0.0, self._near, (*shape, 2))
        if self._goals is None:
            self._goals = drawn
        self._goals = np.where(rng.random((*shape, 1)) < 0.05, drawn, self._goals)
        way = self._goals - poses[..., :2]
        far = np.hypot(way[..., :1], way[..., 1:])
        poses[..., :2] += way * np.minimum(1.0, self._step / np.maximum(far, 1e-9))
        poses[..., 2] += rng.normal(0.0, 0.3, shape)


class Wild:
    """Drives players as another driver does, and each now and then for seconds along a wide arc, wherever it leads.

    So players of each role also leave the field, come late, and meet whom they would avoid.

    Args:
        drives: the other driver.
    """

    def __init__(self, drives: Drives) -> None:
        self._drives = drives
        self._arcs: Any = np.nan

    def __call__(self, seen: Singles, rng: np.random.Generator) -> Singles:
        """The actions; of those that go astray full speed ahead and a slight turn."""
        actions = self._drives(seen, rng)
        shape = actions.shape[:2]
        arcs = np.where(rng.random(shape) < ASTRAY, rng.normal(0.0, ARC, shape), np.nan)
        self._arcs = np.where(rng.random(shape) < TURNS, arcs, self._arcs)
        astray = ~np.isnan(self._arcs)
        actions[astray, 0], actions[astray, 1] = 1.0, np.clip(self._arcs[astray], -1.0, 1.0)
        return actions


@dataclass
class Compared:
    """What was compared.

    Args:
        matches: those that were played to their end. calls: how many, by rule. differences: in words.
    """

    matches: int = 0
    calls: dict[str, int] = field(default_factory=dict)
    differences: list[str] = field(default_factory=list)


def smaller(setup: MatchSetup, players: Collection[str], **rules: object) -> MatchSetup:
    """The match with these players alone, and with other values of some rules."""
    kept = [player for player in setup.players if player.name in players]
    return structs.replace(setup, players=kept, rules={**setup.rules, **rules})


class Judged:
    """One match of a batch under the referee of a match.

    Args:
        setup: the match. players: their names, in the order of the batch.
    """

    def __init__(self, setup: MatchSetup, players: list[str]) -> None:
        self._setup, self._players = setup, players
        self.match = Match(rulebook_of(setup))
        self._time = 0.0

    def step(self, poses: npt.NDArray[np.float64]) -> list[Call]:
        """Judge a look, and return the calls."""
        self._time += PERIOD
        found = {name: Pose(*pose) for name, pose in zip(self._players, poses.tolist(), strict=True)}
        return list(self.match.step(PERIOD, Observation(found, time=self._time), []).calls)

    def begin(self, poses: npt.NDArray[np.float64]) -> str:
        """Begin a round with the players where they are; return what is wrong, or nothing."""
        for name, pose in zip(self._players, poses.tolist(), strict=True):
            mark = self.match.mark(name, Observation({}))
            if mark is None or max(abs(mark.x - pose[0]), abs(mark.y - pose[1]), abs(mark.theta - pose[2])) > 1e-9:
                return f"{name} is at {pose}, and its mark is {mark}"
        self.step(poses)
        return "" if self.match.stage is Stage.PLAY_ROUND else f"the round does not begin: {self.match.waiting}"

    def finish_round(self, poses: npt.NDArray[np.float64]) -> list[Call]:
        """Let the pause after a round pass, and return the calls that follow it."""
        found = []
        while self.match.stage is Stage.ROUND_OVER:
            found += self.step(poses)
        return found


def compare(
    setup: MatchSetup,
    matches: int,
    drives: Drives,
    *,
    ended: int,
    seed: int = 0,
    batch: Any = None,
    leaps: Leaps | None = None,
) -> Compared:
    """Play until so many matches have ended, and compare every call and score with the referee's.

    Args:
        matches: how many are played at a time. batch: what plays them; None makes one.
        leaps: where robots are put before each look.
    """
    found = Compared()
    batch = batch or Batch(setup, matches, seed=seed)
    rng = np.random.default_rng(seed)
    seen = batch.reset()
    judges = [Judged(setup, batch.players) for _ in range(matches)]
    poses = batch.records.motions.poses
    for judge, own in zip(judges, poses, strict=True):
        found.differences += filter(None, [judge.begin(own)])
    while found.matches < ended and not found.differences:
        if leaps is not None:
            leaps(poses, rng)
        before = poses.copy()
        out = batch.step(drives(seen, rng))
        seen = out.observations
        for b, judge in enumerate(judges):
            expected = judge.step(before[b])
            if judge.match.stage is Stage.ROUND_OVER:
                expected += judge.finish_round(before[b])
            differences = list(_differences(judge, expected, batch, b))
            if not differences and judge.match.over:
                found.matches += 1
                judges[b] = Judged(setup, batch.players)
            if not differences and judges[b].match.stage is Stage.INITIALIZE:
                differences = [wrong] if (wrong := judges[b].begin(poses[b])) else []
            found.differences += [f"match {b}: {words}" for words in differences]
            for call in expected:
                found.calls[call.rule] = found.calls.get(call.rule, 0) + 1
    return found


def _differences(judge: Judged, expected: list[Call], batch: Any, b: int) -> Iterator[str]:
    made, wanted = _made(batch, b), [_wanted(call) for call in expected if call.rule in batch.rules]
    if made != wanted:
        yield f"at {judge.match.clock:.1f} s expected {wanted}, got {made}"
    winner = batch.out.winners[b]
    names = [judge.match.winner] if judge.match.over else []
    if (winner >= 0) != bool(names) or (winner >= 0 and batch.teams[winner] != names[0]):
        yield f"expected the winner {names}, got {winner}"
    if judge.match.over:
        return
    standing, game = batch.records.standing, judge.match.game
    expected: dict[str, Any] = {"points": [game.points[team] for team in batch.teams[:2]], "number": game.round}
    if hasattr(standing, "carriers"):
        names = [flag.carrier for flag in game.objects]
        expected["carriers"] = [batch.players.index(name) if name else NO_ONE for name in names]
    for what, right in expected.items():
        if (got := getattr(standing, what)[b].tolist()) != right:
            yield f"at {judge.match.clock:.1f} s expected the {what} {right}, got {got}"


def _made(batch: Any, b: int) -> list[Made]:
    calls, found = batch.records.calls[b], []
    for k in range(calls.total):
        first, others = calls.players[k], np.flatnonzero(calls.others[k])
        names = [batch.players[first]] if first >= 0 else []
        found.append((batch.rules[calls.rules[k]], (*names, *sorted(batch.players[n] for n in others))))
    return found


def _wanted(call: Call) -> Made:
    first = call.players[:0] if call.rule == "pass_over" else call.players[:1]
    return call.rule, (*first, *sorted(call.players[len(first) :]))
