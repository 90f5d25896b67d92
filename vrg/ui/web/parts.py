"""Turns a scene into the parts that the page draws, as JSON. The page knows no game and no colours: it gets them.

Lengths are in m and angles in rad, as everywhere. Numbers are rounded to what can be seen, to keep a frame small.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import msgspec

from vrg.bus.messages import Call, Stage
from vrg.colours import Rgb, hexadecimal
from vrg.figures import ORIGIN
from vrg.games import game_of, look
from vrg.games.game import title
from vrg.types import Pose
from vrg.ui import palette, picture
from vrg.ui.banner import Banner, Help, banners
from vrg.ui.deeds import deed, hindrance
from vrg.ui.headline import headline, legend
from vrg.ui.scene import Scene, SceneBody, ScenePlayer, clock_text
from vrg.ui.view import extent

_COLOURS: Final = (
    "BACKGROUND", "PANEL", "RAISED", "LINE", "FIELD", "TEXT", "MUTED", "INK",
    "SAFE", "WARNING", "ALARM", "CAUTION", "GOOD", "CALM", "LOST",
)  # fmt: skip
"""The colours of the palette that the page itself uses."""
_ENCODER: Final = msgspec.json.Encoder()


def encode(part: Any) -> str:
    """Plain data as a text of JSON."""
    return _ENCODER.encode(part).decode()


def colours() -> dict[str, str]:
    """The palette, by names such as `wall-edge`."""
    return {name.lower().replace("_", "-"): hexadecimal(getattr(palette, name)) for name in _COLOURS}


def welcome(
    match: str, role: str = "viewer", player: str = "", drawers: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """What a page needs once.

    Args:
        match: its name. role: of the visitor. player: that the visitor may drive. drawers: their titles by name.
    """
    return {
        "t": "welcome", "match": match, "role": role, "player": player, "drawers": dict(drawers or {}),
        "colours": colours(),
    }  # fmt: skip


def ground(scene: Scene) -> dict[str, Any]:
    """The figures that stand still. They change when the zones do, for example in a new round."""
    return {"t": "ground", "box": [round(edge, 2) for edge in extent(scene)], "figures": picture.ground(scene)}


def state(scene: Scene) -> dict[str, Any]:
    """The words about the match. They change now and then, not with each frame."""
    game, head = game_of(scene.game), headline(scene)
    return {
        "t": "state",
        "title": head.title if scene.game else "",
        "about": head.about,
        "chips": [] if scene.stage is None else [{"words": head.stage, **_plate(head.colour)}],
        "count": head.count,
        "reason": head.reason,
        "drama": head.drama,
        "scores": [
            {"team": team.team, "points": team.points, "words": team.words, **_plate(team.colour)}
            for team in head.teams
        ],
        "objects": [
            {
                "words": o.words,
                "colour": hexadecimal(game.thing_style(o.kind, o.team).colour),
                "carried": bool(o.carrier),
                "figure": picture.thing(game, replace(o, at=(0.0, 0.0), heading=0.0)),
            }
            for o in scene.objects
        ],
        "banners": [_banner(*both) for both in _banners(scene)],
        "players": [_player(scene, player) for player in scene.players],
        "plans": game.plans,
        "halted": scene.halted is not None,
        "estop": scene.estop,
        "over": scene.stage is Stage.GAME_OVER,
        "stage": scene.stage,
        "waiting": scene.waiting,
        "live": scene.live,
    }


def _banners(scene: Scene) -> Sequence[tuple[Banner, Banner]]:
    """The banners as viewers read them, each with the same one as officials do."""
    if scene.stage is None and not scene.estop:
        lines = ("The match is starting: the world and the referee have not been heard yet.",)
        waiting = Banner("Waiting for", lines, palette.CALM, brief=True)
        return [(waiting, waiting)]
    return list(zip(banners(scene), banners(scene, Help.KEYS), strict=True))


def _banner(banner: Banner, officials: Banner) -> dict[str, Any]:
    return {
        "heading": banner.heading,
        "lines": banner.lines,
        "steps": officials.steps,
        "brief": banner.brief,
        **_plate(banner.colour),
    }


def _plate(colour: Rgb) -> dict[str, str]:
    return {"colour": hexadecimal(colour), "ink": hexadecimal(palette.ink_on(colour))}


def looks(scene: Scene) -> dict[str, Any]:
    """What robots, players and marks look like. The bodies and the players are in the order of the state."""
    game, short = game_of(scene.game), picture.numbers(scene)
    return {
        "t": "looks",
        "bodies": [_body(scene, *both) for both in zip(scene.bodies, short, strict=True)],
        "signs": [look.badge(game.style(player.role, player.state)) for player in scene.players],
        "marks": picture.marks(scene),
        "legend": [{"words": words, "sign": sign} for words, sign in legend(scene)],
    }


def _body(scene: Scene, body: SceneBody, short: str) -> dict[str, Any]:
    here = replace(body, pose=Pose(0.0, 0.0, 0.0, body.pose.z))
    return {
        "name": body.name,
        "size": (round(body.length, 2), round(body.width, 2)),
        "out": body.out_of_play,
        "figure": picture.robot(scene, here, short),
        "ring": look.around(body.name, ORIGIN, (body.length, body.width)),
        "trail": look.trail(game_of(scene.game).style(body.role, body.state).colour),
    }


def _player(scene: Scene, player: ScenePlayer) -> dict[str, Any]:
    words, colour = deed(player)
    return {
        "name": player.name,
        "deed": words,
        "ink": hexadecimal(colour),
        "fault": player.fault,
        "out": player.out_of_play,
        "physical": any(body.physical for body in scene.bodies if body.name == player.name),
        "manual": player.manual,
        "hindrance": hindrance(scene, player),
    }


def strokes(scene: Scene) -> dict[str, Any]:
    """The players' own sketches."""
    return {"t": "strokes", "figures": picture.strokes(scene)}


