"""Gathers what there is to see from the messages of a match."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import is_fresh
from vrg.bus.pacing import match_speed
from vrg.bus.topics import Keys, name_in
from vrg.games import UNKNOWN_GAME, game_of
from vrg.hal.estop import EstopLatch, EstopOrders
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg.regions import Region
from vrg.types import Pose, Vector
from vrg.ui.scene import JUMP, Flash, Scene, SceneBody, SceneObject, ScenePlayer, SceneStroke, objects_of

TRAIL_SECONDS: Final = 6.0
"""s of a body's way that are shown."""
TRAIL_STEP: Final = 0.2
"""s between the points of a trail."""
LATE: Final = 1.0
"""s of match time by which a message of one clock may come after a later one."""
CALLS_KEPT: Final = 200
FLASHES_KEPT: Final = 20
FLASH_SECONDS: Final = 1.5
"""s of real time for which a call is shown where it happened."""


class SceneBuilder:
    """Takes messages in and gives scenes out.

    Args:
        sizes: length and width of the robots in m, by name; others are 0.5 by 0.4, a Pioneer's.
        obstacles: the ground that the map's walls and obstacles cover, m.

    Attributes:
        only: the names of the bodies that are shown; None if all are.
        team: the team whose players' sketches are shown; None if those of all are.
        one_match: another match of this name that begins at the same place is not shown. other: one has begun there.
    """

    def __init__(
        self,
        *,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        obstacles: Sequence[Region] = (),
    ) -> None:
        self.only: frozenset[str] | None = None
        self.team: str | None = None
        self.one_match = self.other = False
        self._sizes = dict(sizes or {})
        self._walls = tuple(obstacles)
        self._clock: m.Clock | None = None
        self._state: m.RefereeState | None = None
        self._game = UNKNOWN_GAME
        self._estop: m.Estop | m.EstopRelease | None = None
        self._bodies: list[m.Body] = []
        self._things: dict[str, Pose] = {}
        self._trails: dict[str, deque[tuple[float, Vector]]] = {}
        self._last: dict[str, Vector] = {}
        self._starts: dict[str, Vector] = {}
        self._reports: dict[str, m.Report] = {}
        self._sketches: dict[str, m.Sketch] = {}
        self._calls: deque[m.Call] = deque(maxlen=CALLS_KEPT)
        self._moments: deque[tuple[float, m.Call]] = deque(maxlen=FLASHES_KEPT)
        self._reason: m.Call | None = None
        self._reason_round = 0

    def clock(self, clock: m.Clock) -> None:
        """Take match time in. After a restart of the world the trails start again."""
        before = self._clock or clock
        # A world that is started again goes on in a later epoch.
        self.other |= self.one_match and (clock.epoch, clock.time + LATE) < (before.epoch, before.time)
        if clock.epoch != before.epoch:
            self._trails.clear()
            self._moments.clear()
            self._sketches.clear()
        self._clock = clock

    def poses(self, poses: m.Poses, stamp: float) -> None:
        """Take in where every body is at `stamp`, s."""
        only = self.only
        self._things = {thing.name: thing.pose for thing in poses.things}
        self._bodies = [b for b in poses.bodies if only is None or b.name in only]
        for body in self._bodies:
            here = (body.pose.x, body.pose.y)
            self._starts.setdefault(body.name, here)
            trail = self._trails.setdefault(body.name, deque())
            if math.dist(here, self._last.get(body.name, here)) > JUMP:
                trail.clear()
            self._last[body.name] = here
            if not trail or stamp - trail[-1][0] >= TRAIL_STEP - 1e-9:
                trail.append((stamp, here))
            while trail and stamp - trail[0][0] > TRAIL_SECONDS:
                trail.popleft()

    def referee(self, state: m.RefereeState) -> None:
        """Take the state of the match in."""
        if self._state is None or state.game != self._state.game:
            self._game = game_of(state.game)
        self._state = state

    def call(self, call: m.Call, stamp: float) -> None:
        """Take in what the referee called at `stamp`, s. Only the official sees what it was refused."""
        if call.rule != "refused":
            self._calls.append(call)
            moment = self._game.moments.get(call.rule)
            if moment is not None and moment.counts:
                self._reason, self._reason_round = call, 0 if self._state is None else self._state.round
            self._moments.append((stamp, call))

    def report(self, player: str, report: m.Report) -> None:
        """Take in a player's report."""
        self._reports[player] = report

    def sketch(self, player: str, sketch: m.Sketch) -> None:
        """Take in what a player wants to be shown."""
        self._sketches[player] = sketch

    def estop(self, estop: m.Estop | m.EstopRelease | None) -> None:
        """Take in the order that engaged or released the emergency stop last; None if that is not known any more."""
        self._estop = estop

    def build(self, live: bool) -> Scene:
        """Make the scene of this instant; `live` is as in `Tick`."""
        clock, state = self._clock, self._state
        stopped, reason = self._stopped()
        scene = Scene(
            live=live and clock is not None,
            time=clock.time if clock else 0.0,
            rate=clock.rate if clock else 1.0,
            estop=stopped,
            estop_reason=reason,
            bodies=tuple(self._body(body) for body in self._bodies),
            calls=tuple(self._calls),
            reason=self._reason,
            reason_round=self._reason_round,
            flashes=self._flashes(),
            obstacles=self._walls,
            starts=tuple(self._starts.values()),
        )
        if state is None:
            return scene
        scene = replace(scene, strokes=self._strokes(state), objects=self._objects(state))
        return _with_referee(scene, state, tuple(self._player(p) for p in state.players))

    @property
    def latched(self) -> bool:
        """True if the world or the referee has reported last that the emergency stop is engaged."""
        return (self._clock is not None and self._clock.estop) or (self._state is not None and self._state.estop)

    def _stopped(self) -> tuple[bool, str]:
        if not isinstance(self._estop, m.Estop):
            return self.latched, ""
        by = f"pressed by {self._estop.by}"
        return True, f"{by}: {self._estop.reason}" if self._estop.reason else by

    def _flashes(self) -> tuple[Flash, ...]:
        if self._clock is None:
            return ()
        lasts = FLASH_SECONDS * match_speed(self._clock.rate)
        found = []
        for stamp, call in self._moments:
            if self.only is not None and call.players and call.players[0] not in self.only:
                continue
            moment, share = self._game.marked.get(call.rule), (self._clock.time - stamp) / lasts
            if moment is not None and call.poses and share < 1.0:
                found.append(Flash((call.poses[0].x, call.poses[0].y), moment.word, max(0.0, share)))
        return tuple(found)

    def _strokes(self, state: m.RefereeState) -> tuple[SceneStroke, ...]:
        """The sketches of the players that play."""
        return tuple(
            SceneStroke(player.name, player.role, tuple(stroke.points), stroke.label)
            for player in state.players
            if player.name in self._sketches and not self._game.is_out(player.state)
            if self.team in (None, player.team)
            for stroke in self._sketches[player.name].strokes
        )

    def _objects(self, state: m.RefereeState) -> tuple[SceneObject, ...]:
        return objects_of(state.objects, {body.name: body.pose for body in self._bodies}, self._things)

    def _body(self, body: m.Body) -> SceneBody:
        status = self._state.player(body.name) if self._state is not None else None
        length, width = self._sizes.get(body.name, (0.5, 0.4))
        state = status.state if status else ""
        return SceneBody(
            name=body.name,
            pose=body.pose,
            length=length,
            width=width,
            role=status.role if status else "",
            state=state,
            physical=body.physical,
            trail=tuple(point for _, point in self._trails.get(body.name, ())),
            out_of_play=self._game.is_out(state),
            uncertainty=body.uncertainty,
        )

    def _player(self, status: m.PlayerStatus) -> ScenePlayer:
        report = self._reports.get(status.name)
        body = next((body for body in self._bodies if body.name == status.name), None)
        return ScenePlayer(
            name=status.name,
            team=status.team,
            role=status.role,
            state=status.state,
            may_move=status.may_move,
            mark=status.mark,
            speed=None if body is None else body.twist.speed,
            battery=report.battery if report else None,
            mode=report.mode if report else "",
            armed=report.armed if report else False,
            manual=report.manual if report else False,
            fault=report.fault if report else None,
            latched=report.latched if report else False,
            out_of_play=self._game.is_out(status.state),
            leased=status.lease is not None,
        )


