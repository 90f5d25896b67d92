"""The shipped strategies of RoboFlag for many matches at once, as opponents of those who learn.

They decide as vrg.games.roboflag.player does, by its numbers, from the poses that the referee has published. Unlike
there, bids need no time, all places but the own are one decision old, and ways lead past standing bodies without a
plan, and do not know the obstacles of a map. So they are sparring partners: how good a policy is against the strategies
themselves is found in matches.
"""

import math
from typing import Final

import numpy as np

from vrg.coordinator.look import NO_ONE
from vrg.games.roboflag.formation import ATTACKER_SPACING, FEINT, FLANK, FORM_UP_DISTANCE, IN_PLACE, feint, lane
from vrg.games.roboflag.judging import FLAGGED, NORMAL, TAGGED
from vrg.games.roboflag.player import (
    APPROACH,
    AT_POST,
    BOLDNESS,
    FORM_UP_TIMEOUT,
    MAX_TIME_MARGIN,
    MIDLINE,
    MIN_PROGRESS,
    NEARLY,
    OFF_POST,
    RISK,
    SLOWEST,
)
from vrg.games.roboflag.posts import ALL_ROUND, LOYALTY, MAX_CHASERS, POST_CLEARANCE, POST_DISTANCE
from vrg.games.roboflag.situation import BORDER_CLEARANCE, HAVEN
from vrg.navigation.control import turn
from vrg.navigation.pilot import FACING
from vrg.portable.scalars import asin, atan2, cos_sin, hypot
from vrg.types import Vector
from vrg_learn.batch.driving import Box, head, meeting_time, nearest_in, safest, scaled, within
from vrg_learn.batch.records import Floats, Numbers, Record, insert

ATTACK, ESCORT, TAG, GUARD, EVADE = range(5)
"""The jobs of a player."""
STRATEGIES: Final = ("conservative", "aggressive", "aggressive-two-groups", "balanced")
"""The strategies by their numbers; those of vrg.games.roboflag.strategies."""
ATTACKERS: Final = (1, 99, 99, 2)
FLANKS: Final = (1, 1, 2, 2)
TOGETHER: Final = (False, True, True, True)
BOLD: Final = (False, True, True, False)
"""Of each strategy: how many attack (99 for all), in how many groups, whether they go at the same time, and whether
they take every risk then, and shield the carrier."""


def forget(p: Record) -> None:
    """Forget all of the round before."""
    p.opened[:] = -math.inf
    p.winner[:] = NO_ONE
    p.job[:] = GUARD
    p.target[:] = NO_ONE
    p.since[:] = 0.0
    p.waiting[:] = -1.0
    p.charging[:] = False
    p.staying[:] = False


def plan(s: Record, t: Record, r: Record, k: Record, p: Record, now: float) -> None:
    """Share the work in the teams that play by a strategy.

    Args:
        p: the plans of the match: see `vrg_learn.batch.stepping.plans`. now: the time in the match, s.
    """
    for team in range(2):
        if p.strategy[team] < 0:
            continue
        auction(s, t, r, k, p, team)
        strategy, carrier, before = p.strategy[team], t.carriers[1 - team], p.job.copy()
        ranked = ranking(s, t, p, team)
        attackers = ranked[: ATTACKERS[strategy]]
        for n in range(len(s.sides)):
            if s.sides[n] == team:
                p.job[n] = EVADE if t.states[n] == FLAGGED else GUARD
        if carrier == NO_ONE:
            p.job[attackers] = ATTACK
        elif BOLD[strategy]:
            p.job[ranked] = ESCORT
        chase(s, t, k, p, team)
        for n in range(len(s.sides)):
            if s.sides[n] == team and (p.job[n] != before[n] or t.states[n] != NORMAL):
                p.charging[n], p.waiting[n] = False, -1.0
                if p.job[n] != before[n]:
                    p.since[n] = now
        if carrier == NO_ONE and TOGETHER[strategy]:
            form(s, k, p, team, attackers, now)
        if carrier != NO_ONE and BOLD[strategy]:
            shield(s, t, r, k, p, team, carrier)
        guard(s, t, r, k, p, team)


