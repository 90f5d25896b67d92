"""A match as solids and arrays: what is drawn is where it is, as large as it is, and seen from outside."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vrg.bus import messages as m
from vrg.colours import ORANGE, PURPLE, RED, mix
from vrg.figures import rounded
from vrg.games import GAMES, game_of, look
from vrg.games.game import Game, Marker, Role
from vrg.hal.models import robot_model
from vrg.hal.sensors.depiction import Rays
from vrg.regions import Rectangle
from vrg.testing.omni import OMNI
from vrg.testing.views import synthetic
from vrg.testing.views.synthetic import scene_at
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.scene import Scene, SceneBody, SceneObject
from vrg_views.three import camera
from vrg_views.three.board import board, last_call
from vrg_views.three.ground import LIT, TURF, extent, ground
from vrg_views.three.robots import marker_mesh, robot_look
from vrg_views.three.shapes import band, circle, prism, sheet, star
from vrg_views.three.stage import _LIFT, Batch, BatchMaker, fan, trails

P2AT = robot_model("P2AT")
CRAZYFLIE = robot_model("Crazyflie")
ORIGIN = Pose(0.0, 0.0, 0.0)
MODELS = (P2AT, robot_model("ATRV-Jr"), OMNI)


def volume(mesh) -> float:
    """What a closed skin holds, m^3; below 0 if it is inside out."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    return float(np.sum(a * np.cross(b, c))) / 6.0


