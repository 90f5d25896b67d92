"""RoboFlag for many matches at once: the rules, the observation and the driving home, as functions of one match.

What is decided at a look and after a round is decided by the functions of that referee, vrg.games.roboflag.judging.
Nobody is pushed, placed by an official or disqualified in these matches, and there are no auctions, which change no
rule. A tagged player is driven straight home, and not around others as by the coordinator of a match.
"""

import math

import numpy as np

from vrg.coordinator.look import NO_ONE, note
from vrg.coordinator.referee_driver import CRAWL
from vrg.coordinator.rulebook import DRAW
from vrg.games.roboflag import BLUES, RED, TEAMS
from vrg.games.roboflag.judging import NORMAL, RULES, SUDDEN, SUDDEN_DEATH, TAGGED, next_number, time_limit, winner
from vrg.games.roboflag.judging import judge as judge_look
from vrg.games.roboflag.rules import RoboFlag
from vrg.navigation.control import linearise
from vrg.navigation.pilot import OFFSET
from vrg.portable.scalars import hypot
from vrg.types import Vector
from vrg_learn.batch.assigning import line_up
from vrg_learn.batch.game import BatchedGame, Functions, calls, worths
from vrg_learn.batch.motion import command, put
from vrg_learn.batch.observing import length
from vrg_learn.batch.records import Record, Records, Singles, records
from vrg_learn.batch.roboflag_players import STRATEGIES, decide, forget, plan
from vrg_learn.games.roboflag import CAPTURES, LEARNING

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
    for name, value in layout.numbers().items():
        setting[name] = value
    setting.starts[:] = [(p.start.x, p.start.y, p.start.theta) for p in players]
    setting.worth[:] = worths(RULES, LEARNING, shaping=shaping)
    setting.order[:] = np.argsort([player.name for player in players])
    setting.sides[:] = [TEAMS.index(player.role) for player in players]
    setting.round_time, setting.sudden_death = settings.round_time, settings.sudden_death
    setting.epoch, setting.captures = settings.epoch, settings.captures
    return BatchedGame(
        setting=setting,
        standing=standing(matches, count),
        calls=calls(matches, count, 2 * count + 4),
        rules=RULES,
        teams=(RED, BLUES, DRAW),
        length=length(LEARNING, count),
        places=len(LEARNING.places),
        functions=Functions(judge, next_round, reset, drive, able, numbers, place_of, flags, forget, plan, decide),
        strategies=STRATEGIES,
    )


def standing(matches: int, players: int) -> Records:
    """The standing of this many matches, before their reset.

    Fields: `before`, the pose of each player at the look before; `number`: that of the round, from 1; `clock`: the time
    of play in it, s; `winner`: the team that has won, DRAWN or NO_ONE; and those of `judging`.
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
        here=(bool, players),
    )


def reset(s: Record, t: Record, m: Record, r: Record, chance: Record) -> None:
    """Begin a match again, with all players on their marks and at rest."""
    t.points[:] = 0
    t.number, t.winner = 1, NO_ONE
    t.here[:] = True
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
    c.others[:] = False
    over = judge_look(s, t, c, t.before, m.poses, t.number, t.clock)
    t.before[:] = m.poses
    return over


def next_round(s: Record, t: Record, m: Record, c: Record) -> None:
    """End a game, or begin its next round: scores carry over, positions and flags do not."""
    t.winner = winner(s, t.points, t.number)
    if t.winner != NO_ONE:
        return
    for team in range(2):
        rows = np.flatnonzero(s.sides == team)
        line_up(m, rows, s.starts[rows])
    t.number = next_number(s, t.points, t.number)
    if t.number == SUDDEN_DEATH:
        note(c, SUDDEN, NO_ONE, math.inf)
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


def numbers(s: Record, t: Record, me: int, x: float, y: float, out: Singles, at: int) -> int:
    """Write from number `at` on the game's numbers for a player that is at (x, y), m, and return the next number."""
    team = s.sides[me]
    for state in range(3):
        out[at + state] = t.states[me] == state
    out[at + 3], out[at + 4] = t.carriers[team] != NO_ONE, t.carriers[1 - team] != NO_ONE
    out[at + 5] = max(0.0, 1.0 - t.clock / time_limit(s, t.number))
    out[at + 6] = min(1.0, max(-1.0, (t.points[team] - t.points[1 - team]) / CAPTURES))
    out[at + 7] = (x - s.midline) * s.ahead[team] <= 0.0
    out[at + 8] = in_zone(s, 0, x, y) or in_zone(s, 1, x, y)
    return at + 9


def place_of(s: Record, t: Record, me: int, number: int, x: float, y: float) -> Vector:
    """The place in m of this number for a player that is at (x, y)."""
    if number == 3:
        return s.midline, y
    team = 1 - s.sides[me] if number == 0 else s.sides[me]
    place = s.homes[team] if number == 2 else s.flag_places[team]
    return place[0], place[1]


def flags(s: Record, t: Record, me: int, n: int, k: Record, out: Singles, at: int) -> int:
    """Write from number `at` on the flags of player `n` as another one sees it, and return the next number."""
    out[at] = s.sides[n] == s.sides[me]
    for state in range(3):
        out[at + 1 + state] = t.states[n] == state
    return at + 4


def in_zone(s: Record, team: int, x: float, y: float) -> bool:
    """True if a place is in the flag zone of a team."""
    return bool(hypot(x - s.flag_places[team, 0], y - s.flag_places[team, 1]) <= s.zone)