def frame(scene: Scene) -> dict[str, Any]:
    """The moving parts. The bodies and the players are in the order of the state.

    Returns:
        `time` (match time, s), `clock` (as it is written), `left` (the time that is left, in words), `rate`, `bodies`
        (x, y in m, heading in rad each), `speeds` (of the players, m/s, or None),
        `objects` (x, y in m, heading in rad each), `flashes` (figures), and `around`: figures around bodies that are
        not known well or in the air, with the number of the body.
    """
    return {
        "t": "frame",
        "time": round(scene.time, 3),
        "clock": clock_text(scene.clock),
        "left": headline(scene).left,
        "rate": scene.rate,
        "bodies": [(round(b.pose.x, 3), round(b.pose.y, 3), round(b.pose.theta, 3)) for b in scene.bodies],
        "speeds": [None if p.speed is None or p.out_of_play else round(p.speed, 1) + 0.0 for p in scene.players],
        "objects": [(*_point(*thing.at), round(thing.heading, 3)) for thing in scene.objects],
        "flashes": picture.flashes(scene),
        "around": [(number, figure) for number, body in enumerate(scene.bodies) for figure in picture.around(body)],
    }


def parts(scene: Scene, kept: dict[str, tuple[object, str]] | None = None) -> dict[str, str]:
    """All parts of a scene as texts of JSON, by name, in the order in which the page needs them.

    Args:
        kept: outlines, which take long to encode and seldom change, with what they were made of. It is brought up to
            date.
    """
    kept = {} if kept is None else kept
    bodies = tuple(
        (b.name, b.length, b.width, b.role, b.state, b.physical, b.out_of_play, round(b.pose.z, 1))
        for b in scene.bodies
    )
    players = tuple((player.name, player.role, player.state, player.mark) for player in scene.players)
    made_of = {
        "ground": (scene.game, scene.zones, scene.obstacles, scene.starts),
        "looks": (scene.game, scene.stage, scene.obstacles, bodies, players),
    }
    for (name, of), make in zip(made_of.items(), (ground, looks), strict=True):
        if name not in kept or kept[name][0] != of:
            kept[name] = of, encode(make(scene))
    changing = {part["t"]: encode(part) for part in (state(scene), strokes(scene), frame(scene))}
    return {name: text for name, (_, text) in kept.items()} | changing


def call(call: Call, game_name: str) -> str:
    """A call of the referee with its rule, as a text of JSON."""
    text = game_of(game_name).rule_text(call.rule)
    return encode(
        {
            "number": call.number,
            "clock": clock_text(call.clock),
            "text": call.text,
            "rule": title(call.rule),
            "words": "" if text is None else text.words,
            "source": "" if text is None else text.source,
        }
    )


def _point(x: float, y: float) -> list[float]:
    return [round(x, 2), round(y, 2)]
