"""Maps: those that come with VRG, and what is said of one that cannot be read."""

from pathlib import Path

import pytest

from vrg.errors import ConfigError
from vrg.hal.models import robot_model
from vrg.hal.sim.map import load_map
from vrg.hal.sim.maps import MAPS
from vrg.types import Pose

P2AT = robot_model("P2AT")


def test_the_maps_that_come_with_vrg_load() -> None:
    assert {"courtyard", "marhes_lab", "open"} <= set(MAPS.names())
    for name in MAPS.names():
        assert load_map(name).boxes or load_map(name).circles or name == "open"


TABLE_4_1 = [(-7, -20), (3, -22), (-3, -26), (-7.5, -16), (-1.3, -28.4)]
TABLE_4_2 = [(21, -30)] + [(x, y) for x in range(17, 25) for y in (-16, -15)]


def test_the_courtyard_is_walled_and_has_room_at_the_places_of_the_thesis() -> None:
    yard = load_map("courtyard")
    poses = [Pose(x, y, heading) for x, y in TABLE_4_1 + TABLE_4_2 for heading in (0.0, 0.8, 1.6)]
    wrong = [str(pose) for pose in poses if not yard.footprint_clear(pose, 1.2, 1.2)]
    assert not wrong, "\n".join(wrong)
    assert yard.footprint_clear(Pose(21.0, -22.5, 0.0), 10.0, 19.0), "the field of Sharks & Minnows"
    x_min, y_min, x_max, y_max = yard.bounds.bounds
    for x, y in ((x_min, -20.0), (x_max, -20.0), (5.0, y_min), (5.0, y_max)):
        assert not yard.footprint_clear(Pose(x, y, 0.0), P2AT.length, P2AT.width)
    assert not load_map("open").footprint_clear(Pose(200.0, 0.0, 0.0), 0.5, 0.5), "outside the bounds"


def test_a_map_may_be_a_file_of_the_users(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(
        'name = "mine"\nbounds = { x_min = 0, y_min = 0, x_max = 9, y_max = 9 }\n'
        "[[wall]]\npoints = [[0, 0], [9, 0], [9, 9]]\nthickness = 0.2\n"
        "[[box]]\nx = 4\ny = 4\nlength = 2\nwidth = 1\nheading = 90\n"
        "[[circle]]\nx = 7\ny = 2\nradius = 0.5\n"
    )
    map_ = load_map(file)
    assert len(map_.boxes) == 3
    assert map_.edges.shape == (12, 4)
    assert map_.discs.tolist() == [[7.0, 2.0, 0.5]]
    assert not map_.footprint_clear(Pose(4.0, 4.9, 0.0), 0.2, 0.2), "its heading is in degrees"
    assert map_.footprint_clear(Pose(4.9, 4.0, 0.0), 0.2, 0.2)
    assert not map_.footprint_clear(Pose(7.0, 2.55, 0.0), 0.2, 0.2)


def test_all_errors_of_a_file_are_told_at_once(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(
        'name = "bad"\nbounds = { x_min = 5, y_min = 0, x_max = 1, y_max = 9 }\ncolour = "red"\n'
        "[[circle]]\nx = nan\ny = 1\nradius = -1\n"
        "[[wall]]\npoints = [[0, 0], [0, 0]]\nthickness = 0.1\n"
    )
    with pytest.raises(ConfigError) as caught:
        load_map(file)
    text = str(caught.value)
    for word in ("bounds", "colour", "circle.1.x", "circle.1.radius", "wall.1", str(file)):
        assert word in text
    assert len(caught.value.problems) == 5


def test_what_is_no_map_is_refused(tmp_path: Path) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text("name = \n")
    for wanted, words in (
        ("courtyrad", "did you mean 'courtyard'"),
        ("/nowhere/at/all.toml", "cannot read"),
        (broken, r"broken.toml:1: not TOML"),
    ):
        with pytest.raises(ConfigError, match=words):
            load_map(wanted)


def test_the_bounds_of_a_map_may_be_any_region(tmp_path: Path) -> None:
    file = tmp_path / "round.toml"
    file.write_text('name = "round"\nbounds = { shape = "circle", x = 0.0, y = 0.0, radius = 3.0 }\n')
    arena = load_map(file)
    assert arena.footprint_clear(Pose(2.0, 0.0, 0.0), 0.5, 0.5)
    assert not arena.footprint_clear(Pose(2.2, 2.2, 0.0), 0.5, 0.5), "in the corner of the square around it"
