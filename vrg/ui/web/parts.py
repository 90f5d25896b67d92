"""Turns a scene into the parts that the page draws, as JSON. The page knows no game and no colours: it gets them.

Lengths are in m and angles in rad, as everywhere. Numbers are rounded to what can be seen, to keep a frame small.
"""

from collections.abc import Sequence
from typing import Any, Final

import msgspec

from vrg.bus.messages import Call, Stage
from vrg.colours import Rgb, hexadecimal
from vrg.games import game_of
from vrg.games.game import Game, title
from vrg.geometry import SIGMAS
from vrg.regions import Region
from vrg.ui import palette
from vrg.ui.banner import Banner, Help, banners
from vrg.ui.deeds import deed, hindrance
from vrg.ui.headline import WALL, headline, legend
from vrg.ui.scene import Scene, SceneBody, ScenePlayer, clock_text
from vrg.ui.view import extent
from vrg.ui.zones import room, zone_look

_COLOURS: Final = (
    "BACKGROUND", "PANEL", "RAISED", "LINE", "FIELD", "GRID", "BORDER", "WALL", "WALL_EDGE", "TEXT", "MUTED", "INK",
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


def ground(scene: Scene) -> dict[str, Any]:
    """The parts that stand still: zones and walls. They change when the zones do, for example in a new round."""
    game = game_of(scene.game)
    return {
        "t": "ground",
        "box": [round(edge, 2) for edge in extent(scene)],
        "fields": [_outline(zone.region) for zone in scene.zones if zone.kind == "field"],
        "zones": [_zone(zone, game) for zone in scene.zones if zone.kind != "field"],
        "walls": [_outline(region) for region in scene.obstacles],
    }


def _zone(zone: Any, game: Game) -> dict[str, Any]:
    look = zone_look(zone, game)
    return {
        "outline": _outline(zone.region),
        "safe": look.safe,
        "tint": hexadecimal(look.tint),
        "stripe": hexadecimal(look.stripe),
        "edge": hexadecimal(look.edge),
        "words": look.words,
        "ink": hexadecimal(look.ink),
        "below": look.below,
        "team": look.team,
        "room": [round(length, 2) for length in room(zone.region)],
        "middle": _point(*zone.region.middle),
        "bounds": [round(edge, 2) for edge in zone.region.bounds],
    }


def state(scene: Scene) -> dict[str, Any]:
    """The words about the match, and the look of the robots. They change now and then, not with each frame."""
    game, head = game_of(scene.game), headline(scene)
    lining_up = scene.stage in (Stage.INITIALIZE, Stage.ROUND_OVER)
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
            {"words": o.words, "colour": hexadecimal(game.team_style(o.team).colour), "carried": bool(o.carrier)}
            for o in scene.objects
        ],
        "banners": [_banner(*both) for both in _banners(scene)],
        "bodies": [_body(body, game) for body in scene.bodies],
        "players": [_player(scene, player, game) for player in scene.players],
        "marks": [
            {
                "pose": [*_point(player.mark.x, player.mark.y), round(player.mark.theta, 2)],
                "colour": hexadecimal(palette.mix(game.style(player.role).colour, palette.FIELD, 0.45)),
            }
            for player in scene.players
            if lining_up and player.mark is not None
        ],
        "legend": [
            {"words": words, "colour": hexadecimal(palette.WALL if words == WALL else palette.BACKGROUND)}
            | ({} if style is None else {"colour": hexadecimal(style.colour), "marker": style.marker.value})
            for words, style in legend(scene)
        ],
        "plans": game.plans,
        "halted": scene.halted is not None,
        "estop": scene.estop,
        "over": scene.stage is Stage.GAME_OVER,
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


def _body(body: SceneBody, game: Game) -> dict[str, Any]:
    style = game.style(body.role, body.state)
    return {
        "name": body.name,
        "length": round(body.length, 2),
        "width": round(body.width, 2),
        "colour": hexadecimal(style.colour),
        "nose": hexadecimal(palette.mix(style.colour, palette.TEXT, 0.75)),
        "marker": style.marker.value,
        "physical": body.physical,
        "out": body.out_of_play,
        "remark": game.remark(body.state),
    }


def _player(scene: Scene, player: ScenePlayer, game: Game) -> dict[str, Any]:
    style = game.style(player.role, player.state)
    words, colour = deed(player)
    return {
        "name": player.name,
        "colour": hexadecimal(style.colour),
        "marker": style.marker.value,
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
    game = game_of(scene.game)
    return {
        "t": "strokes",
        "strokes": [
            {
                "colour": hexadecimal(palette.mix(palette.FIELD, game.style(stroke.role).colour, 0.75)),
                "points": [_point(x, y) for x, y in stroke.points],
                "label": stroke.label,
            }
            for stroke in scene.strokes
        ],
    }


def frame(scene: Scene) -> dict[str, Any]:
    """The moving parts. The bodies and the players are in the order of the state.

    Returns:
        `time` (match time, s), `clock` (as it is written), `left` (the time that is left, in words), `rate`, `bodies`
        (x, y in m, heading in rad each), `speeds` (of the players, m/s, or None), `objects` (x, y in m each),
        `flashes` (x, y in m, word, share of the moment that is over), and `ellipses` within which bodies may be, of
        those that are not known well (number of the body, half axes in m, direction of the longer one in rad).
    """
    return {
        "t": "frame",
        "time": round(scene.time, 3),
        "clock": clock_text(scene.clock),
        "left": headline(scene).left,
        "rate": scene.rate,
        "bodies": [(round(b.pose.x, 3), round(b.pose.y, 3), round(b.pose.theta, 3)) for b in scene.bodies],
        "speeds": [None if p.speed is None or p.out_of_play else round(p.speed, 1) + 0.0 for p in scene.players],
        "objects": [_point(*thing.at) for thing in scene.objects],
        "flashes": [(*_point(*flash.at), flash.word, round(flash.share, 2)) for flash in scene.flashes],
        "ellipses": [
            (number, round(SIGMAS * a, 3), round(SIGMAS * b, 3), round(direction, 3))
            for number, body in enumerate(scene.bodies)
            if body.uncertainty is not None
            for a, b, direction in [body.uncertainty.ellipse]
        ],
    }


def parts(scene: Scene) -> dict[str, str]:
    """All parts of a scene as texts of JSON, by name, in the order in which the page needs them."""
    return {part["t"]: encode(part) for part in (ground(scene), state(scene), strokes(scene), frame(scene))}


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


def _outline(region: Region) -> list[list[float]]:
    return [_point(x, y) for x, y in region.outline()]


def _point(x: float, y: float) -> list[float]:
    return [round(x, 2), round(y, 2)]
