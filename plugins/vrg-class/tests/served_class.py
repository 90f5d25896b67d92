"""A class whose pages are served within the process of a test."""

import asyncio
import json
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import aiohttp
import pytest

from vrg.launch.endpoints import free_port
from vrg.launch.sandbox.seal import missing
from vrg.ui.web.admission import Admission
from vrg_class.folder import ClassFolder
from vrg_class.league import ClassLeague
from vrg_class.lesson import lesson_of
from vrg_class.links import Served
from vrg_class.server import ClassSite
from vrg_class.tries import Tries

T = TypeVar("T")
PATIENCE = 60.0
"""The real time in s for what a test waits for."""
GOOD = "from vrg.agents import *\n\n\nclass Mine(Strategy):\n    def act(self, view):\n        return Twist(0.7, 0.0)\n"
"""Code that reaches the goal of the first step."""
SEALED = pytest.mark.skipif(missing() is not None, reason="this machine cannot seal")


@dataclass
class Class:
    """A class that is served. Its requests are those of a page."""

    folder: ClassFolder
    port: int
    site: ClassSite

    @property
    def at(self) -> str:
        """The address of the page."""
        return f"http://127.0.0.1:{self.port}"

    def run(self, work: Callable[[aiohttp.ClientSession], Awaitable[T]]) -> T:
        """Do something with a session."""

        async def done() -> T:
            async with aiohttp.ClientSession() as session:
                return await asyncio.wait_for(work(session), PATIENCE)

        return asyncio.run(done())

    def ask(self, path: str, token: str, **body: Any) -> tuple[int, Any]:
        """Post a request: its status, and the answer."""

        async def asked(session: aiohttp.ClientSession) -> tuple[int, Any]:
            return await post(session, self.at + path, token, body)

        return self.run(asked)

    def get(self, path: str) -> tuple[int, str]:
        """Get a page: its status, and its text."""

        async def got(session: aiohttp.ClientSession) -> tuple[int, str]:
            async with session.get(self.at + path) as response:
                return response.status, await response.text()

        return self.run(got)

    def base(self, token: str) -> str:
        """The revision of the newest code of a student."""
        return str(self.ask("/me", token)[1]["revision"])

    def send(self, path: str, token: str, code: str, **body: Any) -> tuple[int, Any]:
        """Post code that was made from the newest one: the status, and the answer."""
        return self.ask(path, token, code=code, base=self.base(token), **body)

    def join(self, name: str, word: str = "") -> str:
        """Let a student join; the token."""
        status, found = self.ask("/join", self.folder.about.joining, name=name, word=word)
        assert status == 200, found
        return str(found["token"])

    def tried(self, token: str, code: str, step: str = "01-drive", against: int = 0) -> list[dict[str, Any]]:
        """Try a code, and wait for its end; what the page gets of it."""

        base = self.base(token)

        async def work(session: aiohttp.ClientSession) -> list[dict[str, Any]]:
            async with session.ws_connect(f"{self.at}/feed") as feed:
                await feed.send_str(token)
                while True:  # until the server allows another try
                    body = {"code": code, "base": base, "step": step, "against": against}
                    status, answer = await post(session, f"{self.at}/try", token, body)
                    if status == 200:
                        break
                    assert "haste" in answer, answer
                    await asyncio.sleep(0.1)
                found: list[dict[str, Any]] = []
                async for message in feed:
                    for one in json.loads(message.data):
                        if one["t"] == "begin":
                            found = [] if one["version"] == answer["version"] else found
                        found.append(one)
                        if one["t"] == "end" and found[0]["t"] == "begin":
                            return found
                raise AssertionError(f"the feed has ended: {feed.close_code}")

        return self.run(work)


async def post(session: aiohttp.ClientSession, url: str, token: str, body: Any) -> tuple[int, Any]:
    """Post JSON: the status, and the answer."""
    async with session.post(url, headers={"Authorization": f"Bearer {token}"}, json=body) as response:
        text = await response.text()
        return response.status, json.loads(text) if response.status == 200 else text


def serve(folder: ClassFolder) -> Class:
    """Serve a class; its site is to be stopped."""
    port = free_port("127.0.0.1", 18600, tries=200)
    about = folder.about
    sealed = missing() is None
    site = ClassSite(
        Served(Admission("127.0.0.1", port)), folder, lesson_of(Path(about.lesson)) if about.lesson else [],
        lambda: Tries(2, about.game, "planar", sealed=sealed), ClassLeague(folder, about.match),
    )  # fmt: skip
    site.start()
    return Class(folder, port, site)


def kinds(found: list[dict[str, object]], kind: str) -> list[dict[str, object]]:
    """The messages of a kind."""
    return [one for one in found if one["t"] == kind]


def wait_until(condition: Callable[[], bool], what: str) -> None:
    """Wait for a condition."""
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until, f"waited for {what}"
        threading.Event().wait(0.05)
