"""The head-up display as a node: it shows what one player knows, and publishes what the person at it wants."""

import logging
import math
from collections.abc import Mapping
from typing import ClassVar, Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Body, CameraRequest, Poses
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.games.hud.helm import Goal, Wish
from vrg.hal.models import RobotModel
from vrg.hal.sensors.camera import CameraSpec
from vrg.navigation.motion import VelocityEstimator
from vrg.types import Pose, Twist, Vector
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.hud.dashboard import Dashboard
from vrg.ui.hud.desk import NUDGE, Desk
from vrg.ui.hud.goals import Ground, Other
from vrg.ui.hud.keys import ARROWS, KEYS, PAD, TYPING, Press
from vrg.ui.hud.layout import SET, STOP, Layout
from vrg.ui.hud.painter import HudPainter
from vrg.ui.hud.telemetry import Receiver, Telemetry
from vrg.ui.pace import Pace
from vrg.ui.pads import Act, Pads
from vrg.ui.scene import Scene
from vrg.ui.view import View
from vrg.ui.window import open_window, toggle_whole_screen

log = logging.getLogger(__name__)

FRAME: Final = 1 / 30
"""The real time in s between two frames, and the match time in s between two driving commands."""
PICTURES: Final = 2.0
"""The match time in s for which the world is asked for pictures of the camera at a time."""
ASK: Final = 0.5
"""The match time in s between two such requests."""
PLAN: Final = 0.2
"""The match time in s between two plans of the way that is shown."""


