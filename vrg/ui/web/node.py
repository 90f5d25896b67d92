"""The page as a node of the match: it shows the match to browsers, and publishes what people there want."""

import contextlib
import itertools
import logging
import secrets
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import ClassVar, Final, Protocol

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call, Estop, EstopRelease, Official, OfficialAction
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.hal.models import RobotModel
from vrg.regions import Region
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.driving import TAKEN, Driving
from vrg.ui.pace import Pace
from vrg.ui.scene import Scene
from vrg.ui.web import parts
from vrg.ui.web.drawers import Content
from vrg.ui.web.gallery import PRIVATE
from vrg.ui.web.requests import ButtonPress, Inspect, PageButton, PageDrive, Wishes

log = logging.getLogger(__name__)

FRAME: Final = 1 / 25
"""The real time in s between two frames. The page draws what lies between them. It is a whole number of world ticks."""
LET_GO: Final = "You do not drive {} now: release the controls once, and then drive again."
ANSWERS_AWAITED: Final = 200
"""The limit of decisions that are remembered until the referee answers them."""
DRAWN_EVERY: Final = 15
"""The drawers' contents are made with every so many frames, and at once for a newly selected player."""
LISTENING: Final = 3
"""The frames between the first drawer that is opened and what it shows: until then little has been heard."""
NO_OFFICIAL: Final = "This page has no official's seat: it may stop everything, but not decide."
NO_PLAYER: Final = "Select a player first."
_OFFICIAL: Final = {
    PageButton.HALT: OfficialAction.HALT,
    PageButton.RESUME: OfficialAction.RESUME,
    PageButton.RECOVER: OfficialAction.RECOVER,
    PageButton.END: OfficialAction.END,
    PageButton.DISQUALIFY: OfficialAction.DISQUALIFY,
    PageButton.REINSTATE: OfficialAction.REINSTATE,
}
_ON_PLAYER: Final = (PageButton.DISQUALIFY, PageButton.REINSTATE)


class Audience(Protocol):
    """Those who look at the page, as the node sees them. None of these methods waits; see `vrg.ui.web.server`."""

    @property
    def watched(self) -> bool:
        """True if anybody looks."""

    @property
    def inspected(self) -> frozenset[Inspect]:
        """What the drawers show that officials have open."""

    def start(self) -> None:
        """Let them in."""

    def stop(self) -> None:
        """Send them away."""

    def check(self) -> None:
        """Raise LaunchError if no viewer can come any more."""

    def show(self, parts: Mapping[str, str], calls: Sequence[str] = ()) -> None:
        """Show these parts and calls, texts of JSON, from now on."""

    def tell(self, guest: int, text: str, *, released: bool = False) -> None:
        """Answer one of them; `released` is True if it does not drive its player, and must let go before it can."""

    def wishes(self) -> Wishes:
        """Return the requests since this was last called."""


