"""What the recorder writes, and what it does when it cannot."""

import base64
import errno
import io
import json
import logging
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader

from tests.recording.recordings import KEYS, hear, messages_of, record, written
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.colours import SKY_BLUE, VERMILLION
from vrg.games import game_of
from vrg.hal.models.pioneer import P2AT
from vrg.hal.sensors import png
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.camera import Camera
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.sonar import Sonar, SonarSpec
from vrg.hal.sensors.touch import Touch
from vrg.hal.sim.map import WALL_HEIGHT
from vrg.recording.reader import read_tracks, setting_of
from vrg.recording.recorded import read_recorded
from vrg.recording.recorder import Recorder
from vrg.testing.views import synthetic
from vrg.types import STILL, Pose, Twist


def test_a_viewer_finds_schemas_it_knows(file):
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    schemas = {channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()}
    names = {topic: schema.name for topic, schema in schemas.items()}
    assert names["/view/scene"] == "foxglove.SceneUpdate"
    assert names["/view/robot/nemo"] == "foxglove.PoseInFrame"
    assert names["/view/calls"] == "foxglove.Log"
    assert names["/referee/state"] == "vrg.RefereeState"
    assert names["/player/nemo/report"] == "vrg.Report"
    assert names["/poses"] == "vrg.Poses"
    assert {schema.encoding for schema in schemas.values()} == {"jsonschema"}
    assert {channel.message_encoding for channel in summary.channels.values()} == {"json"}
    [pose] = [number for number, channel in summary.channels.items() if channel.topic == "/view/robot/nemo"]
    assert summary.statistics.channel_message_counts[pose] == 400


def test_times_are_match_time_in_nanoseconds(file):
    poses = messages_of(file, topics="/view/robot/nemo")
    assert [message.log_time for _, _, message in poses[:3]] == [0, 100_000_000, 200_000_000]
    message = poses[11][2]
    assert (message.publish_time, message.sequence) == (1_100_000_000, 11), "the number is its publisher's"
    assert json.loads(message.data)["timestamp"] == {"sec": 1, "nsec": 100_000_000}


def entities_of(message):
    return {entity["id"]: entity for entity in json.loads(message.data)["entities"]}


def test_the_scene_shows_robots_at_every_instant(file):
    for _, _, message in messages_of(file, topics="/view/scene")[::50]:
        entities = entities_of(message)
        assert set(entities) == set(synthetic.NAMES)
        place = entities["nemo"]["cubes"][0]["pose"]["position"]
        assert place["x"] == synthetic.pose_at("nemo", message.log_time / 1e9).x
        assert {name for name in synthetic.NAMES if entities[name]["lines"]} == {"bruce", "nemo"}, "physical: a rim"
    colours = {name: entities[name]["cubes"][0]["color"] for name in synthetic.NAMES}
    for name, colour in (("bruce", VERMILLION), ("gill", VERMILLION), ("nemo", SKY_BLUE)):
        assert [round(255 * colours[name][part]) for part in "rgb"] == list(colour), (
            "in the second pass gill is a shark"
        )


def test_the_whole_field_is_shown_anew_when_its_zones_change(file):
    fields = messages_of(file, topics="/view/field")
    assert [message.log_time for _, _, message in fields] == [0, 20_100_000_000], "the ends swap after the first pass"
    for _, _, message in fields:
        assert set(entities_of(message)) == {"field field", "zone safe zone", "zone start", "border field"}
        assert [deleted["type"] for deleted in json.loads(message.data)["deletions"]] == [1], "all of what was shown"
    north, south = (entities_of(message)["zone safe zone"]["lines"][-1]["points"][0]["y"] for _, _, message in fields)
    assert north > south


