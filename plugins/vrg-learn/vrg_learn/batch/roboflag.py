"""RoboFlag for many matches at once: the rules, the observation and the driving home, as functions of one match.

The rules are those of vrg.games.roboflag.rules, and instants are found by the very functions of that referee. Nobody is
pushed, placed by an official or disqualified in these matches, and there are no auctions, which change no rule. A
tagged player is driven straight home, and not around others as by the coordinator of a match.
"""

import math
from typing import Final

import numpy as np

from vrg.coordinator.referee_driver import CRAWL
from vrg.coordinator.rulebook import DRAW
from vrg.games.roboflag import BLUES, RED, TEAMS
from vrg.games.roboflag.judging import first_exposed, inside, invasion, near
from vrg.games.roboflag.rules import ROUNDS, SUDDEN_DEATH, RoboFlag
from vrg.navigation.control import linearise
from vrg.navigation.pilot import OFFSET
from vrg.portable.scalars import cos_sin, hypot
from vrg.segments import NEVER, Stretch
from vrg.types import Vector
from vrg_learn.batch.assigning import line_up
from vrg_learn.batch.game import BatchedGame, Functions, call, calls, worths
from vrg_learn.batch.motion import command, put
from vrg_learn.batch.observing import length, write_others, write_own, write_place
from vrg_learn.batch.records import Floats, Record, Records, Singles, records
from vrg_learn.batch.roboflag_players import FLAGGED, NO_ONE, NORMAL, STRATEGIES, TAGGED, decide, forget, plan
from vrg_learn.games.roboflag import CAPTURES, LEARNING

DRAWN = 2
"""The winner of a draw."""
CALL_HOME, CAPTURE, FLAG, TAG, TIME, SUDDEN = range(6)
"""The rules of calls, in the order of RULES."""
RULES: Final = ("home", "capture", "flag", "tag", "time", "sudden_death")
NUMBERS, PLACES, FLAGS = len(LEARNING.numbers), len(LEARNING.places), len(LEARNING.flags)
DEPTH = 0.6
"""How deep a tagged player is driven into its home zone, as a share of its radius."""


def batched(book: RoboFlag, matches: int, *, shaping: bool) -> BatchedGame:
    """The game of a match file, for this many matches."""
    layout, settings, players = book.layout, book.settings, list(book.contestants.values())
    count = len(players)
    setting = records(
        1,
        bounds=(float, 4),
        flag_places=(float, 2, 2),
        homes=(float, 2, 2),
        starts=(float, count, 3),
        worth=(float, len(RULES), 4),
        ahead=(float, 2),
        order=(int, count),
        sides=(int, count),
        midline=(float,),
        tag_distance=(float,),
        flag_reach=(float,),
        home_reach=(float,),
        zone=(float,),
        round_time=(float,),
        sudden_death=(float,),
        epoch=(float,),
        captures=(int,),
    )[0]
    setting.bounds[:] = layout.field.bounds
    setting.flag_places[:] = [layout.flag(team) for team in TEAMS]
    setting.homes[:] = [(home.x, home.y) for home in map(layout.home, TEAMS)]
    setting.starts[:] = [(p.start.x, p.start.y, p.start.theta) for p in players]
    setting.worth[:] = worths(RULES, LEARNING, shaping=shaping)
    setting.ahead[:] = [layout.ahead(team) for team in TEAMS]
    setting.order[:] = np.argsort([player.name for player in players])
    setting.sides[:] = [TEAMS.index(player.role) for player in players]
    setting.midline, setting.tag_distance = layout.midline, layout.tag_distance
    setting.flag_reach, setting.home_reach = layout.flag_reach, layout.home_reach
    setting.zone = layout.flag_zones()[0].radius
    setting.round_time, setting.sudden_death = settings.round_time, settings.sudden_death
    setting.epoch, setting.captures = settings.epoch, settings.captures
    return BatchedGame(
        setting=setting,
        standing=standing(matches, count),
        calls=calls(matches, count, 2 * count + 4),
        rules=RULES,
        teams=(RED, BLUES, DRAW),
        length=length(NUMBERS, PLACES, count, FLAGS),
        functions=Functions(judge, next_round, reset, drive, able, observe, forget, plan, decide),
        strategies=STRATEGIES,
    )


def standing(matches: int, players: int) -> Records:
    """The standing of this many matches, before their reset.

    Fields: `states` and `before` (the pose at the look before) of each player; `carriers` and `points` of each team,
    where the carrier is that of its flag; `number`: that of the round, from 1; `clock`: the time of play in it, s;
    `winner`: the team that has won, DRAWN or -1; `after`: the states after the tags of a look, in which a judgement
    works.
    """
    return records(
        matches,
        before=(float, players, 3),
        states=(int, players),
        after=(int, players),
        carriers=(int, 2),
        points=(int, 2),
        number=(int,),
        winner=(int,),
        clock=(float,),
    )


