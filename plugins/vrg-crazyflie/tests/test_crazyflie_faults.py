"""Faults of a Crazyflie that is driven meanwhile: what it does, within what simulated time, and what it is called."""

import contextlib
import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pytest
from crazyflie_bench import CrazyflieBench

from vrg.errors import RobotError
from vrg.hal.sensors.odometry import Odometry
from vrg.testing.driver import arm
from vrg.types import Twist
from vrg_crazyflie.emulated.supervisor import State
from vrg_crazyflie.report import Info

TICK = 0.02
"""The time in s between two looks at the body."""
AHEAD = Twist(0.3, 0.0)
SOFT, HARD = 1.2, 1.5
"""The speed in m/s downwards up to which it lands, and from which it falls; from 0.4 m it ends at 2.8 m/s."""


@dataclass(frozen=True)
class Fault:
    """A fault in flight.

    Args:
        happens: lets it happen. outcome: what it does: `hovers`, `lands`, or is `cut`.
        within: the time in s from the fault until it stands in the air, lies on the ground, or has no thrust.
        words: what the driver calls it. told: the time in s within which it does.
        settings: of the robot.
    """

    happens: Callable[[CrazyflieBench, pytest.MonkeyPatch], object]
    outcome: str
    within: float
    words: str
    told: float
    settings: tuple[tuple[str, float], ...] = ()


def freeze(seconds: float) -> Callable[[CrazyflieBench, pytest.MonkeyPatch], None]:
    """The thread that sends set-points, and whoever commands, are frozen for a while, as their computer is."""

    def happens(bench: CrazyflieBench, patch: pytest.MonkeyPatch) -> None:
        sending, until = bench.driver._radio.send, bench.now + seconds
        turn = bench.driver._send
        patch.setattr("vrg_crazyflie.driver.PERIOD", seconds)
        patch.setattr(bench.driver, "_send", lambda: turn() if bench.now >= until else None)
        patch.setattr(bench.driver._radio, "send", lambda command: sending(command) if bench.now >= until else None)
        bench.clock.at(until, lambda: patch.setattr("vrg_crazyflie.driver.PERIOD", 0.04))

    return happens


def jump(x: float, z: float = 0.0) -> Callable[[CrazyflieBench, pytest.MonkeyPatch], None]:
    """What the estimator says jumps by so many m."""
    return lambda bench, _: bench.body.error.__setitem__(slice(None), [x, 0.0, z])


def flip(bench: CrazyflieBench, _: pytest.MonkeyPatch) -> None:
    """Something turns it over."""
    bench.body.tilt = math.pi


def set_charge(charge: float) -> Callable[[CrazyflieBench, pytest.MonkeyPatch], None]:
    return lambda bench, _: setattr(bench.body, "charge", charge)


def lose_link(bench: CrazyflieBench, _: pytest.MonkeyPatch) -> None:
    bench.craft.reachable = False


def land_then_lose_link(bench: CrazyflieBench, _: pytest.MonkeyPatch) -> None:
    """It is disarmed, and the link is lost as soon as it sinks."""
    bench.driver.disarm()
    bench.time_until(lambda: not bench.body.low_level)
    bench.craft.reachable = False


def switch_off(bench: CrazyflieBench, _: pytest.MonkeyPatch) -> None:
    """Its battery falls out."""
    bench.body.powered = False


