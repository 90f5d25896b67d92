"""The sketches of players as a part of the recorded scene, and their decoding."""

from typing import Final

from vrg.bus.messages import Sketch, Stroke
from vrg.colours import Rgb
from vrg.recording import foxglove as fg
from vrg.recording.scene import colour_of

HEIGHT: Final = 0.05
"""The height at which strokes are drawn, m above the ground, so that zones do not hide them."""
DOT: Final = 0.12
"""The diameter of a dot, m."""
WIDTH: Final = 0.04
"""The width of a line, m."""


def sketch_entity(player: str, sketch: Sketch, colour: Rgb, at: fg.Time) -> fg.SceneEntity:
    """The sketch of a player in the scene: dots are spheres, lines are lines with a dot at the end."""
    shade = colour_of(colour)
    dots, lines, texts = [], [], []
    for stroke in sketch.strokes:
        x, y = stroke.points[-1]
        if len(stroke.points) == 1:
            dots.append(fg.SpherePrimitive(fg.pose_of(x, y, 0.0, HEIGHT), fg.Vector3(DOT, DOT, DOT), shade))
        else:
            points = [fg.Vector3(x, y, HEIGHT) for x, y in stroke.points]
            lines.append(fg.LinePrimitive(0, fg.pose_of(0.0, 0.0, 0.0), WIDTH, False, points, shade))
        if stroke.label:
            place = fg.pose_of(x, y, 0.0, 4 * HEIGHT)
            texts.append(fg.TextPrimitive(place, True, 0.2, False, shade, stroke.label))
    name = f"sketch:{player}"
    return fg.SceneEntity(at, fg.FRAME_ID, name, fg.Time(0, 0), False, [], [], lines, texts, spheres=dots)


def strokes_of(entity: fg.SceneEntity) -> list[Stroke]:
    """The strokes that `sketch_entity` has drawn; a label is that of the last line or dot which ends at its place."""
    labels = {(text.pose.position.x, text.pose.position.y): text.text for text in entity.texts}
    ways = [[(ball.pose.position.x, ball.pose.position.y)] for ball in entity.spheres]
    ways += [[(point.x, point.y) for point in line.points] for line in entity.lines]
    strokes = [Stroke(points=tuple(way), label=labels.pop(way[-1], "")) for way in reversed(ways)]
    return strokes[::-1]
