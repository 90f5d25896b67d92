"""A recorded match looked at at any instant."""

import math

import pytest

from vrg.bus import messages as m
from vrg.recording.recorded import RecordedMatch, read_recorded
from vrg.testing.views import synthetic
from vrg.types import STILL, Pose
from vrg.ui.timeline import Timeline

SIZES = {"bruce": (0.8, 0.6)}


@pytest.fixture(scope="module")
def timeline(recorded):
    return Timeline(read_recorded(recorded), sizes=SIZES, obstacles=synthetic.OBSTACLES)


def without_rounding(scene):
    """The scene with headings and places to a millionth, since recordings keep headings as quaternions."""
    bodies = []
    for body in scene.bodies:
        heading = math.remainder(body.pose.theta, math.tau)
        bodies.append((body.name, *(round(v, 6) for v in (body.pose.x, body.pose.y, heading)), body.trail))
    rest = [(b.length, b.width, b.role, b.state, b.physical, b.out_of_play) for b in scene.bodies]
    fields = {name: value for name, value in vars(scene).items() if name != "bodies"}
    return bodies, rest, fields


@pytest.mark.parametrize("ticks", [0, 1, 57, 63, 90, 91, 104, 125, 126, 200, 201, 333, 399])
def test_the_scene_is_that_of_the_running_match(timeline, ticks):
    assert without_rounding(timeline.at(ticks / 10)) == without_rounding(
        synthetic.scene_at(ticks / 10, sizes=SIZES, reports=True)
    )


def test_the_scene_does_not_depend_on_what_was_looked_at_before(timeline):
    times = [0.0, 12.34, 39.9, 5.0]
    there = [timeline.at(time) for time in times]
    back = [timeline.at(time) for time in reversed(times)]
    assert there == back[::-1]


def test_before_the_referee_spoke_its_first_words_tell_the_field():
    poses = [(time, synthetic.poses(time)) for time in (0.0, 0.2)]
    scene = Timeline(RecordedMatch(poses=poses, states=[(0.2, synthetic.state(0.2))])).at(0.0)
    assert (scene.game, scene.zones) == ("sharks-and-minnows", synthetic.zones())


def test_it_begins_and_ends_with_the_recording(timeline):
    assert (timeline.begin, timeline.end) == (0.0, 39.9)
    assert list(timeline.instants) == [tick / 10 for tick in range(400)]


def test_calls_have_their_time_and_their_words(timeline):
    assert [(call.time, call.text) for call in timeline.calls] == [(c.clock, c.text) for c in synthetic.calls(40.0)]
    assert all(call.marked for call in timeline.calls)


def test_a_call_is_there_from_its_instant_on(timeline):
    assert not timeline.at(8.99).calls
    shown = timeline.at(9.0)
    assert [call.rule for call in shown.calls] == ["tag"]
    assert [flash.word for flash in shown.flashes] == ["tag"]
    assert not timeline.at(11.0).flashes


def test_a_fast_replay_shows_a_call_for_as_much_real_time(timeline):
    assert timeline.at(15.0, rate=8.0).flashes
    assert timeline.at(15.0, rate=8.0).rate == 8.0


def test_bodies_drive_smoothly_between_two_instants(timeline):
    before, between, after = (timeline.at(time).bodies[0].pose for time in (4.0, 4.05, 4.1))
    assert between.x == pytest.approx((before.x + after.x) / 2)
    assert between.y == pytest.approx((before.y + after.y) / 2)
    assert between.theta == pytest.approx((before.theta + after.theta) / 2)


def match_of(*places, **said):
    """A match with one robot that was at these (time, x, y, heading)."""
    return RecordedMatch(
        poses=[
            (time, m.Poses(bodies=(m.Body(name="a", pose=Pose(x, y, theta), twist=STILL, physical=False),)))
            for time, x, y, theta in places
        ],
        **said,
    )


def pose_in(timeline, time):
    [body] = timeline.at(time).bodies
    return body.pose


def test_a_heading_turns_the_short_way():
    timeline = Timeline(match_of((0.0, 0.0, 0.0, 3.1), (0.1, 0.0, 0.0, -3.1)))
    assert abs(pose_in(timeline, 0.05).theta) == pytest.approx(math.pi)
    assert abs(pose_in(timeline, 0.03).theta) > 3.1


def test_a_body_that_was_put_elsewhere_does_not_drive_there():
    timeline = Timeline(match_of((0.0, 0.0, 0.0, 0.0), (0.1, 8.0, 0.0, 0.0)))
    assert pose_in(timeline, 0.09).x == 0.0
    assert pose_in(timeline, 0.1).x == 8.0