def reset(s: Record, t: Record, m: Record, r: Record, chance: Record) -> None:
    """Begin a match again, with all players on their marks and at rest."""
    t.points[:] = 0
    t.number, t.winner = 1, -1
    for n in range(len(s.sides)):
        put(m, n, s.starts[n, 0], s.starts[n, 1], s.starts[n, 2])
    begin_round(t, m)


def begin_round(t: Record, m: Record) -> None:
    """Begin a round with the players where they are."""
    t.states[:] = NORMAL
    t.carriers[:] = NO_ONE
    t.clock = 0.0
    t.before[:] = m.poses


def judge(s: Record, t: Record, m: Record, r: Record, c: Record, dt: float) -> bool:
    """Judge one match at a look, `dt` seconds of play after the one before, and return whether the round is over."""
    t.clock += dt
    c.total = 0
    captured = judge_homes(s, t, m, c)
    judge_flags(s, t, m, c)
    judge_tags(s, t, m, c)
    t.before[:] = m.poses
    sudden = t.number == SUDDEN_DEATH
    decided = captured if sudden else max(t.points[0], t.points[1]) >= s.captures
    if not decided and t.clock < (s.sudden_death if sudden else s.round_time) - 1e-9:
        return False
    if not decided:
        call(c, TIME, -1)
    return True


def judge_homes(s: Record, t: Record, m: Record, c: Record) -> bool:
    """Judge who came home, and return whether anybody scored there."""
    captured = False
    for n in s.order:
        team = s.sides[n]
        if t.states[n] == NORMAL:
            continue
        start, end = way(t, m, n)
        if inside(start, end, (s.homes[team, 0], s.homes[team, 1]), s.home_reach) == NEVER:
            continue
        if t.states[n] == TAGGED:
            call(c, CALL_HOME, n)
        else:
            t.carriers[1 - team] = NO_ONE
            t.points[team] += 1
            call(c, CAPTURE, n)
            captured = True
        t.states[n] = NORMAL
    return captured


def judge_flags(s: Record, t: Record, m: Record, c: Record) -> None:
    """Judge who takes a flag: the first one there, and of those that come at the same instant the nearest."""
    for team in range(2):
        if t.carriers[team] != NO_ONE:
            continue
        place = (s.flag_places[team, 0], s.flag_places[team, 1])
        taker, first, nearest = NO_ONE, math.inf, math.inf
        for n in s.order:
            if s.sides[n] == team or t.states[n] != NORMAL:
                continue
            start, end = way(t, m, n)
            at, last = inside(start, end, place, s.flag_reach)
            if at > last:
                continue
            x, y = start[0] + (end[0] - start[0]) * at, start[1] + (end[1] - start[1]) * at
            far = hypot(x - place[0], y - place[1])
            if at < first or (at == first and far < nearest):
                taker, first, nearest = n, at, far
        if taker != NO_ONE:
            t.states[taker] = FLAGGED
            t.carriers[team] = taker
            call(c, FLAG, taker)


def judge_tags(s: Record, t: Record, m: Record, c: Record) -> None:
    """Judge all tags by the states before any of them, so that two players can tag each other."""
    t.after[:] = t.states
    for n in s.order:
        if t.states[n] == TAGGED:
            continue
        team, (start, end) = s.sides[n], way(t, m, n)
        exposed: Stretch = (0.0, 1.0)
        if t.states[n] == NORMAL:
            exposed = invasion(start[0], end[0], s.midline, s.ahead[team])
        if exposed == NEVER:
            continue
        one = inside(start, end, (s.flag_places[0, 0], s.flag_places[0, 1]), s.zone)
        two = inside(start, end, (s.flag_places[1, 0], s.flag_places[1, 1]), s.zone)
        k = -1
        for by in range(len(s.sides)):
            if s.sides[by] == team or t.states[by] == TAGGED:
                continue
            b0, b1 = way(t, m, by)
            if first_exposed(near(start, end, b0, b1, s.tag_distance), exposed, one, two) < math.inf:
                if k < 0:
                    k = call(c, TAG, n)
                c.others[k, by] = True
        if k >= 0:
            t.after[n] = TAGGED
            if t.states[n] == FLAGGED:
                t.carriers[1 - team] = NO_ONE
    t.states[:] = t.after


