"""Any game in a batch: each match is judged by the very objects that referee a match, and only motion is compiled.

Each match has a `Match` with a rule book of its own, by the seed of its own, and the referee's driver. A player sees
what `vrg_learn.observation` lays out. The time is that of a match in one process, so that the two agree to the last
bit: what follows from the order of messages, such as that a robot's device knows the referee's state one decision late,
is repeated here.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from msgspec import structs

from vrg.agents.strategy import Strategy, View, decided
from vrg.bus.messages import Body, Call, Stage, at_rest
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
from vrg.hal.sim.engines.pushing import Walls
from vrg.launch.strategy_class import strategy_of
from vrg.navigation.motion import VelocityEstimator
from vrg.types import Pose, Twist
from vrg_learn.action import fractions_of, limits_of
from vrg_learn.batch.chance import whole
from vrg_learn.batch.game import BatchedGame
from vrg_learn.batch.motion import advance, command, lock, put
from vrg_learn.batch.records import Record, Records, Singles, records
from vrg_learn.batch.stepping import PERIOD, TICKS, Matches, Outputs, Variation, draw, measure, steer
from vrg_learn.compiled import compiled
from vrg_learn.learning import Learning
from vrg_learn.matches import put_on_marks
from vrg_learn.observation import names, observe
from vrg_learn.rewards import for_calls, for_winning

TICK: Final = PERIOD / TICKS
"""The step of physics, s."""
OWN_STRATEGY: Final = "own"
"""The name under which each player plays by the strategy that it has in the match file."""
LONGEST_PAUSE: Final = 1200
"""The looks that a match may take between two rounds, or before the first."""


def standing(matches: int, players: int) -> Records:
    """What the referees of this many matches want of the robots.

    Fields: `seed`: that of the match; `playing`: whether its robots drive until the next decision; and of each player
    `held`: whether its robot is stopped; `led`: whether the referee drives it; `lease`: the v and w with which;
    `was_held`, `was_led` and `was_lease`: the same one decision before; `limits`: its top speed, m/s; `stood`: for how
    many decisions its wheels have been commanded to stand.
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


def coast(b: int, a: Matches, walls: Walls) -> None:
    """Hold all robots of a match until the next look."""
    for n in range(len(a.motions[b].poses)):
        lock(a.motions[b], n)
    advance(b, b + 1, a.motions, a.robots, np.zeros(b + 1, dtype=np.bool_), walls, TICK, TICKS)


