"""What the pages of a class and of an event have in common: answers and refusals as data, and codes to scan."""

import asyncio
import io
import time
from collections.abc import Callable, Collection
from importlib.resources import files
from typing import Any, Final, TypeVar

import msgspec
import segno
from aiohttp import web
from msgspec import Struct

from vrg.ui.web.lobby import Allowance
from vrg.ui.web.parts import encode
from vrg.ui.web.site import Site
from vrg_class.folder import CODE_SIZE
from vrg_class.languages import preferred, words
from vrg_class.links import Served

LINK_SIZE: Final = 300
"""The number of letters of a link of which a QR code is made."""
PICTURES_AT_ONCE: Final = 5
PICTURES_PER_SECOND: Final = 4.0
"""How fast new pictures of links are made, for all who ask."""
PICTURES: Final = 1000
"""The number of pictures of links that are kept."""
T = TypeVar("T", bound=Struct)


class RefusalError(Exception):
    """A request that is not granted. The page has the words.

    Args:
        why: the reason, one word of the pages' files of words. status: of the answer, by HTTP.
        found: what is reported of it.
    """

    def __init__(self, why: str, status: int = 400, **found: Any) -> None:
        super().__init__(why)
        self.status, self.found = status, {"why": why, **found}


class DaySite(Site):
    """Serves the pages of a day with people.

    Args:
        at: where. page: the file that is served at the top.
    """

    def __init__(self, at: Served, page: str) -> None:
        own, served = files("vrg_class") / "static", at.page
        super().__init__(served.host, served.port, page, served.certificate, served.private_key, own=own, named=at.name)
        self._pictures: dict[str, str] = {}
        self._drawing = Allowance(PICTURES_AT_ONCE, PICTURES_PER_SECOND)

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what all pages ask for."""
        router.add_post("/qr", self.told(self._qr))
        router.add_get("/words.json", self.told(self._words))

    def told(self, answer: Callable[[web.Request], Any]) -> Callable[[web.Request], Any]:
        """What answers with JSON, or with a reason why not."""

        async def handler(request: web.Request) -> web.Response:
            if (refused := self.turned_away(request)) is not None:
                return refused
            try:
                found, status = await answer(request), 200
            except RefusalError as refusal:
                found, status = refusal.found, refusal.status
            except OSError as error:
                found, status = {"why": "disk", "words": error.strerror or str(error)}, 507
            return web.Response(text=encode(found), status=status, content_type="application/json")

        return handler

    async def _words(self, request: web.Request) -> Any:
        tag = language_of(request, words())
        return {"tag": tag, **words()[tag]}

    async def _qr(self, request: web.Request) -> Any:
        """The picture of a link. The link is no part of the address, so that its token is in no log."""
        text = (await read(request, Link)).text[:LINK_SIZE]
        if text not in self._pictures:
            # Making one takes long, so that whoever asks for ever new ones could hold up all others.
            if not self._drawing.spend(time.monotonic()):
                raise RefusalError("haste")
            if len(self._pictures) >= PICTURES:
                del self._pictures[next(iter(self._pictures))]
            self._pictures[text] = await asyncio.to_thread(_picture, text)
        return {"svg": self._pictures[text]}


def language_of(request: web.Request, known: Collection[str]) -> str:
    """The language of a browser among those that there are."""
    return preferred(request.headers.get("Accept-Language", ""), known)


class Link(Struct, frozen=True):
    """A link to be shown as a picture that telephones read."""

    text: str


async def read(request: web.Request, kind: type[T]) -> T:
    """What a request asks for.

    Raises:
        RefusalError: it is none of this kind.
    """
    try:
        return msgspec.json.decode(await request.read(), type=kind)
    except web.HTTPRequestEntityTooLarge as error:
        raise RefusalError("long", 413, most=CODE_SIZE) from error
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RefusalError("request", words=f"expected {kind.__name__}: {error}") from None


def _picture(text: str) -> str:
    found = io.BytesIO()
    segno.make(text or "-", error="m").save(
        found, kind="svg", scale=8, border=2, dark="#000", light="#fff", xmldecl=False, svgns=True, omitsize=True
    )
    return found.getvalue().decode()
