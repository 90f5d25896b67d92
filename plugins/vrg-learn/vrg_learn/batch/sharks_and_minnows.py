"""Sharks and Minnows for many matches at once: the rules, the observation and the rewards, as functions of one match.

What is decided at a look is decided by the functions of that referee, vrg.games.sharks_and_minnows.judging.
Nobody is pushed, placed by an official or disqualified in these matches.
"""

import math

import numpy as np

from vrg.coordinator.look import note
from vrg.games.sharks_and_minnows import MINNOWS, SHARKS
from vrg.games.sharks_and_minnows.judging import BOTH, MINNOW, NEW_SHARK, NO_ROLE, RULES, SHARK, winner
from vrg.games.sharks_and_minnows.judging import judge as judge_look
from vrg.games.sharks_and_minnows.lineup import LargestBody, rows_of
from vrg.games.sharks_and_minnows.rules import SharksAndMinnows
from vrg.portable.scalars import cos_sin
from vrg_learn.batch.assigning import line_up
from vrg_learn.batch.chance import between
from vrg_learn.batch.game import BatchedGame, Functions, calls, worths
from vrg_learn.batch.motion import command, lock, put
from vrg_learn.batch.observing import length, write_others, write_own, write_place
from vrg_learn.batch.records import Floats, Record, Records, Singles, records
from vrg_learn.batch.sharks_and_minnows_players import STRATEGIES, decide, forget, plan
from vrg_learn.games.sharks_and_minnows import LEARNING

LOW, HIGH = 0, 1
"""The ends of the field."""
NUMBERS, PLACES, FLAGS = len(LEARNING.numbers), len(LEARNING.places), len(LEARNING.flags)
"""The counts of what the game adds to an observation."""


def batched(book: SharksAndMinnows, matches: int, *, shaping: bool) -> BatchedGame:
    """The game of a match file, for this many matches."""
    settings, players = book.settings, list(book.contestants.values())
    count, extent = len(players), LargestBody.of(players)
    ends = [settings.end_zone(end) for end in ("low", "high")]
    marks, berths = np.zeros((2, count + 1, count, 3)), np.zeros((2, count + 1, count, 2))
    wide = LargestBody(extent.across, extent.across)  # what minnows know of bodies is the circle around them
    for end, zone in enumerate(ends):
        for number in range(1, count + 1):
            berths[end, number, :number] = [(mark.x, mark.y) for mark in rows_of(number, zone, settings.field, wide)]
            marks[end, number, :number] = [
                (mark.x, mark.y, mark.theta) for mark in rows_of(number, zone, settings.field, extent)
            ]
    setting = records(
        1,
        bounds=(float, 4),
        zones=(float, 2, 4),
        marks=(float, 2, count + 1, count, 3),
        berths=(float, 2, count + 1, count, 2),
        order=(int, count),
        starts=(float, count, 3),
        sides=(int, count),
        worth=(float, len(RULES), 4),
        first_goal=(int,),
        tag_distance=(float,),
        pass_limit=(float,),
        rounds=(int,),
        slowest=(float,),
    )[0]
    setting.bounds[:] = settings.field.bounds
    setting.zones[:] = [zone.bounds for zone in ends]
    setting.marks[:], setting.berths[:] = marks, berths
    setting.order[:] = np.argsort([player.name for player in players])
    setting.starts[:] = [(p.start.x, p.start.y, p.start.theta) for p in players]
    setting.sides[:] = [SHARK if p.role == "shark" else MINNOW for p in players]
    setting.worth[:] = worths(RULES, LEARNING, shaping=shaping)
    setting.first_goal = LOW if settings.first_goal == "low" else HIGH
    setting.tag_distance, setting.pass_limit = settings.tag_distance, book.pass_limit
    setting.rounds, setting.slowest = book.rounds, settings.slowest
    return BatchedGame(
        setting=setting,
        standing=standing(matches, count),
        calls=calls(matches, count, 2 * count + 1),
        rules=RULES,
        teams=(MINNOWS, SHARKS),
        length=length(NUMBERS, PLACES, count, FLAGS),
        functions=Functions(judge, next_round, reset, drive, able, observe, forget, plan, decide),
        strategies=STRATEGIES,
    )


def standing(matches: int, players: int) -> Records:
    """The standing of this many matches, before their reset.

    Fields: `roles`, `active` (whether it may move), `limits` (the top speed, m/s) and `before` (the pose at the look
    before) of each player; `points`: those of the minnows and of the sharks; `number`: that of the pass, from 1;
    `goal`: the end that the minnows cross to; `clock`: the time of play in this pass, s; `winner`: the role whose team
    has won, NO_ROLE while the game goes on; and those of `judging`.
    """
    return records(
        matches,
        before=(float, players, 3),
        boxes=(float, players, 4),
        limits=(float, players),
        exits=(float, players),
        instants=(float, players),
        roles=(int, players),
        seen=(int, players),
        outs=(int, players),
        hunters=(int, players),
        points=(int, 2),
        number=(int,),
        goal=(int,),
        winner=(int,),
        clock=(float,),
        active=(bool, players),
    )