def move_all(low: int, high: int, a: Matches, walls: Walls, vary: Variation, actions: Singles) -> None:
    """Let the robots of these matches drive until the next decision, where they play, and measure."""
    still = np.zeros(high, dtype=np.bool_)
    for b in range(low, high):
        s, t, m, r, k = a.setting[0], a.standing[b], a.motions[b], a.robots[b], a.minds[b]
        still[b] = not t.playing
        if t.playing:
            steer(s, t, m, r, a.model[b], k, a.plans[b], a.chance[b], actions[b])
    advance(low, high, a.motions, a.robots, still, walls, TICK, TICKS)
    for b in range(low, high):
        measure(a.motions[b], a.minds[b], a.chance[b], vary)


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
        setup = put_on_marks(setup)
        game, players = GAMES.get(setup.game), len(setup.players)
        teams = tuple(dict.fromkeys(role.team for role in game.roles))
        setting = records(1, sides=(int, players))[0]
        setting.sides[:] = [teams.index(player.team) for player in setup.players]
        self.game = BatchedGame(
            setting=setting,
            standing=standing(matches, players),
            calls=records(matches, total=(int,)),
            rules=(),
            teams=(*teams, DRAW, NOBODY),
            length=len(names(learning, players)),
            strategies=(OWN_STRATEGY, *strategies_of(setup.game)),
        )
        self.calls: list[list[Call]] = [[] for _ in range(matches)]
        self._referees = [_Referee(setup) for _ in range(matches)]
        self._setup, self._learning = setup, learning
        self._rewards = {**learning.rewards, **(learning.shaping if shaping else {})}
        self._teams = {player.name: player.team for player in setup.players}
        self._prepare, self._coast = compiled(prepare), compiled(coast)
        self._move = compiled(move_all, drive=drive)

    def begin_all(self, low: int, high: int, a: Matches, walls: Walls, vary: Variation, o: Outputs) -> None:
        """Begin the matches of these numbers again."""
        for b in range(low, high):
            self._begin(b, a, walls, vary)
        self._show(low, high, a, walls, vary, a.plans.advice, o)

    def step_all(
        self, low: int, high: int, a: Matches, walls: Walls, vary: Variation, actions: Singles, most: int, o: Outputs
    ) -> None:
        """One decision of the matches of these numbers; see `vrg_learn.batch.stepping.step_all`."""
        if a.plans.strategy.max() >= 0:
            self._advise(low, high, a)
        a.minds.steps[low:high] += 1
        steps, fields = a.minds.steps.tolist(), (a.motions.poses, a.motions.velocities, a.standing.stood)
        for b, field in enumerate(zip(*(part[low:high].tolist() for part in fields), strict=True), low):
            referee = self._referees[b]
            calls = self.calls[b] = referee.look(*field)
            if referee.match.stage is Stage.PLAY_ROUND:
                self._place(referee, a.motions[b])
                referee.publish()
            else:
                calls += self._pause(b, a, walls)
            over, winner = referee.match.over, referee.match.winner
            earned, won = for_calls(calls, self._rewards, self._teams), for_winning(winner, self._teams)
            o.rewards[b] = [earned[name] + won[name] for name in self._teams]
            o.winners[b] = -1 if winner is None else self.game.teams.index(winner)
            o.terminated[b], o.truncated[b] = over, not over and 0 < most <= steps[b]
            if o.terminated[b] or o.truncated[b]:
                measure(a.motions[b], a.minds[b], a.chance[b], vary)
                views = referee.views(a.minds.own[b].tolist())
                o.last[b] = [observe(view, self._learning) for view in views]
                self._begin(b, a, walls, vary)
        self._show(low, high, a, walls, vary, actions, o)

    def _begin(self, b: int, a: Matches, walls: Walls, vary: Variation) -> None:
        """Begin a match again, and go on to its first decision of play."""
        referee, t, m, r = self._referees[b], a.standing[b], a.motions[b], a.robots[b]
        self._prepare(t, m, r, a.model[b], a.minds[b], a.chance[b], vary)
        referee.begin(int(t.seed))
        t.limits[:] = referee.limits
        t.limits[:] *= r.v_max / a.model[b].v_max
        for n, player in enumerate(self._setup.players):
            put(m, n, player.pose.x, player.pose.y, player.pose.theta)
        self._pause(b, a, walls)

    def _pause(self, b: int, a: Matches, walls: Walls) -> list[Call]:
        """Go on to the next decision of play, or to the end of the game, and return the calls meanwhile.

        Robots stand until they are put on their marks.

        Raises:
            ConfigError: no round begins.
        """
        referee, m = self._referees[b], a.motions[b]
        calls, stood = [], [TICKS] * len(m.poses)
        for _ in range(LONGEST_PAUSE):
            if referee.match.stage is Stage.ROUND_OVER:
                self._coast(b, a, walls)
            calls += referee.look(m.poses.tolist(), m.velocities.tolist(), stood)
            self._place(referee, m)
            if referee.match.over or referee.match.stage is Stage.PLAY_ROUND:
                referee.publish(anew=True)
                return calls
        waiting = "; ".join(referee.match.waiting)
        raise ConfigError(f"{self._setup.origin}: no round begins within {LONGEST_PAUSE * PERIOD:g} s: {waiting}")

    def _place(self, referee: "_Referee", m: Record) -> None:
        """Put robots where the referee wants them."""
        for n, name in enumerate(self._teams):
            if (pose := referee.placed.get(name)) is not None:
                put(m, n, pose.x, pose.y, pose.theta)

    def _advise(self, low: int, high: int, a: Matches) -> None:
        """Let the strategies of teams decide, by what their players have seen last."""
        for b in range(low, high):
            for n, (view, team) in enumerate(zip(self._referees[b].seen, a.setting.sides[0], strict=True)):
                if (number := int(a.plans.strategy[b, team])) >= 0:
                    strategy = self._referees[b].strategy(view.me.name, self.game.strategies[number])
                    twist = decided(strategy, view)[0].twist
                    a.plans.advice[b, n] = fractions_of(twist, limits_of(view.robot))

    def _show(
        self, low: int, high: int, a: Matches, walls: Walls, vary: Variation, actions: Singles, o: Outputs
    ) -> None:
        """Let the robots of these matches drive, and write what each player sees then, and whether it may act."""
        referees, t = self._referees[low:high], a.standing
        for part in ("held", "led", "lease"):
            t[f"was_{part}"][low:high] = t[part][low:high]
            t[part][low:high] = [getattr(referee, part) for referee in referees]
        t.playing[low:high] = [referee.playing for referee in referees]
        t.stood[low:high] *= t.playing[low:high, np.newaxis]
        self._move(low, high, a, walls, vary, actions)
        o.able[low:high] = (t.held[low:high] == 0) & (t.led[low:high] == 0)
        for b, own in enumerate(a.minds.own[low:high].tolist(), low):
            o.observations[b] = [observe(view, self._learning) for view in self._referees[b].views(own)]