class Hud(Node):
    """The window of one player. Closing it gives the robot back; the match goes on.

    Args:
        player: whose display it is; it is also the name of the node, so that a player has one display.
        mailbox: the node's own mailbox. keys: the keys of the match.
        team: the player's team. robot: the description of its robot.
        start: where the robot began, in the map's frame. ground: where it can stand.
        sizes: the length and width of all robots, m, by name.
        physical: the names of the players whose robots are physical ones.
        size: the size of the window, pixels.

    Attributes:
        desk: what the person wants. pads: the gamepads and the keyboard.

    Raises:
        LaunchError: at the first tick, there is no display.
    """

    kind: ClassVar[str] = "hud"

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
        physical: frozenset[str] = frozenset(),
        size: tuple[int, int] = (1280, 720),
        period: float = FRAME,
    ) -> None:
        super().__init__(player, mailbox, period)
        self._title = f"VRG: {keys.match}, {player}"
        self._size = size
        self._robot = robot
        self._physical = physical
        self._pictures = keys.camera_request(player)
        self._inlets = SceneInlets(mailbox, keys, poses=False, players=[player])
        self._receiver = Receiver(mailbox, keys, player, team, robot)
        self._builder = SceneBuilder(sizes=sizes, obstacles=ground.walls)
        self._velocities = VelocityEstimator()
        home = Goal(start.x, start.y, start.theta)
        self.desk = Desk(mailbox, keys, player, robot, ground, home)
        self.pads = Pads()
        self._asked = self._planned = -math.inf
        self._way: tuple[Vector, ...] = ()
        self._seen = Telemetry()
        self._board = Dashboard(player)
        self._painter: HudPainter | None = None
        self._shown: tuple[Layout, View] | None = None
        self._pace = Pace(FRAME)
        self._closed = False

    @property
    def board(self) -> Dashboard:
        """What the window showed last."""
        return self._board

    @property
    def scene(self) -> Scene:
        """The field that the window showed last."""
        return self._board.scene

    @property
    def shown(self) -> tuple[Layout, View] | None:
        """Where everything was in the window last; None before the first frame."""
        return self._shown

    @property
    def closed(self) -> bool:
        """Whether the user has closed the window: the node need not be ticked any more."""
        return self._closed

    def tick(self, tick: Tick) -> None:
        """Take in messages and events, publish what the person wants, and draw at most one frame."""
        if self._closed:
            return
        if self._painter is None:
            self._open()
        self._look(tick)
        asked = self._handle_events()
        if self._closed:
            return
        self.desk.obey(self._seen)
        if tick.live:
            self.desk.send(self._seen, self.pads.hands)
            self._ask_for_pictures(tick.time)
        if self._pace.due(tick, self._board.scene.rate) or asked:
            self._draw(tick)

    def stop(self) -> None:
        """Give the robot back and close the window. Calling it again does nothing."""
        self._close()

    def _open(self) -> None:
        self.pads.start()
        open_window(self._title, self._size)
        pygame.key.set_repeat(400, 40)
        self._painter = HudPainter()

    def _close(self) -> None:
        if not self._closed:
            self._closed = True
            self.desk.release()
        if self._painter is not None:
            self._painter = None
            self.pads.stop()
            pygame.display.quit()

    def _look(self, tick: Tick) -> None:
        """Take in what the player knows: of the others only what it is told."""
        self._inlets.feed(self._builder)
        seen = self._seen = self._receiver.look(tick)
        others: list[Other] = []
        bodies = [] if seen.pose is None else [_body(self.name, seen.pose, seen.speed or 0.0, self._physical)]
        if seen.state is not None:
            told = {p.name: p for p in seen.state.players if p.pose is not None and p.name != self.name}
            places = {name: (p.pose.x, p.pose.y) for name, p in told.items() if p.pose is not None}
            self._velocities.update(tick.time - (seen.referee_age or 0.0), places)
            known = self._velocities.velocities
            others = [Other(n, at, known.get(n, (0.0, 0.0)), told[n].radius) for n, at in places.items()]
            bodies += [_body(n, p.pose, 0.0, self._physical) for n, p in told.items() if p.pose is not None]
        self.desk.see(others)
        self._builder.poses(Poses(bodies=tuple(bodies)), tick.time)

    def _ask_for_pictures(self, now: float) -> None:
        if self._robot.sensor(CameraSpec) is not None and not 0.0 <= now - self._asked < ASK:
            self._asked = now
            self.mailbox.publish(self._pictures, CameraRequest(lease=PICTURES))

    def _handle_events(self) -> bool:
        """Handle the events, and return whether anything happened that should be seen at once."""
        some = False
        for event in pygame.event.get():
            some = True
            match event.type:
                case pygame.KEYDOWN:
                    self._key(event)
                case pygame.MOUSEBUTTONDOWN if event.button == 1:
                    self._click(*event.pos)
                case _:
                    self._act(self.pads.take(event))
            if self._closed:
                return False
        return some

    def _key(self, event: pygame.event.Event) -> None:
        if self.desk.form.focus is None:
            self.pads.take(event)
            asked = KEYS.get(event.key)
            if asked is not None:
                self._do(asked, shift=bool(event.mod & pygame.KMOD_SHIFT))
            return
        press = TYPING.get(event.key)
        if press is not None:
            self._do(press, shift=bool(event.mod & pygame.KMOD_SHIFT))
        elif getattr(event, "unicode", "").isprintable() and getattr(event, "unicode", ""):
            self.desk.type(event.unicode)

    def _act(self, act: Act | None) -> None:
        if act is Act.LOST:
            log.warning("the gamepad is lost: %s is given back", self.name)
            self.desk.lose_pad()
        elif act in ARROWS and self._shown is not None:
            right, down = ARROWS[act]
            dx, dy = (down, right) if self._shown[1].turned else (right, -down)
            self.desk.nudge(dx * NUDGE, dy * NUDGE, self._seen)
        elif act is not None and act in PAD:
            self._do(PAD[act])

    def _do(self, asked: Wish | Press, *, shift: bool = False) -> None:
        desk = self.desk
        match asked:
            case Press.STOP:
                desk.stop_all()
            case Press.SET:
                desk.confirm()
            case Press.LEAVE if desk.form.focus is not None:
                desk.form.leave()
            case Press.LEAVE:
                desk.release()
            case Press.NEXT:
                desk.form.step(-1 if shift else 1)
            case Press.ERASE:
                desk.form.erase()
            case Press.SCREEN:
                toggle_whole_screen()
            case Press.CLOSE:
                self._close()
            case Wish():
                desk.want(asked, self._seen)

    def _click(self, x: int, y: int) -> None:
        if self._shown is None:
            return
        places, view = self._shown
        button, field = places.button_at(x, y), places.field_at(x, y)
        if button == STOP:
            self.desk.stop_all()
        elif button == SET:
            self.desk.confirm()
        elif isinstance(button, Wish):
            self.desk.want(button, self._seen)
        elif field is not None:
            self.desk.form.enter(field)
        elif places.map_area.collidepoint(x, y):
            self.desk.aim(*view.place(x, y))

    def _plan(self, now: float) -> tuple[Vector, ...]:
        if self.desk.wish not in (Wish.GOTO, Wish.RESET):
            self._planned = -math.inf
            return ()
        if not 0.0 <= now - self._planned < PLAN:
            self._planned, self._way = now, tuple(self.desk.way(self._seen))
        return self._way

    def _draw(self, tick: Tick) -> None:
        window = pygame.display.get_surface()
        if window is None or self._painter is None:
            return
        seen, desk = self._seen, self.desk
        report = None if seen.report is None else seen.report.body
        self._board = Dashboard(
            player=self.name,
            scene=self._builder.build(tick.live),
            seen=seen,
            wish=desk.wish,
            mode=desk.where if desk.wish is not Wish.WATCH else "" if report is None else report.mode,
            holder=desk.holder(seen),
            hindrance=desk.hindrance(seen),
            goal=desk.goal,
            home=desk.home,
            way=self._plan(tick.time),
            texts=tuple(desk.form.texts),
            focus=desk.form.focus,
            notice=desk.notice,
            pad=self.pads.status,
            pad_ready=self.pads.active is not None,
        )
        self._shown = self._painter.draw(window, self._board)
        pygame.display.flip()


def _body(name: str, pose: Pose, v: float, physical: frozenset[str]) -> Body:
    return Body(name=name, pose=pose, twist=Twist(v, 0.0), physical=name in physical)
