"""Any game in a batch: each match is judged by the very objects that referee a match, and only motion is compiled.

Each match has a `Match` with a rule book of its own, by the seed of its own, and the referee's driver. A player sees
what `vrg_learn.observation` lays out. The time is that of a match in one process, so that the two agree to the last
bit: what follows from the order of messages, such as that a robot's device knows the referee's state one decision late,
is repeated here.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from msgspec import structs

from vrg.agents.strategy import Strategy, View, decided
from vrg.bus.messages import Body, Call, RefereeState, Stage, at_rest
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.coordinator.match import Match
from vrg.coordinator.pushing import moved
from vrg.coordinator.referee_driver import RefereeDriver
from vrg.coordinator.rulebook import DRAW, NOBODY, Observation
from vrg.errors import ConfigError
from vrg.games import GAMES, strategies_of
from vrg.hal.readings import Readings
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.launch.strategy_class import strategy_of
from vrg.navigation.motion import VelocityEstimator
from vrg.types import Pose, Twist
from vrg_learn.batch.chance import whole
from vrg_learn.batch.game import BatchedGame
from vrg_learn.batch.motion import Walls, advance, command, lock, put
from vrg_learn.batch.records import Record, Records, Singles, records
from vrg_learn.batch.stepping import PERIOD, TICKS, Matches, Outputs, Variation, draw, measure, move
from vrg_learn.compiled import compiled
from vrg_learn.learning import Learning
from vrg_learn.observation import names, observe
from vrg_learn.rewards import for_calls, for_winning

TICK: Final = PERIOD / TICKS
"""The step of physics, s."""
LONGEST_PAUSE: Final = 1200
"""The looks that a match may take between two rounds, or before the first."""


def standing(matches: int, players: int) -> Records:
    """What the referees of this many matches want of the robots.

    Fields: `seed`: that of the match; `playing`: whether its robots drive until the next decision; and of each player
    `held`: whether its robot is stopped; `led`: whether the referee drives it; `lease`: the v and w with which; `limits`:
    its top speed, m/s; `was_held`, `was_led` and `was_lease`: the same one decision before; `stood`: for how many
    decisions its wheels have been commanded to stand.
    """
    return records(
        matches,
        lease=(float, players, 2),
        was_lease=(float, players, 2),
        limits=(float, players),
        stood=(int, players),
        seed=(int,),
        playing=(bool,),
        held=(bool, players),
        led=(bool, players),
        was_held=(bool, players),
        was_led=(bool, players),
    )


def drive(s: Record, t: Record, m: Record, r: Record, n: int, v: float, w: float) -> None:
    """Let a robot do what the referee permits: its device by the state before, and the world by that of now."""
    if t.was_held[n]:
        v, w = 0.0, 0.0
    elif t.was_led[n]:
        v, w = t.was_lease[n, 0], t.was_lease[n, 1]
    stands = v == 0.0 and w == 0.0
    if t.held[n]:
        lock(m, n)
        stands = True
    elif t.led[n] and not stands:
        stands = t.lease[n, 0] == 0.0 and t.lease[n, 1] == 0.0
        command(m, r, n, t.lease[n, 0], t.lease[n, 1], t.limits[n])
    else:
        command(m, r, n, v, w, t.limits[n])
    t.stood[n] = t.stood[n] + 1 if stands else 0


def prepare(t: Record, m: Record, r: Record, model: Record, k: Record, chance: Record, vary: Variation) -> None:
    """Draw the robots, the link and the seed of a match that begins again."""
    draw(m, r, model, k, chance, vary)
    t.seed = whole(chance)


def coast(m: Record, r: Record, walls: Walls) -> None:
    """Hold all robots of a match until the next look."""
    for n in range(len(m.poses)):
        lock(m, n)
    for _ in range(TICKS):
        advance(m, r, walls, TICK)


def move_all(low: int, high: int, a: Matches, walls: Walls, vary: Variation, actions: Singles) -> None:
    """Let the robots of these matches drive until the next decision, where they play, and measure."""
    for b in range(low, high):
        s, t, m, r, k = a.setting, a.standing[b], a.motions[b], a.robots[b], a.minds[b]
        if t.playing:
            move(s, t, m, r, a.model[b], k, a.plans[b], a.chance[b], walls, actions[b])
        measure(m, k, a.chance[b], vary)


class Refereed:
    """The matches of a batch under referees.

    Args:
        setup: the match. learning: of its game. matches: how many.
        shaping: whether calls that only lead to what counts are rewarded, too.

    Attributes:
        game: for `Batch`. calls: those of each match at the last step.

    Raises:
        ConfigError: its players need a scan, or tell the referee something, which no batch has.
    """

    def __init__(self, setup: MatchSetup, learning: Learning, matches: int, *, shaping: bool) -> None:
        if learning.scan or learning.talks:
            raise ConfigError(
                f"{setup.origin}: expected a game whose players need no scan and tell the referee nothing, got "
                f"{setup.game}: use an environment (vrg_learn.environment) in place of a batch"
            )
        players = len(setup.players)
        teams = tuple(dict.fromkeys(role.team for role in GAMES.get(setup.game).roles))
        setting = records(1, sides=(int, players))[0]
        setting.sides[:] = [teams.index(player.team) for player in setup.players]
        self.game = BatchedGame(
            setting=setting,
            standing=standing(matches, players),
            calls=records(matches, total=(int,)),
            rules=(),
            teams=(*teams, DRAW, NOBODY),
            length=len(names(learning, players)),
        )
        self.calls: list[list[Call]] = [[] for _ in range(matches)]
        self._referees = [_Referee(setup) for _ in range(matches)]
        self._setup, self._learning = setup, learning
        self._rewards = {**learning.rewards, **(learning.shaping if shaping else {})}
        self._teams = {player.name: player.team for player in setup.players}
        self._move = compiled(move_all, drive=drive)
        self._prepare = compiled(prepare)

    def begin_all(self, low: int, high: int, a: Matches, walls: Walls, vary: Variation, o: Outputs) -> None:
        """Begin the matches of these numbers again."""
        for b in range(low, high):
            self._begin(b, a, walls, vary)
        self._show(low, high, a, walls, vary, np.zeros((len(self._referees), len(self._teams), 2), np.float32), o)

    def step_all(
        self, low: int, high: int, a: Matches, walls: Walls, vary: Variation, actions: Singles, most: int, o: Outputs
    ) -> None:
        """One decision of the matches of these numbers; see `vrg_learn.batch.stepping.step_all`."""
        for b in range(low, high):
            referee, t, m, k = self._referees[b], a.standing[b], a.motions[b], a.minds[b]
            calls = self.calls[b] = referee.look(t, m, a.robots[b], walls)
            k.steps += 1
            winner = referee.match.winner
            earned = for_calls(calls, self._rewards, self._teams)
            won = for_winning(winner, self._teams)
            o.rewards[b] = [earned[name] + won[name] for name in self._teams]
            o.winners[b] = -1 if winner is None else self.game.teams.index(winner)
            o.terminated[b] = referee.match.over
            o.truncated[b] = cut = not referee.match.over and 0 < most <= k.steps
            if referee.match.over or cut:
                measure(m, k, a.chance[b], vary)
                o.last[b] = [observe(view, self._learning) for view in referee.views(k.own.tolist())]
                self._begin(b, a, walls, vary)
        self._show(low, high, a, walls, vary, actions, o)

    def _begin(self, b: int, a: Matches, walls: Walls, vary: Variation) -> None:
        t, m, r = a.standing[b], a.motions[b], a.robots[b]
        self._prepare(t, m, r, a.model[b], a.minds[b], a.chance[b], vary)
        self._referees[b].begin(t, m, r, walls)

    def _show(
        self, low: int, high: int, a: Matches, walls: Walls, vary: Variation, actions: Singles, o: Outputs
    ) -> None:
        """Let players drive, and write what each sees then."""
        self._move(low, high, a, walls, vary, actions)
        o.able[low:high] = (a.standing.held[low:high] + a.standing.led[low:high]) == 0
        own = a.minds.own[low:high].tolist()
        for b in range(low, high):
            views = self._referees[b].views(own[b - low])
            o.observations[b] = [observe(view, self._learning) for view in views]


class _Referee:
    """One match, and what its players see of it. Nothing is known of it before `begin`.

    Args:
        setup: the match, whatever its seed.
    """

    match: Match
    calls: list[Call]

    def __init__(self, setup: MatchSetup) -> None:
        self._setup = setup
        self._robots = {player.name: player.robot for player in setup.players}

    def begin(self, t: Record, m: Record, r: Record, walls: Walls) -> None:
        """Begin a match by the seed in its standing, and go on to the first decision of play."""
        self._own = structs.replace(self._setup, seed=int(t.seed))
        book = rulebook_of(self._own)
        self._limits = book.speed_limits()
        self.match, self._strategies = Match(book), dict[int, tuple[str, Strategy]]()
        self._driver = RefereeDriver({name: robot.v_max for name, robot in self._robots.items()}, self._own.obstacles)
        self._ticks, self._field = 0, Observation({})
        for n, player in enumerate(self._own.players):
            put(m, n, *structs.astuple(player.pose))
        self._go_on([], t, m, r, walls)

    def look(self, t: Record, m: Record, r: Record, walls: Walls) -> list[Call]:
        """Judge where the robots are, go on to the next decision of play, and return the calls meanwhile."""
        calls = self._judge(t, m)
        if self.match.stage is Stage.PLAY_ROUND:
            self._publish(t, r)
            t.playing = True
        elif not self.match.over:
            self._go_on(calls, t, m, r, walls)
        return calls

    def _go_on(self, calls: list[Call], t: Record, m: Record, r: Record, walls: Walls) -> None:
        """Let the pause between two rounds pass, in which robots stand until they are put on their marks."""
        for _ in range(LONGEST_PAUSE):
            if self.match.stage is Stage.ROUND_OVER:
                compiled(coast)(m, r, walls)
            calls += self._judge(t, m)
            if self.match.over or self.match.stage is Stage.PLAY_ROUND:
                break
        else:
            raise ConfigError(
                f"{self._setup.origin}: no round begins within {LONGEST_PAUSE * PERIOD:g} s: "
                f"{'; '.join(self.match.waiting)}"
            )
        # What was known before are other places, from which nobody has driven to these.
        self._motion = VelocityEstimator()
        t.stood[:], t.playing = TICKS, False
        self._publish(t, r)

    def _judge(self, t: Record, m: Record) -> list[Call]:
        """Look at the robots, as the coordinator does, judge them, and put those somewhere that the rules want there."""
        before = self._field
        self._ticks += TICKS
        now = self._ticks * TICK
        self._bodies = {
            name: Body(name, Pose(*pose), Twist(*velocity), False, stands=0.0 if stood > 1 else None)
            for name, pose, velocity, stood in zip(
                self._robots, m.poses.tolist(), m.velocities.tolist(), t.stood.tolist(), strict=True
            )
        }
        field = Observation({name: body.pose for name, body in self._bodies.items()})
        pushed = frozenset[str]()
        if self.match.stage is Stage.PLAY_ROUND:
            fields = before, field
            names = moved(self._bodies, before)
            pushed = frozenset(n for n in names if any(self.match.touched(n, at) for at in fields))
        moving = frozenset(name for name, body in self._bodies.items() if not at_rest(body.twist))
        self._field = Observation(field.poses, moving, time=now, pushed=pushed)
        effects = self.match.step(now - before.time, self._field, ())
        for n, name in enumerate(self._robots):
            if (pose := effects.place.get(name)) is not None:
                put(m, n, pose.x, pose.y, pose.theta)
        return list(effects.calls)

    def _publish(self, t: Record, r: Record) -> None:
        """Tell robots and players what is now."""
        now = self._field.time
        state = self._driver.with_twists(
            self.match.state(self._field, estop=False), self.match.driven, self._bodies, now
        )
        self._state, self._players = state, {player.name: player for player in state.players}
        self._motion.update(now, {p.name: (p.pose.x, p.pose.y) for p in state.players if p.pose is not None})
        t.was_held[:], t.was_led[:], t.was_lease[:] = t.held, t.led, t.lease
        for n, (name, robot) in enumerate(self._robots.items()):
            player = self._players[name]
            t.held[n], t.led[n] = not player.may_move, player.lease is not None
            if player.lease is not None:
                t.lease[n] = player.lease.v, player.lease.w
            t.limits[n] = self._limits.get(name, robot.v_max) * (r.v_max[n] / robot.v_max)

    def views(self, own: Sequence[Sequence[float]]) -> list[View]:
        """What the players see at the next decision.

        Args:
            own: what each measures of itself: x, y, heading, v and w.
        """
        time, found = (self._ticks + TICKS) * TICK, []
        for (name, robot), (x, y, theta, v, w) in zip(self._robots.items(), own, strict=True):
            pose = Pose(x, y, theta)
            samples = Sample(time, 0.0, Ins(pose=pose)), Sample(time, 0.0, Odometry(pose=pose, twist=Twist(v, w)))
            found.append(View(
                time=time,
                me=self._players[name],
                readings=Readings(time, 0.0, True, False, samples=samples),
                referee=self._state,
                velocities=self._motion.velocities,
                robot=robot,
                pose=pose,
                obstacles=self._own.obstacles,
            ))  # fmt: skip
        return found
