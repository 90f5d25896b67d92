"""The names beside the robots."""

import itertools
import math
import random

import pygame

from vrg.ui import palette
from vrg.ui.nametags import NamePainter, numbers
from vrg.ui.text import Fonts

AREA = pygame.Rect(0, 0, 700, 700)
RADIUS = 14.0


def crowd(count, seed, apart=3 * RADIUS):
    """Robots that do not touch each other, in the middle of the area."""
    rng, places = random.Random(seed), []
    while len(places) < count:
        place = (rng.uniform(150, 550), rng.uniform(150, 550))
        if all(math.dist(place, other) > apart for other in places):
            places.append(place)
    return [(f"player{i + 1}", palette.TEXT, (place, RADIUS)) for i, place in enumerate(places)]


def gap(plate, centre):
    """The distance of a plate from a robot's edge."""
    x = min(max(centre[0], plate.left), plate.right)
    y = min(max(centre[1], plate.top), plate.bottom)
    return math.dist((x, y), centre) - RADIUS


def test_names_cover_nothing():
    wrong = []
    for count, seed in itertools.product((2, 7, 16, 24), range(10)):
        robots = crowd(count, seed)
        plates = NamePainter(Fonts()).draw(pygame.Surface(AREA.size), AREA, robots, 1.0)
        assert len(plates) == count, f"{count} robots, seed {seed}"
        for index, plate in enumerate(plates):
            free = all(gap(plate, circle[0]) > 0 for _, _, circle in robots)
            if not (AREA.contains(plate) and free and plate.collidelist(plates[:index]) == -1):
                wrong.append(f"{count} robots, seed {seed}: {robots[index][0]} at {plate}")
    assert not wrong, "\n".join(wrong)


def test_a_name_beside_another_robot_is_led_to_its_own():
    without_line = []
    for seed in range(10):
        robots = crowd(24, seed)
        plates = NamePainter(Fonts()).draw(surface := pygame.Surface(AREA.size), AREA, robots, 1.0)
        for index, (plate, (name, _, (centre, _))) in enumerate(zip(plates, robots, strict=True)):
            others = [circle[0] for i, (_, _, circle) in enumerate(robots) if i != index]
            clear = gap(plate, centre) + 3.5 <= min(gap(plate, other) for other in others)
            on_edge = (min(max(centre[0], plate.left), plate.right), min(max(centre[1], plate.top), plate.bottom))
            middle = [round((a + b) / 2) for a, b in zip(centre, on_edge, strict=True)]
            around = [surface.get_at((middle[0] + dx, middle[1] + dy)) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
            if not clear and all(tuple(colour)[:3] == (0, 0, 0) for colour in around):
                without_line.append(f"seed {seed}: {name}")
    assert not without_line, "\n".join(without_line)


def test_a_name_stays_where_it_is_while_that_is_free():
    painter, surface = NamePainter(Fonts()), pygame.Surface(AREA.size)
    shark = ("shark", palette.TEXT, ((300.0, 345.0), RADIUS))
    alone = [("nemo", palette.TEXT, ((300.0, 300.0), RADIUS))]
    [below] = painter.draw(surface, AREA, alone, 1.0)
    [above, _] = painter.draw(surface, AREA, [*alone, shark], 1.0)
    [later] = painter.draw(surface, AREA, alone, 1.0)
    assert below.top > 300 > above.bottom
    assert later == above


def test_a_robot_outside_the_picture_has_no_name():
    far = [("nemo", palette.TEXT, ((-100.0, 300.0), RADIUS))]
    assert NamePainter(Fonts()).draw(pygame.Surface(AREA.size), AREA, far, 1.0) == []


def test_names_that_differ_by_a_number_are_shortened_in_a_crowd_only():
    assert numbers(["player1", "player12"]) == ["1", "12"]
    assert numbers(["shark1", "minnow2"]) is None
    assert numbers(["player", "player2"]) is None
    assert numbers(["1", "2"]) is None
    assert numbers(["nemo", "dory"]) is None
    painter, surface = NamePainter(Fonts()), pygame.Surface(AREA.size)
    row = [(f"player{i}", palette.TEXT, ((40.0 + 30.0 * i, 350.0), 10.0)) for i in range(20)]
    apart = [
        (name, colour, ((40.0 + 120 * (i % 5), 60.0 + 120 * (i // 5)), 10.0)) for i, (name, colour, _) in enumerate(row)
    ]
    crowded = painter.draw(surface, AREA, row, 1.0)
    assert max(plate.width for plate in crowded) < 40
    assert min(plate.width for plate in painter.draw(surface, AREA, apart, 1.0)) > 50
