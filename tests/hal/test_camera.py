"""Cameras: what they see, when they take pictures, and that nothing else changes by them."""

import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.hal.engine_bench import ENGINE_NAMES
from tests.hal.world_bench import KEYS, SimBench, Wire, config
from vrg.bus.codec import Received, decode, encode
from vrg.bus.messages import CameraRequest
from vrg.errors import MessageError
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.sensors import png
from vrg.hal.sensors.camera import Camera, CameraSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sim.config import RobotSetup, WorldConfig, fingerprint
from vrg.hal.sim.map import Map, load_map
from vrg.hal.sim.sensors.rays import Edges, Fan, cast
from vrg.hal.sim.shapes import Box
from vrg.hal.sim.world import World
from vrg.regions import Circle, Rectangle
from vrg.types import Pose, Twist

pytest.importorskip("pybullet")
from vrg.hal.sim.sensors.renderer import Renderer  # only where there are wheels of PyBullet

P2AT, ATRV = robot_model("P2AT"), robot_model("ATRV-Jr")
SPEC = CameraSpec(x=0.0, height=0.45, columns=160, rows=120)
Begin = Callable[[WorldConfig], World]
Look = Callable[..., np.ndarray]  # type: ignore[type-arg]


@pytest.fixture
def look() -> Iterator[Look]:
    """What a camera on the first of some robots sees."""
    opened = []

    def seen(
        *poses: tuple[float, float, float],
        models: tuple[RobotModel, ...] = (),
        spec: CameraSpec = SPEC,
        map_: Map | None = None,
        boxes: tuple[Box, ...] = (),
        circles: tuple[Circle, ...] = (),
    ) -> np.ndarray:  # type: ignore[type-arg]
        renderer = Renderer(map_ or Map("yard", Rectangle(-50, -50, 50, 50), boxes, circles))
        opened.append(renderer)
        renderer.look(models or [P2AT] * len(poses), np.array(poses))
        return renderer.picture(spec, 0, poses[0])

    yield seen
    for renderer in opened:
        renderer.close()