def test_walls_and_obstacles_are_blocks_as_high_as_in_the_world(path):
    record(path, 1.0, obstacles=synthetic.OBSTACLES).stop()
    [(schema, _, message)] = messages_of(path, topics="/view/map")
    assert schema.name == "foxglove.SceneUpdate"
    blocks = entities_of(message)
    assert set(blocks) == {"wall 0", "wall 1", "wall 2"}
    [wall] = blocks["wall 0"]["triangles"]
    assert {(p["x"], p["y"]) for p in wall["points"]} == set(synthetic.OBSTACLES[0].outline())
    assert {p["z"] for p in wall["points"]} == {0.0, WALL_HEIGHT}
    assert len(wall["indices"]) == 3 * (2 + 2 * 4), "two triangles on top and two on each of four sides"
    corners = np.array([[p["x"], p["y"], p["z"]] for p in wall["points"]])
    triangles = corners[np.array(wall["indices"])].reshape(-1, 3, 3)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    outward = ((triangles.mean(axis=1) - corners.mean(axis=0)) * normals).sum(axis=1)
    assert (outward > 0).all(), "a viewer may draw only the sides that face it"


def test_reports_are_recorded_as_they_were_published(path, recorder):
    said = [
        (0.1 * number, m.Report(mode="x", armed=True, command=Twist(0.1 * number, -0.2), battery=charge))
        for number, charge in enumerate((0.5001, 0.5002, None))
    ]
    said.append((2.0, m.Report(mode="x", armed=False, fault="no laser", latched=True)))
    for stamp, report in said:
        hear(recorder, (KEYS.report("nemo"), report, stamp))
    recorder.stop()
    found = read_recorded(path)
    assert found.reports["nemo"] == said
    assert found.commands["nemo"] == [(stamp, report.command) for stamp, report in said[:3]]


def test_a_zone_of_any_shape_is_outlined_in_the_scene_and_read_back(path, recorder):
    synthetic.SyntheticMatch(KEYS).step(recorder, 0.0, 0, zones=synthetic.four_shapes())
    recorder.stop()
    [(_, _, message)] = messages_of(path, topics="/view/field")
    entities = entities_of(message)
    for zone in synthetic.four_shapes():
        name = f"{'border' if zone.kind == 'field' else 'zone'} {zone.name}"
        points = entities[name]["lines"][-1]["points"]
        assert np.array([(point["x"], point["y"]) for point in points]) == pytest.approx(
            np.array(zone.region.outline()), abs=0.001
        )
    assert setting_of(read_recorded(path)).zones == {1: synthetic.four_shapes()}


def test_a_game_that_is_not_installed_here_is_recorded_too(path, recorder):
    game = "a-game-from-elsewhere"
    synthetic.SyntheticMatch(KEYS).step(recorder, 0.0, 0, game=game)
    recorder.stop()
    assert setting_of(read_recorded(path)).game == game
    _, _, message = messages_of(path, topics="/view/scene")[0]
    entities = entities_of(message)
    assert entities["bruce"]["cubes"][0]["color"]["r"] == game_of(game).style("shark", "active").colour[0] / 255


def test_a_measured_pose_is_kept_as_it_came_beside_where_the_world_shows_the_robot(path):
    recorder = record(path, 1.0)
    pose = m.MeasuredPose(pose=Pose(1.0, 2.0, np.pi / 2), twist=Twist(0.5, 0.0))
    hear(recorder, (KEYS.robot_pose("nemo"), pose, 0.95))
    recorder.stop()
    [(schema, _, message)] = messages_of(path, topics="/robot/nemo/pose")
    assert (schema.name, message.log_time) == ("vrg.MeasuredPose", 950_000_000)
    assert read_recorded(path).measured["nemo"] == [(0.95, pose)]
    assert len(read_tracks(path)["nemo"].times) == 10, "a track is where the world showed it"


MODELS = {"nemo": P2AT, "dory": P2AT}
SCAN = Laser(angle_min=-0.5, angle_step=0.5, range_max=8.0, data=np.array([1.0004, 2.0, 8.0], dtype="<f4").tobytes())


def recorded_readings(path, said, models=MODELS):
    """What a recorder writes of readings at one instant, as (schema, topic, JSON)."""
    recorder = Recorder("recorder", Mailbox(), KEYS, path, models=models)
    body = m.Body(name="nemo", pose=Pose(1.0, 2.0, np.pi / 2), twist=STILL, physical=False)
    hear(recorder, (KEYS.poses, m.Poses(bodies=(body,)), 0.0), *((topic, reading, 0.0) for topic, reading in said))
    recorder.stop()
    assert recorder.fault is None
    own = ("/poses", "/view/scene", "/view/robot/nemo")
    return [
        (schema.name, channel.topic, json.loads(message.data))
        for schema, channel, message in messages_of(path)
        if channel.topic not in own
    ]