class _Referee:
    """One match under its referee, and what its players see of it. Nothing is known of it before `begin`.

    Args:
        setup: the match, whatever its seed.

    Attributes:
        match: what the referee judges. limits: the top speed of each robot, m/s.
        placed: where the last look wants robots to be put.
        playing: whether the robots drive until the next decision; they do not where a round has just begun.
        held, led, lease: see `standing`. seen: what the players saw last.
    """

    match: Match

    def __init__(self, setup: MatchSetup) -> None:
        self._setup = setup
        self._robots = {player.name: player.robot for player in setup.players}
        self.seen: list[View] = []

    def begin(self, seed: int) -> None:
        """Begin a match with a seed."""
        self._own = structs.replace(self._setup, seed=seed)
        book, fastest = rulebook_of(self._own), {name: robot.v_max for name, robot in self._robots.items()}
        self.match, self.limits = Match(book), [*{**fastest, **book.speed_limits()}.values()]
        self._driver = RefereeDriver(fastest, self._own.obstacles)
        self._strategies: dict[str, tuple[str, Strategy]] = {}
        self._ticks, self._field = 0, Observation({})

    def look(
        self, poses: Sequence[Sequence[float]], velocities: Sequence[Sequence[float]], stood: Sequence[int]
    ) -> list[Call]:
        """Look at the robots as the coordinator does, judge them, and return the calls."""
        before, playing = self._field, self.match.stage is Stage.PLAY_ROUND
        self._ticks += TICKS
        now = self._ticks * TICK
        self._bodies = bodies = {
            name: Body(name, Pose(*pose), Twist(*velocity), False, stands=0.0 if rest > 1 else None)
            for name, pose, velocity, rest in zip(self._robots, poses, velocities, stood, strict=True)
        }
        field = Observation({name: body.pose for name, body in bodies.items()})
        at_hand = moved(bodies, before) if playing else []
        pushed = [name for name in at_hand if any(self.match.touched(name, at) for at in (before, field))]
        moving = [name for name, body in bodies.items() if not at_rest(body.twist)]
        self._field = Observation(field.poses, frozenset(moving), time=now, pushed=frozenset(pushed))
        effects = self.match.step(now - before.time, self._field, ())
        self.placed = effects.place
        return list(effects.calls)

    def publish(self, *, anew: bool = False) -> None:
        """Tell players and robots what the last look has found.

        Args:
            anew: a round has begun, or the game has ended: the places before are of another round.
        """
        now = self._field.time
        published = self.match.state(self._field, estop=False)
        self._state = state = self._driver.with_twists(published, self.match.driven, self._bodies, now)
        self._players = players = {player.name: player for player in state.players}
        if anew:
            self._motion = VelocityEstimator()
        self._motion.update(now, {p.name: (p.pose.x, p.pose.y) for p in state.players if p.pose is not None})
        leases = [players[name].lease for name in self._robots]
        self.playing = not anew
        self.held = [not players[name].may_move for name in self._robots]
        self.led = [lease is not None for lease in leases]
        self.lease = [(0.0, 0.0) if lease is None else (lease.v, lease.w) for lease in leases]

    def views(self, own: Sequence[Sequence[float]]) -> list[View]:
        """What the players see at the next decision, which is kept as `seen`, too.

        Args:
            own: what each measures of itself: x, y, heading, v and w.
        """
        time = (self._ticks + TICKS) * TICK
        self.seen = []
        for (name, robot), (x, y, theta, v, w) in zip(self._robots.items(), own, strict=True):
            pose = Pose(x, y, theta)
            samples = Sample(time, 0.0, Ins(pose=pose)), Sample(time, 0.0, Odometry(pose=pose, twist=Twist(v, w)))
            self.seen.append(View(
                time=time,
                me=self._players[name],
                readings=Readings(time, 0.0, True, False, samples=samples),
                referee=self._state,
                velocities=self._motion.velocities,
                robot=robot,
                pose=pose,
                obstacles=self._own.obstacles,
            ))  # fmt: skip
        return self.seen

    def strategy(self, name: str, target: str) -> Strategy:
        """The strategy by which a player plays in this match.

        Args:
            target: OWN_STRATEGY, or a strategy as a match file names it.

        Raises:
            ConfigError: it cannot be made.
        """
        known = self._strategies.get(name)
        if known is None or known[0] != target:
            own = self._own if target == OWN_STRATEGY else self._own.substituted(name, target)
            known = self._strategies[name] = target, strategy_of(own, name)
        return known[1]
