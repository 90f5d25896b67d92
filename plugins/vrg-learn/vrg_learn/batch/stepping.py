"""One decision of many matches: judge, publish, drive, observe, in the order in which the nodes of a match do.

At each decision the referee judges where the robots are. A player knows its own pose of now, and of the others what the
referee published one decision before. What it decides holds until the next decision, which is PERIOD later.
"""

from typing import NamedTuple

import numpy as np

from vrg.hal.sim.engines.pushing import Walls
from vrg.navigation.motion import SMOOTHING
from vrg.types import quantised
from vrg_learn.batch.chance import between, normal, uniform
from vrg_learn.batch.game import reward
from vrg_learn.batch.motion import advance
from vrg_learn.batch.observing import observe
from vrg_learn.batch.records import Flags, Numbers, Record, Records, Singles, records
from vrg_learn.compiled import hole

PERIOD, TICKS = 0.1, 5
"""The time between two decisions, s, and the steps of physics in it."""
COMMANDS = 8
"""The number of last commands of a player that are kept is a multiple of this, as each is machine code of its own."""


class Variation(NamedTuple):
    """How matches differ from the robots and the link of the match file, so that a policy does not depend on them.

    Each match draws its own when it begins: evenly between 1 - x and 1 + x times what the match file has, or between 0
    and the most.

    Args:
        speed, acceleration, turning: x for the top speed, for how fast it is reached, and for how far a robot turns.
        position_noise, heading_noise: the standard deviation of the own measured pose, m and rad.
        delay: the most decisions by which a command is late. loss: the largest share of commands that are lost.
    """

    speed: float = 0.0
    acceleration: float = 0.0
    turning: float = 0.0
    position_noise: float = 0.0
    heading_noise: float = 0.0
    delay: int = 0
    loss: float = 0.0


class Outputs(NamedTuple):
    """What a step returns; the first index is the match.

    Args:
        observations, last: shape (matches, players, length): of now, and where a match has ended, its last one.
        able: shape (matches, players): whether a player may drive at its next action: it is not out of play, and the
            referee does not drive it.
        rewards: shape (matches, players). terminated, truncated, winners: shape (matches,).
    """

    observations: Singles
    last: Singles
    able: Flags
    rewards: Singles
    terminated: Flags
    truncated: Flags
    winners: Numbers


class Matches(NamedTuple):
    """The records of all matches.

    Args:
        setting: what is the same in all: an array of one record, as numba takes long to be handed a record alone.
        standing, calls: those of the game.
        motions, robots: see vrg_learn.batch.motion. model: the robots of the match file.
        minds: what players know and have decided. plans: those of teams that play by a strategy.
        chance: the streams of random numbers.
    """

    setting: Records
    standing: Records
    calls: Records
    motions: Records
    robots: Records
    model: Records
    minds: Records
    plans: Records
    chance: Records
    sights: Records


