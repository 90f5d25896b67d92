"""What players sketch is shown in the window and in the plot."""

from dataclasses import replace

import matplotlib.image
import numpy as np
import pygame
import pytest

from vrg.bus import messages as m
from vrg.colours import VERMILLION
from vrg.games.game import Moment
from vrg.recording.reader import RecordedCall, Thought
from vrg.testing.views import synthetic
from vrg.ui import picture, view
from vrg.ui.builder import SceneBuilder
from vrg.ui.plots import plot
from vrg.ui.plots.thoughts import Thoughts
from vrg.ui.scene import SceneStroke
from vrg.ui.window.draw import Painter
from vrg.ui.window.window import save_png


def test_a_sketch_is_shown_in_the_colour_of_its_players_role_while_it_plays():
    builder = SceneBuilder()
    builder.clock(m.Clock(time=1.0, tick=10, epoch=0, rate=1.0, estop=False))
    builder.sketch("bruce", m.Sketch(strokes=(m.Stroke(points=((1.0, 2.0),), label="x"),)))
    builder.sketch("somebody else", m.Sketch(strokes=(m.Stroke(points=((3.0, 3.0),)),)))
    builder.referee(synthetic.state(1.0))
    assert builder.build(True).strokes == (SceneStroke("bruce", "shark", ((1.0, 2.0),), "x"),)
    builder.sketch("bruce", m.Sketch(strokes=()))
    assert builder.build(True).strokes == ()


def test_where_bodies_began_is_in_sight_also_outside_the_zones(scene_at):
    scene = scene_at(1.0)
    assert set(scene.starts) == {(b.pose.x, b.pose.y) for b in scene_at(0.0).bodies}
    x_min, *_ = view.extent(replace(scene, starts=((-50.0, 0.0),)))
    assert x_min == pytest.approx(-50.0 - view.BODY - view.MARGIN)


def test_a_stroke_is_drawn_where_it_is(scene_at, tmp_path):
    scene = scene_at(1.0)
    x_min, y_min, x_max, y_max = view.extent(scene)
    at = ((x_min + x_max) / 2 + 1.3, (y_min + y_max) / 2)
    stroke = SceneStroke("", "shark", (at,))
    for name, strokes in (("plain", ()), ("dot", (stroke,))):
        surface = pygame.Surface((1280, 800))
        where = Painter(plans=True).draw(surface, replace(scene, strokes=strokes))
        save_png(surface, tmp_path / f"{name}.png")
    plain, dot = (matplotlib.image.imread(tmp_path / f"{name}.png")[..., :3] for name in ("plain", "dot"))
    rows, columns = np.nonzero(np.abs(plain - dot).max(axis=2) > 0.05)
    x, y = where.point(*at)
    assert rows.size
    assert np.hypot(columns - x, rows - y).max() < 8, "a dot and nothing else"
    red, green, blue = dot[round(y), round(x)]
    assert red > green > blue, f"the shark's colour is {VERMILLION}"


def test_of_many_strokes_a_few_have_words_and_those_with_names_come_first(scene_at):
    points = ((1.0, 1.0), (2.0, 2.0))
    every = [SceneStroke(name, "shark", points, f"{number}") for name in ("ann", "bob") for number in range(50)]
    figures = picture.strokes(replace(scene_at(0.0), strokes=tuple(every)))
    words = [figure.label.words for figure in figures if figure.label is not None]
    assert len(words) == picture.MOST_LABELS
    assert {"ann 49", "bob 49"} <= set(words)
    assert len([figure for figure in figures if figure.shapes[0].closed]) == 100, "all have their dots"


@pytest.fixture
def axes():
    _figure, [axes], metre = plot._figure(1, (0.0, 0.0, 10.0, 10.0))
    return axes, plot.Labels(metre, (0.0, 0.0, 10.0, 10.0))


CALL = RecordedCall(
    number=1, rule="dispatch", text="", players=("ann",), poses=(), clock=1.0, time=5.0, round=1,
)  # fmt: skip


def test_what_the_first_player_of_a_call_expected_is_in_the_plot(axes):
    panel, labels = axes
    early = Thought("ann", 4.0, [m.Stroke(points=((1.0, 1.0), (2.0, 2.0)), label="too early")])
    plain = Thought("ann", 5.1, [m.Stroke(points=((1.0, 1.0), (3.0, 3.0)))])
    said = Thought("ann", 5.6, [m.Stroke(points=((1.0, 1.0), (4.0, 4.0)), label="meets in 2.0 s")])
    other = Thought("bob", 5.0, [m.Stroke(points=((9.0, 9.0), (8.0, 8.0)), label="bob")])
    thoughts = Thoughts({}, [early, other, plain, said])
    thoughts.draw_at(panel, CALL, Moment("*", "dispatched", thought=True), {"ann": (1.0, 0.0, 0.0)}, labels)
    assert "meets in 2.0 s" in [text.get_text() for text in panel.texts]
    assert {"too early", "bob"}.isdisjoint(text.get_text() for text in panel.texts)


def test_a_moment_that_does_not_ask_for_it_shows_no_thought(axes):
    panel, labels = axes
    thoughts = Thoughts({}, [Thought("ann", 5.1, [m.Stroke(points=((1.0, 1.0),), label="x")])])
    thoughts.draw_at(panel, CALL, Moment("X", "tag"), {"ann": (1.0, 0.0, 0.0)}, labels)
    assert not panel.texts


def test_sightings_of_the_round_are_dots_in_the_colour_of_their_player(axes):
    panel, _ = axes
    seen = [m.Sighting(x=t, y=1.0, time=t, xx=1.0, xy=0.0, yy=1.0) for t in (1.0, 2.0, 9.0)]
    Thoughts({"ann": seen}).draw_sightings(panel, {"ann": (1.0, 0.0, 0.0)}, 0.5, 3.0)
    [line] = panel.lines
    assert list(line.get_xdata()) == [1.0, 2.0]


def test_the_legend_explains_only_what_is_there():
    moments = [Moment("*", "dispatched", thought=True)]
    assert list(Thoughts().legend(moments)) == []
    seen = {"ann": [m.Sighting(x=0.0, y=0.0, time=0.0, xx=1.0, xy=0.0, yy=1.0)]}
    assert [str(line.get_label()) for line in Thoughts(seen).legend(moments)] == ["sighting, by its player"]