def area(mesh) -> float:
    """How much ground a flat mesh covers as seen from above, m^2."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    return float(np.sum(np.cross(b - a, c - a)[:, 2])) / 2.0


def batches(stage: BatchMaker, scene: Scene) -> dict[str, Batch]:
    return {batch.name: batch for batch in stage.batches(scene)}


def body(pose: Pose = ORIGIN, **changes) -> SceneBody:
    return replace(SceneBody("nemo", pose, 0.5, 0.49, "minnow", "active", False, ()), **changes)


def test_a_solid_holds_what_its_measures_say() -> None:
    assert volume(prism([(0, 0), (2, 0), (2, 1), (0, 1)], 0.0, 3.0)) == pytest.approx(6.0)
    assert volume(prism(star(1.0, 0.5, 5), 0.0, 1.0)) > 0.0
    assert area(sheet(rounded(2.0, 1.0, 0.2), 0.0)) == pytest.approx(2.0 - (4 - math.pi) * 0.04, abs=0.01)
    ring = math.pi * (1.0 - 0.9**2)
    assert area(band(circle(1.0, 200), 0.1, 0.0)) == pytest.approx(ring, rel=0.01)
    assert area(band(circle(0.9, 200), -0.1, 0.0)) == pytest.approx(ring, rel=0.01)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_a_robot_is_as_large_as_its_model_and_stands_on_its_wheels(model) -> None:
    look = robot_look(model)
    for part in (look.paint, look.dark, look.light, look.tyre, look.hub):
        assert volume(part) > 0.0
    low, high = look.paint.vertices.min(axis=0), look.paint.vertices.max(axis=0)
    assert high[:2] - low[:2] == pytest.approx(model.size, abs=1e-3)
    assert 0.0 < low[2] < model.drivetrain.wheel_radius
    assert model.height < high[2] < 1.5 * model.height
    assert look.tyre.vertices[:, 2].max() == pytest.approx(model.drivetrain.wheel_radius, rel=0.01)


def test_a_robot_with_rotors_is_as_large_as_its_model_and_its_shade_lies_on_the_ground() -> None:
    look = robot_look(CRAZYFLIE)
    for part in (look.paint, look.dark, look.light):
        assert volume(part) > 0.0
    low, high = look.paint.vertices.min(axis=0), look.paint.vertices.max(axis=0)
    assert high[:2] - low[:2] == pytest.approx(CRAZYFLIE.size, abs=2e-3)
    assert (low[2], high[2]) == pytest.approx((0.0, CRAZYFLIE.height))
    found = batches(BatchMaker({"nemo": CRAZYFLIE}, P2AT), Scene(bodies=(body(pose=Pose(1.0, 2.0, 0.0, 0.8)),)))
    assert found["robots/Crazyflie/paint"].places[0] == pytest.approx((1.0, 2.0, 0.8))
    assert "robots/Crazyflie/tyres" not in found
    assert found["shades"].places[0, 2] == pytest.approx(found["rings"].places[0, 2], abs=0.05)
    assert 0.0 < found["shades"].places[0, 2] < 0.1


@pytest.mark.parametrize("marker", Marker)
def test_a_marker_lies_upright(marker) -> None:
    assert volume(marker_mesh(marker)) > 0.0


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_wheels_turn_by_the_way_of_the_robot(model) -> None:
    stage, name = BatchMaker({"nemo": model}, P2AT), f"robots/{model.name}/tyres"
    turn = 2 * math.pi * model.drivetrain.wheel_radius
    shown = []
    for step in range(9):
        scene = Scene(bodies=(body(pose=Pose(turn * step / 8, 0.0, 0.0)),))
        shown.append(batches(stage, scene)[name].turns.copy())
    driven = [n for n, wheel in enumerate(model.drivetrain.wheels) if abs(math.cos(wheel.heading)) > 0.99]
    for wheel in driven:
        assert abs(shown[0][wheel] @ shown[4][wheel]) == pytest.approx(0.0, abs=1e-3)
        assert abs(shown[0][wheel] @ shown[8][wheel]) == pytest.approx(1.0, abs=1e-3)
    assert len(shown[0]) == len(model.drivetrain.wheels)


@pytest.fixture
def stage() -> BatchMaker:
    """A stage on which all robots are Pioneers."""
    return BatchMaker({}, P2AT)


def test_wheels_do_not_turn_when_a_robot_is_placed_elsewhere(stage: BatchMaker) -> None:
    before = batches(stage, Scene(bodies=(body(),)))["robots/P2AT/tyres"].turns
    after = batches(stage, Scene(bodies=(body(pose=Pose(5.3, 0.0, 0.0)),)))["robots/P2AT/tyres"].turns
    assert after == pytest.approx(before)


def test_each_robot_has_its_place_its_colour_and_the_sign_of_its_role() -> None:
    scene = scene_at(4.0)
    shown = batches(BatchMaker({"bruce": robot_model("ATRV-Jr")}, P2AT), scene)
    own = shown["robots/ATRV-Jr/paint"]
    bruce = next(body for body in scene.bodies if body.name == "bruce")
    assert own.robots == ("bruce",)
    assert own.places[0] == pytest.approx((bruce.pose.x, bruce.pose.y, 0.0), abs=1e-5)
    assert tuple(own.colours[0]) == (213, 94, 0)
    assert len(shown["robots/P2AT/paint"].places) == len(scene.bodies) - 1
    names = [body.name for body in scene.bodies]
    sharks = shown["signs/triangle"].scales[:, 0] > 0.0
    assert {name for name, worn in zip(names, sharks, strict=True) if worn} == set(synthetic.SHARKS)
    physical = [body.physical for body in scene.bodies]
    assert [tuple(rim) == palette.TEXT for rim in shown["rings"].colours] == physical


def test_a_call_blinks_where_it_happened_and_then_the_robot_is_dull(stage: BatchMaker) -> None:
    scenes = [scene_at(synthetic.TAGGED_AT + late) for late in (0.0, 0.2, 0.4, 3.0)]
    gill = [body.name for body in scenes[0].bodies].index("gill")
    colours = [tuple(batches(stage, scene)["robots/P2AT/paint"].colours[gill]) for scene in scenes]
    assert palette.TEXT in colours[:3]
    assert colours[3] != palette.TEXT
    assert max(colours[3]) < max(palette.MUTED)
    grown = [batches(stage, scene)["flashes"].scales[0, 0] for scene in scenes]
    assert 0.0 < grown[0] < grown[1] < grown[2]
    assert grown[3] == 0.0


def test_a_flag_stands_in_its_place_or_rides_on_its_carrier() -> None:
    flags = (
        SceneObject("red flag", "flag", "red", (1.0, 2.0)),
        SceneObject("blue flag", "flag", "blue", (3.0, 4.0), carrier="nemo"),
    )
    scene = Scene(game="roboflag", bodies=(body(pose=Pose(3.0, 4.0, 0.5)),), objects=flags)
    shown = batches(BatchMaker({}, P2AT), scene)["flags/cloths"]
    assert shown.places[0] == pytest.approx((1.0, 2.0, 0.0))
    assert shown.places[1, 2] > 0.1
    assert [tuple(colour) for colour in shown.colours] == [RED, (0, 114, 178)]


def test_trails_lead_to_the_robots_and_fade() -> None:
    scene = scene_at(5.0)
    lines = trails(scene)
    ends = {tuple(np.round(b.trail[-1], 3)) for b in scene.bodies if len(b.trail) > 1}
    assert ends <= {tuple(np.round(point[:2].astype(float), 3)) for point in lines.points[:, 1]}
    assert lines.points.shape == lines.colours.shape
    assert len(trails(Scene()).points) == 0
    [[foot, top]] = trails(Scene(bodies=(body(pose=Pose(1.0, 2.0, 0.0, 0.8)),))).points
    assert (foot[0], foot[1], *top) == pytest.approx((1.0, 2.0, 1.0, 2.0, 0.8))


def test_a_scan_covers_the_ground_that_it_has_found_free() -> None:
    rays = Rays(Pose(0.0, 0.0, 0.0), -math.pi / 2, math.pi / 180, [2.0] * 181, 8.0)
    assert area(fan(Pose(5.0, 5.0, 1.0), rays)) == pytest.approx(2.0 * math.pi, rel=0.01)


@pytest.mark.parametrize("zones", [synthetic.zones(), synthetic.four_shapes(), ()], ids=["two", "shapes", "none"])
def test_the_ground_shows_every_zone_and_every_wall_from_above(zones) -> None:
    scene = scene_at(1.0, zones=zones)
    solids = ground(scene)
    shown = {solid.colour for solid in solids}
    for figure in look.ground(game_of(scene.game), zones, scene.obstacles, LIT):
        for shape in figure.shapes:
            assert {shape.fill, shape.line} - {None} <= shown, figure.name
    assert LIT.grid in shown, "lines give a feeling for lengths"
    assert sum(volume(solid.mesh) for solid in solids if solid.casts) > 0.0
    flat = [solid for solid in solids if not solid.casts]
    assert all(area(solid.mesh) > 0.0 for solid in flat)
    assert max(solid.mesh.vertices[:, 2].max() for solid in flat) < _LIFT


@pytest.mark.parametrize(("length", "width"), [(10.0, 19.0), (30.0, 8.0), (6.0, 6.0)])
@pytest.mark.parametrize("shape", [16 / 9, 390 / 844], ids=["projector", "telephone"])
def test_the_first_views_show_the_whole_field(length: float, width: float, shape: float) -> None:
    place = replace(extent(Scene()), x=3.0, y=-4.0, length=length, width=width)
    for shot in (camera.overview(place, shape), camera.above(place, shape)):
        eye, target = np.array(shot.eye), np.array(shot.target)
        ahead = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        half = math.tan(camera.FIELD_OF_VIEW / 2)
        for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            way = np.array((3.0 + x * length / 2, -4.0 + y * width / 2, 0.0)) - eye
            deep = way @ ahead
            assert deep > 0.0
            assert abs(way @ right) / deep < half * shape
            assert abs(way @ np.cross(right, ahead)) / deep < half


def test_a_camera_follows_smoothly_and_jumps_after_what_is_placed() -> None:
    near = camera.behind(Pose(1.0, 0.0, 0.0), 0.5)
    before = camera.behind(Pose(0.0, 0.0, 0.0), 0.5)
    shot = before
    for _ in range(60):
        shot = camera.eased(shot, near, 1 / 30)
    assert shot.eye == pytest.approx(near.eye, abs=0.01)
    assert before.eye[0] < camera.eased(before, near, 1 / 30).eye[0] < near.eye[0]
    far = camera.behind(Pose(90.0, 0.0, 0.0), 0.5)
    assert camera.eased(before, far, 1 / 30) == far


def test_the_headline_tells_score_and_clock_and_what_must_not_be_overlooked() -> None:
    scene = scene_at(10.0)
    assert "<b>1</b><div><span>Sharks</span><i>minnow caught</i>" in board(scene)
    assert "<b>0:10</b>" in board(scene)
    assert "Minnows cross to the safe zone" in board(scene)
    assert "HALT" in board(replace(scene, halted="by ann"))
    assert "Bruce tagged gill" in last_call(scene)
    assert last_call(Scene()) == ""


def test_names_in_the_headline_are_no_html() -> None:
    scene = replace(scene_at(10.0), score=(("<script>", 1),), halted="<img onerror=x>")
    evil = m.Call(number=1, rule="tag", text="<b>ann</b> is tagged", players=(), poses=(), clock=1.0)
    assert "<script>" not in board(scene).lower()
    assert "<img" not in board(scene)
    assert "<b>ann" not in last_call(replace(scene, calls=(evil,))).lower()


def test_what_lies_on_another_packages_field_has_its_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    """A zone, a thing and a mark that VRG's own games have not: no drawing is changed for them."""
    roles = (Role("runner", "reds", PURPLE, Marker.DIAMOND), Role("guard", "blues", ORANGE, Marker.SQUARE))
    game = Game(name="heist", settings="", rules="", strategy="", match="", roles=roles)
    monkeypatch.setitem(GAMES._found, "heist", game)
    court = m.Zone(name="court", kind="court", region=Rectangle(18.0, -24.0, 22.0, -20.0), team="reds")
    cup = m.FieldObject(name="cup", kind="cup", team="blues", x=20.0, y=-28.0)
    player = m.PlayerStatus(
        name="nemo", team="reds", role="runner", state="active", may_move=True, radius=0.3, mark=Pose(24.0, -16.0, 0.0)
    )
    changes = {"game": "heist", "players": [player], "zones": (court,), "objects": (cup,)}
    scene = scene_at(5.0, **changes, stage=m.Stage.INITIALIZE)
    assert mix(TURF, PURPLE, 0.14) in {solid.colour for solid in ground(scene)}
    shown = batches(BatchMaker({}, P2AT), scene)
    assert tuple(shown["flags/cloths"].colours[0]) == ORANGE
    assert shown["marks"].scales.any()
