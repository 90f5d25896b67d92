"""A strategy in a process of its own is shown what it would be shown in the process of its match."""

import contextlib
import pickle
import queue
import threading

import pytest
from msgspec import structs

from vrg.agents.radio import TeamMessage
from vrg.agents.strategy import View
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import SensorMessage
from vrg.bus.topics import Keys
from vrg.bus.transport import MemoryTransport
from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Observation
from vrg.hal.models.pioneer import P2AT
from vrg.hal.readings import Readings, SensorInlets
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.spec import Sample
from vrg.playing.question import EVERY_KIND, VIEWS_KEPT, Answering, Questions, TooManyQuestionsError, Wanted
from vrg.regions import Circle
from vrg.types import Pose, Uncertainty


def views_of(game: str) -> list[View]:
    """A view of each player of a match at its beginning, and one of the first player that no rule book gives."""
    setup = load_match(match_path(game))
    poses = {player.name: Pose(0.1 * n, -1.5, 0.25 * n) for n, player in enumerate(setup.players)}
    state, velocities = Match(rulebook_of(setup)).state(Observation(poses), estop=False), {}
    for n, player in enumerate(state.players):
        velocities[player.name] = (0.1 * n, -0.3)
    views = []
    for me in state.players:
        mailbox, robot = Mailbox(f"player/{me.name}"), setup.player(me.name).robot
        inlets = SensorInlets(setup.keys, mailbox, me.name, robot.sensors)
        for inlet in mailbox.inlets:
            said = {Ins: Ins(pose=poses[me.name]), Battery: Battery(charge=0.5)}.get(inlet.topic.type)  # type: ignore[call-overload]
            if said is not None:
                mailbox.publish(inlet.topic, said)
                inlet.offer(mailbox.collect()[0].message)
        mailbox.handover(0.5)
        readings = Readings(0.5, 0.0, armed=True, estop=False, samples=inlets.samples())
        heard = [TeamMessage("mate", 0.4, {"at": [1.5, 2.0]})]
        views.append(View(0.5, me, readings, state, velocities, robot, poses[me.name], heard, obstacles=()))
    return [*views, structs.replace(views[0], me=structs.replace(views[0].me, role="spectator"))]


class Wire:
    """A match and a strategy that decides elsewhere, without a pipe."""

    def __init__(self) -> None:
        self.questions, self.asked = Questions(), list[str]()
        self.ways: list[bytes] = []
        self.strategy = Answering(lambda: self.ways.pop(0), self.ask)

    def ask(self, wanted: Wanted) -> None:
        self.asked.append(wanted.kind)
        self.ways.append(self.questions.told(wanted))

    def shown(self, view: View) -> View:
        self.ways.append(self.questions.packed(view))
        return self.strategy.view()


def plain(view: View) -> View:
    return structs.replace(view, readings=structs.replace(view.readings, samples=tuple(view.readings.samples)))


@pytest.mark.parametrize("game", ["sharks-and-minnows", "pursuit-evasion", "roboflag"])
def test_what_arrives_is_what_was_sent(game: str) -> None:
    for me in range(3):
        wire, view = Wire(), views_of(game)[-me]
        for _ in range(2):
            arrived = wire.shown(view)
            assert plain(arrived) == plain(view)
            assert repr(plain(arrived)) == repr(plain(view)), "also what it prints"
            assert len(plain(view).readings.samples) == 2


def test_every_field_arrives() -> None:
    """Each has another value than where nothing is known."""
    wire, view = Wire(), views_of("roboflag")[0]
    readings = structs.replace(view.readings, stamp=0.4, age=0.1, armed=False, estop=True, fault="hot", latched=True)
    full = structs.replace(
        view, pose=Pose(1.0, 2.0, 3.0, 0.5), priority="hail-mary", uncertainty=Uncertainty(0.1, 0.02, 0.3, 0.04),
        obstacles=(Circle(1.0, 2.0, 0.5, z_max=0.7),), readings=readings,
    )  # fmt: skip
    empty = View(
        0.0, view.me, Readings(0.0, 0.0, armed=True, estop=False), view.referee, {}, view.robot, Pose(0.0, 0.0, 0.0)
    )
    for name in View.__struct_fields__:
        same = name in ("me", "referee", "robot")
        assert (getattr(full, name) == getattr(empty, name)) is same, name
    for _ in range(2):
        assert plain(wire.shown(full)) == plain(full)


def test_what_is_always_the_same_is_sent_once() -> None:
    questions, view = Questions(), views_of("sharks-and-minnows")[0]
    first, second, third = (len(questions.packed(view)) for _ in range(3))
    assert second == third < first / 2


