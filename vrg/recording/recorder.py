"""The recorder: a match in one MCAP file that Foxglove and Lichtblick open, and `vrg.recording.reader` reads back.

Topics:

- `/scene`: the robots as boxes coloured by role, the physical ones with a white rim. `/field`: the zones as outlines,
  when they change. `/map`: walls and obstacles, once.
- `/robot/<robot>/pose`: where the world shows a robot. `/robot/<robot>/measured`: a physical robot's measured pose.
- `/robot/<robot>/motion`: what a robot that the fusion centre locates has measured of its motion.
  `/robot/<robot>/fix/<source>`: where a source of fixes has seen it.
- `/robot/<robot>/twist`: how it moves. `/robot/<robot>/command`: the motion that was last commanded, after all
  limits.
- `/robot/<robot>/rest`: whether it is at rest, and since which tick of the world, when that changes.
- `/robot/<robot>/battery`: the charge of its battery, when it changes by a thousandth.
- `/robot/<robot>/<kind>/<sensor>`: the readings of its sensors, as their specs want it: see `vrg.recording.readings`.
- `/player/<player>/report`: what a player says of itself, when it changes.
- `/player/<player>/sightings`: the unknown robots that it has reported to the referee.
- `/player/<player>/sketch`: what it wants to be shown about what it thinks, at most once in SKETCH_EVERY.
- `/referee/state`: the state of the match.
- `/estop`: the orders that engage and release the emergency stop.
- `/referee/calls`: the calls in words for the viewer's log panel. `/referee/event`: the same with players and places.

Times are match time in ns.
"""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO, ClassVar, Final

from msgspec import Struct
from msgspec.structs import replace

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.names import name_of
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, name_in
from vrg.games import UNKNOWN_GAME, game_of
from vrg.hal.models.description import RobotModel
from vrg.hal.sensors.spec import Recorded
from vrg.recording import foxglove as fg
from vrg.recording.mcap_file import McapFile
from vrg.recording.readings import records_of
from vrg.recording.records import (
    BatteryRecord,
    CallRecord,
    EstopRecord,
    MotionRecord,
    PlayerRecord,
    ReportRecord,
    RestRecord,
    SightingsRecord,
    StateRecord,
    TwistRecord,
)
from vrg.recording.scene import flag_entity, obstacle_entity, robot_entity, zone_entity
from vrg.recording.sink import Sink
from vrg.recording.sketches import sketch_entity
from vrg.regions import Region
from vrg.types import Pose

log = logging.getLogger(__name__)

SKETCH_EVERY: Final = 0.5
"""The match time in s between two sketches of a player that are recorded."""

FLUSH_EVERY: Final = 1.0
"""s of match time that a killed process loses at most."""


