"""The recording of a match, written and read back."""

import contextlib
import errno
import io
import json
import logging
import struct

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from zstandard import ZstdError

from tests.ui import synthetic
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.foxglove import SCHEMA_NAMES, heading_of, json_schema, pose_of
from vrg.bus.foxglove_scene import Shape
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.recording import Recorder
from vrg.bus.topics import Keys
from vrg.bus.tracks import Setting, read_calls, read_setting, read_tracks
from vrg.errors import MessageError

KEYS = Keys("test")


def record(output, until, **options):
    """A recorder that has heard the made-up match until then, not yet stopped."""
    recorder = Recorder("recorder", Mailbox(), KEYS, output, **options)
    go_on(recorder, 0.0, until)
    return recorder


def go_on(recorder, begin, until):
    match = synthetic.Match(KEYS)
    for tick in range(round(begin * 10), round(until * 10)):
        match.step(recorder, tick / 10, tick)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "match.mcap"
    record(path, 40.0).stop()
    return path


def messages_of(path, **options):
    with path.open("rb") as stream:
        return list(NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False, **options))


def test_a_viewer_finds_schemas_it_knows(file):
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    schemas = {channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()}
    names = {topic: schema.name for topic, schema in schemas.items()}
    assert names["/scene"] == "foxglove.SceneUpdate"
    assert names["/robot/nemo/pose"] == "foxglove.PoseInFrame"
    assert names["/referee/calls"] == "foxglove.Log"
    assert names["/referee/state"] == "vrg.RefereeState"
    assert names["/player/nemo/report"] == "vrg.Report"
    assert {schema.encoding for schema in schemas.values()} == {"jsonschema"}
    assert {channel.message_encoding for channel in summary.channels.values()} == {"json"}
    assert summary.statistics.channel_message_counts[1] == 400


@pytest.mark.parametrize("record_type", SCHEMA_NAMES)
def test_schemas_are_plain_objects_without_references_and_unions(record_type):
    text = json_schema(record_type).decode()
    assert json.loads(text)["type"] == "object"
    assert "$ref" not in text
    assert "anyOf" not in text
    assert '"null"' not in text


def test_times_are_match_time_in_nanoseconds(file):
    poses = messages_of(file, topics="/robot/nemo/pose")
    assert [message.log_time for _, _, message in poses[:3]] == [0, 100_000_000, 200_000_000]
    assert poses[11][2].publish_time == 1_100_000_000
    assert json.loads(poses[11][2].data)["timestamp"] == {"sec": 1, "nsec": 100_000_000}


def test_the_scene_shows_robots_and_zones_at_every_instant(file):
    for _, _, message in messages_of(file, topics="/scene")[::50]:
        entities = {entity["id"]: entity for entity in json.loads(message.data)["entities"]}
        assert set(entities) == {*synthetic.NAMES, "zone:field", "zone:safe zone", "zone:start"}
        place = entities["nemo"]["cubes"][0]["pose"]["position"]
        assert place["x"] == synthetic.pose_at("nemo", message.log_time / 1e9).x
    colours = {name: json.dumps(entities[name]["cubes"][0]["color"]) for name in synthetic.NAMES}
    assert colours["bruce"] == colours["gill"], "in the second pass gill is a shark"
    assert colours["nemo"] != colours["bruce"]


def test_calls_are_told_in_words_and_kept_in_numbers(file):
    words = [json.loads(message.data)["message"] for _, _, message in messages_of(file, topics="/referee/calls")]
    assert words == [call.text for call in synthetic.calls(40.0)]
    calls = read_calls(file)
    assert [(c.number, c.rule, c.players, c.poses, c.clock, c.round) for c in calls] == [
        (c.number, c.rule, c.players, c.poses, c.clock, 1) for c in synthetic.calls(40.0)
    ]


def test_tracks_are_read_back_with_roles_over_time(file):
    tracks = read_tracks(file)
    assert set(tracks) == set(synthetic.NAMES)
    gill = tracks["gill"]
    np.testing.assert_allclose(gill.times, np.arange(400) / 10)
    poses = [synthetic.pose_at("gill", tick / 10) for tick in range(400)]
    np.testing.assert_allclose(gill.x, [pose.x for pose in poses])
    np.testing.assert_allclose(gill.y, [pose.y for pose in poses])
    np.testing.assert_allclose(np.cos(gill.theta), [np.cos(pose.theta) for pose in poses], atol=1e-12)
    np.testing.assert_allclose(np.sin(gill.theta), [np.sin(pose.theta) for pose in poses], atol=1e-12)
    assert (gill.roles[0], gill.states[100], gill.roles[300], gill.states[300]) == (
        "minnow", "inactive", "shark", "active",
    )  # fmt: skip
    assert (gill.rounds[100], gill.rounds[300]) == (1, 2)
    assert gill.playing.all()
    assert {name for name, track in tracks.items() if track.physical} == {"bruce", "nemo"}


