"""A strategy in a process of its own is shown what it would be shown in the process of its match."""

import pickle

from msgspec import structs

from vrg.agents.radio import TeamMessage
from vrg.agents.strategy import View
from vrg.bus.mailbox import Mailbox
from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Observation
from vrg.hal.readings import Readings, SensorInlets
from vrg.hal.sensors.ins import Ins
from vrg.playing.question import packed, unpacked
from vrg.types import Pose


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
            if inlet.topic.type is Ins:
                mailbox.publish(inlet.topic, Ins(pose=poses[me.name]))
                inlet.offer(mailbox.collect()[0].message)
        mailbox.handover(0.5)
        readings = Readings(0.5, 0.0, armed=True, estop=False, samples=inlets.samples())
        heard = [TeamMessage("mate", 0.4, {"at": [1.5, 2.0]})]
        views.append(View(0.5, me, readings, state, velocities, robot, poses[me.name], heard, obstacles=()))
    return [*views, structs.replace(views[0], me=structs.replace(views[0].me, role="spectator"))]


def plain(view: View) -> View:
    return structs.replace(view, readings=structs.replace(view.readings, samples=tuple(view.readings.samples)))


def test_what_arrives_is_what_was_sent_whoever_is_asked_and_how_often() -> None:
    for game in ("sharks-and-minnows", "pursuit-evasion", "roboflag"):
        before: View | None = None
        for view in (views := views_of(game)):
            known = None if before is None or before.robot is not view.robot else view.robot
            arrived = unpacked(packed(view, known), before if known is not None else None)
            assert plain(arrived) == plain(view)
            assert len(plain(view).readings.samples) == 1
            before = view
        whole, again = packed(views[0], None), packed(views[0], views[0].robot)
        assert len(again) < len(whole)


def test_its_readings_stay_what_they_were_when_it_was_asked() -> None:
    view = views_of("sharks-and-minnows")[0]
    sample = view.readings.latest(Ins)
    assert sample is not None
    assert (sample.stamp, sample.age, sample.value.pose) == (0.0, 0.5, view.pose)
    assert [type(one) for one in pickle.loads(pickle.dumps(view.readings.samples))] == [type(sample)]