def test_nobody_knows_what_a_body_did_while_nothing_was_recorded():
    timeline = Timeline(match_of((0.0, 0.0, 0.0, 0.0), (3.0, 0.9, 0.0, 0.0)))
    assert pose_in(timeline, 2.9).x == 0.0


def test_a_body_that_goes_away_stands_until_then_and_one_that_comes_later_is_not_there_before():
    match = match_of((0.0, 0.0, 0.0, 0.0), (0.1, 0.1, 0.0, 0.0))
    b = m.Body(name="b", pose=Pose(5.0, 5.0, 0.0), twist=STILL, physical=False)
    match.poses.append((0.2, m.Poses(bodies=(b,))))
    timeline = Timeline(match)
    assert [body.name for body in timeline.at(0.15).bodies] == ["a"]
    assert timeline.at(0.15).starts == ((0.0, 0.0),)
    assert [body.name for body in timeline.at(0.2).bodies] == ["b"]
    assert timeline.at(0.2).starts == ((0.0, 0.0), (5.0, 5.0))


def test_the_referee_may_be_heard_before_the_first_and_after_the_last_pose():
    over = synthetic.state(9.0, stage=m.Stage.GAME_OVER, winner="sharks")
    timeline = Timeline(match_of((1.0, 0.0, 0.0, 0.0), states=[(0.5, synthetic.state(0.5)), (2.0, over)]))
    assert (timeline.begin, timeline.end) == (1.0, 2.0)
    assert timeline.at(1.0).game == "sharks-and-minnows"
    assert timeline.at(2.0).winner == "sharks"


def test_the_emergency_stop_is_shown_while_it_is_engaged():
    orders = [(1.0, m.Estop(by="ann", reason="smoke")), (2.0, m.EstopRelease(by="ann"))]
    timeline = Timeline(match_of(*((t / 2, 0.0, 0.0, 0.0) for t in range(8)), estops=orders))
    assert [timeline.at(time).estop for time in (0.9, 1.0, 1.9, 2.0)] == [False, True, True, False]
    assert timeline.at(1.5).estop_reason == "pressed by ann: smoke"


def test_a_release_that_was_not_recorded_is_made_up_for_by_the_referee():
    states = [(time, synthetic.state(time, estop=estop)) for time, estop in ((0.5, False), (1.2, True), (2.0, False))]
    timeline = Timeline(
        match_of(*((t / 2, 0.0, 0.0, 0.0) for t in range(8)), estops=[(1.0, m.Estop(by="ann"))], states=states)
    )
    assert [timeline.at(time).estop for time in (0.9, 1.0, 1.9, 2.0)] == [False, True, True, False]


def test_sketches_are_shown_until_the_next_one():
    said = [(1.0, m.Sketch(strokes=(m.Stroke(points=((1.0, 2.0),)),))), (2.0, m.Sketch(strokes=()))]
    places = [(t / 2, 0.0, 0.0, 0.0) for t in range(8)]
    timeline = Timeline(match_of(*places, states=[(0.0, synthetic.state(0.0))], sketches={"nemo": said}))
    assert [len(timeline.at(time).strokes) for time in (0.9, 1.0, 1.9, 2.0)] == [0, 1, 1, 0]


def test_what_an_official_was_refused_is_no_mark():
    refused = m.Call(number=1, rule="refused", text="no", players=(), poses=(), clock=0.0)
    timeline = Timeline(match_of((0.0, 0.0, 0.0, 0.0), calls=[(0.0, refused)]))
    assert not timeline.calls


def test_a_game_that_is_not_installed_is_shown_all_the_same():
    states = [(0.0, synthetic.state(0.0, game="chess-on-wheels"))]
    timeline = Timeline(match_of((0.0, 0.0, 0.0, 0.0), states=states))
    assert timeline.at(0.0).game == "chess-on-wheels"


def test_a_recording_without_a_pose_is_refused():
    with pytest.raises(ValueError, match="where the robots were"):
        Timeline(RecordedMatch())


def test_a_recording_that_is_cut_in_half_is_shown_as_far_as_it_goes(recorded, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recorded.read_bytes()[: recorded.stat().st_size // 2])
    timeline = Timeline(read_recorded(cut))
    assert 10.0 < timeline.end < 30.0
    assert len(timeline.at(timeline.end).bodies) == len(synthetic.NAMES)