def test_the_game_and_the_zones_of_each_round_are_read_back(file):
    assert read_setting(file) == Setting("sharks-and-minnows", {1: synthetic.zones(1), 2: synthetic.zones(2)})


def test_a_report_is_written_when_it_changes(tmp_path):
    path = tmp_path / "match.mcap"
    recorder = record(path, 5.0)
    match = synthetic.Match(KEYS)
    fault = m.Report(mode="Minnow/Stopped", armed=False, fault="no laser", latched=True)
    match.say(recorder.mailbox, KEYS.report("nemo"), fault, 5.0, 99)
    recorder.mailbox.handover(5.0)
    recorder.tick(Tick(5.0))
    recorder.stop()
    reports = [json.loads(message.data) for _, _, message in messages_of(path, topics="/player/nemo/report")]
    assert [(r["mode"], r["fault"], r["latched"]) for r in reports] == [
        ("Minnow/Cross", "", False),
        ("Minnow/Stopped", "no laser", True),
    ]


def test_a_measured_pose_is_kept_as_it_came_beside_where_the_world_shows_the_robot(tmp_path):
    path = tmp_path / "match.mcap"
    recorder = record(path, 1.0)
    pose = m.MeasuredPose(pose=m.Pose(1.0, 2.0, np.pi / 2), v=0.5, w=0.0)
    synthetic.Match(KEYS).say(recorder.mailbox, KEYS.robot_pose("nemo"), pose, 0.95, 7)
    recorder.mailbox.handover(1.0)
    recorder.tick(Tick(1.0))
    recorder.stop()
    [(schema, _, message)] = messages_of(path, topics="/robot/nemo/measured")
    place = json.loads(message.data)["pose"]["position"]
    assert (schema.name, message.log_time) == ("foxglove.PoseInFrame", 950_000_000)
    assert (place["x"], place["y"]) == (1.0, 2.0)
    assert len(read_tracks(path)["nemo"].times) == 10, "a track is where the world showed it"


def test_physical_robots_have_a_rim_in_the_scene(file):
    _, _, message = messages_of(file, topics="/scene")[0]
    entities = {entity["id"]: entity for entity in json.loads(message.data)["entities"]}
    assert {name for name in synthetic.NAMES if entities[name]["lines"]} == {"bruce", "nemo"}


def test_lasers_are_recorded_where_they_are_on_the_robot(tmp_path):
    path = tmp_path / "match.mcap"
    recorder = Recorder("recorder", Mailbox(), KEYS, path, lasers=True, shapes={"nemo": Shape(laser_x=0.2)})
    ranges = np.array([1.0, 2.0, 8.0], dtype="<f4")
    scan = m.Laser(angle_min=-0.5, angle_step=0.5, range_max=8.0, data=ranges.tobytes())
    body = m.Body(name="nemo", pose=m.Pose(1.0, 2.0, np.pi / 2), v=0.0, w=0.0, physical=False)
    match = synthetic.Match(KEYS)
    match.say(recorder.mailbox, KEYS.laser("dory"), scan, 0.0, 0)
    match.say(recorder.mailbox, KEYS.laser("nemo"), scan, 0.0, 0)
    match.say(recorder.mailbox, KEYS.poses, m.Poses(bodies=[body]), 0.0, 0)
    recorder.mailbox.handover(0.0)
    recorder.tick(Tick(0.0))
    recorder.stop()
    [(schema, channel, message)] = [found for found in messages_of(path) if found[1].topic.endswith("laser")]
    data = json.loads(message.data)
    assert (schema.name, channel.topic) == ("foxglove.LaserScan", "/robot/nemo/laser")
    assert data["ranges"] == [1.0, 2.0, 8.0]
    assert (data["start_angle"], data["end_angle"]) == (-0.5, 0.5)
    assert data["pose"]["position"]["y"] == pytest.approx(2.2)


def test_scans_are_not_even_heard_unless_they_are_wanted():
    recorder = Recorder("recorder", Mailbox(), KEYS, io.BytesIO())
    assert m.Laser not in {inlet.topic.type for inlet in recorder.mailbox.inlets}