def auction(s: Record, t: Record, r: Record, k: Record, p: Record, team: int) -> None:
    """Let a team bid for who goes for the flag, as the referee's auctions do."""
    if t.carriers[1 - team] != NO_ONE:
        p.winner[team] = NO_ONE
        return
    winner, waited = p.winner[team], t.clock - p.opened[team]
    if winner != NO_ONE and t.states[winner] == NORMAL and 0.0 <= waited < s.epoch:
        return
    p.opened[team], p.winner[team], lowest = t.clock, NO_ONE, math.inf
    for n in s.order:
        if s.sides[n] == team:
            p.bid[n] = math.inf
            if t.states[n] == NORMAL:
                dx, dy = s.flag_places[1 - team, 0] - k.poses[n, 0], s.flag_places[1 - team, 1] - k.poses[n, 1]
                p.bid[n] = hypot(dx, dy) / r.v_max[n]
                if p.bid[n] < lowest:
                    p.winner[team], lowest = n, p.bid[n]


def ranking(s: Record, t: Record, p: Record, team: int) -> Numbers:
    """The normal players of a team in the order of their bids, the winner first."""
    found, bids, count = np.empty(len(s.sides), dtype=np.int64), np.empty(len(s.sides)), 0
    for n in s.order:
        if s.sides[n] == team and t.states[n] == NORMAL:
            insert(bids, found, count, -1.0 if n == p.winner[team] else p.bid[n], n)
            count += 1
    return found[:count]


def form(s: Record, k: Record, p: Record, team: int, attackers: Numbers, now: float) -> None:
    """Give the attackers of a team their places in the formation, and let them charge when all are there."""
    flanks, ahead = FLANKS[p.strategy[team]], s.ahead[team]
    low, high = s.bounds[1] + BORDER_CLEARANCE, s.bounds[3] - BORDER_CLEARANCE
    formed, number = True, 0
    for n in s.order:
        if s.sides[n] != team or p.job[n] != ATTACK:
            continue
        group, place = number % flanks, number // flanks
        members = (len(attackers) - group + flanks - 1) // flanks
        number += 1
        apart = min(ATTACKER_SPACING, (high - low) / max(1, members - 1))
        width = apart * (members - 1)
        middle = s.flag_places[1 - team, 1]
        if flanks > 1:
            side = group if ahead > 0.0 else 1 - group
            middle = low + FLANK if side % 2 == 0 else high - FLANK
        middle = min(max(middle, low + width / 2), high - width / 2)
        p.place[n, 0] = s.midline - ahead * FORM_UP_DISTANCE
        p.place[n, 1] = middle + ahead * (apart * place - width / 2)
        away = hypot(p.place[n, 0] - k.poses[n, 0], p.place[n, 1] - k.poses[n, 1])
        p.place[n, 1] += ahead * FEINT * feint(now)
        formed = formed and away <= IN_PLACE
        if p.waiting[n] < 0.0 and away <= NEARLY:
            p.waiting[n] = now
    for n in attackers:
        late = p.waiting[n] >= 0.0 and now - p.waiting[n] > FORM_UP_TIMEOUT
        p.charging[n] = p.charging[n] or formed or late


