"""A robot's device among the messages of a match that the test plays, and what a referee says in it."""

from collections.abc import Sequence

from tests.hal.fake_driver import FakeDriver
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys, Topic
from vrg.hal.device import Device
from vrg.types import Pose, Twist

KEYS = Keys("test")


def status(name: str = "a", may_move: bool = True, lease: Twist | None = None) -> m.PlayerStatus:
    """The referee's word on one robot."""
    return m.PlayerStatus(name=name, team="t", role="r", state="s", may_move=may_move, radius=0.35, lease=lease)


def referee_state(players: Sequence[m.PlayerStatus], halted: str | None = None, estop: bool = False) -> m.RefereeState:
    """A state of the referee while a round is played."""
    return m.RefereeState(
        game="g", stage=m.Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=players, zones=(), estop=estop,
    )  # fmt: skip


class Bench:
    """The device of a robot `a`."""

    def __init__(self, driver: FakeDriver, **options: object) -> None:
        self.driver = driver
        self.mailbox = Mailbox()
        self.device = Device(driver, KEYS, self.mailbox, **options)  # type: ignore[arg-type]
        self.device.start()
        self.time = 0.0
        self._sequence = 0

    def say(self, topic: Topic[m.Message], body: m.Message, stamp: float | None = None) -> None:
        """Somebody says something on the match's bus."""
        self._sequence += 1
        for inlet in self.mailbox.inlets:
            if inlet.topic.key == topic.key:
                inlet.offer(Received(topic.key, self.time if stamp is None else stamp, self._sequence, body))

    def tick(self, advance: float = 0.1) -> None:
        """Time passes, and the device hears what was said."""
        self.time += advance
        self.driver.told.clear()
        self.mailbox.handover(self.time)
        self.device.hear()

    def referee(
        self, *, may_move: bool = True, lease: Twist | None = None, stamp: float | None = None, **state: object
    ) -> None:
        """The referee speaks, and is heard."""
        players = [status(may_move=may_move, lease=lease)]
        self.say(KEYS.referee_state, referee_state(players, **state), stamp)  # type: ignore[arg-type]
        self.tick()

    def armed(self) -> "Bench":
        """The referee lets it move, and its player has armed it."""
        self.referee()
        self.device.arm()
        self.driver.told.clear()
        return self

    def estop(self) -> None:
        """Somebody engages the emergency stop, which sounds between two ticks."""
        self.say(KEYS.estop, m.Estop(by="x"))

    def release(self) -> None:
        """Somebody releases it, which is heard at a tick."""
        self.say(KEYS.estop_release, m.EstopRelease(by="x"))
        self.tick()

    def world_sees(self, pose: Pose) -> None:
        """The world says where it has the robot."""
        self.say(KEYS.robot_seen("a"), m.MeasuredPose(pose=pose))
        self.tick()

    def reported(self) -> list[Received[m.Message]]:
        """What the device tells."""
        self.device.report()
        return [out.message for out in self.mailbox.collect()]
