"""An emergency stop that a player has missed, on a mailbox whose messages the test brings."""

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Drive, RobotState
from vrg.bus.topics import Keys
from vrg.hal.backends import MatchContext
from vrg.hal.models import robot_model
from vrg.hal.sim.driver import AGREE_TIME, SimDriver

KEYS = Keys("m")


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