class Recorder(Node):
    """Writes what happens in a match to a file.

    The recording ends with the game, also where processes go on because a window is open.

    A write that fails, for example on a full disk, ends the recording and nothing else: it is logged once, `fault`
    says why, and what was written stays readable.

    Args:
        output: the file to make at the first tick; where one of that name exists, a number is added, so that a
            restarted recorder never overwrites the first part. Or an open binary file, which is not closed; or what
            opens another thing to write to.
        models: of the robots, by name; a robot without one is drawn 0.5 m long. Of their sensors those are recorded
            whose specs want it. With scans a recording is two to three times as large.
        obstacles: the ground that the map's walls and obstacles cover, m.
        period: s between ticks.

    Attributes:
        fault: why nothing is recorded any more, in words, or None.
        path: the file, with its number once it is made; None if there is none.
    """

    kind: ClassVar[str] = "recorder"
    linger: ClassVar[float] = 1.0
    """The match time in s for which a recording goes on after the game is over: it shows how all robots stop."""

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        output: Path | BinaryIO | Callable[[], Sink],
        *,
        models: Mapping[str, RobotModel] | None = None,
        obstacles: Sequence[Region] = (),
        period: float = 0.1,
    ) -> None:
        super().__init__(name, mailbox, period)
        self.fault: str | None = None
        self.path: Path | None = output if isinstance(output, Path) else None
        self._output = output
        self._models = dict(models or {})
        self._obstacles = tuple(obstacles)
        self._map_written = not self._obstacles
        self._clock = mailbox.subscribe(keys.clock)
        self._poses = mailbox.subscribe(keys.poses)
        self._measured = mailbox.subscribe(keys.robot_pose())
        self._motions = mailbox.subscribe(keys.motion())
        self._fixes = mailbox.subscribe(keys.fixes())
        self._state = mailbox.subscribe(keys.referee_state)
        self._calls = mailbox.subscribe(keys.referee_event)
        self._reports = mailbox.subscribe(keys.report())
        self._sightings = mailbox.subscribe(keys.sightings())
        self._sketches = mailbox.subscribe(keys.sketch())
        self._estops = mailbox.subscribe(keys.estop)
        self._releases = mailbox.subscribe(keys.estop_release)
        specs = [spec for model in self._models.values() for spec in model.sensors]
        wanted = dict.fromkeys(spec.message for spec in specs if spec.recorded is not Recorded.NONE)
        self._sensors = [mailbox.subscribe(keys.sensor(message)) for message in wanted]
        self._file: Sink | None = None
        self._ends = math.inf
        """The match time at which the recording ends, s."""
        self._flushed = 0.0
        self._pending = False
        self._said: dict[str, m.Report] = {}
        self._waiting: dict[str, Received[m.Sketch]] = {}
        """The newest sketch of each player that is still to be written."""
        self._sketched: dict[str, tuple[m.Sketch | None, float]] = {}
        self._readings: dict[str, m.SensorMessage] = {}
        """The newest reading of each sensor of which only changes are written, by topic."""
        self._charge: dict[str, float] = {}
        self._rest: dict[str, float | None] = {}
        self._known: dict[str, tuple[float, int]] = {}
        """When each robot was last known to move, or to be at rest as is written: match time in s, and the epoch."""
        self._where: dict[str, Pose] = {}
        self._game_name, self._game = "", UNKNOWN_GAME
        self._roles: dict[str, tuple[str, str]] = {}
        self._zones: tuple[m.Zone, ...] | None = None
        self._round = 0
        self._objects: tuple[m.FieldObject, ...] = ()

    @property
    def recording(self) -> bool:
        """True if arriving messages are being written."""
        return self._file is not None

    def tick(self, tick: Tick) -> None:
        """Write what arrived. This never raises for a file that cannot be written."""
        if self.fault is not None or (self._file is None and self._ends < math.inf):
            return
        try:
            if self._file is None:
                self._file = self._output() if callable(self._output) else McapFile(self._output)
                self.path = self._file.path
            self._write_arrivals()
            # Also when the clock has stopped: nothing more may come for a long time.
            if self._pending and not (tick.live and 0 <= tick.time - self._flushed < FLUSH_EVERY):
                self._file.flush()
                self._flushed = tick.time
                self._pending = False
            if tick.time >= self._ends:
                self.stop()
        except OSError as error:
            self._fail(error)

    def stop(self) -> None:
        """Finish the file with its index. Calling it again does nothing."""
        if self._file is None:
            return
        try:
            self._file.finish()
            self._file = None
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        self.fault = f"recording ended: {f'{self.path}: ' if self.path else ''}{error.strerror or error}"
        log.error("%s; the match goes on, what was written stays readable", self.fault)
        if self._file is not None:
            self._file.abandon()
            self._file = None

    def _write(self, topic: str, record: Struct, of: Received[m.Message], *, physical: bool = False) -> None:
        assert self._file is not None
        self._file.write(topic, record, of.stamp, of.sequence, physical=physical)
        self._pending = True

    def _write_arrivals(self) -> None:
        # The state comes first, so that a reader knows each player's role before its pose.
        for state in self._state.take():
            self._write_state(state)
        for call in self._calls.take():
            self._write_call(call)
        for estop in self._estops.take():
            self._write_estop(estop)
        for release in self._releases.take():
            self._write_estop(release)
        for report in self._reports.take():
            self._write_report(report)
        for sightings in self._sightings.take():
            record = SightingsRecord(fg.time_of(sightings.stamp), sightings.body.seen)
            self._write(f"/player/{name_in(sightings.key)}/sightings", record, sightings)
        self._waiting |= {name_in(sketch.key): sketch for sketch in self._sketches.take()}
        for player, sketch in list(self._waiting.items()):
            if self._write_sketch(player, sketch):
                del self._waiting[player]
        for poses in self._poses.take():
            self._write_poses(poses)
        self._write_located()
        for inlet in self._sensors:
            for reading in inlet.take():
                self._write_reading(reading)

    def _write_located(self) -> None:
        """Write what locates robots: their motion, the fixes, and the poses that follow."""
        for measured in self._measured.take():
            self._write_pose(f"/robot/{name_in(measured.key)}/measured", measured.body.pose, measured)
        for motion in self._motions.take():
            told = MotionRecord(fg.time_of(motion.stamp), motion.body.odometry, motion.body.twist)
            self._write(f"/robot/{name_in(motion.key)}/motion", told, motion)
        for fixes in self._fixes.take():
            for fix in fixes.body.fixes:
                self._write_pose(f"/robot/{fix.robot}/fix/{name_in(fixes.key)}", fix.pose, fixes)

    def _write_pose(self, topic: str, pose: Pose, of: Received[m.Message]) -> None:
        """Write where a robot was measured to be."""
        record = fg.PoseInFrame(fg.time_of(of.stamp), fg.FRAME_ID, fg.pose_of(pose.x, pose.y, pose.theta))
        self._write(topic, record, of, physical=True)

    def _write_state(self, received: Received[m.RefereeState]) -> None:
        state = received.body
        if state.game != self._game_name:
            self._game_name, self._game = state.game, game_of(state.game)
        if state.stage is m.Stage.GAME_OVER:
            self._ends = min(self._ends, received.stamp + self.linger)
        self._roles = {p.name: (p.role, p.state) for p in state.players}
        self._round, self._objects = state.round, state.objects
        if state.zones != self._zones:
            self._zones = state.zones
            # Each update is whole: a viewer that jumps to an instant reads only the last one before it.
            at = fg.time_of(received.stamp)
            update = fg.SceneUpdate([fg.everything(at)], self._zone_entities(state.zones, at))
            self._write("/field", update, received)
        record = StateRecord(
            fg.time_of(received.stamp), state.game, state.stage.value, state.halted or "", state.way_out or "",
            state.waiting, state.clock, state.total, state.round, state.rounds, state.score, state.winner or "",
            state.estop,
            tuple(
                PlayerRecord(
                    p.name, p.team, p.role, p.state, p.may_move,
                    () if p.mark is None else (p.mark,), () if p.lease is None else (p.lease,),
                )
                for p in state.players
            ),
            state.zones, state.auctions, state.objects, state.numbers, state.ended or "",
            state.unproved,
        )  # fmt: skip
        self._write("/referee/state", record, received)

    def _write_call(self, received: Received[m.Call]) -> None:
        call, at = received.body, fg.time_of(received.stamp)
        self._write("/referee/calls", fg.Log(at, 2, call.text, call.rule, "", call.number), received)
        record = CallRecord(
            at,
            call.number,
            call.rule,
            call.text,
            call.players,
            call.poses,
            call.clock,
            self._round,
            call.why,
            call.cause,
        )
        self._write("/referee/event", record, received)

    def _write_estop(self, received: Received[m.Estop] | Received[m.EstopRelease]) -> None:
        order, clock = received.body, self._clock.latest
        # Commands hear no clock, so their stamps do not tell the match time.
        stamp = received.stamp or (clock.stamp if clock is not None else 0.0)
        record = EstopRecord(fg.time_of(stamp), isinstance(order, m.Estop), order.by, order.reason)
        written: Received[m.Message] = Received(received.key, stamp, received.sequence, order)
        self._write("/estop", record, written)

    def _write_report(self, received: Received[m.Report]) -> None:
        report, player = received.body, name_in(received.key)
        at = fg.time_of(received.stamp)
        if report.command is not None:
            self._write(f"/robot/{player}/command", TwistRecord.of(at, report.command), received)
        if report.battery is not None and self._charge.get(player) != (charge := round(report.battery, 3)):
            self._charge[player] = charge
            self._write(f"/robot/{player}/battery", BatteryRecord(at, charge), received)
        report = replace(report, command=None, battery=None)
        # Players repeat themselves to show that they live; a viewer wants the changes.
        if self._said.get(player) == report:
            return
        self._said[player] = report
        record = ReportRecord(
            at, report.mode, report.armed, report.manual, report.fault or "", report.latched, report.estop
        )
        self._write(f"/player/{player}/report", record, received)

    def _write_sketch(self, player: str, received: Received[m.Sketch]) -> bool:
        """Write a sketch that is due; return whether it need not be looked at again."""
        sketch, now = received.body, self._now(received)
        before, stamp = self._sketched.get(player, (None, -math.inf))
        if sketch == before:
            return True
        # An empty one is written at once: what it ends must not stay in the scene.
        if sketch.strokes and 0.0 <= now - stamp < SKETCH_EVERY:
            return False
        self._sketched[player] = (sketch, now)
        colour = self._game.style(*self._roles.get(player, ("robot", ""))).colour
        at = fg.time_of(received.stamp)
        update = fg.SceneUpdate([], [sketch_entity(player, sketch, colour, at)])
        self._write(f"/player/{player}/sketch", update, received)
        return True

    def _now(self, received: Received[m.Sketch]) -> float:
        """The match time, or that of a message before the clock was heard, s."""
        clock = self._clock.latest
        return received.stamp if clock is None else max(clock.body.time, received.stamp)

    def _write_poses(self, received: Received[m.Poses]) -> None:
        at = fg.time_of(received.stamp)
        if not self._map_written:
            self._map_written = True
            blocks = [obstacle_entity(obstacle, number, at) for number, obstacle in enumerate(self._obstacles)]
            self._write("/map", fg.SceneUpdate([], blocks), received)
        entities = []
        for body in received.body.bodies:
            self._where[body.name] = body.pose
            pose = fg.pose_of(body.pose.x, body.pose.y, body.pose.theta)
            in_frame = fg.PoseInFrame(at, fg.FRAME_ID, pose)
            self._write(f"/robot/{body.name}/pose", in_frame, received, physical=body.physical)
            self._write(f"/robot/{body.name}/twist", TwistRecord.of(at, body.twist), received)
            self._write_rest(body, received)
            role, state = self._roles.get(body.name, ("robot", ""))
            colour, model = self._game.style(role, state).colour, self._models.get(body.name)
            entities.append(robot_entity(body.name, pose, model, colour, state or role, at, physical=body.physical))
        for thing in self._objects:
            carried = self._where.get(thing.carrier or "")
            place = (thing.x, thing.y) if carried is None else (carried.x, carried.y)
            entities.append(flag_entity(thing.name, place, self._game.team_style(thing.team or "").colour, at))
        self._write("/scene", fg.SceneUpdate([], entities), received)

    def _write_rest(self, body: m.Body, received: Received[m.Poses]) -> None:
        """Write whether a robot is at rest if that has changed. Not all poses are heard, but each tells since when."""
        name, measured = body.name, received.stamp - body.age
        clock = self._clock.latest
        epoch = 0 if clock is None else clock.body.epoch
        moves, same = not m.at_rest(body.twist), name in self._rest and self._rest[name] == body.rest
        if moves or same:
            self._known[name] = measured, epoch
        # Of a physical robot that is not measured any more its next place tells whether it has moved.
        if same or (body.physical and body.rest is None and not moves):
            return
        self._rest[name] = body.rest
        since = measured if body.rest is None else body.rest
        resolution = clock.body.time / clock.body.tick if clock is not None and clock.body.tick else 0.0
        known, its_epoch = self._known.get(name, (since, epoch))
        # A physical robot is measured less often than the world ticks. A world that goes on from a snapshot knows
        # nothing of the time before, of which perhaps nothing was heard.
        if body.physical or its_epoch != epoch:
            resolution = max(resolution, since - known)
        record = RestRecord(fg.time_of(received.stamp), body.rest is not None, since, round(resolution, 6))
        self._write(f"/robot/{name}/rest", record, received)

    def _zone_entities(self, zones: Sequence[m.Zone], at: fg.Time) -> list[fg.SceneEntity]:
        team = self._game.team_style
        return [zone_entity(zone, team(zone.team).colour if zone.team else None, at) for zone in zones]

    def _write_reading(self, received: Received[m.SensorMessage]) -> None:
        _, _, _, coded, _, kind, sensor = received.key.split("/")
        robot, reading = name_of(coded), received.body
        topic, model = f"/robot/{robot}/{kind}/{sensor}", self._models.get(robot)
        spec = None if model is None else model.spec(kind, name_of(sensor))
        if spec is not None and spec.recorded is Recorded.CHANGES:
            if self._readings.get(topic) == reading:
                return
            self._readings[topic] = reading
        # A viewer draws a reading where the sensor was; before the first pose its place is not known.
        where, at = self._where.get(robot), fg.time_of(received.stamp)
        for end, record in records_of(reading, spec, at, f"{robot}/{sensor}", where):
            self._write(topic + end, record, received)
