"""The picture of a scene: all that lies on the field, as figures from the ground upwards."""

from collections.abc import Sequence
from typing import Final

from vrg.bus.messages import Stage
from vrg.colours import DARK, Theme
from vrg.figures import Figure, Label, Shape, to_millimetres
from vrg.games import game_of, look
from vrg.games.game import Game
from vrg.geometry import ellipse
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.scene import Scene, SceneBody, SceneObject

MOST_LABELS: Final = 24
"""The most words beside strokes: to find places for more of them takes long, and nobody reads them."""
LINING_UP: Final = (Stage.INITIALIZE, Stage.ROUND_OVER)
"""The stages in which players drive to their marks."""


def ground(scene: Scene) -> list[Figure]:
    """What stands still: it changes when the zones do."""
    return look.ground(game_of(scene.game), scene.zones, scene.obstacles)


def moving(
    scene: Scene, driving: str | None = None, below: Sequence[Figure] = (), above: Sequence[Figure] = ()
) -> list[Figure]:
    """What moves.

    Args:
        driving: the player with a ring. below, above: lie below the robots, and above everything.
    """
    game, short = game_of(scene.game), dict(zip((b.name for b in scene.bodies), numbers(scene), strict=True))
    found = marks(scene)
    for body in scene.bodies:
        way = (*body.trail, (body.pose.x, body.pose.y))
        found.append(Figure(f"trail {body.name}", (look.trail(game.style(body.role, body.state).colour, way),)))
    found += [*strokes(scene), *below]
    found += [figure for body in scene.bodies for figure in around(body)]
    # What is out of play lies under what plays, and what is on the ground under what flies.
    for body in sorted(scene.bodies, key=lambda body: (body.pose.z, not body.out_of_play)):
        found.append(robot(scene, body, short[body.name], driving))
        if body.name == driving:
            found.append(look.around(body.name, body.pose, (body.length, body.width)))
    found += [thing(game, o) for o in scene.objects]
    return [*found, *flashes(scene), *above]


def thing(game: Game, thing: SceneObject, theme: Theme = DARK) -> Figure:
    """A thing of the game where it is."""
    style = game.thing_style(thing.kind, thing.team)
    at = Pose(*thing.at, thing.heading)
    return look.thing(thing.name, at, style, theme, radius=thing.radius, corners=thing.corners, lost=thing.lost)


def marks(scene: Scene) -> list[Figure]:
    """Where players line up, while they do."""
    game, lining_up = game_of(scene.game), scene.stage in LINING_UP
    return [
        look.mark(player.name, player.mark, game.style(player.role, player.state).colour)
        for player in scene.players
        if lining_up and player.mark is not None
    ]


def strokes(scene: Scene) -> list[Figure]:
    """What players want to be shown. The name of a player stands beside the last thing that it has sketched."""
    last = {stroke.player: number for number, stroke in enumerate(scene.strokes)}
    labelled = {*last.values(), *(number for number, stroke in enumerate(scene.strokes) if stroke.label)}
    # A name is worth more than what a player writes, of which it may write a lot.
    labelled = set(sorted(labelled, key=lambda number: number not in last.values())[:MOST_LABELS])
    found = []
    for number, stroke in enumerate(scene.strokes):
        named = stroke.player if last[stroke.player] == number else ""
        words = " ".join(word for word in (named, stroke.label) if word and number in labelled)
        colour = game_of(scene.game).style(stroke.role).colour
        found += look.stroke(f"stroke {number}", stroke.points, words, colour)
    return found


def around(body: SceneBody) -> list[Figure]:
    """What lies around a body, and does not turn with it: the ellipse within which one may be that is not known well,
    and the shadow of one in the air."""
    found = []
    if body.uncertainty is not None:
        outline = Shape(to_millimetres(ellipse(0.0, 0.0, body.uncertainty)), line=palette.CAUTION, width=1.5)
        found.append(Figure(f"about {body.name}", (outline,), Pose(body.pose.x, body.pose.y, 0.0)))
    if body.pose.z > 0.0:
        found.append(look.shadow(body.name, body.pose, (body.length, body.width)))
    return found


def robot(scene: Scene, body: SceneBody, short: str, driving: str | None = None) -> Figure:
    """A robot with its name.

    Args:
        short: what stands for its name in a crowd. driving: the player that a person drives.
    """
    game, size = game_of(scene.game), (body.length, body.width)
    ink = palette.CAUTION if body.name == driving else palette.MUTED if body.out_of_play else palette.TEXT
    remark = game.remark(body.state)
    if body.pose.z > 0.0:
        remark = f"{remark} {body.pose.z:.1f} m".lstrip()
    label = Label(body.name, ink, short=short, remark=remark, plate=palette.BACKGROUND, reach=look.reach(size))
    style = game.style(body.role, body.state)
    return look.robot(body.name, body.pose, style, size, physical=body.physical, label=label)


def flashes(scene: Scene) -> list[Figure]:
    """What the referee has just called."""
    return [look.flash(number, flash.at, flash.word, flash.share) for number, flash in enumerate(scene.flashes)]


def numbers(scene: Scene) -> list[str]:
    """The numbers at the ends of names that are otherwise the same, and nothing where they are not."""
    names = [body.name for body in scene.bodies]
    stems = {name.rstrip("0123456789") for name in names}
    [stem] = stems if len(stems) == 1 else [""]
    found = [name.removeprefix(stem) for name in names]
    return found if stem and all(found) else [""] * len(names)