def shield(s: Record, t: Record, r: Record, k: Record, p: Record, team: int, carrier: int) -> None:
    """Put each escort of a team between the carrier and an opponent near it, the nearest opponent first."""
    count = len(s.sides)
    for n in range(count):
        if p.job[n] == ESCORT and s.sides[n] == team:
            p.target[n] = carrier
            p.place[n, 0], p.place[n, 1] = k.poses[carrier, 0], k.poses[carrier, 1]
    for by in nearest(s, t, k, 1 - team, k.poses[carrier, 0], k.poses[carrier, 1]):
        far = hypot(k.poses[by, 0] - k.poses[carrier, 0], k.poses[by, 1] - k.poses[carrier, 1])
        share = max(0.5, 1.0 - (r.reach[by] + r.reach[carrier]) / max(far, 1e-9))
        x = k.poses[carrier, 0] + (k.poses[by, 0] - k.poses[carrier, 0]) * share
        y = k.poses[carrier, 1] + (k.poses[by, 1] - k.poses[carrier, 1]) * share
        escort, gap = NO_ONE, math.inf
        for n in s.order:
            if s.sides[n] == team and p.job[n] == ESCORT and p.target[n] == carrier:
                away = hypot(k.poses[n, 0] - x, k.poses[n, 1] - y)
                if away < gap:
                    escort, gap = n, away
        if escort == NO_ONE:
            return
        p.target[escort], p.place[escort, 0], p.place[escort, 1] = by, x, y


def nearest(s: Record, t: Record, k: Record, team: int, x: float, y: float) -> Numbers:
    """The players of a team that can tag, those nearest to a place first."""
    found, gaps, count = np.empty(len(s.sides), dtype=np.int64), np.empty(len(s.sides)), 0
    for n in s.order:
        if s.sides[n] == team and t.states[n] != TAGGED:
            insert(gaps, found, count, hypot(k.poses[n, 0] - x, k.poses[n, 1] - y), n)
            count += 1
    return found[:count]


def chase(s: Record, t: Record, k: Record, p: Record, team: int) -> None:
    """Give defenders an opponent to tag, the shortest ways first."""
    count, before = len(s.sides), p.target.copy()
    wanted = threats(s, t, k, team)
    while True:
        chaser, prey, least = NO_ONE, NO_ONE, math.inf
        for n in s.order:
            if s.sides[n] != team or p.job[n] != GUARD or t.states[n] != NORMAL:
                continue
            for o in s.order:
                if wanted[o] > 0:
                    way = hypot(k.poses[o, 0] - k.poses[n, 0], k.poses[o, 1] - k.poses[n, 1])
                    way *= LOYALTY if before[n] == o else 1.0
                    if way < least:
                        chaser, prey, least = n, o, way
        if chaser == NO_ONE:
            break
        p.job[chaser], p.target[chaser] = TAG, prey
        wanted[prey] -= 1
    for n in range(count):
        if s.sides[n] == team and p.job[n] != TAG and p.job[n] != ESCORT:
            p.target[n] = NO_ONE


def threats(s: Record, t: Record, k: Record, team: int) -> Numbers:
    """How many players of a team should chase each opponent: those with its flag, and those on its half."""
    wanted = np.zeros(len(s.sides), dtype=np.int64)
    for o in range(len(s.sides)):
        if s.sides[o] == team or t.states[o] == TAGGED:
            continue
        invades = (k.poses[o, 0] - s.midline) * s.ahead[team] <= 0.0
        dx, dy = k.poses[o, 0] - s.flag_places[team, 0], k.poses[o, 1] - s.flag_places[team, 1]
        if o == t.carriers[team]:
            wanted[o] = MAX_CHASERS
        elif invades and hypot(dx, dy) > s.zone:
            wanted[o] = 1
    return wanted