def test_what_a_killed_process_wrote_is_readable_to_its_last_second(tmp_path):
    path = tmp_path / "match.mcap"
    record(path, 12.0)
    times = read_tracks(path)["nemo"].times
    assert times[-1] >= 12.0 - 1.2


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
def test_a_file_that_is_cut_is_read_as_far_as_it_goes(file, tmp_path, share):
    whole = file.read_bytes()
    complete = read_tracks(file)["nemo"]
    cut = tmp_path / "cut.mcap"
    for size in range(int(len(whole) * share), int(len(whole) * share) + 60, 6):
        cut.write_bytes(whole[:size])
        tracks = read_tracks(cut)
        assert len(tracks["nemo"].times) >= 400 * (share - 0.12)
        np.testing.assert_array_equal(tracks["nemo"].x, complete.x[: len(tracks["nemo"].x)])


def test_mcaps_own_reader_reads_a_file_that_is_cut_in_half(file, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    count = 0
    with cut.open("rb") as stream, contextlib.suppress(McapError, ZstdError, struct.error):
        for _ in NonSeekingReader(stream).iter_messages(log_time_order=False):
            count += 1
    assert count > 1000


def test_an_empty_file_has_no_tracks_and_another_file_is_no_recording(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_bytes(b"")
    assert read_tracks(path) == {}
    path.write_bytes(b"this is some other file, long enough")
    with pytest.raises(MessageError, match="expected an MCAP recording"):
        read_tracks(path)
    with pytest.raises(FileNotFoundError):
        read_tracks(tmp_path / "none.mcap")


class FullDisk(io.BytesIO):
    """A file on a disk with little room left."""

    room = 40_000

    def write(self, data):
        if self.tell() + len(data) > self.room:
            part = bytes(data)[: max(0, self.room - self.tell())]
            super().write(part)
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


def test_a_full_disk_ends_the_recording_and_nothing_else(tmp_path, caplog):
    disk = FullDisk()
    with caplog.at_level(logging.ERROR):
        recorder = record(disk, 30.0)
        recorder.stop()
    assert "No space left on device" in recorder.fault
    assert not recorder.recording
    assert len(caplog.records) == 1, "logged once"
    path = tmp_path / "part.mcap"
    path.write_bytes(disk.getvalue())
    times = read_tracks(path)["nemo"].times
    assert times[0] == 0.0
    assert times[-1] > 2.0


def test_a_folder_that_is_not_there_ends_the_recording_and_nothing_else(tmp_path, caplog):
    recorder = record(tmp_path / "nowhere" / "match.mcap", 1.0)
    recorder.stop()
    assert "No such file or directory" in recorder.fault
    assert len(caplog.records) == 1


def test_a_restarted_recorder_does_not_overwrite_the_first_part(tmp_path):
    path = tmp_path / "match.mcap"
    first = record(path, 3.0)
    second = record(path, 5.0)
    second.stop()
    assert (first.path, second.path) == (path, tmp_path / "match-2.mcap")
    assert len(read_tracks(tmp_path / "match-2.mcap")["nemo"].times) == 50
    assert len(read_tracks(path)["nemo"].times) >= 20


def test_when_the_world_steps_back_in_time_the_track_is_what_happened(tmp_path):
    path = tmp_path / "match.mcap"
    recorder = record(path, 5.0)
    go_on(recorder, 4.0, 6.0)
    recorder.stop()
    np.testing.assert_allclose(read_tracks(path)["nemo"].times, np.arange(60) / 10)


def test_what_waits_is_written_out_when_the_clock_stops(tmp_path):
    path = tmp_path / "match.mcap"
    recorder = record(path, 0.5)
    before = path.stat().st_size
    recorder.tick(Tick(0.5, live=False))
    assert path.stat().st_size > before
    assert len(read_tracks(path)["nemo"].times) == 5


def test_stopping_twice_or_before_the_first_tick_is_harmless(tmp_path):
    path = tmp_path / "match.mcap"
    Recorder("recorder", Mailbox(), KEYS, path).stop()
    assert not path.exists()
    recorder = record(path, 1.0)
    recorder.stop()
    recorder.stop()
    assert recorder.fault is None


@pytest.mark.parametrize("theta", [0.0, 1.0, -3.0, 3.1, 7.0])
def test_a_heading_survives_its_quaternion(theta):
    assert np.exp(1j * heading_of(pose_of(0.0, 0.0, theta).orientation)) == pytest.approx(np.exp(1j * theta))


def test_a_stamp_just_below_a_whole_second_is_a_valid_time(tmp_path):
    path = tmp_path / "match.mcap"
    recorder = Recorder("recorder", Mailbox(), KEYS, path)
    [inlet] = [i for i in recorder.mailbox.inlets if i.topic.type is m.Poses]
    inlet.offer(Received(KEYS.poses.key, 0.9999999999, 0, synthetic.poses(1.0)))
    recorder.mailbox.handover(1.0)
    recorder.tick(Tick(1.0))
    recorder.stop()
    assert json.loads(messages_of(path)[0][2].data)["timestamp"] == {"sec": 1, "nsec": 0}