def reset(s: Record, t: Record, m: Record, r: Record, chance: Record) -> None:
    """Begin a match again, with all players on their marks and at rest."""
    t.points[:] = 0
    t.number, t.goal, t.clock, t.winner = 1, s.first_goal, 0.0, NO_ROLE
    t.seen[:] = BOTH
    for n in range(len(s.sides)):
        t.roles[n], t.active[n] = s.sides[n], True
        t.limits[n] = r.v_max[n] * between(chance, s.slowest, 1.0)
        put(m, n, s.starts[n, 0], s.starts[n, 1], s.starts[n, 2])
    t.before[:] = m.poses


def judge(s: Record, t: Record, m: Record, r: Record, c: Record, dt: float) -> bool:
    """Judge one match at a look, `dt` seconds of play after the one before, and return whether the pass is over."""
    t.clock += dt
    c.total = 0
    c.others[:] = False
    over = judge_look(s, t, c, t.before, m.poses, r.sizes, t.clock)
    t.before[:] = m.poses
    return over


def next_round(s: Record, t: Record, m: Record, c: Record) -> None:
    """End a game, or let inactive players become sharks and put all of them on their marks at the other end."""
    count = len(s.sides)
    left = 0
    for n in range(count):
        left += t.active[n] and t.roles[n] == MINNOW
    t.winner = winner(left, t.number, s.rounds)
    if t.winner != NO_ROLE:
        return
    for n in s.order:
        if not t.active[n]:
            if t.roles[n] == MINNOW:
                note(c, NEW_SHARK, n, math.inf)
            t.roles[n], t.active[n] = SHARK, True
    minnows_end = t.goal
    t.goal = HIGH if minnows_end == LOW else LOW
    t.number += 1
    t.clock = 0.0
    for role in (SHARK, MINNOW):
        rows = np.flatnonzero(t.roles == role)
        line_up(m, rows, s.marks[t.goal if role == SHARK else minnows_end, len(rows)])
    t.before[:] = m.poses


def observe(
    s: Record,
    t: Record,
    model: Record,
    seen: Floats,
    velocities: Floats,
    own: Floats,
    out: Singles,
) -> None:
    """Write what each player of a match sees.

    Args:
        seen: shape (players, 3): the poses that the referee has published. velocities: shape (players, 2), m/s.
        own: shape (players, 5): the pose and the twist that each measures of itself. out: shape (players, length).
    """
    count = len(s.sides)
    dx, dy = s.bounds[2] - s.bounds[0], s.bounds[3] - s.bounds[1]
    scale = 1.0 / math.sqrt(dx * dx + dy * dy)
    zone = s.zones[t.goal]
    flags, turns, gaps = np.empty((count, FLAGS)), np.empty((count, 2)), np.empty(count)
    minnows, sharks = 0, 0
    for n in range(count):
        flags[n, 2] = t.active[n]
        flags[n, 3] = zone[0] <= seen[n, 0] <= zone[2] and zone[1] <= seen[n, 1] <= zone[3]
        minnows += t.active[n] and t.roles[n] == MINNOW
        sharks += t.active[n] and t.roles[n] == SHARK
        turns[n, 0], turns[n, 1] = cos_sin(seen[n, 2])
    for me in range(count):
        row = out[me]
        x, y, theta, v, w = own[me, 0], own[me, 1], own[me, 2], own[me, 3], own[me, 4]
        cos, sin = cos_sin(theta)
        at = write_own(row, x, y, cos, sin, v / model.v_max[me], w / model.w_max[me], s.bounds, scale)
        row[at] = t.roles[me] == SHARK
        row[at + 1] = t.active[me]
        row[at + 2] = zone[0] <= x <= zone[2] and zone[1] <= y <= zone[3]
        row[at + 3] = 1.0 if s.pass_limit <= 0.0 else max(0.0, 1.0 - t.clock / s.pass_limit)
        row[at + 4] = min(1.0, t.number / s.rounds)
        row[at + 5], row[at + 6], row[at + 7] = minnows / count, sharks / count, s.sides[me] == SHARK
        at += NUMBERS
        near_x, near_y = min(max(x, zone[0]), zone[2]), min(max(y, zone[1]), zone[3])
        at = write_place(row, at, near_x - x, near_y - y, cos, sin, scale)
        at = write_place(row, at, (zone[0] + zone[2]) / 2 - x, (zone[1] + zone[3]) / 2 - y, cos, sin, scale)
        for n in range(count):
            flags[n, 0], flags[n, 1] = t.roles[n] == t.roles[me], s.sides[n] == s.sides[me]
        write_others(row, at, me, (x, y, v, cos, sin), seen, turns, velocities, flags, model.v_max[me], scale, gaps)


def able(t: Record, n: int) -> bool:
    """True if a player may move."""
    return bool(t.active[n])


def drive(s: Record, t: Record, m: Record, r: Record, n: int, v: float, w: float) -> None:
    """Let a player drive if it may, at most as fast as the referee lets it; otherwise its wheels are locked."""
    if able(t, n):
        command(m, r, n, v, w, t.limits[n])
    else:
        lock(m, n)
