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
from vrg.types import Vector
from vrg_learn.batch.assigning import line_up
from vrg_learn.batch.chance import between
from vrg_learn.batch.game import BatchedGame, Functions, calls, worths
from vrg_learn.batch.motion import command, lock, put
from vrg_learn.batch.observing import length
from vrg_learn.batch.records import Record, Records, Singles, records
from vrg_learn.batch.sharks_and_minnows_players import STRATEGIES, decide, forget, is_safe, plan
from vrg_learn.games.sharks_and_minnows import LEARNING

LOW, HIGH = 0, 1
"""The ends of the field."""


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
        length=length(LEARNING, count),
        places=len(LEARNING.places),
        functions=Functions(judge, next_round, reset, drive, able, numbers, place_of, flags, forget, plan, decide),
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


def numbers(s: Record, t: Record, me: int, x: float, y: float, out: Singles, at: int) -> int:
    """Write from number `at` on the game's numbers for a player that is at (x, y), m, and return the next number."""
    count, minnows, sharks = len(s.sides), 0, 0
    for n in range(count):
        minnows += t.active[n] and t.roles[n] == MINNOW
        sharks += t.active[n] and t.roles[n] == SHARK
    out[at], out[at + 1] = t.roles[me] == SHARK, t.active[me]
    out[at + 2] = is_safe(s, t, x, y)
    out[at + 3] = 1.0 if s.pass_limit <= 0.0 else max(0.0, 1.0 - t.clock / s.pass_limit)
    out[at + 4] = min(1.0, t.number / s.rounds)
    out[at + 5], out[at + 6], out[at + 7] = minnows / count, sharks / count, s.sides[me] == SHARK
    return at + 8


def place_of(s: Record, t: Record, me: int, number: int, x: float, y: float) -> Vector:
    """The place in m of this number for a player that is at (x, y)."""
    zone = s.zones[t.goal]
    if number == 0:
        return min(max(x, zone[0]), zone[2]), min(max(y, zone[1]), zone[3])
    return (zone[0] + zone[2]) / 2, (zone[1] + zone[3]) / 2


def flags(s: Record, t: Record, me: int, n: int, k: Record, out: Singles, at: int) -> int:
    """Write from number `at` on the flags of player `n` as another one sees it, and return the next number."""
    out[at], out[at + 1] = t.roles[n] == t.roles[me], s.sides[n] == s.sides[me]
    out[at + 2], out[at + 3] = t.active[n], is_safe(s, t, k.poses[n, 0], k.poses[n, 1])
    return at + 4


def able(t: Record, n: int) -> bool:
    """True if a player may move."""
    return bool(t.active[n])


def drive(s: Record, t: Record, m: Record, r: Record, n: int, v: float, w: float) -> None:
    """Let a player drive if it may, at most as fast as the referee lets it; otherwise its wheels are locked."""
    if able(t, n):
        command(m, r, n, v, w, t.limits[n])
    else:
        lock(m, n)