def test_lasers_are_recorded_where_they_are_on_the_robot_each_on_a_topic_of_its_own(path):
    laser = P2AT.sensor(LaserSpec)
    two = {"nemo": replace(P2AT, sensors=(laser, replace(laser, name="rear"))), "dory": P2AT}
    said = [(KEYS.sensor(Laser, *of), SCAN) for of in (("dory", "front"), ("nemo", "front"), ("nemo", "rear"))]
    found = recorded_readings(path, said, two)
    assert [topic for _, topic, _ in found] == ["/view/nemo/laser/front", "/view/nemo/laser/rear"]
    schema, _, data = found[0]
    assert schema == "foxglove.LaserScan"
    assert data["ranges"] == [1.0, 2.0, 8.0], "in whole mm"
    assert (data["start_angle"], data["end_angle"]) == (-0.5, 0.5)
    assert laser.x > 0.0
    assert data["pose"]["position"]["y"] == pytest.approx(2.0 + laser.x)


RING = next(spec for spec in P2AT.sensors if isinstance(spec, SonarSpec))


def echoes(**heard: float) -> Sonar:
    """A reading of the Pioneer's ring in which the numbered transducers hear something."""
    ranges = [heard.get(f"t{number}", RING.range_max) for number in range(len(RING.places))]
    return Sonar(range_max=RING.range_max, ranges=tuple(ranges))


def test_a_sonar_is_recorded_as_ranges_and_as_cones_that_end_where_it_heard_something(tmp_path):
    said = [(KEYS.sensor(Sonar, "nemo", "rings"), echoes(t3=1.25 + 1e-15))]
    [ranges, cones] = recorded_readings(tmp_path / "match.mcap", said)
    assert ranges[:2] == ("vrg.Sonar", "/robot/nemo/sensor/sonar/rings")
    assert (ranges[2]["ranges"][3], ranges[2]["ranges"][4], ranges[2]["range_max"]) == (1.25, 5.0, 5.0)
    assert cones[:2] == ("foxglove.SceneUpdate", "/view/nemo/sonar/rings")
    [entity] = cones[2]["entities"]
    [drawn] = entity["triangles"]
    place = drawn["pose"]["position"]
    assert (place["x"], place["y"]) == (1.0, 2.0), "points are relative to the body, which is there"
    apex, *ends = drawn["points"]
    transducer = RING.places[3]
    assert (apex["x"], apex["y"]) == (transducer.x, transducer.y)
    for end in ends:
        assert np.hypot(end["x"] - apex["x"], end["y"] - apex["y"]) == pytest.approx(1.25, abs=2e-3)
    bearings = [np.arctan2(end["y"] - apex["y"], end["x"] - apex["x"]) for end in ends]
    assert bearings[1] - bearings[0] == pytest.approx(RING.cone, abs=2e-3)


def test_where_a_sonar_hears_nothing_its_cones_go_and_another_ring_than_the_models_has_none(tmp_path):
    topic = KEYS.sensor(Sonar, "nemo", "rings")
    [_, (_, _, cones)] = recorded_readings(tmp_path / "1.mcap", [(topic, echoes())])
    [entity] = cones["entities"]
    assert (entity["id"], entity["triangles"]) == ("nemo/rings", [])
    other = {"nemo": replace(P2AT, sensors=(replace(RING, places=RING.places[:3]),))}
    [(_, name, _)] = recorded_readings(tmp_path / "2.mcap", [(topic, echoes(t3=1.25))], other)
    assert name == "/robot/nemo/sensor/sonar/rings"


