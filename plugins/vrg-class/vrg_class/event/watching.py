"""Watches the match on the field as a viewer of its page does."""

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec
from aiohttp import ClientError, ClientSession, WSMsgType
from msgspec import Struct

from vrg.ui.web.admission import Admission
from vrg_class.event.course import Live

LOOPBACK: Final = "127.0.0.1"
LARGEST: Final = 4_000_000
"""The bytes of a message of a match's page."""
_RETRY: Final = 0.3
"""The real time in s between two attempts to reach the page."""
_SILENT: Final = 6.0
"""The real time in s after which a page that says nothing is left."""


class _Part(Struct, frozen=True):
    """A part of what a page shows; see `vrg.ui.web.parts`."""

    t: str
    stage: str | None = None
    chips: list[Mapping[str, str]] = []
    scores: list[Mapping[str, Any]] = []
    waiting: list[str] = []
    halted: bool = False
    clock: str = ""


_DECODER: Final = msgspec.json.Decoder(list[_Part])


def taken(live: Live, text: str) -> Live:
    """What is known of a match after a message of its page.

    Raises:
        ValueError: it is no such message.
    """
    for part in _DECODER.decode(text):
        if part.t == "state":
            live = Live(
                part.stage, part.chips[0]["words"] if part.chips else "", live.clock,
                tuple((str(one["team"]), int(one["points"])) for one in part.scores), tuple(part.waiting), part.halted,
            )  # fmt: skip
        elif part.t == "frame":
            live = msgspec.structs.replace(live, clock=part.clock)
    return live


async def watch(session: ClientSession, page: Admission, hear: Callable[[Live | None], None]) -> None:
    """Tell what a page on loopback shows, until this is cancelled; None while it does not answer."""
    hello = msgspec.json.encode({"t": "hello", "token": page.official}).decode()  # spectators cannot take its place
    while True:
        try:
            async with asyncio.timeout(_SILENT):
                socket = await session.ws_connect(f"http://{LOOPBACK}:{page.port}/socket", max_msg_size=LARGEST)
            async with socket:
                await socket.send_str(hello)
                live, heard = Live(), 0
                while (message := await socket.receive(_SILENT)).type is WSMsgType.TEXT:
                    live, heard = taken(live, message.data), heard + 1
                    hear(live)
                    if heard % 3 == 0:
                        await socket.send_str(f'{{"t":"ack","count":{heard}}}')
        except (ClientError, OSError, TimeoutError, ValueError, LookupError, TypeError):
            pass  # it is not there yet, or no more
        hear(None)
        await asyncio.sleep(_RETRY)