def guard(s: Record, t: Record, r: Record, k: Record, p: Record, team: int) -> None:
    """Give the guards of a team their posts around its flag, between it and the nearest opponents."""
    x, y = s.flag_places[team, 0], s.flag_places[team, 1]
    guards, bearings, count, widest = np.empty(len(s.sides), dtype=np.int64), np.empty(len(s.sides)), 0, 0.0
    for n in s.order:
        if s.sides[n] == team and p.job[n] == GUARD and t.states[n] == NORMAL:
            insert(bearings, guards, count, bearing(k.poses[n, 0] - x, k.poses[n, 1] - y, s.ahead[team]), n)
            widest = max(widest, r.reach[n])
            count += 1
    if count == 0:
        return
    radius = s.zone + POST_DISTANCE
    facing = nearest(s, t, k, 1 - team, x, y)[:count]
    angles, free = np.empty(count), count - len(facing)
    for place in range(len(facing)):
        angles[place] = bearing(k.poses[facing[place], 0] - x, k.poses[facing[place], 1] - y, s.ahead[team])
    for place in range(free):
        angles[len(facing) + place] = ALL_ROUND * (place - (free - 1) / 2)
    apart = min(2.0 * asin(min(1.0, (widest + POST_CLEARANCE / 2) / radius)), math.tau / 8)
    angles = spread(np.sort(angles), apart)
    for place in range(count):
        n = guards[place]
        cos, sin = cos_sin(angles[place])
        p.place[n, 0] = x + radius * cos * s.ahead[team]
        p.place[n, 1] = y + radius * sin * s.ahead[team]


def bearing(dx: float, dy: float, ahead: float) -> float:
    """The direction of a way relative to that of the opponents' half, rad."""
    return atan2(dy * ahead, dx * ahead)


def spread(bearings: Floats, apart: float) -> Floats:
    """Sorted angles, moved so that neighbours are at least `apart` from one another: see `vrg.games.roboflag.posts`."""
    count = len(bearings)
    if count < 2:
        return bearings
    first, widest = 0, -1.0
    for i in range(count):
        gap = bearings[i] - bearings[i - 1] + (math.tau if i == 0 else 0.0)
        if gap > widest:
            first, widest = i, gap
    pushed, shift = np.empty(count), 0.0
    for i in range(count):
        angle = bearings[(first + i) % count] + (math.tau if first + i >= count else 0.0)
        pushed[i] = angle if i == 0 else max(angle, pushed[i - 1] + apart)
        shift += angle - pushed[i]
    pushed += shift / count
    found = np.empty(count)
    for i in range(count):
        found[(first + i) % count] = pushed[i]
    return found


def decide(s: Record, t: Record, r: Record, k: Record, p: Record, n: int, now: float) -> tuple[float, float]:
    """The twist (v, w) of a player of a team that plays by a strategy, after `plan`."""
    team, job = s.sides[n], p.job[n]
    x, y = k.own[n, 0], k.own[n, 1]
    box = within(s.bounds, BORDER_CLEARANCE)
    if job == EVADE:
        dx, dy = x - s.homes[team, 0], y - s.homes[team, 1]
        share = min(1.0, max(0.0, s.home_reach - HAVEN) / max(hypot(dx, dy), 1e-9))
        return drive_safely(s, t, r, k, p, n, now, (s.homes[team, 0] + dx * share, s.homes[team, 1] + dy * share), box)
    if job == ATTACK:
        flag = (s.flag_places[1 - team, 0], s.flag_places[1 - team, 1])
        if p.charging[n] or not TOGETHER[p.strategy[team]]:
            return drive_safely(s, t, r, k, p, n, now, flag, box)
        return to_place(r, k, p, n, flag, box)
    if job == GUARD:
        return to_place(r, k, p, n, (s.midline, y), box)
    goal_x, goal_y = p.place[n, 0], p.place[n, 1]
    if job == TAG:
        prey = p.target[n]
        vx, vy = k.velocities[prey, 0], k.velocities[prey, 1]
        time = meeting_time(k.poses[prey, 0] - x, k.poses[prey, 1] - y, r.v_max[n], vx, vy, 0.0)
        time = time if time < math.inf else 0.0
        goal_x, goal_y = k.poses[prey, 0] + vx * time, k.poses[prey, 1] + vy * time
        if prey != t.carriers[team]:
            limit = s.midline - MIDLINE * s.ahead[team]
            goal_x = min(goal_x, limit) if s.ahead[team] > 0.0 else max(goal_x, limit)
    goal_x, goal_y = nearest_in(goal_x, goal_y, box)
    return go(r, k, p, n, p.target[n], (goal_x - x, goal_y - y), r.v_max[n], box)


