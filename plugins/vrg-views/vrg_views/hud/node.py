"""The head-up display as a node: it shows what one player knows, and publishes what the person at it wants."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import ClassVar, Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Body, CameraRequest, Poses
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.config.setup import MatchSetup
from vrg.geometry import circumradius
from vrg.hal.models import RobotModel
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sim.map import load_map
from vrg.launch.context import Made, NodeContext
from vrg.launch.nodes.windows import sizes, until_closed
from vrg.navigation.motion import VelocityEstimator
from vrg.types import Pose, Twist, Vector
from vrg.ui.acts import Act, Press
from vrg.ui.view import Projection
from vrg.ui.window.window_node import WindowNode
from vrg_views.hud.dashboard import Dashboard
from vrg_views.hud.desk import Desk
from vrg_views.hud.goals import Ground, OtherRobot
from vrg_views.hud.helm import Goal, Wish
from vrg_views.hud.layout import WISHES, Layout
from vrg_views.hud.painter import HudPainter
from vrg_views.hud.telemetry import Receiver, Telemetry

PICTURES: Final = 2.0
"""The match time in s for which the world is asked for pictures of the camera at a time."""
ASK: Final = 0.5
"""The match time in s between two such requests."""
PLAN: Final = 0.2
"""The match time in s between two plans of the way that is shown."""


class Hud(WindowNode):
    """The window of one player. Closing it gives the robot back; the match goes on.

    Args:
        player: whose display it is; it is also the name of the node, so that a player has one display.
        mailbox, keys, sizes, size, run: as for WindowNode.
        team: the player's team. robot: the description of its robot.
        start: where the robot began, in the map's frame. ground: where it can stand.
        ranging: False where the match simulates no range finders.
        physical: the names of the players whose robots are physical ones.

    Attributes:
        desk: what the person wants. board: the dashboard that the window showed last.
        shown: the places in the window's last frame; None before the first.
    """

    kind: ClassVar[str] = "hud"
    meanings: ClassVar[Mapping[Act, str]] = {Act.NEXT: "next field", Act.TAKE: "set the goal"}
    repeated = frozenset({Act.NEXT, Act.PREVIOUS})

    def __init__(
        self,
        player: str,
        mailbox: Mailbox,
        keys: Keys,
        *,
        team: str,
        robot: RobotModel,
        start: Pose,
        ground: Ground,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        ranging: bool = True,
        physical: frozenset[str] = frozenset(),
        size: tuple[int, int] | None = None,
        run: Path | None = None,
    ) -> None:
        super().__init__(
            player, mailbox, keys, f"{keys.match}, {player}", sizes=sizes, obstacles=ground.walls, players=[player],
            size=size, run=run, by=f"display of {player}",
        )  # fmt: skip
        if not ranging:
            robot = replace(robot, sensors=tuple(spec for spec in robot.sensors if not spec.range_finder))
        self._robot, self._ranging = robot, ranging
        self._physical = physical
        self._pictures_key = keys.camera_request(player)
        self._receiver = Receiver(mailbox, keys, player, team, robot)
        self._velocities = VelocityEstimator()
        self.desk = Desk(self.driving, player, robot, ground, Goal(start.x, start.y, start.theta))
        self.acts |= {act: partial(self._want, wish) for act, wish in WISHES.items()}
        self.acts |= {Act.NEXT: self._step, Act.PREVIOUS: self._step, Act.TAKE: lambda _: self.desk.confirm()}
        self._asked = self._planned = -math.inf
        self._way: tuple[Vector, ...] = ()
        self._seen = Telemetry()
        self.board = Dashboard(player)
        self._painter = HudPainter()
        self.shown: tuple[Layout, Projection] | None = None

    @property
    def drivable(self) -> Sequence[str]:
        """The player whose display it is."""
        return [self.name]

    @property
    def stopped(self) -> bool:
        """True if the emergency stop is engaged, for all or at the robot itself."""
        return super().stopped or self.desk.stopped(self._seen)

    def steer(self, tick: Tick) -> None:
        """Publish the motion that the person wants, and ask for pictures of the camera."""
        self.desk.send(self._seen, self.pads.hands, self.scene.rate)
        if self._robot.sensor(CameraSpec) is not None and not 0.0 <= tick.time - self._asked < ASK:
            self._asked = tick.time
            self.mailbox.publish(self._pictures_key, CameraRequest(lease=PICTURES))

    def give_back(self, notice: str = "") -> None:
        """Give the robot back; `notice` is what the person must read."""
        self.desk.release()
        super().give_back(notice)

    def take_in(self, tick: Tick) -> None:
        """Take in the player's knowledge, and no more than that about the others."""
        self._inlets.feed(self._builder)
        seen = self._seen = self._receiver.look(tick)
        others: list[OtherRobot] = []
        bodies = [] if seen.pose is None else [_body(self.name, seen.pose, seen.speed or 0.0, self._physical)]
        if seen.state is not None:
            published = {p.name: p for p in seen.state.players if p.pose is not None and p.name != self.name}
            places = {name: (p.pose.x, p.pose.y) for name, p in published.items() if p.pose is not None}
            self._velocities.update(tick.time - (seen.referee_age or 0.0), places)
            known = self._velocities.velocities
            others = [OtherRobot(n, at, known.get(n, (0.0, 0.0)), published[n].radius) for n, at in places.items()]
            bodies += [_body(n, p.pose, 0.0, self._physical) for n, p in published.items() if p.pose is not None]
        self.desk.see(others)
        self._builder.poses(Poses(bodies=tuple(bodies)), tick.time)

    def takes(self, press: Press) -> bool:
        """While the person types into a field, take the keys that belong to the text."""
        form = self.desk.form
        if form.focus is None or not press.key or press.act is Act.STOP:
            return False
        self.pads.type(press.key)
        if press.key == pygame.K_BACKSPACE:
            form.erase()
        elif press.sign:
            self.desk.type(press.sign)
        elif press.act is Act.LEAVE:
            form.leave()
        else:
            return press.act in WISHES  # HOME moves no robot
        return True

    def click(self, place: tuple[int, int]) -> None:
        """Press a button, type into a field, or set the goal on the map."""
        if self.shown is None:
            return
        (places, view), (x, y) = self.shown, place
        act, field = places.button_at(x, y), places.field_at(x, y)
        if act is not None:
            self.press(Press(act))
        elif field is not None:
            self.desk.form.enter(field)
        elif places.map_area.collidepoint(x, y):
            self.desk.aim(*view.place(x, y))

    def _want(self, wish: Wish, _press: Press) -> None:
        self.desk.want(wish, self._seen)

    def _step(self, press: Press) -> None:
        if press.key:  # the gamepad has no text to go to
            self.desk.form.step(-1 if press.act is Act.PREVIOUS else 1)

    def _plan(self, now: float) -> tuple[Vector, ...]:
        if self.desk.wish not in (Wish.GOTO, Wish.RESET):
            self._planned = -math.inf
            return ()
        if not 0.0 <= now - self._planned < PLAN:
            self._planned, self._way = now, tuple(self.desk.way(self._seen))
        return self._way

    def draw(self, window: pygame.Surface, tick: Tick) -> None:
        """Draw what the player knows."""
        seen, desk = self._seen, self.desk
        report = None if seen.report is None else seen.report.body
        self.board = Dashboard(
            player=self.name,
            scene=self.scene,
            seen=seen,
            wish=desk.wish,
            mode=desk.where if desk.wish is not Wish.WATCH else "" if report is None else report.mode,
            holder=desk.holder(seen),
            hindrance=desk.hindrance(seen, self.scene),
            goal=desk.goal,
            home=desk.home,
            way=self._plan(tick.time),
            texts=tuple(desk.form.texts),
            focus=desk.form.focus,
            ranging=self._ranging,
            notice=self.notice or desk.notice,
            pad=self.pads.status,
        )
        self.shown = self._painter.draw(window, self.board, self.listed)


def _body(name: str, pose: Pose, v: float, physical: frozenset[str]) -> Body:
    return Body(name=name, pose=pose, twist=Twist(v, 0.0), physical=name in physical)


def hud_node(setup: MatchSetup, player: str, run: Path | None = None) -> Hud:
    """Make the head-up display of a player; `run` is the run folder, for pictures that its user takes.

    Raises:
        ConfigError: there is no such player.
    """
    own = setup.player(player)
    bounds, walls = load_map(setup.map).bounds, tuple(setup.obstacles)
    return Hud(
        player, Mailbox(), setup.keys, team=own.team, robot=own.robot, start=own.pose, sizes=sizes(setup), run=run,
        ground=Ground(bounds, walls, circumradius(own.robot.size)), ranging=setup.lasers or own.physical,
        physical=frozenset(setup.physical),
    )  # fmt: skip


def hud(on: NodeContext) -> Made:
    """The head-up display of a player."""
    return until_closed(on, hud_node(on.setup, on.name, on.run))