FAULTS = {
    "the host freezes for a second": Fault(freeze(1.0), "hovers", 0.6, "its driver has hung", 0.5),
    "the host freezes for three seconds": Fault(freeze(3.0), "cut", 2.1, "its driver has hung", 0.5),
    "the link is lost": Fault(lose_link, "cut", 2.1, "the link was lost", 1.1),
    "the link is lost as it lands": Fault(land_then_lose_link, "lands", 3.0, "the link was lost", 1.5),
    "it is switched off": Fault(switch_off, "cut", 0.05, "the link was lost", 1.1),
    "it reports nothing": Fault(lambda b, _: b.craft.firmware.blocks.clear(), "lands", 5.0, "has not reported", 0.6),
    "its battery is low": Fault(set_charge(0.05), "lands", 5.0, "battery is low", 2.3),
    "its firmware finds the battery low": Fault(
        set_charge(0.04), "lands", 10.0, "battery is low", 7.3, (("battery_low", 3.0),)
    ),
    "it is flipped": Fault(flip, "cut", 0.5, "it has crashed", 0.7),
    "a propeller blocks in the air": Fault(
        lambda b, _: setattr(b.body, "blocked", True), "cut", 0.7, "it has crashed", 0.8
    ),
    "its thrust does not suffice": Fault(lambda b, _: setattr(b.body, "sag", 0.2), "lands", 4.0, "it sinks", 1.5),
    "its place jumps": Fault(jump(1.0), "lands", 4.0, "its estimator has diverged: its place has jumped by 1.0", 0.1),
    "its height jumps": Fault(jump(0.0, 0.6), "lands", 6.0, "its estimator has diverged: its place has jumped", 0.1),
    "its place is no number": Fault(jump(math.nan), "lands", 4.0, "diverged: its place is no number", 0.1),
    "somebody else cuts it": Fault(
        lambda b, _: setattr(b.body.supervisor, "emergency", True), "cut", 0.1, "locked the motors", 0.2
    ),
    "somebody else disarms it": Fault(
        lambda b, _: b.body.supervisor.arm(False), "cut", 0.1, "switched the motors off in flight", 0.2
    ),
    "the emergency stop is engaged": Fault(
        lambda b, _: b.driver.emergency_stop(), "cut", 0.05, "locked the motors", 0.2
    ),
}
"""Faults of one that flies ahead at 0.3 m/s, 0.4 m above the ground."""


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_fault_in_flight(fault: Fault, monkeypatch: pytest.MonkeyPatch) -> None:
    with CrazyflieBench(**dict(fault.settings)) as bench:
        bench.fly()
        bench.run(AHEAD, 1.0)
        assert bench.fault == ""
        body, began = bench.body, bench.now
        fault.happens(bench, monkeypatch)
        fell, lowest = 0.0, body.z
        reached: float | None = None
        told: float | None = None
        while bench.now < began + fault.within + 4.0:
            with contextlib.suppress(RobotError):
                bench.driver.drive(AHEAD)
            fell, lowest = max(fell, -body.vz), min(lowest, body.z)
            done = {
                "hovers": body.supervisor.state is State.LEVELLING,
                "lands": body.z <= 0.0 and body.thrust == 0.0,
                "cut": body.thrust == 0.0 and (body.z > 0.0 or fell > HARD),
            }
            if reached is None and done[fault.outcome]:
                reached = bench.now - began
            if told is None and fault.words in bench.fault:
                told = bench.now - began
            bench.advance(TICK)
        assert told is not None, f"it is not named: {bench.fault!r}"
        assert told <= fault.told
        assert reached is not None, f"expected that it {fault.outcome}"
        assert reached <= fault.within
        if fault.outcome == "hovers":
            assert lowest > 0.35
            assert (bench.driver.read().armed, bench.fault) == (True, ""), "it obeys again"
        elif fault.outcome == "lands":
            assert fell < SOFT
        else:
            assert fell > HARD
            assert not bench.driver.read().armed


def set_up(bench: CrazyflieBench, **values: object) -> None:
    for name, value in values.items():
        setattr(bench.body, name, value)


REFUSALS: dict[str, tuple[Callable[[CrazyflieBench], object], str]] = {
    "it lies upside down": (lambda b: set_up(b, tilt=math.pi), "lies tilted or upside down"),
    "its battery is low": (lambda b: set_up(b, charge=0.003), "battery is low"),
    "it was locked before": (lambda b: setattr(b.body.supervisor, "emergency", True), "locked the motors"),
    "its firmware refuses": (lambda b: setattr(b.body.supervisor, "arm", lambda _: False), "refuses to arm"),
    "a propeller is blocked": (lambda b: set_up(b, blocked=True), "does not leave the ground"),
    "the link is lost": (lambda b: setattr(b.craft, "reachable", False), "the link was lost"),
}
"""Faults on the ground, with words of their names."""


