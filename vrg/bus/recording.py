"""The recorder: a match in one MCAP file that Foxglove and Lichtblick open, and `vrg.bus.tracks` reads back.

Topics: `/scene` (robots as boxes coloured by role, the physical ones with a white rim, zones as outlines),
`/robot/<name>/pose` (by the world), `/robot/<name>/measured` (of a physical robot, as it came), `/robot/<name>/laser`,
`/player/<name>/report`, `/referee/state`, `/referee/calls` (words for the viewer's log panel) and `/referee/event`
(the same calls with players and places). Times are match time in ns.
"""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO, ClassVar

import msgspec
from mcap.writer import Writer
from msgspec import Struct

from vrg.bus import foxglove as fg
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.foxglove_scene import Shape, robot_entity, zone_entity
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, name_in

log = logging.getLogger(__name__)

FLUSH_EVERY = 1.0
"""s of match time; what a killed process loses at most."""
CHUNK_BYTES = 1 << 20
"""A second with lasers may be larger than this; it is then cut in two."""
_DEFAULT_SHAPE = Shape()


class Recorder(Node):
    """Writes what happens in a match to a file.

    A write that fails (disk full) ends the recording and nothing else: it is logged once, `fault` says why, and
    what was written stays readable.

    Args:
        output: the file to make at the first tick; where one of that name exists, a number is added, so that a
            restarted recorder never overwrites the first part. Or an open binary file, which is not closed.
        shapes: of the robots, by name; others are drawn as `Shape()`.
        lasers: record the scans too, about ten times the data.
        period: s between ticks.
    """

    kind: ClassVar[str] = "recorder"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        output: Path | BinaryIO,
        *,
        shapes: Mapping[str, Shape] | None = None,
        lasers: bool = False,
        period: float = 0.1,
    ) -> None:
        super().__init__(name, mailbox, period)
        self.fault: str | None = None
        self.path: Path | None = output if isinstance(output, Path) else None
        self._output = output
        self._shapes = dict(shapes or {})
        self._clock = mailbox.subscribe(keys.clock)
        self._poses = mailbox.subscribe(keys.poses)
        self._measured = mailbox.subscribe(keys.robot_pose())
        self._state = mailbox.subscribe(keys.referee_state)
        self._calls = mailbox.subscribe(keys.referee_event)
        self._reports = mailbox.subscribe(keys.report())
        self._lasers = mailbox.subscribe(keys.laser()) if lasers else None
        self._stream: BinaryIO | None = None
        self._writer: Writer | None = None
        self._encode = msgspec.json.Encoder().encode
        self._schemas: dict[type[Struct], int] = {}
        self._channels: dict[str, int] = {}
        self._flushed = 0.0
        self._pending = False
        self._said: dict[str, m.Report] = {}
        self._where: dict[str, m.Pose] = {}
        self._roles: dict[str, tuple[str, str]] = {}
        self._zones: list[m.Zone] = []
        self._round = 0

    @property
    def recording(self) -> bool:
        """What arrives is being written."""
        return self._writer is not None

    def tick(self, tick: Tick) -> None:
        """Write what arrived. Never raises for a file that cannot be written."""
        if self.fault is not None:
            return
        try:
            if self._writer is None:
                self._open()
            self._write_arrivals()
            # Also when the clock has stopped: nothing more may come for a long time.
            if self._pending and not (tick.live and 0 <= tick.time - self._flushed < FLUSH_EVERY):
                self._flush(tick.time)
        except OSError as error:
            self._fail(error)

    def stop(self) -> None:
        """Finish the file with its index. Idempotent."""
        if self._writer is None:
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._close()
        except OSError as error:
            self._fail(error)

    def _open(self) -> None:
        if isinstance(self._output, Path):
            self.path, self._stream = _open_new(self._output)
        else:
            self._stream = self._output
        self._writer = Writer(self._stream, chunk_size=CHUNK_BYTES)
        self._writer.start(profile="", library="vrg")
        self._stream.flush()

    def _close(self) -> None:
        stream, self._stream, self._writer = self._stream, None, None
        if stream is not None and stream is not self._output:
            stream.close()

    def _fail(self, error: OSError) -> None:
        where = str(self.path or "the given file")
        self.fault = f"recording ended: {where}: {error.strerror or error}"
        log.error("%s; the match goes on, what was written stays readable", self.fault)
        try:
            self._close()
        except OSError:
            # Closing tries to write the rest once more; that it fails again is no news.
            log.debug("closing %s failed too", where)

    def _flush(self, now: float) -> None:
        assert self._writer is not None
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._flushed = now
        self._pending = False

    def _write_arrivals(self) -> None:
        # The state first, so that a reader knows each player's role before its pose.
        for state in self._state.take():
            self._write_state(state)
        for call in self._calls.take():
            self._write_call(call)
        for report in self._reports.take():
            self._write_report(report)
        for poses in self._poses.take():
            self._write_poses(poses)
        for measured in self._measured.take():
            pose = measured.body.pose
            in_frame = fg.PoseInFrame(_time(measured.stamp), fg.FRAME, fg.pose_of(pose.x, pose.y, pose.theta))
            topic = f"/robot/{name_in(measured.key)}/measured"
            self._write(topic, in_frame, measured.stamp, measured.sequence, physical=True)
        if self._lasers is not None:
            for scan in self._lasers.take():
                self._write_scan(scan)

    def _write(self, topic: str, record: Struct, stamp: float, sequence: int, physical: bool = False) -> None:
        assert self._writer is not None
        channel = self._channels.get(topic)
        if channel is None:
            kind = type(record)
            schema = self._schemas.get(kind)
            if schema is None:
                schema = self._writer.register_schema(fg.SCHEMA_NAMES[kind], "jsonschema", fg.json_schema(kind))
                self._schemas[kind] = schema
            metadata = {"physical": "true"} if physical else {}
            channel = self._writer.register_channel(topic, "json", schema, metadata)
            self._channels[topic] = channel
        time = round(stamp * 1e9)
        self._writer.add_message(channel, time, self._encode(record), time, sequence)
        self._pending = True

    def _write_state(self, received: Received[m.RefereeState]) -> None:
        state = received.body
        self._roles = {p.name: (p.role, p.state) for p in state.players}
        self._zones = state.zones
        self._round = state.round
        record = fg.StateRecord(
            _time(received.stamp), state.game, state.stage.value, state.halted or "", state.waiting, state.clock,
            state.total, state.round, state.rounds, state.score, state.winner or "", state.estop,
            [fg.PlayerRecord(p.name, p.team, p.role, p.state, p.may_move) for p in state.players], state.zones,
        )  # fmt: skip
        self._write("/referee/state", record, received.stamp, received.sequence)

    def _write_call(self, received: Received[m.Call]) -> None:
        call, stamp, at = received.body, received.stamp, _time(received.stamp)
        words = fg.Log(at, 2, call.text, call.rule, "", call.number)
        self._write("/referee/calls", words, stamp, received.sequence)
        record = fg.CallRecord(at, call.number, call.rule, call.text, call.players, call.poses, call.clock, self._round)
        self._write("/referee/event", record, stamp, received.sequence)

    def _write_report(self, received: Received[m.Report]) -> None:
        report, player = received.body, name_in(received.key)
        # Players repeat themselves to show that they live; a viewer wants the changes.
        if self._said.get(player) == report:
            return
        self._said[player] = report
        record = fg.ReportRecord(
            _time(received.stamp), report.mode, report.armed, report.manual, report.fault or "", report.latched
        )
        self._write(f"/player/{player}/report", record, received.stamp, received.sequence)

    def _write_poses(self, received: Received[m.Poses]) -> None:
        stamp, sequence, at = received.stamp, received.sequence, _time(received.stamp)
        entities = []
        for body in received.body.bodies:
            self._where[body.name] = body.pose
            pose = fg.pose_of(body.pose.x, body.pose.y, body.pose.theta)
            in_frame = fg.PoseInFrame(at, fg.FRAME, pose)
            self._write(f"/robot/{body.name}/pose", in_frame, stamp, sequence, body.physical)
            role, state = self._roles.get(body.name, ("robot", ""))
            shape = self._shapes.get(body.name, _DEFAULT_SHAPE)
            entities.append(robot_entity(body.name, pose, shape, role, state, at, physical=body.physical))
        # The zones go along each time: a viewer that jumps to an instant reads only the last scene before it.
        entities.extend(zone_entity(zone, at) for zone in self._zones)
        self._write("/scene", fg.SceneUpdate([], entities), stamp, sequence)

    def _write_scan(self, received: Received[m.Laser]) -> None:
        robot, scan = name_in(received.key), received.body
        pose = self._where.get(robot)
        if pose is None:
            return
        here = self._shapes.get(robot, _DEFAULT_SHAPE).laser_pose(pose)
        ranges: list[float] = scan.ranges.tolist()
        end = scan.angle_min + scan.angle_step * max(0, len(ranges) - 1)
        record = fg.LaserScan(_time(received.stamp), fg.FRAME, here, scan.angle_min, end, ranges, [])
        self._write(f"/robot/{robot}/laser", record, received.stamp, received.sequence)


def _time(stamp: float) -> fg.Time:
    seconds, rest = divmod(round(stamp * 1e9), 1_000_000_000)
    return fg.Time(seconds, rest)


def _open_new(path: Path) -> tuple[Path, BinaryIO]:
    number = 1
    while True:
        candidate = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        try:
            return candidate, candidate.open("xb")
        except FileExistsError:
            number += 1