def is_red(picture: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    r, g, b = (picture[..., channel].astype(int) for channel in range(3))
    return (r > 2 * g) & (r > 2 * b) & (r > 60)


def test_alone_it_sees_the_sky_above_the_ground(look: Look) -> None:
    picture = look((0.0, 0.0, 0.3))
    assert (picture.shape, picture.dtype) == ((120, 160, 3), np.uint8)
    sky, ground = picture[:60].astype(int), picture[60:].astype(int)
    assert (sky[..., 2] > sky[..., 0] + 10).all(), "the sky is blue"
    assert (abs(ground[..., 2] - ground[..., 0]) < 20).all(), "the ground is grey"
    assert (look((5.0, -3.0, 2.0)) == picture).all(), "the empty plane looks the same everywhere"


def test_a_robot_ahead_is_red_in_the_middle_and_nearer_is_larger(look: Look) -> None:
    near, far = (is_red(look((0.0, 0.0, 0.5), (d * math.cos(0.5), d * math.sin(0.5), 0.5))) for d in (2.0, 4.0))
    rows, columns = near.nonzero()
    assert abs(columns.mean() - 79.5) < 5
    assert rows.min() > 60, "its hull is below the camera"
    assert near.sum() > 2.5 * far.sum() > 0


def test_a_low_wall_hides_less_of_the_sky(look: Look) -> None:
    none, low, high = (
        look((0.0, 0.0, 0.0), boxes=boxes)[:60]
        for boxes in ((), (Box(2.0, 0.0, 0.0, 0.2, 20.0, 0.2),), (Box(2.0, 0.0, 0.0, 0.2, 20.0),))
    )
    assert (low == none).all(), "it is lower than the camera"
    assert (high != none).any()


def test_models_have_colours_of_their_own(look: Look) -> None:
    pioneer, junior = (look((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), models=(P2AT, m)) for m in (P2AT, ATRV))
    assert is_red(pioneer).any()
    assert not is_red(junior).any()


def test_nobody_sees_itself(look: Look) -> None:
    alone = look((0.0, 0.0, 0.0), spec=replace(SPEC, height=0.2, tilt=-0.5))
    assert not is_red(alone).any()
    assert (alone == look((9.0, 9.0, 1.0), spec=replace(SPEC, height=0.2, tilt=-0.5))).all()


def test_a_robot_that_was_in_no_picture_of_its_own_is_in_those_of_others() -> None:
    renderer = Renderer(Map("yard", Rectangle(-9, -9, 9, 9), (), ()))
    poses = np.array([(0.0, 0.0, 0.0), (3.0, 0.0, math.pi)])
    renderer.look([P2AT, P2AT], poses)
    pictures = [renderer.picture(SPEC, row, tuple(poses[row].tolist())) for row in (0, 1, 0)]
    assert all(is_red(picture).any() for picture in pictures)
    assert (pictures[0] == pictures[2]).all()
    renderer.look([P2AT], poses[:1])
    assert not is_red(renderer.picture(SPEC, 0, (0.0, 0.0, 0.0))).any(), "one has left"
    renderer.close()
    renderer.close()


def test_walls_and_round_obstacles_have_other_colours_than_the_sky_behind_them(look: Look) -> None:
    empty = look((0.0, 0.0, 0.0))
    wall = look((0.0, 0.0, 0.0), boxes=(Box(4.0, 0.0, 0.0, 0.3, 30.0),))
    post = look((0.0, 0.0, 0.0), circles=(Circle(4.0, 0.0, 0.5),))
    changed = (wall != empty).any(axis=2)
    assert changed[60].all(), "a long wall fills the horizon"
    assert not changed[:10].any(), "a wall of 1 m at 4 m is not as high as the picture"
    _, columns = (post != empty).any(axis=2).nonzero()
    assert columns.min() > 0
    assert columns.max() < 159
    assert abs(columns.mean() - 79.5) < 1


def test_a_pixel_is_seen_at_the_bearing_that_the_message_tells(look: Look) -> None:
    bearing, spec = 0.35, replace(SPEC, columns=320, rows=20)
    post = (Circle(6.0 * math.cos(bearing), 6.0 * math.sin(bearing), 0.1),)
    found = (look((0.0, 0.0, 0.0), spec=spec) != look((0.0, 0.0, 0.0), spec=spec, circles=post)).any(axis=(0, 2))
    column = found.nonzero()[0].mean()
    focal = spec.columns / 2 / math.tan(spec.fov / 2)
    assert math.atan((spec.columns / 2 - column - 0.5) / focal) == pytest.approx(bearing, abs=0.005)


@pytest.mark.parametrize("seed", range(6))
def test_at_the_horizon_it_sees_walls_where_rays_meet_them(look: Look, seed: int) -> None:
    """Also walls that begin beside or behind the camera, and one that it stands close to."""
    map_, rng = load_map("courtyard"), np.random.default_rng(seed)
    edges, reach = Edges(map_.edges), 100.0
    spec = replace(SPEC, columns=320, rows=3)
    while True:
        x, y, theta = rng.uniform(14, 28), rng.uniform(-34, -11), rng.uniform(-3, 3)
        if map_.footprint_clear(Pose(x, y, theta), 0.4, 0.4):
            break
    picture = look((x, y, theta), spec=spec, map_=map_)
    background = look((x, y, theta), spec=spec)
    drawn = (picture != background).any(axis=2)[1]
    focal = spec.columns / 2 / math.tan(spec.fov / 2)
    bearings = np.arctan((spec.columns / 2 - np.arange(spec.columns) - 0.5) / focal)
    met = [cast(x, y, theta + b, Fan.of(1, 0.1), reach, edges, map_.discs)[0] < reach for b in bearings]
    assert (drawn == np.array(met)).mean() > 0.97


def test_a_tilted_camera_sees_more_of_the_ground(look: Look) -> None:
    def ground(tilt: float) -> float:
        picture = look((0.0, 0.0, 0.0), spec=replace(SPEC, tilt=tilt)).astype(int)
        return float((abs(picture[..., 2] - picture[..., 0]) < 20).mean())

    assert ground(-0.3) > ground(0.0) > ground(0.3)
    assert ground(-math.pi / 2) == 1.0
    assert ground(math.pi / 2) == 0.0


@pytest.fixture
def begin() -> Iterator[Begin]:
    """A world of a set-up."""
    with ExitStack() as stack:

        def build(setup: WorldConfig) -> World:
            world = World(setup)
            stack.callback(world.close)
            return world

        yield build


def pictures(world: World, ticks: int) -> list[tuple[int, str, Camera]]:
    """The pictures of so many ticks: the tick, the robot, the message."""
    found = []
    for _ in range(ticks):
        world.step()
        found += [(world.tick, robot, said) for robot, _, said in world.sense() if isinstance(said, Camera)]
    return found


def two(*, camera: bool = False, **settings: float) -> WorldConfig:
    small = {"camera": {"columns": 32, "rows": 24, **settings}}
    robots = [RobotSetup(name=n, model="P2AT", pose=Pose(x, 0, 0), sensors=small) for n, x in (("a", 0.0), ("b", 2.0))]
    return WorldConfig(map="open", engine="planar", robots=(replace(robots[0], camera=camera), robots[1]))


def test_pictures_are_taken_only_while_somebody_asks(begin: Begin) -> None:
    world = begin(two())
    assert pictures(world, 100) == []
    world.ask_camera("a", 1.0)
    assert [robot for _, robot, _ in pictures(world, 49)] == ["a", "a"]
    assert pictures(world, 100) == []
    world.ask_camera("nobody", 1.0)
    assert pictures(world, 50) == []


@pytest.mark.parametrize("lasers", [True, False], ids=["with lasers", "without lasers"])
def test_the_match_file_may_ask_all_the_time_at_the_rate_of_the_spec(begin: Begin, lasers: bool) -> None:
    found = pictures(begin(replace(two(camera=True, rate=5.0), lasers=lasers)), 100)
    assert [robot for _, robot, _ in found] == ["a"] * 10
    assert {b - a for (a, _, _), (b, _, _) in pairwise(found)} == {10}
    first = found[0][2]
    assert (first.size, first.fov) == ((32, 24), SPEC.fov)
    assert is_red(first.image).any(), "b is ahead"


def test_a_camera_may_drop_pictures(begin: Begin) -> None:
    assert pictures(begin(two(camera=True, drop_out=1.0)), 100) == []


def test_not_all_robots_take_their_pictures_in_one_tick(begin: Begin) -> None:
    robots = [(f"r{number}", 2.0 * number, 0.0, 0.0) for number in range(6)]
    world = begin(config(*robots))
    for name, *_ in robots:
        world.ask_camera(name, 10.0)
    found = pictures(world, 25)
    assert len(found) == 6
    assert len({tick for tick, _, _ in found}) > 3


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_every_engine_gives_pictures_and_a_picture_changes_nothing_else(begin: Begin, engine: str) -> None:
    """The renderer is a client of its own, so that not even the order of bodies in the engine changes."""

    def course(camera: bool) -> list[object]:
        world = begin(replace(two(camera=camera), engine=engine))
        said: list[object] = []
        for tick in range(60):
            world.drive("a", Twist(0.5, 0.2 * (-1) ** tick), armed=tick > 2)
            world.step()
            said += [m for m in world.sense() if not isinstance(m[2], Camera)]
            said.append(world.poses())
        return said

    assert course(camera=True) == course(camera=False)


def test_a_physical_robot_gets_pictures_too() -> None:
    wire = Wire(config(("p", 0.0, 0.0, 0.0), ("v", 2.0, 0.0, 0.0), physical="p"))
    wire.tick(60, each=[(KEYS.camera_request("p"), CameraRequest(lease=1.0))])
    assert is_red(wire.last(KEYS.sensor(Camera, "p", "main")).image).any()
    assert KEYS.sensor(Camera, "v", "main").key not in wire.heard
    wire.node.stop()


def test_a_player_reads_the_newest_picture_of_its_robot() -> None:
    bench = SimBench("planar")
    bench.driver.connect()
    bench.advance(1.0)
    assert bench.driver.read().latest(Camera) is None
    bench.player.mailbox.publish(KEYS.camera_request("r"), CameraRequest(lease=2.0))
    bench.advance(1.2)
    sample = bench.driver.read().latest(Camera)
    assert sample is not None
    assert sample.value.image.shape == (240, 320, 3)
    assert 0.0 <= sample.age <= 0.6
    bench.close()


def test_pictures_end_with_the_lease_that_nobody_renews() -> None:
    wire = Wire(config(("a", 0.0, 0.0, 0.0)))
    wire.say(KEYS.camera_request("a"), CameraRequest(lease=1.0))
    wire.tick(300)
    stamps = [stamp for key, stamp, _ in wire.log if "camera" in key]
    assert len(stamps) == 2
    assert max(stamps) <= 1.0
    wire.node.stop()


def test_demand_is_a_lease_that_is_never_shortened() -> None:
    names = ("always", "a", "b")
    robots = [RobotSetup(name=n, model="P2AT", pose=Pose(3.0 * i, 0, 0), camera=i == 0) for i, n in enumerate(names)]
    world = World(WorldConfig(map="open", engine="planar", robots=tuple(robots)))

    def wanted(tick: int) -> set[str]:
        world.tick = tick
        return set(world._instant().cameras)

    assert wanted(0) == {"always"}
    world.ask_camera("a", 5.0)
    world.ask_camera("nobody", 5.0)
    world.tick = 50
    world.ask_camera("a", 1.0)
    world.ask_camera("b", 1.0)
    assert wanted(75) == {"always", "a", "b"}
    assert wanted(100) == {"always", "a"}
    assert wanted(250) == {"always"}
    world.close()


def test_whether_pictures_are_taken_does_not_make_another_world() -> None:
    assert fingerprint(two(camera=True)) == fingerprint(two())
    assert fingerprint(two(camera=True)) != fingerprint(two(camera=True, fov=1.0))


def test_every_model_has_a_camera_that_looks_over_its_own_laser() -> None:
    for model in (P2AT, ATRV):
        camera = model.sensor(CameraSpec)
        assert camera is not None
        assert model.sensor(LaserSpec) is not None
        assert camera.height > model.sensor(LaserSpec).height
        assert (camera.columns, camera.rows, camera.rate) == (320, 240, 2.0)


def test_a_message_that_holds_no_picture_is_refused_by_its_field() -> None:
    taken = Camera(fov=1.0, data=png.encode(np.zeros((2, 3, 3), dtype=np.uint8)))
    good = encode(Received("k", 0.0, 0, taken))
    assert decode(good, Camera, "k").body.size == (3, 2)
    with pytest.raises(MessageError, match="k: expected Camera: data: expected a PNG file"):
        decode(good.replace(b"PNG", b"GIF"), Camera, "k")
    with pytest.raises(ValueError, match="data: expected a PNG file"):
        Camera(fov=1.0, data=b"")


def test_a_player_that_gets_pictures_loads_no_numpy_until_it_looks_at_one() -> None:
    code = (
        "import sys\nfrom vrg.hal.sensors.camera import Camera\nfrom vrg.bus.codec import decode\n"
        "assert 'numpy' not in sys.modules and 'pybullet' not in sys.modules"
    )
    subprocess.run([sys.executable, "-P", "-c", code], check=True, timeout=300)


@pytest.mark.parametrize("camera", [False, True])
def test_a_world_loads_the_renderer_before_it_begins_or_not_at_all(camera: bool) -> None:
    code = (
        "import sys\nfrom vrg.hal.sim.config import RobotSetup, WorldConfig\nfrom vrg.hal.sim.world import World\n"
        "from vrg.types import Pose\n"
        f"robots = (RobotSetup(name='a', model='P2AT', pose=Pose(0, 0, 0), camera={camera}),)\n"
        "world = World(WorldConfig(map='open', engine='planar', robots=robots))\n"
        f"assert ('pybullet' in sys.modules) is {camera}\n"
        "for _ in range(60):\n    world.step()\n    world.sense()\n"
        f"assert ('pybullet' in sys.modules) is {camera}\n"
    )
    subprocess.run([sys.executable, "-P", "-c", code], check=True, timeout=300)
