"""The driver of a robot in the world keeps the contract, on every engine."""

from collections.abc import Iterator

import pytest

from tests.hal.engine_bench import ENGINE_NAMES
from tests.hal.world_bench import KEYS, SimBench
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Drive, RobotState
from vrg.errors import ConfigError, RobotError
from vrg.hal.backends import BACKENDS, MatchContext, open_driver
from vrg.hal.models import robot_model
from vrg.hal.sensors.laser import Laser
from vrg.hal.sim.driver import AGREE_TIME, SimDriver
from vrg.testing.driver import FORWARD, DriverContract, armed


class TestContract(DriverContract):
    @pytest.fixture(params=ENGINE_NAMES)
    def bench(self, request: pytest.FixtureRequest) -> Iterator[SimBench]:
        bench = SimBench(request.param)
        yield bench
        bench.close()

    def test_a_scan_arrives_with_angles_and_age(self, bench: SimBench) -> None:
        bench.driver.connect()
        bench.advance(0.5)
        scan = bench.driver.read().latest(Laser)
        assert scan is not None
        assert scan.value.ranges.shape == scan.value.angles.shape == (181,)
        assert scan.value.angles[90] == pytest.approx(0.0)
        assert scan.age <= 0.1

    def test_an_emergency_stop_that_came_and_went_unseen_disarms_it_too(self, bench: SimBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        bench.node.world.engage(True)
        bench.node.world.engage(False)
        with pytest.raises(RobotError, match="arm"):
            bench.run(FORWARD, 2.0)
        bench.driver.arm()  # in the very tick in which it found itself disarmed
        bench.run(FORWARD, 1.0)
        assert bench.driver.read().armed
        assert bench.speed > 0.1


def test_a_robot_that_was_stopped_unseen_is_disarmed_also_by_a_player_that_only_stops() -> None:
    mailbox = Mailbox()
    driver = SimDriver(MatchContext(name="r", model=robot_model("P2AT"), keys=KEYS, mailbox=mailbox))
    states = next(inlet for inlet in mailbox.inlets if inlet.topic.key == KEYS.robot_state("r").key)

    def hear(now: float, *, armed: bool) -> None:
        state = RobotState(armed=armed, estop=False, fault=None if armed else "stopped by the emergency stop")
        states.offer(Received(KEYS.robot_state("r").key, now, round(50 * now), state))
        mailbox.handover(now)

    driver.connect()
    hear(1.0, armed=True)
    driver.arm()
    mailbox.collect()
    hear(1.1 + AGREE_TIME, armed=False)
    driver.stop()
    drives = [out.message.body for out in mailbox.collect()]
    assert all(isinstance(drive, Drive) and not drive.armed for drive in drives)
    assert drives


def test_the_table_of_backends_has_it() -> None:
    driver = open_driver("sim", MatchContext(name="r", model=robot_model("P2AT"), keys=KEYS, mailbox=Mailbox()))
    assert isinstance(driver, SimDriver)
    assert driver.name == "r"
    assert driver.features.name == "P2AT"
    assert not driver.physical
    with pytest.raises(ConfigError, match=r"backend: expected one of can, .*sim, got 'simm', did you mean 'sim'"):
        BACKENDS.get("simm")
