"""A recording read back, whole and torn."""

import contextlib
import json
import struct

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from zstandard import ZstdError

from tests.recording.recordings import go_on, messages_of, record
from vrg.errors import MessageError
from vrg.recording.reader import Setting, calls_of, read_tracks, setting_of
from vrg.recording.recorded import read_recorded
from vrg.testing.views import synthetic


def test_calls_are_told_in_words_and_kept_in_numbers(file):
    words = [json.loads(message.data)["message"] for _, _, message in messages_of(file, topics="/view/calls")]
    assert words == [call.text for call in synthetic.calls(40.0)]
    calls = calls_of(read_recorded(file))
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
    zones = {number: synthetic.zones(number) for number in (1, 2)}
    assert setting_of(read_recorded(file)) == Setting("sharks-and-minnows", zones)


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


def test_an_empty_file_has_no_tracks_and_is_torn_and_another_file_is_no_recording(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_bytes(b"")
    assert read_tracks(path) == {}
    assert read_recorded(path).torn == [path]
    path.write_bytes(b"this is some other file, long enough")
    for read in (read_tracks, read_recorded):
        with pytest.raises(MessageError, match="expected an MCAP recording"):
            read(path)
    with pytest.raises(FileNotFoundError):
        read_tracks(tmp_path / "none.mcap")


def test_when_the_world_steps_back_in_time_the_track_is_what_happened(path):
    recorder = record(path, 5.0)
    go_on(recorder, 4.0, 6.0)
    recorder.stop()
    np.testing.assert_allclose(read_tracks(path)["nemo"].times, np.arange(60) / 10)