@pytest.mark.parametrize(("happens", "words"), REFUSALS.values(), ids=REFUSALS)
def test_with_a_fault_on_the_ground_it_stays_there(happens: Callable[[CrazyflieBench], object], words: str) -> None:
    with CrazyflieBench(auto_arm=words != "refuses to arm") as bench:
        bench.driver.connect()
        bench.advance(0.2)
        happens(bench)
        bench.advance(1.5)
        highest, thrust = 0.0, 0.0
        for _ in range(60):
            with contextlib.suppress(RobotError):
                bench.driver.arm()
            bench.advance(0.1)
            highest = max(highest, bench.body.z)
            thrust = bench.body.thrust
        assert (highest, thrust) == (0.0, 0.0)
        assert words in bench.fault
        assert not bench.driver.read().armed


def test_recovering_one_that_flies_well_changes_nothing(bench: CrazyflieBench) -> None:
    """An official recovers all robots at once."""
    bench.fly()
    bench.driver.recover()
    bench.run(AHEAD, 1.0)
    assert (bench.fault, bench.driver.read().armed) == ("", True)
    bench.body.error = [1.0, 0.0, 0.0]
    bench.advance(0.1)
    with pytest.raises(RobotError, match="it still flies: recover it as soon as it has landed"):
        bench.driver.recover()
    bench.time_until(lambda: bench.body.z == 0.0 and bench.body.thrust == 0.0, 5.0)
    bench.driver.recover()
    assert bench.fault == ""


def test_a_lost_link_is_opened_again_by_recovering(bench: CrazyflieBench) -> None:
    bench.driver.connect()
    bench.advance(0.2)
    bench.craft.reachable = False
    bench.advance(1.5)
    assert bench.driver.read().latched
    with pytest.raises(RobotError, match=r"cannot connect to vrg://cf: .* does not answer"):
        bench.driver.recover()
    bench.craft.reachable = True
    bench.driver.recover()
    bench.advance(0.2)
    assert bench.fault == ""
    arm(bench)
    bench.run(AHEAD, 1.0)
    assert bench.speed == pytest.approx(0.3, rel=0.1)


def test_a_crash_is_forgotten_as_soon_as_it_lies_on_its_feet(bench: CrazyflieBench) -> None:
    bench.fly()
    bench.body.tilt = math.pi
    bench.advance(2.0)
    with pytest.raises(RobotError, match="set it upright"):
        bench.driver.recover()
    bench.body.tilt = 0.0
    bench.advance(0.2)
    bench.driver.recover()
    bench.advance(0.2)
    assert bench.fault == ""
    arm(bench)
    assert bench.body.z == pytest.approx(0.4, abs=0.1)


def test_one_that_is_locked_is_restarted_by_recovering_and_its_way_goes_on(bench: CrazyflieBench) -> None:
    bench.fly()
    bench.run(AHEAD, 1.0)
    bench.body.supervisor.emergency = True
    bench.advance(1.0)
    before = bench.odometry.pose
    bench.driver.recover()
    bench.advance(0.2)
    assert (bench.body.x, bench.fault) == (0.0, ""), "its estimator begins anew"
    assert bench.odometry.pose.x == pytest.approx(before.x)
    arm(bench)


def test_a_restart_that_fails_is_a_fault(bench: CrazyflieBench) -> None:
    bench.fly()
    bench.driver.emergency_stop()
    bench.advance(0.5)
    bench.craft.reachable = False
    bench.driver.release()
    bench.advance(0.5)
    assert bench.fault.startswith("cannot restart it")
    assert "switch it off and on" in bench.fault
    with pytest.raises(RobotError, match="recover it, then arm"):
        bench.driver.arm()


