"""The commander as a node: it shows the match to one team's commander, and publishes what the commander wants."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Body, Call, Poses, RefereeState
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.games import game_of
from vrg.regions import Region
from vrg.types import STILL
from vrg.ui.acts import Act, Press
from vrg.ui.commander.board import BoardPainter, Lights
from vrg.ui.commander.deck import BUTTONS, Deck
from vrg.ui.deeds import NO_CLOCK, hindrance
from vrg.ui.window.draw import Painter
from vrg.ui.window.text import Fonts
from vrg.ui.window.window_node import WindowNode

SHORT, LONG = (0.6, 0.25), (1.0, 0.8)
"""The rumble of a gamepad, strength and s, for an event of a player, and for a score."""


class Commander(WindowNode):
    """The window of one team's commander. Closing it gives everything back; the match goes on.

    Args:
        team: the team that is commanded; it is also the name of the node, so that a team has one commander.
        mailbox, keys, sizes, obstacles, size, run: as for WindowNode.
        seated: the names of the team's players if it has the seat of the team's commander; None otherwise. With a seat
            it hears only of these, and does not know the true poses: it then shows the robots where the
            referee's state, or the team's limited sight, has them.

    Attributes:
        deck: what the commander has chosen.
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
        size: tuple[int, int] | None = None,
        run: Path | None = None,
        seated: Sequence[str] | None = None,
    ) -> None:
        super().__init__(
            team, mailbox, keys, f"{keys.match}, commander of {team}", sizes=sizes, obstacles=obstacles, players=seated,
            size=size, run=run, by=f"commander of {team}",
        )  # fmt: skip
        self._builder.team = team
        self.acts |= {Act.ORDER: self._order, Act.PLAYER: self._drive_player, Act.WHY: self.explain_last}
        self._seated = seated is not None
        self._referee = mailbox.subscribe(keys.referee_state)
        self._sight = mailbox.subscribe(keys.sight(team))
        self.deck = Deck(mailbox, keys, team, self.driving)
        self._score: Mapping[str, int] = {}
        fonts = Fonts()
        self._board = BoardPainter(fonts, self.deck)
        self.painter = Painter(fonts, self._board, panel_width=380, plans=True)

    @property
    def drivable(self) -> Sequence[str]:
        """The players of the team."""
        return self.deck.players

    def take_in(self, tick: Tick) -> None:
        """Take in the messages that arrived, and shake the gamepad at what matters."""
        state = self._referee.latest
        self._builder.only = self._seen(None if state is None else state.body)
        calls = self._inlets.feed(self._builder)
        if state is None:
            return
        if self._seated:
            self._place(state.body, state.stamp)
        self.deck.priorities = game_of(state.body.game).priorities[:BUTTONS]
        self.deck.players = [player.name for player in state.body.players if player.team == self.name]
        self._shake(calls, state.body)

    def steer(self, tick: Tick) -> None:
        """Publish the priority, and the command for the driven player."""
        self.deck.send()
        super().steer(tick)

    def close(self) -> None:
        """Give everything back and close the window. Calling it again does nothing."""
        if not self.closed:
            self.deck.close()
        super().close()

    def _order(self, press: Press) -> None:
        self.deck.order(press.number)

    def _drive_player(self, press: Press) -> None:
        if press.number < len(self.deck.shown):
            wanted = self.deck.shown[press.number]
            self.take(None if wanted == self.driving.player else wanted)

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
        """Show the robots at the poses that the team knows."""
        sight = self._sight.latest
        poses = {player.name: player.pose for player in state.players if player.pose is not None}
        if not poses and sight is not None:
            poses, stamp = dict(sight.body.poses), sight.stamp
        bodies = (Body(name, pose, STILL, False) for name, pose in poses.items())
        self._builder.poses(Poses(bodies=tuple(bodies)), stamp)

    def _shake(self, calls: Sequence[Call], state: RefereeState) -> None:
        """Shake the gamepad when a team scores, and when something happens to a player of this team."""
        marked = game_of(state.game).marked
        if self._score and state.score != self._score:
            self.pads.rumble(*LONG)
        elif any(call.rule in marked and call.players and call.players[0] in self.deck.players for call in calls):
            self.pads.rumble(*SHORT)
        self._score = dict(state.score)

    def draw(self, window: pygame.Surface, tick: Tick) -> None:
        """Draw the match and the commander's panel."""
        self._board.limited = self._builder.only is not None
        self._board.lights = Lights(
            bus="" if tick.live else NO_CLOCK,
            robot=self.hindrance(),
            pad=self.pads.status,
            pad_ready=self.pads.active is not None,
        )
        self.paint(window, self.deck.selected)

    def hindrance(self) -> str:
        """The reason why the driven robot cannot move, in words; empty if there is none."""
        selected = self.deck.selected
        return hindrance(self.scene, None if selected is None else self.scene.player(selected))