def test_a_kind_of_sensor_is_asked_for_once_and_then_sent() -> None:
    wire, view = Wire(), views_of("sharks-and-minnows")[0]
    for _ in range(3):
        readings = wire.shown(view).readings
        assert readings.latest(Ins) == view.readings.latest(Ins)
        assert readings.latest(Laser) is None is readings.latest(Laser, "front")
    assert wire.asked == ["ins", "laser"]
    readings = wire.shown(view).readings
    assert len(readings.samples) == 2
    assert [type(sample.value) for sample in readings.samples] == [type(s.value) for s in view.readings.samples]
    assert wire.asked == ["ins", "laser", EVERY_KIND]
    readings = wire.shown(view).readings
    assert readings.latest(Battery) == view.readings.latest(Battery)
    assert len(wire.asked) == 3


def test_a_view_that_is_kept_has_the_readings_of_its_instant_until_it_is_too_old() -> None:
    wire, view, other = Wire(), *views_of("sharks-and-minnows")[:2]
    first, second = wire.shown(view), wire.shown(view)
    assert second.readings.latest(Ins) == view.readings.latest(Ins)
    for _ in range(VIEWS_KEPT - 2):
        wire.shown(other)
    assert first.readings.latest(Ins) == view.readings.latest(Ins)
    wire.shown(other)
    with pytest.raises(LookupError, match="this view is older than 600 views: look at it while it is newer"):
        first.readings.latest(Battery)
    assert len(second.readings.samples) == 2
    wire.shown(other)
    assert second.readings.latest(Ins) == view.readings.latest(Ins), "what it had it keeps"


def test_one_that_asks_without_end_is_refused() -> None:
    wire, view = Wire(), views_of("sharks-and-minnows")[0]
    for number in range(100):
        wire.questions.told(Wanted(1, f"kind {number}"))
    wire.shown(view)
    with pytest.raises(TooManyQuestionsError, match="expected at most 100 questions about readings, and of 100 kinds"):
        wire.questions.told(Wanted(1, "another kind"))


def test_threads_of_a_strategy_may_look_at_readings_while_it_waits_for_the_next_view() -> None:
    questions, ways, asked = Questions(), queue.Queue[bytes](), queue.Queue[Wanted]()
    strategy, views = Answering(ways.get, asked.put), views_of("sharks-and-minnows")
    ways.put(questions.packed(views[0]))
    first, seen = strategy.view(), queue.Queue[object]()
    looking = [threading.Thread(target=lambda: seen.put(first.readings.latest(Ins)), daemon=True) for _ in range(2)]
    waiting = threading.Thread(target=lambda: seen.put(strategy.view().time), daemon=True)
    for thread in (waiting, *looking):
        thread.start()
    ways.put(questions.packed(views[0]))
    for _ in range(asked.qsize() or 1):
        ways.put(questions.told(asked.get(timeout=60.0)))
    while looking[0].is_alive() or looking[1].is_alive():
        with contextlib.suppress(queue.Empty):
            ways.put(questions.told(asked.get(timeout=0.01)))
    waiting.join(60.0)
    found = [seen.get(timeout=60.0) for _ in range(3)]
    assert sorted(map(str, found)) == sorted(map(str, [0.5, *[views[0].readings.latest(Ins)] * 2]))


def test_readings_are_made_when_they_are_looked_at_and_stay_what_they_were() -> None:
    keys, world, player = Keys("m"), Mailbox("world/world"), Mailbox("player/a")
    inlets = SensorInlets(keys, player, "a", [spec for spec in P2AT.sensors if spec.kind in ("ins", "battery")])
    world.deferring = [inlet.topic for inlet in player.inlets]
    transport, made = MemoryTransport(), list[float]()
    transport.attach(world)
    transport.attach(player)

    def seen(now: float) -> Readings:
        def make() -> list[SensorMessage]:
            made.append(now)
            return [Ins(pose=Pose(now, 0.0, 0.0))]

        for mailbox in (world, player):
            mailbox.handover(now)
        world.defer([topic for topic in world.deferring if topic.type is Ins], make)
        transport.send(world.collect())
        player.handover(now)
        return Readings(now, 0.0, armed=True, estop=False, samples=inlets.samples())

    readings = [seen(now) for now in (0.0, 0.1, 0.2, 0.3)]
    assert made == [0.0], "the first is sent to all, before it is known who hears it"
    places = [sample.value.pose.x for one in readings if (sample := one.latest(Ins)) is not None]
    assert places == made == [0.0, 0.1, 0.2, 0.3]
    assert [type(one) for one in pickle.loads(pickle.dumps(readings[3].samples))] == [Sample]
    assert (readings[3].samples[0], len(readings[3].samples)) == (readings[3].latest(Ins), 1)
    with pytest.raises(TypeError, match="expected the class of a sensor's message, such as Laser, got 'ins'"):
        readings[3].latest("ins")  # type: ignore[arg-type, type-var]
