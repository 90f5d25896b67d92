"""The recorder: a match in one MCAP file that Foxglove and Lichtblick open, and `vrg.recording.reader` reads back.

It writes what was published, one topic a key: `/referee/state`, `/poses`, `/player/NAME/report` and so on are the keys
of the bus below that of the match, and what is on them are the messages, as JSON. The newest clock is written with what
arrived until then. Beside them are the views that a viewer cannot make of messages:

- `/view/scene`: the robots as boxes coloured by role, the physical ones with a white rim. `/view/field`: the field and
  its zones, when they change. `/view/map`: walls and obstacles, once.
- `/view/robot/NAME`: where the world shows a robot. `/view/sketch/NAME`: what a player has sketched, in the scene.
- `/view/NAME/KIND/SENSOR`: the scan, the picture, the cones or the place on the earth of a sensor, as its spec wants
  it. A scan and a picture are not written as messages besides: see `vrg.recording.readings`.
- `/view/calls`: the calls in words for the viewer's log panel.

Times are match time in ns.
"""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO, ClassVar, Final

from msgspec import Struct

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox, is_power_of_ten
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, name_in
from vrg.errors import MessageError
from vrg.games import UNKNOWN_GAME, game_of, look
from vrg.hal.models.description import RobotModel
from vrg.hal.sensors.spec import Recorded
from vrg.names import name_of
from vrg.recording import foxglove as fg
from vrg.recording.layout import VIEW
from vrg.recording.mcap_file import McapFile
from vrg.recording.readings import records_of
from vrg.recording.scene import FIGURE, STROKE_HEIGHT, entity, robot_entity
from vrg.recording.sink import Sink
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
    gives the reason, and what was written stays readable. A message that the file cannot hold is left out, and logged.

    Args:
        output: the file to make at the first tick; where one of that name exists, a number is added, so that a
            restarted recorder never overwrites the first part. Or an open binary file, which is not closed; or what
            opens another thing to write to.
        models: of the robots, by name; a robot without one is drawn 0.5 m long. Those of their sensors are recorded
            whose specs ask for it. With scans a recording is two to three times as large.
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
        self._root = keys.root
        self._clock = mailbox.subscribe(keys.clock)
        self._state = mailbox.subscribe(keys.referee_state)
        self._calls = mailbox.subscribe(keys.referee_event)
        self._sketches = mailbox.subscribe(keys.sketch())
        self._poses = mailbox.subscribe(keys.poses)
        self._orders = [mailbox.subscribe(topic) for topic in (keys.estop, keys.estop_release)]
        plain = (keys.report(), keys.sightings(), keys.robot_pose(), keys.motion(), keys.fixes())
        self._plain = [mailbox.subscribe(topic) for topic in plain]
        specs = [spec for model in self._models.values() for spec in model.sensors]
        wanted = dict.fromkeys(spec.message for spec in specs if spec.recorded is not Recorded.NONE)
        self._sensors = [mailbox.subscribe(keys.sensor(message)) for message in wanted]
        self._file: Sink | None = None
        self._ends = math.inf
        """The match time at which the recording ends, s."""
        self._flushed = 0.0
        self._pending = False
        self._refused = 0
        self._ticked: Received[m.Clock] | None = None
        """The clock that was written last."""
        self._waiting: dict[str, Received[m.Sketch]] = {}
        """The newest sketch of each player that is still to be written."""
        self._sketched: dict[str, tuple[m.Sketch | None, float]] = {}
        self._readings: dict[str, m.SensorMessage] = {}
        """The newest reading of each sensor of which only changes are written, by topic."""
        self._where: dict[str, Pose] = {}
        self._game_name, self._game = "", UNKNOWN_GAME
        self._roles: dict[str, tuple[str, str]] = {}
        self._zones: tuple[m.Zone, ...] | None = None
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

    def _write(self, topic: str, record: Struct, of: Received[m.Message]) -> None:
        assert self._file is not None
        try:
            self._file.write(topic, record, of.stamp, of.sequence)
        except MessageError as error:
            self._refused += 1
            if is_power_of_ten(self._refused):
                log.warning("a message of %s is not recorded: %s (%d so far)", of.sender, error, self._refused)
            return
        self._pending = True

    def _keep(self, received: Received[m.Message]) -> None:
        """Write a message as it was published."""
        self._write(received.key.removeprefix(self._root), received.body, received)

    def _show(self, view: str, record: Struct, of: Received[m.Message]) -> None:
        """Write what viewers show of a message."""
        self._write(f"{VIEW}{view}", record, of)

    def _write_arrivals(self) -> None:
        clock = self._clock.latest
        if clock is not None and clock is not self._ticked:
            self._ticked = clock
            self._keep(clock)
        # The state comes before poses, so that each player's role is known.
        for state in self._state.take():
            self._write_state(state)
        for call in self._calls.take():
            self._keep(call)
            words = fg.Log(fg.time_of(call.stamp), 2, call.body.text, call.body.rule, "", call.body.number)
            self._show("calls", words, call)
        for order in (order for inlet in self._orders for order in inlet.take()):
            # Commands hear no clock, so their stamps do not tell the match time.
            stamp = order.stamp or (clock.stamp if clock is not None else 0.0)
            self._keep(Received(order.key, stamp, order.sequence, order.body))
        for inlet in self._plain:
            for received in inlet.take():
                self._keep(received)
        self._waiting |= {name_in(sketch.key): sketch for sketch in self._sketches.take()}
        for player, sketch in list(self._waiting.items()):
            if self._write_sketch(player, sketch):
                del self._waiting[player]
        for poses in self._poses.take():
            self._write_poses(poses)
        for sensor in self._sensors:
            for reading in sensor.take():
                self._write_reading(reading)

    def _write_state(self, received: Received[m.RefereeState]) -> None:
        state = received.body
        self._keep(received)
        if state.game != self._game_name:
            self._game_name, self._game = state.game, game_of(state.game)
        if state.stage is m.Stage.GAME_OVER:
            self._ends = min(self._ends, received.stamp + self.linger)
        self._roles = {p.name: (p.role, p.state) for p in state.players}
        self._objects = state.objects
        if state.zones != self._zones:
            self._zones = state.zones
            # Each update is whole: a viewer that jumps to an instant reads only the last one before it.
            at = fg.time_of(received.stamp)
            figures = look.ground(self._game, state.zones, ())
            drawn = [entity(figure.name, [figure], at, FIGURE * level) for level, figure in enumerate(figures)]
            update = fg.SceneUpdate([fg.everything(at)], drawn)
            self._show("field", update, received)

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
        self._keep(received)
        colour = self._game.style(*self._roles.get(player, ("robot", ""))).colour
        figures = [f for stroke in sketch.strokes for f in look.stroke("", stroke.points, stroke.label, colour)]
        drawn = entity(f"sketch:{player}", figures, fg.time_of(received.stamp), STROKE_HEIGHT)
        self._show(f"sketch/{player}", fg.SceneUpdate([], [drawn]), received)
        return True

    def _now(self, received: Received[m.Sketch]) -> float:
        """The match time, or that of a message before the clock was heard, s."""
        clock = self._clock.latest
        return received.stamp if clock is None else max(clock.body.time, received.stamp)

    def _write_poses(self, received: Received[m.Poses]) -> None:
        self._keep(received)
        at = fg.time_of(received.stamp)
        if not self._map_written:
            self._map_written = True
            blocks = [entity(wall.name, [wall], at) for wall in look.ground(self._game, (), self._obstacles)]
            self._show("map", fg.SceneUpdate([], blocks), received)
        entities = []
        for body in received.body.bodies:
            self._where[body.name] = body.pose
            pose = fg.pose_of(body.pose.x, body.pose.y, body.pose.theta, body.pose.z)
            self._show(f"robot/{body.name}", fg.PoseInFrame(at, fg.FRAME_ID, pose), received)
            role, state = self._roles.get(body.name, ("robot", ""))
            colour, model = self._game.style(role, state).colour, self._models.get(body.name)
            entities.append(robot_entity(body.name, pose, model, colour, state or role, at, physical=body.physical))
        for thing in self._objects:
            carried = self._where.get(thing.carrier or "")
            place = Pose(thing.x, thing.y, thing.heading) if carried is None else carried
            style = self._game.thing_style(thing.kind, thing.team or "")
            drawn = look.thing(thing.name, place, style, radius=thing.radius, corners=thing.corners)
            entities.append(entity(drawn.name, [drawn], at))
        self._show("scene", fg.SceneUpdate([], entities), received)

    def _write_reading(self, received: Received[m.SensorMessage]) -> None:
        _, _, _, coded, _, kind, sensor = received.key.split("/")
        robot, reading = name_of(coded), received.body
        model = self._models.get(robot)
        spec = None if model is None else model.spec(kind, name_of(sensor))
        if spec is not None and spec.recorded is Recorded.CHANGES:
            if self._readings.get(received.key) == reading:
                return
            self._readings[received.key] = reading
        # A viewer draws a reading where the sensor was; before the first pose its place is not known.
        where, at = self._where.get(robot), fg.time_of(received.stamp)
        for record in records_of(reading, spec, at, f"{robot}/{sensor}", where):
            if isinstance(record, m.SensorMessage):
                self._keep(Received(received.key, received.stamp, received.sequence, record))
            else:
                self._show(f"{robot}/{kind}/{sensor}", record, received)