def minds(matches: int, players: int, delay: int) -> Records:
    """What the players of this many matches know and have decided.

    Fields: `poses`: as published; `velocities`: their estimates, m/s; `own`: each player's own measured pose and twist;
    `order`: the others, as they were last seen from the nearest on; `steps`: the decisions in this match so far;
    `late`: by how many decisions commands are late; `loss`: their lost share; `wanted`, shape (players, decisions, 2):
    the last commands, in m/s and rad/s, at least as many as needed.
    """
    found = records(
        matches,
        poses=(float, players, 3),
        velocities=(float, players, 2),
        own=(float, players, 5),
        order=(int, players, players - 1),
        wanted=(float, players, (delay // COMMANDS + 1) * COMMANDS, 2),
        loss=(float,),
        steps=(int,),
        late=(int,),
    )
    found.order[:] = [[n for n in range(players) if n != me] for me in range(players)]
    return found


def plans(matches: int, players: int, teams: int = 2) -> Records:
    """What the teams of this many matches that play by a strategy remember: all play by actions at first.

    Fields: `strategy` of each team: its number, or -1; `driving`: whether it drives by that, or by actions; `opened`
    and `winner`: when each has chosen the player that goes first, s, and whom; and of each player `advice`: the v and w
    that its strategy wants, as shares of its model's; its `bid`, its `job` since the time `since`, s, whom it is about
    (`target`), the `place` that it drives to, m, since when it is `waiting`, s, whether it is `charging` or `staying`;
    and who is `ignored` by the one that decides now.
    """
    found = records(
        matches,
        strategy=(int, teams),
        driving=(bool, teams),
        advice=(np.float32, players, 2),
        opened=(float, teams),
        winner=(int, teams),
        bid=(float, players),
        job=(int, players),
        target=(int, players),
        since=(float, players),
        waiting=(float, players),
        place=(float, players, 2),
        charging=(bool, players),
        staying=(bool, players),
        ignored=(bool, players),
    )
    found.strategy[:] = -1
    return found


judge = next_round = reset = drive = able = forget = plan = decide = hole
"""The functions of a game, which are given the records of one match; `compiled` fills them in."""


def draw(m: Record, r: Record, model: Record, k: Record, chance: Record, vary: Variation) -> None:
    """Draw the robots and the link of a match that begins again."""
    for n in range(len(m.poses)):
        r.v_max[n] = model.v_max[n] * between(chance, 1.0 - vary.speed, 1.0 + vary.speed)
        r.slew[n] = model.slew[n] * between(chance, 1.0 - vary.acceleration, 1.0 + vary.acceleration)
        turning = between(chance, 1.0 - vary.turning, 1.0 + vary.turning)
        for axis in range(r.motions.shape[1]):
            r.motions[n, axis, 1] = model.motions[n, axis, 1] * turning
            r.rates[n, axis, 1] = model.rates[n, axis, 1] / turning
    k.late = int(between(chance, 0.0, vary.delay + 1.0))
    k.loss = between(chance, 0.0, vary.loss)
    k.wanted[:] = 0.0
    k.steps = 0


def begin(
    s: Record, t: Record, m: Record, r: Record, model: Record, k: Record, chance: Record, vary: Variation
) -> None:
    """Begin a match again, with robots and a link of its own."""
    draw(m, r, model, k, chance, vary)
    reset(s, t, m, r, chance)
    k.poses[:] = m.poses
    k.velocities[:] = 0.0


def measure(m: Record, k: Record, chance: Record, vary: Variation) -> None:
    """Let each player of a match measure its own pose and twist."""
    for n in range(len(m.poses)):
        for axis in range(3):
            k.own[n, axis] = m.poses[n, axis]
        if vary.position_noise > 0.0 or vary.heading_noise > 0.0:
            k.own[n, 0] += vary.position_noise * normal(chance)
            k.own[n, 1] += vary.position_noise * normal(chance)
            k.own[n, 2] += vary.heading_noise * normal(chance)
        k.own[n, 3], k.own[n, 4] = m.rolled[n, 0], m.rolled[n, 1]


def publish(m: Record, k: Record, jumped: bool) -> None:
    """Publish the poses of a match, and estimate the velocities as players do."""
    for n in range(len(m.poses)):
        for axis in range(2):
            speed = (m.poses[n, axis] - k.poses[n, axis]) / PERIOD
            k.velocities[n, axis] = (
                0.0 if jumped else k.velocities[n, axis] + SMOOTHING * (speed - k.velocities[n, axis])
            )
        for axis in range(3):
            k.poses[n, axis] = m.poses[n, axis]


def keep(k: Record, chance: Record, n: int, v: float, w: float) -> None:
    """Keep what a player wants, unless this command is lost."""
    for late in range(k.late, 0, -1):
        k.wanted[n, late, 0], k.wanted[n, late, 1] = k.wanted[n, late - 1, 0], k.wanted[n, late - 1, 1]
    if k.loss == 0.0 or uniform(chance) >= k.loss:
        k.wanted[n, 0, 0], k.wanted[n, 0, 1] = quantised(v), quantised(w)


def advise(s: Record, t: Record, r: Record, model: Record, k: Record, p: Record) -> None:
    """Let the strategies of a match decide, by what was published last."""
    if max(p.strategy[0], p.strategy[1]) < 0:
        return
    now = k.steps * PERIOD
    plan(s, t, r, k, p, now)
    for n in range(len(s.sides)):
        if p.strategy[s.sides[n]] >= 0:
            v, w = decide(s, t, r, k, p, n, now)
            p.advice[n, 0] = min(1.0, max(-1.0, v / model.v_max[n]))
            p.advice[n, 1] = min(1.0, max(-1.0, w / model.w_max[n]))


def steer(
    s: Record, t: Record, m: Record, r: Record, model: Record, k: Record, p: Record, chance: Record, actions: Singles
) -> None:
    """Let the players of a match set what their robots aim for until the next decision.

    Args:
        actions: shape (players, 2), those of the players that do not play by a strategy.
    """
    for n in range(len(m.poses)):
        wanted = p.advice[n] if p.driving[s.sides[n]] else actions[n]
        keep(k, chance, n, wanted[0] * model.v_max[n], wanted[1] * model.w_max[n])
        drive(s, t, m, r, n, k.wanted[n, k.late, 0], k.wanted[n, k.late, 1])


def show(s: Record, t: Record, model: Record, k: Record, e: Record, o: Outputs, b: int) -> None:
    """Write what each player of match `b` sees, and whether it is able to act."""
    observe(s, t, model, k, e, o.observations[b])
    for n in range(len(k.poses)):
        o.able[b, n] = able(t, n)


def begin_all(low: int, high: int, a: Matches, walls: Walls, vary: Variation, o: Outputs) -> None:
    """Begin the matches of these numbers again."""
    for b in range(low, high):
        s, t, m, r, k, model = a.setting[0], a.standing[b], a.motions[b], a.robots[b], a.minds[b], a.model[b]
        begin(s, t, m, r, model, k, a.chance[b], vary)
        forget(a.plans[b])
        measure(m, k, a.chance[b], vary)
        show(s, t, model, k, a.sights[low], o, b)


def step_all(
    low: int, high: int, a: Matches, walls: Walls, vary: Variation, actions: Singles, most: int, o: Outputs
) -> None:
    """One decision of the matches of these numbers.

    Args:
        actions: shape (matches, players, 2): shares of the models' top speed and turn rate, -1 to 1.
        most: the decisions after which a match is truncated; 0 for no bound.
    """
    still = np.zeros(high, dtype=np.bool_)
    for b in range(low, high):
        s, t, m, r, k = a.setting[0], a.standing[b], a.motions[b], a.robots[b], a.minds[b]
        c, model, chance, p = a.calls[b], a.model[b], a.chance[b], a.plans[b]
        advise(s, t, r, model, k, p)
        o.rewards[b] = 0.0
        over = judge(s, t, m, r, c, PERIOD)
        if over:
            next_round(s, t, m, c)
            forget(p)
        reward(s, t, c, o.rewards[b])
        publish(m, k, over)
        k.steps += 1
        o.winners[b] = t.winner
        o.terminated[b] = t.winner >= 0
        o.truncated[b] = t.winner < 0 and 0 < most <= k.steps
        still[b] = over or o.terminated[b] or o.truncated[b]
        if o.terminated[b] or o.truncated[b]:
            measure(m, k, chance, vary)
            observe(s, t, model, k, a.sights[low], o.last[b])
            begin(s, t, m, r, model, k, chance, vary)
            forget(p)
        elif not over:
            steer(s, t, m, r, model, k, p, chance, actions[b])
    advance(low, high, a.motions, a.robots, still, walls, PERIOD / TICKS, TICKS)
    for b in range(low, high):
        measure(a.motions[b], a.minds[b], a.chance[b], vary)
        show(a.setting[0], a.standing[b], a.model[b], a.minds[b], a.sights[low], o, b)
