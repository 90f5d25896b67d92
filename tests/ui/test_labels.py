"""The places of words beside robots and other figures."""

import itertools
import math
import random

import pygame

from vrg.figures import Figure, Label
from vrg.games import look
from vrg.games.game import ThingStyle
from vrg.types import Pose
from vrg.ui.labels import Placer, Wanted, line_to, nearest, overlap
from vrg.ui.picture import numbers
from vrg.ui.scene import Scene, SceneBody
from vrg.ui.view import Projection
from vrg.ui.window.easel import FigurePainter
from vrg.ui.window.text import Fonts

AREA = (0.0, 0.0, 700.0, 700.0)
RADIUS = 14.0
SIZE = (62.0, 17.0)
VIEW = Projection(0.0, 0.0, 0.0, 700.0, 1.0, turned=False)
"""A pixel is a metre, and y points up."""


def crowd(count, seed, apart=3 * RADIUS):
    """The circles of robots that do not touch each other, in the middle of the area."""
    rng, places = random.Random(seed), []
    while len(places) < count:
        place = (rng.uniform(150, 550), rng.uniform(150, 550))
        if all(math.dist(place, other) > apart for other in places):
            places.append(place)
    return [(place, RADIUS) for place in places]


def placed(circles, placer=None):
    """The boxes of the names of robots."""
    wanted = [Wanted(f"player{number}", SIZE, circle) for number, circle in enumerate(circles)]
    return (placer or Placer()).place(wanted, AREA)


def gap(box, circle):
    """The distance of a box from a robot's edge."""
    return math.dist(nearest(box, circle[0]), circle[0]) - circle[1]


def test_words_cover_nothing():
    wrong = []
    for count, seed in itertools.product((2, 7, 16, 24), range(10)):
        circles = crowd(count, seed)
        boxes = placed(circles)
        for index, box in enumerate(boxes):
            free = all(gap(box, circle) > 0 for circle in circles)
            inside = AREA[0] <= box[0] and AREA[1] <= box[1] and box[2] <= AREA[2] and box[3] <= AREA[3]
            if not inside or not free or any(overlap(box, other) for other in boxes[:index]):
                wrong.append(f"{count} robots, seed {seed}: {index} at {box}")
    assert not wrong, "\n".join(wrong)


def test_words_beside_another_robot_are_led_to_their_own():
    for seed in range(10):
        circles = crowd(24, seed)
        for index, (box, circle) in enumerate(zip(placed(circles), circles, strict=True)):
            others = [other for i, other in enumerate(circles) if i != index]
            clear = gap(box, circle) + 3.5 <= min(gap(box, other) for other in others)
            assert clear or line_to(box, circle) is not None, f"seed {seed}: {index}"


def test_a_line_leads_from_the_edge_of_a_robot_to_its_words():
    start, end = line_to((100.0, 40.0, 160.0, 57.0), ((20.0, 45.0), RADIUS)) or ((), ())
    assert (start, end) == ((34.0, 45.0), (100.0, 45.0))
    assert line_to((40.0, 40.0, 100.0, 57.0), ((20.0, 45.0), RADIUS)) is None


def test_words_stay_where_they_are_while_that_is_free():
    placer, alone = Placer(), [((300.0, 300.0), RADIUS)]
    [below] = placed(alone, placer)
    [above, _] = placed([*alone, ((300.0, 345.0), RADIUS)], placer)
    [later] = placed(alone, placer)
    assert below[1] > 300 > above[3]
    assert later == above


def test_what_is_taken_and_other_words_are_not_covered():
    circle, sign = ((300.0, 300.0), 0.0), (250.0, 300.0, 350.0, 330.0)
    both = [Wanted("a", SIZE, circle), Wanted("b", SIZE, circle)]
    boxes = [*Placer().place(both, AREA, [sign]), sign]
    assert not any(overlap(a, b) for a, b in itertools.combinations(boxes, 2))


def test_the_number_of_a_measured_way_hides_no_robot_where_there_is_room():
    area, number = (0.0, 0.0, 600.0, 400.0), Wanted("0.3 m", SIZE, ((315.0, 185.0), 4.0))
    robots = [(260.0, 170.0, 320.0, 230.0), (310.0, 140.0, 370.0, 200.0)]
    [box] = Placer().place([number], area, robots)
    assert not any(overlap(box, robot) for robot in robots)
    assert gap(box, number.about) < 100, "it is near what it measures"
    [box] = Placer().place([number], area, [area])
    assert gap(box, number.about) < 100, "it is shown also without room"


def figures(places, short=""):
    """Robots with names."""
    found = []
    for i, (x, y) in enumerate(places):
        label = Label(f"player{i}", (255, 255, 255), short and f"{i}", reach=10.0)
        found.append(Figure(f"p{i}", at=Pose(x, 700.0 - y, 0.0), label=label))
    return found


def labelled(painter, *args):
    """The plates of figures in a picture."""
    return painter.label(pygame.Surface((700, 700)), pygame.Rect(0, 0, 700, 700), figures(*args), VIEW, 1.0)


def test_no_name_lies_on_a_flag():
    painter, area = FigurePainter(Fonts()), pygame.Rect(0, 0, 700, 700)
    robot, flag = (
        figures([(300.0, 300.0)]),
        look.thing("flag", Pose(290.0, 700.0 - 325.0, 0.0), ThingStyle((255, 0, 0))),
    )
    [alone] = painter.label(pygame.Surface(area.size), area, robot, VIEW, 1.0)
    [beside] = painter.label(pygame.Surface(area.size), area, [*robot, flag], VIEW, 1.0)
    drawn = pygame.Rect(290, 325 - round(look.SMALLEST), round(0.75 * look.SMALLEST), round(look.SMALLEST))
    assert alone.colliderect(drawn)
    assert not beside.colliderect(drawn)


def test_a_robot_outside_the_picture_has_no_name():
    assert labelled(FigurePainter(Fonts()), [(-100.0, 300.0)]) == []


def test_names_are_shortened_in_a_crowd_only():
    painter = FigurePainter(Fonts())
    row = [(40.0 + 30.0 * i, 350.0) for i in range(20)]
    apart = [(40.0 + 120 * (i % 5), 60.0 + 120 * (i // 5)) for i in range(20)]
    assert max(plate.width for plate in labelled(painter, row, "number")) < 40
    assert min(plate.width for plate in labelled(painter, apart, "number")) > 50
    assert min(plate.width for plate in labelled(painter, row)) > 50, "where nothing stands for them"


def test_names_that_differ_by_a_number_have_it_for_a_crowd():
    def short(*names):
        here = Pose(0.0, 0.0, 0.0)
        return numbers(Scene(bodies=tuple(SceneBody(n, here, 0.5, 0.4, "", "", False, ()) for n in names)))

    assert short("player1", "player12") == ["1", "12"]
    assert short("shark1", "minnow2") == ["", ""]
    assert short("player", "player2") == ["", ""]
    assert short("1", "2") == ["", ""]