def test_a_radio_that_takes_no_packet_any_more_is_a_lost_link(bench: CrazyflieBench) -> None:
    """cflib learns of it within a call that sends, and must come back from that."""
    bench.fly()
    radio = bench.driver._radio
    assert radio._craft is not None
    link = radio._craft.link
    # cflib's thread of pings would wait for the packet, and cflib for that thread.
    assert "ping_thread" not in {thread.name for thread in threading.enumerate()}
    link.send_packet = lambda _: link.failed("could not send packet")
    bench.advance(0.2)
    assert "the link was lost (could not send packet)" in bench.fault
    bench.time_until(lambda: bench.body.thrust == 0.0, 2.2)
    bench.driver.recover()
    bench.advance(0.2)
    assert "locked" in bench.fault, "its firmware had cut it meanwhile"
    bench.driver.recover()
    bench.advance(0.2)
    assert bench.fault == ""


def test_it_flies_on_though_a_third_of_the_packets_is_lost(bench: CrazyflieBench) -> None:
    bench.fly()
    bench.craft.loss = 0.33
    bench.run(AHEAD, 3.0)
    assert (bench.fault, bench.driver.read().armed) == ("", True)
    assert bench.body.vx == pytest.approx(0.3, abs=0.05)
    bench.driver.disarm()
    bench.time_until(lambda: bench.body.z == 0.0 and bench.body.thrust == 0.0, 5.0)


def test_one_that_still_flies_when_it_is_reached_again_is_armed_only_after_it_lies_on_the_ground() -> None:
    with CrazyflieBench(height=0.8) as bench:
        bench.fly()
        bench.craft.reachable = False
        bench.advance(1.1)
        bench.craft.reachable = True
        bench.driver.recover()
        assert bench.body.z > 0.5, "its firmware has levelled it"
        highest = 0.0
        while bench.body.z > 0.0:
            with contextlib.suppress(RobotError):
                bench.driver.arm()
            bench.advance(0.1)
            highest = max(highest, bench.body.z)
            assert not bench.driver.read().armed
        assert highest <= 0.85, "its height is not counted from where it was"


def test_a_take_off_that_nobody_asks_for_any_more_is_broken_off(bench: CrazyflieBench) -> None:
    """As in a HALT, in which a player only stops its robot."""
    bench.driver.connect()
    bench.advance(0.2)
    while bench.body.z <= 0.1:
        bench.driver.arm()
        bench.advance(0.1)
    for _ in range(60):
        bench.driver.stop()
        bench.advance(0.1)
    assert (bench.body.z, bench.body.thrust) == (0.0, 0.0)
    assert not bench.driver.read().armed
    assert bench.fault == ""


def test_one_that_is_disarmed_while_it_is_being_armed_is_disarmed_in_its_firmware() -> None:
    with CrazyflieBench(auto_arm=False) as bench:
        bench.driver.connect()
        bench.advance(0.2)
        bench.driver.arm()
        bench.advance(0.05)
        bench.driver.disarm()
        bench.advance(2.0)
        assert Info.ARMED not in bench.body.supervisor.info(Info(0))
        assert bench.body.z == 0.0


def test_its_way_goes_on_where_it_fell_though_a_last_report_comes_in_as_it_is_restarted(
    bench: CrazyflieBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    radio, reports = bench.driver._radio, list[Mapping[str, float]]()
    hear, close = radio._heard, radio.close

    def heard(values: Mapping[str, float]) -> None:
        reports.append(values)
        hear(values)

    def closed() -> None:
        if radio._craft is not None:
            hear(next(values for values in reversed(reports) if "stateEstimate.x" in values))
        close()

    monkeypatch.setattr(radio, "_heard", heard)
    monkeypatch.setattr(radio, "close", closed)
    bench.fly()
    bench.run(AHEAD, 3.0)
    bench.driver.emergency_stop()
    bench.advance(1.0)
    fell = bench.driver.read().latest(Odometry)
    bench.driver.release()
    bench.time_until(lambda: bench.fault == "")
    again = bench.driver.read().latest(Odometry)
    assert fell is not None
    assert again is not None
    assert fell.value.pose.x > 0.5
    assert again.value.pose.x == pytest.approx(fell.value.pose.x, abs=0.01)
    assert again.value.pose.z == 0.0
