"""Programs of cflib that know nothing of VRG fly an emulated Crazyflie, in simulated time."""

import threading
from collections.abc import Callable, Iterator

import cflib.crtp
import pytest
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
from cflib.utils.power_switch import PowerSwitch

from vrg.hal.simulated_clock import SimulatedClock
from vrg_crazyflie.emulated.link import CRAZYFLIES, Emulated, register
from vrg_crazyflie.emulated.supervisor import State

URI = "vrg://example"
ANSWERED = 20.0
"""The real time in s for cflib's own threads to come to something."""


@pytest.fixture
def craft() -> Iterator[Emulated]:
    register()
    clock = SimulatedClock()
    made = CRAZYFLIES["example"] = Emulated("example", clock=clock)
    clock.sleep(0.2)
    yield made
    made.close()
    clock.sleep(0.1)
    clock.close()


@pytest.fixture
def connected(craft: Emulated) -> Iterator[SyncCrazyflie]:
    with SyncCrazyflie(URI, cf=Crazyflie()) as opened:
        opened.wait_for_params()
        yield opened


def test_it_is_found_by_a_scan(craft: Emulated, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cflib.crtp, "CLASSES", [kind for kind in cflib.crtp.CLASSES if kind().get_name() == "vrg"])
    assert [URI, ""] in cflib.crtp.scan_interfaces()


def test_to_register_twice_changes_nothing(craft: Emulated) -> None:
    before = list(cflib.crtp.CLASSES)
    register()
    assert before == cflib.crtp.CLASSES


def test_log_blocks_bring_values(craft: Emulated, connected: SyncCrazyflie) -> None:
    block, found = LogConfig(name="power", period_in_ms=100), []
    block.add_variable("pm.vbat", "FP16")
    block.add_variable("pm.batteryLevel")
    block.data_received_cb.add_callback(lambda stamp, values, _: found.append((stamp, values)))
    connected.cf.log.add_config(block)
    block.start()
    craft.clock.sleep(1.0)
    assert len(found) == 10
    stamp, values = found[-1]
    assert stamp == pytest.approx(1000 * craft.vehicle.now, abs=1)
    assert values["pm.vbat"] == pytest.approx(4.15, abs=0.01)
    assert values["pm.batteryLevel"] == 99
    block.stop()
    craft.clock.sleep(1.0)
    assert len(found) == 10


def test_parameters_are_set(craft: Emulated, connected: SyncCrazyflie) -> None:
    updated = threading.Event()
    connected.cf.param.add_update_callback(group="pm", name="lowVoltage", cb=lambda *_: updated.set())
    connected.cf.param.set_value("pm.lowVoltage", 3.4)
    assert updated.wait(ANSWERED)
    assert craft.vehicle.low_voltage == pytest.approx(3.4)
    assert connected.cf.param.get_value("deck.bcFlow2") == "1"
    with pytest.raises(AttributeError, match="read-only"):
        connected.cf.param.set_value("deck.bcFlow2", 0)


def fly_by_set_points(craft: Emulated, cf: Crazyflie) -> None:
    """As an example of cflib does, ten times a second."""

    def send(seconds: float, send: Callable[[], None]) -> None:
        for _ in range(round(seconds * 10)):
            send()
            craft.clock.sleep(0.1)

    send(2.0, lambda: cf.commander.send_hover_setpoint(0.0, 0.0, 0.0, 0.5))
    send(2.0, lambda: cf.commander.send_hover_setpoint(0.25, 0.0, 45.0, 0.5))
    send(1.0, lambda: cf.commander.send_hover_setpoint(0.0, 0.0, 0.0, 0.5))
    cf.high_level_commander.land(0.0, 2.0, yaw=None)
    cf.commander.send_notify_setpoint_stop()
    craft.clock.sleep(3.0)


def test_set_points_fly_it(craft: Emulated, connected: SyncCrazyflie) -> None:
    fly_by_set_points(craft, connected.cf)
    body = craft.vehicle
    assert body.yaw == pytest.approx(1.57, abs=0.1), "it has turned to the left"
    assert min(body.x, body.y) > 0.2, "and has flown in an arc to the left"
    assert (body.z, body.thrust) == (0.0, 0.0)


def test_the_high_level_commander_flies_it(craft: Emulated, connected: SyncCrazyflie) -> None:
    cf = connected.cf
    cf.supervisor.send_arming_request(True)
    cf.high_level_commander.takeoff(0.5, 1.0)
    craft.clock.sleep(3.0)
    assert cf.supervisor.is_flying
    cf.high_level_commander.go_to(0.5, 0.0, 0.0, 0.0, 1.0, relative=True)
    craft.clock.sleep(3.0)
    assert craft.vehicle.estimate == pytest.approx((0.5, 0.0, 0.5), abs=0.02)
    cf.high_level_commander.land(0.0, 1.5)
    craft.clock.sleep(6.0)
    assert craft.vehicle.z == 0.0


def test_a_set_point_to_stop_makes_it_fall(craft: Emulated, connected: SyncCrazyflie) -> None:
    connected.cf.high_level_commander.takeoff(0.5, 1.0)
    craft.clock.sleep(2.0)
    connected.cf.commander.send_stop_setpoint()
    craft.clock.sleep(0.1)
    assert craft.vehicle.thrust == 0.0
    craft.clock.sleep(0.3)
    assert craft.vehicle.z == 0.0


def test_closing_a_link_in_flight_makes_it_fall(craft: Emulated) -> None:
    """cflib sends a set-point without thrust as it closes a link, also while the high-level commander flies."""
    with SyncCrazyflie(URI, cf=Crazyflie()) as opened:
        opened.cf.high_level_commander.takeoff(0.5, 1.0)
        craft.clock.sleep(2.0)
        assert craft.vehicle.z > 0.4
    craft.clock.sleep(0.5)
    assert (craft.vehicle.z, craft.vehicle.thrust) == (0.0, 0.0)


def test_a_position_from_outside_is_taken_over(craft: Emulated, connected: SyncCrazyflie) -> None:
    connected.cf.extpos.send_extpos(1.0, 2.0, 0.0)
    craft.clock.sleep(0.1)
    assert craft.vehicle.estimate == pytest.approx((1.0, 2.0, 0.0))


def test_an_emergency_stop_locks_it_until_it_is_restarted(craft: Emulated, connected: SyncCrazyflie) -> None:
    connected.cf.supervisor.send_emergency_stop()
    craft.clock.sleep(0.1)
    assert craft.vehicle.supervisor.state is State.LOCKED
    connected.close_link()
    switch = PowerSwitch(URI)
    switch.stm_power_down()
    switch.stm_power_up()
    switch.close()
    craft.clock.sleep(1.5)
    assert craft.vehicle.supervisor.able


def test_the_watchdog_of_the_emergency_stop_cuts_it(craft: Emulated, connected: SyncCrazyflie) -> None:
    connected.cf.high_level_commander.takeoff(0.5, 1.0)
    for _ in range(4):
        connected.cf.supervisor.send_emergency_stop_watchdog()
        craft.clock.sleep(0.5)
    assert craft.vehicle.z > 0.4
    craft.clock.sleep(1.1)
    assert craft.vehicle.supervisor.state is State.LOCKED
