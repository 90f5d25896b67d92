"""What a player sees at an instant, as lines of code and their values, for a student who asks what a view has."""

import math
from collections.abc import Iterator
from typing import Any

from vrg.agents.strategy import View
from vrg.hal.sensors.laser import Laser

MOST_OTHERS = 8
"""The other players that are listed, the nearest ones."""


def seen(view: View) -> list[tuple[str, str]]:
    """Expressions of a view, and their values in words, the most useful ones first."""
    return [(expression, _words(value)) for expression, value in _values(view)]


def _values(view: View) -> Iterator[tuple[str, Any]]:
    me, state = view.me, view.referee
    yield "view.position", view.position
    yield "view.pose.theta", view.pose.theta
    yield "view.speed", view.speed
    for number, thing in enumerate(state.objects):
        yield f"view.referee.objects[{number}].name", thing.name
        yield f"view.referee.objects[{number}].carrier", thing.carrier
        yield f"view.referee.objects[{number}].x", thing.x
        yield f"view.referee.objects[{number}].y", thing.y
    others = sorted(view.others(), key=lambda one: math.dist((one.pose.x, one.pose.y), view.position))  # type: ignore[union-attr]
    for number, one in enumerate(view.others()):
        if one in others[:MOST_OTHERS] and one.pose is not None:
            yield f"view.others()[{number}].name", one.name
            yield f"view.others()[{number}].team", one.team
            yield f"view.others()[{number}].pose", (one.pose.x, one.pose.y)
    for kind in dict.fromkeys(zone.kind for zone in state.zones):
        region = view.zone(kind)
        if region is not None:
            yield f"view.zone({kind!r}).contains(*view.position)", region.contains(*view.position)
            yield f"view.zone({kind!r}).nearest(*view.position)", region.nearest(*view.position)
    yield "view.time", view.time
    yield "view.me.role", me.role
    yield "view.me.state", me.state
    yield "view.me.may_move", me.may_move
    if me.mark is not None:
        yield "view.me.mark", (me.mark.x, me.mark.y)
    yield "view.referee.clock", state.clock
    yield "view.referee.score", dict(state.score)
    for number, message in enumerate(view.heard):
        yield f"view.heard[{number}].speaker", message.speaker
        yield f"view.heard[{number}].words", message.words
    scan = view.readings.latest(Laser)
    if scan is not None and len(scan.value.ranges):
        yield "min(view.readings.latest(Laser).value.ranges)", float(min(scan.value.ranges))


def _words(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.2f}"
    if isinstance(value, tuple):
        return f"({', '.join(_words(one) for one in value)})"
    return repr(value)[:200]