def _with_referee(scene: Scene, state: m.RefereeState, players: tuple[ScenePlayer, ...]) -> Scene:
    return replace(
        scene,
        game=state.game,
        stage=state.stage,
        halted=state.halted,
        way_out=state.way_out,
        waiting=tuple(state.waiting),
        clock=state.clock,
        round=state.round,
        rounds=state.rounds,
        score=tuple(state.score.items()),
        winner=state.winner,
        ended=state.ended,
        unproved=state.unproved,
        numbers=state.numbers,
        players=players,
        zones=tuple(state.zones),
    )


class SceneInlets:
    """A node's subscriptions to all that a scene is made of.

    Args:
        mailbox: the node's own. keys: of the match.
        poses: False if this node may not hear where every body really is.
        players: the players whose reports and sketches it may hear; None for all.
    """

    def __init__(
        self, mailbox: Mailbox, keys: Keys, *, poses: bool = True, players: Sequence[str] | None = None
    ) -> None:
        self._mailbox = mailbox
        self._latch = EstopLatch()
        self._clock = mailbox.subscribe(keys.clock)
        self._poses = mailbox.subscribe(keys.poses) if poses else None
        self._state = mailbox.subscribe(keys.referee_state)
        self._calls = mailbox.subscribe(keys.referee_event)
        names = [()] if players is None else [(name,) for name in players]
        self._reports = [mailbox.subscribe(keys.report(*own)) for own in names]
        self._sketches = [mailbox.subscribe(keys.sketch(*own)) for own in names]
        self._estops = EstopOrders(mailbox, keys)

    def feed(self, builder: SceneBuilder) -> list[m.Call]:
        """Hand over what arrived since this was last called, and return the referee's new calls."""
        for clock in self._clock.take():
            builder.clock(clock.body)
        if builder.other:
            return []
        for poses in self._poses.take() if self._poses is not None else ():
            builder.poses(poses.body, poses.stamp)
        order = self._estops.take()
        if order is not None:
            self._latch.order(isinstance(order, m.Estop), self._mailbox.now)
            builder.estop(order)
        for state in self._state.take():
            builder.referee(state.body)
            if state.body.estop or is_fresh(state.stamp, self._mailbox.now, REFEREE_TIMEOUT):
                self._latch.referee(state.body.estop, state.stamp)
        if not self._latch.engaged:
            builder.estop(None)  # its release may have been missed
        for report in (report for inlet in self._reports for report in inlet.take()):
            builder.report(name_in(report.key), report.body)
        for sketch in (sketch for inlet in self._sketches for sketch in inlet.take()):
            builder.sketch(name_in(sketch.key), sketch.body)
        calls = self._calls.take()
        for call in calls:
            builder.call(call.body, call.stamp)
        return [call.body for call in calls]