def go(
    r: Record, k: Record, p: Record, n: int, ignored: int, way: Vector, speed: float, box: Box
) -> tuple[float, float]:
    """The twist that drives a way, m, at a speed, m/s; a player that is ignored may be touched."""
    p.ignored[:] = False
    if ignored != NO_ONE:
        p.ignored[ignored] = True
    pose = (k.own[n, 0], k.own[n, 1], k.own[n, 2])
    return head(n, pose, scaled(way, speed), p.ignored, k.poses, k.velocities, r.reach, box)


def to_place(r: Record, k: Record, p: Record, n: int, towards: Vector, box: Box) -> tuple[float, float]:
    """The twist that drives to the place of a player's plan, and stands there, turned towards another one."""
    x, y = nearest_in(p.place[n, 0], p.place[n, 1], box)
    dx, dy = x - k.own[n, 0], y - k.own[n, 1]
    away = hypot(dx, dy)
    p.staying[n] = away < (OFF_POST if p.staying[n] else AT_POST)
    if p.staying[n]:
        return stay(k, n, towards)
    return go(r, k, p, n, NO_ONE, (dx, dy), min(r.v_max[n], max(SLOWEST, APPROACH * away)), box)


def stay(k: Record, n: int, towards: Vector) -> tuple[float, float]:
    """The twist of a player that stands, turned towards a place."""
    dx, dy = towards[0] - k.own[n, 0], towards[1] - k.own[n, 1]
    cos, sin = cos_sin(k.own[n, 2])
    error = atan2(dy * cos - dx * sin, dx * cos + dy * sin)
    twist = turn(error, FACING)
    return twist.v, twist.w


def drive_safely(
    s: Record, t: Record, r: Record, k: Record, p: Record, n: int, now: float, goal: Vector, box: Box
) -> tuple[float, float]:
    """The twist on the way to a goal on which no opponent can tag the player, with less care the longer it takes."""
    team, carries = s.sides[n], p.job[n] == EVADE
    hunters, count = np.empty((len(s.sides), 2)), 0
    for o in range(len(s.sides)):
        if s.sides[o] != team and t.states[o] != TAGGED:
            hunters[count, 0], hunters[count, 1] = k.poses[o, 0], k.poses[o, 1]
            count += 1
    discs = np.empty((3, 3))
    for place in range(2):
        discs[place, 0], discs[place, 1] = s.flag_places[place, 0], s.flag_places[place, 1]
        discs[place, 2] = s.zone if carries or place != team else 0.0
    discs[2, 0], discs[2, 1], discs[2, 2] = s.homes[team, 0], s.homes[team, 1], s.home_reach if carries else 0.0
    bold = p.job[n] == ATTACK and p.charging[n] and BOLD[p.strategy[team]]
    margin = RISK if bold else max(RISK, MAX_TIME_MARGIN - BOLDNESS * (now - p.since[n]))
    here = (k.own[n, 0], k.own[n, 1])
    cos, sin, progress, spare = safest(
        here,
        goal,
        hunters[:count],
        r.v_max[n],
        s.tag_distance,
        margin,
        box,
        discs,
        s.midline,
        0.0 if carries else s.ahead[team],
    )
    far = hypot(goal[0] - here[0], goal[1] - here[1])
    if 0.0 <= progress < MIN_PROGRESS and spare > 0.0 and far > MIN_PROGRESS:
        if p.job[n] != ATTACK or (here[0] - s.midline) * s.ahead[team] >= 0.0:
            return stay(k, n, goal)
        x, y = lane(box, s.midline, s.ahead[team], now)
        return go(r, k, p, n, NO_ONE, (x - here[0], y - here[1]), r.v_max[n], box)
    return go(r, k, p, n, NO_ONE, (cos, sin), r.v_max[n], box)
