"""The observations of a match's players, laid out as vrg_learn.observation lays out that of a player in a match.

Each value is computed for all players side by side, so that the processor works on several at a time.
"""

from vrg.portable.scalars import cos_sin, hypot
from vrg_learn.batch.records import Floats, Numbers, Record, Records, Singles, records
from vrg_learn.compiled import hole
from vrg_learn.learning import Learning
from vrg_learn.observation import own, place, turned

OWN = 8
"""The number of values about the player itself, before the game's numbers."""
PLACE = 4
"""The number of values about each place."""
OTHER = 8
"""The number of values about each other player, before its flags."""
LANES = 4
"""The number of players whose values are computed together is a multiple of this, as processors have it."""

numbers = place_of = flags = hole
"""What a game adds: see `vrg_learn.batch.game.Functions`."""


def length(learning: Learning, players: int) -> int:
    """The number of values of an observation."""
    others = (players - 1) * (OTHER + len(learning.flags))
    return OWN + len(learning.numbers) + PLACE * len(learning.places) + others


def sights(matches: int, players: int, spots: int) -> Records:
    """Room to work in, as each match needs it while its players observe.

    Of the players that are seen there are `x` and `y`, m, `heading`, rad, with its cosine and sine, `bearing`; `vx` and
    `vy`, m/s; `gaps`, their squared distances from the one that looks, m^2; and `seen`, the values about them. Of those
    that look there are `theta`, rad, and `turn`, its cosine and sine. Of each place of each of them there are `ways`:
    the way there, m, and the cosine and sine of the own heading; and `places`, the values about it.
    """
    lanes, ways = -(-players // LANES) * LANES, -(-players * spots // LANES) * LANES
    # All are of one type: only then does a compiler see that those of one record do not overlap.
    return records(
        matches,
        **dict.fromkeys(("x", "y", "heading", "vx", "vy", "gaps", "theta"), (float, lanes)),
        **dict.fromkeys(("bearing", "turn"), (float, 2, lanes)),
        seen=(float, OTHER, lanes),
        ways=(float, 4, ways),
        places=(float, PLACE, ways),
    )


def clipped(value: float) -> float:
    """The value within -1 to 1."""
    return min(1.0, max(-1.0, value))


def observe(s: Record, t: Record, model: Record, k: Record, e: Record, out: Singles) -> None:
    """Write what each player of a match sees.

    Args:
        k: what players know. e: room to work in, of `sights`. out: shape (players, length).
    """
    count, spots = len(k.poses), e.ways.shape[1] // len(k.poses)
    box = (s.bounds[0], s.bounds[1], s.bounds[2], s.bounds[3])
    scale = 1.0 / hypot(box[2] - box[0], box[3] - box[1])
    for n in range(count):
        e.x[n], e.y[n], e.heading[n], e.theta[n] = k.poses[n, 0], k.poses[n, 1], k.poses[n, 2], k.own[n, 2]
        e.vx[n], e.vy[n] = k.velocities[n, 0], k.velocities[n, 1]
    for i in range(len(e.x)):
        e.bearing[0, i], e.bearing[1, i] = cos_sin(e.heading[i])
        e.turn[0, i], e.turn[1, i] = cos_sin(e.theta[i])
    for me in range(count):
        x, y = k.own[me, 0], k.own[me, 1]
        for spot in range(spots):
            i, (to_x, to_y) = me * spots + spot, place_of(s, t, me, spot, x, y)
            e.ways[0, i], e.ways[1, i], e.ways[2, i], e.ways[3, i] = to_x - x, to_y - y, e.turn[0, me], e.turn[1, me]
    for i in range(e.ways.shape[1]):
        ahead, aside, far, near = place(e.ways[0, i], e.ways[1, i], e.ways[2, i], e.ways[3, i], scale)
        e.places[0, i], e.places[1, i], e.places[2, i], e.places[3, i] = ahead, aside, min(1.0, far), near
    for me in range(count):
        row, order = out[me], k.order[me]
        x, y, v, w, cosine, sine = k.own[me, 0], k.own[me, 1], k.own[me, 3], k.own[me, 4], e.turn[0, me], e.turn[1, me]
        mine = own(x, y, cosine, sine, v / model.v_max[me], w / model.w_max[me], box, scale)
        for value in range(OWN):
            row[value] = clipped(mine[value])
        at = numbers(s, t, me, x, y, row, OWN)
        for spot in range(me * spots, (me + 1) * spots):
            for value in range(PLACE):
                row[at + value] = e.places[value, spot]
            at += PLACE
        look(e, x, y, v, cosine, sine, 2.0 * model.v_max[me], scale)
        rank(order, e.gaps)
        for n in order:
            for value in range(OTHER):
                row[at + value] = e.seen[value, n]
            at = flags(s, t, me, n, k, row, at + OTHER)


def look(e: Record, x: float, y: float, v: float, cosine: float, sine: float, fastest: float, scale: float) -> None:
    """Find what a player sees of the others.

    Args:
        x, y, v: where it is, m, and its speed, m/s. cosine, sine: of its heading.
        fastest: the relative speed that counts as 1, m/s. scale: 1 / reach, 1/m.
    """
    for i in range(len(e.x)):
        dx, dy = e.x[i] - x, e.y[i] - y
        e.gaps[i] = dx * dx + dy * dy
        ahead, aside, far, near = place(dx, dy, cosine, sine, scale)
        e.seen[0, i], e.seen[1, i], e.seen[2, i], e.seen[3, i] = ahead, aside, min(1.0, far), near
        along, across = turned(e.vx[i], e.vy[i], cosine, sine)
        e.seen[4, i], e.seen[5, i] = clipped((along - v) / fastest), clipped(across / fastest)
        e.seen[6, i], e.seen[7, i] = turned(e.bearing[0, i], e.bearing[1, i], cosine, sine)


def rank(order: Numbers, gaps: Floats) -> None:
    """Sort players by their gaps, and those at the same distance by their rows.

    They are mostly in order already, as they were so at the look before.
    """
    for last in range(1, len(order)):
        n, at = order[last], last
        while at > 0 and (gaps[order[at - 1]] > gaps[n] or (gaps[order[at - 1]] == gaps[n] and order[at - 1] > n)):
            order[at] = order[at - 1]
            at -= 1
        order[at] = n
