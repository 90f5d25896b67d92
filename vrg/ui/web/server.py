"""The server of a match's page: WebSockets beside the files of a site.

The node of the match never waits for it: it hands over what there is to see, and takes what people have asked for. Each
viewer has a task that sends it the newest state; one that does not keep up gets fewer frames, and holds up no other.
"""

import asyncio
import logging
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from aiohttp import WSCloseCode, WSMessage, WSMsgType, web

from vrg.bus.mailbox import is_power_of_ten
from vrg.ui.driving import DEAD_ZONE, SILENCE, SLOW
from vrg.ui.web.admission import Admission, VisitorKind, VisitorRole
from vrg.ui.web.drawers import Drawer
from vrg.ui.web.gallery import PRIVATE, Delivered, Gallery
from vrg.ui.web.lobby import Allowance, Lobby, Refused
from vrg.ui.web.parts import encode, welcome
from vrg.ui.web.requests import (
    REQUEST_LIMIT,
    Ack,
    ButtonPress,
    DriveRequest,
    GiveBack,
    Hello,
    Inspect,
    PageDrive,
    Pressed,
    Request,
    Wishes,
    read_request,
    refusal,
)
from vrg.ui.web.site import PAGE_TIMEOUT, Site

log = logging.getLogger(__name__)

IN_FLIGHT: Final = 10
"""The limit of batches that a viewer has not shown yet. One that is slower gets no more until it has."""
PING: Final = 10.0
"""The real time in s between two signs of life that are asked of a browser."""
WRONG_TOKEN_DELAY: Final = 0.5
"""The real time in s that a wrong token's answer takes."""
DECISIONS_LIMIT: Final = 50
"""The limit of decisions that wait for the match."""
DRIVING: Final = {"zone": DEAD_ZONE, "slow": SLOW, "deadman": 5, "turbo": 4, "silence": SILENCE}
"""The rules of driving for the page; its buttons are those of the browsers' standard gamepad, as in `vrg.ui.acts`."""


@dataclass(eq=False)
class _Guest:
    """One connection; `inspects` is what its drawer shows, and None while none is open."""

    number: int
    socket: web.WebSocketResponse
    news: asyncio.Event = field(default_factory=asyncio.Event)
    seen: Delivered = field(default_factory=Delivered)
    notices: list[str] = field(default_factory=list)
    allowance: Allowance = field(default_factory=Allowance)
    sent: int = 0
    shown: int = 0
    refused: int = 0
    inspects: Inspect | None = None
    dismissed: bool = False
    ended: WSCloseCode | None = None

    def tell(self, notice: Mapping[str, object]) -> None:
        """Send it a message of its own with the next batch."""
        if len(self.notices) < 20:
            self.notices.append(encode(notice))
        self.news.set()

    def unseen(self, gallery: Gallery) -> str:
        """The news for it, which are then no longer new."""
        news, self.seen = gallery.since(self.seen, None if self.inspects is None else f"{PRIVATE}{self.inspects.part}")
        return news