PICTURE = png.encode(np.full((4, 6, 3), 200, dtype=np.uint8))
READINGS: dict[str, tuple[list[tuple[str, str, m.SensorMessage]], list[tuple[str, str]], dict[str, object]]] = {
    "a place on the Earth in degrees for the map, and without a fix not at all": (
        [("nemo", "main", Gps(latitude=np.pi / 4, longitude=-np.pi / 2, satellites=7)),
         ("dory", "main", Gps(latitude=None, longitude=None, satellites=2))],
        [("foxglove.LocationFix", "/view/nemo/gps/main")],
        {"latitude": 45.0, "longitude": -90.0, "timestamp": {"sec": 0, "nsec": 0}},
    ),
    "a picture as a file that viewers open": (
        [("nemo", "main", Camera(fov=1.0, data=PICTURE))], [("foxglove.CompressedImage", "/view/nemo/camera/main")],
        {"format": "png", "data": base64.b64encode(PICTURE).decode()},
    ),
    "a scan of a laser that nobody knows": (
        [("nemo", "rear", SCAN)], [("vrg.Laser", "/robot/nemo/sensor/laser/rear")], {},
    ),
    "a sensor that is called pose is no pose": (
        [("dory", "pose", Touch(pressed=(True, False)))], [("vrg.Touch", "/robot/dory/sensor/touch/pose")],
        {"pressed": [True, False]},
    ),
    "not what the poses tell too": (
        [("nemo", "main", Ins(pose=Pose(1.0, 2.0, 0.0))), ("nemo", "main", Battery(charge=0.5)),
         ("nemo", "main", Odometry(pose=Pose(0.1, 0.0, 0.0), twist=Twist(0.7, 0.0)))], [], {},
    ),
}  # fmt: skip
"""Readings, each of a robot's sensor; as what and where they are recorded, and some of it."""


@pytest.mark.parametrize(("said", "kept", "values"), READINGS.values(), ids=READINGS)
def test_what_is_recorded_of_readings(path, said, kept, values):
    found = recorded_readings(path, [(KEYS.sensor(type(body), robot, name), body) for robot, name, body in said])
    assert [(schema, topic) for schema, topic, _ in found] == kept
    assert all(data.items() >= values.items() for _, _, data in found)
    assert list(read_tracks(path)) == ["nemo"]


def test_bumpers_are_written_when_they_change(path):
    recorder = Recorder("recorder", Mailbox(), KEYS, path, models=MODELS)
    for number, pressed in enumerate([False, False, True, True, False]):
        robots = ("nemo", "dory") if number == 0 else ("nemo",)
        reading = Touch(pressed=(pressed, False))
        hear(recorder, *((KEYS.sensor(Touch, robot, "main"), reading, number / 10) for robot in robots))
    recorder.stop()
    found = [(channel.topic, message.log_time / 1e8) for _, channel, message in messages_of(path)]
    assert [at for topic, at in found if "nemo" in topic] == [0, 2, 4]
    assert [at for topic, at in found if "dory" in topic] == [0]


def test_without_models_no_sensor_is_heard():
    recorder = Recorder("recorder", Mailbox(), KEYS, io.BytesIO())
    assert not any(issubclass(inlet.topic.type, m.SensorMessage) for inlet in recorder.mailbox.inlets)


class FullDisk(io.BytesIO):
    """A file on a disk with little room left."""

    room = 40_000

    def write(self, data):
        if self.tell() + len(data) > self.room:
            part = bytes(data)[: max(0, self.room - self.tell())]
            super().write(part)
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


def test_a_full_disk_ends_the_recording_and_nothing_else(path, caplog):
    disk = FullDisk()
    with caplog.at_level(logging.ERROR):
        recorder = record(disk, 30.0)
        recorder.stop()
    assert "No space left on device" in recorder.fault
    assert not recorder.recording
    assert len(caplog.records) == 1, "logged once"
    path.write_bytes(disk.getvalue())
    times = read_tracks(path)["nemo"].times
    assert times[0] == 0.0
    assert times[-1] > 2.0


@pytest.mark.parametrize(("number", "stamp"), [(2**32, 0.2), (-1, 0.2), (0, -0.1), (0, 2e10)])
def test_a_message_that_no_recording_can_hold_is_left_out_alone(path, caplog, number, stamp):
    recorder, match = record(path, 0.2), synthetic.SyntheticMatch(KEYS)
    for time, sequence in ((stamp, number), (0.3, 2**32 - 1)):
        match.say(recorder.mailbox, KEYS.report("nemo"), synthetic.report("nemo"), time, sequence)
        recorder.mailbox.handover(0.3)
        recorder.tick(Tick(0.3))
    recorder.stop()
    assert recorder.fault is None
    assert "is not recorded: /player/nemo/report: expected a number from 0 to 4294967295" in caplog.text
    assert [message.sequence for _, _, message in messages_of(path, topics="/player/nemo/report")] == [0, 1, 2**32 - 1]
    assert len(read_tracks(path)["nemo"].times) == 2, "what is around it can be read"