class WebNode(Node):
    """Shows the match to an audience. Closing a page ends nothing, and gives back the player that was driven there.

    Args:
        audience: those who look at the page.
        robots: the models of the players' robots, by name.
        obstacles: the ground that the map's walls and obstacles cover, m.
        drawers: what officials may open beside the match, by name.
        official: whether the page has an official's seat.
    """

    kind: ClassVar[str] = "spectator"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        audience: Audience,
        *,
        robots: Mapping[str, RobotModel] = MappingProxyType({}),
        obstacles: Sequence[Region] = (),
        drawers: Mapping[str, Content] = MappingProxyType({}),
        official: bool = True,
        period: float = FRAME,
    ) -> None:
        super().__init__(name, mailbox, period)
        self._official = official
        self._drawers = dict(drawers)
        self._inspected: frozenset[Inspect] = frozenset()
        self._frames = 0
        self._keys = keys
        self._audience = audience
        self._inlets = SceneInlets(mailbox, keys)
        self._builder = SceneBuilder(sizes={name: robot.size for name, robot in robots.items()}, obstacles=obstacles)
        self._scene = Scene()
        self._kept: dict[str, tuple[object, str]] = {}
        self._pace = Pace(FRAME)
        # Another page of this match, also on another machine, gets answers of its own.
        self._own = secrets.token_hex(4)
        self._numbers = itertools.count(1)
        self._asked: dict[str, int] = {}
        self._driven: dict[str, Driving] = {}
        self._held: dict[str, int] = {}
        """The players whose drivers must let go once, each with the guest that was notified; 0 while none was."""

    def start(self) -> None:
        """Open the port.

        Raises:
            LaunchError: it cannot be opened.
        """
        self._audience.start()

    def tick(self, tick: Tick) -> None:
        """Take messages and wishes in, publish what the wishes ask for, and show at most one frame.

        Raises:
            LaunchError: the page is not served any more.
        """
        self._audience.check()
        calls = self._inlets.feed(self._builder)
        for call in calls:
            self._answer(call)
        self._fulfil(self._audience.wishes(), live=tick.live)
        opened = {one.drawer for one in self._audience.inspected}
        for name, content in list(self._drawers.items()):
            with self._contained(name):
                if name in opened:
                    content.take(tick.time)
                else:
                    content.close()
        judged = [call for call in calls if call.rule != "refused"]
        if judged or (self._pace.due(tick, self._scene.rate) and self._audience.watched):
            self._scene = self._builder.build(tick.live)
            shown = {**parts.parts(self._scene, self._kept), **self._private(tick.time)}
            self._audience.show(shown, [parts.call(call, self._scene.game) for call in judged])

    def stop(self) -> None:
        """Give all driven players back and close the port. Calling it again does nothing."""
        for player in list(self._driven):
            self._give_back(player)
        if self._audience.watched:
            # Every visitor keeps the last picture.
            self._audience.show(parts.parts(self._builder.build(live=self._scene.live), self._kept))
        self._audience.stop()

    def _private(self, now: float) -> dict[str, str]:
        """What open drawers show, if it is time for it."""
        wanted, before = self._audience.inspected, self._inspected
        self._inspected, self._frames = wanted, self._frames + 1
        if wanted and not before:
            self._frames = -LISTENING
        if self._frames < 0 or (wanted == before and self._frames % DRAWN_EVERY):
            return {}
        found = {}
        for one in wanted:
            if one.drawer in self._drawers:
                with self._contained(one.drawer):
                    found[f"{PRIVATE}{one.part}"] = self._drawn(one, now)
        return found

    @contextlib.contextmanager
    def _contained(self, name: str) -> Iterator[None]:
        """Drop a drawer that fails: the page, which has the emergency stop, is served without it."""
        try:
            yield
        except Exception:  # another package may raise anything
            log.exception("the page continues without the drawer %s, which has failed", name)
            del self._drawers[name]

    def _drawn(self, wanted: Inspect, now: float) -> str:
        # A player may be selected that another match had.
        player = wanted.player if self._scene.player(wanted.player) else ""
        data = self._drawers[wanted.drawer].part(now, self._scene, player)
        return parts.encode({"t": "drawer", "drawer": wanted.drawer, "data": data})

    def _answer(self, call: Call) -> None:
        guest = self._asked.pop(call.answers, None) if call.answers is not None else None
        if guest is not None:
            self._audience.tell(guest, call.text)

    def _fulfil(self, wishes: Wishes, *, live: bool) -> None:
        for decision in wishes.decisions:
            self._decide(decision)
        for player in wishes.given_back:
            self._give_back(player)
            self._held.pop(player, None)
        # No robot drives on by itself after a stop or a silence, be it of the page, the clock or this process: its
        # driver must let go once.
        stopped = self._scene.estop or not live
        for player, driving in self._driven.items():
            if driving.player is not None and (stopped or driving.lapsed(self._scene.rate)):
                driving.give_back()
                self._held[player] = 0
        for command in wishes.commands:
            if stopped:
                self._held.setdefault(command.player, 0)
            elif not (command.forward or command.turn):
                self._held.pop(command.player, None)
            if command.player not in self._held:
                self._drive(command)
            elif self._held[command.player] != command.guest:
                # Once: on a slow connection the answer to a later command would meet hands that were free meanwhile.
                self._release(command, LET_GO)

    def _drive(self, command: PageDrive) -> None:
        player = command.player
        driving = self._driven.setdefault(player, Driving(self.mailbox, self._keys))
        status = self._scene.player(player)
        if driving.taken(player, manual=status is not None and status.manual):
            self._release(command, TAKEN)
        else:
            driving.take(player)
            driving.command((command.forward, command.turn, 0.0), self._scene.rate)

    def _release(self, command: PageDrive, words: str) -> None:
        self._held[command.player] = command.guest
        self._audience.tell(command.guest, words.format(command.player), released=True)

    def _give_back(self, player: str) -> None:
        if player in self._driven:
            self._driven[player].give_back()

    def _decide(self, decision: ButtonPress) -> None:
        log.info("%s asks for: %s", decision.by, decision.what)
        if decision.what is PageButton.ESTOP:
            self.mailbox.publish(self._keys.estop, Estop(by=decision.by))
        elif not self._official:
            self._audience.tell(decision.guest, NO_OFFICIAL)
        elif decision.what is PageButton.RELEASE:
            self.mailbox.publish(self._keys.estop_release, EstopRelease(by=decision.by))
        elif decision.what in _ON_PLAYER and self._scene.player(decision.player) is None:
            self._audience.tell(decision.guest, NO_PLAYER)
        else:
            number = f"web-{self._own}-{next(self._numbers)}"
            if len(self._asked) >= ANSWERS_AWAITED:
                self._asked.pop(next(iter(self._asked)))
            self._asked[number] = decision.guest
            subject = decision.player if decision.what in _ON_PLAYER else None
            asked = Official(action=_OFFICIAL[decision.what], by=decision.by, id=number, subject=subject)
            self.mailbox.publish(self._keys.official, asked)
