"""The commander as a node: it shows the match to one team's commander, and publishes what the commander wants."""

import logging
from collections.abc import Mapping, Sequence
from typing import ClassVar, Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Body, Call, Poses, RefereeState, shortened
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.games import game_of
from vrg.regions import Region
from vrg.types import STILL
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.commander.board import BoardPainter, Lights
from vrg.ui.commander.deck import Deck
from vrg.ui.deeds import hindrance
from vrg.ui.draw import Painter
from vrg.ui.pace import Pace
from vrg.ui.pads import FACES, PLAYERS, Act, Pads
from vrg.ui.scene import Scene
from vrg.ui.text import Fonts
from vrg.ui.window import open_window

log = logging.getLogger(__name__)

PERIOD: Final = 1 / 20
"""The match time in s between two driving commands."""
FRAME: Final = 1 / 30
"""The real time in s between two frames."""
SHORT, LONG = (0.6, 0.25), (1.0, 0.8)
"""How a gamepad shakes, strength and s, for what happens to a player, and for a score."""


class Commander(Node):
    """The window of one team's commander. Closing it gives everything back; the match goes on.

    Args:
        team: the team that is commanded; it is also the name of the node, so that a team has one commander.
        mailbox: the node's own mailbox. keys: the keys of the match.
        sizes: the length and width of the robots, m, by name.
        obstacles: the ground that the map's walls and obstacles cover, m.
        size: the size of the window, pixels.
        seated: the names of the team's players if it has the seat of the team's commander; None otherwise. With a seat
            it hears only of these, and is not told where every body truly is: it then shows the robots where the
            referee's state, or the team's limited sight, says.

    Attributes:
        deck: what the commander has chosen. pads: the gamepads and the keyboard.

    Raises:
        LaunchError: at the first tick, there is no display.
    """

    kind: ClassVar[str] = "commander"

    def __init__(
        self,
        team: str,
        mailbox: Mailbox,
        keys: Keys,
        *,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        obstacles: Sequence[Region] = (),
        size: tuple[int, int] = (1280, 720),
        period: float = PERIOD,
        seated: Sequence[str] | None = None,
    ) -> None:
        super().__init__(team, mailbox, period)
        self._title = f"VRG: {keys.match}, {team}"
        self._size = size
        self._inlets = SceneInlets(mailbox, keys, poses=seated is None, players=seated)
        self._seated = seated is not None
        self._builder = SceneBuilder(sizes=sizes, obstacles=obstacles)
        self._builder.team = team
        self._referee = mailbox.subscribe(keys.referee_state)
        self._sight = mailbox.subscribe(keys.sight(team))
        self.deck = Deck(mailbox, keys, team, by=shortened(f"commander of {team}", 64))
        self.pads = Pads()
        self._score: Mapping[str, int] = {}
        self._scene = Scene()
        self._painter: Painter | None = None
        self._board: BoardPainter | None = None
        self._pace = Pace(FRAME)
        self._closed = False

    @property
    def scene(self) -> Scene:
        """What the window showed last."""
        return self._scene

    @property
    def closed(self) -> bool:
        """Whether the user has closed the window: the node need not be ticked any more."""
        return self._closed

    def tick(self, tick: Tick) -> None:
        """Take in messages and buttons, publish what the commander wants, and draw at most one frame."""
        if self._closed:
            return
        if self._painter is None:
            self._open()
        state = self._referee.latest
        self._builder.only = self._seen(None if state is None else state.body)
        calls = self._inlets.feed(self._builder)
        if self._seated and state is not None:
            self._place(state.body, state.stamp)
        if state is not None:
            self._learn(state.body)
            self._shake(calls, state.body)
        asked = self._handle_events()
        if self._closed:
            return
        if tick.live:
            self.deck.send(self.pads.hands)
        if self._pace.due(tick, self._scene.rate) or asked:
            self._draw(tick)

    def stop(self) -> None:
        """Give everything back and close the window. Calling it again does nothing."""
        self._close()

    def _seen(self, state: RefereeState | None) -> frozenset[str] | None:
        """The players that the team sees now; None if it sees all."""
        if state is None:
            return frozenset()
        if any(player.pose is not None for player in state.players):
            return None
        sight = self._sight.latest
        own = (player.name for player in state.players if player.team == self.name)
        return frozenset(own if sight is None else sight.body.poses)

    def _place(self, state: RefereeState, stamp: float) -> None:
        """Show the robots where the team is told that they are."""
        sight = self._sight.latest
        poses = {player.name: player.pose for player in state.players if player.pose is not None}
        if not poses and sight is not None:
            poses, stamp = dict(sight.body.poses), sight.stamp
        bodies = (Body(name, pose, STILL, False) for name, pose in poses.items())
        self._builder.poses(Poses(bodies=tuple(bodies)), stamp)

    def _open(self) -> None:
        self.pads.start()
        open_window(self._title, self._size)
        fonts = Fonts()
        self._board = BoardPainter(fonts, self.deck)
        self._painter = Painter(fonts, self._board, panel_width=400)

    def _close(self) -> None:
        if not self._closed:
            self._closed = True
            self.deck.close()
        if self._painter is not None:
            self._painter = None
            self.pads.stop()
            pygame.display.quit()

    def _learn(self, state: RefereeState) -> None:
        self.deck.priorities = game_of(state.game).priorities[: len(FACES)]
        self.deck.players = [player.name for player in state.players if player.team == self.name]

    def _shake(self, calls: Sequence[Call], state: RefereeState) -> None:
        """Shake the gamepad when a team scores, and when something happens to a player of this team."""
        marked = game_of(state.game).marked
        if self._score and state.score != self._score:
            self.pads.rumble(*LONG)
        elif any(call.rule in marked and call.players and call.players[0] in self.deck.players for call in calls):
            self.pads.rumble(*SHORT)
        self._score = dict(state.score)

    def _handle_events(self) -> bool:
        """Handle the buttons, and return whether anything happened that should be seen at once."""
        seen = False
        for event in pygame.event.get():
            act = self.pads.take(event)
            if act is not None:
                self._do(act)
                seen = True
            if self._closed:
                return False
            seen |= event.type in (pygame.VIDEORESIZE, pygame.WINDOWEXPOSED)
        return seen

    def _do(self, act: Act) -> None:
        if act in FACES:
            self.deck.face(FACES.index(act))
        elif act in PLAYERS:
            self.deck.player(PLAYERS.index(act))
        elif act is Act.PAGE:
            self.deck.turn_page()
        elif act is Act.ESTOP:
            self.deck.stop_all()
        elif act is Act.LOST:
            log.warning("the gamepad is lost: %s is given back", self.deck.selected or "nobody")
            self.deck.release()
        elif act is Act.CLOSE:
            self._close()

    def _draw(self, tick: Tick) -> None:
        self._scene = self._builder.build(tick.live)
        window = pygame.display.get_surface()
        if window is None or self._painter is None or self._board is None:
            return
        self._board.limited = self._builder.only is not None
        self._board.lights = Lights(
            bus="" if tick.live else "the match clock has stopped",
            robot=self.hindrance(),
            pad=self.pads.status,
            pad_ready=self.pads.active is not None,
        )
        self._painter.draw(window, self._scene, self.deck.selected)
        pygame.display.flip()

    def hindrance(self) -> str:
        """What keeps the driven robot from moving, in words; empty if nothing does."""
        scene, selected = self._scene, self.deck.selected
        return hindrance(scene, None if selected is None else scene.player(selected))
