"""The world tells since which tick each body has been at rest."""

import pytest

from tests.hal.engine_bench import ENGINE_NAMES
from tests.hal.world_bench import KEYS, Wire, config
from vrg.bus.messages import AT_REST, Body, Drive, MeasuredPose, Poses, at_rest
from vrg.hal.sim.robot import EXTRAPOLATE, RestTimer
from vrg.types import STILL, Pose, Twist

GO = (KEYS.drive("a"), Drive(twist=Twist(0.6, 0.0)))


def bodies(wire: Wire, name: str) -> list[tuple[float, Body]]:
    """Each pose of a body that the world has published, with its match time."""
    return [
        (stamp, next(body for body in poses.bodies if body.name == name))
        for _, stamp, poses in wire.log
        if isinstance(poses, Poses)
    ]


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_a_robot_that_brakes_is_at_rest_since_the_first_tick_at_which_it_is(engine: str) -> None:
    world = Wire(config(("a", 0.0, 0.0, 0.0), engine=engine))
    world.tick()
    world.say(KEYS.drive("a"), Drive(twist=STILL, armed=False))
    world.tick()
    world.tick(60, each=[GO])
    world.tick(60, each=[(KEYS.drive("a"), Drive(twist=STILL))])
    seen = bodies(world, "a")
    moving = [stamp for stamp, body in seen if not at_rest(body.twist)]
    assert len(moving) > 30
    assert all((body.rest is None) == (not at_rest(body.twist)) for _, body in seen)
    stood = next(stamp for stamp, body in seen if stamp > moving[-1])
    assert seen[-1][1].rest == stood
    assert seen[0][1].rest == 0.0


def test_a_physical_robot_that_is_not_measured_is_not_known_to_be_at_rest() -> None:
    world = Wire(config(("g", 3.0, 0.0, 0.0), physical="g"))
    still = (KEYS.robot_pose("g"), MeasuredPose(pose=Pose(3.0, 0.0, 0.0)))
    world.tick(5, each=[still])
    assert bodies(world, "g")[-1][1].rest == 0.0
    world.tick(round(EXTRAPOLATE / 0.02) + 3)
    silent = bodies(world, "g")[-1][1]
    assert (silent.twist, silent.rest) == (STILL, None)
    world.tick(1, each=[still])
    stamp, again = bodies(world, "g")[-1]
    assert again.rest == stamp


def test_slow_is_at_rest_and_turning_is_not() -> None:
    rest = RestTimer()
    assert rest.since(Twist(AT_REST, -AT_REST), 1.0) == 1.0
    assert rest.since(Twist(0.0, 0.0), 2.0) == 1.0
    assert rest.since(Twist(0.0, 2 * AT_REST), 3.0) is None
    assert rest.since(Twist(0.0, 0.0), 4.0) == 4.0
    assert rest.since(Twist(0.0, 0.0), 4.0) == 4.0, "asking again changes nothing"
    assert RestTimer().since(STILL, 5.0) == 5.0