class WebServer(Site):
    """Serves the page of a match. Its methods are for the thread of the node, and none of them waits.

    Args:
        admission: where it is served, and who may do what. match: the name of the match.
        drawers: what officials may open beside it, by name.
    """

    def __init__(self, admission: Admission, match: str, drawers: Mapping[str, Drawer] = MappingProxyType({})) -> None:
        super().__init__(admission.host, admission.port, "index.html", admission.certificate, admission.private_key)
        self._admission, self._match, self._drawers = admission, match, drawers
        self._lobby = Lobby(admission)
        self._gallery = Gallery()
        self._guests: dict[int, _Guest] = {}
        self._numbers = 0
        self._lock = threading.Lock()
        self._commands: dict[str, PageDrive] = {}
        self._given_back: dict[str, None] = {}
        self._decisions: list[ButtonPress] = []
        self._refused = 0
        self._inspected: frozenset[Inspect] = frozenset()

    @property
    def inspected(self) -> frozenset[Inspect]:
        """What open drawers show."""
        return self._inspected

    @property
    def watched(self) -> bool:
        """True if anybody looks at the page."""
        return bool(self._guests)

    def show(self, parts: Mapping[str, str], calls: Sequence[str] = ()) -> None:
        """Show these parts and calls, which are texts of JSON, from now on."""
        if self._loop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._put, parts, calls)

    def tell(self, guest: int, text: str, *, released: bool = False) -> None:
        """Answer one connection; `released` is True if it does not drive its player, and must let go before it can."""
        if self._loop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._tell, guest, {"t": "notice", "text": text, "released": released})

    def wishes(self) -> Wishes:
        """Return the requests since this was last called."""
        with self._lock:
            wishes = Wishes(tuple(self._commands.values()), tuple(self._given_back), tuple(self._decisions))
            self._commands, self._given_back, self._decisions = {}, {}, []
        return wishes

    def _put(self, parts: Mapping[str, str], calls: Sequence[str]) -> None:
        self._gallery.put(parts, calls)
        self._gallery.forget({one.part for one in self._inspected})
        for guest in self._guests.values():
            guest.news.set()

    def _tell(self, number: int, notice: Mapping[str, object]) -> None:
        guest = self._guests.get(number)
        if guest is not None:
            guest.tell(notice)

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what pages talk to."""
        router.add_get("/socket", self._talk)
        for name, drawer in self._drawers.items():
            self.add_files(router, drawer.folder, f"/drawers/{name}/")

    async def dismiss(self) -> None:
        """Send everybody the last picture, and that it is the last."""
        await asyncio.gather(*(self._dismiss(guest) for guest in self._guests.values()), return_exceptions=True)

    async def _dismiss(self, guest: _Guest) -> None:
        """Send a guest the last picture, say that it is the last, and close the connection."""
        news = guest.unseen(self._gallery)
        async with asyncio.timeout(1.0):
            await guest.socket.send_str(f"[{','.join(filter(None, (news, encode({'t': 'bye'}))))}]")
            await guest.socket.close(code=WSCloseCode.GOING_AWAY)

    async def _talk(self, request: web.Request) -> web.StreamResponse:
        if (refused := self.turned_away(request)) is not None:
            return refused
        talk = web.WebSocketResponse(
            heartbeat=PING, max_msg_size=REQUEST_LIMIT, compress=False, timeout=1.0, autoping=False
        )
        try:
            await talk.prepare(request)
            guest = await self._admit(talk, request.remote or "")
            if guest is not None:
                self.let_in(request)
                await self._serve_guest(guest)
        except (ConnectionError, TimeoutError):
            pass  # the browser is gone, and forgotten already
        return talk

    async def _admit(self, talk: web.WebSocketResponse, address: str) -> _Guest | None:
        """Hear who a browser is, and let it in; None if it is not let in."""
        message = await talk.receive(PAGE_TIMEOUT)
        try:
            hello = read_request(message.data) if message.type is WSMsgType.TEXT else None
        except ValueError as error:
            await self._turn_away(talk, str(error), "request")
            return None
        if not isinstance(hello, Hello):
            if not talk.closed:
                await self._turn_away(talk, "expected the page's token first", "request")
            return None
        self._numbers += 1
        guest = _Guest(self._numbers, talk)
        found = self._lobby.admit(guest.number, hello, address)
        if isinstance(found, Refused):
            if found.reason == "token":
                if is_power_of_ten(self._lobby.wrong_tokens):
                    log.warning("refused a wrong token (number %d)", self._lobby.wrong_tokens)
                await asyncio.sleep(WRONG_TOKEN_DELAY)
            await self._turn_away(talk, found.why, found.reason)
            return None
        if found.displaced is not None and (other := self._guests.get(found.displaced)) is not None:
            self._leave_seat(found.role)
            other.tell({"t": "displaced", "player": found.role.player})
        if found.evicted is not None and (other := self._guests.get(found.evicted)) is not None:
            other.dismissed = True
            other.tell({"t": "refused", "why": self._lobby.full, "reason": "full"})
        log.info("%s has joined", found.role.words)
        # Every guest in the dictionary is also in the lobby.
        self._guests[guest.number] = guest
        drawers = self._drawers if found.role.kind is VisitorKind.OFFICIAL else {}
        guest.tell(
            welcome(self._match, found.role.kind, found.role.player, {name: one.title for name, one in drawers.items()})
            | {"driving": DRIVING}
        )
        return guest

    @staticmethod
    async def _turn_away(talk: web.WebSocketResponse, why: str, reason: str) -> None:
        await talk.send_str(encode([{"t": "refused", "why": why, "reason": reason}]))
        await talk.close(code=WSCloseCode.POLICY_VIOLATION)

    async def _serve_guest(self, guest: _Guest) -> None:
        sending, reading = asyncio.create_task(self._send(guest)), asyncio.create_task(self._read(guest))
        try:
            await asyncio.wait({sending, reading}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            sending.cancel()
            reading.cancel()
            # While one task reads, another one cannot wait for the answer to the end of a connection.
            for failure in await asyncio.gather(sending, reading, return_exceptions=True):
                if isinstance(failure, Exception):
                    log.error("a page's connection has failed", exc_info=failure)
            self._guests.pop(guest.number, None)
            self._look_at_drawers()
            role = self._lobby.leave(guest.number)
            if role is not None:
                self._leave_seat(role)
                log.info("%s has left", role.words)
        if guest.ended is not None:
            await guest.socket.close(code=guest.ended)

    async def _read(self, guest: _Guest) -> None:
        """Take in what a guest asks for, until its connection ends or has to end."""
        async for message in guest.socket:
            if not self._hear(guest, message):
                guest.tell({"t": "notice", "text": "This page talks too fast: the connection is closed."})
                await asyncio.sleep(0.1)
                guest.ended = WSCloseCode.POLICY_VIOLATION
                return
            if message.type is WSMsgType.PING:
                await guest.socket.pong(message.data)

    async def _send(self, guest: _Guest) -> None:
        """Send a guest what is new to it, until its connection has to end."""
        while True:
            await guest.news.wait()
            guest.news.clear()
            if guest.sent - guest.shown >= IN_FLIGHT and not guest.notices:
                continue
            news = guest.unseen(self._gallery)
            texts = [*guest.notices, news] if news else guest.notices
            guest.notices = []
            if texts:
                guest.sent += 1
                try:
                    async with asyncio.timeout(PAGE_TIMEOUT):
                        await guest.socket.send_str(f"[{','.join(texts)}]")
                except (ConnectionError, TimeoutError):
                    guest.ended = WSCloseCode.TRY_AGAIN_LATER
                    return
            if guest.dismissed:
                guest.ended = WSCloseCode.POLICY_VIOLATION
                return

    def _hear(self, guest: _Guest, message: WSMessage) -> bool:
        """Take a request in, and answer one that is wrong or not allowed; return False if the guest talks too fast."""
        if self._loop is None or not guest.allowance.spend(self._loop.time()):
            return False
        if guest.dismissed or message.type in (WSMsgType.PING, WSMsgType.PONG):
            return True
        try:
            if message.type is not WSMsgType.TEXT:
                raise ValueError("expected a request in JSON, got bytes")
            request = read_request(message.data)
        except ValueError as error:
            guest.tell({"t": "notice", "text": str(error)})
            return True
        role = self._lobby.roles[guest.number]
        if why := refusal(role, request):
            self._refused += 1
            guest.refused += 1
            if is_power_of_ten(guest.refused):
                what = request.what if isinstance(request, Pressed) else request.__struct_config__.tag
                log.warning("%s, connection %d, wanted to %s: refused", role.words, guest.number, what)
            guest.tell({"t": "notice", "text": f"Refused: {why}."})
        else:
            self._grant(guest, role, request)
        return True

    def _grant(self, guest: _Guest, role: VisitorRole, request: Request) -> None:
        match request:
            case Ack(count=count):
                guest.shown = max(guest.shown, min(count, guest.sent))
                guest.news.set()
            case DriveRequest(forward=forward, turn=turn):
                with self._lock:
                    self._commands[role.player] = PageDrive(guest.number, role.player, forward, turn)
            case GiveBack():
                self._leave_seat(role)
            case Inspect(drawer=drawer):
                guest.inspects = request if drawer else None
                self._look_at_drawers()
                guest.news.set()
            case Pressed(what=what, player=player):
                with self._lock:
                    waiting = len(self._decisions)
                    if waiting < DECISIONS_LIMIT:
                        self._decisions.append(ButtonPress(guest.number, role.words, what, player))
                if waiting >= DECISIONS_LIMIT:
                    guest.tell({"t": "notice", "text": "The match has not handled the last request yet: wait."})
            case Hello():
                guest.tell({"t": "notice", "text": "This page has sent its token already."})

    def _look_at_drawers(self) -> None:
        self._inspected = frozenset(g.inspects for g in self._guests.values() if g.inspects is not None)
        self._gallery.forget({one.part for one in self._inspected})

    def _leave_seat(self, role: VisitorRole) -> None:
        if role.kind is VisitorKind.SEAT:
            with self._lock:
                self._commands.pop(role.player, None)
                self._given_back[role.player] = None
