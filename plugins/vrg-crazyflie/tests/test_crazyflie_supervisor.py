"""The supervisor and the body of an emulated Crazyflie, as the firmware's sources have them."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg_crazyflie.emulated.supervisor import State, Supervisor
from vrg_crazyflie.emulated.vehicle import RESPONSE, TILT_ACCELERATION, Vehicle
from vrg_crazyflie.emulated.wire import OFF, Mode, Setpoint
from vrg_crazyflie.report import Info

TICK = 0.04


@dataclass
class Bench:
    """A supervisor, and what it sees at each of its ticks."""

    supervisor: Supervisor
    now: float = 0.0
    thrust: bool = False
    up: float = 1.0
    age: float = 0.0

    def run(self, seconds: float) -> State:
        for _ in range(round(seconds / TICK)):
            self.now += TICK
            self.supervisor.update(self.now, thrust=self.thrust, up=self.up, age=self.age)
        return self.supervisor.state

    def until(self, state: State) -> float:
        """The time in s until it is in a state."""
        began = self.now
        while self.run(TICK) is not state:
            assert self.now < began + 60.0, f"expected {state}, got {self.supervisor.state}"
        return self.now - began


def flying(**options: bool) -> Bench:
    bench = Bench(Supervisor(**options))
    bench.run(0.2)
    bench.thrust = True
    assert bench.run(0.2) is State.FLYING
    return bench


def test_it_arms_itself_unless_it_has_brushless_motors() -> None:
    assert Bench(Supervisor()).run(0.2) is State.READY_TO_FLY
    bench = Bench(Supervisor(auto_arm=False))
    assert bench.run(0.2) is State.READY_TO_ARM
    assert bench.supervisor.arm(True)
    assert bench.run(TICK) is State.READY_TO_FLY
    assert not bench.supervisor.info(Info(0)) & Info.CAN_BE_ARMED


def test_one_that_is_armed_and_does_not_take_off_is_disarmed() -> None:
    bench = Bench(Supervisor(auto_arm=False))
    bench.run(0.2)
    bench.supervisor.arm(True)
    bench.until(State.READY_TO_FLY)
    assert bench.until(State.NOT_READY) == pytest.approx(30.0, abs=2 * TICK)
    assert not bench.supervisor.armed


def test_without_set_points_it_is_levelled_and_then_locked_for_good() -> None:
    bench = flying()
    bench.age = 0.49
    assert bench.run(1.0) is State.FLYING
    bench.age = 0.51
    assert bench.run(TICK) is State.LEVELLING
    bench.age = 0.1
    assert bench.run(TICK) is State.FLYING
    bench.age = 2.01
    assert bench.run(TICK) is State.LOCKED
    bench.age = 0.0
    assert bench.run(60.0) is State.LOCKED
    assert not bench.supervisor.arm(True)
    assert bench.supervisor.info(Info(0)) & (Info.LOCKED | Info.CAN_FLY) == Info.LOCKED


def test_it_has_landed_two_seconds_after_its_thrust_and_is_disarmed_three_later() -> None:
    bench = flying()
    bench.thrust = False
    assert bench.until(State.LANDED) == pytest.approx(2.0, abs=2 * TICK)
    assert bench.until(State.NOT_READY) == pytest.approx(3.0, abs=2 * TICK)


@pytest.mark.parametrize(("up", "within"), [(0.4, 1.0), (-0.5, 0.1)])
def test_one_that_has_tumbled_crashes_until_it_is_recovered_on_its_feet(up: float, within: float) -> None:
    bench = flying()
    bench.up = up
    assert bench.until(State.CRASHED) == pytest.approx(within, abs=3 * TICK)
    assert not bench.supervisor.recover()
    bench.up, bench.thrust = 1.0, False
    assert bench.run(3.0) is State.CRASHED
    assert bench.supervisor.recover()
    assert bench.run(0.2) is State.READY_TO_FLY


def test_a_free_fall_and_a_short_tilt_are_no_tumble() -> None:
    bench = flying()
    for _ in range(5):
        bench.up = 0.4
        bench.run(0.8)
        bench.up = 0.0
        assert bench.run(0.4) is State.FLYING


def stop(supervisor: Supervisor) -> None:
    supervisor.emergency = True


def disarm(supervisor: Supervisor) -> None:
    supervisor.arm(False)


@pytest.mark.parametrize(("happens", "state"), [(stop, State.LOCKED), (disarm, State.NOT_READY)])
def test_a_stop_and_a_disarming_end_a_flight(happens: Callable[[Supervisor], None], state: State) -> None:
    bench = flying()
    happens(bench.supervisor)
    assert bench.run(TICK) is state
    assert not bench.supervisor.able


@given(st.lists(st.tuples(st.booleans(), st.floats(-1.0, 1.0), st.floats(0.0, 3.0)), max_size=60))
def test_nothing_unlocks_it(seen: list[tuple[bool, float, float]]) -> None:
    bench = flying()
    bench.supervisor.emergency = True
    bench.run(TICK)
    bench.supervisor.emergency = False
    for bench.thrust, bench.up, bench.age in seen:
        bench.supervisor.recover()
        bench.supervisor.arm(True)
        assert bench.run(TICK) is State.LOCKED


def hovering() -> Vehicle:
    body = Vehicle()
    for _ in range(300):
        if body.supervisor.able:
            body.command(Setpoint(Mode.HOVER, 0.0, 0.0, 0.5, 0.0))
        body.step()
    assert body.z == pytest.approx(0.5, abs=0.01)
    return body


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_it_accelerates_no_more_than_its_tilt_allows_and_reaches_its_velocity(vx: float, vy: float) -> None:
    body = hovering()
    before = (0.0, 0.0)
    for _ in range(200):
        body.command(Setpoint(Mode.VELOCITY, vx, vy, 0.0, 0.0))
        body.step()
        assert math.dist((body.vx, body.vy), before) / 0.01 <= TILT_ACCELERATION + 1e-6
        before = body.vx, body.vy
    assert before == pytest.approx((vx, vy), abs=1e-3)


def test_its_velocity_is_of_first_order() -> None:
    body = hovering()
    for _ in range(round(RESPONSE * 100)):
        body.command(Setpoint(Mode.VELOCITY, 0.3, 0.0, 0.0, 0.0))
        body.step()
    assert body.vx == pytest.approx(0.3 * (1.0 - math.exp(-1.0)), rel=0.05)


def test_it_drifts_on_while_the_firmware_only_levels_it() -> None:
    body = hovering()
    for _ in range(200):
        body.command(Setpoint(Mode.HOVER, 0.4, 0.0, 0.5, 0.0))
        body.step()
    for _ in range(180):
        body.step()
    assert body.supervisor.state is State.LEVELLING
    assert body.vx > 0.1
    assert body.z == pytest.approx(0.5, abs=0.01), "its height is held"


def test_without_thrust_it_falls_freely_and_lies_still() -> None:
    body = hovering()
    body.command(OFF)
    ticks = 0
    while body.z > 0.0:
        body.step()
        ticks += 1
    assert ticks / 100 == pytest.approx(math.sqrt(2 * 0.5 / 9.81), abs=0.02)
    assert (body.vx, body.vy, body.vz) == (0.0, 0.0, 0.0)


def test_an_empty_battery_switches_everything_off() -> None:
    body = hovering()
    body.charge = 0.0
    for _ in range(600):
        body.command(Setpoint(Mode.HOVER, 0.0, 0.0, 0.5, 0.0))
        body.step()
    assert not body.powered
    assert body.z == 0.0