def way(t: Record, m: Record, n: int) -> tuple[Vector, Vector]:
    """Where a player was and is, m."""
    return (t.before[n, 0], t.before[n, 1]), (m.poses[n, 0], m.poses[n, 1])


def next_round(s: Record, t: Record, m: Record, c: Record) -> None:
    """End a game, or begin its next round: scores carry over, positions and flags do not."""
    last = max(t.points[0], t.points[1]) >= s.captures or t.number >= ROUNDS
    if last and t.points[0] != t.points[1]:
        t.winner = 0 if t.points[0] > t.points[1] else 1
        return
    if t.number >= SUDDEN_DEATH:
        t.winner = DRAWN
        return
    for team in range(2):
        rows = np.flatnonzero(s.sides == team)
        line_up(m, rows, s.starts[rows])
    t.number = SUDDEN_DEATH if last else t.number + 1
    if last:
        call(c, SUDDEN, -1)
    begin_round(t, m)


def able(t: Record, n: int) -> bool:
    """True unless a player is driven home."""
    return bool(t.states[n] != TAGGED)


def drive(s: Record, t: Record, m: Record, r: Record, n: int, v: float, w: float) -> None:
    """Let a player drive; one that is tagged is driven home."""
    if not able(t, n):
        team = s.sides[n]
        x, y, theta = m.poses[n, 0], m.poses[n, 1], m.poses[n, 2]
        to_x, to_y = s.homes[team, 0] - x, s.homes[team, 1] - y
        far = math.sqrt(to_x * to_x + to_y * to_y)
        left = max(0.0, far - DEPTH * s.home_reach)
        speed = min(r.v_max[n], max(CRAWL, left)) / max(far, 1e-9)
        led = linearise((to_x * speed, to_y * speed), theta, OFFSET)
        v, w = led.v, led.w
    command(m, r, n, v, w, r.v_max[n])


def observe(s: Record, t: Record, model: Record, seen: Floats, velocities: Floats, own: Floats, out: Singles) -> None:
    """Write what each player of a match sees.

    Args:
        seen: shape (players, 3): the poses that the referee has published. velocities: shape (players, 2), m/s.
        own: shape (players, 5): the pose and the twist that each measures of itself. out: shape (players, length).
    """
    count = len(s.sides)
    dx, dy = s.bounds[2] - s.bounds[0], s.bounds[3] - s.bounds[1]
    scale = 1.0 / math.sqrt(dx * dx + dy * dy)
    limit = s.sudden_death if t.number == SUDDEN_DEATH else s.round_time
    flags, turns, gaps = np.empty((count, FLAGS)), np.empty((count, 2)), np.empty(count)
    for n in range(count):
        turns[n, 0], turns[n, 1] = cos_sin(seen[n, 2])
        for state in range(3):
            flags[n, 1 + state] = t.states[n] == state
    for me in range(count):
        row, team = out[me], s.sides[me]
        x, y, theta, v, w = own[me, 0], own[me, 1], own[me, 2], own[me, 3], own[me, 4]
        cos, sin = cos_sin(theta)
        at = write_own(row, x, y, cos, sin, v / model.v_max[me], w / model.w_max[me], s.bounds, scale)
        for state in range(3):
            row[at + state] = t.states[me] == state
        row[at + 3], row[at + 4] = t.carriers[team] != NO_ONE, t.carriers[1 - team] != NO_ONE
        row[at + 5] = max(0.0, 1.0 - t.clock / limit)
        row[at + 6] = min(1.0, max(-1.0, (t.points[team] - t.points[1 - team]) / CAPTURES))
        row[at + 7] = (x - s.midline) * s.ahead[team] <= 0.0
        row[at + 8] = in_zone(s, 0, x, y) or in_zone(s, 1, x, y)
        at += NUMBERS
        at = write_place(row, at, s.flag_places[1 - team, 0] - x, s.flag_places[1 - team, 1] - y, cos, sin, scale)
        at = write_place(row, at, s.flag_places[team, 0] - x, s.flag_places[team, 1] - y, cos, sin, scale)
        at = write_place(row, at, s.homes[team, 0] - x, s.homes[team, 1] - y, cos, sin, scale)
        at = write_place(row, at, s.midline - x, 0.0, cos, sin, scale)
        for n in range(count):
            flags[n, 0] = s.sides[n] == team
        write_others(row, at, me, (x, y, v, cos, sin), seen, turns, velocities, flags, model.v_max[me], scale, gaps)


def in_zone(s: Record, team: int, x: float, y: float) -> bool:
    """True if a place is in the flag zone of a team."""
    return bool(hypot(x - s.flag_places[team, 0], y - s.flag_places[team, 1]) <= s.zone)