def test_a_folder_that_is_not_there_ends_the_recording_and_nothing_else(tmp_path, caplog):
    recorder = record(tmp_path / "nowhere" / "match.mcap", 1.0)
    recorder.stop()
    assert "No such file or directory" in recorder.fault
    assert len(caplog.records) == 1


def test_a_restarted_recorder_does_not_overwrite_the_first_part_which_is_there_to_its_last_second(path, tmp_path):
    first = record(path, 3.0)
    second = record(path, 5.0)
    second.stop()
    assert (first.path, second.path) == (path, tmp_path / "match-2.mcap")
    assert len(read_tracks(tmp_path / "match-2.mcap")["nemo"].times) == 50
    assert read_tracks(path)["nemo"].times[-1] >= 3.0 - 1.2


def test_what_waits_is_written_out_when_the_clock_stops(path):
    recorder = record(path, 0.5)
    before = path.stat().st_size
    recorder.tick(Tick(0.5, live=False))
    assert path.stat().st_size > before
    assert len(read_tracks(path)["nemo"].times) == 5


def test_stopping_twice_or_before_the_first_tick_is_harmless(path):
    Recorder("recorder", Mailbox(), KEYS, path).stop()
    assert not path.exists()
    recorder = record(path, 1.0)
    recorder.stop()
    recorder.stop()
    assert recorder.fault is None


def test_a_stamp_just_below_a_whole_second_is_a_valid_time(path, recorder):
    hear(recorder, (KEYS.poses, synthetic.poses(1.0), 0.9999999999))
    recorder.stop()
    [(_, pose)] = written(path, "/view/robot/nemo")
    assert pose["timestamp"] == {"sec": 1, "nsec": 0}


def test_a_recording_ends_with_the_game_although_the_match_goes_on(path, recorder):
    match = synthetic.SyntheticMatch(KEYS)
    for tick in range(60):
        stage = m.Stage.GAME_OVER if tick >= 20 else m.Stage.PLAY_ROUND
        match.step(recorder, tick / 10, tick, stage=stage)
    assert not recorder.recording
    assert recorder.fault is None
    with path.open("rb") as stream:
        assert make_reader(stream).get_summary() is not None, "it is finished while the match still runs"
    assert read_tracks(path)["nemo"].times[-1] == pytest.approx(2.0 + Recorder.linger)


def test_motions_and_fixes_are_recorded_and_read_back(path, recorder):
    """A robot's commands, its odometry and where it was, for who compares it with its simulation."""
    twist, fix = Twist(0.3, -0.1), m.Fix(robot="nemo", pose=Pose(4.0, 5.0, 0.1), position=0.01, heading=0.02)
    for n in range(3):
        odometry = Pose(0.03 * n, 2.0, 0.5)
        said = (
            (KEYS.motion("nemo"), m.Motion(odometry=odometry, twist=twist)),
            (KEYS.fixes("eye"), m.Fixes(fixes=(fix,))),
            (KEYS.robot_pose("nemo"), m.MeasuredPose(pose=odometry, twist=twist)),
            (KEYS.report("nemo"), m.Report(mode="x", armed=True, command=twist)),
        )
        hear(recorder, *((topic, body, 0.1 * n) for topic, body in said))
    recorder.stop()
    recorded = read_recorded(path)
    moved = [(stamp, motion.odometry, motion.twist) for stamp, motion in recorded.motions["nemo"]]
    assert moved == [(pytest.approx(0.1 * n), Pose(0.03 * n, 2.0, 0.5), twist) for n in range(3)]
    assert [command for _, command in recorded.commands["nemo"]] == [twist] * 3
    assert [round(measured.pose.theta, 6) for _, measured in recorded.measured["nemo"]] == [0.5] * 3
    fixes = written(path, "/fix/eye")
    assert [[one["pose"]["x"] for one in said["fixes"]] for _, said in fixes] == [[4.0]] * 3
