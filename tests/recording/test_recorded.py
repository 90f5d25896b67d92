"""A recording turned back into messages."""

import pytest
from msgspec import Struct
from msgspec.structs import replace

from tests.recording.recordings import KEYS, go_on, hear, record
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.errors import MessageError
from vrg.recording.mcap_file import McapFile
from vrg.recording.recorded import read_recorded
from vrg.recording.recorder import Recorder
from vrg.testing.views import synthetic
from vrg.types import Pose, Twist


def test_everything_that_windows_hear_comes_back(file):
    match = read_recorded(file)
    assert [stamp for stamp, _ in match.poses] == [tick / 10 for tick in range(400)]
    stamp, poses = match.poses[123]
    assert poses == synthetic.poses(stamp)
    assert [call for _, call in match.calls] == synthetic.calls(40.0)
    stamp, state = match.states[300]
    said = synthetic.state(stamp)
    assert state == replace(said, players=tuple(said.players))
    assert {(r.mode, r.armed, r.battery) for _, r in match.reports["nemo"]} == {("Minnow/Cross", True, 0.8)}
    assert not match.torn


def test_the_marks_on_which_players_line_up_and_the_way_out_of_a_halt_come_back(recorder, path):
    state = synthetic.state(1.0, halted="a cable", way_out="plug it in")
    mark = Pose(1.0, 2.0, 0.5)
    marked = replace(state, players=(replace(state.players[0], mark=mark), *state.players[1:]))
    hear(recorder, (KEYS.referee_state, marked, 1.0))
    recorder.stop()
    (_, read) = read_recorded(path).states[0]
    assert [player.mark for player in read.players] == [mark, *[None] * (len(state.players) - 1)]
    assert (read.halted, read.way_out) == ("a cable", "plug it in")


def test_orders_of_the_emergency_stop_and_sketches_come_back(recorder, path):
    sketch = m.Sketch(strokes=(m.Stroke(points=((1.0, 2.0), (3.0, 4.0)), label="goal"),))
    hear(recorder, (KEYS.estop, m.Estop(by="ann", reason="smoke"), 1.0), (KEYS.sketch("nemo"), sketch, 1.0))
    hear(recorder, (KEYS.estop_release, m.EstopRelease(by="bob"), 2.0))
    recorder.stop()
    found = read_recorded(path)
    assert found.estops == [(1.0, m.Estop(by="ann", reason="smoke")), (2.0, m.EstopRelease(by="bob"))]
    [(stamp, back)] = found.sketches["nemo"]
    assert (stamp, back) == (1.0, sketch)


def test_a_robot_that_was_taken_out_of_the_world_is_not_there_any_more(recorder, path):
    hear(recorder, (KEYS.poses, synthetic.poses(1.0), 1.0))
    hear(recorder, (KEYS.poses, m.Poses(bodies=synthetic.poses(1.1).bodies[2:]), 1.1))
    recorder.stop()
    assert [len(poses.bodies) for _, poses in read_recorded(path).poses] == [7, 5]


def test_the_parts_of_a_recorder_that_was_started_again_are_one_match(path, tmp_path):
    first, second = path, tmp_path / "match-2.mcap"
    recorder = record(first, 11.0)
    torn = first.read_bytes()
    recorder.stop()
    first.write_bytes(torn)
    recorder = Recorder("recorder", Mailbox(), KEYS, second)
    go_on(recorder, 12.0, 15.0)
    recorder.stop()
    match = read_recorded([first, second])
    assert match.torn == [first]
    assert [call.number for _, call in match.calls] == [1, 2]
    times = [stamp for stamp, _ in match.poses]
    assert times == sorted(times)
    assert (times[0], times[-1]) == (0.0, 14.9)


def test_after_a_restart_of_the_world_only_what_happened_is_left_and_all_that_was_said(path):
    recorder = record(path, 10.0)
    go_on(recorder, 8.0, 9.5)
    recorder.stop()
    match = read_recorded(path)
    assert [stamp for stamp, _ in match.poses] == [tick / 10 for tick in range(95)]
    assert [(stamp, call.number) for stamp, call in match.calls] == [(8.0, 1)], "it is not called twice"
    assert max(stamp for stamp, _ in match.states) == 9.4
    stamps = [stamp for stamp, _ in match.states]
    assert stamps == sorted(stamps)
    for commands in match.commands.values():
        stamps = [stamp for stamp, _ in commands]
        assert stamps == sorted(set(stamps)), "what was commanded beyond did not happen"
    assert match.commands


def test_an_instant_of_which_a_part_is_missing_is_left_out(file, tmp_path):
    whole, cut = file.read_bytes(), tmp_path / "cut.mcap"
    for size in range(len(whole) // 2, len(whole) // 2 + 2000, 40):
        cut.write_bytes(whole[:size])
        match = read_recorded(cut)
        assert match.torn == [cut]
        assert {len(poses.bodies) for _, poses in match.poses} == {len(synthetic.NAMES)}


class Siesta(Struct):
    """A state of another release, in which the stage has another word."""

    stage: str = "siesta"


@pytest.mark.parametrize(
    ("topics", "said"),
    [
        (["/referee/state"], r"/referee/state: expected vrg\.RefereeState: .*siesta"),
        (["/robot/ann/pose", "/scene"], "one of an earlier VRG"),
    ],
    ids=["another message", "an earlier release"],
)
def test_what_another_version_has_recorded_is_refused(path, topics, said):
    file = McapFile(path)
    for topic in topics:
        file.write(topic, Siesta(), 0.0, 0)
    file.finish()
    with pytest.raises(MessageError, match=said):
        read_recorded(path)


def test_readings_of_a_sensor_that_are_not_such_as_here_make_nothing_unreadable(path):
    file = McapFile(path)
    file.write("/robot/nemo/sensor/ins/ins", Siesta(), 0.0, 0)
    file.write("/poses", synthetic.poses(1.0), 1.0, 0)
    file.finish()
    assert read_recorded(path).poses == [(1.0, synthetic.poses(1.0))]


def test_what_was_recorded_out_of_order_after_a_restart_of_the_world_is_kept_and_put_in_order(path):
    file = McapFile(path)
    still = m.Motion(odometry=Pose(0.0, 0.0, 0.0), twist=Twist(0.0, 0.0))
    for topic, message, times in (
        ("/poses", synthetic.poses(1.0), [1.0, 2.0]),
        ("/robot/nemo/motion", still, [1.1, 2.0, 1.55, 1.52]),
        ("/poses", synthetic.poses(1.5), [1.5]),
    ):
        for time in times:
            file.write(topic, message, time, 0)
    file.finish()
    match = read_recorded(path)
    assert [stamp for stamp, _ in match.poses] == [1.0, 1.5]
    assert [stamp for stamp, _ in match.motions["nemo"]] == [1.1, 1.52, 1.55]
